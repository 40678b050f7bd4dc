//! Whole plans of flows and spirals: verified, without a finding, and finished.

use std::f64::consts::TAU;

use facemill::Planned;
use facemill::report::outcome::Outcome;
use facemill::surface_model::{NamedNode, TriMesh, write_obj};
use facemill_tests::variants::tiny_patch;
use nalgebra::{Isometry3, Point3};
use serde_json::json;

const STRATEGY: &str = "/operations/0/path/strategy/strategy";

/// A plan has to cut all of its region within the limit, without a finding.
fn check(planned: &Planned) {
    assert!(planned.outcome() == Outcome::Done, "{:?}", planned.report.findings);
    assert!(planned.report.verified && planned.report.findings.is_empty(), "{:?}", planned.report.findings);
    let left = &planned.report.remaining.as_ref().expect("a verified plan").operations[0];
    let largest = left.largest.expect("samples").height_mm;
    assert!(!left.exceeded && largest <= left.limit_mm, "{largest} of {}", left.limit_mm);
}

#[test]
fn a_flow_between_two_planes_is_planned_verified_and_leaves_nothing() {
    let job = tiny_patch();
    let end = |y: f64| json!({ "plane": { "origin_mm": [0, y, 0], "normal": [0, 1, 0] } });
    job.set(
        "job.json",
        &[
            (STRATEGY, json!({ "flow": { "from": end(-4.0), "to": end(4.0) } })),
            (
                "/operations/0/path/strategy/region",
                json!({ "box": { "min_mm": [-90, -4, -90], "max_mm": [90, 4, 90] } }),
            ),
        ],
    );
    check(&job.plan());
}

/// A ring of a cap of radius 100 mm about the z axis, its top at z = 0.
fn ring(radii: [f64; 2]) -> TriMesh {
    const AROUND: u32 = 120;
    const ROWS: u32 = 12;
    let (vertices, triangles) = facemill_test_kit::grid_around([ROWS, AROUND], |j, k| {
        let radius = radii[0] + (radii[1] - radii[0]) * f64::from(j) / f64::from(ROWS);
        let (sin, cos) = (TAU * f64::from(k) / f64::from(AROUND)).sin_cos();
        Point3::new(radius * cos, radius * sin, f64::sqrt(1e4 - radius * radius) - 100.0)
    });
    TriMesh::new(vertices, triangles).expect("indices are in range")
}

#[test]
fn a_spiral_around_a_cap_is_one_pass_planned_verified_and_leaves_nothing() {
    let job = tiny_patch();
    let mesh = ring([20.0, 27.0]);
    let nodes = [NamedNode { name: "patch", mesh: 0, transform: Isometry3::identity() }];
    job.write("patch.obj", &write_obj(&[&mesh], &nodes).expect("a mesh"));
    // Its levels bound the region: the rest of the ring does not count as left.
    let rings = json!({ "axis_direction": [0, 0, 1], "from_radius_mm": 21, "to_radius_mm": 25 });
    job.set(
        "job.json",
        &[
            (STRATEGY, json!({ "spiral": { "cylindrical_sections": rings } })),
            ("/operations/0/path/strategy/order", json!("decreasing")),
        ],
    );
    let planned = job.plan();
    check(&planned);
    assert_eq!(planned.report.totals.passes, 1);
}
