//! Treatment of each statement.

use facemill_cl_post::{PostNote, PostOptions, PostReport, Treatment};
use nalgebra::Vector3;

use crate::kit::*;

#[test]
fn each_word_is_written_applied_or_listed() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let text = "$$ from a system\nPARTNO/BLADE 7\nUNITS/MM\nMULTAX/ON\nTOOL PATH/FINISH,TOOL,MILL\nCUTTER/20,1\nLOADTL/7\n\
                SPINDL/3000,RPM,CLW\nCOOLNT/MIST\nPPRINT/OP 10\nRAPID\nGOTO/0,0,60\nFEDRAT/500,MMPM\nGOTO/0,0,50\n\
                DELAY/1.5\nSPINDL/2000,RPM,CLW\nCOOLNT/OFF\nGOTO/5,0,50\nSTOP\nOPSTOP\nCUTCOM/LEFT\nSTRANGE/1,2\n\
                GOTO/10,0,50\nSPINDL/OFF\nRAPID\nGOTO/10,0,60\nFINI\n";
    let posted = stage.post(text);
    let faults: Vec<(Option<u32>, &str)> = posted.report.faults.iter().map(|f| (f.line, f.text.as_str())).collect();
    assert!(posted.is_as_meant && faults.len() == 2, "{faults:?}");
    assert!(faults[0].0 == Some(21) && faults[0].1.starts_with("CUTCOM is not written"), "{faults:?}");
    assert_eq!(faults[1], (Some(22), "STRANGE is not understood: its 1 statement(s) are not written"));
    let body: Vec<&str> = posted.text.lines().map(|l| l.split_once(' ').map_or(l, |(_, rest)| rest)).collect();
    let at = |word: &str| {
        let found = posted.text.lines().position(|line| line.contains(word));
        found.unwrap_or_else(|| panic!("{word}: {}", posted.text))
    };
    let order =
        ["BLADE 7", "S3000 M3", "M7", "FINISH", "OP 10", "Z1350.", "G4 P", "S2000 M3", "M9", "X5.", "M0", "X10."];
    for pair in order.windows(2) {
        assert!(at(pair[0]) < at(pair[1]), "{pair:?}: {}", posted.text);
    }
    assert!(body.iter().filter(|line| **line == "M5").count() == 2, "{}", posted.text);
    let treatment = |word: &str| posted.report.words.iter().find(|w| w.word == word).unwrap().treatment;
    for (word, expected) in [
        ("$$", Treatment::NoEffect),
        ("PARTNO", Treatment::Written),
        ("UNITS", Treatment::Applied),
        ("TOOL", Treatment::AsComment),
        ("CUTTER", Treatment::Applied),
        ("PPRINT", Treatment::AsComment),
        ("DELAY", Treatment::Written),
        ("OPSTOP", Treatment::NotWritten),
        ("CUTCOM", Treatment::NotWritten),
        ("STRANGE", Treatment::Unknown),
        ("GOTO", Treatment::Written),
    ] {
        assert_eq!(treatment(word), expected, "{word}");
    }
    let n_statements: usize = posted.report.words.iter().map(|w| w.count).sum();
    assert_eq!(n_statements, text.lines().count());
    let notes: Vec<String> = posted.report.notes.iter().map(|n| format!("{:?} {}", n.line, n.text)).collect();
    assert!(notes.iter().any(|n| n.starts_with("Some(20) OPSTOP")), "{notes:?}");
    assert!(posted.report.summary().contains("NOT CHECKED AGAINST A PART"));
}

/// The tape is not rewound, and an offset that was never on is not missing.
#[test]
fn rewind_and_the_end_of_no_offset_are_words_without_effect() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let report = stage.post(&format!("{HEAD}CUTCOM/OFF\nREWIND/0\nFINI")).report;
    assert!(report.is_clean() && report.notes.is_empty(), "{report:?}");
    let treatment = |report: &PostReport, word: &str| report.words.iter().find(|w| w.word == word).unwrap().treatment;
    for word in ["CUTCOM", "REWIND"] {
        assert_eq!(treatment(&report, word), Treatment::NoEffect, "{word}");
    }
    let on = stage.post(&format!("{HEAD}CUTCOM/OFF\nCUTCOM/LEFT\nCUTCOM/OFF\nFINI")).report;
    assert!(!on.is_clean() && treatment(&on, "CUTCOM") == Treatment::NotWritten);
}

