use crate::rapids::numbered::*;

/// Returns the new text, and the places of the texts.
fn reported(text: &str, all: &[(&[u32], &[String])]) -> (String, Vec<[u32; 2]>) {
    let (new, places) = replaced(text.as_bytes(), all, true);
    (String::from_utf8(new).unwrap(), places)
}

#[test]
fn numbers_count_on_over_fewer_and_more_lines_and_comments_between_them() {
    let text = "0 A\r\n1 B\r\n2 ; C\r\n3 D\r\n/4 E\r\nF\r\n5 G\r\n6 H ~\r\n  Q1=+1\r\n / 7 I\r\n8 J";
    let [one, three] = [&["X"][..], &["U", "V", "W"]].map(|t| t.iter().map(|t| (*t).to_owned()).collect::<Vec<_>>());
    let (new, places) = reported(text, &[(&[2, 4], &one), (&[7], &three)]);
    let expected = "0 A\r\n1 X\r\n2 ; C\r\n/3 E\r\nF\r\n4 U\r\n5 V\r\n6 W\r\n7 H ~\r\n  Q1=+1\r\n / 8 I\r\n9 J";
    assert_eq!((&*new, &places[..]), (expected, &[[2, 2], [6, 8]][..]));
    // Without numbers, both are the same apart from the replaced lines.
    let rest = |text: &str, lines: &[usize]| -> Vec<String> {
        let text = String::from_utf8(without_numbers(text.as_bytes())).unwrap();
        text.lines().enumerate().filter(|(k, _)| !lines.contains(k)).map(|(_, l)| l.to_owned()).collect()
    };
    assert_eq!(rest(text, &[1, 3, 6]), rest(&new, &[1, 5, 6, 7]));
}

#[test]
fn zeros_before_numbers_stay_and_lines_without_one_get_none() {
    let one = ["X".to_owned()];
    assert_eq!(reported("0008 A\n0009 B\n0010 C\n", &[(&[1, 2], &one)]).0, "0008 X\n0009 C\n");
    assert_eq!(reported("A\nB\nC\n10 D\n", &[(&[1, 2], &one)]).0, "X\nC\n10 D\n");
    // A first line without a number, a second one with.
    assert_eq!(reported("A\n1 B\n2 C\n", &[(&[1, 2], &one)]).0, "X\n1 C\n");
    // Numbers of other controls are words of their lines.
    let (new, places) = replaced(b"N1 A\nN2 B\n3 C\n", &[(&[1, 2], &one)], false);
    assert_eq!((&new[..], &places[..]), (&b"X\n3 C\n"[..], &[[1, 1]][..]));
}
