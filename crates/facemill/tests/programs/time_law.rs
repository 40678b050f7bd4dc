//! Planned programs under the law of motion, read back from their text.

#[path = "../../../feedrate/tests/laws/time_law/control_programs.rs"]
mod control_programs;
mod left_unsaid;
mod linuxcnc;
mod simulated;
mod vectors;

use std::path::Path;

use facemill::feedrate::{AxisBounds, ProgramBlock, ProgramSettings, machine_bounds, program_law};
use facemill::feeds::{FeedLaw, FeedRewriteSettings, TipFeed};
use facemill::inverse_kinematics::{AxisValues, Machine};
use facemill::nc_program::Dialect;
use facemill::new_job::{NewJob, new_job};
use facemill::{Job, PlanSettings, Planned, SilentStages, plan_setup, rewrite_feeds, summary};
use serde_json::{Value, json};

/// Plans the example patch with two passes, and values of job and machine set; `null` removes.
fn planned(job: &[(&str, Value)], machine: &[(&str, Value)]) -> Planned {
    let folder = tempfile::tempdir().unwrap();
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    let small = [
        ("/operations/0/tolerances/max_step_mm", json!(3.0)),
        ("/operations/0/search/tilt_deg", json!([14.0, 20.0])),
        (&format!("{planes}/from_mm"), json!(-1.0)),
        (&format!("{planes}/to_mm"), json!(1.0)),
    ];
    let of_job: Vec<(&str, Value)> = small.into_iter().chain(job.iter().cloned()).collect();
    for (name, bytes) in new_job(&NewJob::Patch { size_mm: 60.0 }).unwrap() {
        let values: &[(&str, Value)] = match name.as_str() {
            "job.json" => &of_job,
            "machine.json" => machine,
            _ => &[],
        };
        let bytes = if values.is_empty() { bytes } else { with(&bytes, values) };
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    plan(&folder.path().join("job.json"))
}

fn plan(job: &Path) -> Planned {
    let settings = PlanSettings { verify: false, certificates: false };
    plan_setup(&Job::read(job).unwrap(), 0, settings, &SilentStages).unwrap_or_else(|e| panic!("{e}"))
}

fn with(bytes: &[u8], values: &[(&str, Value)]) -> Vec<u8> {
    let mut file: Value = serde_json::from_slice(bytes).unwrap();
    for (pointer, value) in values {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        match file.pointer_mut(parent).unwrap() {
            Value::Object(map) if value.is_null() => drop(map.remove(key)),
            at => at[key] = value.clone(),
        }
    }
    serde_json::to_vec(&file).unwrap()
}

fn text(planned: &Planned) -> String {
    let file = planned.files.iter().find(|(name, _)| name == "program.nc").expect("a program");
    String::from_utf8(file.1.clone()).unwrap()
}

/// A motion of the text: where it ends, mm and rad, and its F; `None` in rapids.
struct Motion {
    end: AxisValues,
    feed: Option<f64>,
}

/// Reads G0, G1, X, Y, Z, B, C and F behind the length compensation, which stay until they are
/// given again.
fn motions(text: &str) -> Vec<Motion> {
    let body = text.lines().skip_while(|l| !l.contains("G43")).skip(1).take_while(|l| !l.contains("G91"));
    let (mut at, mut rapid, mut feed) = (AxisValues::zeros(5), true, 0.0);
    let mut out = Vec::new();
    for line in body.filter(|l| !l.starts_with('(')) {
        let mut moves = false;
        for word in line.split(' ') {
            let (letter, number) = word.split_at(1);
            let value: f64 = number.parse().unwrap();
            match "XYZBC".find(letter) {
                Some(k) => {
                    at[k] = if k > 2 { value.to_radians() } else { value };
                    moves = true;
                }
                None if letter == "F" => feed = value,
                None if word == "G0" || word == "G1" => rapid = word == "G0",
                None => {}
            }
        }
        if moves {
            out.push(Motion { end: at, feed: (!rapid).then_some(feed) });
        }
    }
    out
}

/// Returns the length of a block as F counts it: the norm over all axes with 1 deg as 1 mm.
fn f_length(a: &AxisValues, b: &AxisValues) -> f64 {
    (0..5).map(|k| (b[k] - a[k]) * if k > 2 { 1f64.to_degrees() } else { 1.0 }).fold(0.0, f64::hypot)
}

/// Returns consecutive cutting moves: their start, and each with the time of its F.
fn cutting_runs(motions: &[Motion]) -> Vec<(AxisValues, Vec<ProgramBlock>)> {
    let mut runs: Vec<(AxisValues, Vec<ProgramBlock>)> = Vec::new();
    for pair in motions.windows(2) {
        let Some(feed) = pair[1].feed else { continue };
        if pair[0].feed.is_none() {
            runs.push((pair[0].end, Vec::new()));
        }
        let tip_time = 60.0 * f_length(&pair[0].end, &pair[1].end) / feed;
        runs.last_mut().unwrap().1.push(ProgramBlock { end: pair[1].end, tip_time, exact_stop: false });
    }
    runs
}

/// Returns the largest share of any limit by first, second and third differences of positions over
/// steps of `time`/`n`: averages of derivatives, which in a motion within its limits no difference
/// exceeds.
fn worst_share(bounds: &[AxisBounds], time: f64, n: usize, position: impl Fn(f64) -> AxisValues) -> f64 {
    let h = time / n as f64;
    let q: Vec<AxisValues> = (0..n + 7).map(|k| position((k as f64 - 3.0) * h)).collect();
    let mut worst = 0.0_f64;
    for w in q.windows(4) {
        for (k, b) in bounds.iter().enumerate() {
            let [p0, p1, p2, p3] = [0, 1, 2, 3].map(|i| w[i][k]);
            let velocity = (p1 - p0) / (h * b.velocity);
            let acceleration = ((p2 - p1) - (p1 - p0)) / (h * h * b.acceleration);
            let jerk = ((p3 - p2) - 2.0 * (p2 - p1) + (p1 - p0)) / (h * h * h * b.jerk);
            worst = [velocity, acceleration, jerk].iter().fold(worst, |most, share| most.max(share.abs()));
        }
    }
    worst
}

fn bounds() -> Vec<AxisBounds> {
    machine_bounds(&Machine::head_b_table_c().unwrap()).unwrap()
}

/// Returns the approximate tolerance of each axis of the example under the control's 0.01 mm.
fn tolerance() -> ProgramSettings {
    ProgramSettings::blended(AxisValues::from([0.0029, 0.0029, 0.0029, 5e-6, 2e-5]))
}

#[test]
fn feeds_are_lowered_to_what_the_axes_reach_and_no_limit_is_exceeded_at_them() {
    let (quick, lowered) = (planned(&[("/feeds_within", json!("velocity"))], &[]), planned(&[], &[]));
    let (before, after) = (motions(&text(&quick)), motions(&text(&lowered)));
    assert_eq!(before.len(), after.len());
    let mut changed = 0;
    for (a, b) in before.iter().zip(&after) {
        assert_eq!((a.end, a.feed.is_some()), (b.end, b.feed.is_some()));
        assert!(b.feed <= a.feed, "{:?} {:?}", a.feed, b.feed);
        changed += usize::from(b.feed < a.feed);
    }
    let law = lowered.report.time_law.as_ref().unwrap();
    assert!(changed > after.len() / 4 && law.lowered_blocks.abs_diff(changed) <= changed / 20, "{changed} {law:?}");
    assert_eq!(quick.report.time_law.as_ref().unwrap().lowered_blocks, 0);
    // The program as it is written, by differences of positions.
    let bounds = bounds();
    let (mut time, mut hot) = (0.0, [0, 0]);
    for (start, blocks) in cutting_runs(&after) {
        let law = program_law(&start, &blocks, &bounds, &tolerance()).unwrap();
        // Steps of about 2 ms: rounding in third differences then is 1e-3 of the jerks.
        let steps = (law.total_time() / 2e-3) as usize;
        let share = worst_share(&bounds, law.total_time(), steps, |t| law.at(t).position);
        assert!(share <= 1.0 + 2e-3, "{share}");
        for (block, peak) in blocks.iter().zip(law.block_peak_times()) {
            hot[usize::from(block.tip_time >= 0.9 * peak)] += 1;
        }
        time += law.total_time();
    }
    let reported = law.passes_time_s + law.approach_time_s;
    assert!((time / reported - 1.0).abs() < 0.05, "{time} {reported}");
    // Few blocks have a feed a tenth above the one they reach: the tolerance here is not quite the
    // planner's.
    assert!(hot[0] * 10 < hot[1], "{hot:?}");
    let at_f: f64 = cutting_runs(&after).iter().flat_map(|r| &r.1).map(|b| b.tip_time).sum();
    let totals = &lowered.report.totals;
    assert!((totals.passes_time_s + totals.approach_time_s - at_f).abs() < 2e-3 * at_f && at_f < reported);
    let shares: f64 = law.held_back_by.iter().map(|h| h.share).sum();
    assert!((shares - 1.0).abs() < 1e-9 && law.held_back_by.windows(2).all(|h| h[0].share >= h[1].share));
}

#[test]
fn without_jerk_a_machine_plans_as_without_the_law_and_says_so() {
    let jerk = "/tool_chains/0/rows/1/joint/prismatic/max_jerk_mm_s3";
    // The law has no say in postures that the job fixes.
    let fixed = ("/operations/0/search/mode", json!({ "fixed": { "lead_deg": 15.0, "lean_deg": 4.0 } }));
    let without = planned(std::slice::from_ref(&fixed), &[(jerk, Value::Null)]);
    let quick = planned(&[fixed, ("/feeds_within", json!("velocity"))], &[]);
    assert_eq!(text(&without), text(&quick));
    assert!(without.report.time_law.is_none() && quick.report.no_time_law.is_empty());
    assert_eq!(without.report.no_time_law.len(), 1);
    let reported = summary(&without.report);
    assert!(reported.contains("no jerk for axis X") && reported.contains(" at constant speed\n"), "{reported}");
    assert!(summary(&quick.report).contains("(at constant speed "));
}

#[test]
fn timed_programs_do_not_depend_on_the_number_of_threads() {
    let on = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| planned(&[("/post/feed_mode", json!("g93"))], &[])).files
    };
    assert!(on(1) == on(2));
}

