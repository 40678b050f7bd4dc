//! Laws of APT cutter-location files.

use std::path::Path;

use facemill_cl_data::ClPoint;
use facemill_cl_file::*;
use facemill_nc_program::*;
use facemill_test_kit::{Random, SHARED_NC};
use nalgebra::{Point3, Unit, Vector3};

fn spec(moves: Vec<AptMove>) -> AptSpec {
    AptSpec {
        part_name: "Blade $1 (Prüfung)".to_owned(),
        tool_number: 7,
        cutter: AptCutter { radius: 80.0, corner_radius: 6.0, height: 50.0 },
        spindle: SpindleSpec { rpm: 350.0, clockwise: false },
        coolant: Coolant::Flood,
        moves,
    }
}

fn random_cl(random: &mut Random) -> ClPoint {
    let mut coordinate = || (random.unit() - 0.5) * 2e4;
    let tip = Point3::new(coordinate(), coordinate(), coordinate());
    let axis = Vector3::new(coordinate(), coordinate(), coordinate());
    ClPoint { tip, axis: Unit::try_new(axis, 1e-6).unwrap_or(Vector3::z_axis()) }
}

#[test]
fn what_is_written_is_read() {
    let mut random = Random(21);
    let moves: Vec<AptMove> = (0..2000)
        .map(|_| match random.below(4) {
            0 => AptMove::Rapid(random_cl(&mut random)),
            _ => AptMove::Linear { cl: random_cl(&mut random), feed: [100.0, 0.25, 3333.3333][random.below(3)] },
        })
        .collect();
    let text = write_apt(&spec(moves.clone())).unwrap();
    assert!(text.lines().all(|line| line.len() <= 72 && line.is_ascii()));
    let file = read_apt(&text).unwrap();
    assert_eq!(file.unknown, []);
    assert_eq!(file.points.len(), moves.len());
    for (step, point) in moves.iter().zip(&file.points) {
        let (cl, feed) = match step {
            AptMove::Rapid(cl) => (cl, None),
            AptMove::Linear { cl, feed } => (cl, Some(*feed)),
            other => unreachable!("{other:?}"),
        };
        assert_eq!(point.kind, if feed.is_some() { AptPointKind::Linear } else { AptPointKind::Rapid });
        assert!((cl.tip - point.cl.tip).amax() <= 0.5e-9 + 1e-11);
        assert!((cl.axis.into_inner() - point.cl.axis.into_inner()).norm() < 1e-12);
        assert!((feed.unwrap_or(0.0) - point.feed.unwrap_or(0.0)).abs() <= 0.0005 + 1e-10);
    }
}

/// The axis is a unit vector in the text already, for readers that do not normalise.
#[test]
fn written_axes_are_unit_to_a_trillionth() {
    let mut random = Random(22);
    let moves = (0..2000).map(|_| AptMove::Rapid(random_cl(&mut random))).collect();
    let text = write_apt(&spec(moves)).unwrap().replace("$\n", "");
    let mut count = 0;
    for values in text.lines().filter_map(|line| line.strip_prefix("GOTO/")) {
        let values: Vec<f64> = values.split(',').map(|v| v.parse().unwrap()).collect();
        let norm = values[3..].iter().map(|v| v * v).sum::<f64>().sqrt();
        assert!(values.len() == 6 && (norm - 1.0).abs() < 1e-12);
        count += 1;
    }
    assert_eq!(count, 2000);
}

