//! Programs whose passes go back and forth: turns with the tool down in place of links.

use facemill::sample_parts::{AnalyticPart, AnalyticShape};
use facemill::surface_model::{NamedNode, TriMesh, write_obj};
use facemill::{Job, PlanSettings, Planned, SilentStages, plan_job};
use facemill_tests::jobs::JobFolder;
use facemill_tests::variants::{planned, tiny_patch};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use serde_json::json;

const PLANES: &str = "/operations/0/path/strategy/strategy/parallel_planes";

/// Some passes over the middle of a part, back and forth.
fn zigzag(mesh: Option<&TriMesh>, turns: bool) -> JobFolder {
    let job = tiny_patch();
    job.set(
        "job.json",
        &[
            ("/operations/0/direction", json!("either")),
            ("/operations/0/path/strategy/linking", json!("zigzag")),
            ("/operations/0/feeds/turn_mm_min", json!(TURNING)),
            (&format!("{PLANES}/from_mm"), json!(-2.0)),
            (&format!("{PLANES}/to_mm"), json!(2.0)),
            ("/setups/0/links/turns", json!(turns)),
        ],
    );
    if let Some(mesh) = mesh {
        let nodes = [NamedNode { name: "patch", mesh: 0, transform: Isometry3::identity() }];
        job.write("patch.obj", &write_obj(&[mesh], &nodes).expect("a mesh"));
    }
    job
}

/// Tip feed in turns, mm/min: neither that of cuts nor that of entries.
const TURNING: f64 = 1100.0;

fn plan(job: &JobFolder, certificates: bool) -> Planned {
    let job = Job::read(&job.job()).expect("a job");
    let settings = PlanSettings { verify: true, certificates };
    plan_job(&job, settings, None, &SilentStages).unwrap_or_else(|e| panic!("{e}")).remove(0)
}

fn total_time(planned: &Planned) -> f64 {
    planned.report.time_law.as_ref().expect("limits of every axis").total_time_s
}

/// The number of links from pass to pass in the text as it is read back.
fn links(planned: &Planned) -> usize {
    planned.report.links.shortened.as_ref().expect("a cut stock").links.len()
}

/// A plan with turns needs no link, takes less time than with links, and is certified whole.
fn check(name: &str, mesh: Option<&TriMesh>) {
    let (turned, linked) = (plan(&zigzag(mesh, true), true), plan(&zigzag(mesh, false), false));
    for planned in [&turned, &linked] {
        assert!(planned.report.findings.is_empty(), "{name}: {:?}", planned.report.findings);
    }
    let certified = turned.report.certified.as_ref().expect("certificates");
    assert_eq!(certified.certified, certified.blocks, "{name}");
    let turns = turned.report.links.turns.as_ref().expect("turns");
    let passes = turned.report.totals.passes;
    assert!(passes >= 3 && linked.report.links.turns.is_none());
    assert_eq!((turns.turns_on_surface, turns.links), (passes - 1, 0), "{name}: {:?}", turns.reasons);
    assert_eq!((links(&turned), links(&linked)), (0, passes - 1), "{name}");
    let [with, without] = [&turned, &linked].map(total_time);
    // Most of either is the way to the part and home.
    let gain = (without - with) / (passes - 1) as f64;
    assert!(gain > 0.5, "{name}: a turn gains {gain} s; {with} s with turns, {without} s with links");
    // What is cut is the same.
    let cusp = |p: &Planned| p.report.worst.cusp_mm;
    assert_eq!(cusp(&turned), cusp(&linked), "{name}");
}

fn plane() -> TriMesh {
    AnalyticPart::new(AnalyticShape::Plane { size: [80.0; 2] }).expect("sizes").mesh(16).expect("facets")
}

#[test]
fn passes_on_a_plane_need_no_link() {
    check("plane", Some(&plane()));
}

#[test]
fn passes_on_an_inclined_plane_need_no_link() {
    let lean = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 10f64.to_radians());
    check("inclined plane", Some(&plane().transformed(&Isometry3::from_parts(Vector3::zeros().into(), lean))));
}

#[test]
fn passes_on_a_cylinder_need_no_link() {
    // Its top is at z = 0, along x.
    let shape = AnalyticShape::Saddle { size: [80.0; 2], concave_radius: 1e5, convex_radius: 150.0 };
    check("cylinder", Some(&AnalyticPart::new(shape).expect("sizes").mesh(64).expect("facets")));
}

#[test]
fn passes_on_a_wavy_patch_need_no_link_and_the_program_is_held_to_what_all_are() {
    check("wavy patch", None);
    let w = planned(&zigzag(None, true));
    w.check();
    let rapid: Vec<usize> = w.motions.iter().enumerate().filter(|(_, m)| m.rapid).map(|(k, _)| k).collect();
    let cut: Vec<usize> = (0..w.motions.len()).filter(|&k| w.feeds[k].is_some()).collect();
    let (first, last) = (cut[0], *cut.last().expect("cuts"));
    assert!(rapid.iter().all(|k| *k < first || *k > last), "a rapid between the passes");
    let turning = w.feeds.iter().filter(|feed| **feed == Some(TURNING)).count();
    assert!(turning >= 100, "{turning} blocks at the feed of turns");
}

#[test]
fn a_link_leads_across_a_hole_and_turns_on_either_side_of_it() {
    let half = |x: f64| {
        let plane = AnalyticPart::new(AnalyticShape::Plane { size: [30.0, 80.0] }).expect("sizes");
        plane.mesh(8).expect("facets").transformed(&Isometry3::translation(x, 0.0, 0.0))
    };
    let planned = plan(&zigzag(Some(&half(-25.0).joined(&half(25.0))), true), false);
    assert!(planned.report.findings.is_empty(), "{:?}", planned.report.findings);
    let turns = planned.report.links.turns.as_ref().expect("turns");
    let levels = planned.report.totals.passes / 2;
    assert!(levels >= 3, "{levels}");
    assert_eq!((turns.turns_on_surface, turns.links), (levels - 1, levels), "{:?}", turns.reasons);
    assert!(turns.reasons[0].reason.contains("beside"), "{:?}", turns.reasons);
}