/// Returns the time from rest to rest of an axis alone: its largest speed by bisection.
fn rest_to_rest(way: f64, b: &AxisBounds) -> f64 {
    let change = |u: f64| {
        if u * b.jerk >= b.acceleration.powi(2) {
            u / b.acceleration + b.acceleration / b.jerk
        } else {
            2.0 * (u / b.jerk).sqrt()
        }
    };
    let (mut low, mut high) = (0.0, b.velocity);
    for _ in 0..200 {
        let u = 0.5 * (low + high);
        if u * change(u) <= way { low = u } else { high = u }
    }
    if way > 0.0 { 2.0 * change(low) + (way - low * change(low)) / low } else { 0.0 }
}

#[test]
fn rapids_of_axes_on_their_own_take_the_slowest_axis_time_from_stop_to_stop() {
    let motion = json!({
        "cutting": "axes_linear",
        "rapid": "per_axis",
        "control_tolerance": { "path_mm": 0.0, "orientation_deg": 0.0 },
    });
    let planned = planned(&[], &[("/motion", motion)]);
    let bounds = bounds();
    let read = motions(&text(&planned));
    let rapid = |pair: &[Motion]| {
        let times = bounds.iter().enumerate().map(|(k, b)| rest_to_rest((pair[1].end[k] - pair[0].end[k]).abs(), b));
        if pair[1].feed.is_none() { times.fold(0.0, f64::max) } else { 0.0 }
    };
    // From home the rotary axes go first, then X and Y, then Z; back the other way round.
    let (first, last, home) = (read[0].end, read[read.len() - 1].end, home_words());
    let leg = |axes: &[usize], a: &AxisValues, b: &AxisValues| {
        axes.iter().map(|&k| rest_to_rest((b[k] - a[k]).abs(), &bounds[k])).fold(0.0, f64::max)
    };
    let ways: f64 =
        [&[3, 4][..], &[0, 1], &[2]].iter().map(|axes| leg(axes, &home, &first) + leg(axes, &last, &home)).sum();
    let least = ways + read.windows(2).map(rapid).sum::<f64>();
    assert!(summary(&planned.report).contains("at every corner"));
    let law = planned.report.time_law.unwrap();
    assert!(
        law.stops_at_corners && least > 1.0 && (law.rapid_time_s - least).abs() < 1e-6 * least,
        "{} {least}",
        law.rapid_time_s
    );
    // Without a tolerance the axes stop at every corner.
    let stopping: f64 = cutting_runs(&read)
        .iter()
        .map(|(start, blocks)| program_law(start, blocks, &bounds, &ProgramSettings::stopping()).unwrap().total_time())
        .sum();
    let reported = law.passes_time_s + law.approach_time_s;
    assert!((reported / stopping - 1.0).abs() < 0.01, "{reported} {stopping}");
}

