//! Material left on the requested surface, as plans and verifications measure it on their text.

use std::path::Path;

use facemill::formats::{SetupSummary, VerificationFile};
use facemill::nc_program::Dialect;
use facemill::new_job::NewJob;
use facemill::report::outcome::Outcome;
use facemill::report::remaining::RemainingOnRegion;
use facemill::surface_model::{NamedNode, TriMesh, write_obj};
use facemill::virtual_machine::FindingKind;
use facemill::{
    CutRequest, DeviationRequest, Job, PlanSettings, Planned, SilentStages, VerifyRequest, plan_setup, summary,
    verify_program,
};
use facemill_tests::jobs::{JobFolder, unfinished};
use facemill_tests::variants::{blink_patch, tiny_patch};
use nalgebra::{Isometry3, Point3};
use serde_json::json;

fn planned(job: &JobFolder) -> Planned {
    job.try_plan().unwrap_or_else(|e| panic!("{e}"))
}

fn program(planned: &Planned) -> String {
    let file = planned.files.iter().find(|(name, _)| name.ends_with(".nc")).expect("a program");
    String::from_utf8(file.1.clone()).expect("text")
}

fn left(planned: &Planned) -> &RemainingOnRegion {
    &planned.report.remaining.as_ref().expect("a verified plan").operations[0]
}

#[test]
fn a_finished_plan_says_so_and_a_deleted_pass_is_found_by_the_same_measure() {
    let job = tiny_patch();
    let plan = planned(&job);
    assert!(plan.outcome() == Outcome::Done && !left(&plan).exceeded, "{:?}", left(&plan));
    let largest = left(&plan).largest.expect("samples");
    assert!(largest.height_mm >= left(&plan).p99_mm && left(&plan).p50_mm > 0.0 && largest.line.is_some());

    let read = Job::read(&job.job()).expect("a job");
    let verified = |text: &str| {
        let cut = CutRequest { deviation: Some(DeviationRequest::default()), ..CutRequest::on_lines(1.0, 0.02) };
        let request = VerifyRequest { cut: Some(cut), ..VerifyRequest::new(Path::new("program.nc"), Dialect::Fanuc) };
        verify_program(&read, text.as_bytes(), &request, &SilentStages).expect("a run").file
    };
    let text = program(&plan);
    let whole = verified(&text);
    assert_eq!(whole.remaining, plan.report.remaining);
    let totals = &plan.report.totals;
    let constant = |times: &facemill::formats::ProgramTimes| [times.constant_cutting_s, times.constant_rapid_s];
    assert_eq!(
        (totals.blocks, totals.cutting_length_mm, constant(&plan.report.times)),
        (whole.verification.n_blocks, whole.verification.cutting_length_mm, constant(&whole.times)),
        "a plan and a verification of its text count alike"
    );
    let deviation = whole.deviation.as_ref().expect("a deviation");
    assert_eq!(
        deviation.tolerance_mm,
        left(&plan).limit_mm,
        "one limit for what is left and for the map of deviations"
    );
    assert!(totals.passes_length_mm > 0.0 && totals.passes_length_mm < totals.cutting_length_mm);
    assert!(whole.verification.findings.iter().all(|f| f.kind != FindingKind::Excess));

    // Without the first pass more is left at the border of the region, though its neighbour keeps
    // within the limit there.
    let passes: Vec<usize> = text.lines().enumerate().filter(|(_, l)| l.contains("PASS")).map(|(k, _)| k).collect();
    assert!(passes.len() >= 3, "{}", passes.len());
    let without = |gone: std::ops::Range<usize>| {
        let kept = text.lines().enumerate().filter(|(k, _)| !gone.contains(k));
        verified(&(kept.map(|(_, l)| l).collect::<Vec<_>>().join("\n") + "\n"))
    };
    let found = without(passes[0]..passes[1]);
    let of = &found.remaining.as_ref().expect("an operation").operations[0];
    let largest = of.largest.expect("samples");
    assert!(of.p99_mm > 2.0 * left(&plan).p99_mm && largest.at_mm[1] < -3.5, "{of:?}");

    // Without the passes in the middle.
    let found = without(passes[1]..passes[passes.len() - 1]);
    let of = &found.remaining.as_ref().expect("an operation").operations[0];
    assert!(of.exceeded && of.above_fraction > 5.0 * left(&plan).above_fraction.max(0.01), "{of:?}");
    assert!(found.verification.findings.iter().any(|f| f.kind == FindingKind::Excess), "{of:?}");
}

