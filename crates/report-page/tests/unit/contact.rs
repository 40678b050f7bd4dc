use facemill_cl_data::{CcPoint, Posture};
use facemill_surface_model::{SurfaceSettings, TriMesh};
use facemill_tool_model::{ToolFile, cl_from_cc};
use nalgebra::Point3;

use super::*;

/// A square of 200 mm in the plane z = 0.
fn plane() -> Surface {
    let corner = |x: f64, y: f64| Point3::new(100.0 * x, 100.0 * y, 0.0);
    let vertices = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    Surface::new(TriMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).expect("a mesh"), SurfaceSettings::default())
}

fn tool() -> ToolAssembly {
    let file: ToolFile = serde_json::from_str(include_str!("../../../../assets/propeller/tool.json")).expect("a tool");
    ToolAssembly::new(file).expect("a tool")
}

#[test]
fn the_tilt_of_a_posture_is_found_again_from_the_pose_alone() {
    let (surface, tool) = (plane(), tool());
    let up = Vector3::z();
    let cc = CcPoint::new(Point3::origin(), up, Vector3::x()).expect("a point");
    for tilt_deg in [0.0_f64, 0.5, 2.0, 15.0, 40.0] {
        for rotate_deg in [0.0_f64, -30.0, 80.0] {
            let posture = Posture { tilt: tilt_deg.to_radians(), rotate: rotate_deg.to_radians() };
            let pose = cl_from_cc(tool.cutter(), &cc, posture);
            let found = tilt_to_surface(&pose, &tool, &surface, 0.0).expect("it touches");
            assert!((found - tilt_deg).abs() < 1e-6, "{found} for {tilt_deg}");
            let raised = ClPoint { tip: pose.tip + up, ..pose };
            assert_eq!(tilt_to_surface(&raised, &tool, &surface, 0.0), None);
            let on_allowance = tilt_to_surface(&raised, &tool, &surface, 1.0).expect("it touches the allowance");
            assert!((on_allowance - tilt_deg).abs() < 1e-6, "{on_allowance} for {tilt_deg}");
        }
    }
}
