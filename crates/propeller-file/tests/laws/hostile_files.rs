//! Files that describe no propeller: each fault names file, row, column and remedy, in bounded
//! time.

use facemill_propeller_file::{read_propeller, read_propeller_with};
use facemill_test_kit::Random;

use crate::kit::{DTMB_4119, VP1304, read, refused};

#[test]
fn faults_of_values_name_row_and_column() {
    let cases = [
        ("0.4048", "nan", "own.csv, line 9, column \"c_D\": ", "no number"),
        ("0.4048", "inf", "own.csv, line 9, column \"c_D\": ", "no number"),
        ("0.4048", "1e999", "own.csv, line 9, column \"c_D\": ", "no number"),
        ("0.4048", "0.4O48", "own.csv, line 9, column \"c_D\": ", "no number"),
        ("0.4048", "0,4048", "own.csv, line 9: ", "8 values for 7"),
        ("0.4048", "-0.4", "own.csv, line 9: ", "chord c/D is -0.4"),
        ("0.4048", "0", "own.csv, line 9: ", "chord c/D is 0"),
        ("1.098", "0", "own.csv, line 9: ", "pitch P/D is 0"),
        ("0.118", "0", "own.csv, line 9: ", "thickness t/c is 0"),
        ("0.02303", "7", "own.csv, line 9: ", "camber f/c is 7"),
        ("0.4,0.4048", "0.3,0.4048", "own.csv, line 9: ", "order the rows"),
        ("0.4,0.4048", "0.2,0.4048", "own.csv, line 9: ", "order the rows"),
        ("0.2,0.32,", "0.25,0.32,", "own.csv, line 7: ", "add a row at the hub"),
        ("1.0,0,1.075", "0.97,0,1.075", "own.csv, line 16: ", "add rows up to 1"),
        ("1.0,0,1.075", "1.2,0,1.075", "own.csv, line 16: ", "between 0 and 1"),
        ("304.8", "0", "own.csv, line 1: ", "between 1 and 20000"),
        ("304.8", "three", "own.csv, line 1: ", "no number"),
        ("blades: 3", "blades: 3.5", "own.csv, line 2: ", "2 to 12"),
        ("blades: 3", "blades: 1000000000", "own.csv, line 2: ", "2 to 12"),
        ("hand: right", "hand: both", "own.csv, line 3: ", "right, left"),
        ("hub_ratio: 0.2", "hub_ratio: 0.9", "own.csv: ", "hub diameter over propeller diameter is 0.9"),
        ("naca66_a08", "naca0012", "own.csv, line 5: ", "naca66_a08, wageningen_b, offsets"),
        ("naca66_a08", "offsets", "own.csv: ", "table of sections"),
        ("naca66_a08", "wageningen_b", "own.csv, line 7, column \"f_c\": ", "is not used"),
        ("# blades: 3\n", "", "own.csv: ", "# blades"),
        ("# diameter_mm: 304.8\n", "", "own.csv: ", "# diameter_mm"),
        ("# hand: right\n", "", "own.csv: ", "# hand"),
        ("# hub_ratio: 0.2\n", "", "own.csv: ", "# hub_ratio"),
        ("# section: naca66_a08\n", "", "own.csv: ", "# section"),
        ("# blades", "# blade", "own.csv, line 2: ", "did you mean \"blades\""),
        ("# blades", "# blades: 4\n# blades", "own.csv, line 3: ", "given twice"),
        ("# hub_ratio", "# hub_diameter_mm: 4\n# hub_ratio", "own.csv, line 5: ", "given twice"),
        ("r_R,", "r_Q,", "own.csv, line 6, column \"r_Q\": ", "did you mean \"r_R\""),
        ("rake_D", "rake_ft", "own.csv, line 6, column \"rake_ft\": ", "rake"),
        ("c_D,P_D", "c_D,c_D", "own.csv, line 6, column \"c_D\": ", "there twice"),
        ("r_R,c_D,P_D,t_c,f_c,skew_deg,rake_D\n", "", "own.csv, line 6: ", "header line"),
        (
            "t_c,f_c,skew_deg",
            "t_c,phi_deg,skew_deg",
            "own.csv, line 7, column \"phi_deg\": ",
            "disagrees with column \"P_D\"",
        ),
        ("0.0316,", "0.9,", "own.csv: at r/R 0.9", "add some here"),
    ];
    for (from, to, start, remedy) in cases {
        assert!(DTMB_4119.contains(from), "{from}");
        let why = refused(&DTMB_4119.replacen(from, to, 1));
        assert!(why.starts_with(start) && why.contains(remedy), "{from} → {to}: {why}");
    }
    let why = refused(&DTMB_4119.replace(",t_c", ",t_D").replace("0.0316,", "0,"));
    assert!(why.starts_with("own.csv, line 16: ") && why.contains("thickness t/D is 0"), "{why}");
}