#[test]
fn header_says_part_unit_cutter_tool_spindle_and_coolant() {
    let cl = ClPoint { tip: Point3::new(1.0, -2.5, -0.0), axis: Vector3::z_axis() };
    let moves = vec![
        AptMove::Comment("pass 1".to_owned()),
        AptMove::Rapid(cl),
        AptMove::Linear { cl, feed: 500.0 },
        AptMove::Linear { cl, feed: 500.0 },
    ];
    let expected = "\
PARTNO/Blade ?1 (Pr?fung)
UNITS/MM
MULTAX/ON
CUTTER/160.,6.,74.,6.,0.,0.,50.
LOADTL/7
SPINDL/350.,RPM,CCLW
COOLNT/FLOOD
PPRINT/pass 1
RAPID
GOTO/1.,-2.5,0.,0.,0.,1.
FEDRAT/500.,MMPM
GOTO/1.,-2.5,0.,0.,0.,1.
GOTO/1.,-2.5,0.,0.,0.,1.
COOLNT/OFF
SPINDL/OFF
FINI
";
    let text = write_apt(&spec(moves)).unwrap();
    assert_eq!(text, expected);
    let meanings: Vec<_> = read_apt(&text).unwrap().statements.into_iter().map(|s| s.meaning).collect();
    let mill = FileMill {
        word: CutterWord::Cutter,
        diameter: 160.0,
        corner_radius: Some(6.0),
        corner_center: [74.0, 6.0],
        bottom_deg: 0.0,
        side_deg: 0.0,
    };
    assert_eq!(meanings[3], AptMeaning::Cutter(FileCutter::Mill(mill)));
    assert_eq!(meanings[5], AptMeaning::Spindle { rpm: 350.0, clockwise: false });
    assert_eq!(meanings.last(), Some(&AptMeaning::End));
}

#[test]
fn what_cannot_be_written_is_refused() {
    let at = |x: f64| ClPoint { tip: Point3::new(x, 0.0, 0.0), axis: Vector3::z_axis() };
    let write = |step: AptMove| write_apt(&spec(vec![step])).unwrap_err();
    assert_eq!(write(AptMove::Rapid(at(f64::NAN))), WriteError::Coordinate { index: 0 });
    for feed in [0.0, -1.0, f64::NAN, 1e-4] {
        assert!(matches!(write(AptMove::Linear { cl: at(0.0), feed }), WriteError::Number { .. }), "{feed}");
    }
}

#[test]
fn other_forms_are_understood() {
    let text = "$$ made elsewhere
PARTNO/PART 5
units / inches
FROM/0,0,1
FEDRAT/IPM,10
GOTO / 1.0, 2., $ the rest
  3E0, 0, 0, 2
GODLTA/0,0,-1
RAPID/
GOTO/0,0,5
CIRCLE/0,0,0,0,0,1,5
GOTO/5,0,0
CYCLE/DRILL,FEDTO,1.
GOTO/7,0,0
CYCLE/OFF
MULTAX/OFF
GOTO/8,0,0 $$ last
CSYS/1,0,0
CSYS/2,0,0
FINI";
    let file = read_apt(text).unwrap();
    let kinds: Vec<_> = file.points.iter().map(|p| p.kind).collect();
    use AptPointKind::{Arc, Cycle, Linear, Rapid, Start};
    assert_eq!(kinds, [Start, Linear, Linear, Rapid, Arc, Cycle, Linear]);
    assert!((file.points[1].cl.tip - Point3::new(25.4, 50.8, 76.2)).norm() < 1e-12);
    assert_eq!((file.points[1].line, file.points[1].feed), (6, Some(254.0)));
    assert!((file.points[2].cl.tip - Point3::new(25.4, 50.8, 50.8)).norm() < 1e-12);
    assert!(file.points.iter().all(|p| p.cl.axis == Vector3::z_axis()));
    assert_eq!(file.unknown, [AptUnknownWord { word: "CSYS".to_owned(), line: 18, count: 2 }]);
}

