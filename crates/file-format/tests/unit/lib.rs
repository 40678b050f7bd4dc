use super::*;
use serde::Deserialize;

#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Outer {
    inner: Vec<Inner>,
}

#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Inner {
    tilt_deg: f64,
    rotate_deg: f64,
}

#[test]
fn unknown_key_is_refused_with_field_place_and_nearest_key() {
    let e = from_json::<Outer>(b"{\"inner\": [\n {\"tlt_deg\": 1}]}").unwrap_err();
    assert_eq!(e.field, "inner[0].tlt_deg");
    assert_eq!(e.line, 2);
    assert_eq!(e.hint.as_deref(), Some("did you mean `tilt_deg`?"));
}

#[test]
fn missing_key_wrong_kind_and_trailing_text_are_refused() {
    let e = from_json::<Outer>(b"{\"inner\": [{\"tilt_deg\": 1}]}").unwrap_err();
    assert!(e.to_string().contains("rotate_deg"), "{e}");
    let e = from_json::<Outer>(b"{\"inner\": [{\"tilt_deg\": \"1\", \"rotate_deg\": 2}]}").unwrap_err();
    assert_eq!(e.field, "inner[0].tilt_deg");
    assert!(from_json::<Outer>(b"{\"inner\": []} x").is_err());
    assert!(from_json::<Outer>(b"").is_err());
}

/// Nested lists and long keys have paths as long as the file likes: messages are short, with the
/// beginning and the end.
#[test]
fn the_path_in_a_message_is_bounded() {
    /// Lists of lists to any depth.
    #[derive(Debug, Deserialize)]
    struct Deep(#[expect(dead_code, reason = "read alone")] Vec<Deep>);

    let deep = "[".repeat(100) + "1" + &"]".repeat(100);
    let e = from_json::<Deep>(deep.as_bytes()).unwrap_err();
    assert_eq!(e.field, "[0]".repeat(100));
    assert!(e.to_string().starts_with("[0][0][0][0][0][0]…[0][0][0], line 1, column 101: invalid type"), "{e}");
    let own = "[".repeat(12) + "1" + &"]".repeat(12);
    let e = from_json::<Deep>(own.as_bytes()).unwrap_err().to_string();
    assert!(e.starts_with(&("[0]".repeat(12) + ", line")), "{e}");
    let too_deep = "[".repeat(10_000);
    assert!(from_json::<Deep>(too_deep.as_bytes()).unwrap_err().to_string().len() < 200);
    let long = format!("{{\"inner\": [{{\"{}\": 1}}]}}", "é".repeat(5000));
    let e = from_json::<Outer>(long.as_bytes()).unwrap_err();
    let place = e.to_string().split(", line").next().map_or(0, |place| place.chars().count());
    assert!(place <= 160, "{place}");
}

#[test]
fn a_value_is_read_as_strictly_as_a_file_and_its_fault_has_no_line() {
    let read = |text: &str| from_value::<Outer>(serde_json::from_str(text).unwrap());
    assert_eq!(read(r#"{"inner": [{"tilt_deg": 1, "rotate_deg": 2}]}"#).unwrap().inner.len(), 1);
    let e = read(r#"{"inner": [{"tlt_deg": 1}]}"#).unwrap_err().to_string();
    assert!(e.starts_with("inner[0].tlt_deg: unknown field") && e.ends_with("did you mean `tilt_deg`?"), "{e}");
    assert!(
        read(r#"{"inner": [{"tilt_deg": "1", "rotate_deg": 2}]}"#)
            .unwrap_err()
            .to_string()
            .starts_with("inner[0].tilt_deg: ")
    );
}

#[test]
fn byte_order_mark_is_no_part_of_the_file() {
    assert!(from_json::<Outer>(b"\xef\xbb\xbf{\"inner\": []}").is_ok());
}

/// First line of a paragraph that
/// goes on here.
///
/// - an item
///   of two lines
/// - another
///
/// ```text
/// code
///  indented
/// ```
#[derive(JsonSchema)]
#[expect(dead_code, reason = "only its schema is read")]
struct Wrapped {
    /// Angle that is
    /// described twice.
    description: f64,
}

#[test]
fn a_paragraph_of_a_description_is_one_line_and_lists_and_code_keep_theirs() {
    let schema: Value = serde_json::from_str(&schema::<Wrapped>()).unwrap();
    let whole = "First line of a paragraph that goes on here.\n\n- an item of two lines\n- another\n\n```text\ncode\n \
                 indented\n```";
    assert_eq!(schema["description"], whole);
    assert_eq!(schema["properties"]["description"]["description"], "Angle that is described twice.");
}
