//! Templates that a shop could have written: one change to ours, planned and run, gives the finding
//! that names it. The unchanged one gives none, in every mode and for tools of either sense.

use std::collections::BTreeSet;

use facemill::Planned;
use facemill::virtual_machine::FindingKind::{self, *};
use facemill_tests::jobs::{JobFolder, text_of};
use facemill_tests::shared::workspace;
use facemill_tests::variants::blink_patch;
use serde_json::json;

/// Our template.
fn ours() -> String {
    std::fs::read_to_string(workspace().join("crates/nc-program/templates/fanuc.j2")).expect("the template")
}

/// The job under RTCP.
fn rtcp_job() -> JobFolder {
    let job = blink_patch();
    job.set("job.json", &[("/post/feed_mode", json!("rtcp"))]);
    let tolerance = json!({ "path_mm": 0.0, "orientation_deg": 0.0 });
    let motion = json!({ "cutting": "tip_and_rotaries_linear", "rapid": "linear", "control_tolerance": tolerance });
    job.set("machine.json", &[("/motion", motion)]);
    job
}

/// A change of the template: the first place of one text becomes another; what the block of the
/// finding starts with.
struct Mutant {
    from: &'static str,
    to: &'static str,
    kind: FindingKind,
    block: &'static str,
}

const fn mutant(from: &'static str, to: &'static str, kind: FindingKind, block: &'static str) -> Mutant {
    Mutant { from, to, kind, block }
}

const CHANGE: &str = "T{{ tool.number }} M6\n";
const LENGTH: &str = "{{ first.spindle }} H{{ tool.length_register }}";
const RTCP_LENGTH: &str = "{{ approach.linear }} H{{ tool.length_register }}";
const LABEL: &str = "N9001\n";
const SPINDLE: &str = "S{{ spindle.rpm }} {{ spindle.code }}\n";
const COOLANT: &str = "{{ coolant.code }}\n{{ body }}\n";

/// For programs of axis words.
const MUTANTS: [Mutant; 34] = [
    // Length registers.
    mutant(LENGTH, "{{ first.spindle }} H77", OtherLengthRegister, "G0 G90 G43"),
    mutant(LENGTH, "{{ first.spindle }}", OtherLengthRegister, "G0 G90 G43"),
    mutant(COOLANT, "G0 H55\n{{ body }}\n", OtherLengthRegister, "G0 H55"),
    // Numbers without a point.
    mutant(COOLANT, "G0 Z500\n{{ body }}\n", NoDecimalPoint, "G0 Z500"),
    mutant(COOLANT, "F300\n{{ body }}\n", NoDecimalPoint, "F300"),
    // Blocks that are not run, or not in their order.
    mutant(COOLANT, "IF [#500 EQ 1] GOTO 9002\n{{ body }}\nN9002\n", Branch, "IF [#500 EQ 1] GOTO 9002"),
    mutant(COOLANT, "GOTO 9002\n{{ body }}\nN9002\n", Branch, "GOTO 9002"),
    mutant(COOLANT, "WHILE [#500 LT 3] DO 1\n{{ body }}\nEND 1\n", Branch, "WHILE"),
    mutant(LABEL, "N9001\n#3000=2(STOP)\n", Branch, "#3000=2"),
    mutant(LABEL, "M8\nN9001\n", Branch, "IF [ABS"),
    mutant("GOTO 9001", "GOTO 9003", Branch, "IF [ABS"),
    mutant(COOLANT, "M30\n{{ body }}\n", BehindEnd, "G90 G94 G0"),
    mutant(COOLANT, "%\n{{ body }}\n", BehindEnd, "("),
    mutant("G0 G90 {{ approach.across }}", "/G0 G90 {{ approach.across }}", SkippableBlock, "/G0 G90 X"),
    mutant("G49\n{% if home.across", "/G49\n{% if home.across", SkippableBlock, "/G49"),
    mutant(SPINDLE, "/S{{ spindle.rpm }} {{ spindle.code }}\n", SkippableBlock, "/S"),
    mutant(CHANGE, "/2 T{{ tool.number }} M6\n", SkippableBlock, "/2 T"),
    mutant("G17 G21 G40 G80 G90 G94\n", "/G17 G21 G40 G80 G90 G94\n", SkippableBlock, "/G17"),
    mutant("{{ work_offset }}\n", "/{{ work_offset }}\n", SkippableBlock, "/G54"),
    // Spindle.
    mutant(SPINDLE, "", SpindleOff, "G1"),
    mutant(SPINDLE, "S{{ spindle.rpm }}\n", SpindleOff, "G1"),
    mutant(SPINDLE, "{{ spindle.code }}\n", SpindleOff, "G1"),
    mutant(SPINDLE, "S0 {{ spindle.code }}\n", SpindleOff, "G1"),
    mutant(SPINDLE, "S{{ spindle.rpm }} M4\n", SpindleSense, "G1"),
    mutant(SPINDLE, "S{{ spindle.rpm }} M13\n", SpindleOff, "G1"),
    mutant(COOLANT, "M5\n{{ body }}\n", SpindleOff, "G1"),
    mutant(COOLANT, "M19\n{{ body }}\n", SpindleOff, "G1"),
    mutant(COOLANT, "M88\n{{ body }}\n", UnknownFunction, "M88"),
    // Tool.
    mutant(CHANGE, "", NoTool, "G1"),
    mutant(CHANGE, "T{{ tool.number }}\n", NoTool, "G1"),
    mutant(CHANGE, "M6\n", NoTool, "G1"),
    mutant(COOLANT, "T{{ tool.number }} M6\n{{ spindle.code }}\n{{ body }}\n", UnsafeToolChange, "T"),
    // Findings of the state before.
    mutant("{{ work_offset }}\n", "G55\n", UnknownPosition, "G0"),
    mutant(COOLANT, "M98 P9000\n{{ body }}\n", UnknownBlock, "M98 P9000"),
];