/// Returns the example's machine, and its tool from the gauge line to the tip, mm.
fn shop() -> (Machine, f64) {
    let files = new_job(&NewJob::Patch { size_mm: 60.0 }).unwrap();
    let tool = files.iter().find(|(name, _)| name == "tool.json").unwrap();
    let tool: Value = serde_json::from_slice(&tool.1).unwrap();
    (Machine::head_b_table_c().unwrap(), tool["gauge_length_mm"].as_f64().unwrap())
}

/// Words of the example at home, with the tool's length in force.
fn home_words() -> AxisValues {
    let (machine, tool_length) = shop();
    let mut home = machine.home();
    home[2] -= tool_length;
    home
}

fn within_the_law(machine: &Machine, tool_length: f64, blend_tolerance: Option<f64>) -> FeedRewriteSettings<'_> {
    FeedRewriteSettings {
        machine,
        tool_length,
        tip_feed: TipFeed::Keep,
        work_offset: Vec::new(),
        dialect: Dialect::Fanuc,
        dialect_file: None,
        time_law: Some(FeedLaw { blend_tolerance }),
    }
}

#[test]
fn new_feeds_within_the_law_are_those_that_a_plan_has_within_it() {
    let mode = ("/post/feed_mode", json!("g93"));
    let decimals = ("/post/decimals/inverse_time", json!(5));
    let quick = planned(&[mode.clone(), decimals.clone(), ("/feeds_within", json!("velocity"))], &[]);
    let lowered = planned(&[mode, decimals], &[]);
    let (machine, tool_length) = shop();
    let new = rewrite_feeds(text(&quick).as_bytes(), &within_the_law(&machine, tool_length, None)).unwrap();
    let reported = new.summary.time_law.unwrap();
    let law = lowered.report.time_law.as_ref().unwrap();
    let time = law.passes_time_s + law.approach_time_s;
    assert!((reported.cutting_time_s / time - 1.0).abs() < 0.01, "{reported:?} {law:?}");
    // Here the feeds that there were are those of FEED.
    assert!((reported.cutting_time_before_s / time - 1.0).abs() < 0.01, "{reported:?} {law:?}");
    // The same program under the same law has one time for every reader, with the moves to the part
    // and home.
    let again = rewrite_feeds(text(&lowered).as_bytes(), &within_the_law(&machine, tool_length, None)).unwrap().summary;
    let of_text = again.time_law.unwrap();
    let is_same = |a: f64, b: f64| (a - b).abs() < 1e-9 * b;
    assert!(is_same(of_text.rapid_time_s, law.rapid_time_s) && is_same(of_text.cutting_time_before_s, time), "{law:?}");
    let totals = &lowered.report.totals;
    assert!(is_same(again.rapid_time_s, totals.rapid_time_s), "{again:?} {totals:?}");
    let moves = motions(&text(&lowered));
    let (first, last, home) = (moves[0].end, moves[moves.len() - 1].end, home_words());
    let ways = machine.travel_time(&home, &first) + machine.travel_time(&last, &home);
    assert!(ways > 1.0 && totals.rapid_time_s > 0.99 * ways, "{ways} s of {totals:?}");
    assert!(reported.lowered_blocks.abs_diff(law.lowered_blocks) <= law.lowered_blocks / 10, "{reported:?} {law:?}");
    let new = String::from_utf8(new.text).unwrap();
    let all = [motions(&text(&quick)), motions(&new), motions(&text(&lowered))];
    assert!(all.iter().all(|m| m.len() == all[0].len()));
    let mut apart = 0;
    for ((before, new), planned) in all[0].iter().zip(&all[1]).zip(&all[2]) {
        assert!(new.end == before.end && new.feed <= before.feed, "{:?} {:?}", new.feed, before.feed);
        let ratio = new.feed.zip(planned.feed).map_or(1.0, |(a, b)| a / b);
        apart += usize::from((ratio - 1.0).abs() > 0.02);
    }
    assert!(apart * 20 < all[0].len(), "{apart} of {}", all[0].len());
    let is_f = |word: &&str| !word.starts_with('F');
    let bare = |text: &str| text.split([' ', '\n']).filter(is_f).collect::<Vec<_>>().join(" ");
    assert_eq!(bare(&new), bare(&text(&quick)));
    // Wider blends are not slower, stops at every corner are.
    let time = |blend_tolerance: Option<f64>| {
        let settings = within_the_law(&machine, tool_length, blend_tolerance);
        rewrite_feeds(text(&quick).as_bytes(), &settings).map(|new| new.summary.time_law.unwrap().cutting_time_s)
    };
    let [wide, own, stops] = [Some(0.5), None, Some(0.0)].map(|tolerance| time(tolerance).unwrap());
    assert!(wide < own && own < 0.9 * stops, "{wide} {own} {stops}");
    assert!(time(Some(-0.1)).unwrap_err().contains("--blend-tolerance-mm"));
}

#[test]
fn machines_without_limits_are_refused_by_axis() {
    let (machine, tool_length) = shop();
    let file = facemill::file_format::to_json(&machine.to_file());
    let file: Vec<&str> = file.lines().collect();
    // The last line of the first joint, C, is its jerk.
    let at = file.iter().position(|l| l.contains("max_jerk_deg_s3")).unwrap();
    let mut kept: Vec<String> = file.iter().map(|l| (*l).to_owned()).collect();
    kept[at - 1] = kept[at - 1].trim_end_matches(',').to_owned();
    kept.remove(at);
    let machine = Machine::from_json(kept.join("\n").as_bytes()).unwrap();
    let why = rewrite_feeds(b"%\nO1\nM30\n%\n", &within_the_law(&machine, tool_length, None)).unwrap_err();
    assert!(why.contains("--time-law") && why.contains("jerk for axis C") && why.contains(machine.name()), "{why}");
}
