//! Length compensation and RTCP: switched off where an axis may move by the tool's length, and on
//! over a turned table.

use facemill_nc_program::AxisLetter;
use facemill_virtual_machine::FindingKind;

use crate::kit::{HEAD, Shop, Text};

#[test]
fn cancelling_the_length_away_from_home_is_found_and_behind_the_way_home_it_is_not() {
    let shop = Shop::new();
    let kinds = |t: &Text<'_>| t.verify().findings.iter().map(|f| (f.kind, f.worst_line)).collect::<Vec<_>>();
    let at_work = || Text::new(&shop).rapid([-300.0, 0.0, 300.0]).rapid([-300.0, 0.0, 50.0]);
    let found = [(FindingKind::UnsafeCancel, HEAD + 3)];
    let home = "G91 G28 Z0.";
    // With G43: a lone G49, and H0, which is the same.
    assert_eq!(kinds(&at_work().line("G49").line(home)), found);
    assert_eq!(kinds(&at_work().line("H0").line(home)), found);
    assert_eq!(kinds(&at_work().line("G0 G49 X0.").line(home)), found);
    assert_eq!(kinds(&at_work().line(home).line("G49").line("G91 G28 X0. Y0.")), []);
    assert_eq!(kinds(&at_work().line(home).line("H0")), []);
    // The block says where the axis goes: with the length off, word 300 is 300 mm above the offset
    // for the nose.
    assert_eq!(kinds(&at_work().line("G0 G49 Z300.")), []);
    assert_eq!(kinds(&at_work().line("G0 G53 G49 Z3000.").line("G91 G28 X0. Y0.")), []);
    // With RTCP the same, tilted.
    let q = shop.axes_at([-300.0, 0.0, 300.0], [0.2, 0.1, 1.0]);
    let words = shop.words.words(q.as_slice()).unwrap();
    let rotary = format!("B{:.4} C{:.4}", words.get(AxisLetter::B).unwrap(), words.get(AxisLetter::C).unwrap());
    let rtcp = || {
        let on = Text::new(&shop).line("G0 B0. C0.").line("G0 G43.4 X-300. Y0. Z900. H7");
        on.line(&format!("G0 Z300. {rotary}"))
    };
    let found = [(FindingKind::UnsafeCancel, HEAD + 4)];
    assert_eq!(kinds(&rtcp().line("G49").line(home)), found);
    assert_eq!(kinds(&rtcp().line("G0 G49 Z1000.").line(home)), found);
    assert_eq!(kinds(&rtcp().line(home).line("G49").line("G91 G28 X0. Y0.").line("G91 G28 B0. C0.")), []);
}

#[test]
fn the_way_home_under_rtcp_moves_the_named_axes_alone() {
    // X and Y stay where they are while Z goes home, whatever the words of the tip were.
    let shop = Shop::new();
    let q = shop.axes_at([-300.0, 0.0, 300.0], [0.2, 0.1, 1.0]);
    let words = shop.words.words(q.as_slice()).unwrap();
    let rotary = format!("B{:.4} C{:.4}", words.get(AxisLetter::B).unwrap(), words.get(AxisLetter::C).unwrap());
    let on = Text::new(&shop).line("G0 B0. C0.").line("G0 G43.4 X-300. Y0. Z900. H7");
    let there = on.line(&format!("G0 Z300. {rotary}"));
    let stay = format!("G1 G53 X{:.4} Y{:.4} F1000.", q[0], q[1]);
    let v = there.line("G91 G28 Z0.").line("G90 G49").line(&stay).verify();
    assert_eq!(v.findings, []);
    assert!(v.cutting_length_mm < 1e-3, "{}", v.cutting_length_mm);
}

#[test]
fn rtcp_switched_on_over_a_turned_table_is_found_and_at_zero_it_is_not() {
    // The control would fix the frame of the words to the table as it stands there.
    let shop = Shop::new();
    let kinds = |t: Text<'_>| t.verify().findings.iter().map(|f| (f.kind, f.worst_line)).collect::<Vec<_>>();
    let on = |before: &str, rotary: &str| {
        let turned = Text::new(&shop).line(&format!("G0 {before}"));
        turned.line(&format!("G0 G43.4 X-300. Y0. Z900. {rotary} H7")).line("G0 Z800. B10. C35.")
    };
    assert_eq!(kinds(on("B0. C0.", "")), []);
    // The head does not turn the frame.
    assert_eq!(kinds(on("B10. C0.", "")), []);
    let found = [(FindingKind::UnknownPosition, HEAD + 2)];
    assert_eq!(kinds(on("B0. C35.", "")), found);
    assert_eq!(kinds(on("B0. C0.", "C35.")), found);
    assert_eq!(kinds(on("B0. C35.", "C0.")), found);
}
