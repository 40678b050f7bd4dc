//! Feed modes, RTCP and operations with tolerances of their own: programs of one small job, planned
//! by the command, held to what every clean program is held to and to a law of its own.

use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::interpreter::{Axes, Motion};
use facemill_tests::oracles::read_back::{ReadBack, TipAndAxis, number};
use facemill_tests::variants::{APPROACH, CUTTING, Written, planned, strays, tiny_patch, variant};
use serde_json::{Value, json};

/// Largest speed of each axis of the machine file, word unit per minute.
pub(crate) fn axis_speeds(job: &JobFolder) -> Vec<(String, f64)> {
    fn joints(v: &Value, found: &mut Vec<(String, f64)>) {
        match v {
            Value::Object(map) => {
                let speed = map.get("max_velocity_mm_min").or(map.get("max_velocity_deg_min"));
                if let (Some(axis), Some(speed)) = (map.get("axis").and_then(Value::as_str), speed) {
                    found.push((axis.to_owned(), number(speed)));
                }
                map.values().for_each(|v| joints(v, found));
            }
            Value::Array(list) => list.iter().for_each(|v| joints(v, found)),
            _ => {}
        }
    }
    let mut found = Vec::new();
    joints(&job.json("machine.json"), &mut found);
    assert_eq!(found.len(), 5);
    found
}

/// The time that a block needs, s: of the tip's straight way at its feed and each axis' way at its
/// largest speed the longest.
pub(crate) fn needed_seconds(back: &ReadBack, m: &Motion, feed: f64, speeds: &[(String, f64)]) -> f64 {
    let (from, to) = (back.tool(&m.from, m.rtcp).0, back.end(m).0);
    let way = |axis: &str, a: &Axes| match axis {
        "X" => a.x,
        "Y" => a.y,
        "Z" => a.z,
        "B" => a.b,
        _ => a.c,
    };
    let axes = speeds.iter().map(|(axis, v)| (way(axis, &m.to) - way(axis, &m.from)).abs() / v);
    60.0 * axes.fold((to - from).norm() / feed, f64::max)
}

/// Every cutting block takes the time that tip feed and axes want, and their sum is the report's.
fn check_times(w: &Written, job: &JobFolder) {
    let speeds = axis_speeds(job);
    let mut sums = [0.0, 0.0];
    for (m, feed) in w.motions.iter().zip(&w.feeds) {
        let Some(feed) = *feed else { continue };
        let (needed, took) = (needed_seconds(&w.back, m, feed, &speeds), m.seconds());
        // F has decimals, and words are rounded: a thousandth of a millimetre of a short block.
        let slack = 2e-3 + 60.0 * 2e-3 / feed / needed;
        assert!((took / needed - 1.0).abs() < slack, "line {}: {took} s, needs {needed} s", m.line);
        sums[usize::from(feed == APPROACH)] += took;
    }
    for (sum, key) in sums.into_iter().zip(["passes_time_s", "approach_time_s"]) {
        assert!(sum > 1.0 && (sum / w.total(key) - 1.0).abs() < 1e-3, "{key}: {sum} s and {}", w.total(key));
    }
}

#[test]
fn g94_and_g93_move_alike_and_their_blocks_take_the_time_that_tip_feed_and_axes_want() {
    let quick = ("/feeds_within", json!("velocity"));
    let (job, inverse) =
        (variant(std::slice::from_ref(&quick)), variant(&[quick.clone(), ("/post/feed_mode", json!("g93"))]));
    let (g94, g93) = (planned(&job), planned(&inverse));
    g94.check();
    check_times(&g94, &job);
    check_times(&g93, &inverse);
    assert_eq!(g94.motions.len(), g93.motions.len());
    for (a, b) in g94.motions.iter().zip(&g93.motions) {
        assert_eq!((a.from, a.to, a.rapid), (b.from, b.to, b.rapid), "line {}", a.line);
        assert!(!a.inverse_time && b.inverse_time, "line {}", b.line);
        if !a.rapid {
            // F times the block's time is a minute: the time that G94 takes for the same way, up to
            // the decimals of both F.
            let f = b.feed.unwrap();
            let rounding = 0.05 / a.feed.unwrap() + 5e-4 / f + 1e-9;
            let way_rounding = 60.0 * 2e-3 / a.feed.unwrap() / a.seconds();
            let product = f * a.seconds();
            assert!((product / 60.0 - 1.0).abs() < rounding + way_rounding, "line {}: {product}", b.line);
        }
    }
}