/// Where a point gives no axis, the last one counts; MULTAX/OFF and TLAXIS set it.
#[test]
fn an_axis_is_carried_until_another_is_said() {
    let stage = Stage::fanuc("head-b-table-c", 4);
    let text = format!(
        "{HEAD}GOTO/0,0,50,0.3,0,1\nGOTO/5,0,50\nTLAXIS/0,0.2,1\nGOTO/6,0,50\nMULTAX/OFF\nGOTO/7,0,50\nRAPID\n\
         GOTO/7,0,60\nFINI"
    );
    let reached = stage.reached(&stage.post(&text).text);
    for (x, axis) in [(5.0, Vector3::new(0.3, 0.0, 1.0)), (6.0, Vector3::new(0.0, 0.2, 1.0)), (7.0, Vector3::z())] {
        let there = reached.iter().find(|r| (r.cl.tip.x - x).abs() < 1e-3).expect("the point");
        assert!(angle(&there.cl.axis, &nalgebra::Unit::new_normalize(axis)) < 1e-5, "{x}");
    }
}

/// CSYS gives the frame of the points behind it: tip and axis turn with it.
#[test]
fn points_of_a_frame_are_brought_into_that_of_the_part() {
    let stage = Stage::fanuc("table-table-a-c", 4);
    // x of the frame is −z of the part, z of the frame is x of the part.
    let text =
        format!("{HEAD}CSYS/0,0,-1,40,0,1,0,0,1,0,0,30\nRAPID\nGOTO/0,0,10\nGOTO/-5,0,2\nRAPID\nGOTO/0,0,60\nFINI");
    let reached = stage.reached(&stage.post(&text).text);
    let there = reached.iter().find(|r| !r.is_rapid).expect("a cut");
    assert!((there.cl.tip - nalgebra::Point3::new(42.0, 0.0, 35.0)).norm() < 1e-3, "{}", there.cl.tip);
    assert!(angle(&there.cl.axis, &Vector3::x_axis()) < 1e-5);
}

/// FROM often comes before the tool is called, and GOHOME at the end: the program is that without
/// them.
#[test]
fn from_before_the_tool_and_gohome_at_its_end_are_what_the_program_does_anyway() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let cut = "SPINDL/3000,RPM,CLW\nRAPID\nGOTO/0,0,60,0.2,0,1\nFEDRAT/600,MMPM\nGOTO/5,0,50,0.2,0,1\nRAPID\nGOTO/0,0,60,0.2,0,1\n";
    let text = |before: &str, behind: &str| format!("UNITS/MM\nMULTAX/ON\n{before}LOADTL/7\n{cut}{behind}FINI");
    let plain = stage.post(&text("", ""));
    let with = stage.post(&text("FROM/0,0,300\n", "GOHOME\n"));
    // Lines of the file are no part of the program.
    assert_eq!(with.text, plain.text);
    assert!(with.report.is_clean(), "{:?}", with.report.faults);
    // What is switched between FROM and the call is the header's.
    for between in
        ["SPINDL/900,RPM,CLW\n", "SPINDL/OFF\n", "COOLNT/FLOOD\n", "SPINDL/900,RPM,CCLW\nCOOLNT/MIST\nGOHOME\n"]
    {
        let plain = stage.post(&text(between, ""));
        let with = stage.post(&text(&format!("FROM/0,0,300\n{between}"), ""));
        assert_eq!(with.text, plain.text, "{between}");
    }
    // Behind the call it is a move, with the spindle as the file has it.
    let off = |from: &str| {
        format!(
            "LOADTL/7\nSPINDL/3000,RPM,CLW\nSPINDL/OFF\n{from}RAPID\nGOTO/0,0,60\nSPINDL/ON\nFEDRAT/600,MMPM\nGOTO/5,0,50\nRAPID\nGOTO/0,0,60\nFINI"
        )
    };
    let words = |text: &str, word: &str| text.split_whitespace().filter(|w| *w == word).count();
    let [bare, moved] = ["", "FROM/0,0,90\n"].map(|from| stage.post(&off(from)).text);
    assert_eq!([words(&bare, "M5"), words(&bare, "M3")], [words(&moved, "M5"), words(&moved, "M3")], "{moved}");
    // With a cut behind the call, the tool comes to it from there.
    let begins = |from: &str| {
        format!(
            "UNITS/MM\nMULTAX/ON\n{from}LOADTL/7\nSPINDL/3000,RPM,CLW\nFEDRAT/600,MMPM\nGOTO/5,0,50,0.2,0,1\nRAPID\nGOTO/0,0,60\nFINI"
        )
    };
    assert!(stage.refused(&begins("")).contains("the tool begins with a cut"));
    let reached = stage.reached(&stage.post(&begins("FROM/0,0,90,0.2,0,1\n")).text);
    assert!(reached[0].is_rapid && (reached[0].cl.tip.z - 90.0).abs() < 1e-3, "{}", reached[0].cl.tip);
    let notes: Vec<&str> = with.report.notes.iter().map(|note| note.text.as_str()).collect();
    for word in ["FROM before the tool is called", "GOHOME: the tool goes home"] {
        assert!(notes.iter().any(|note| note.starts_with(word)), "{notes:?}");
    }
}

