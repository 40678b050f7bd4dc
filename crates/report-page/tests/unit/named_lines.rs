use serde_json::json;

use super::*;

#[test]
fn a_line_is_quoted_with_its_text_and_a_long_one_is_cut() {
    let text = format!("0 BEGIN\r\n1 L X+0 FMAX\r\n\r\n{}\n", "é".repeat(100));
    let lines = FileLines::of(&text, &[]);
    assert_eq!(lines.quoted(2), "file line 2: \"1 L X+0 FMAX\"");
    assert_eq!([0, 3, 9].map(|line| lines.quoted(line)), ["file line 0", "file line 3", "file line 9"]);
    assert_eq!(lines.text(4).map(|t| t.chars().count()), Some(LONGEST));
    let result = json!({ "findings": [{ "first_line": 1, "last_line": 2, "worst_line": 2 }], "assumptions": [{}, { "line": 7 }] });
    let named = lines.named(&result, [4].into_iter());
    assert_eq!(named.into_keys().collect::<Vec<_>>(), [1, 2, 4]);
}

#[test]
fn a_line_of_an_expanded_program_is_named_by_its_written_file() {
    let run = |first_line, file: &str, line| WrittenLines { first_line, file: file.to_owned(), line };
    let written = [run(1, "main.nc", 1), run(3, "O2.nc", 3), run(4, "main.nc", 4)];
    let lines = FileLines::of("O1\nG0 X0\nG1 X5\nM30\n", &written);
    let quoted = ["main.nc line 2: \"G0 X0\"", "O2.nc line 3: \"G1 X5\"", "main.nc line 4: \"M30\"", "main.nc line 5"];
    assert_eq!([2, 3, 4, 5].map(|line| lines.quoted(line)), quoted);
}
