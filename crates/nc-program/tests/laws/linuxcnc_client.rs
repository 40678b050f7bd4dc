//! The interpreter of LinuxCNC itself (program `rs274` of the Debian package `linuxcnc-uspace`)
//! takes our programs.
//!
//! Skipped, with a message, where neither the environment variable `FACEMILL_RS274` nor the search
//! path has it.

use std::{collections::BTreeMap, path::Path};

use facemill_nc_program::dialect::PostFile;
use facemill_nc_program::*;
use facemill_test_kit::{linuxcnc_interpreter, run_linuxcnc};

use crate::dialects::{WORD_ADDRESS, home, law};
use crate::kit::{Random, random_blocks, spec};
use crate::slow_control::State;

/// Axes as the interpreter prints them.
const CANON: [&str; 6] = ["X", "Y", "Z", "A", "B", "C"];

/// Actions of the interpreter in one block.
#[derive(Clone, Debug, Default)]
struct Canon {
    is_rapid: bool,
    position: [f64; 6],
    /// mm/min, or deg/min where nothing linear moves.
    rate: f64,
}

/// Output and success of the interpreter for a program, with a tool table that has one tool of this
/// length.
fn run(rs274: &Path, text: &str, length: f64, name: &str) -> (bool, String) {
    run_linuxcnc(rs274, text, &format!("T7 P7 Z{length} D160 ;mill\n"), name)
}

/// Motions by block number.
fn canon(output: &str) -> BTreeMap<u32, Canon> {
    let mut all = BTreeMap::new();
    let mut rate = 0.0;
    for line in output.lines() {
        let Some((head, call)) = line.trim().split_once(" N") else { continue };
        let Some((number, call)) = call.split_once(' ') else { continue };
        let (Ok(_), Some((name, rest))) = (head.trim().parse::<u32>(), call.trim().split_once('(')) else { continue };
        let Ok(number) = number.parse::<u32>() else { continue };
        let values: Vec<f64> = rest.trim_end_matches(')').split(',').filter_map(|v| v.trim().parse().ok()).collect();
        match name {
            "SET_FEED_RATE" => rate = values[0],
            "STRAIGHT_TRAVERSE" | "STRAIGHT_FEED" => {
                let position = std::array::from_fn(|k| values[k]);
                all.insert(number, Canon { is_rapid: name == "STRAIGHT_TRAVERSE", position, rate });
            }
            _ => {}
        }
    }
    all
}

/// Every block is taken, goes where its words say, and takes as long as its F says.
#[test]
fn its_interpreter_goes_where_the_words_say_and_takes_the_time_of_f() {
    let Some(rs274) = linuxcnc_interpreter() else { return };
    let mut random = Random(61);
    for (round, path) in [0.01, 0.0].into_iter().enumerate() {
        let mut blocks = random_blocks(&mut random, 1500);
        let extra = ["probeclose", "logopen,x", "debug,#1", "msg,hi", "a;b", "py,import os", "abort,now"];
        blocks.extend(extra.map(|text| Block::Comment(text.to_owned())));
        blocks.extend([Block::Dwell { seconds: 0.5 }, Block::Stop]);
        let spec = spec(blocks);
        let post = PostFile { dialect: Dialect::LinuxCnc, feed_mode: FeedMode::G93, ..PostFile::default() };
        let settings = post.settings(None).unwrap().on_machine(law(path), home()).unwrap();
        let written = write_program_with_lines(&spec, &settings).unwrap();
        // Run by itself the interpreter takes the table's numbers as they are.
        let (is_good, output) = run(&rs274, &written.text, 420.0, &format!("{round}"));
        assert!(is_good && output.contains("PROGRAM_END"), "{}", &output[output.len().saturating_sub(600)..]);
        let found = canon(&output);
        let lines: Vec<&str> = written.text.lines().collect();
        let (mut state, mut before) = (State::default(), None::<Canon>);
        let mut n_timed = 0;
        for (block, line) in spec.program.blocks.iter().zip(&written.block_lines) {
            if !matches!(block, Block::Rapid { .. } | Block::Linear { .. }) {
                continue;
            }
            let line = lines[*line as usize - 1];
            state.run(line, &WORD_ADDRESS, &["X", "Y", "Z", "B", "C"]);
            let number: u32 = line[1..].split(' ').next().unwrap().parse().unwrap();
            let now = found.get(&number).unwrap_or_else(|| panic!("{line} is no motion"));
            assert_eq!(now.is_rapid, state.is_rapid, "{line}");
            for (name, value) in CANON.iter().zip(now.position) {
                let said = state.words.get(*name).copied().unwrap_or(0.0);
                assert!((value - said).abs() <= 1e-4, "{name} {value} in {line}");
            }
            if let (Some(before), Some(feed)) = (&before, state.own_feed) {
                n_timed += usize::from(check_time(before, now, feed, line));
            }
            before = Some(now.clone());
        }
        assert!(n_timed > 500, "{n_timed}");
    }
}

/// The interpreter's rate is for X, Y and Z where one of them moves, else for the rotary axes. What
/// it prints has four decimals, and it takes no rate below 0.1.
fn check_time(before: &Canon, now: &Canon, feed: f64, line: &str) -> bool {
    let norm = |range: std::ops::Range<usize>| {
        range.map(|k| (now.position[k] - before.position[k]).powi(2)).sum::<f64>().sqrt()
    };
    let length = if norm(0..3) > 0.0 { norm(0..3) } else { norm(3..6) };
    if length < 0.5 || length * feed < 1.0 {
        return false;
    }
    let expected = length * feed;
    assert!((now.rate / expected - 1.0).abs() <= 1e-3, "{} for {expected} in {line}", now.rate);
    true
}

#[test]
fn its_interpreter_stops_where_the_tool_has_another_length() {
    let Some(rs274) = linuxcnc_interpreter() else { return };
    let post = PostFile { dialect: Dialect::LinuxCnc, feed_mode: FeedMode::G93, ..PostFile::default() };
    let settings = post.settings(None).unwrap().on_machine(law(0.01), home()).unwrap();
    let text = write_program(&spec(random_blocks(&mut Random(62), 5)), &settings).unwrap();
    for (length, is_right) in [(420.0, true), (420.005, true), (420.1, false), (419.9, false)] {
        let (is_good, output) = run(&rs274, &text, length, "length");
        assert_eq!(is_good, is_right, "{length}\n{output}");
        assert_eq!(output.contains("TOOL LENGTH H7 NOT 420.000"), !is_right, "{length}\n{output}");
        assert_eq!(output.contains("STRAIGHT_FEED"), is_right, "{length}\n{output}");
    }
}
