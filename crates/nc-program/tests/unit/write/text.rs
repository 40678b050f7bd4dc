use crate::write::text::*;

#[test]
fn comments_keep_to_the_characters_of_the_control() {
    assert_eq!(clean_fanuc_comment("Prüfung (Ø80) a_b\n단"), "PRUEFUNG [?80] A-B ?");
    let rule = |characters: &str, active: &[&str]| CommentRule {
        open: "(".into(),
        close: ")".into(),
        characters: characters.into(),
        active: active.iter().map(|a| (*a).to_owned()).collect(),
    };
    assert_eq!(clean_comment("a_(b), 단", &rule("", &[])), "A  B    ");
    assert_eq!(clean_comment("logclose", &rule("", &["LOGCLOSE"])), ". LOGCLOSE");
}

#[test]
fn names_of_programs_hold_letters_digits_and_underscores() {
    assert_eq!(program_id("Blade - top (2)", 7, 24), "BLADE_TOP_2");
    assert_eq!(program_id("단", 7, 24), "P7");
    assert_eq!(program_id("a b c d", 7, 4), "A_B");
}

#[test]
fn pieces_hold_every_word_and_fit() {
    let text = clean_fanuc_comment("one two three four_five_six seven");
    for limit in 1..40 {
        let pieces = comment_pieces(&text, limit);
        assert!(pieces.iter().all(|p| p.len() <= limit), "{limit} {pieces:?}");
        let joined: String = pieces.concat().replace(' ', "");
        assert_eq!(joined, text.replace(' ', ""));
    }
}
