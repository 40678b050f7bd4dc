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

#[test]
fn numbers_without_a_decimal_point_are_one_finding_at_the_first_of_them() {
    let shop = Shop::new();
    let start = || Text::new(&shop).line("G0 G43 X0. Y0. Z1000. B0 C0. H7");
    let pointless = FindingKind::NoDecimalPoint;
    assert_eq!(kinds(&start().line("G0 Z500.").line("G1 Z450. F100.")), []);
    assert_eq!(kinds(&start().line("G0 Z500").line("X30").line("G0 B5")), [(pointless, HEAD + 2)]);
    assert_eq!(kinds(&start().line("G1 X450. F100")), [(pointless, HEAD + 2)]);
    assert_eq!(kinds(&start().line("G0 B10")), [(pointless, HEAD + 2)]);
    let v = start().line("N7 G0 Z500").line("X30").verify();
    let f = kit::only(&v);
    assert_eq!((f.block_number, f.block_text.as_str(), f.kind.is_fault()), (Some(7), "N7 G0 Z500", true));
    assert!(f.note.contains("1 more"), "{f}");
}

#[test]
fn feeds_in_inches_and_lines_behind_the_end_mark_are_findings() {
    let shop = Shop::new();
    let start = || Text::new(&shop).line("G0 G43 X0. Y0. Z1000. B0. C0. H7");
    assert_eq!(kinds(&start().line("G20 G1 X1. F10.")), [(FindingKind::InchFeed, HEAD + 2)]);
    assert_eq!(kinds(&start().line("%")), []);
    let v = start().line("%").line("").line(" G0 X0.").line("G0 X1.").verify();
    let f = kit::only(&v);
    assert_eq!((f.kind, f.first_line, f.block_text.as_str()), (FindingKind::BehindEnd, HEAD + 4, "G0 X0."));
    // Nothing but an end: no block is read at all.
    let nothing = Text { shop: &shop, text: "%\n%\nG0 X0.\n".to_owned() };
    assert_eq!(kinds(&nothing), [(FindingKind::BehindEnd, 3)]);
}

#[test]
fn branches_are_findings_and_a_check_that_goes_over_its_alarm_is_none() {
    let shop = Shop::new();
    let start = || Text::new(&shop).line("G0 G43 X0. Y0. Z1000. B0. C0. H7");
    let check = || start().line("IF [ABS[#11007+#10007-120.000] LE 0.01] GOTO 9001").line("#3000=1(LENGTH H7)");
    assert_eq!(kinds(&check().line("N9001").line("G0 X1.")), []);
    let found = [(FindingKind::Branch, HEAD + 2)];
    // To another label, over a block, without its alarm, backwards, in a loop, an alarm alone.
    assert_eq!(kinds(&check().line("N9002").line("N9001")), found);
    assert_eq!(kinds(&check().line("G0 X1.").line("N9001")), found);
    assert_eq!(kinds(&start().line("IF [#500 EQ 1] GOTO 9002").line("G0 X1.").line("N9002")), found);
    assert_eq!(kinds(&start().line("GOTO 9002").line("N9002")), found);
    assert_eq!(kinds(&start().line("WHILE [#1 LT 5] DO 1").line("G0 X1.").line("END 1")), found);
    assert_eq!(kinds(&start().line("#3000=1(STOP)").line("G0 X1.")), found);
    assert_eq!(kinds(&start().line("#500=1").line("G0 X1.")), []);
}

#[test]
fn lines_that_may_be_skipped_are_findings_when_anything_depends_on_them() {
    let shop = Shop::new();
    let start = || Text::new(&shop).line("G0 G43 X0. Y0. Z1000. B0. C0. H7");
    for harmless in ["/", "/ (note)", "/M0", "/1 M1", "/M8", "/M9", "/N5 G4 P100", "/G4 X0.5 M8"] {
        assert_eq!(kinds(&start().line(harmless).line("G0 X1.")), [], "{harmless}");
    }
    for harmful in [
        "/G0 X1.",
        "/X1.",
        "/3 G90",
        "/G91",
        "/G1",
        "/F100.",
        "/G93",
        "/G54",
        "/G55",
        "/H7",
        "/G49 Z1000.",
        "/G61",
        "/G91 G28 Z0.",
        "/T7",
        "/S2000",
        "/M3",
        "/M5",
        "/M19",
        "/M30",
        "/#100=1",
        "/G4 P100 F100.",
        "/G4 G90 P100",
        "/D7",
    ] {
        let text = start().line(harmful).line("(behind)").verify();
        let found: Vec<_> = text.findings.iter().filter(|f| f.kind == FindingKind::SkippableBlock).collect();
        assert_eq!(found.len(), 1, "{harmful}: {:?}", text.findings);
        assert_eq!((found[0].first_line, found[0].block_text.as_str()), (HEAD + 2, harmful));
        assert!(found[0].kind.is_fault());
    }
    // Those that follow each other are one.
    let both = start().line("/G0 X1.").line("/G0 X2.").line("G0 X3.").line("/G0 X4.");
    let skippable = FindingKind::SkippableBlock;
    assert_eq!(found(&both), [(skippable, HEAD + 2, HEAD + 3), (skippable, HEAD + 5, HEAD + 5)]);
}