/// The places of a cycle are passed above, and the program says that nothing is done there.
#[test]
fn a_cycle_is_reported_and_its_places_are_passed_above() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let text = format!(
        "{HEAD}CYCLE/INIT\nCYCLE/DRILL,FEDTO,10.,MMPM,275.59,RAPTO,3.,RTRCTO,25.\nGOTO/0,0,20,0.2,0,1\nGOTO/10,0,20\n\
         CYCLE/OFF\nRAPID\nGOTO/10,0,60\nFINI"
    );
    let posted = stage.post(&text);
    assert!(posted.is_as_meant && !posted.report.is_clean());
    let faults: Vec<(Option<u32>, &str)> = posted.report.faults.iter().map(|f| (f.line, f.text.as_str())).collect();
    assert!(faults.len() == 1 && faults[0].0 == Some(9) && faults[0].1.contains("2 places are passed 25 mm above"));
    assert!(posted.text.contains("(NOT WRITTEN: CYCLE/DRILL"), "{}", posted.text);
    for r in stage.reached(&posted.text) {
        assert!(r.is_rapid && r.cl.tip.z >= 20.0 + 24.0, "{}", r.cl.tip);
    }
    let at_rapid = text.replace("GOTO/10,0,20\n", "RAPID\nGOTO/10,0,20\n");
    assert!(stage.reached(&stage.post(&at_rapid).text).iter().all(|r| r.cl.tip.z >= 20.0 + 24.0));
    let low = text.replace(",RAPTO,3.,RTRCTO,25.", "");
    assert!(stage.refused(&low).starts_with("line 9: the cycle says no height above its places"));
}

#[test]
fn a_file_that_begins_or_ends_in_a_cut_needs_a_retract() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let text = "LOADTL/7\nSPINDL/3000,RPM,CLW\nMULTAX/ON\nFEDRAT/600,MMPM\nGOTO/0,0,50,0.3,0,1\nGOTO/5,0,50\nFINI";
    assert!(stage.refused(text).starts_with("line 5: the tool begins with a cut, and would come to it at rapid rate"));
    let options = PostOptions { retract: Some(20.0), ..PostOptions::new("test") };
    let posted = stage.post_with(text, &options).unwrap();
    let reached = stage.reached(&posted.text);
    for (end, cut) in [(&reached[0], &reached[1]), (&reached[reached.len() - 1], &reached[reached.len() - 2])] {
        assert!(end.is_rapid && ((end.cl.tip - cut.cl.tip).norm() - 20.0).abs() < 2e-3);
        let way = (end.cl.tip - cut.cl.tip).normalize();
        assert!(way.dot(&cut.cl.axis) > 1.0 - 1e-6);
    }
    let begun = text.replace("FEDRAT/600", "FROM/0,0,80,0.3,0,1\nFEDRAT/600");
    assert!(stage.refused(&begun).starts_with("line 7: the tool ends in a cut, and would go home"));
    assert!(stage.post(&begun.replace("FINI", "RAPID\nGOTO/5,0,80\nFINI")).report.is_clean());
}

