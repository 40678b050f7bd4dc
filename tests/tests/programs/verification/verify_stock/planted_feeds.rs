//! Feeds and spindle speeds planted in programs for `facemill verify`: a tenth of their tolerance
//! beyond it they are found, on their line alone; a tenth within it nothing is.

use facemill_tests::commands::facemill_in;
use facemill_tests::jobs::JobFolder;
use serde_json::{Value, json};

use super::{plate, words};

/// Feeds of the job, mm/min.
const CUTS: f64 = 1000.0;
const ENTRIES: f64 = 2000.0;

/// Share by which a tip may be faster than the job asks for.
const FASTER: f64 = 0.01;

/// The plate with feeds of its own and this spindle speed, 1/min.
fn job(speed: f64) -> JobFolder {
    let job = plate();
    let feed = |key: &str| format!("/operations/0/feeds/{key}");
    job.set(
        "job.json",
        &[
            (&feed("cutting_mm_min"), json!(CUTS)),
            (&feed("approach_mm_min"), json!(ENTRIES)),
            (&feed("air_mm_min"), Value::Null),
            (&feed("spindle_rpm"), json!(speed)),
            facemill_tests::jobs::unfinished(),
        ],
    );
    job
}

/// Foremost points of the cutter on one pass over the plate, mm: 20 mm in the middle lie in the
/// stock.
const PLACES: [f64; 4] = [-30.0, -10.0, 10.0, 35.0];

/// One pass at this spindle speed; the block in the middle at this feed, and with this speed where
/// one is given, which the next one takes back. Findings name the block by its line, from 1.
fn pass(speed: f64, feed: f64, is_inverse: bool, other: Option<f64>) -> (String, u64) {
    let (mode, first, above) = (if is_inverse { "G93" } else { "G94" }, PLACES[0], 40.0);
    let f = |feed: f64, way: f64| format!("F{:.4}", if is_inverse { feed / way } else { feed });
    let head = format!("G21 G90 {mode}\nT1 M6\nS{speed} M3\nG0 G43 {} H1", words([first, 0.0, above]));
    let mut lines: Vec<String> = head.lines().map(str::to_owned).collect();
    lines.push(format!("G1 {} {}", words([first, 0.0, 0.0]), f(ENTRIES, above)));
    let mut planted = 0;
    for (k, ends) in PLACES.windows(2).enumerate() {
        let (feed, s) = match k {
            1 => (feed, other),
            2 => (CUTS, other.map(|_| speed)),
            _ => (CUTS, None),
        };
        let s = s.map_or_else(String::new, |s| format!(" S{s}"));
        lines.push(format!("G1 {} {}{s}", words([ends[1], 0.0, 0.0]), f(feed, ends[1] - ends[0])));
        if k == 1 {
            planted = lines.len() as u64;
        }
    }
    lines.push(format!("G0 {}\nM30\n", words([PLACES[3], 0.0, above])));
    (lines.join("\n").replace("B10 ", "B10. "), planted)
}

/// Runs `facemill verify` on a program: its findings, all of which are faults.
fn findings(job: &JobFolder, text: &str, words: &str) -> Vec<Value> {
    job.write("program.nc", text.as_bytes());
    let output = facemill_in(job, &format!("verify program.nc --job job.json --out found.json {words}"));
    let found = job.json("found.json")["findings"].as_array().unwrap().clone();
    assert_eq!(output.code, i32::from(!found.is_empty()), "{text}{}{}", output.errors, output.printed);
    found
}

/// Holds findings to be the planted one alone, on its line, or none.
fn holds(found: &[Value], kind: &str, text: &str, planted: Option<u64>) {
    let Some(line) = planted else {
        assert!(found.is_empty(), "{text}{found:?}");
        return;
    };
    let [finding] = found else { panic!("{text}{found:?}") };
    assert_eq!([&finding["kind"], &finding["block_text"]], [kind, text.lines().nth(line as usize - 1).unwrap()]);
    assert_eq!([&finding["first_line"], &finding["last_line"]], [&json!(line), &json!(line)], "{finding}");
}

#[test]
fn a_feed_beyond_its_tolerance_is_found_on_its_line_and_one_within_it_is_not() {
    let speed = 6000.0;
    let job = job(speed);
    let cut = "--stock-cell-mm 1 --stock-tolerance-mm 0.002";
    for (limit, is_inverse, options) in
        [(ENTRIES, false, ""), (ENTRIES, true, ""), (CUTS, false, cut), (CUTS, true, cut)]
    {
        for (share, is_found) in [(1.1, true), (0.9, false)] {
            let feed = limit * (1.0 + share * FASTER);
            let (text, line) = pass(speed, feed, is_inverse, None);
            let found = findings(&job, &text, options);
            holds(&found, "feed_above_job", &text, is_found.then_some(line));
            if let Some(finding) = found.first() {
                let ratio = finding["measure"]["feed_ratio"].as_f64().unwrap();
                assert!((ratio - feed / limit).abs() < 1e-4, "{finding}");
            }
        }
    }
}

#[test]
fn a_spindle_speed_beyond_its_tolerance_is_found_on_its_line_and_one_within_it_is_not() {
    // Half a turn per minute, or a thousandth where that is more.
    for (requested, other, is_found) in [
        (300.55, 300.0, true),
        (300.45, 300.0, false),
        (10_000.0, 10_011.0, true),
        (10_000.0, 10_009.0, false),
        (10_000.0, 9989.0, true),
        (10_000.0, 9991.0, false),
    ] {
        let (text, line) = pass(requested, CUTS, false, Some(other));
        holds(&findings(&job(requested), &text, ""), "other_spindle_speed", &text, is_found.then_some(line));
    }
}
