//! Laws of programs with nine words per block: two heads and one table in one channel.

use crate::head_kit::{LENGTHS, axis, heads, letters, map, map_of, nine_axis_spec, random_joints, words_of};
use crate::kit::{Random, post_file, words};
use facemill_nc_program::dialect::PostFile;
use facemill_nc_program::read::{AxisAt, Compensation, MotionKind, ReadCommand, ReadMotion, read_fanuc};
use facemill_nc_program::words::{AxisKind, AxisLengths};
use facemill_nc_program::*;

/// Half a unit of the third decimal, with what a sum of numbers of this size may lose.
const HALF_UNIT: f64 = 0.0005 + 1e-9;

fn settings(feed_mode: FeedMode) -> PostSettings {
    PostFile { feed_mode, max_line_length: Some(200), ..post_file() }.settings(None).unwrap()
}

fn write(blocks: Vec<Block>) -> Result<String, WriteError> {
    write_program_of_heads(&nine_axis_spec(blocks), &heads(), &settings(FeedMode::G93)).map(|w| w.text)
}

fn blocks_of(joints: &[Vec<f64>], map: &WordMap) -> Vec<Block> {
    let block = |(k, q): (usize, &Vec<f64>)| {
        let words = map.words(q).unwrap();
        if k == 0 { Block::Rapid { words } } else { Block::Linear { words, feed: 30.0 } }
    };
    joints.iter().enumerate().map(block).collect()
}

/// The template with what a shop might have changed.
fn read_changed(text: &str, from: &str, to: &str) -> ReadProgram {
    assert!(text.contains(from), "{from} in\n{text}");
    read_fanuc(text.replacen(from, to, 1)).unwrap()
}

fn cuts(read: &ReadProgram) -> Vec<&ReadMotion> {
    read.motions().map(|(_, m)| m).filter(|m| m.kind == MotionKind::Linear).collect()
}

