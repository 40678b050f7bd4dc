//! State that a program sets besides axes: each fault in its text is found once, where it is, and
//! its twin is not.

mod functions;
mod left_unsaid;

use crate::kit;
use crate::kit::{HEAD, Shop, Text};
use facemill_cl_data::Silent;
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_virtual_machine::verify;
use facemill_virtual_machine::{FindingKind, VerifySettings, VirtualSetup};

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
fn lines_behind_the_end_mark_are_findings() {
    let shop = Shop::new();
    let start = || Text::new(&shop).line("G0 G43 X0. Y0. Z1000. B0. C0. H7");
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

/// A text at the work whose head does not switch the spindle on.
fn still(shop: &Shop) -> Text<'_> {
    Text { shop, text: "%\nO1\nG21 G90 G94 G49\nT7 M6\nG0 G43 X0. Y0. Z1000. B0. C0. H7\n".to_owned() }
}

/// Two feed moves, each with a rapid behind it.
fn pass(text: Text<'_>) -> Text<'_> {
    text.line("G1 X1. F100.").line("G0 X3.").line("G1 X4.").line("G0 X5.")
}

#[test]
fn feed_moves_without_the_spindle_are_one_finding_from_the_first_to_the_last() {
    let shop = Shop::new();
    let start = || still(&shop);
    let (off, sense) = (FindingKind::SpindleOff, FindingKind::SpindleSense);
    assert_eq!(found(&pass(start())), [(off, 6, 8)]);
    // One line, and the pass behind it.
    for (line, kind) in [
        ("S2000 M3", None),
        ("S2000 M03", None),
        ("M3", Some(off)),
        ("S2000", Some(off)),
        ("S0 M3", Some(off)),
        ("S2000 M4", Some(sense)),
        ("S2000 M3 M5", Some(off)),
    ] {
        let expected: Vec<_> = kind.iter().map(|k| (*k, 7, 9)).collect();
        assert_eq!(found(&pass(start().line(line))), expected, "{line}");
    }
    let on = || start().line("S2000 M3");
    for stop in ["M5", "M19"] {
        assert_eq!(found(&pass(on().line(stop))), [(off, 8, 10)], "{stop}");
        assert_eq!(found(&pass(on().line(stop).line("M3"))), []);
    }
    // A tool is changed at rest.
    let home = || on().line("G91 G28 Z0.").line("G90").line("T7 M6");
    assert_eq!(found(&pass(home())), [(off, 10, 12)]);
    assert_eq!(found(&pass(home().line("M3"))), []);
    // In the block itself it may come too late, or go too early.
    assert_eq!(found(&start().line("S2000 M3 G1 X1. F100.").line("X2.")), [(off, 6, 6)]);
    assert_eq!(found(&on().line("G1 X1. F100.").line("X2. M5")), [(off, 8, 8)]);
    // Rapids need no spindle, and arcs and cycles do.
    assert_eq!(found(&start().line("G0 X1.").line("M8").line("X3.")), []);
    assert!(kinds(&start().line("G2 X10. I5. J0. F100.")).contains(&(off, 6)));
    // Each time it is stopped is a cause of its own.
    assert_eq!(found(&pass(pass(on().line("M5")).line("M3").line("M5"))), [(off, 8, 10), (off, 14, 16)]);
    assert!(off.is_fault() && sense.is_fault());
}

#[test]
fn the_sense_of_the_spindle_is_that_of_the_tool() {
    let shop = Shop::new();
    let mut left = Shop::new();
    left.tool = kit::tool_turning("counterclockwise");
    let sense = FindingKind::SpindleSense;
    for (shop, good, bad) in [(&shop, "M3", "M4"), (&left, "M4", "M3")] {
        let cut = |m: &str| still(shop).line(&format!("S2000 {m}")).line("G1 X1. F100.").line("X2.");
        assert_eq!(found(&cut(good)), []);
        assert_eq!(found(&cut(bad)), [(sense, 7, 8)]);
    }
}

#[test]
fn functions_of_the_machine_builder_are_reported_once_each() {
    let shop = Shop::new();
    let start = || Text::new(&shop).line("G0 G43 X0. Y0. Z1000. B0. C0. H7");
    for known in ["M0", "M1", "M3", "M5", "M7", "M8", "M9", "M19", "M2", "M30"] {
        assert_eq!(kinds(&start().line(known)), [], "{known}");
    }
    let text = start().line("M88").line("G0 X1.").line("M10").line("M88");
    let unknown = FindingKind::UnknownFunction;
    assert_eq!(found(&text), [(unknown, HEAD + 2, HEAD + 5), (unknown, HEAD + 4, HEAD + 4)]);
    let v = text.verify();
    assert_eq!(v.faults().count(), 2);
    assert!(v.findings[0].to_string().contains("M88"), "{}", v.findings[0]);
    // One that switches the spindle on is not followed: the cut behind it is without.
    let v = still(&shop).line("S2000 M13").line("G1 X1. F100.").verify();
    assert!(v.faults().any(|f| f.kind == FindingKind::SpindleOff));
}

#[test]
fn blocks_behind_the_end_of_the_program_are_a_finding() {
    let shop = Shop::new();
    let start = || Text::new(&shop).line("G0 G43 X0. Y0. Z1000. B0. C0. H7");
    for end in ["M30", "M2"] {
        let behind = [(FindingKind::BehindEnd, HEAD + 3, HEAD + 5)];
        assert_eq!(found(&start().line(end).line("G0 X1.").line("(note)").line("X2.").line("%")), behind, "{end}");
        assert_eq!(found(&start().line(end).line("(note)").line("%")), []);
    }
}

#[test]
fn feed_moves_without_a_tool_are_one_finding() {
    let shop = Shop::new();
    // The way to the work and a pass behind what a header says of the tool.
    let with = |lines: &[&str]| {
        let mut text = Text { shop: &shop, text: "%\nO1\nG21 G90 G94 G49\n".to_owned() };
        for line in lines {
            text = text.line(line);
        }
        found(&pass(text.line("S2000 M3").line("G0 G43 X0. Y0. Z1000. B0. C0. H7")))
    };
    let no_tool = |n: u32| vec![(FindingKind::NoTool, 6 + n, 8 + n)];
    assert_eq!(with(&[]), no_tool(0));
    assert_eq!(with(&["T7"]), no_tool(1));
    assert_eq!(with(&["M6"]), no_tool(1));
    assert_eq!(with(&["T7 M6", "M6"]), no_tool(2));
    for good in [&["T7 M6"][..], &["M6 T7"], &["T7", "M6"], &["T7 M6", "T7"], &["M6", "T7 M6"]] {
        assert_eq!(with(good), [], "{good:?}");
    }
    assert_eq!(with(&["T8 M6"]), [(FindingKind::UnknownBlock, 4, 4)]);
    assert!(FindingKind::NoTool.is_fault());
}

#[test]
fn a_tool_change_away_from_the_reference_position_is_found_and_at_home_it_is_not() {
    let shop = Shop::new();
    let unsafe_change = FindingKind::UnsafeToolChange;
    let at_work = || Text::new(&shop).line("G0 G43 X0. Y0. Z1000. B0. C0. H7");
    assert_eq!(kinds(&at_work().line("T7 M6")), [(unsafe_change, HEAD + 2)]);
    assert_eq!(kinds(&at_work().line("G91 G28 X0. Y0.").line("T7 M6")), [(unsafe_change, HEAD + 3)]);
    assert_eq!(kinds(&at_work().line("G91 G28 Z0.").line("T7 M6")), []);
    // In the block of the motion it may come before or behind.
    assert_eq!(kinds(&at_work().line("G91 G28 Z0. T7 M6")), [(unsafe_change, HEAD + 2)]);
    let home = || at_work().line("G91 G28 Z0.");
    assert_eq!(kinds(&home().line("G90 G0 Z900. T7 M6")), [(unsafe_change, HEAD + 3)]);
    // T alone moves the magazine only.
    assert_eq!(kinds(&at_work().line("T7")), []);
    let v = at_work().line("N30 T7 M6").verify();
    let f = kit::only(&v);
    assert_eq!((f.block_number, f.block_text.as_str(), f.kind.is_fault()), (Some(30), "N30 T7 M6", true));
}

/// Kind, first line and axis of every finding that is about places, of a text as it stands.
fn lost(text: &str, dialect: Dialect) -> Vec<(FindingKind, u32, Option<String>)> {
    let shop = Shop::new();
    let program = read_program(text, dialect).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let v = verify(&program, &shop.setup(), &VerifySettings::default(), &Silent).unwrap();
    let is_place = |k: FindingKind| k == FindingKind::UnknownPosition;
    let reports = v.findings.iter().filter(|f| is_place(f.kind));
    reports.map(|f| (f.kind, f.first_line, f.axis.clone())).collect()
}

/// An axis whose word is an expression that nobody evaluates goes somewhere, and does not stay
/// where it was.
#[test]
fn an_axis_with_a_word_of_unknown_value_is_lost_and_not_taken_to_stay() {
    let fanuc = |word: &str| format!("G21 G90 G94 G49\nG0 X0. Y0. Z0. B0. C0.\nG0 X10. Y{word}\nG0 X20.\nM30\n");
    let siemens = |word: &str| format!("G54 G71 G90 G94\nG0 X0. Y0. Z0. B0. C0.\nG0 X10. Y={word}\nG0 X20.\nM30\n");
    let heidenhain = |word: &str| {
        format!("BEGIN PGM A MM\nL X+0 Y+0 Z+0 B+0 C+0 R0 FMAX\nL X+10 Y+{word} R0 FMAX\nL X+20 R0 FMAX\nM30\n")
    };
    let here = |line| vec![(FindingKind::UnknownPosition, line, Some("Y".to_owned()))];
    for dialect in [Dialect::Fanuc, Dialect::Haas, Dialect::Mazak, Dialect::LinuxCnc] {
        assert_eq!(lost(&fanuc("5."), dialect), []);
        assert_eq!(lost(&fanuc("#100"), dialect), here(3), "{dialect:?}");
    }
    assert_eq!(lost(&siemens("5+3"), Dialect::Siemens840d), []);
    assert_eq!(lost(&siemens("R5*2"), Dialect::Siemens840d), here(3));
    assert_eq!(lost(&heidenhain("8"), Dialect::Heidenhain), []);
    assert_eq!(lost(&heidenhain("Q5"), Dialect::Heidenhain), here(2 + 1));
    // Where a cycle leaves the tool is not known, either: at its height or at where it came from.
    let cycle = "G21 G90 G94 G49\nG0 X0. Y0. Z0. B0. C0.\nG81 X5. Z-10. R2. F100.\nG80\nG0 X20.\nM30\n";
    assert_eq!(lost(cycle, Dialect::Fanuc), [(FindingKind::UnknownPosition, 3, Some("Z".to_owned()))]);
}

/// In inches 1 deg counts as 1 inch, which is an assumption where a rotary axis moves, and no
/// finding.
#[test]
fn feeds_in_inches_count_a_degree_as_an_inch_and_are_no_findings() {
    let shop = Shop::new();
    for (axis, counted, rests) in [("", 1.0, false), (" C0.5", 1.0_f64.hypot(0.5), true)] {
        let text = format!(
            "G21 G90 G94\nT7 M6\nS2000 M3\nG0 G43 H7 Z400.\nG0 X0. Y0. Z400. B0. C0.\nG20\nG1 X1.{axis} F2.4\n"
        );
        let program = read_program(&text, Dialect::Fanuc).unwrap();
        let found = verify(&program, &shop.setup(), &VerifySettings::default(), &Silent).unwrap();
        assert!((found.cutting_time_s - 60.0 * counted / 2.4).abs() < 1e-9, "{axis}: {} s", found.cutting_time_s);
        assert!(found.findings.iter().all(|f| f.kind == FindingKind::NoEnd), "{axis}: {:?}", found.findings);
        let all = facemill_virtual_machine::assumptions(&program, shop.setup().machine);
        assert_eq!(all.iter().any(|a| a.text.contains("1 inch")), rests, "{axis}: {all:?}");
    }
}

/// Axes that F counts: all axes with 1 deg as 1 mm, as FANUC does and FGROUP says it; or the linear
/// axes alone, as Siemens and LinuxCNC do without it.
#[test]
fn blocks_take_the_time_of_the_axes_that_the_control_counts() {
    let shop = Shop::new();
    let run = |dialect: Dialect, group: &str, mode: &str| {
        let start = match dialect {
            Dialect::Siemens840d => "G710 G90 G94\nT7 M6\nS2000 M3\nD1\n",
            _ => "G21 G90 G94\nT7 M6\nS2000 M3\nG0 G43 H7 Z400.\n",
        };
        let text = format!("{start}G0 X0. Y0. Z400. B0. C0.\n{mode}{group}G1 X8. C0.6 F60.\nX16. C1.2\n");
        let length_register = if dialect == Dialect::Siemens840d { 1 } else { 7 };
        let setup = VirtualSetup { length_register, ..shop.setup() };
        verify(&read_program(&text, dialect).unwrap(), &setup, &VerifySettings::default(), &Silent).unwrap()
    };
    let all = |axes: &str| format!("FGROUP({axes})\nFGREF[B]=57.29578\nFGREF[C]=57.29578\n");
    let (norm, linear) = (16.0_f64.hypot(1.2), 16.0);
    for (dialect, group, way) in [
        (Dialect::Fanuc, String::new(), norm),
        (Dialect::LinuxCnc, String::new(), linear),
        (Dialect::Siemens840d, String::new(), linear),
        (Dialect::Siemens840d, all("X,Y,Z,B,C"), norm),
        (Dialect::Siemens840d, "FGROUP(X,Y,Z)\n".to_owned(), linear),
        (Dialect::Siemens840d, format!("{}FGROUP()\n", all("X,Y,Z,B,C")), linear),
    ] {
        let found = run(dialect, &group, "");
        assert!((found.cutting_time_s - way).abs() < 1e-9, "{dialect:?} {group}: {} s", found.cutting_time_s);
        assert_eq!(found.findings, [], "{dialect:?} {group}");
    }
    let words =
        ["OVR=50", "OVRRAP=50", "FB=50", "FD=1", "FZ=0.1", "SVC=90", "LIMS=500", "FMA[2,X]=5", "FRC=3", "FRCM=3"];
    let words = words.map(|word| format!("{word}\n"));
    for group in [all("X,Y,Z,C"), "FGROUP(X,Y,Z,B,C)\n".to_owned()].into_iter().chain(words) {
        let found = run(Dialect::Siemens840d, &group, "");
        let reports = found.findings.iter().filter(|f| f.kind == FindingKind::NoFeed && !f.note.is_empty()).count();
        assert!(reports == 1 && found.faults().count() > 0, "{group}: {:?}", found.findings);
    }
    // Under TRAORI F is the tip's where FGROUP has no rotary axes.
    let is_clear = |group: &str| {
        run(Dialect::Siemens840d, group, "TRAORI\n").findings.iter().all(|f| f.kind != FindingKind::NoFeed)
    };
    assert!(is_clear("") && is_clear("FGROUP(X,Y,Z)\n") && !is_clear(&all("X,Y,Z,B,C")));
}

/// Words that choose another motion than the machine file states are reported at their lines.
#[test]
fn words_that_choose_another_motion_are_findings() {
    let shop = Shop::new();
    let reports = |dialect: Dialect, text: &str| -> Vec<u32> {
        let program = read_program(text, dialect).unwrap_or_else(|e| panic!("{e}: {text}"));
        let v = verify(&program, &shop.setup(), &VerifySettings::default(), &Silent).unwrap();
        v.findings.iter().filter(|f| f.kind == FindingKind::OtherMotion).map(|f| f.first_line).collect()
    };
    // The shop's control goes on lines with all axes and smooths nothing.
    for (word, is_strange) in [
        ("ORIAXES", false),
        ("RTLION", false),
        ("CYCLE832()", false),
        ("CYCLE832(0,0,1)", false),
        ("G60", false),
        ("ORIVECT", true),
        ("ORICURVE", true),
        ("RTLIOF", true),
        ("COMPCAD", true),
        ("CYCLE832(0.02,1,1)", true),
        ("G641 ADIS=0.5", true),
    ] {
        let found = reports(Dialect::Siemens840d, &format!("G710 G90 G94\n{word}\nG0 X0. Y0.\n"));
        assert_eq!(found, if is_strange { vec![2] } else { vec![] }, "{word}");
    }
    for (path, lines) in [("AXIS", vec![]), ("VECTOR", vec![1])] {
        let text = format!("BEGIN PGM A MM\nFUNCTION TCPM F TCP AXIS POS PATHCTRL {path}\nEND PGM A MM\n");
        assert_eq!(reports(Dialect::Heidenhain, &text), lines.into_iter().map(|l: u32| l + 1).collect::<Vec<_>>());
    }
}