/// A tool file that is not the tool of the file is a fault, unless that is meant; the program is
/// written.
#[test]
fn another_cutter_is_a_fault_and_another_sense_of_the_spindle_a_note() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let cut = "GOTO/0,0,50\nRAPID\nGOTO/0,0,60\n";
    let text = format!("CUTTER/12,0\n{}{cut}FINI", HEAD.replace("CLW", "CCLW"));
    let is_cutter =
        |n: &PostNote| n.line == Some(1) && n.text.starts_with("ANOTHER CUTTER: CUTTER has diameter 12.000");
    let posted = stage.post(&text);
    assert!(posted.is_as_meant && !posted.report.is_clean());
    assert!(posted.report.faults.len() == 1 && is_cutter(&posted.report.faults[0]), "{:?}", posted.report.faults);
    let notes = &posted.report.notes;
    assert!(notes.len() == 1 && notes[0].text.starts_with("the spindle turns against the sense"), "{notes:?}");
    let meant_for = |number: u32| PostOptions { other_cutters: vec![number], ..PostOptions::new("test") };
    assert!(!stage.post_with(&text, &meant_for(8)).unwrap().report.is_clean(), "that of another tool");
    let meant = stage.post_with(&text, &meant_for(7)).unwrap();
    assert!(meant.report.is_clean() && meant.report.notes.iter().any(is_cutter), "{:?}", meant.report.notes);
    assert_eq!(meant.text, posted.text);
    let later = format!("{HEAD}SPINDL/CCLW\nGOTO/0,0,50\nRAPID\nGOTO/0,0,60\nFINI");
    let posted = stage.post(&later);
    assert!(posted.text.contains("S3000 M4"), "{}", posted.text);
    assert!(posted.report.notes.iter().any(|n| n.text.starts_with("the spindle turns against the sense")));
    let whole = format!("CUTTER/20,1\n{HEAD}{cut}FINI");
    assert_eq!(stage.post(&whole).report.notes, []);
    let cut_off = stage.post(HEAD).report.notes;
    assert!(cut_off.iter().any(|n| n.text.starts_with("FINI is missing")), "{cut_off:?}");
}

