use serde_json::json;

use super::*;

#[test]
fn a_line_is_quoted_with_its_text_and_a_long_one_is_cut() {
    let text = format!("0 BEGIN\r\n1 L X+0 FMAX\r\n\r\n{}\n", "é".repeat(100));
    let lines = FileLines::of(&text);
    assert_eq!(lines.quoted(2), "file line 2: \"1 L X+0 FMAX\"");
    assert_eq!([0, 3, 9].map(|line| lines.quoted(line)), ["file line 0", "file line 3", "file line 9"]);
    assert_eq!(lines.text(4).map(|t| t.chars().count()), Some(LONGEST));
    let result = json!({ "findings": [{ "first_line": 1, "last_line": 2, "worst_line": 2 }], "assumptions": [{}, { "line": 7 }] });
    let named = lines.named(&result, [4].into_iter());
    assert_eq!(named.into_keys().collect::<Vec<_>>(), [1, 2, 4]);
}