/// Without a value for the camber over a chord of 0 the row is named.
#[test]
fn camber_as_a_length_over_no_chord_is_refused() {
    let why = refused(&VP1304.replace("125.0;25.0", "125.0;0"));
    assert!(why.starts_with("own.csv, line 18, column \"max_camber_mm\": ") && why.contains("chord is 0"), "{why}");
}

const SECTIONS: &str = "# diameter_mm: 300\n# blades: 3\n# hand: left\n# hub_diameter_mm: 60\n\
    r_R,c_D,P_D\n0.2,0.3,1\n0.5,0.3,1\n0.8,0.3,1\n1,0.1,1\n\
    r_R,x_c,upper_c,lower_c\n";

fn sections(change: impl Fn(usize, usize, [f64; 4]) -> [f64; 4]) -> String {
    let mut text = SECTIONS.to_owned();
    for (k, radius) in [0.2, 0.5, 0.8, 1.0].into_iter().enumerate() {
        for (j, (x, y)) in [(0.0, 0.0), (0.1, 0.04), (0.4, 0.06), (0.8, 0.03), (1.0, 0.002)].into_iter().enumerate() {
            text += &format!("{}\n", change(k, j, [radius, x, y, -y]).map(|v| v.to_string()).join(","));
        }
    }
    text
}

#[test]
fn faults_of_sections_name_their_row() {
    read(&sections(|_, _, row| row)).unwrap().spec(None).unwrap();
    let changed = |at: (usize, usize), column: usize, value: f64| {
        sections(move |k, j, mut row| {
            if (k, j) == at {
                row[column] = value;
            }
            row
        })
    };
    // The first row is line 11, each section has five.
    let cases = [
        (changed((1, 2), 1, 0.5), "own.csv, line 18: ", "the same stations"),
        (changed((1, 2), 2, -0.2), "own.csv, line 18: ", "without thickness"),
        (changed((1, 2), 2, 20.0), "own.csv, line 18: ", "between -1 and 1"),
        (
            sections(|k, j, [r, x, h, l]| [r, if (k, j) == (0, 0) { 0.01 } else { x }, h, l]),
            "own.csv, line 16: ",
            "the same stations",
        ),
        (sections(|_, j, [r, x, h, l]| [r, if j == 0 { 0.01 } else { x }, h, l]), "own.csv, line 11: ", "both edges"),
        (
            sections(|_, j, [r, x, h, l]| [r, if j == 2 { 0.05 } else { x }, h, l]),
            "own.csv, line 13: ",
            "order stations by x/c",
        ),
        (sections(|k, _, [r, x, h, l]| [if k == 1 { 0.1 } else { r }, x, h, l]), "own.csv", "order the rows"),
        (
            sections(|k, _, [r, x, h, l]| [if k == 1 { 0.2 } else { r }, x, h, l]),
            "own.csv, line 16: ",
            "neither a further station",
        ),
    ];
    for (text, start, remedy) in cases {
        let why = refused(&text);
        assert!(why.starts_with(start) && why.contains(remedy), "{why}");
    }
    let shortened = sections(|_, _, row| row);
    let shortened = shortened.trim_end().rsplit_once('\n').unwrap().0;
    assert!(refused(shortened).contains("its end"), "{}", refused(shortened));
    let why = refused(&sections(|_, _, row| row).replace("upper_c,lower_c", "upper_c,lower_mm"));
    assert!(why.contains("give both alike"), "{why}");
    let why = refused(&sections(|_, _, row| row).replace("upper_c,lower_c", "upper_c,camber_c"));
    assert!(why.contains("is not used"), "{why}");
    let why = refused(&sections(|_, _, row| row).replace("c_D,P_D\n", "c_D,P_D,t_c\n"));
    assert!(why.contains("line 6: has 3 values for 4"), "{why}");
    let why = refused(SECTIONS);
    assert!(why.contains("without rows"), "{why}");
    let why = refused(&format!("{}# section: naca66_a08\n", sections(|_, _, row| row)));
    assert!(why.contains("remove one of them"), "{why}");
}

