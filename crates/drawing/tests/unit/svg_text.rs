use facemill_test_kit::{drawn_width, texts_outside};

use crate::svg_text::*;

#[test]
fn no_text_is_wider_than_it_is_taken_to_be() {
    let all: String = (' '..='~').collect();
    for bold in [false, true] {
        for letter in all.chars() {
            let text = letter.to_string();
            let (taken, drawn) = (text_width(&text, 13.0, bold), drawn_width(&text, 13.0, bold));
            assert!(taken >= drawn, "{letter:?} bold {bold}: {taken} for {drawn}");
        }
    }
}

#[test]
fn lines_fit_and_hold_all_of_the_text() {
    let text = "a propeller of 3048 mm, operation suction-side-with-a-very-long-name-that-has-no-space-in-it, done";
    for width in [20.0, 90.0, 300.0, 3000.0] {
        let broken = lines(text, 13.0, false, width);
        assert!(broken.iter().all(|line| text_width(line, 13.0, false) <= width), "{width}: {broken:?}");
        let letters = |text: &str| text.chars().filter(|c| *c != ' ').collect::<String>();
        assert_eq!(letters(&broken.concat()), letters(text));
    }
    assert_eq!(lines(text, 13.0, false, 3000.0), [text]);
    assert_eq!(lines("", 13.0, false, 10.0), [""]);
}

#[test]
fn entries_that_do_not_fit_go_to_the_next_line() {
    assert_eq!(flow(&[40.0, 50.0, 20.0, 200.0, 5.0], 100.0), [(0.0, 0), (40.0, 0), (0.0, 1), (0.0, 2), (0.0, 3)]);
}

/// The test itself detects text outside.
#[test]
fn a_text_beyond_the_edge_is_seen() {
    let svg = |x: f64| {
        format!(
            r#"<svg viewBox="0 0 100 50" font-size="10"><g transform="translate(0 8)"><text x="{x}" y="20">wide text</text></g></svg>"#
        )
    };
    assert_eq!(texts_outside(&svg(10.0)), Vec::<String>::new());
    assert_eq!(texts_outside(&svg(70.0)), ["wide text"]);
    assert_eq!(texts_outside(&svg(-1.0)), ["wide text"]);
}
