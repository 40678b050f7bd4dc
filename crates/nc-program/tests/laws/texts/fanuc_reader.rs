//! Texts that the FANUC reader understands, refuses and survives.

use std::path::Path;

use crate::kit::{Random, random_blocks, settings, spec};
use facemill_nc_program::read::{
    ArcWords, AxisAt, CallKind, Compensation, Feed, LengthRelation, MacroKind, MotionKind, NoteKind, Plane,
    ReadCommand, ReadFault, ReadMotion, ReadNote, ToolLengthNote, read_fanuc,
};
use facemill_nc_program::*;
use facemill_test_kit::SHARED_NC;

fn motions(text: &str) -> Vec<ReadMotion> {
    read_fanuc(text).unwrap_or_else(|e| panic!("{e}")).motions().map(|(_, m)| m.clone()).collect()
}

fn at(motion: &ReadMotion, axis: &str) -> Option<AxisAt> {
    motion.position.get(axis.parse().unwrap())
}

fn word(value: f64) -> Option<AxisAt> {
    Some(AxisAt::Word(value))
}

#[test]
fn blanks_case_zeros_and_comments_do_not_matter() {
    let plain = motions("G0 X10. Y-0.5 Z5.\nG1 X11. F100.");
    for text in [
        "g00x10.y-.5z5.\ng01x11.f100.",
        "G0 X  10.  Y - 0.5 (here) Z5. ; and here\r\n\r\nG1 X1 1. F 100.\r\n",
        "%\nO1001(name)\nN10 G0 X+10. Y-.5 Z5\n/N20 G1 X011.000 F100\nM30\n%\nbehind the end [",
        "(first)\n:77\nG 0 X10. Y-.5 Z5.\n\t\n/2 G1 X11. F100.",
    ] {
        assert_eq!(motions(text), plain, "{text}");
    }
    assert_eq!(plain[1].kind, MotionKind::Linear);
    assert_eq!(plain[1].feed, Some(Feed { mode: FeedMode::G94, value: 100.0 }));
    assert_eq!((plain[0].feed, at(&plain[1], "Y")), (None, word(-0.5)));
}

#[test]
fn modal_state_is_resolved() {
    let m = motions("G0 X1. Z5.\nG91 G1 X2. Z-1. F60.\nX.5\nG90 X7.\nG20 X1. F10.\nB5.\nG93 G1 X2. F4.\nX3.");
    let x: Vec<_> = m.iter().map(|m| at(m, "X")).collect();
    assert_eq!(x, [1.0, 3.0, 3.5, 7.0, 25.4, 25.4, 50.8, 3.0 * 25.4].map(word));
    assert_eq!(at(&m[7], "Z"), word(4.0));
    assert_eq!(at(&m[7], "B"), word(5.0), "degrees have no inches");
    assert_eq!(m[4].feed, Some(Feed { mode: FeedMode::G94, value: 254.0 }));
    assert_eq!(m[6].feed, Some(Feed { mode: FeedMode::G93, value: 4.0 }));
    assert_eq!(m[7].feed, None, "the time of one block is not another's");
    assert!(m[0].position.is_programmed(AxisLetter::X) && !m[5].position.is_programmed(AxisLetter::X));
}

#[test]
fn look_ahead_moves_nothing() {
    let m = motions("G0 X1. Z5.\nG5.1 Q1 X0. Z0.\nG5 P10000\nG8 P1\nG61 X2.\nG64 G5.1 Q0");
    assert_eq!(m.len(), 2);
    assert_eq!((at(&m[1], "X"), at(&m[1], "Z")), (word(2.0), word(5.0)));
}

#[test]
fn homing_and_machine_values_are_kept_apart_from_words() {
    let m = motions("G91 G28 Z0.\nG28 X0. B0.\nG90 G53 G0 Y-100.\nG54 G0 X5.\nG28 Z50.\nG30 P3 X9.\nG55 G0 Y1.");
    assert_eq!(
        (m[0].kind, at(&m[0], "Z"), at(&m[0], "X")),
        (MotionKind::ReferenceReturn, Some(AxisAt::Reference(1)), None)
    );
    assert_eq!((at(&m[1], "B"), m[1].via.clone()), (Some(AxisAt::Reference(1)), None));
    assert_eq!((m[2].kind, at(&m[2], "Y")), (MotionKind::Rapid, Some(AxisAt::Machine(-100.0))));
    assert_eq!(at(&m[3], "Z"), Some(AxisAt::Reference(1)));
    assert_eq!(m[4].via.as_deref().and_then(|via| via.get(AxisLetter::Z)), Some(50.0));
    assert_eq!(at(&m[5], "X"), Some(AxisAt::Reference(3)));
    assert_eq!((m[6].work_offset, at(&m[6], "Y")), (WorkOffset::new(2).unwrap(), word(1.0)));
}

