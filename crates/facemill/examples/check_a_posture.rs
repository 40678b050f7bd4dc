//! Whether a tool posture at one point of a propeller blade can be taken, and if not, why:
//!
//! `cargo run -p facemill --example check_a_posture`

use std::error::Error;

use facemill::cl_data::{CcPoint, Posture};
use facemill::cutter_location::{Hints, Infeasible, Obstacle, PoseTest, Workcell};
use facemill::interference::MeshTree;
use facemill::inverse_kinematics::{Machine, preset};
use facemill::sample_parts::{BladeResolution, PropellerSeries, PropellerSpec, blade, hub};
use facemill::surface_model::{Surface, SurfaceSettings, TriMesh};
use facemill::tool_model::ToolAssembly;
use nalgebra::{Isometry3, Point3, Vector3};

fn main() -> Result<(), Box<dyn Error>> {
    // A blade of DTMB propeller 4119, 1.2 m in diameter, with the hub, as a mesh.
    let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 1200.0)?;
    let mesh = blade(&spec, BladeResolution::new(60, 40)?).joined(&hub(&spec, 0.05)?);
    let outside = point_from_above(&mesh, 0.7 * 600.0).ok_or("the blade has no surface there")?;
    let at_hub = point_from_above(&mesh, spec.hub_radius() + 6.0).ok_or("the blade has no surface there")?;

    let machine = Machine::from_json(preset("head-b-table-c").ok_or("no such preset")?.as_bytes())?;
    let tool = ToolAssembly::from_json(include_bytes!("tutorial/tool.json"))?;
    let tree = MeshTree::new(&mesh);
    // The same part, mounted above the table, and too low by mistake.
    let mounted = |height: f64| {
        let mut cell = Workcell::new(&machine, &tool, Isometry3::translation(0.0, 0.0, height));
        cell.obstacles.push(Obstacle::part("blade", &tree));
        cell
    };
    let (high, low) = (mounted(700.0), mounted(-20.0));

    let good = report("high, tilt 8 deg, rotate -20 deg", &high, &outside, 8.0, -20.0);
    let pose = good.map_err(|why| why.to_string())?;
    assert!(pose.lift <= high.max_lift);

    // Beside the hub there is no room for the disc of the cutter.
    let gouge = report("at the hub, the same", &high, &at_hub, 8.0, -20.0);
    assert!(matches!(gouge, Err(Infeasible::Gouge { .. })));

    // The table is tested by default: with a wrong height in the setup the cutter would cut it.
    let hit = report("low, tilt 8 deg, rotate -20 deg", &low, &outside, 8.0, -20.0);
    let Err(Infeasible::Gouge { obstacle, .. }) = hit else { return Err("the table is in the way".into()) };
    assert_eq!(low.obstacles[obstacle].name, "table");
    Ok(())
}

/// CC point at this distance from the shaft, hit from above, with the feed around the shaft.
fn point_from_above(mesh: &TriMesh, radius: f64) -> Option<CcPoint> {
    let surface = Surface::new(mesh.clone(), SurfaceSettings::default());
    let hit = surface.ray(&Point3::new(radius, 0.0, 1000.0), &-Vector3::z_axis(), 2000.0)?;
    let normal = surface.normal_at(&hit.point).into_inner();
    CcPoint::new(hit.point.position, normal, Vector3::y()).ok()
}

/// Tests a posture, and prints what comes of it.
fn report(
    name: &str,
    cell: &Workcell<'_>,
    cc: &CcPoint,
    tilt_deg: f64,
    rotate_deg: f64,
) -> Result<facemill::cutter_location::FeasiblePose, Infeasible> {
    let test = PoseTest::new(cell);
    let posture = Posture { tilt: tilt_deg.to_radians(), rotate: rotate_deg.to_radians() };
    let outcome = test.try_posture(cc, posture, None, &mut Hints::default());
    match &outcome {
        Ok(pose) => {
            let axes = cell.machine.axes().iter().enumerate();
            let values = axes.map(|(k, a)| format!("{}{:.3}", a.letter, a.in_word_unit(pose.configuration.axes[k])));
            println!("{name}: feasible, {}", values.collect::<Vec<_>>().join(" "));
        }
        Err(why) => println!("{name}: {}", test.describe(why)),
    }
    outcome
}
