use facemill_cc_path::files::ParallelPlanesFile;
use serde_json::{Value, json};

use super::*;
use crate::candidates::candidates_of_operations;
use crate::strategies::default_strategies;
use crate::test_kit::patch_job;

/// A flow of this way, named by its end, with ends of this length.
fn flow(name: &str, way: [f64; 3], length: f64, is_closed: bool) -> PossibleFlow {
    let group = |name: &str| FlowEndFile::Group(name.to_owned());
    let flow = FlowFile { from: group(name), to: group("other"), within_mm: 0.05 };
    PossibleFlow { flow, way: way.into(), length, is_closed }
}

#[test]
fn the_flow_with_the_longest_ends_of_each_kind_is_taken() {
    // Passes run across the way from end to end.
    let found = [
        flow("a", [1.0, 30.0, 0.0], 90.0, false),
        flow("b", [0.0, 25.0, 3.0], 80.0, false),
        flow("c", [70.0, 10.0, 0.0], 60.0, true),
    ];
    let flows = RegionFlows::of(&found, Some(Vector3::x()));
    let taken = |f: &Option<FlowFile>| f.as_ref().map(|f| f.from.clone());
    assert_eq!(taken(&flows.along), Some(FlowEndFile::Group("a".to_owned())));
    assert_eq!(taken(&flows.across), Some(FlowEndFile::Group("c".to_owned())));
    assert_eq!(taken(&flows.closed), Some(FlowEndFile::Group("c".to_owned())));
    let flows = RegionFlows::of(&found[2..], None);
    assert_eq!((taken(&flows.along), flows.across), (Some(FlowEndFile::Group("c".to_owned())), None));
    assert_eq!(RegionFlows::of(&[], Some(Vector3::x())), RegionFlows::default());
}

#[test]
fn ends_of_levels_are_the_sections_that_bound_them() {
    let planes =
        ParallelPlanesFile { normal: [0.0, 0.0, 2.0], origin_mm: [5.0, 0.0, 1.0], from_mm: None, to_mm: Some(30.0) };
    let plane = FlowPlaneFile { origin_mm: [5.0, 0.0, 31.0], normal: [0.0, 0.0, 2.0] };
    assert_eq!(ends_of_levels(&SectionsFile::ParallelPlanes(planes)), [FlowEndFile::Plane(plane)]);
    let cylinders = CylindricalSectionsFile {
        axis_origin_mm: [1.0, 2.0, 3.0],
        axis_direction: [0.0, 1.0, 0.0],
        from_radius_mm: 20.0,
        to_radius_mm: 45.0,
    };
    let found = ends_of_levels(&SectionsFile::CylindricalSections(cylinders));
    let radii: Vec<f64> = found
        .iter()
        .filter_map(|end| match end {
            FlowEndFile::Cylinder(c) => Some(c.radius_mm),
            _ => None,
        })
        .collect();
    assert_eq!(radii, [20.0, 45.0]);
}

/// Returns a path along x between two planes, in a region of this form.
fn between_planes(region: &Value) -> Value {
    json!({ "strategy": {
        "strategy": { "parallel_planes": { "normal": [0, 1, 0], "from_mm": -3, "to_mm": 3 } },
        "region": region,
    } })
}

#[test]
fn levels_of_a_job_bound_a_flow_which_is_a_strategy_of_a_comparison() {
    let folder = tempfile::tempdir().unwrap();
    let sloped = |x: f64| 0.1 * x;
    let job = patch_job(&folder, sloped, &between_planes(&json!({})));
    let flows = candidates_of_operations(&job).unwrap().swap_remove(0).flows;
    assert!(flows.across.is_none() && flows.closed.is_none());
    let along = flows.along.unwrap();
    let all = default_strategies(&job).unwrap();
    let found = all.iter().find(|s| s.name == "flow along").unwrap();
    let written = serde_json::to_value(&found.file).unwrap();
    let path = &written["operations"][0]["path"]["strategy"];
    assert_eq!(path["strategy"]["flow"], serde_json::to_value(&along).unwrap());
    // The levels bound its region now.
    assert_eq!(path["region"]["between"]["parallel_planes"]["to_mm"], 3.0);
    assert!(all.iter().all(|s| !s.name.starts_with("spiral") && !s.name.starts_with("flow across")));
    // Between two ranges there is no flow.
    let twice = json!({ "between": { "parallel_planes": { "normal": [1, 0, 0], "from_mm": -5, "to_mm": 5 } } });
    let job = patch_job(&folder, sloped, &between_planes(&twice));
    assert_eq!(candidates_of_operations(&job).unwrap()[0].flows, RegionFlows::default());
}