#[test]
fn faults_of_json_name_field_line_and_column() {
    let good = r#"{"format": "facemill-propeller/1", "diameter_mm": 300, "blades": 3, "hand": "left", "hub_diameter_mm": 60,
"section": "naca66_a08", "rows": [
{"r_R": 0.2, "c_D": 0.3, "P_D": 1, "t_c": 0.1, "f_c": 0.02},
{"r_R": 0.5, "c_D": 0.3, "P_D": 1, "t_c": 0.1, "f_c": 0.02},
{"r_R": 0.8, "c_D": 0.3, "P_D": 1, "t_c": 0.1, "f_c": 0.02},
{"r_R": 1.0, "c_D": 0.1, "P_D": 1, "t_c": 0.1, "f_c": 0.02}]}"#;
    let why = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        let text = good.replacen(from, to, 1);
        let file = read_propeller("own.json", text.as_bytes()).and_then(|file| file.spec(None));
        file.expect_err(to).to_string()
    };
    read_propeller("own.json", good.as_bytes()).unwrap().spec(None).unwrap();
    for (from, to, start, remedy) in [
        ("\"c_D\": 0.3", "\"cD\": 0.3", "own.json: rows[0].cD, line 3, column ", "c_D"),
        ("\"c_D\": 0.3", "\"c_D\": \"x\"", "own.json: rows[0].c_D, line 3, column ", "invalid type"),
        ("\"c_D\": 0.3", "\"c_D\": -1", "own.json, rows[0]: ", "chord c/D is -1"),
        (", \"f_c\": 0.02},\n{\"r_R\": 0.8", "},\n{\"r_R\": 0.8", "own.json, rows[1]: ", "other keys"),
        ("\"blades\": 3", "\"blades\": 30", "own.json: ", "number of blades is 30"),
        ("\"diameter_mm\": 300", "\"diameter_mm\": 0", "own.json: ", "between 1 and 20000"),
        ("\"hand\": \"left\"", "\"hand\": \"none\"", "own.json: hand, line 1, column ", "left"),
        ("\"rows\"", "\"colour\": 1, \"rows\"", "own.json: colour, line 2, column ", "unknown field"),
        ("propeller/1", "propeller/2", "own.json: format, line 1, column ", "facemill-propeller/1"),
    ] {
        let why = why(from, to);
        assert!(why.starts_with(start) && why.contains(remedy), "{from} → {to}: {why}");
    }
}

/// A file of another kind is called no table, and not a table with a wrong column.
#[test]
fn files_of_other_kinds_are_no_table() {
    let deep = |n: usize| "[".repeat(n) + &"]".repeat(n);
    for list in [deep(1), deep(130), deep(100_000), "\u{feff} [{\"r_R\": 0.2}]".to_owned()] {
        assert_eq!(refused(&list), "own.csv: is no table: JSON of a propeller is an object, in { }");
    }
    let nested = format!("{{\"format\": {}}}", deep(100_000));
    for json in ["{\"rows\": [[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]}", "{}", &nested] {
        let why = refused(json);
        assert!(!why.contains("column of the") && why.len() < 400, "{why}");
    }
    for other in ["solid part\nfacet normal 0 0 1\n", "null", "\"text\"", "<svg>\n", "# note\nG0 X1\n"] {
        let why = refused(other);
        let line = 1 + other.matches('#').count();
        assert!(why.starts_with(&format!("own.csv, line {line}: is no table of a propeller: ")), "{why}");
    }
    // A header with one known name is one, and its others are named.
    let why = refused("# blades: 3\nr_R,colour\n");
    assert!(why.starts_with("own.csv, line 2, column \"colour\": is no column"), "{why}");
}

/// A diameter beside the file is that of one without, and of no other.
#[test]
fn a_diameter_beside_the_file_is_taken_where_the_file_has_none() {
    let bare = VP1304.replace("# diameter_mm: 250", "# D 250 mm");
    let with = |text: &str, mm: f64| read_propeller_with("own.csv", text.as_bytes(), Some(mm));
    let file = with(&bare, 250.0).unwrap();
    assert_eq!(file, read_propeller("own.csv", VP1304.as_bytes()).unwrap());
    // Lengths are those at that diameter: the radii in mm no longer end at the tip of another.
    assert!(with(&bare, 400.0).and_then(|file| file.spec(None)).is_err());
    assert_eq!(with(VP1304, 400.0).unwrap().diameter_mm, 250.0);
    assert_eq!(with(VP1304, 400.0).unwrap().spec(Some(400.0)).unwrap().diameter(), 400.0);
    let why = refused(&bare);
    assert_eq!(why, "own.csv: has no line \"# diameter_mm: …\"; add it, or give --diameter-mm");
    let why = with(&bare, 1e9).unwrap_err().to_string();
    assert!(why.starts_with("own.csv: diameter in mm is 1000000000; it lies between 1 and 20000"), "{why}");
}

