//! Jobs that cannot be meant on a machine with two heads, or with one, are refused by field.

use std::path::Path;

use facemill::inverse_kinematics::preset_dual_xyzb;
use facemill::nc_program::Dialect;
use facemill::new_job::NewJob;
use facemill::rapids::{RapidsRequest, faster_rapids};
use facemill::{CutRequest, Job, PlanSettings, Scene, Setup, SilentStages, UseScene};
use facemill_tests::jobs::{JobFolder, set};
use serde_json::{Value, json};

/// Returns the refusal of a job with one value set.
fn refusal(job: &JobFolder, pointer: &str, value: Value) -> String {
    let before = job.json("job.json");
    job.set("job.json", &[(pointer, value)]);
    let refused = Job::read(&job.job()).err().unwrap_or_else(|| panic!("{pointer} is taken")).to_string();
    job.write("job.json", facemill::file_format::to_json(&before).as_bytes());
    refused
}

#[test]
fn jobs_that_two_heads_cannot_mean_are_refused_by_field() {
    let job = JobFolder::new(&NewJob::DualPropeller { diameter_mm: 1000.0 });
    let pair = |first: &str, second: &str| json!([{ "first": first, "second": second }]);
    let sides = pair("suction side", "pressure side");
    let twice = json!([sides[0], sides[0]]);
    let mut leaning = sides.clone();
    set(&mut leaning, "/0/lean_back_deg", json!(181.0));
    for (pointer, value, reported) in [
        ("/second_tool", Value::Null, &["second_tool", "is needed", "two heads"][..]),
        ("/second_tool", json!("tool-3.json"), &["tool-3.json"]),
        ("/operations/1/head", json!(3), &["operations[1].head", "2 head(s)", "no head 3"]),
        ("/operations/1/head", json!(0), &["operations[1].head", "no head 0"]),
        ("/operations/1/head", json!(1), &["pairs[0].second", "is of head 1, must be of head 2"]),
        ("/pairs", pair("pressure side", "suction side"), &["pairs[0].first", "is of head 2, must be of head 1"]),
        ("/pairs", pair("suction side", "back"), &["pairs[0].second", "0 operations are named \"back\""]),
        ("/pairs", twice, &["pairs[1].first", "in a pair already"]),
        ("/operations/1/feeds/coolant", json!("off"), &["operations[1].feeds.coolant", "switches the coolant once"]),
        ("/post/feed_mode", json!("rtcp"), &["post.feed_mode", "the tip of one head"]),
        ("/pairs", leaning, &["pairs[0].lean_back_deg", "181"]),
    ] {
        let refused = refusal(&job, pointer, value);
        assert!(reported.iter().all(|part| refused.contains(part)), "{pointer}: {refused}");
    }
}

#[test]
fn what_is_for_two_heads_is_refused_on_a_machine_with_one() {
    let job = JobFolder::new(&NewJob::Patch { size_mm: 80.0 });
    let plane = json!({ "plane": { "origin_mm": [0.0, 0.0, -50.0], "normal": [0.0, 0.0, -1.0] } });
    for (pointer, value, reported) in [
        ("/second_tool", json!("tool.json"), "second_tool: is for machines with two heads"),
        ("/setups/0/second_clearance", plane, "setups[0].second_clearance: is for machines with two heads"),
        ("/pairs", json!([{ "first": "a", "second": "b" }]), "pairs: is for machines with two heads"),
        ("/operations/0/head", json!(2), "operations[0].head: the machine has 1 head(s)"),
    ] {
        let refused = refusal(&job, pointer, value);
        assert!(refused.contains(reported), "{pointer}: {refused}");
    }
}

/// One tool file for both heads has one number and one length register: a control could not tell
/// the tools apart.
#[test]
fn both_heads_with_one_tool_are_refused() {
    let job = JobFolder::new(&NewJob::Patch { size_mm: 80.0 });
    job.write("machine.json", preset_dual_xyzb().as_bytes());
    job.set("job.json", &[("/second_tool", json!("tool.json"))]);
    let refused = job.try_plan().err().map(|e| e.to_string()).unwrap_or_default();
    assert!(refused.contains("the heads `1` and `2` both have H1"), "{refused}");
}

/// No change of the program helps: its heads would have to be moved otherwise at the same time.
#[test]
fn links_of_programs_for_two_heads_are_not_replaced_and_the_error_says_what_runs_them() {
    let job = JobFolder::new(&NewJob::DualPropeller { diameter_mm: 1000.0 });
    let cut = CutRequest::on_lines(4.0, 0.1);
    let program = Path::new("program.nc");
    let request = RapidsRequest { program, dialect: Dialect::Fanuc, setup: 0, gouge_limit: None, cut, clearance: None };
    let refused = faster_rapids(&Job::read(&job.job()).unwrap(), b"G0 X1=0.\n", &request, &SilentStages);
    let refused = refused.map(|_| ()).unwrap_err().to_string();
    for part in ["job.json", "second_tool", "two heads", "facemill verify"] {
        assert!(refused.contains(part), "{refused}");
    }
}

/// A scene is that of one head: planned or run alone, the other head would be missing.
#[test]
fn a_scene_of_a_machine_with_two_heads_is_refused() {
    let folder = JobFolder::new(&NewJob::DualPropeller { diameter_mm: 1000.0 });
    let job = Job::read(&folder.job()).unwrap().seen_by(1, 0.0);
    let setup = Setup::read(&job, 0).unwrap();
    let scene = Scene::new(&job, &setup, 0).unwrap();
    let settings = PlanSettings { verify: false, certificates: false };
    let refused = [
        scene.search("suction side", &[], true).err(),
        scene.plan(settings, &SilentStages).err(),
        scene.verify(b"M30\n", Dialect::Fanuc, &SilentStages).err(),
        scene.cut(b"M30\n", Dialect::Fanuc, CutRequest::on_lines(10.0, 0.1), &SilentStages).err(),
    ];
    for why in refused {
        assert!(why.as_ref().is_some_and(|why| why.to_string().contains("second_tool")), "{why:?}");
    }
}