/// Cutters of NX and of Creo count as that of CUTTER does, also that of a later operation with the
/// same tool.
#[test]
fn cutters_of_other_systems_are_compared_with_the_tool() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let another = |cutter: &str| {
        let report = stage.post(&format!("{HEAD}{cutter}\nGOTO/0,0,50\nRAPID\nGOTO/0,0,60\nFINI")).report;
        let found = report.faults.into_iter().filter(|n| n.text.starts_with("ANOTHER CUTTER: "));
        found.map(|n| (n.line.unwrap(), n.text["ANOTHER CUTTER: ".len()..].to_owned())).collect::<Vec<_>>()
    };
    for same in
        ["TLDATA/MILL,20.0000,1.0000,75.0000,0.0000,0.0000", "$$-> CUTTER / 20.000000", "CUTTER/20,1,9,1,0,0,50"]
    {
        assert_eq!(another(same), [], "{same}");
    }
    for (other, expected) in [
        (
            "TLDATA/MILL,50.0,5.0,75.0,0.0,0.0",
            "TLDATA/MILL has diameter 50.000 and corner radius 5.000 mm, the file of T7 diameter 20.000 and corner radius \
             1.000 mm",
        ),
        (
            "$$-> CUTTER / 12.0",
            "CUTTER of Creo has diameter 12.000 mm, the file of T7 diameter 20.000 and corner radius 1.000 mm",
        ),
        ("TLDATA/MILL,20,1,75,3,0", "TLDATA/MILL has an angle of 3 deg at its side, the file of T7 none"),
        (
            "CUTTER/20,1,5,1",
            "CUTTER has the centre of its corner 5.000 mm from the axis and 1.000 mm above the tip, the file of T7 9.000 and \
             1.000 mm",
        ),
        (
            "CUTTER/20",
            "CUTTER has diameter 20.000 mm and no corner radius, the file of T7 diameter 20.000 and corner radius 1.000 mm",
        ),
        ("CUTTER/20,1,9,1,2", "CUTTER has an angle of 2 deg at its bottom, the file of T7 none"),
        ("TLDATA/DRILL,MILL,20,0,80,118,35", "TLDATA/DRILL is no mill, and the file of T7 is one"),
    ] {
        assert_eq!(another(other), [(8, expected.to_owned())], "{other}");
    }
    // Rounding of an inch file, a name in place of a diameter.
    for same in ["CUTTER/20.009,1", "$$-> CUTTER / MILL_A"] {
        assert_eq!(another(same), [], "{same}");
    }
    let words = stage.post(&format!("$$ a\n$$-> CUTTER / 20\n{HEAD}FINI")).report.words;
    let treatments: Vec<_> = words.iter().take(2).map(|w| (w.word.as_str(), w.treatment)).collect();
    assert_eq!(treatments, [("$$", Treatment::NoEffect), ("$$-> CUTTER", Treatment::Applied)]);
}

/// A point that repeats the one before is not written again.
#[test]
fn repeated_points_are_counted_and_left_out() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let posted = stage.post(&format!("{HEAD}GOTO/1,0,50\nGOTO/1,0,50\nGOTO/1,0,50\nRAPID\nGOTO/1,0,60\nFINI"));
    assert_eq!((posted.report.tools[0].points, posted.report.tools[0].repeated), (5, 2));
    assert_eq!(motions(&posted.text).len(), 3);
}