#[test]
fn long_files_are_refused_in_bounded_time() {
    let row = "0.5,0.3,1,0.1,0.02,0,0\n";
    let why = refused(&format!("{DTMB_4119}{}", row.repeat(1_000_000)));
    assert!(why.contains("more than 1000 rows"), "{why}");
    let why = refused(&format!("{}{}", sections(|_, _, row| row), "1,1,0.1,0\n".repeat(1_000_000)));
    assert!(why.contains("more than 20000 rows"), "{why}");
    let why = refused(&format!("r_R{}\n", ",c_D".repeat(1_000_000)));
    assert!(why.contains("there twice"), "{why}");
    assert!(read_propeller("own.csv", &[0xff, 0xfe, 0]).unwrap_err().to_string().contains("UTF-8"));
}

/// Rows beyond the most are refused where they are written, before the rest is read: behind them
/// the text may be no JSON at all.
#[test]
fn long_lists_of_json_are_refused_at_once() {
    let file = |rows: &str, sections: &str| {
        let text = format!(
            "{{\"format\": \"facemill-propeller/1\", \"diameter_mm\": 300, \"blades\": 3, \"hand\": \"left\", \
             \"hub_diameter_mm\": 60, \"section\": \"offsets\",\n\"rows\": [{rows}],\n\"sections\": [{sections}"
        );
        read_propeller("own.json", text.as_bytes()).unwrap_err().to_string()
    };
    let section = |n: usize| format!("{{\"r_R\": 0.2, \"x_c\": [0{}]}}", ",0".repeat(n - 1));
    let why = file(&"{},".repeat(2_000_000), "");
    assert!(why.starts_with("own.json: rows, line 2, column ") && why.contains("more than 1000 rows"), "{why}");
    for (sections, field) in [
        ("{},".repeat(2_000_000), "sections"),
        (section(2_000_000), "sections[0].x_c"),
        (format!("{},", section(1000)).repeat(2000), "sections"),
    ] {
        let why = file("", &sections);
        let start = format!("own.json: {field}, line 3, column ");
        assert!(why.starts_with(&start) && why.contains("more than 20000 rows; thin them out"), "{why}");
    }
    // As many as may be.
    let why = file(&vec!["{}"; 1000].join(","), &vec![section(1000); 20].join(","));
    assert!(why.contains("the file ends in the middle"), "{why}");
}

/// Comments whose words are no slips of keys are comments.
#[test]
fn plain_comments_are_passed_over() {
    let plain = read(DTMB_4119).unwrap();
    for comment in [
        "date: 2024-05-01",
        "rake: negative aft",
        "note: x",
        "page: 3",
        "case: a",
        "made: by hand",
        "skew: against the rotation",
        "https://a.test",
        ": x",
    ] {
        let commented = read(&format!("# {comment}\n{DTMB_4119}")).unwrap_or_else(|why| panic!("{comment}: {why}"));
        assert_eq!(commented.table, plain.table);
    }
    for (slip, key) in [("nmae", "name"), ("bla", ""), ("hnad", "hand"), ("blade", "blades"), ("sectoin", "section")] {
        match read(&format!("# {slip}: x\n{DTMB_4119}")) {
            Ok(_) => assert!(key.is_empty(), "{slip}"),
            Err(why) => {
                assert!(
                    why.starts_with("own.csv, line 1: ") && why.contains(&format!("did you mean \"{key}\"")),
                    "{why}"
                );
            }
        }
    }
}

#[test]
fn random_damage_never_panics() {
    let mut random = Random(46);
    let texts = [DTMB_4119.to_owned(), VP1304.to_owned(), sections(|_, _, row| row)];
    for _ in 0..3000 {
        let mut bytes = texts[random.below(3)].clone().into_bytes();
        for _ in 0..1 + random.below(4) {
            let at = random.below(bytes.len());
            bytes[at] = b"0123456789.-e,;\n#:rR_c"[random.below(22)];
        }
        if let Ok(file) = read(&String::from_utf8(bytes).unwrap()) {
            let _ = file.spec(None);
        }
    }
}
