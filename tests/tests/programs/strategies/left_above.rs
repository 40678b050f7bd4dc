//! Passes where earlier programs left stock, and nowhere else: a band that a large mill left out is
//! found, cut by a smaller one, and gone.

use std::path::Path;

use facemill::job_file::JobFile;
use facemill::nc_program::Dialect;
use facemill::report::left_above::LeftAboveReport;
use facemill::report::outcome::Outcome;
use facemill::{
    CutRequest, Failure, Job, PlanSettings, Planned, SilentStages, VerifyRequest, plan_setup, summary, verify_program,
};
use facemill_tests::jobs::{JobFolder, text_of};
use facemill_tests::variants::{box_obj, variant};
use serde_json::{Value, json};

/// Height above which stock is to be cut; the stock is 0.2 mm high, and cusps are a third of this.
pub(crate) const LIMIT: f64 = 0.12;
pub(crate) const OVERLAP: f64 = 1.5;

/// A wavy patch of 80 mm between y = -10 and 10, and the program of a mill of 8 mm that left out a
/// band about its middle.
pub(crate) fn half_cut() -> JobFolder {
    let job = variant(&[
        ("/operations/0/tolerances/cusp_mm", json!(0.04)),
        ("/operations/0/tolerances/max_step_mm", json!(4.0)),
        ("/operations/0/tolerances/max_lift_mm", json!(0.02)),
    ]);
    let planes = "/path/strategy/strategy/parallel_planes";
    let both = [("low", -10.0, -4.0), ("high", 4.0, 10.0)].map(|(name, from, to)| {
        let mut operation = job.json("job.json")["operations"][0].clone();
        operation["name"] = json!(name);
        let range = operation.pointer_mut(planes).expect("planes");
        (range["from_mm"], range["to_mm"]) = (json!(from), json!(to));
        operation
    });
    let mut whole = both[0].clone();
    whole["name"] = json!("whole");
    whole.pointer_mut(planes).expect("planes")["to_mm"] = json!(10.0);
    job.set("job.json", &[("/operations", json!(both))]);
    let text = text_of(&planned(&job, true).expect("a plan"), "program.nc");
    job.write("large.nc", text.as_bytes());
    // The same with a mill of 6 mm, of all of it.
    let mut small = job.json("tool.json");
    for (key, value) in [("radius_mm", 3.0), ("dead_core_radius_mm", 2.0)] {
        small[key] = json!(value);
    }
    small["name"] = json!("face mill D6 r0.3");
    for (key, value) in [("diameter_low_mm", 5.2), ("diameter_high_mm", 4.8)] {
        small["body"]["sections"][0][key] = json!(value);
    }
    job.write("small.json", small.to_string().as_bytes());
    job.set("job.json", &[("/operations", json!([whole]))]);
    job
}

fn planned(job: &JobFolder, verify: bool) -> Result<Planned, Failure> {
    plan_setup(&Job::read(&job.job())?, 0, PlanSettings { verify, certificates: false }, &SilentStages)
}

/// Limits the region to what is left of a stock, for the small mill.
pub(crate) fn limit_to(job: &JobFolder, of: Value) {
    let left_above = json!({ "height_mm": LIMIT, "overlap_mm": OVERLAP, "of": of });
    job.set(
        "job.json",
        &[("/tool", json!("small.json")), ("/operations/0/path/strategy/region", json!({ "left_above": left_above }))],
    );
}

fn found(planned: &Planned) -> &LeftAboveReport {
    &planned.report.left_above[0]
}

pub(crate) fn large() -> Value {
    json!({ "file": "large.nc", "tool": "tool.json" })
}

