//! Feeds of cuts against the job's: which blocks of the plate's passes cut is known from where they
//! are.

use std::fmt::Write as _;
use std::path::Path;

use facemill::formats::VerificationFile;
use facemill::nc_program::Dialect;
use facemill::virtual_machine::{Finding, FindingKind};
use facemill::{CutRequest, Job, SilentStages, StockRegion, VerifyRequest, verify_program};
use facemill_tests::jobs::{JobFolder, text_of};
use facemill_tests::variants::variant;
use serde_json::json;

use super::{STEP, plate, words};

/// Feeds of the example's job, mm/min.
const CUTS: f64 = 1200.0;
const ENTRIES: f64 = 2000.0;

/// Half of the plate's width with its stock, mm.
const HALF: f64 = 15.5;

/// By how much the edge of the disc lags behind its foremost point where it is as high as the
/// stock, mm: 0.5/sin 10°.
const LAG: f64 = 2.9;

/// By how much farther it is until the edge is above the stock by more than is near to it: 1.5/sin
/// 10°, mm.
const CLEAR: f64 = 8.7;

/// A block of a pass.
struct Block {
    pass: i32,
    /// Foremost point of the cutter at its start and end, mm.
    from: f64,
    to: f64,
    line: u32,
}

impl Block {
    /// Whether the foremost edge comes from where the stock begins, or is in it, for a millimetre
    /// or more.
    fn cuts(&self) -> bool {
        self.to > -HALF + 1.0 && self.from < HALF
    }

    /// Whether it is beside the stock, before or behind it, and farther from it than a cell's
    /// diagonal.
    fn is_in_air(&self) -> bool {
        self.to < -HALF - 2.0 || self.from > HALF + LAG + CLEAR
    }
}

/// Passes over the plate with the feed of each block, and the blocks.
fn passes(feed: impl Fn(&Block) -> f64) -> (String, Vec<Block>) {
    let mut text = format!("G21 G90 G94\nG0 G43 {} H1\n", words([-30.0, -18.0, 40.0]));
    let mut blocks = Vec::new();
    for pass in -2..=2 {
        let y = STEP * f64::from(pass);
        let _ = writeln!(text, "G0 {}\nG1 {} F{ENTRIES:.1}", words([-30.0, y, 40.0]), words([-30.0, y, 0.0]));
        for to in (-25..=45).step_by(5).map(f64::from) {
            let line = u32::try_from(text.lines().count()).expect("few lines") + 1;
            let block = Block { pass, from: to - 5.0, to, line };
            let _ = writeln!(text, "G1 {} F{:.1}", words([to, y, 0.0]), feed(&block));
            blocks.push(block);
        }
        let _ = writeln!(text, "G0 {}", words([45.0, y, 40.0]));
    }
    (text + "M30\n", blocks)
}

fn cut(tolerance: f64, region: StockRegion) -> Option<CutRequest> {
    Some(CutRequest { region, ..CutRequest::on_lines(0.5, tolerance) })
}

fn run(job: &JobFolder, text: &str, cut: Option<CutRequest>) -> VerificationFile {
    let program = Path::new("program.nc");
    let request = VerifyRequest { gouge_limit: Some(0.05), cut, ..VerifyRequest::new(program, Dialect::Fanuc) };
    let job = Job::read(&job.job()).expect("a job");
    verify_program(&job, text.as_bytes(), &request, &SilentStages).expect("a program that is understood").file
}

fn feeds_of(file: &VerificationFile) -> Vec<&Finding> {
    file.verification.findings.iter().filter(|f| f.kind == FindingKind::FeedAboveJob).collect()
}

/// First lines and texts of the assumptions on feeds.
fn rests_on(file: &VerificationFile) -> Vec<(Option<u32>, &str)> {
    let all = file.assumptions.iter().map(|a| (a.line, a.text.as_str()));
    all.filter(|(_, text)| text.starts_with("feeds ")).collect()
}

fn as_requested(block: &Block) -> f64 {
    if block.is_in_air() { ENTRIES } else { CUTS }
}

fn raised(block: &Block) -> f64 {
    if block.pass % 2 == 0 && block.cuts() { 1.5 * CUTS } else { as_requested(block) }
}

#[test]
fn cuts_at_the_feed_of_entries_are_found_at_their_lines_where_the_stock_is_cut() {
    let job = plate();
    let (text, blocks) = passes(as_requested);
    let clean = run(&job, &text, cut(0.002, StockRegion::Whole));
    assert!(feeds_of(&clean).is_empty() && rests_on(&clean).is_empty(), "{:?}", rests_on(&clean));
    assert!(blocks.iter().filter(|b| as_requested(b) == ENTRIES).count() > 20);

    let (text, blocks) = passes(raised);
    let file = run(&job, &text, cut(0.002, StockRegion::Whole));
    let found = feeds_of(&file);
    let fast: Vec<&Block> = blocks.iter().filter(|b| raised(b) == 1.5 * CUTS).collect();
    let of_pass: Vec<&[&Block]> = fast.chunk_by(|a, b| a.pass == b.pass).collect();
    assert_eq!(found.len(), of_pass.len(), "{found:?}");
    for (finding, pass) in found.iter().zip(of_pass) {
        assert_eq!([finding.first_line, finding.last_line], [pass[0].line, pass[pass.len() - 1].line], "{finding}");
        let ratio = finding.measure.as_ref().expect("a ratio").value();
        assert!((ratio - 1.5).abs() < 1e-3 && finding.note.contains("at most 1200 mm/min in cuts"), "{finding}");
    }
    assert!(rests_on(&file).is_empty(), "{:?}", rests_on(&file));
}