/// The text with every F a hundredth of what it was.
fn slowed(text: &str) -> String {
    let slow = |word: &str| match word.strip_prefix('F').and_then(|f| f.parse::<f64>().ok()) {
        Some(feed) => format!("F{:.3}", feed / 100.0),
        None => word.to_owned(),
    };
    let line = |l: &str| l.split(' ').map(slow).collect::<Vec<_>>().join(" ");
    text.lines().map(line).collect::<Vec<_>>().join("\n") + "\n"
}

#[test]
fn feeds_far_below_the_jobs_are_a_note_and_no_fault() {
    let job = blink_patch();
    job.set("job.json", &[unfinished()]);
    let text = program(&planned(&job));
    let read = Job::read(&job.job()).expect("a job");
    let request = VerifyRequest::new(Path::new("program.nc"), Dialect::Fanuc);
    let verified = |text: &str| verify_program(&read, text.as_bytes(), &request, &SilentStages).expect("a run").file;
    let note = |text: &str| {
        let file = verified(text);
        assert!(file.verification.findings.iter().all(|f| !f.kind.is_fault()), "{:?}", file.verification.findings);
        file.assumptions.into_iter().find(|a| a.text.contains("the job requires at least"))
    };
    assert_eq!(note(&text), None);
    let found = note(&slowed(&text)).expect("a note");
    let words = ["100 % of the cutting path", "at least 1000 mm/min"];
    assert!(words.iter().all(|w| found.text.contains(w)) && found.line.is_some(), "{found:?}");
}

#[test]
fn the_region_is_the_requested_surface_and_not_the_passes_on_it() {
    let job = tiny_patch();
    job.set("job.json", &[("/operations/0/path/strategy/edge_margin_mm", json!(12.0))]);
    let plan = planned(&job);
    assert!(plan.report.findings.iter().all(|f| !f.kind.is_fault()));
    assert!(plan.outcome() == Outcome::Incomplete && left(&plan).exceeded, "{:?}", left(&plan));
    job.set("job.json", &[unfinished()]);
    assert!(planned(&job).outcome() == Outcome::Done);
}

/// A job of a face mill of 40 mm on a profile in x and z that goes on along y, with passes along y
/// and all of the stock above it.
fn profiled(profile: &[[f64; 2]]) -> JobFolder {
    let job = JobFolder::new(&NewJob::Patch { size_mm: 400.0 });
    let rows = [-9.0, -3.0, 3.0, 9.0];
    let vertices = rows.iter().flat_map(|y| profile.iter().map(move |[x, z]| format!("v {x} {y} {z}\n")));
    let n = profile.len();
    let faces = (1..rows.len()).flat_map(|j| {
        (1..n).map(move |i| {
            let [a, b] = [(j - 1) * n + i, j * n + i];
            format!("f {a} {} {}\nf {a} {} {b}\n", a + 1, b + 1, b + 1)
        })
    });
    job.write("patch.obj", vertices.chain(faces).collect::<String>().as_bytes());
    let top = profile.iter().map(|[_, z]| *z).fold(0.0, f64::max) + 0.5;
    let stock = json!({ "box": { "min_mm": [-40, -9.01, -20], "max_mm": [40, 9.01, top] } });
    job.set(
        "job.json",
        &[
            ("/setups/0/stock", stock),
            ("/verification", json!({ "cut_stock": false })),
            ("/operations/0/path/strategy/strategy/parallel_planes/normal", json!([1, 0, 0])),
            ("/operations/0/tolerances/max_step_mm", json!(6.0)),
            ("/operations/0/infeasible/trim/max_trimmed_fraction", json!(1.0)),
            ("/operations/0/search/mode", json!("smallest")),
        ],
    );
    job
}

