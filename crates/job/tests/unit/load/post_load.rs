use crate::load::post_load::*;

/// Returns a dialect file with values changed at places, and keys taken away (`None`).
fn changed(dialect: Dialect, changes: &[(&str, &str, Option<serde_json::Value>)]) -> DialectFile {
    let mut file = serde_json::to_value(dialect.file()).unwrap();
    for (object, key, value) in changes {
        let object = file.pointer_mut(object).unwrap().as_object_mut().unwrap();
        match value {
            Some(value) => drop(object.insert((*key).to_owned(), value.clone())),
            None => drop(object.remove(*key).unwrap()),
        }
    }
    serde_json::from_value(file).unwrap()
}

/// Numbers that a shop sets for its control: no words.
fn shop_numbers() -> Vec<(&'static str, &'static str, Option<serde_json::Value>)> {
    let four = serde_json::json!({"linear": 4, "rotary": 4, "feed": 4, "inverse_time": 4});
    vec![
        ("/numbers", "max_decimals", Some(four)),
        ("/numbers", "numbered_axes", Some(false.into())),
        ("/lines", "max_length", Some(128.into())),
        ("/program", "last_number", Some(9999.into())),
        ("", "several_heads", None),
    ]
}

#[test]
fn numbers_that_a_shop_sets_make_no_file_of_another_control() {
    for dialect in Dialect::ALL {
        assert_eq!(control_of(&changed(dialect, &shop_numbers()), dialect), None, "{}", dialect.name());
    }
}

#[test]
fn words_that_a_shop_leaves_out_make_no_file_of_another_control() {
    let mut changes = shop_numbers();
    let one_law = serde_json::json!([{"law": "tip_and_rotaries_linear", "code": ""}]);
    changes.push(("/motion/rtcp", "cutting", Some(one_law)));
    changes.push(("/words", "spindles", None));
    changes.push(("/words", "end", Some(serde_json::json!(["M9", "M30"]))));
    assert_eq!(control_of(&changed(Dialect::Fanuc, &changes), Dialect::Fanuc), None);
}

#[test]
fn files_of_other_words_are_refused_under_every_other_control() {
    for from in Dialect::ALL {
        let file = changed(from, &shop_numbers());
        for own in Dialect::ALL.into_iter().filter(|own| *own != from) {
            assert_eq!(control_of(&file, own), Some(from), "{} under {}", from.name(), own.name());
        }
    }
}