/// The job with a control that goes straight with the tip, under a work offset that is neither the
/// table's frame nor the workpiece's. Which of several links is the fastest, the law of motion
/// decides: they stay as they are laid.
fn straight_tip(feed_mode: &str) -> JobFolder {
    let offset = json!({ "linear_mm": { "X": 41.5, "Y": -27.0, "Z": 260.0 } });
    let quick = ("/feeds_within", json!("velocity"));
    let links = ("/setups/0/links", json!({ "shorten": false }));
    let job = variant(&[("/post/feed_mode", json!(feed_mode)), ("/setups/0/work_offset", offset), links, quick]);
    if feed_mode == "rtcp" {
        let tolerance = json!({ "path_mm": 0.0, "orientation_deg": 0.0 });
        let motion = json!({ "cutting": "tip_and_rotaries_linear", "rapid": "linear", "control_tolerance": tolerance });
        job.set("machine.json", &[("/motion", motion)]);
    }
    job
}

#[test]
fn rtcp_and_axis_programs_of_a_job_take_the_tool_the_same_way() {
    let (axes_job, rtcp_job) = (straight_tip("g94"), straight_tip("rtcp"));
    let (axes, rtcp) = (planned(&axes_job), planned(&rtcp_job));
    axes.check();
    rtcp.check();
    check_times(&rtcp, &rtcp_job);
    assert!(rtcp.motions.iter().all(|m| m.rtcp) && !axes.motions.iter().any(|m| m.rtcp));
    assert!(rtcp.motions.len() <= axes.motions.len(), "{} {}", rtcp.motions.len(), axes.motions.len());
    let radius = axes.back.cutter.radius;
    let linearisation = 0.02;
    for rapid in [false, true] {
        let of = |w: &Written, step: f64| -> Vec<TipAndAxis> {
            w.motions.iter().filter(|m| m.rapid == rapid).flat_map(|m| w.back.places(m, step)).collect()
        };
        let step = 0.05;
        let [fine_axes, fine_rtcp] = [&axes, &rtcp].map(|w| of(w, step));
        let ends = |w: &Written| -> Vec<TipAndAxis> {
            w.motions.iter().filter(|m| m.rapid == rapid).map(|m| w.back.end(m)).collect()
        };
        // Each leaves the common way by its linearisation; a sample is half a step away. Rapids may
        // leave it by more.
        let limit = 2.0 * linearisation + step + if rapid { 1.0 } else { 0.0 };
        for (what, apart) in [
            ("RTCP from axes", strays(&ends(&rtcp), &fine_axes, radius)),
            ("axes from RTCP", strays(&ends(&axes), &fine_rtcp, radius)),
        ] {
            assert!(apart <= limit, "{what}, rapid {rapid}: {apart} mm");
        }
    }
}

#[test]
fn operations_keep_their_own_tolerances() {
    let job = tiny_patch();
    let mut fine = job.json("job.json")["operations"][0].clone();
    let mut coarse = fine.clone();
    coarse["name"] = json!("coarse");
    coarse["tolerances"]["linearisation_mm"] = json!(0.05);
    fine["name"] = json!("fine");
    fine["tolerances"]["linearisation_mm"] = json!(0.01);
    fine["tolerances"]["max_step_mm"] = json!(1.5);
    job.set("job.json", &[("/operations", json!([coarse, fine]))]);
    let w = planned(&job);
    // Each line against the budget of its own operation.
    w.check();
    let budgets = w.report["budgets"].as_array().unwrap();
    let totals: Vec<f64> = budgets.iter().map(|b| number(&b["against_mesh_mm"])).collect();
    for (k, b) in budgets.iter().enumerate() {
        let of = |key: &str| number(&b[key]);
        let written = of("path_chord_mm") + of("linearisation_mm") + of("gouge_mm");
        // The control's own contribution is no part of the text.
        assert!(totals[k] >= written - 1e-12 && totals[k] <= written + of("control_mm") + 1e-12, "{b}");
    }
    let blocks = |k: usize| w.motions.iter().filter(|m| !m.rapid && w.operation_of(m.line) == k).count();
    assert!(totals[0] > 1.3 * totals[1] && 2 * blocks(1) > 3 * blocks(0), "{totals:?}: {} {}", blocks(0), blocks(1));
    // Steps as each operation wants them.
    for (k, longest) in [(0, 3.0), (1, 1.5)] {
        for (m, feed) in w.motions.iter().zip(&w.feeds) {
            if *feed == Some(CUTTING) && w.operation_of(m.line) == k {
                let (a, b) = (w.back.tool(&m.from, m.rtcp).0, w.back.end(m).0);
                // The tip is at most as fast as the contact point on a patch as flat as this, and a
                // third.
                assert!((b - a).norm() < 1.33 * longest, "line {}: {}", m.line, (b - a).norm());
            }
        }
    }
}
