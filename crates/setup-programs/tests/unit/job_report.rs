use nalgebra::{Point3, Vector3};

use super::*;

fn at(axis: [f64; 3], deg: f64, shift: [f64; 3]) -> PoseFile {
    PoseFile { translation_mm: shift, rotation_axis: axis, rotation_deg: deg }
}

#[test]
fn a_reported_pose_moves_points_as_the_pose_does() {
    let files = [
        at([0.0, 0.0, 1.0], 0.0, [0.0; 3]),
        at([0.0, 0.0, 1.0], 0.0, [1.0, -2.0, 3.0]),
        at([1.0, 0.0, 0.0], 180.0, [0.0, 0.0, 500.0]),
        at([1.0, 2.0, -0.5], -75.0, [10.0, 0.0, 0.25]),
        at([0.0, 1.0, 0.0], 270.0, [0.0; 3]),
    ];
    for file in files {
        let reported = stated(&file);
        assert!((0.0..=180.0).contains(&reported.rotation_deg), "{reported:?}");
        let again = at(reported.rotation_axis, reported.rotation_deg, reported.translation_mm);
        for point in [Point3::new(100.0, 0.0, 0.0), Point3::new(-3.0, 70.0, 20.0)] {
            assert!((pose(&file) * point - pose(&again) * point).norm() < 1e-6, "{file:?}");
        }
    }
}

#[test]
fn a_flip_is_reported_from_the_position_on_the_table() {
    let file = |json: serde_json::Value| serde_json::from_value::<SetupFile>(json).unwrap();
    let setup = |deg: f64, height: f64| {
        file(serde_json::json!({
            "name": "a", "meshes": [{ "file": "part.stl", "role": "drive" }, { "file": "vice.stl", "role": "fixture" }],
            "stock": { "offset": { "allowance_mm": 1.0 } }, "clearance": { "cylinder": { "radius_mm": 100.0 } },
            "work_from_part": { "rotation_axis": [1.0, 0.0, 0.0], "rotation_deg": deg },
            "table_from_work": { "translation_mm": [0.0, 0.0, height] },
        }))
    };
    let (up, down) = (setup(0.0, 500.0), setup(180.0, 420.0));
    assert_eq!(placement(&up, None).moved_by, None);
    let placed = placement(&down, Some(("up", &up)));
    assert_eq!(placed.compared_with.as_deref(), Some("up"));
    // A point 30 mm above the part's origin was at 530 mm and is at 390 mm.
    let moved = placed.moved_by.unwrap();
    let by = Isometry3::new(
        Vector3::from(moved.translation_mm),
        Vector3::from(moved.rotation_axis) * moved.rotation_deg.to_radians(),
    );
    assert!((by * Point3::new(0.0, 0.0, 530.0) - Point3::new(0.0, 0.0, 390.0)).norm() < 1e-6, "{moved:?}");
    assert_eq!(fixtures(&up), ["vice.stl"]);
}