/// That a plan tells what it leaves above the tolerance in summary, report and exit code, the
/// largest height with place and line.
fn tells_what_is_left(plan: &Planned) -> RemainingOnRegion {
    let left = left(plan).clone();
    assert!(left.exceeded && plan.outcome() == Outcome::Incomplete && plan.outcome().exit_code() == 1, "{left:?}");
    let reported = summary(&plan.report);
    assert!(
        reported.contains("NOT FINISHED") && reported.contains("% above") && reported.contains("% never cut"),
        "{reported}"
    );
    let largest = left.largest.expect("samples");
    let [x, y, z] = largest.at_mm;
    assert!(reported.contains(&format!("largest {:.3} at ({x:.2}, {y:.2}, {z:.2})", largest.height_mm)), "{reported}");
    left
}

#[test]
fn a_valley_that_the_cutter_does_not_fit_into_is_reported_with_its_height_and_place() {
    // Radius 8, 4 mm deep.
    let arc = (-10..=10).map(|k| {
        let x = 0.69 * f64::from(k);
        [x, 4.0 - (64.0 - x * x).sqrt()]
    });
    let profile: Vec<[f64; 2]> = [[-30.0, 0.0]].into_iter().chain(arc).chain([[30.0, 0.0]]).collect();
    let left = tells_what_is_left(&planned(&profiled(&profile)));
    // The arc is a quarter of the surface; a disc of 40 mm lies on its rims, 4 mm above its bottom.
    assert!(left.above_fraction > 0.15 && left.above_fraction < 0.35, "{left:?}");
    let largest = left.largest.expect("samples");
    assert!(largest.height_mm > 2.0 && largest.height_mm < 4.2 && largest.at_mm[0].abs() < 3.0, "{largest:?}");
}

#[test]
fn a_foot_of_a_wall_that_no_pass_reaches_is_reported_with_its_height_and_place() {
    // A floor, and a wall of 20 mm with a foot of radius 1.
    let foot = (1..=4).map(|k| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_8).sin_cos();
        [20.0 + sin, 1.0 - cos]
    });
    let profile: Vec<[f64; 2]> = [[-30.0, 0.0], [20.0, 0.0]].into_iter().chain(foot).chain([[21.2, 20.0]]).collect();
    let job = profiled(&profile);
    // The request covers the floor with the foot, not the wall.
    let bounds = json!({ "min_mm": [-30, -9, -1], "max_mm": [21, 9, 0.9] });
    // Stock as an allowance: a solid would be in the way of a holder beside the wall.
    let stock = json!({ "offset": { "allowance_mm": 1.0 } });
    let values = [("/setups/0/stock", stock), ("/operations/0/path/strategy/region", json!({ "box": bounds }))];
    job.set("job.json", &values);
    let left = tells_what_is_left(&planned(&job));
    let largest = left.largest.expect("samples");
    assert!(left.above_fraction > 0.01, "{left:?}");
    assert!(largest.at_mm[0] > 10.0, "at the wall: {largest:?}");
}

/// A plate of 60 mm by 42 mm, its facets numbered along y.
fn write_plate(job: &JobFolder, n: u32, m: u32) {
    let at = |k: u32, of: u32, length: f64| length * (f64::from(k) / f64::from(of) - 0.5);
    let point = |i: u32, j: u32| Point3::new(at(i, n, 60.0), at(j, m, 42.0), 0.0);
    let (vertices, triangles) = facemill_test_kit::grid_by_columns([n, m], point);
    let mesh = TriMesh::new(vertices, triangles).expect("a plate");
    let nodes = [NamedNode { name: "plate", mesh: 0, transform: Isometry3::identity() }];
    job.write("patch.obj", &write_obj(&[&mesh], &nodes).expect("a mesh"));
}

