use crate::feeds::*;
use facemill_inverse_kinematics::Machine;
use facemill_nc_program::{Dialect, MappedAxis, WordMap, WorkOffset, read_program};
use facemill_virtual_machine::motion::axis_motion::MotionContext;

fn found(text: &str) -> Vec<([u32; 2], String)> {
    let required = RequiredFeeds { cuts: 1000.0, all: 1000.0, least: None, speeds: vec![6000.0], rounding: [0.0; 2] };
    let program = read_program(text, Dialect::Fanuc).unwrap();
    let all = required.other_speeds(&program);
    all.into_iter().map(|f| ([f.first_line, f.last_line], f.note)).collect()
}

#[test]
fn other_spindle_speeds_that_follow_each_other_are_one_finding() {
    let head = "G21 G90 G94\nG0 X0. Y0. Z0.\nS6000 M3\n";
    let cuts = |speeds: &[u32]| -> String {
        speeds.iter().enumerate().map(|(k, s)| format!("G1 X{k}. F100. S{s}\n")).collect()
    };
    let lines = |speeds: &[u32]| found(&(head.to_owned() + &cuts(speeds)));
    let same = lines(&[100; 50]);
    assert_eq!(same.len(), 1);
    assert!(same[0].0 == [4, 53] && same[0].1.ends_with("6000 1/min"), "{same:?}");
    let other = lines(&[100, 200, 100, 300]);
    assert!(other.len() == 1 && other[0].0 == [4, 7] && other[0].1.ends_with(OTHERS), "{other:?}");
    // A cut at the job's speed ends it; an S in the air does not, and is not reported.
    let apart: Vec<[u32; 2]> = lines(&[100, 100, 6000, 100]).into_iter().map(|(lines, _)| lines).collect();
    assert_eq!(apart, [[4, 5], [7, 7]]);
    assert_eq!(found(&format!("{head}S100\nS6000\nG1 X1. F100.\n")), []);
    let air = found(&format!("{head}G1 X1. F100. S100\nS6000\nS100\nG1 X2.\n"));
    assert!(air.len() == 1 && air[0].0 == [4, 6], "{air:?}");
}

/// Feeds that a word has changed are not compared: what they are is not known.
#[test]
fn cuts_behind_a_word_that_changes_feeds_are_not_compared() {
    let machine = Machine::head_b_table_c().unwrap();
    let axes = machine.axes().iter().map(|axis| MappedAxis {
        letter: axis.letter.as_str().parse().unwrap(),
        offset: 0.0,
        along_spindle: if axis.letter == "Z" { 1.0 } else { 0.0 },
    });
    let words = WordMap::new(axes.collect(), WorkOffset::default(), 100.0).unwrap();
    let at = MotionContext { machine: &machine, tool_length: 100.0, words: &words, frame: None, work_offset: None };
    let required = RequiredFeeds { cuts: 1000.0, all: 1000.0, least: None, speeds: vec![6000.0], rounding: [0.0; 2] };
    let fast = |word: &str| -> Vec<u32> {
        let there = "G0 X0 Y0 Z800 B0 C0\n";
        let text = format!("G710 G90 G94 G54\n{there}G1 X50 F5000\n{word}\n{there}G1 X50\n");
        let program = read_program(text, Dialect::Siemens840d).unwrap();
        required.feeds_of_cuts(&program, at).fast.into_iter().map(|block| block.line).collect()
    };
    assert_eq!(fast("M8"), [3, 6]);
    assert_eq!(fast("OVR=10"), [3]);
}