/// The same path in the forms of three systems gives the same positions.
#[test]
fn files_of_three_systems_are_posted_alike() {
    let nx = "$$ UNITS\nUNITS/MM\nTOOL PATH/CONTOUR,TOOL,MILL_20\nTLDATA/MILL,20.0000,1.0000,75.0000,0.0000,0.0000\n\
              MSYS/0.0000,0.0000,0.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000\nMULTAX/ON\n\
              LOADTL/7\n$$ centerline data\nPAINT/PATH\nPAINT/SPEED,10\nSPINDL/RPM,3000,CLW\nRAPID\n\
              GOTO/0.0000,0.0000,60.0000,0.0000000,0.0000000,1.0000000\nFEDRAT/MMPM,600.0000\n\
              GOTO/10.0000,0.0000,50.0000\nCIRCLE/0.0000,0.0000,50.0000,0.0000000,0.0000000,1.0000000,10.0000,0.06,0.5,20,0\n\
              GOTO/0.0000,10.0000,50.0000\nRAPID\nGOTO/0.0000,10.0000,60.0000\nEND-OF-PATH\nFINI\n";
    let catia = "$$ -----\nPARTNO PART OPERATION\n$$*CATIA0\nCATPROCESS\nPPRINT OPERATION NAME : CONTOUR\n\
                 TPRINT/T1 MILL D 20,,T1\nCUTTER/ 20.000000,  1.000000,  9.000000,  1.000000,  0.000000,$\n  0.000000, 50.000000\n\
                 MULTAX\nLOADTL/7,1\nSPINDL/ 3000.0000,RPM,CLW\nRAPID\n\
                 GOTO  /    0.00000,    0.00000,   60.00000, 0.000000, 0.000000, 1.000000\nFEDRAT/  600.0000,MMPM\n\
                 GOTO  /   10.00000,    0.00000,   50.00000, 0.000000, 0.000000, 1.000000\nAUTOPS\n\
                 INDIRV/    0.00000,    1.00000,    0.00000\n\
                 TLON,GOFWD/ (CIRCLE/    0.00000,    0.00000,   50.00000,$\n   10.00000),ON,2,INTOF,$\n\
                 (LINE/    0.00000,    0.00000,   50.00000,$\n      0.00000,   10.00000,   50.00000)\nRAPID\n\
                 GOTO  /    0.00000,   10.00000,   60.00000, 0.000000, 0.000000, 1.000000\nFINI\n";
    let creo = "$$*         Pro/CLfile\n$$-> MFGNO / MFG0001\nPARTNO / MFG0001\n$$-> FEATNO / 17\nMACHIN / UNCX01, 1\n\
                $$-> CUTCOM_GEOMETRY_TYPE / OUTPUT_ON_CENTER\nUNITS / MM\nLOADTL / 7\n$$-> CUTTER / 20.000000\n\
                $$-> CSYS / 1.0000000000, 0.0000000000, 0.0000000000, 0.0000000000, $\n\
                0.0000000000, 1.0000000000, 0.0000000000, 0.0000000000\nMULTAX / ON\n\
                SPINDL / RPM, 3000.000000,  CLW\nRAPID\nGOTO / 0.0000000000, 0.0000000000, 60.0000000000, $\n\
                0.0000000000, 0.0000000000, 1.0000000000\nFEDRAT / 600.000000,  MMPM\n\
                GOTO / 10.0000000000, 0.0000000000, 50.0000000000\nCIRCLE / 0.0000000000, 0.0000000000, 50.0000000000, $\n\
                0.0000000000, 0.0000000000, 1.0000000000, 10.0000000000\nGOTO / 0.0000000000, 10.0000000000, 50.0000000000\n\
                RAPID\nGOTO / 0.0000000000, 10.0000000000, 60.0000000000\n$$-> END /\nFINI\n";
    let stage = Stage::fanuc("head-b-table-c", 3);
    let all = [nx, catia, creo].map(|text| {
        let posted = stage.post(text);
        assert!(posted.report.is_clean(), "{:?}", posted.report.faults);
        // CATIA gives no unit.
        let n_notes = usize::from(!text.contains("UNITS"));
        assert_eq!(posted.report.notes.len(), n_notes, "{:?}", posted.report.notes);
        motions(&posted.text).into_iter().map(|m| (m.is_rapid, m.words)).collect::<Vec<_>>()
    });
    assert!(all[0].len() > 15);
    assert_eq!(all[0], all[1]);
    assert_eq!(all[0], all[2]);
}

/// Lines of a program without their numbers.
fn lines(text: &str) -> Vec<&str> {
    text.lines().map(|l| l.split_once(' ').filter(|(n, _)| n.starts_with('N')).map_or(l, |(_, rest)| rest)).collect()
}

/// A stop is written wherever the file has one, with spindle and coolant off before the first move
/// and on again behind it.
#[test]
fn a_stop_is_written_before_and_behind_a_tool_change() {
    let mut stage = Stage::fanuc("head-b-table-c", 3);
    stage.tools.push(tool(9, 120.0));
    let head = format!("{HEAD}COOLNT/ON\nGOTO/0,0,50\nRAPID\nGOTO/0,0,60\n");
    let rest = "SPINDL/1500,RPM,CLW\nRAPID\nGOTO/5,0,60\nGOTO/5,0,50\nRAPID\nGOTO/5,0,60\nFINI";
    let stops = |text: &str| {
        let posted = stage.post(text);
        assert!(posted.report.is_clean(), "{:?}", posted.report.faults);
        let lines: Vec<String> = lines(&posted.text).into_iter().map(str::to_owned).collect();
        let at: Vec<usize> = (0..lines.len()).filter(|k| lines[*k] == "M0").collect();
        let change = lines.iter().position(|l| l.contains("T9 M6")).expect("the second tool");
        (at, change, lines)
    };
    let (without, _, _) = stops(&format!("{head}LOADTL/9\n{rest}"));
    assert!(without.is_empty());
    let (at, change, _) = stops(&format!("{head}STOP\nLOADTL/9\n{rest}"));
    assert!(at.len() == 1 && at[0] < change, "{at:?}");
    // The header of a tool comes to its first point: the stop is before the tool change, with the
    // spindle off.
    let (at, change, lines) = stops(&format!("{head}LOADTL/9\nSTOP\n{rest}"));
    assert!(at.len() == 1 && at[0] < change, "{at:?}");
    assert_eq!(&lines[at[0] - 3..at[0]], ["G0 Z1360.", "M5", "M9"], "{lines:?}");
    let (at, change, lines) = stops(&format!("STOP\n{head}LOADTL/9\n{rest}"));
    assert!(at.len() == 1 && at[0] < change, "{at:?}");
    assert_eq!(&lines[at[0] - 1..at[0] + 2], ["M5", "M0", "S3000 M3"], "{lines:?}");
    assert!(lines[..at[0]].iter().all(|l| !l.starts_with("G1 ")), "{lines:?}");
}