#[test]
fn points_know_the_frame_that_they_are_given_in() {
    let text = "UNITS/CM
GOTO/1,2,3
CSYS/0,-1,0,4,1,0,0,5,0,0,1,6
TRNTYP/WORLD,0,0,0
CUTCOM/LEFT
GOTO/1,2,3
CUTCOM/OFF
SETUP/START,1
SETUP/END,1
CSI_SET_FLUTE_LENGTH/73.
CSYS/FIXTURE
GOTO/1,2,4
FINI";
    let file = read_apt(text).unwrap();
    let rows = [0.0, -1.0, 0.0, 40.0, 1.0, 0.0, 0.0, 50.0, 0.0, 0.0, 1.0, 60.0];
    let meanings: Vec<_> = file.statements.iter().map(|s| s.meaning.clone()).collect();
    assert_eq!(meanings[2], AptMeaning::Frame(Some(Box::new(rows))));
    assert_eq!(file.points.iter().map(|p| p.frame).collect::<Vec<_>>(), [None, Some(2), Some(2)]);
    assert_eq!(meanings[3..5], [AptMeaning::Frame(None), AptMeaning::RadiusCompensation(true)]);
    assert_eq!(meanings[6..10].iter().filter(|m| **m == AptMeaning::Setup(true)).count(), 1);
    assert_eq!(file.unknown, [AptUnknownWord { word: "CSYS".to_owned(), line: 11, count: 1 }]);
    assert!(read_apt("CSYS/1,0,0,0,0,1,0,0,0,0,1,x").unwrap_err().to_string().starts_with("line 1, column 28: `x`"));
}

#[test]
fn arcs_of_all_forms_are_the_same() {
    let about_z =
        AptArc { center: Point3::new(25.4, 0.0, 0.0), axis: Vector3::z_axis(), radius: Some(25.4), angle: None };
    let start = "UNITS/INCHES\nGOTO/2,0,0\n";
    for (arc, angle) in [
        ("CIRCLE/1,0,0,0,0,2,1\nGOTO/1,1,0", None),
        ("MOVARC/1,0,0,0,0,1,1,ANGLE,90\nGOTO/1,1,0", Some(std::f64::consts::FRAC_PI_2)),
        ("MOVARC/CENTER,1,0,0,AXIS,0,0,1,RADIUS,1,ANGLE,90\nGOTO/1,1,0", Some(std::f64::consts::FRAC_PI_2)),
        ("AUTOPS\nINDIRV/0,1,0\nTLON,GOFWD/ (CIRCLE/ 1, 0, 0,$\n 1),ON,(LINE/1,0,0,1,1,0)", None),
    ] {
        let file = read_apt(format!("{start}{arc}\nGOTO/0,0,0\nFINI")).unwrap();
        assert_eq!(file.unknown, [], "{arc}");
        assert_eq!(file.arcs, [AptArc { angle, ..about_z }], "{arc}");
        let kinds: Vec<_> = file.points.iter().map(|p| (p.kind, p.arc)).collect();
        use AptPointKind::{Arc, Linear};
        assert_eq!(kinds, [(Linear, None), (Arc, Some(0)), (Linear, None)], "{arc}");
        assert!((file.points[1].cl.tip - Point3::new(25.4, 25.4, 0.0)).norm() < 1e-12);
    }
    let rapid = read_apt("FEDRAT/100\nGOTO/1,0,0\nRAPID\nCIRCLE/0,0,0,0,0,1\nGOTO/0,1,0\nGOTO/0,2,0").unwrap();
    let kinds: Vec<_> = rapid.points.iter().map(|p| (p.kind, p.feed.is_some())).collect();
    assert_eq!(kinds[1..], [(AptPointKind::Arc, true), (AptPointKind::Linear, true)]);
    let by_name = read_apt("GOTO/0,0,0\nCIRCLE/C1\nGOTO/1,0,0").unwrap();
    assert_eq!((by_name.points[1].kind, by_name.points[1].arc), (AptPointKind::Arc, None));
}

