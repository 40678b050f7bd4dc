//! Plans by constant scallop.

use facemill::report::outcome::Outcome;
use facemill_tests::commands::facemill_in;
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
    // What is within its tolerance as laid is not laid again.
    let rounds = &planned.report.cusps[0].width_rounds;
    assert!(rounds.len() == 1 && rounds[0].is_cut && rounds[0].largest_mm <= left.limit_mm, "{rounds:?}");
}

#[test]
fn seeds_groups_and_levels_that_lead_nowhere_are_refused_with_a_remedy() {
    let refused = |strategy: serde_json::Value, words: &[&str]| {
        let job = variant(&[(STRATEGY, strategy)]);
        let output = facemill_in(&job, "plan job.json");
        assert!(output.is_refused_for(words), "{words:?}: {} {}{}", output.code, output.printed, output.errors);
        assert!(
            output.errors.contains("operations[0].path") && output.errors.contains("job.json"),
            "{}",
            output.errors
        );
    };
    let seed = json!({ "cylinder": { "axis_direction": [0, 0, 1], "radius_mm": 900 } });
    refused(json!({ "constant_scallop": { "seed": seed } }), &["cylinder of radius 900 mm", "move the seed"]);
    let seed = json!({ "points_mm": [[-10, 0, 30], [10, 0, 30]] });
    refused(json!({ "constant_scallop": { "seed": seed } }), &["seed, point 0", "check frame and unit"]);
    refused(json!({ "constant_scallop": { "seed": { "group_border": "hub" } } }), &["hub"]);
    let levels = json!({ "parallel_planes": { "normal": [0, 1, 0], "from_mm": -4, "to_mm": 4 } });
    refused(json!({ "spiral": levels }), &["closed curve", "bound the levels"]);
}