#[test]
fn a_small_mill_cuts_what_a_large_one_left_and_nothing_more() {
    let job = half_cut();
    let rest = {
        let cut = CutRequest::on_lines(0.5, 0.02);
        let request = VerifyRequest { cut: Some(cut), ..VerifyRequest::new(Path::new("large.nc"), Dialect::Fanuc) };
        let text = std::fs::read(job.path("large.nc")).expect("a program");
        let verified = verify_program(&Job::read(&job.job()).expect("a job"), &text, &request, &SilentStages);
        verified.expect("a run").rest.expect("a rest")
    };
    job.write("large.stock", &rest.to_bytes());
    job.set("job.json", &[("/tool", json!("small.json"))]);
    let everywhere = planned(&job, false).expect("a plan");

    limit_to(&job, json!({ "programs": [large()] }));
    let plan = planned(&job, true).expect("a plan");
    assert_eq!(plan.outcome(), Outcome::Done, "{}", summary(&plan.report));
    let left = found(&plan);
    assert!(left.islands == 1 && left.not_reached.is_empty(), "{left:?}");
    assert!((left.reached_mm2 - left.area_mm2).abs() < 1e-6, "{left:?}");
    // Between passes at -4 and 4 of a cutter of 8 mm.
    assert!(left.area_mm2 > 80.0 * 2.0 && left.area_mm2 < 80.0 * 7.0, "{left:?}");
    let length = |p: &Planned| p.report.totals.passes_length_mm;
    assert!(length(&plan) < 0.65 * length(&everywhere), "{} of {}", length(&plan), length(&everywhere));
    assert!(summary(&plan.report).contains("left above"));

    // On lines the same is found, to their distance along both sides of the band.
    limit_to(&job, json!({ "rest": "large.stock" }));
    let by_lines = planned(&job, false).expect("a plan");
    let apart = (found(&by_lines).area_mm2 - left.area_mm2).abs();
    assert!(apart < 2.0 * 80.0 * 0.71 && found(&by_lines).islands == 1, "{apart}: {:?}", found(&by_lines));

    // After both programs nothing is left above the limit, and there is nothing to do.
    job.write("small.nc", text_of(&plan, "program.nc").as_bytes());
    limit_to(&job, json!({ "programs": [large(), { "file": "small.nc" }] }));
    let nothing = planned(&job, true).err().expect("no program");
    assert!(matches!(&nothing, Failure::NothingToCut(why) if why.contains("left above 0.12 mm")), "{nothing}");
    // The small program alone leaves both sides of its band, less the overlap and half a cutter on
    // each: the measure is not of the last program.
    limit_to(&job, json!({ "programs": [{ "file": "small.nc" }] }));
    let other = planned(&job, false).expect("a plan");
    let least = 80.0 * 20.0 - left.area_mm2 - 80.0 * 2.0 * (OVERLAP + 3.0);
    assert!(found(&other).islands == 2 && found(&other).area_mm2 > least, "{least}: {:?}", found(&other));
}

#[test]
fn stock_that_cannot_be_measured_is_refused_with_a_remedy() {
    let job = variant(&[]);
    let file: JobFile = job.file();
    assert_eq!(file.operations.len(), 1);
    let refused = |job: &JobFolder, of: Value, words: &[&str]| {
        limit_to(job, of);
        job.set("job.json", &[("/tool", json!("tool.json"))]);
        let why = planned(job, false).err().expect("an error").to_string();
        assert!(words.iter().all(|word| why.contains(word)), "{why}");
    };
    refused(&job, json!({ "rest": "none.stock" }), &["none.stock"]);
    job.write("text.stock", b"no stock");
    refused(&job, json!({ "rest": "text.stock" }), &["text.stock"]);
    job.write("air.nc", b"%\nO1\nG21 G90\nM30\n%\n");
    refused(&job, json!({ "programs": [{ "file": "air.nc" }] }), &["air.nc", "no cutting move"]);
    refused(&job, json!({ "programs": [] }), &["left_above.of.programs", "at least 1"]);
    refused(&job, json!({ "programs": [{ "file": "air.nc", "tool": "none.json" }] }), &["none.json"]);

    // A rest of another part.
    let other = variant(&[]);
    other.write("patch.obj", box_obj([-40.0, -40.0, -5.0], [40.0, 40.0, 0.0]).as_bytes());
    let cut = CutRequest::on_lines(4.0, 0.1);
    let request = VerifyRequest { cut: Some(cut), ..VerifyRequest::new(Path::new("air.nc"), Dialect::Fanuc) };
    let text = std::fs::read(job.path("air.nc")).expect("a program");
    let verified = verify_program(&Job::read(&other.job()).expect("a job"), &text, &request, &SilentStages);
    job.write("other.stock", &verified.expect("a run").rest.expect("a rest").to_bytes());
    refused(&job, json!({ "rest": "other.stock" }), &["other.stock", "not a rest of the stock"]);

    job.set("job.json", &[("/setups/0/stock", json!({ "offset": { "allowance_mm": 0 } }))]);
    refused(&job, json!("initial_stock"), &["left_above", "nowhere above", "state the stock"]);
}

/// An offset of 0.2 mm is left everywhere above 0.12 mm, and nowhere above 0.3 mm.
#[test]
fn initial_stock_is_left_where_it_is_higher_than_the_limit() {
    let job = variant(&[("/operations/0/tolerances/max_step_mm", json!(8.0))]);
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    job.set("job.json", &[(&format!("{planes}/from_mm"), json!(-20.0)), (&format!("{planes}/to_mm"), json!(20.0))]);
    limit_to(&job, json!("initial_stock"));
    job.set("job.json", &[("/tool", json!("tool.json"))]);
    let all = planned(&job, false).expect("a plan");
    assert!((found(&all).area_mm2 / (40.0 * 80.0) - 1.0).abs() < 0.1, "{:?}", found(&all));
    let high = json!({ "height_mm": 0.3, "overlap_mm": OVERLAP, "of": "initial_stock" });
    job.set("job.json", &[("/operations/0/path/strategy/region/left_above", high)]);
    let none = planned(&job, false).err().expect("no program");
    assert!(matches!(none, Failure::NothingToCut(_)), "{none}");
}
