use std::collections::BTreeMap;

use facemill_inverse_kinematics::Machine;
use facemill_job::format::program_times::NoLawReason;
use facemill_nc_program::{Dialect, MappedAxis, WordMap, WorkOffset};
use facemill_virtual_machine::motion::axis_motion::MotionContext;

use crate::text_times::{ALL_LINES, TimedText, motions};

/// Returns why a text has no time by the law of motion.
fn unknown(text: &str) -> Option<NoLawReason> {
    let machine = Machine::head_b_table_c().unwrap();
    let axes = machine.axes().iter().map(|axis| MappedAxis {
        letter: axis.letter.as_str().parse().unwrap(),
        offset: 0.0,
        along_spindle: if axis.letter == "Z" { 1.0 } else { 0.0 },
    });
    let words = WordMap::new(axes.collect(), WorkOffset::default(), 100.0).unwrap();
    let at = MotionContext { machine: &machine, tool_length: 100.0, words: &words, frame: None, work_offset: None };
    let dialect = Dialect::Fanuc;
    let file = dialect.file();
    let (control, rapids) = (&file.control_motion, file.rtcp_rapids());
    let written = TimedText { text: text.as_bytes(), dialect, control, rapids, block_lines: &[], lines: ALL_LINES };
    motions(at, &written, &BTreeMap::new()).unwrap().not_followed
}

#[test]
fn a_cut_without_a_feed_has_no_time() {
    for (mode, feed, behind, line) in [
        ("G94", "F500.", "X2.", None),
        ("G94", "", "X2.", Some(3)),
        ("G93", "F5.", "X2. F5.", None),
        ("G93", "F5.", "X2.", Some(4)),
        ("G94", "F500.", "G93 X2.", Some(4)),
    ] {
        let text = format!("G90 G54 {mode}\nG0 X0. Y0. Z100. B0. C0.\nG1 X1. {feed}\n{behind}\nM30\n");
        let why = |line| NoLawReason::Line { file: None, line, why: " cuts without a feed".to_owned() };
        assert_eq!(unknown(&text), line.map(why), "{text}");
    }
}
