//! Bodies of the machine as hulls of meshes.

use std::sync::Arc;

use facemill_cl_data::{ClPoint, ConvexPolyhedron};
use facemill_cutter_location::{Hints, Infeasible, PoseTest};
use facemill_inverse_kinematics::Machine;
use facemill_inverse_kinematics::machine_file::{BodyFile, MachineFile, MeshShapeFile, ShapeFile};
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

use crate::kit::{MOUNT, Random, machine, stand, tool, workcell};

/// The preset with a block on its bed 180 mm beside the workpiece's origin, up to 700
/// mm above it.
fn with_block() -> MachineFile {
    let mut file = machine().to_file();
    file.bed_bodies = vec![BodyFile {
        name: "block".to_owned(),
        shape: ShapeFile::Box { size_mm: [120.0, 90.0, 600.0] },
        position_mm: [0.0, 180.0, MOUNT + 700.0 - 300.0],
        rotation_xyz_deg: [0.0; 3],
        clearance_mm: 5.0,
    }];
    file
}

/// Replaces every box by the hull of its corners, in a mesh frame that is turned about z against
/// the box's and placed back by as much.
fn boxes_as_meshes(mut file: MachineFile, turn_deg: f64) -> (MachineFile, usize) {
    let mut n_boxes = 0;
    let rows = file.workpiece_chain.rows.iter_mut().chain(file.tool_chains.iter_mut().flat_map(|c| c.rows.iter_mut()));
    for body in rows.flat_map(|row| row.bodies.iter_mut()).chain(file.bed_bodies.iter_mut()) {
        let ShapeFile::Box { size_mm } = body.shape else { continue };
        let mesh_from_box = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -turn_deg.to_radians());
        let end = |k: usize, axis: usize| (if k >> axis & 1 == 0 { -0.5 } else { 0.5 }) * size_mm[axis];
        let corner = |k| mesh_from_box * Point3::new(end(k, 0), end(k, 1), end(k, 2));
        let hull = ConvexPolyhedron::around(&(0..8).map(corner).collect::<Vec<_>>(), []).unwrap();
        let (file, hull) = ("box.stl".to_owned(), Some(Arc::new(hull)));
        body.shape = ShapeFile::Mesh(MeshShapeFile { file, unit: None, groups: None, hull });
        assert_eq!(body.rotation_xyz_deg, [0.0; 3]);
        body.rotation_xyz_deg[2] = turn_deg;
        n_boxes += 1;
    }
    (file, n_boxes)
}

#[test]
fn boxes_as_meshes_collide_and_are_as_far_as_boxes() {
    let tool = tool(16.0, 2.0, 20.0);
    let boxes = Machine::from_file(with_block()).unwrap();
    let mut random = Random(71);
    let (mut free, mut hit) = (0, 0);
    for turn_deg in [0.0, 33.0] {
        let (file, n_boxes) = boxes_as_meshes(with_block(), turn_deg);
        assert!(n_boxes >= 3, "{n_boxes}");
        let meshes = Machine::from_file(file).unwrap();
        let (of_boxes, of_meshes) = (workcell(&boxes, &tool, vec![]), workcell(&meshes, &tool, vec![]));
        let (with_boxes, with_meshes) = (PoseTest::new(&of_boxes), PoseTest::new(&of_meshes));
        for _ in 0..150 {
            let axis = Vector3::new(random.between(-0.7, 0.7), random.between(-0.7, 0.7), 1.0);
            let mut at = |low: f64, high: f64| random.between(low, high);
            let tip = Point3::new(at(-400.0, 400.0), at(-400.0, 400.0), at(150.0, 600.0));
            let here = stand(&of_boxes, &ClPoint { tip, axis: Unit::new_normalize(axis) }).configuration.axes;
            let [a, b] = [&with_boxes, &with_meshes].map(|test| test.collision(&here, &mut Hints::default()));
            match (&a, &b) {
                (None, None) => free += 1,
                (Some(Infeasible::Collision { .. }), Some(Infeasible::Collision { .. })) => hit += 1,
                _ => panic!("{a:?} and {b:?} at {tip}"),
            }
            let distance = |test: &PoseTest<'_>| test.rapid_distance(&here, 300.0, &mut Hints::default()).0;
            let (a, b) = (distance(&with_boxes), distance(&with_meshes));
            assert!((a - b).abs() < 1e-9, "{a} and {b} at {tip}");
        }
    }
    assert!(free > 30 && hit > 30, "{free} free, {hit} hit");
}