#[test]
fn cuts_that_are_not_distinguished_from_entries_are_an_assumption() {
    let job = plate();
    let (text, blocks) = passes(raised);
    let line = |is: &dyn Fn(&&Block) -> bool| blocks.iter().find(is).map(|b| b.line);
    let entry = line(&|_| true).map(|first| first - 1);
    // No stock is cut.
    let file = run(&job, &text, None);
    assert!(feeds_of(&file).is_empty());
    let [(first, why)] = rests_on(&file)[..] else { panic!("{:?}", rests_on(&file)) };
    assert!(first == entry && why.contains("with 2000 mm/min, the largest of cutting, approach and air"), "{why}");
    // All of it is thinner than what the tolerance explains.
    let file = run(&job, &text, cut(0.2, StockRegion::Whole));
    assert!(feeds_of(&file).is_empty());
    let all = rests_on(&file);
    let first =
        all.iter().find(|(_, why)| why.contains("than a tolerance of 0.2 mm explains")).map(|(first, _)| *first);
    assert_eq!(first, Some(line(&|b| raised(b) == 1.5 * CUTS)), "{all:?}");
    // Half of it has lines.
    let half = StockRegion::Rectangle([[-20.0, -20.0], [0.0, 20.0]]);
    let file = run(&job, &text, cut(0.002, half));
    let lines: Vec<u32> = blocks.iter().filter(|b| raised(b) == 1.5 * CUTS && b.from < 0.0).map(|b| b.line).collect();
    for finding in feeds_of(&file) {
        assert!(lines.contains(&finding.first_line) && finding.last_line <= finding.first_line + 4, "{finding}");
    }
    assert_eq!(feeds_of(&file).len(), 3);
    assert!(rests_on(&file).iter().any(|(_, why)| why.contains("beyond the region")), "{:?}", rests_on(&file));
    // Where no feed is above that of cuts there is nothing to take for granted, and none above all
    // is fine anywhere.
    let (slow, _) = passes(|_| CUTS);
    let slow = slow.replace(&format!("F{ENTRIES:.1}"), &format!("F{CUTS:.1}"));
    assert!(rests_on(&run(&job, &slow, None)).is_empty());
    let (fast, _) = passes(|b| if b.is_in_air() { 1.5 * ENTRIES } else { CUTS });
    for cut in [None, cut(0.002, StockRegion::Whole)] {
        let file = run(&job, &fast, cut);
        let found = feeds_of(&file);
        assert!(found.len() == 10 && found.iter().all(|f| f.note.ends_with("at most 2000 mm/min")), "{found:?}");
    }
}

/// Behind the stock the edge is not above it by a cell's diagonal at first, and lines so far apart
/// do not tell whether it cuts.
#[test]
fn fast_blocks_near_stock_on_no_line_are_an_assumption() {
    let job = plate();
    let is_near = |b: &Block| b.from > HALF + LAG && b.from < HALF + LAG + 5.0;
    let (text, blocks) = passes(|b| if is_near(b) { ENTRIES } else { as_requested(b) });
    let file = run(&job, &text, cut(0.002, StockRegion::Whole));
    let [(first, why)] = rests_on(&file)[..] else { panic!("{:?}", rests_on(&file)) };
    assert!(feeds_of(&file).is_empty() && why.contains("lines 0.5 mm apart"), "{why}");
    assert_eq!(first, blocks.iter().find(|b| is_near(b)).map(|b| b.line));
}

/// The plan's own program has cuts, entries and air at feeds of their own, and none is found; with
/// its cuts raised they are.
#[test]
fn a_plan_keeps_to_the_feeds_of_its_job_and_raised_cuts_are_found() {
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    let job = variant(&[
        (&format!("{planes}/from_mm"), json!(-2.2)),
        (&format!("{planes}/to_mm"), json!(2.2)),
        ("/operations/0/feeds/approach_mm_min", json!(ENTRIES)),
        ("/operations/0/feeds/air_mm_min", json!(1.2 * ENTRIES)),
        ("/post/feed_mode", json!("rtcp")),
    ]);
    job.set("machine.json", &[("/motion/cutting", json!("tip_and_rotaries_linear"))]);
    let planned = job.plan();
    let text = text_of(&planned, "program.nc");
    let [requested, higher] = [CUTS, 1.5 * CUTS].map(|feed| format!("F{feed}."));
    // F of every line, as it stays in force.
    let in_force = |text: &str| -> Vec<String> {
        let mut last = String::new();
        let f = |l: &str| l.split(' ').find(|w| w.starts_with('F')).map(str::to_owned);
        text.lines().map(|l| f(l).inspect(|f| last.clone_from(f)).unwrap_or_else(|| last.clone())).collect()
    };
    let number = |f: &str| f.strip_prefix('F').and_then(|f| f.parse::<f64>().ok());
    let is_entry = |f: &&String| number(f).is_some_and(|f| f > 1.5 * CUTS);
    assert!(in_force(&text).iter().filter(is_entry).count() > 4, "{text}");
    let clean = run(&job, &text, cut(0.02, StockRegion::Whole));
    assert!(feeds_of(&clean).is_empty(), "{:?}", feeds_of(&clean));

    let faster = text.replace(&requested, &higher);
    let feeds = in_force(&faster);
    let file = run(&job, &faster, cut(0.02, StockRegion::Whole));
    let found = feeds_of(&file);
    let mut lines = 0;
    for finding in &found {
        let of_finding = &feeds[finding.first_line as usize - 1..finding.last_line as usize];
        assert!(of_finding.iter().all(|f| *f == higher), "{finding}: {of_finding:?}");
        lines += of_finding.len();
    }
    let all = feeds.iter().filter(|f| **f == higher).count();
    assert!(lines > all / 2, "{lines} of {all} lines: {found:?}");
}
