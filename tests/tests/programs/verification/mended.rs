//! Blocks in which the written program goes too deep, though each of its ends is clean, are halved.

use facemill::{Job, PlanSettings, Planned, SilentStages, plan_setup};
use facemill_tests::jobs::{JobFolder, text_of};
use facemill_tests::oracles::read_back::apt_feeds;
use facemill_tests::variants::{CUTTING, tiny_patch, tiny_patch_planned};
use serde_json::{Value, json};

/// A ridge across the passes: a prism so thin that the cutter comes over it between two points.
fn ridge_obj(x: f64, low: f64, high: f64) -> String {
    let mut text = String::from("o ridge\n");
    for y in [-12.0, 12.0] {
        text += &format!("v {} {y} {low}\nv {} {y} {low}\nv {x} {y} {high}\n", x - 0.05, x + 0.05);
    }
    for face in ["1 2 3", "6 5 4", "1 4 5", "1 5 2", "2 5 6", "2 6 3", "3 6 4", "3 4 1"] {
        text += &format!("f {face}\n");
    }
    text
}

/// Height of the patch at a place, by its vertices.
fn height_at(job: &JobFolder, x: f64, y: f64) -> f64 {
    let text = std::fs::read_to_string(job.path("patch.obj")).unwrap();
    let vertices = text.lines().filter_map(|l| l.strip_prefix("v ")).map(|l| {
        let v: Vec<f64> = l.split_whitespace().map(|w| w.parse().unwrap()).collect();
        ((v[0] - x).hypot(v[1] - y), v[2])
    });
    vertices.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap().1
}

/// Passes with a point every 6 mm, and a ridge a little higher than the cutter may be deep, across
/// them.
fn over_a_ridge() -> JobFolder {
    let job = tiny_patch();
    let top = height_at(&job, 4.3, 0.0);
    job.write("ridge.obj", ridge_obj(4.3, top - 4.0, top + 0.35).as_bytes());
    let meshes = job.json("job.json")["setups"][0]["meshes"].as_array().unwrap().clone();
    let ridge = json!({ "file": "ridge.obj", "role": "part" });
    let meshes: Vec<Value> = meshes.into_iter().chain([ridge]).collect();
    job.set(
        "job.json",
        &[
            ("/setups/0/meshes", json!(meshes)),
            ("/operations/0/tolerances/max_step_mm", json!(6.0)),
            ("/operations/0/tolerances/path_chord_mm", json!(0.2)),
            ("/operations/0/tolerances/max_lift_mm", json!(0.5)),
            ("/operations/0/tolerances/linearisation_mm", json!(0.01)),
            ("/operations/0/infeasible", json!({ "trim": { "max_trimmed_fraction": 0.2 } })),
            facemill_tests::jobs::unfinished(),
        ],
    );
    job
}

fn plan(job: &JobFolder, certificates: bool) -> Planned {
    let settings = PlanSettings { verify: true, certificates };
    plan_setup(&Job::read(&job.job()).unwrap(), 0, settings, &SilentStages).unwrap()
}

#[test]
fn a_ridge_between_two_points_is_gone_over_by_points_put_in() {
    let planned = plan(&over_a_ridge(), true);
    let report = &planned.report;
    println!("{} mended of {}, {:?}", report.totals.mended_blocks, report.totals.blocks, report.certified);
    assert!(report.totals.mended_blocks > 0);
    assert!(planned.is_clean(), "{:?}", report.findings);
    let certified = report.certified.as_ref().unwrap();
    assert_eq!(certified.certified, certified.blocks);
}

#[test]
fn points_put_in_keep_the_feed_of_their_chips() {
    let job = over_a_ridge();
    // So small a target that every cut has the smallest feed.
    let (target, min) = (1e-3, 500.0);
    job.set(
        "job.json",
        &[("/operations/0/feeds/removal_rate", json!({ "target_cm3_min": target, "min_mm_min": min }))],
    );
    let planned = plan(&job, false);
    assert!(planned.report.totals.mended_blocks > 0);
    let feeds = apt_feeds(&text_of(&planned, "program.apt"));
    let n = |feed: f64| feeds.iter().filter(|f| **f == Some(feed)).count();
    assert_eq!(n(CUTTING), 0);
    // Every cut, those put in among them; points with a chip are fewer.
    let cut = planned.report.chips[0].feeds_set_by.removal_rate;
    assert!(n(min) >= cut + planned.report.totals.mended_blocks, "{} of {cut} points", n(min));
}

#[test]
fn a_program_that_holds_is_left_alone() {
    assert_eq!(tiny_patch_planned().total("mended_blocks"), 0.0);
}
