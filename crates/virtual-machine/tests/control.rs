//! What a program sets besides axes: each fault in its text is found once, where it is, and its twin is not.

mod kit;

use facemill_virtual_machine::FindingKind;
use kit::{HEAD, Shop, Text};

/// Kind, first and last line of every finding.
fn found(text: &Text<'_>) -> Vec<(FindingKind, u32, u32)> {
    text.verify().findings.iter().map(|f| (f.kind, f.first_line, f.last_line)).collect()
}

/// Kind and first line of every finding.
fn kinds(text: &Text<'_>) -> Vec<(FindingKind, u32)> {
    found(text).iter().map(|f| (f.0, f.1)).collect()
}

#[test]
fn a_length_from_another_register_is_found_where_it_is_taken() {
    let shop = Shop::new();
    let start = || Text::new(&shop).line("G0 X0. Y0. B0. C0.");
    let other = FindingKind::OtherLengthRegister;
    assert_eq!(kinds(&start().line("G0 G43 Z1000. H7").line("G0 Z900.")), []);
    assert_eq!(kinds(&start().line("G0 G43 Z1000. H77").line("G0 Z900.").line("G0 Z800.")), [(other, HEAD + 2)]);
    assert_eq!(kinds(&start().line("G0 G43.4 X0. Y0. Z1000. H77").line("G0 Z900.")), [(other, HEAD + 2)]);
    // H alone changes the register in force; with compensation off it waits for the next G43.
    let at_work = || start().line("G0 G43 Z1000. H7");
    assert_eq!(kinds(&at_work().line("G0 H55").line("G0 X1. Z900.")), [(other, HEAD + 3)]);
    assert_eq!(kinds(&at_work().line("G91 G28 Z0.").line("G49").line("G90").line("G0 H55")), []);
    let again = |h: &str| at_work().line("G91 G28 Z0.").line("G49").line("G90").line(h).line("G0 G43 Z900.");
    assert_eq!(kinds(&again("H55")), [(other, HEAD + 7)]);
    assert_eq!(kinds(&again("H7")), []);
    // Without any H the control takes what it had last, or nothing.
    assert_eq!(kinds(&start().line("G0 G43 Z1000.")), [(other, HEAD + 2)]);
    let text = start().line("N20 G0 G43 Z1000. H77").verify();
    let f = kit::only(&text);
    assert_eq!((f.block_number, f.block_text.as_str()), (Some(20), "N20 G0 G43 Z1000. H77"));
    assert!(f.note.contains("H77") && f.note.contains("H7"), "{f}");
    assert!(f.kind.is_fault());
}