/// Some controls switch spindle and coolant off at a stop: both are on again before the next cut.
#[test]
fn spindle_and_coolant_go_on_behind_a_stop() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let text = format!("COOLNT/MIST\n{HEAD}GOTO/0,0,50\nSTOP\nGOTO/5,0,50\nRAPID\nGOTO/5,0,60\nFINI");
    let posted = stage.post(&text);
    let lines = lines(&posted.text);
    let at = lines.iter().position(|l| *l == "M0").expect("the stop");
    assert_eq!(&lines[at + 1..at + 3], ["S3000 M3", "M7"], "{lines:?}");
    // A spindle that is off stays off.
    let off = format!("{HEAD}SPINDL/OFF\nSTOP\nRAPID\nGOTO/5,0,60\nFINI");
    let posted = stage.post(&off);
    let at = posted.text.lines().position(|l| l.ends_with(" M0")).expect("the stop");
    assert!(posted.text.lines().skip(at).all(|l| !l.ends_with("M3")), "{}", posted.text);
    // Its first SPINDL behind a stop is written there.
    let late = "LOADTL/7\nRAPID\nGOTO/0,0,60\nSTOP\nSPINDL/900,RPM\nFEDRAT/100,MMPM\nGOTO/0,0,50\nRAPID\n\
                GOTO/0,0,60\nFINI";
    let posted = stage.post(late);
    let at = posted.text.lines().position(|l| l.ends_with(" M0")).expect("the stop");
    assert!(posted.text.lines().skip(at).any(|l| l.ends_with("S900 M3")), "{}", posted.text);
}

/// SPINDL/OFF holds over a tool change until another SPINDL.
#[test]
fn a_spindle_that_is_said_off_is_not_started_by_the_next_tool() {
    let mut stage = Stage::fanuc("head-b-table-c", 3);
    stage.tools.push(tool(9, 120.0));
    let head = format!("{HEAD}GOTO/0,0,50\nRAPID\nGOTO/0,0,60\nSPINDL/OFF\nLOADTL/9\n");
    let cut = "GOTO/0,0,50\nRAPID\nGOTO/0,0,60\nFINI";
    let why = stage.refused(&format!("{head}RAPID\nGOTO/0,0,60\n{cut}"));
    assert!(why.starts_with("line 15: the tool cuts with the spindle off"), "{why}");
    let why = stage.refused(&format!("{head}RAPID\nGOTO/0,0,60\nFINI"));
    assert!(why.starts_with("line 14: the tool moves behind SPINDL/OFF"), "{why}");
    for on in ["SPINDL/ON", "SPINDL/900,RPM,CLW"] {
        let posted = stage.post(&format!("{head}RAPID\nGOTO/0,0,60\n{on}\n{cut}"));
        // Off at the first point of the tool, on at its cut.
        let lines = lines(&posted.text);
        let change = lines.iter().position(|l| l.contains("T9 M6")).expect("the tool");
        let places = |word: &str| (change..lines.len()).filter(|k| lines[*k].ends_with(word)).collect::<Vec<_>>();
        let (starts, offs) = (places("M3"), places("M5"));
        assert!(starts.len() == 2 && starts[0] < offs[0] && offs[0] < starts[1], "{lines:?}");
    }
}
