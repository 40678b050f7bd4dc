//! Plans by constant scallop.

use facemill::report::outcome::Outcome;
use facemill_tests::variants::variant;
use serde_json::json;

const STRATEGY: &str = "/operations/0/path/strategy/strategy";

#[test]
fn a_patch_is_cut_from_a_seed_in_its_middle_within_its_tolerance() {
    let planes = json!({ "normal": [0, 1, 0], "from_mm": -4, "to_mm": 4 });
    let scallop = json!({ "seed": { "plane": { "normal": [0, 1, 0] } }, "within": { "parallel_planes": planes } });
    let job = variant(&[(STRATEGY, json!({ "constant_scallop": scallop }))]);
    let planned = job.try_plan().unwrap_or_else(|e| panic!("{e}"));
    assert!(planned.outcome() == Outcome::Done);
    let left = &planned.report.remaining.as_ref().expect("a verified plan").operations[0];
    assert!(!left.exceeded, "{left:?}");
}

#[test]
fn a_seed_beside_the_patch_is_refused_with_a_remedy() {
    let seed = json!({ "cylinder": { "axis_direction": [0, 0, 1], "radius_mm": 900 } });
    let job = variant(&[(STRATEGY, json!({ "constant_scallop": { "seed": seed } }))]);
    let Err(e) = job.try_plan() else { panic!("no seed") };
    let e = e.to_string();
    assert!(e.contains("cylinder of radius 900 mm") && e.contains("move the seed"), "{e}");
}