#[test]
fn words_are_unknown_once_their_frame_has_changed() {
    let m = motions("G54 G0 X1. Y2. Z3. B4.\nG43 H5 Y2.\nZ3.\nG55 X1.\nG43.4 H5 Y2. Z3.\nG49 B4.");
    assert_eq!((m[0].compensation, m[1].compensation), (Compensation::Off, Compensation::Length(5)));
    assert_eq!((at(&m[1], "X"), at(&m[1], "Z"), at(&m[2], "Z")), (word(1.0), None, word(3.0)));
    assert_eq!((at(&m[3], "X"), at(&m[3], "Y"), at(&m[3], "B")), (word(1.0), None, None));
    assert_eq!((m[4].compensation, at(&m[4], "X")), (Compensation::Rtcp(5), None));
    assert_eq!((m[5].compensation, at(&m[5], "Y"), at(&m[5], "B")), (Compensation::Off, None, word(4.0)));
    let m = motions("G43.4 H1 G1 X1. F100.");
    assert_eq!(m[0].feed, Some(Feed { mode: FeedMode::Rtcp, value: 100.0 }));
    let m = motions("G54.1 P3 G0 X1.\nG52 X5.\nY1.");
    assert_eq!((m[0].work_offset.to_string(), m.len()), ("G54.1 P3".to_owned(), 2));
    assert_eq!(at(&m[1], "X"), None);
}

#[test]
fn arcs_and_cycles_are_kept_as_such() {
    let m = motions(
        "G0 X0. Y0. Z9.\nG2 X10. I5. J0. F50.\nG3 I1.\nG18 G2 X1. R4.\nG81 X1. Y2. Z-5. R2. F30.\nX3.\nG80 G0 Z9.",
    );
    let arc = |m: &ReadMotion| **m.arc.as_ref().unwrap();
    assert_eq!(m[1].kind, MotionKind::Arc { clockwise: true });
    assert_eq!(arc(&m[1]), ArcWords { i: Some(5.0), j: Some(0.0), ..ArcWords::default() });
    assert_eq!((m[2].kind, arc(&m[2]).i), (MotionKind::Arc { clockwise: false }, Some(1.0)));
    assert_eq!((arc(&m[3]).plane, arc(&m[3]).r), (Plane::Zx, Some(4.0)));
    assert_eq!((m[4].kind, at(&m[4], "Z"), at(&m[4], "Y")), (MotionKind::Cycle { code: 81 }, None, word(2.0)));
    assert_eq!((m[5].kind, at(&m[5], "X")), (MotionKind::Cycle { code: 81 }, word(3.0)));
    assert_eq!((m[6].kind, at(&m[6], "Z")), (MotionKind::Rapid, word(9.0)));
}

#[test]
fn programs_are_named_by_number_or_name() {
    let first = |text: &str| read_fanuc(text).unwrap().blocks.remove(0);
    assert_eq!(first("%\nO0012(PART)").commands[0], ReadCommand::ProgramNumber(12));
    let with_words = first("O12 G21 G90 G0 X5.");
    assert_eq!((with_words.commands.len(), at(&with_words.motion.unwrap(), "X")), (1, word(5.0)));
    for text in ["<SHAFT-2>", "O<SHAFT-2>"] {
        assert_eq!(first(text).commands, [ReadCommand::Comment("SHAFT-2".to_owned())]);
        assert!(read_fanuc(text).unwrap().is_evaluated());
    }
    let e = read_fanuc("G0 X1. <A>").unwrap_err();
    assert_eq!((e.line, e.column), (1, 8));
}

#[test]
fn arguments_of_cycles_and_calls_are_kept() {
    let read =
        read_fanuc("G0 G90 X1. Y1.\nG98 G83 X5. Z-9. R2. Q3. F80. M8\nX6.\nG80\nM98 P1000 L2\nG66 P9 A1. F3.").unwrap();
    let of = |c: &ReadCommand| if let ReadCommand::Call(call) = c { Some((**call).clone()) } else { None };
    let found: Vec<_> = read.blocks.iter().flat_map(|b| &b.commands).filter_map(of).collect();
    let said: Vec<_> = found.iter().map(|c| (c.kind, &*c.name, &*c.arguments, c.is_modal)).collect();
    use CallKind::{Cycle, Subprogram};
    let expected = [
        (Cycle, "G83", "X5. Z-9. R2. Q3.", true),
        (Subprogram, "1000", "L2", false),
        (Subprogram, "9", "A1. F3.", true),
    ];
    assert_eq!(said, expected);
}

