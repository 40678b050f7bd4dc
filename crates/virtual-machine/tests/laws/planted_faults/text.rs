//! Faults that the text alone shows.

use facemill_virtual_machine::{FindingKind, VerifySettings};

use super::pairs::{Outcome, Row, ran_with, row};
use crate::kit::{HEAD, Shop, Text};

/// Lines with a fault and their twins; which of them the fault is on, from 1.
struct Lines<'a> {
    wrong: &'a [&'a str],
    right: &'a [&'a str],
    at: u32,
}

const START: &str = "G0 X0. Y0. Z1500. B0. C0.";

pub(crate) fn rows() -> Vec<Row> {
    vec![
        row("length of another tool in the text", FindingKind::OtherToolLength, |s| {
            let comment = format!("(TOOL LENGTH {:.4})", 120.0 + 0.01 * s);
            run(&Text::new(&Shop::new()).line(START).line(&comment).line("M30").text, HEAD + 2)
        }),
        row("register of another tool", FindingKind::OtherLengthRegister, |s| {
            pick(s, &Lines { wrong: &[START, "G0 G43 Z900. H8"], right: &[START, "G0 G43 Z900. H7"], at: 2 })
        }),
        row("RTCP left on", FindingKind::RtcpLeftOn, |s| {
            let on = "G0 G43.4 X0. Y0. Z1000. H7";
            let home: &[&str] = if s > 1.0 { &[] } else { &["G91 G28 Z0.", "G49"] };
            let lines = [&[START, on], home, &["M30"]].concat();
            run_lines(&lines, HEAD + 3)
        }),
        row("cut without a feed", FindingKind::NoFeed, |s| {
            pick(s, &Lines { wrong: &[START, "G1 X10."], right: &[START, "G1 X10. F100."], at: 2 })
        }),
        row("cut with the spindle off", FindingKind::SpindleOff, |s| {
            pick(s, &Lines { wrong: &[START, "M5", "G1 X10. F100."], right: &[START, "M9", "G1 X10. F100."], at: 3 })
        }),
        row("spindle the wrong way round", FindingKind::SpindleSense, |s| {
            pick(s, &Lines { wrong: &[START, "M4", "G1 X10. F100."], right: &[START, "M3", "G1 X10. F100."], at: 3 })
        }),
        row("tool change away from home", FindingKind::UnsafeToolChange, |s| {
            pick(s, &Lines { wrong: &[START, "(up)", "T7 M6"], right: &[START, "G91 G28 Z0.", "T7 M6"], at: 3 })
        }),
        row("another work offset", FindingKind::UnknownPosition, |s| {
            pick(s, &Lines { wrong: &[START, "G55", "G0 X1."], right: &[START, "G54", "G0 X1."], at: 3 })
        }),
        row("RTCP over a turned table", FindingKind::UnknownPosition, |s| {
            let on = "G0 G43.4 X0. Y0. Z1000. H7";
            pick(
                s,
                &Lines {
                    wrong: &[START, "G0 C35.", on, "G0 Z900.", OFF[0], OFF[1]],
                    right: &[START, "G0 C0.", on, "G0 Z900.", OFF[0], OFF[1]],
                    at: 3,
                },
            )
        }),
        row("macro call", FindingKind::UnknownBlock, |s| {
            pick(s, &Lines { wrong: &[START, "G65 P9100"], right: &[START, "(G65 P9100)"], at: 2 })
        }),
        row("arc", FindingKind::UnknownBlock, |s| {
            pick(s, &Lines { wrong: &[START, "G2 X10. I5. J0. F100."], right: &[START, "G1 X10. F100."], at: 2 })
        }),
        row("axis that is not there", FindingKind::UnknownBlock, |s| {
            pick(s, &Lines { wrong: &[START, "G0 A10."], right: &[START, "G0 B10."], at: 2 })
        }),
        row("another tool", FindingKind::UnknownBlock, |s| {
            pick(s, &Lines { wrong: &[START, "T8"], right: &[START, "T7"], at: 2 })
        }),
        row("branch", FindingKind::Branch, |s| {
            let wrong = &[START, "GOTO 9002", "N9002"];
            pick(s, &Lines { wrong, right: &[START, "(GOTO 9002)", "N9002"], at: 2 })
        }),
        row("block that may be skipped", FindingKind::SkippableBlock, |s| {
            pick(s, &Lines { wrong: &[START, "/G0 X10."], right: &[START, "/M8"], at: 2 })
        }),
        row("block behind the end", FindingKind::BehindEnd, |s| {
            pick(s, &Lines { wrong: &[START, "M30", "G0 X10."], right: &[START, "G0 X10.", "M30"], at: 3 })
        }),
        row("number without a point", FindingKind::NoDecimalPoint, |s| {
            pick(s, &Lines { wrong: &[START, "G0 X10"], right: &[START, "G0 X10."], at: 2 })
        }),
        row("length cancelled over the work", FindingKind::UnsafeCancel, |s| {
            let home = if s > 1.0 { "G0 X1." } else { "G91 G28 Z0." };
            run_lines(&[START, "G0 G43 Z1500. H7", home, "G90 G49", "M30"], HEAD + 4)
        }),
        row("no end", FindingKind::NoEnd, |s| {
            run_lines(if s > 1.0 { &[START, "G0 X1."] } else { &[START, "G0 X1.", "M30"] }, HEAD + 2)
        }),
        row("cut without a tool", FindingKind::NoTool, |s| {
            let text = Text::new(&Shop::new()).line(START).line("G1 X10. F100.").line("M30").text;
            let without = text.replace("T7 M6", "(no tool)");
            run(if s > 1.0 { &without } else { &text }, HEAD + 2)
        }),
    ]
}

/// The way home under RTCP.
const OFF: [&str; 2] = ["G91 G28 Z0.", "G90 G49"];

fn pick(scale: f64, lines: &Lines<'_>) -> Outcome {
    let chosen = if scale > 1.0 { lines.wrong } else { lines.right };
    let has_end = chosen.iter().any(|line| line.contains("M30"));
    let end: &[&str] = if has_end { &[] } else { &["M30"] };
    run_lines(&[chosen, end].concat(), HEAD + lines.at)
}

fn run_lines(lines: &[&str], line: u32) -> Outcome {
    let shop = Shop::new();
    run(&lines.iter().fold(Text::new(&shop), |text, line| text.line(line)).text, line)
}

fn run(text: &str, line: u32) -> Outcome {
    let shop = Shop::new();
    ran_with(text, &shop.setup(), &VerifySettings { is_whole: true, ..VerifySettings::default() }, line)
}