/// A job on the plate whose passes are 6 mm apart, each in the same posture.
fn plate() -> JobFolder {
    let job = JobFolder::new(&NewJob::Patch { size_mm: 400.0 });
    let arc = json!({ "tangential_arc": { "angle_deg": 8.0, "radius_mm": 60.0 } });
    job.set(
        "job.json",
        &[
            ("/operations/0/tolerances/max_step_over_mm", json!(6.0)),
            ("/operations/0/tolerances/max_step_mm", json!(5.0)),
            ("/operations/0/search/tilt_deg", json!([20.0, 20.0])),
            ("/operations/0/search/rotate_deg", json!([0.0, 0.0])),
            ("/operations/0/path/strategy/strategy", json!({ "parallel_planes": { "normal": [0, 1, 0] } })),
            ("/operations/0/entry", arc.clone()),
            ("/operations/0/exit", arc),
            ("/setups/0/stock", json!({ "offset": { "allowance_mm": 0.5 } })),
        ],
    );
    write_plate(&job, 6, 4);
    job
}

/// A program without the cuts of one pass in the middle.
fn without_a_pass(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let passes: Vec<usize> = (0..lines.len()).filter(|&k| lines[k].starts_with("(PASS")).collect();
    let (from, to) = (passes[passes.len() / 2], passes[passes.len() / 2 + 1]);
    [&lines[..from], &lines[to..]].concat().join("\n") + "\n"
}

fn verified(job: &JobFolder, text: &str) -> VerificationFile {
    let read = Job::read(&job.job()).expect("a job");
    let request = VerifyRequest::new(Path::new("program.nc"), Dialect::Fanuc);
    verify_program(&read, text.as_bytes(), &request, &SilentStages).expect("a run").file
}

fn left_by(job: &JobFolder, text: &str) -> RemainingOnRegion {
    verified(job, text).remaining.expect("an operation").operations.remove(0)
}

#[test]
fn neither_facets_nor_step_over_nor_thin_stock_hide_a_pass_that_is_not_cut() {
    let job = plate();
    let settings = PlanSettings { verify: false, certificates: false };
    let planned = |job: &JobFolder| {
        plan_setup(&Job::read(&job.job()).expect("a job"), 0, settings, &SilentStages).unwrap_or_else(|e| panic!("{e}"))
    };
    let plan = planned(&job);
    let finished = left(&plan);
    assert!(!finished.exceeded && finished.samples >= 9_000, "{finished:?}");
    let without = without_a_pass(&program(&plan));
    let coarse = left_by(&job, &without);
    assert!(coarse.exceeded && coarse.above_fraction > 0.02, "{coarse:?}");
    // The rest is the same, however the plate is divided: the strip shows on every line across.
    write_plate(&job, 150, 80);
    let fine = left_by(&job, &without);
    assert!((fine.above_fraction / coarse.above_fraction - 1.0).abs() < 0.01, "{coarse:?} {fine:?}");
    let [of_fine, of_coarse] = [&fine, &coarse].map(|of| of.largest.expect("samples").height_mm);
    assert!((of_fine - of_coarse).abs() < 0.003, "{of_fine} {of_coarse}");
    write_plate(&job, 6, 4);
    // Nor does a step-over that is no limit make samples few.
    for step_over in [200.0, 2000.0] {
        job.set("job.json", &[("/operations/0/tolerances/max_step_over_mm", json!(step_over))]);
        let wide = left_by(&job, &without);
        assert!(wide.exceeded && wide.samples >= 9_000, "{step_over}: {wide:?}");
    }
    // Stock that is thinner than what may be left has not been cut for that.
    job.set("job.json", &[("/setups/0/stock", json!({ "offset": { "allowance_mm": 0.1 } }))]);
    let empty: Vec<&str> =
        without.lines().filter(|l| !l.contains("X") || l.contains("G28") || l.contains("G0")).collect();
    let thin = left_by(&job, &(empty.join("\n") + "\n"));
    assert!(
        thin.exceeded
            && thin.never_cut_fraction > 0.99
            && thin.above_fraction == 0.0
            && thin.above_fraction.is_sign_positive(),
        "{thin:?}"
    );
}