#[test]
fn macro_text_is_kept_and_not_trusted() {
    let kinds = |text: &str| -> Vec<MacroKind> {
        let read = read_fanuc(text).unwrap_or_else(|e| panic!("{text}: {e}"));
        let all = read.blocks.iter().flat_map(|b| &b.commands);
        all.filter_map(|c| if let ReadCommand::Macro { kind, .. } = c { Some(*kind) } else { None }).collect()
    };
    for (text, kind, is_evaluated) in [
        ("#100=5", MacroKind::Assignment, true),
        ("#5221=5", MacroKind::Setting, false),
        ("#3000=1(STOP)", MacroKind::Alarm, false),
        ("GOTO 5", MacroKind::Branch, false),
        ("WHILE [#1 LT 5] DO 1", MacroKind::Branch, false),
        ("END1", MacroKind::Branch, false),
        ("o100 while [1]", MacroKind::Branch, false),
        ("o<sub> call", MacroKind::Call, false),
        ("M98 P1000 L2", MacroKind::Call, false),
        ("G65 P9010 A1. B2. E3.", MacroKind::Call, false),
        ("G0 X#100", MacroKind::VariableWords, false),
        ("G1 X[1+#2]", MacroKind::VariableWords, false),
        ("G#1 X1.", MacroKind::VariableWords, false),
        ("DPRNT[X#1[53]]", MacroKind::Output, true),
        ("G10 L2 P1 X0. Y0.", MacroKind::Setting, false),
        ("G10 L2 P1 X#1", MacroKind::Setting, false),
        ("G92 X0.", MacroKind::Setting, false),
    ] {
        assert_eq!(kinds(text), [kind], "{text}");
        assert_eq!(read_fanuc(text).unwrap().is_evaluated(), is_evaluated, "{text}");
    }
    // A check that only raises an alarm is the one branch that changes nothing.
    let check = "IF [ABS[#11001-420.] LE 0.01] GOTO 9001\n(note)\nN8 #3000=1(LENGTH)\nN9001\n";
    assert!(read_fanuc(check).unwrap().is_evaluated());
    for broken in [check.replace("N9001", "N9002"), check.replace("#3000", "G0 X1.\n#3000"), check.replace("N9001", "")]
    {
        let read = read_fanuc(&broken).unwrap();
        let branch = read.notes.iter().find(|n| n.kind == NoteKind::Branch).unwrap();
        assert_eq!((branch.line, &*branch.text), (1, check.lines().next().unwrap()), "{broken}");
        assert!(!read.is_evaluated(), "{broken}");
    }
    // Nothing is known behind text that may have moved everything.
    let m = motions("G0 X1. Y1.\nG0 X#1\nG0 Y2.\nG0 M#1 X3.\nG0 X3.\nM98 P1\nG0 X3.");
    assert_eq!((at(&m[1], "X"), at(&m[1], "Y"), m[1].kind), (None, word(1.0), MotionKind::Rapid));
    assert_eq!((at(&m[2], "X"), at(&m[2], "Y")), (None, word(2.0)));
    assert_eq!((at(&m[3], "X"), at(&m[3], "Y"), m.len()), (word(3.0), None, 5));
    assert_eq!(at(&m[4], "Y"), None);
}

#[test]
fn other_words_are_kept_as_commands() {
    let text = "O77\nT5 M6\nS600 M3\nM8\nG4 P1500\nG4 X2.5\nM1\nM5 M9\nM88\n(TOOL LENGTH 123.5)\nM30";
    let read = read_fanuc(text).unwrap();
    let commands: Vec<_> = read.blocks.iter().flat_map(|b| b.commands.clone()).collect();
    let expected = [
        ReadCommand::ProgramNumber(77),
        ReadCommand::ToolChange,
        ReadCommand::Tool(5),
        ReadCommand::SpindleOn { clockwise: true },
        ReadCommand::SpindleSpeed(600.0),
        ReadCommand::Coolant(Coolant::Flood),
        ReadCommand::Dwell(1.5),
        ReadCommand::Dwell(2.5),
        ReadCommand::Stop { optional: true },
        ReadCommand::SpindleOff,
        ReadCommand::Coolant(Coolant::Off),
        ReadCommand::Function(88),
        ReadCommand::Comment("TOOL LENGTH 123.5".to_owned()),
        ReadCommand::End,
    ];
    assert_eq!(commands, expected);
    assert_eq!(
        read.tool_lengths,
        [ToolLengthNote { line: 10, length: 123.5, register: None, relation: LengthRelation::Same, check: None }]
    );
    assert_eq!(read.motions().count(), 0);
}