#[test]
fn nine_words_come_back_as_the_joints_of_both_heads() {
    let (map, mut random) = (map(), Random(11));
    for _ in 0..40 {
        let joints = random_joints(&mut random, 30);
        let text = write(blocks_of(&joints, &map)).unwrap();
        let read = read_fanuc(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        assert!(read.is_evaluated());
        let read = cuts(&read);
        assert_eq!(read.len(), joints.len() - 1);
        for (motion, joints) in read.iter().zip(&joints[1..]) {
            let back = map.joints_at(motion, &[0.0; 9]).unwrap();
            for ((a, b), letter) in back.iter().zip(joints).zip(letters()) {
                let bound = if letter.kind() == AxisKind::Linear { HALF_UNIT } else { HALF_UNIT.to_radians() };
                assert!((a - b).abs() <= bound, "{letter}: {a} {b}");
            }
        }
    }
}

/// Each word holds the length of its own head and of no other.
#[test]
fn a_tool_that_is_longer_changes_its_own_heads_spindle_word_alone() {
    let joints = [0.1, 1.0, 2.0, 3.0, 0.2, 4.0, 5.0, 6.0, 0.3];
    let before = map().words(&joints).unwrap();
    for (k, sign) in [(0, -1.0), (1, 1.0)] {
        let mut longer = heads();
        longer[k].tool.length += 10.0;
        let after = map_of(&longer).unwrap().words(&joints).unwrap();
        for word in before.iter() {
            let change = if word.letter == longer[k].spindle_axis { sign * 10.0 } else { 0.0 };
            assert!((after.get(word.letter).unwrap() - word.value - change).abs() < 1e-9, "{}", word.letter);
        }
    }
}

#[test]
fn header_and_end_are_those_of_two_heads() {
    let map = map();
    let text = write(blocks_of(&random_joints(&mut Random(5), 3), &map)).unwrap();
    let read = read_fanuc(&text).unwrap();
    let lengths: Vec<_> = read.tool_lengths.iter().map(|n| (n.length, n.register)).collect();
    assert_eq!(lengths, [(LENGTHS[0], Some(7)), (LENGTHS[1], Some(31))]);

    let tools: Vec<_> =
        read.blocks.iter().flat_map(|b| &b.commands).filter(|c| matches!(c, ReadCommand::Tool(_))).collect();
    assert_eq!(tools, [&ReadCommand::Tool(7), &ReadCommand::Tool(12)]);
    let spindles: Vec<&[ReadCommand]> = read
        .blocks
        .iter()
        .map(|b| &b.commands[..])
        .filter(|c| c.iter().any(|c| matches!(c, ReadCommand::SpindleOn { .. } | ReadCommand::SpindleOff)))
        .collect();
    use ReadCommand::{Spindle, SpindleOff, SpindleOn, SpindleSpeed};
    assert_eq!(spindles[0], [Spindle(1), SpindleOn { clockwise: true }, SpindleSpeed(350.0)]);
    assert_eq!(spindles[1], [Spindle(2), SpindleOn { clockwise: false }, SpindleSpeed(512.0)]);
    assert_eq!(spindles[2..], [[Spindle(1), SpindleOff], [Spindle(2), SpindleOff]]);

    // Both spindle axes are home before any other axis moves, before a length is taken off, and
    // before a tool is changed.
    let homes: Vec<_> = read.motions().filter(|(_, m)| m.kind == MotionKind::ReferenceReturn).collect();
    for home in [homes[0], homes[3]] {
        for letter in letters() {
            assert_eq!(home.1.position.is_programmed(letter), letter.letter() == 'Z', "{}", home.0.text);
        }
    }
    // Lengths are on for both axes from the approach to the way home.
    for motion in cuts(&read) {
        assert_eq!(motion.lengths.iter().collect::<Vec<_>>(), [(axis("Z1"), 7), (axis("Z2"), 31)]);
    }
    let last = read.blocks.last().unwrap();
    assert_eq!((last.lengths, last.compensation), (AxisLengths::default(), Compensation::Off));
}

#[test]
fn a_length_of_another_register_or_axis_is_no_position() {
    let map = map();
    let text = write(blocks_of(&random_joints(&mut Random(6), 3), &map)).unwrap();
    let joints = |read: &ReadProgram| map.joints_at(cuts(read)[0], &[0.0; 9]);
    assert!(joints(&read_fanuc(&text).unwrap()).is_ok());
    let swapped = read_changed(&text, "H31", "H7");
    // The first H31 is a comment's.
    assert!(joints(&swapped).is_ok());
    let code = text.lines().find(|l| l.contains("G43 Z2=")).unwrap();
    let swapped = read_changed(&text, code, &code.replace("H31", "H7"));
    let z2 = axis("Z2");
    assert_eq!(joints(&swapped), Err(WordMapError::OtherRegister { axis: z2, found: 7, expected: 31 }));
    for (from, to) in [("Z2=", "Z2=0. Z1="), ("H31", ""), (" Z2=", " X2=1. Z2=")] {
        let unclear = read_changed(&text, code, &code.replace(from, to));
        assert_eq!(joints(&unclear), Err(WordMapError::UnclearLength), "{from} {to}");
    }
    // Without a length Z2 is where the words say, by the tool's length nearer.
    let plain = read_changed(&text, code, &code.replace("G43 ", "").replace("H31", ""));
    let (with, without) = (joints(&read_fanuc(&text).unwrap()).unwrap(), joints(&plain).unwrap());
    assert!((without[7] - with[7] - LENGTHS[1]).abs() < 1e-9 && with[..7] == without[..7]);
}

#[test]
fn faults_of_heads_are_named() {
    let refused = |change: fn(&mut Vec<HeadSpec>)| {
        let mut changed = heads();
        change(&mut changed);
        let spec = nine_axis_spec(blocks_of(&random_joints(&mut Random(7), 1), &map()));
        let written = write_program_of_heads(&spec, &changed, &settings(FeedMode::G94)).unwrap_err().to_string();
        (written, map_of(&changed).map_err(|e| e.to_string()))
    };
    let both = |change, message: &str| {
        let (written, mapped) = refused(change);
        assert!(written.contains(message), "{written}");
        assert!(mapped.unwrap_err().contains(message));
    };
    both(|h| h[1].tool.length_register = 7, "`left` and `right` both have H7");
    both(|h| h[1].tool.number = 7, "`left` and `right` both have T7");
    both(|h| h[1].spindle_number = 1, "`left` and `right` both have P1");
    both(|h| h[1].spindle_axis = h[0].spindle_axis, "both have Z1");
    both(|h| h[1].spindle_axis = AxisLetter::Z, "must be linear and have a number");
    both(|h| h[0].spindle_axis = "X1".parse().unwrap(), "`left`: its spindle axis X1 is no axis");
    both(|h| h[0].spindle_number = 0, "`left` has P0");
    both(|h| h.truncate(1), "not 1");
    assert!(refused(|h| h[0].spindle.rpm = 1.0).0.contains("the spindle of the program is not that of its first head"));

    let words = map().words(&[0.0; 9]).unwrap();
    let rapid = || Block::Rapid { words };
    let e = write(vec![rapid(), Block::SpindleOn { rpm: 100.0, clockwise: true, spindle: None }]).unwrap_err();
    assert!(e.to_string().starts_with("block 1: one of several spindles"), "{e}");
    let z2 = words_of(&[("Z2", 5.0)]);
    let length = |register, words| Block::LengthCompensation { register, length: LENGTHS[1], words };
    assert!(write(vec![rapid(), length(31, z2)]).is_ok());
    for block in [length(7, z2), length(31, words), length(31, words_of(&[("Z1", 5.0)]))] {
        assert!(matches!(write(vec![rapid(), block]), Err(WriteError::WhichHead { .. })));
    }
    let e = write(vec![Block::Rapid { words: words_of(&[("Z1", 5.0)]) }]).unwrap_err();
    assert_eq!(e, WriteError::FirstMotionOfHead { head: "right".into(), axis: axis("Z2") });
    let rtcp = settings(FeedMode::Rtcp);
    let spec = ProgramSpec { approach: Some(words), ..nine_axis_spec(vec![rapid()]) };
    assert_eq!(write_program_of_heads(&spec, &heads(), &rtcp).unwrap_err(), WriteError::RtcpOfHeads);
    assert!(write_program_of_heads(&spec, &[], &rtcp).is_err());
}

/// Switching a length on for one axis leaves the words of the others what they are; ending all does
/// not.
#[test]
fn words_of_other_axes_stay_known_while_a_length_is_switched_on() {
    let text = "G21 G90 G94\nG0 X1=1. Y1=2. Z1=3. X2=4. Z2=5.\nG43 Z1=10. H1\nG43 Z2=20. H2\nG49\n";
    let read = read_fanuc(text).unwrap();
    let at = |k: usize, name: &str| read.motions().nth(k).unwrap().1.position.get(axis(name));
    assert_eq!(
        (at(1, "Z1"), at(1, "Z2"), at(1, "X2")),
        (Some(AxisAt::Word(10.0)), Some(AxisAt::Word(5.0)), Some(AxisAt::Word(4.0)))
    );
    assert_eq!((at(2, "Z1"), at(2, "Z2")), (Some(AxisAt::Word(10.0)), Some(AxisAt::Word(20.0))));
    let next = read_fanuc(format!("{text}X1=7.\n")).unwrap();
    let last = next.motions().last().unwrap().1;
    assert_eq!((last.position.get(axis("Z1")), last.position.get(axis("Z2"))), (None, None));
    assert_eq!(last.position.get(axis("X2")), Some(AxisAt::Word(4.0)));
}

#[test]
fn the_number_of_a_spindle_must_be_whole_and_stand_with_it() {
    assert_eq!(
        read_fanuc("S100 P2\n").unwrap().blocks[0].commands,
        [ReadCommand::Spindle(2), ReadCommand::SpindleSpeed(100.0)]
    );
    for wrong in ["S100 P1.5\n", "M3 P-1\n", "T1 P2\n", "P2\n"] {
        assert!(read_fanuc(wrong).is_err(), "{wrong}");
    }
}

#[test]
fn one_spindle_of_two_changes_its_speed_by_its_number() {
    let words = map().words(&[0.0; 9]).unwrap();
    let on = |spindle| Block::SpindleOn { rpm: 640.4, clockwise: false, spindle };
    let write = |block| {
        let spec = nine_axis_spec(vec![Block::Rapid { words }, block]);
        write_program_of_heads(&spec, &heads(), &settings(FeedMode::G93)).map(|w| w.text)
    };
    for head in heads() {
        let n = head.spindle_number;
        let text = write(on(Some(n))).unwrap();
        let line = format!("S640 M4 P{n}\n");
        assert_eq!(text.matches(&line).count(), 1, "{text}");
        let read = read_fanuc(&text).unwrap();
        let commands =
            [ReadCommand::Spindle(n), ReadCommand::SpindleOn { clockwise: false }, ReadCommand::SpindleSpeed(640.0)];
        assert!(read.blocks.iter().any(|b| b.commands == commands), "{text}");
    }
    let error = write(on(Some(9))).unwrap_err().to_string();
    assert_eq!(error, "block 1: spindle 9 is that of no head");
    assert!(matches!(write(on(None)), Err(WriteError::WhichHead { .. })));
}

#[test]
fn a_numbered_spindle_of_one_head_is_said_as_its_control_says_it() {
    let said = |dialect| {
        let on = Block::SpindleOn { rpm: 900.0, clockwise: true, spindle: Some(2) };
        let spec = crate::kit::spec(vec![Block::Rapid { words: words(&crate::kit::AXES.map(|l| (l, 0.0))) }, on]);
        let post = PostFile { dialect, feed_mode: crate::dialects::modes(dialect)[0], ..PostFile::default() };
        write_program(&spec, &crate::dialects::on_machine(&post))
    };
    for (dialect, line) in [
        (Dialect::Fanuc, " S900 M3 P2\n"),
        (Dialect::LinuxCnc, " S900 M3 $2\n"),
        (Dialect::Siemens840d, " S2=900 M2=3\n"),
    ] {
        assert!(said(dialect).unwrap().contains(line), "{dialect:?}");
    }
    for dialect in [Dialect::Haas, Dialect::Mazak, Dialect::Heidenhain] {
        let error = said(dialect).unwrap_err().to_string();
        assert!(error.starts_with("block 1: ") && error.ends_with("has no word for this: spindle 2"), "{error}");
    }
}