#[test]
fn a_feed_per_revolution_follows_the_spindle() {
    let text = "SPINDL/RPM,1000,CLW\nFEDRAT/MMPR,0.2\nGOTO/0,0,0\nSPINDL/500\nGOTO/1,0,0\nFEDRAT/0.1,IPR\n\
                GOTO/2,0,0\nFEDRAT/100,PERMIN\nGOTO/3,0,0\nFEDRAT/7\nGOTO/4,0,0";
    let file = read_apt(text).unwrap();
    let feeds: Vec<f64> = file.points.iter().map(|p| p.feed.unwrap()).collect();
    let expected = [200.0, 100.0, 0.1 * 25.4 * 500.0, 100.0, 7.0];
    assert!(feeds.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{feeds:?}");
}

/// The values of CUTTER and TLDATA have orders of their own; Creo's comment has the diameter alone.
#[test]
fn cutters_of_three_systems_are_the_same_mill() {
    let text = "UNITS/INCHES\nCUTTER/2,0.25,0.75,0.25,3,5,4\nTLDATA/MILL,2.0,0.25,4.0,5.0,3.0,0.75,0.25\n\
                $$-> CUTTER / 2.0\nTLDATA/DRILL,MILL,10.0,0.0,80.0,118.0,35.0\nCUTTER/2\n$$-> CUTTERS / 2\nTLDATA";
    let file = read_apt(text).unwrap();
    let of = |k: usize| match &file.statements[k].meaning {
        AptMeaning::Cutter(FileCutter::Mill(mill)) => *mill,
        other => panic!("{other:?}"),
    };
    let whole = FileMill {
        word: CutterWord::Cutter,
        diameter: 50.8,
        corner_radius: Some(6.35),
        corner_center: [0.75 * 25.4, 6.35],
        bottom_deg: 3.0,
        side_deg: 5.0,
    };
    assert_eq!(of(1), whole);
    assert_eq!(of(2), FileMill { word: CutterWord::Tldata, ..whole });
    let bare = FileMill { corner_radius: None, corner_center: [0.0; 2], bottom_deg: 0.0, side_deg: 0.0, ..whole };
    assert_eq!(of(3), FileMill { word: CutterWord::Creo, ..bare });
    assert_eq!(of(5), bare);
    assert_eq!(file.statements[4].meaning, AptMeaning::Cutter(FileCutter::Other("DRILL".to_owned())));
    assert_eq!(file.statements[6].meaning, AptMeaning::Comment);
    assert_eq!(file.statements[7].meaning, AptMeaning::Auxiliary);
}

/// Cutters before UNITS have its unit; a comment with a name is no cutter.
#[test]
fn a_cutter_before_units_is_in_the_unit_of_the_file() {
    let meaning = |text: &str, k: usize| read_apt(text).unwrap().statements[k].meaning.clone();
    let cutters = "CUTTER/2,0.25,0.75,0.25,3,5,4\nTLDATA/MILL,2.0,0.25,4.0,5.0,3.0,0.75,0.25\n$$-> CUTTER / 2.0\n";
    for k in 0..3 {
        let behind = meaning(&format!("UNITS/INCHES\n{cutters}GOTO/1,2,3"), k + 1);
        assert!(matches!(&behind, AptMeaning::Cutter(FileCutter::Mill(mill)) if mill.diameter == 2.0 * 25.4));
        assert_eq!(meaning(&format!("{cutters}UNITS/INCHES\nGOTO/1,2,3"), k), behind);
        // A second UNITS does not change what was before it.
        assert_eq!(meaning(&format!("UNITS/INCHES\n{cutters}UNITS/MM\nGOTO/1,2,3"), k + 1), behind);
    }
    for name in ["$$-> CUTTER / MILL_A", "$$-> CUTTER /", "$$-> CUTTER"] {
        assert_eq!(meaning(name, 0), AptMeaning::Comment, "{name}");
    }
}

#[test]
fn tool_axes_that_are_taken_in_another_way_than_written_are_remarked_once() {
    let text = "MULTAX/ON\nGOTO/0,0,0,0,0,1\nGOTO/0,0,0,0,0,5\nGOTO/0,0,1,0,3,0\nMULTAX/OFF\nGOTO/1,2,3\nGOTO/1,2,3,0,0,1\n\
                GOTO/1,2,3,0,0,1";
    let file = read_apt(text).unwrap();
    let lines: Vec<u32> = file.remarks.iter().map(|(line, _)| *line).collect();
    assert_eq!(lines, [3, 7], "{:?}", file.remarks);
    assert_eq!(file.points[2].cl.axis.into_inner(), nalgebra::Vector3::y());
    let why = read_apt("GOTO/5,0,0\nCIRCLE/0,0,0,0,0,1,5,TIMES,1").unwrap_err().to_string();
    assert!(why.starts_with("line 2") && why.contains("TIMES (several turns) is not followed"), "{why}");
}

#[test]
fn a_statement_of_a_megabyte_is_refused_with_its_line() {
    let long = "1,".repeat(500_000);
    let joined = format!("GOTO/1,2,3\nGOTO/{}", "1,$\n".repeat(60_000));
    for text in [format!("GOTO/1,2,3\nGOTO/{long}"), format!("PARTNO/A\nPPRINT/{long}\nFINI"), joined] {
        let why = read_apt(text).unwrap_err();
        assert!(why.line == 2 && why.to_string().contains(": it has more than 100,000 characters"), "{why}");
    }
    // As long as it may be.
    assert!(read_apt(format!("PPRINT/{}\nGOTO/1,2,3", "1".repeat(99_000))).is_ok());
}

/// A unit beside the file is that of a file without UNITS, and is not overridden.
#[test]
fn a_unit_beside_the_file_is_as_units_at_its_beginning() {
    let text = "CUTTER/1,0.1\nFEDRAT/10\nGOTO/1,2,3\nCSYS/1,0,0,4,0,1,0,5,0,0,1,6\nGOTO/0,0,1";
    for (unit, word) in [(ClUnit::Millimetre, "MM"), (ClUnit::Inch, "INCHES"), (ClUnit::Centimetre, "CM")] {
        let said = read_apt(format!("UNITS/{word}\n{text}")).unwrap();
        let given = read_apt_in(text, Some(unit)).unwrap();
        let meanings = |file: &AptFile| file.statements.iter().map(|s| s.meaning.clone()).collect::<Vec<_>>();
        assert_eq!(meanings(&said)[1..], meanings(&given), "{word}");
        let points = |file: &AptFile| file.points.iter().map(|p| (p.cl, p.feed)).collect::<Vec<_>>();
        assert_eq!(points(&said), points(&given), "{word}");
        assert_eq!(points(&said), points(&read_apt_in(format!("UNITS/{word}\n{text}"), Some(unit)).unwrap()));
        assert_eq!(unit_note(&said), None);
        assert_eq!(
            unit_note(&given),
            Some(format!("UNITS is missing: lengths are in {unit}, the unit given beside the file"))
        );
    }
    assert_eq!(unit_note(&read_apt(text).unwrap()).as_deref(), Some("UNITS is missing: lengths are taken as mm"));
    let why = read_apt_in("GOTO/1,2,3\nUNITS/MM", Some(ClUnit::Inch)).unwrap_err().to_string();
    assert_eq!(why, "line 2, column 1: UNITS: it is not the unit that was given beside the file; leave that out");
}

/// A tool is called with the register of its length by several systems.
#[test]
fn calls_of_tools_have_their_length_registers() {
    for (call, expected) in [
        ("LOADTL/7", (7, None)),
        ("LOAD/TOOL,7,ADJUST,9", (7, Some(9))),
        ("LOADTL/7,OSETNO,9", (7, Some(9))),
        ("LOADTL / 7, LENGTH, 5.000000, OSETNO, 9", (7, Some(9))),
        ("LOADTL/7,adjust,9.00", (7, Some(9))),
        ("LOADTL/7,ADJUST,10", (7, Some(10))),
        ("LOADTL/7,ADJUST,NONE", (7, Some(0))),
        ("LOADTL/7,ADJUST,OFF", (7, Some(0))),
        ("LOADTL/7,ADJUST,ON", (7, None)),
        ("LOADTL/7,ADJUST,NOTE", (7, None)),
        ("LOADTL/7,ADJUST", (7, None)),
        ("LOADTL/7,1", (7, None)),
    ] {
        let (number, length_register) = expected;
        let meaning = read_apt(call).unwrap().statements.remove(0).meaning;
        assert_eq!(meaning, AptMeaning::Tool { number, length_register }, "{call}");
    }
    let why = read_apt("LOADTL/ADJUST,9").unwrap_err().to_string();
    assert_eq!(why, "line 1, column 1: LOADTL: expected a tool number");
}

/// Creo's frames are comments over several lines.
#[test]
fn comments_of_creo_go_on_over_lines() {
    let text = "$$-> CSYS / 1.0, 0.0, 0.0, 0.0, $\n            0.0, 1.0, 0.0, 0.0, $\n            0.0, 0.0, 1.0, 0.0\n\
                $$ ends in $\nGOTO / 1.0, 2.0, $\n3.0\nFINI";
    let file = read_apt(text).unwrap();
    assert_eq!(file.unknown, []);
    assert_eq!(file.statements.len(), 4);
    assert_eq!(&*file.statements[0].text, "$$-> CSYS / 1.0, 0.0, 0.0, 0.0,0.0, 1.0, 0.0, 0.0,0.0, 0.0, 1.0, 0.0");
    assert_eq!(file.points[0].cl.tip, Point3::new(1.0, 2.0, 3.0));
}

#[test]
fn words_of_the_machine_are_told_apart() {
    let text = "COOLNT/ON\nCOOLNT/THRU\nCOOLNT/OFF\nSPINDL/OFF\nSPINDL/ON\nDELAY/2.5\nDELAY/3,REV\nSTOP\nOPSTOP\n\
                TPRINT/T1 mill\nTLAXIS/0,2,0\nGOTO/0,0,0";
    let file = read_apt(text).unwrap();
    let meanings: Vec<_> = file.statements.iter().map(|s| s.meaning.clone()).collect();
    let expected = [
        AptMeaning::Coolant(AptCoolant::Flood),
        AptMeaning::Coolant(AptCoolant::Other),
        AptMeaning::Coolant(AptCoolant::Off),
        AptMeaning::SpindleOff,
        AptMeaning::SpindleOn,
        AptMeaning::Dwell(Some(2.5)),
        AptMeaning::Dwell(None),
        AptMeaning::Stop { optional: false },
        AptMeaning::Stop { optional: true },
        AptMeaning::Comment,
        AptMeaning::ToolAxis,
        AptMeaning::Point(0),
    ];
    assert_eq!(meanings, expected);
    assert_eq!(file.points[0].cl.axis, Vector3::y_axis());
}

/// A range or a largest speed is no speed, OFF counts with a speed too, and a sense alone is the
/// last speed in that sense.
#[test]
fn values_of_spindl_are_told_apart() {
    let on = |rpm: f64, clockwise: bool| AptMeaning::Spindle { rpm, clockwise };
    for (values, expected) in [
        ("RANGE,2,RPM,3000,CCLW", on(3000.0, false)),
        ("3000,RPM,CLW,RANGE,LOW", on(3000.0, true)),
        ("MAXRPM,5000,RPM,3000", on(3000.0, true)),
        ("ON,3000,RPM", on(3000.0, true)),
        ("CCLW", on(700.0, false)),
        ("ON,CCLW", on(700.0, false)),
        ("3000,RPM,OFF", AptMeaning::SpindleOff),
        ("0", AptMeaning::SpindleOff),
        ("RANGE,HIGH", AptMeaning::Auxiliary),
    ] {
        let file = read_apt(format!("SPINDL/700,RPM,CLW\nSPINDL/{values}")).unwrap();
        assert_eq!(file.statements[1].meaning, expected, "{values}");
    }
    let file = read_apt("SPINDL/3000,OFF\nSPINDL/CCLW").unwrap();
    assert_eq!(file.statements[1].meaning, on(3000.0, false));
}

#[test]
fn faults_are_placed() {
    for (text, expected) in [
        ("GOTO/1,2", "line 1, column 1: GOTO: expected x, y, z or x, y, z, i, j, k"),
        ("UNITS/MM\n  GOTO/1,x2,3", "line 2, column 10: `x2` has no valid number"),
        ("GOTO/1,2,$\n  inf", "line 2, column 3: `inf` has no valid number"),
        ("GOTO/1,2,3,0,0,0", "line 1, column 1: GOTO: the axis has length zero"),
        ("GODLTA/1,2,3", "line 1, column 1: GODLTA: there is no point before it"),
        ("UNITS/FEET", "line 1, column 1: UNITS: expected MM, CM or INCHES"),
        ("FEDRAT/0.1,INVERS", "line 1, column 1: FEDRAT: inverse time is not supported; give MMPM or MMPR"),
        ("FEDRAT/0.1,FPT", "line 1, column 1: FEDRAT: expected MMPM, IPM, PERMIN, MMPR, IPR or PERREV for the unit"),
        (
            "SPINDL/10\nFEDRAT/1,MMPR\nFEDRAT/2",
            "line 3, column 1: FEDRAT: behind a feed per revolution the unit must be given: MMPM or MMPR",
        ),
        (
            "FEDRAT/1,MMPR\nGOTO/1,2,3",
            "line 2, column 1: GOTO: its feed is per revolution, and no SPINDL says how many",
        ),
        ("SPINDL/100,SMM", "line 1, column 1: SPINDL: a cutting speed is not supported; give the speed as RPM"),
        ("SPINDL/-100", "line 1, column 1: SPINDL: the speed is below 0; give CLW or CCLW"),
        ("SPINDL/CCLW", "line 1, column 1: SPINDL: no speed was given before"),
        ("SPINDL/100,200", "line 1, column 1: SPINDL: it has two speeds"),
        ("SPINDL/100,CLW,CCLW", "line 1, column 1: SPINDL: it has two senses"),
        ("SPINDL/100,ON,OFF", "line 1, column 1: SPINDL: it has ON and OFF"),
        ("SPINDL/100,FPM", "line 1, column 1: SPINDL: expected RPM, CLW, CCLW, ON, OFF, RANGE or MAXRPM"),
        ("\nSPINDL/", "line 2, column 1: SPINDL: expected a speed, CLW, CCLW, ON or OFF"),
        ("SPINDL/100,RANGE", "line 1, column 1: SPINDL: expected a range behind RANGE"),
        ("SPINDL/100,MAXRPM", "line 1, column 1: SPINDL: expected a speed behind MAXRPM"),
        ("SPINDL/100,MAXRPM,50", "line 1, column 1: SPINDL: the speed is above MAXRPM"),
        ("SPINDL/1000001", "line 1, column 1: SPINDL: the speed is above 1000000 revolutions per minute"),
        (
            "FEDRAT/1,IPM\nFEDRAT/2",
            "line 2, column 1: FEDRAT: behind a feed in another unit than that of UNITS the unit must be given: MMPM, IPM \
             or PERMIN",
        ),
        (
            "GOTO/1,0,0\nINDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,0,1),ON,(LINE/0,0,0,0,1,0)\n\
             TLON,GOFWD/(CIRCLE/0,0,0,1),ON,(LINE/0,0,0,1,0,0)",
            "line 4, column 1: TLON: no INDIRV says in which direction the circle is followed",
        ),
        (
            "INDIRV/0,1,0\nGOTO/1,0,0\nTLON,GOFWD/(CIRCLE/0,0,0,1),ON,(LINE/0,0,0,0,1,0)",
            "line 3, column 1: TLON: no INDIRV says in which direction the circle is followed",
        ),
        ("CIRCLE/0,0,0,0,0,0,5", "line 1, column 1: CIRCLE: the axis of the arc has length zero"),
        ("CIRCLE/0,0,nan,0,0,1,5", "line 1, column 12: `nan` has no valid number"),
        ("TLAXIS/0,0,0", "line 1, column 1: TLAXIS: the direction has length zero"),
        (
            "GOTO/1,0,0\nTLON,GOFWD/(CIRCLE/0,0,0,1),ON,(LINE/0,0,0,0,1,0)",
            "line 2, column 1: TLON: no INDIRV says in which direction the circle is followed",
        ),
        ("CUTTER/", "line 1, column 1: CUTTER: expected a diameter"),
        ("TLDATA/MILL,20", "line 1, column 1: TLDATA: expected diameter and lower radius behind MILL"),
        ("TLDATA/MILL,20,one,75", "line 1, column 16: `one` has no valid number"),
    ] {
        assert_eq!(read_apt(text).unwrap_err().to_string(), expected, "{text}");
    }
}

#[test]
fn no_bytes_make_the_reader_panic() {
    let mut random = Random(23);
    let words = [
        "GOTO/",
        "FEDRAT/",
        "CUTTER/",
        "$\n",
        "$$",
        "\n",
        ",",
        "1.5",
        "-2",
        "1e308",
        "UNITS/INCHES",
        "RAPID",
        "/",
        " ",
        "é",
        "FROM/",
        "GODLTA/",
        "LOADTL/",
        "SPINDL/",
        "CYCLE/",
        "MMPM",
        "\u{feff}",
    ];
    for _ in 0..6000 {
        let text: Vec<u8> = (0..random.below(40)).flat_map(|_| words[random.below(words.len())].bytes()).collect();
        check_read(&text);
        let text: Vec<u8> = (0..random.below(80)).map(|_| random.bits() as u8).collect();
        check_read(&text);
    }
}

fn check_read(text: &[u8]) {
    if let Ok(file) = read_apt(text) {
        for point in &file.points {
            assert!(point.cl.tip.iter().all(|v| v.is_finite()) && (point.cl.axis.norm() - 1.0).abs() < 1e-9);
        }
    }
}

/// Files of a CAM system.
#[test]
fn published_files_are_read_whole() {
    for (name, n_points, frames, offsets) in [
        ("aamorim_Interface-glue.apt", 6311, 4 + 4, 20),
        ("aamorim_basemach.apt", 2090, 12 + 12, 124),
        ("aamorim_manufacture3-top.apt", 360, 14 + 14, 42),
    ] {
        let path = Path::new(SHARED_NC).join(name);
        let Ok(text) = std::fs::read(&path) else {
            eprintln!("skipped: {} is not there", path.display());
            continue;
        };
        let file = read_apt(&text).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(file.points.len(), n_points, "{name}");
        assert_eq!(file.unknown, [], "{name}");
        let count = |is_meant: fn(&AptMeaning) -> bool| file.statements.iter().filter(|s| is_meant(&s.meaning)).count();
        assert_eq!(count(|m| matches!(m, AptMeaning::Frame(_))), frames, "{name}");
        assert_eq!(count(|m| matches!(m, AptMeaning::RadiusCompensation(_))), offsets, "{name}");
        assert!(file.points.iter().all(|p| p.frame.is_some()), "{name}");
        assert!(file.points.iter().filter(|p| p.kind == AptPointKind::Linear).all(|p| p.feed.is_some()));
        assert_eq!(file.statements.last().map(|s| s.meaning.clone()), Some(AptMeaning::End));
    }
}