/// For programs of the tip's words.
const RTCP_MUTANTS: [Mutant; 4] = [
    mutant(RTCP_LENGTH, "{{ approach.linear }} H77", OtherLengthRegister, "G0 G90 G43.4"),
    mutant(SPINDLE, "S{{ spindle.rpm }} M4\n", SpindleSense, "G1"),
    mutant(CHANGE, "", NoTool, "G1"),
    // Above, RTCP is switched on at home.
    mutant("{{ body }}\n", "{{ body }}\nT{{ tool.number }} M6\n", UnsafeToolChange, "T"),
];

fn plan_with(job: &JobFolder, template: &str) -> Planned {
    job.write("shop.j2", template.as_bytes());
    job.set("job.json", &[("/post/template", json!("shop.j2"))]);
    job.plan()
}

/// The block's text without its number.
fn without_number(block: &str) -> &str {
    let rest = block.strip_prefix('N').map_or(block, |b| b.trim_start_matches(|c: char| c.is_ascii_digit()));
    rest.trim_start()
}

fn check(job: &JobFolder, m: &Mutant) {
    let what = format!("{:?} for {:?}", m.to, m.from);
    let template = ours();
    assert!(template.contains(m.from), "{what}: no such place");
    let planned = plan_with(job, &template.replacen(m.from, m.to, 1));
    let name = planned.files.iter().map(|(n, _)| n).find(|n| n.ends_with(".nc")).expect("a program");
    let nc = text_of(&planned, name);
    let findings = &planned.report.findings;
    let found: Vec<_> = findings.iter().filter(|f| f.kind == m.kind).collect();
    assert!(!found.is_empty(), "{what}: {findings:?}");
    // The same is said once.
    let notes: BTreeSet<&str> = found.iter().map(|f| f.note.as_str()).collect();
    assert_eq!(notes.len(), found.len(), "{what}: {findings:?}");
    let f = found[0];
    assert!(without_number(&f.block_text).starts_with(m.block), "{what}: {f}");
    let line = nc.lines().nth(f.first_line as usize - 1).expect("a line");
    assert_eq!(line, f.block_text, "{what}");
    let number: Option<u32> = line.strip_prefix('N').and_then(|l| l.split(' ').next()?.parse().ok());
    assert!(m.kind == BehindEnd || f.block_number == number, "{what}: {f}");
    assert!(!planned.is_clean(), "{what}");
    assert!(findings.len() <= 4, "{what}: one cause, {} findings", findings.len());
}

#[test]
fn our_own_template_gives_no_finding_in_any_mode() {
    let inverse = blink_patch();
    inverse.set("job.json", &[("/post/feed_mode", json!("g93"))]);
    let left = blink_patch();
    left.set("tool.json", &[("/spindle_rotation", json!("counterclockwise"))]);
    let planned = [blink_patch(), inverse, rtcp_job(), left].map(|job| plan_with(&job, &ours()));
    for p in &planned {
        assert!(p.is_clean() && p.report.findings.is_empty(), "{:?}", p.report.findings);
    }
    assert!(["M3", "M3", "M3", "M4"].iter().zip(&planned).all(|(m, p)| text_of(p, "program.nc").contains(m)));
}

/// The first mutant of each kind of finding; the others are for the sweep.
#[test]
fn a_mutant_of_the_template_for_each_finding_gives_it() {
    let job = blink_patch();
    let is_first = |k: usize| MUTANTS[..k].iter().all(|m| m.kind != MUTANTS[k].kind);
    let first: Vec<&Mutant> = (0..MUTANTS.len()).filter(|&k| is_first(k)).map(|k| &MUTANTS[k]).collect();
    assert!(first.len() >= 12, "{} kinds", first.len());
    first.into_iter().for_each(|m| check(&job, m));
}

#[test]
#[ignore = "plans for each of 34 templates: half a minute"]
fn every_mutant_of_the_template_gives_its_finding() {
    let job = blink_patch();
    MUTANTS.iter().for_each(|m| check(&job, m));
}

#[test]
fn mutants_under_rtcp_give_their_findings() {
    let job = rtcp_job();
    RTCP_MUTANTS.iter().for_each(|m| check(&job, m));
}