#[test]
fn what_is_not_understood_is_refused_with_its_place() {
    for (text, expected) in [
        ("G0 X1.\nG1 E5. X2.", "line 2, column 4: `E5.` is not understood"),
        ("G0 X 1 . Q 5 .", "line 1, column 10: `Q5.` has no meaning in this block"),
        ("G0 X1.5.2", "line 1, column 4: `X1.5.2` has no valid number"),
        ("G0 X-", "line 1, column 4: `X-` has no valid number"),
        ("G0 X1. X2.", "line 1, column 8: `X2.` occurs twice in the block"),
        ("G0 X1. (open", "line 1, column 8: the comment is not closed"),
        ("TRAORI", "line 1, column 1: `TRAORI` is not understood"),
        ("G0 X=5.", "line 1, column 4: `X` has no valid number"),
        ("G0 *", "line 1, column 4: unexpected character '*'"),
        ("M3.5", "line 1, column 1: `M3.5` has no valid number"),
        ("G54.1 P0", "line 1, column 1: `G54.1` has no valid number"),
        ("N99999999999 G0", "line 1, column 1: `N99999999999` has no valid number"),
    ] {
        assert_eq!(read_fanuc(text).map(|_| ()).unwrap_err().to_string(), expected, "{text}");
    }
}

#[test]
fn ambiguous_texts_are_noted() {
    let notes = |text: &str| read_fanuc(text).unwrap().notes;
    let note = |line, text: &str, count, kind| ReadNote { line, text: text.into(), count, kind };
    let pointless = |line, text, count| [note(line, text, count, NoteKind::NoDecimalPoint)];
    assert_eq!(notes("G0 X0\nG0 X10\nY5\nG4 P100\nG1 X1. F100."), pointless(2, "G0 X10", 2));
    assert_eq!(notes("G1 X1. F100\nF20.\nF30\nS500 M3\nT7 M6"), pointless(1, "G1 X1. F100", 2));
    assert_eq!(notes("G0 X1.\n /G0 X2. "), [note(2, "/G0 X2.", 1, NoteKind::Skippable)]);
    assert_eq!(notes("%\nG0 X1.\n%\n G0\n!!"), [note(4, "G0", 2, NoteKind::BehindEnd)]);
    assert_eq!(notes("G20\nG1 X1. F5."), [note(2, "G1 X1. F5.", 1, NoteKind::InchFeed)]);
    // A branch that turns out to guard nothing precedes one that was known at once.
    let two = "IF [#1 EQ 1] GOTO 5\nGOTO 6\nN5\nN6";
    assert_eq!(notes(two), [note(1, "IF [#1 EQ 1] GOTO 5", 2, NoteKind::Branch)]);
}

#[test]
fn bytes_that_are_not_text_stand_in_comments_only() {
    assert_eq!(read_fanuc(b"G0 X1. (Pr\xfcfung)\n").unwrap().blocks.len(), 1);
    let e = read_fanuc(b"G0 X1.\xfc").unwrap_err();
    assert_eq!((e.line, e.column, e.fault), (1, 7, ReadFault::Character('ü')));
}

#[test]
fn no_bytes_make_the_reader_panic() {
    let mut random = Random(11);
    let alphabet = b"GMXYZBCFSTHNOPIJKRQLD0123456789.-+ \t/()%#[]=;:EIFGOTO\n\r\xfc";
    for _ in 0..4000 {
        let n = random.below(120);
        let text: Vec<u8> = (0..n).map(|_| alphabet[random.below(alphabet.len())]).collect();
        check_read(&text);
        let text: Vec<u8> = (0..n).map(|_| random.bits() as u8).collect();
        check_read(&text);
    }
}

