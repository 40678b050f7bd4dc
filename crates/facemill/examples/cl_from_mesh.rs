//! From a triangle mesh to cutter locations, with the stages alone, without a job:
//!
//! `cargo run -p facemill --example cl_from_mesh`

use std::error::Error;

use facemill::cc_path::strategies::{ParallelPlanes, Region, UncutSide};
use facemill::cc_path::{LaySettings, Strategy, lay_passes};
use facemill::cl_data::{Posture, Silent};
use facemill::cutter_location::{
    Obstacle, PassSettings, PassTask, PoseTest, PostureMode, SearchCurve, SearchOrder, SearchSettings, Workcell,
    plan_passes,
};
use facemill::interference::MeshTree;
use facemill::inverse_kinematics::{Machine, preset};
use facemill::sample_parts::{PatchSpec, patch};
use facemill::surface_model::{
    ImportSettings, MeshFormat, NamedNode, Surface, SurfaceSettings, import_mesh, no_external_files, write_obj,
};
use facemill::tool_model::ToolAssembly;
use nalgebra::{Isometry3, Point3, Vector3};

fn main() -> Result<(), Box<dyn Error>> {
    // 1. A mesh, as from a CAD system: here a wavy patch of 120 mm, written and read as OBJ.
    let sample = patch(&PatchSpec::new([120.0, 120.0], 2.0, [1.2, 1.0])?, 40, 40)?;
    let node = NamedNode { name: "patch", mesh: 0, transform: Isometry3::identity() };
    let obj = write_obj(&[&sample], &[node])?;
    let settings = ImportSettings::default_for(MeshFormat::Obj);
    let imported = import_mesh("patch.obj", &obj, MeshFormat::Obj, &settings, &no_external_files)?;
    // An OBJ file tells neither unit nor up axis: the defaults are millimetres and z.
    let mesh = imported.mesh;
    println!("mesh       {} triangles", mesh.triangles().len());

    // 2. Cutter-contact points: sections by parallel planes, along x, 15 mm apart.
    let surface = Surface::new(mesh.clone(), SurfaceSettings::default());
    let planes = ParallelPlanes { origin: Point3::origin(), normal: Vector3::y_axis(), from: None, to: None };
    let laying = LaySettings { max_step_over: 15.0, uncut: Some(UncutSide::Right), ..LaySettings::default() };
    let strategy = Strategy::ParallelPlanes(planes);
    let laid = lay_passes(&surface, &Region::default(), &strategy, &laying, &|_| 15.0, &Silent)?;
    let cc_points: usize = laid.passes.iter().map(|p| p.pass.points.len()).sum();
    println!("CC points  {cc_points} on {} passes", laid.passes.len());

    // 3. Machine, tool and part. The workcell tests the table of the machine by itself.
    let machine = Machine::from_json(preset("head-b-table-c").ok_or("no such preset")?.as_bytes())?;
    let tool = ToolAssembly::from_json(include_bytes!("tutorial/tool.json"))?;
    let tree = MeshTree::new(&mesh);
    let mut cell = Workcell::new(&machine, &tool, Isometry3::translation(0.0, 0.0, 300.0));
    cell.obstacles.push(Obstacle::part("patch", &tree));
    let test = PoseTest::new(&cell);

    // 4. Postures: the smallest tilt and rotate of these ranges that is feasible, tilt first.
    let posture = |tilt: f64, rotate: f64| Posture { tilt: tilt.to_radians(), rotate: rotate.to_radians() };
    let curve = SearchCurve::new(posture(2.0, 0.0), posture(15.0, -85.0), SearchOrder::TiltFirst, 1.0)?;
    let tasks: Vec<PassTask> = laid
        .passes
        .into_iter()
        .map(|p| PassTask { pass: p.pass, curve, strips: Vec::new(), given: Vec::new() })
        .collect();
    let settings = PassSettings {
        search: SearchSettings::default(),
        mode: PostureMode::Smallest,
        max_turn_per_mm: 0.5_f64.to_radians(),
    };
    let planned = plan_passes(&test, &tasks, &settings, &Silent)?;

    // 5. Each CC point has a CL point, tested as it is, or the reason why not.
    let outcomes: Vec<_> = planned.iter().flat_map(|pass| &pass.outcomes.points).collect();
    for why in outcomes.iter().filter_map(|outcome| outcome.as_ref().err()) {
        println!("no posture: {}", test.describe(why));
    }
    let poses: Vec<_> = outcomes.iter().filter_map(|outcome| outcome.as_ref().ok()).collect();
    println!("CL points  {}", poses.len());
    for pose in poses.iter().step_by(poses.len() / 5) {
        let (tip, axis) = (pose.cl.tip, pose.cl.axis);
        println!(
            "  tip ({:8.3}, {:8.3}, {:8.3}) mm, axis ({:6.3}, {:6.3}, {:6.3}), tilt {:5.2} deg",
            tip.x,
            tip.y,
            tip.z,
            axis.x,
            axis.y,
            axis.z,
            pose.posture.tilt.to_degrees()
        );
    }
    assert_eq!(poses.len(), cc_points, "every point of this patch can be cut");
    assert!(poses.iter().all(|pose| test.gouge(&pose.cl, &mut Default::default()).is_none()));
    Ok(())
}
