//! A main blade and its splitter from one profile file: each side is planned with the other blade
//! as an obstacle.

use std::f64::consts::TAU;

use facemill::new_job::{NewJob, new_job};
use facemill::report::outcome::Outcome;
use facemill::{Failure, Job, PlanSettings, Planned, SilentStages, plan_setup};
use facemill_tests::jobs::JobFolder;
use facemill_tests::tables::blades::{spread_passes, take_band};
use serde_json::json;

/// Sections of a radial blade of thin ellipses about a place of x and z, mm.
fn sections(title: &str, half_chord: f64, [x, z]: [f64; 2], n: u32) -> String {
    let mut text = format!("## {title}\n");
    for (k, radius) in [60.0, 80.0, 100.0].into_iter().enumerate() {
        text += &format!("# Profile {}\n", k + 1);
        for j in 0..=n {
            let (sin, cos) = (TAU * f64::from(j % n) / f64::from(n)).sin_cos();
            text += &format!("{} {radius} {}\n", x + 0.08 * half_chord * sin, z - half_chord * cos);
        }
    }
    text
}

/// Job of a main blade of 100 mm chord and a splitter of 60 mm at a place of x and z, with passes
/// along a band in the middle of each side, `spread` times as far apart as written.
fn job_of_set(splitter: [f64; 2], (band, spread): (f64, f64)) -> JobFolder {
    let profile = sections("Main blade", 50.0, [0.0; 2], 24) + &sections("Splitter blade", 30.0, splitter, 18);
    let ends = [0, 1].map(|k| format!("Blade {k} LE: EllipseEnd\nBlade {k} TE: EllipseEnd\n")).concat();
    let inf = format!(
        "Axis of Rotation: Z\nNumber of Blade Sets: 5\nNumber of Blades Per Set: 2\nGeometry Units: MM\n{ends}Profile Data File: \
         p.curve\n"
    );
    let given = JobFolder::of(&[("b.inf".to_owned(), inf.into_bytes()), ("p.curve".to_owned(), profile.into_bytes())]);
    let blade = NewJob::Blade { from: given.path("b.inf"), scale: 1.0, hub: false };
    let folder = JobFolder::of(&new_job(&blade).expect("a job"));
    folder.set("job.json", &[("/verification", json!({ "cut_stock": false }))]);
    for k in 0..4 {
        take_band(&folder, k, band);
        spread_passes(&folder, k, spread);
    }
    folder
}

fn planned(folder: &JobFolder, setup: usize) -> Result<Planned, Failure> {
    let job = Job::read(&folder.job()).expect("a job");
    plan_setup(&job, setup, PlanSettings { verify: true, certificates: false }, &SilentStages)
}

#[test]
fn both_sides_of_main_and_splitter_blade_are_planned() {
    // Behind the main blade: neither covers the other.
    let folder = job_of_set([20.0, 240.0], (3.0, 1.0));
    for setup in 0..4 {
        let planned = planned(&folder, setup).unwrap_or_else(|why| panic!("setup {setup}: {why}"));
        let report = &planned.report;
        assert!(report.verified && planned.outcome() == Outcome::Done, "{setup}: {:?}", report.findings.first());
        assert!(report.totals.cc_points >= 100, "{setup}: only {} CC points", report.totals.cc_points);
        assert!(report.totals.planned_fraction >= 0.99, "{setup}: {:?}", report.infeasible);
    }
}

/// Beside the main blade, each of both covers the side of the other that faces it; without the
/// obstacle the same passes are planned.
#[test]
fn blades_of_a_set_that_cover_each_other_are_in_the_way_of_the_tool() {
    let folder = job_of_set([60.0, 20.0], (90.0, 8.0));
    let job = Job::read(&folder.job()).expect("a job");
    let of_main = [0, 1].map(|setup| planned(&folder, setup).unwrap_or_else(|why| panic!("setup {setup}: {why}")));
    let fractions = of_main.each_ref().map(|planned| planned.report.totals.planned_fraction);
    let covered = usize::from(fractions[1] < fractions[0]);
    assert!(fractions[covered] < 0.5 && fractions[1 - covered] >= 0.99, "{fractions:?}");
    let report = &of_main[covered].report;
    assert!(of_main[covered].outcome() == Outcome::Incomplete, "{}", job.file.setups[covered].name);
    let reasons = serde_json::to_string(&report.infeasible).expect("JSON");
    assert!(reasons.contains("hits check surface (blade.obj: splitter/"), "{reasons}");
    let meshes = format!("/setups/{covered}/meshes");
    let alone = folder.json("job.json").pointer(&meshes).and_then(|all| all.as_array()).expect("meshes")[..2].to_vec();
    folder.set("job.json", &[(&meshes, json!(alone))]);
    let alone = planned(&folder, covered).expect("nothing is in the way");
    assert!(alone.report.totals.planned_fraction >= 0.99, "{:?}", alone.report.infeasible);
}