#[test]
fn no_mutation_of_a_program_makes_the_reader_panic() {
    let mut random = Random(12);
    let sample = b"GXYZ09.-/(%#[=\n E;&\x00\xff";
    for round in 0..1500 {
        let blocks = random_blocks(&mut random, 12);
        let mode = [FeedMode::G94, FeedMode::G93, FeedMode::Rtcp][round % 3];
        let mut text = write_program(&spec(blocks), &settings(mode)).unwrap().into_bytes();
        for _ in 0..=random.below(4) {
            let k = random.below(text.len());
            match random.below(4) {
                0 => text[k] = sample[random.below(sample.len())],
                1 if text.len() > 1 => drop(text.remove(k)),
                2 => text.insert(k, sample[random.below(sample.len())]),
                _ => text.truncate(k.max(1)),
            }
        }
        check_read(&text);
    }
}

/// Reads, and checks that an error is somewhere in the text and that numbers are finite.
fn check_read(text: &[u8]) {
    match read_fanuc(text) {
        Ok(read) => {
            for (block, motion) in read.motions() {
                assert!(block.line >= 1);
                assert!(motion.position.words().iter().all(|w| w.value.is_finite()));
            }
        }
        Err(e) => {
            let line = text.split(|b| *b == b'\n').nth(e.line as usize - 1).expect("the line exists");
            assert!(e.column as usize <= line.len().max(1), "{e}");
            assert!(!e.to_string().is_empty());
        }
    }
}

/// A published five-axis program for a relative of the dialect: blanks inside words, inverse time,
/// M functions.
#[test]
fn linuxcnc_impeller_is_read_whole() {
    let path = Path::new(SHARED_NC).join("impeller-7bl-xyzac.ngc");
    let Ok(text) = std::fs::read(&path) else {
        eprintln!("skipped: {} is not there", path.display());
        return;
    };
    let read = read_fanuc(&text).unwrap_or_else(|e| panic!("{e}"));
    let count = |kind| read.motions().filter(|(_, m)| m.kind == kind).count();
    let lines = |code: &str| String::from_utf8_lossy(&text).lines().filter(|l| l.starts_with(code)).count();
    assert_eq!(count(MotionKind::Linear), lines("G1"));
    assert_eq!(count(MotionKind::Rapid), lines("G0"));
    assert!(count(MotionKind::Linear) > 4000);
    let cuts: Vec<_> = read.motions().map(|(_, m)| m).filter(|m| m.kind == MotionKind::Linear).collect();
    assert!(cuts.iter().all(|m| m.feed.is_some_and(|f| f.mode == FeedMode::G93 && f.value > 0.0)));
    // The file ends with the extremes of its own words, to two decimals.
    let extreme = |axis: &str, f: fn(f64, f64) -> f64, start: f64| {
        let words = cuts.iter().filter_map(|m| m.position.words().get(axis.parse().unwrap()));
        words.fold(start, f)
    };
    assert!((extreme("A", f64::min, f64::INFINITY) + 74.49).abs() <= 0.0051);
    assert!((extreme("C", f64::min, f64::INFINITY) + 399.81).abs() <= 0.0051);
    assert!((extreme("Z", f64::min, f64::INFINITY) + 2.65).abs() <= 0.0051);
}

#[test]
fn blocks_tell_the_length_compensation_behind_them_and_h0_is_none() {
    let text = "G21 G90\nG0 Z900.\nG43 Z100. H3\nH5\nG49\nG43 Z100.\nG43 Z50. H0\nG43 Z20.\nG43 Z10. H2\nH0\n\
        G43.4 X0. H2\nG49\n";
    let read = read_fanuc(text).unwrap();
    let said: Vec<_> = read.blocks.iter().map(|b| b.compensation).collect();
    let [off, length] = [Compensation::Off, Compensation::Length(5)];
    let (third, second) = (Compensation::Length(3), Compensation::Length(2));
    assert_eq!(said, [off, off, third, length, off, length, off, off, second, off, Compensation::Rtcp(2), off]);
    // Before the first H a control takes the tool's own length.
    assert_eq!(read_fanuc("G21 G0 G43 Z1.").unwrap().blocks[0].compensation, Compensation::Length(0));
    for text in ["G21 G0 G43.4 X1. H0", "G21 G0 G43.4 X1. H2\nH0", "G21 G0 G43 Z1. H0\nG43.4 X1."] {
        let last = read_fanuc(text).unwrap().blocks.pop().unwrap();
        let reported = |c: &ReadCommand| matches!(c, ReadCommand::Macro { kind: MacroKind::NotFollowed, text } if text.contains("H0"));
        assert!(last.commands.iter().any(reported) && last.motion.is_none(), "{text}");
    }
    assert!(read_fanuc("G21 G0 G43 Z1. H0\nG43.4 X1. H4").is_ok());
}