#[test]
fn a_plan_that_is_not_run_measures_what_it_leaves() {
    let job = plate();
    // Passes on half of the plate.
    job.set("job.json", &[("/operations/0/path/strategy/edge_margin_mm", json!(9.0))]);
    let read = Job::read(&job.job()).expect("a job");
    let settings = PlanSettings { verify: false, certificates: false };
    let plan = plan_setup(&read, 0, settings, &SilentStages).unwrap_or_else(|e| panic!("{e}"));
    assert!(!plan.report.verified && left(&plan).exceeded, "{:?}", left(&plan));
    let [written, run] =
        [&plan.report.totals.cutting_length_mm, &verified(&job, &program(&plan)).verification.cutting_length_mm];
    assert!((written / run - 1.0).abs() < 1e-3, "{written} {run}");
    assert_eq!(plan.outcome(), Outcome::Incomplete);
    let summary = SetupSummary::of(&plan.report);
    let [reason] = &*summary.incomplete_because else { panic!("{:?}", summary.incomplete_because) };
    assert!(reason.contains(&left(&plan).operation) && summary.remaining == plan.report.remaining, "{reason}");
}
#[test]
fn a_verification_on_a_job_finds_what_is_not_finished() {
    let job = plate();
    let read = Job::read(&job.job()).expect("a job");
    let settings = PlanSettings { verify: false, certificates: false };
    let plan = plan_setup(&read, 0, settings, &SilentStages).unwrap_or_else(|e| panic!("{e}"));
    let excess = |text: &str| {
        verified(&job, text).verification.findings.iter().filter(|f| f.kind == FindingKind::Excess).count()
    };
    let text = program(&plan);
    assert_eq!([excess(&text), excess(&without_a_pass(&text))], [0, 1]);
}

#[test]
fn all_of_the_drive_surface_is_measured_with_the_cuts_of_programs_before() {
    // Of a plane of 34 mm across, a band of 4 mm is to be cut; the stock is higher than the limit.
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    let job = tiny_patch();
    job.write("patch.obj", b"o patch\nv -12 -17 0\nv 12 -17 0\nv 12 17 0\nv -12 17 0\nf 1 2 3\nf 1 3 4\n");
    let band = [(&*format!("{planes}/from_mm"), json!(-2.0)), (&*format!("{planes}/to_mm"), json!(2.0))];
    job.set("job.json", &[(&format!("{planes}/from_mm"), json!(null)), (&format!("{planes}/to_mm"), json!(null))]);
    let drive = |plan: &Planned| plan.report.remaining.as_ref().expect("a verified plan").drive;

    let all = planned(&job);
    let of = drive(&all);
    assert!((of.area_mm2 - 24.0 * 34.0).abs() < 1e-6 && of.limit_mm == left(&all).limit_mm, "{of:?}");
    assert!(of.outside_fraction < 1e-9 && (of.above_fraction - left(&all).above_fraction).abs() < 0.01, "{of:?}");

    job.write("all.nc", program(&all).as_bytes());
    job.set("job.json", &band);
    let of = drive(&planned(&job));
    let outside = 1.0 - 4.0 / 34.0;
    assert!((of.outside_fraction - outside).abs() < 0.01, "{of:?}");
    // The cutter of 8 mm cuts on both sides of the band as well.
    let beyond = outside - 2.0 * 8.0 / 34.0;
    assert!(beyond < of.above_fraction && of.above_fraction < outside, "{of:?}");
    assert!(0.0 < of.never_cut_fraction && of.never_cut_fraction < of.above_fraction, "{of:?}");

    job.set("job.json", &[("/setups/0/programs_before", json!([{ "file": "all.nc", "tool": "tool.json" }]))]);
    let after = drive(&planned(&job));
    assert!((after.outside_fraction - of.outside_fraction).abs() < 1e-9, "{after:?}");
    assert!(after.above_fraction < 0.01 && after.never_cut_fraction < 0.01, "{after:?}");
}
