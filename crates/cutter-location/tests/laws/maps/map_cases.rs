//! Maps of scenes with a known answer: closed forms, needles, ceilings, a part all around.

use facemill_cl_data::{CcPoint, Silent};
use facemill_cutter_location::search::map::{CellState, MapCell, map};
use facemill_cutter_location::{Hints, Infeasible, PoseTest, Workcell, tool_frame};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::Machine;
use facemill_sample_parts::{AnalyticPart, AnalyticShape, MaterialSide};
use facemill_surface_model::TriMesh;
use facemill_tool_model::{Section, Stack, ToolAssembly, cl_from_cc};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use crate::kit::{Ball, Random, cc_on_plane, machine, obstacle, plane, posture_deg, tool, workcell};
use crate::maps::map::{Tested, assert_true, range_deg};

/// The bottom half of a hollow ball about the origin, open toward +z.
fn bowl(radius: f64, n: usize) -> TriMesh {
    let shape = AnalyticShape::Sphere { radius, material: MaterialSide::Outside };
    let whole = AnalyticPart::new(shape).unwrap().mesh(n).unwrap();
    let low = |t: &&[u32; 3]| t.iter().all(|v| whole.vertices()[*v as usize].z < -0.8 * radius);
    TriMesh::new(whole.vertices().to_vec(), whole.triangles().iter().filter(low).copied().collect()).unwrap()
}

#[test]
fn rear_gouge_in_a_bowl_ends_at_the_closed_form_for_every_rotate() {
    const RADIUS: f64 = 500.0;
    const N: usize = 160;
    let tree = MeshTree::new(&bowl(RADIUS, N));
    let machine = without_bodies();
    let tool = tool(63.0, 2.0, 40.0);
    // A part that leans: nowhere in the map is the tool along the machine's C axis.
    let lean = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.5);
    let table_from_work = Isometry3::translation(0.0, 0.0, 1500.0) * lean;
    let cell = Workcell {
        table_from_work,
        max_lift: 0.03,
        gouge_tolerance: 0.005,
        ..workcell(&machine, &tool, vec![obstacle("bowl", &tree)])
    };
    let test = PoseTest::new(&cell);
    let cc = CcPoint::new(Point3::new(0.0, 0.0, -RADIUS), Vector3::z(), Vector3::x()).unwrap();
    // The circle of corner centres lies in a ball of radius RADIUS − r, through one point of it:
    // the farthest one is 2·(R − r) away along a chord at the angle of the tilt.
    let closed_form = (61.0f64 / (RADIUS - 2.0)).asin();
    // Two directions of facets, tolerance and lift, seen across the disc.
    let facets = 2.0 * RADIUS * (1.0 - (0.25 * std::f64::consts::PI / N as f64).cos());
    let slack = (2.0 * cell.gouge_tolerance + cell.max_lift + facets) / (2.0 * 61.0);
    let resolution = 0.2f64.to_radians();
    assert!(slack < 0.3 * resolution, "the test says something");
    let map = map(&test, &cc, range_deg([2.0, 12.0], [-60.0, 60.0]), resolution, &Silent).unwrap();
    for cell in &map.cells {
        match cell.state {
            CellState::Free => assert!(cell.range.tilt[0] > closed_form - slack, "{cell:?}"),
            CellState::Blocked(why) => {
                assert!(matches!(why, Infeasible::Gouge { obstacle: 0, .. }), "{why:?}");
                assert!(cell.range.tilt[1] < closed_form + slack, "{cell:?}");
            }
            CellState::Uncertain(_) => {
                let off = (cell.range.middle().tilt - closed_form).abs();
                assert!(off < 4.0 * resolution + slack, "{cell:?} is {off} from {closed_form}");
            }
        }
    }
    assert!(map.fractions().uncertain < 0.08, "{:?}", map.fractions());
}

/// A mill below a flange of 60 mm that is a twentieth of a millimetre thick.
fn flanged() -> ToolAssembly {
    let mut file = tool(10.0, 2.0, 12.0).to_file();
    let section =
        |length_mm, diameter_mm| Section { length_mm, diameter_low_mm: diameter_mm, diameter_high_mm: diameter_mm };
    file.holder = Stack { clearance_mm: 0.0, sections: vec![section(0.05, 60.0), section(99.95, 14.0)] };
    ToolAssembly::new(file).unwrap()
}

#[test]
fn a_needle_that_blocks_a_band_narrower_than_the_cells_is_never_in_a_free_cell() {
    let flat = MeshTree::new(&plane(400.0));
    let machine = without_bodies();
    let tool = flanged();
    let mut random = Random(45);
    let (mut free_beside, mut missed_by_middles) = (0, 0);
    for _ in 0..60 {
        let posture = posture_deg(random.between(12.0, 18.0), random.between(-40.0, -30.0));
        let cc = cc_on_plane(random.between(-50.0, 50.0), random.between(-50.0, 50.0));
        let frame = tool_frame(&cl_from_cc(tool.cutter(), &cc, posture));
        let (radius, turn) = (random.between(12.0, 29.0), random.between(-3.1, 3.1));
        // In the flange, which starts 52 mm above the tip.
        let tip = frame * Point3::new(radius * turn.cos(), radius * turn.sin(), 52.025);
        let (u, v) = (frame * Vector3::x() * 0.005, frame * Vector3::y() * 0.005);
        let speck = MeshTree::new(&TriMesh::new(vec![tip, tip + u, tip + v], vec![[0, 1, 2]]).unwrap());
        let cell = workcell(&machine, &tool, vec![obstacle("part", &flat), obstacle("needle", &speck)]);
        let test = PoseTest::new(&cell);
        assert!(test.try_posture(&cc, posture, None, &mut Hints::default()).is_err());
        let range = range_deg([10.0, 20.0], [-45.0, -25.0]);
        let map = map(&test, &cc, range, 1f64.to_radians(), &Silent).unwrap();
        let there: Vec<&MapCell> = map.cells.iter().filter(|c| c.range.holds(&posture)).collect();
        assert!(!there.is_empty() && there.iter().all(|c| c.state != CellState::Free), "{there:?}");
        free_beside += usize::from(map.fractions().free > 0.5);
        missed_by_middles += usize::from(there.iter().all(|c| c.state == CellState::Uncertain(None)));
    }
    assert!(free_beside > 40, "{free_beside}");
    assert!(missed_by_middles > 10, "the verdicts in the middle alone would miss it: {missed_by_middles}");
}

#[test]
fn a_cutter_wholly_inside_a_closed_part_is_proven_blocked() {
    let part = Ball { center: Point3::new(0.0, 0.0, 60.0), radius: 400.0 };
    let tree = MeshTree::new(&part.mesh());
    let machine = without_bodies();
    let tool = tool(16.0, 2.0, 12.0);
    let cell = workcell(&machine, &tool, vec![obstacle("part", &tree)]);
    let test = PoseTest::new(&cell);
    let map = map(&test, &cc_on_plane(0.0, 0.0), range_deg([2.0, 30.0], [-90.0, 90.0]), 2f64.to_radians(), &Silent);
    for cell in map.unwrap().cells {
        let CellState::Blocked(why) = cell.state else { panic!("{cell:?}") };
        assert_eq!(test.describe(&why), "cutter gouges part");
        assert!(cell.range.tilt[1] - cell.range.tilt[0] > 3.0 * 2f64.to_radians(), "in large cells: {cell:?}");
    }
}

#[test]
fn a_ceiling_that_only_a_lifted_cutter_meets_blocks_nothing_that_needs_no_lift() {
    let flat = MeshTree::new(&plane(300.0));
    let machine = without_bodies();
    let tool = tool(16.0, 2.0, 12.0);
    let cc = cc_on_plane(0.0, 0.0);
    let middle = posture_deg(10.0, 0.0);
    let frame = tool_frame(&cl_from_cc(tool.cutter(), &cc, middle));
    let axis = frame * Vector3::z();
    let front = (Vector3::x() - axis * axis.x).normalize();
    let speck = |at: Point3<f64>, up: f64| {
        let (u, v) = (Vector3::new(0.01, 0.0, up), Vector3::new(0.0, 0.01, up));
        MeshTree::new(&TriMesh::new(vec![at, at + u, at + v], vec![[0, 1, 2]]).unwrap())
    };
    // Under the rear as high as the cutter at 10°, and as far above its upper end as half of the
    // largest lift.
    let floor = speck(frame * Point3::origin() - front * 14.0 + axis * 0.02, -1.0);
    let ceiling = speck(frame * Point3::origin() + front * 14.0 + axis * 12.3, 1.0);
    let obstacles = vec![obstacle("part", &flat), obstacle("floor", &floor), obstacle("ceiling", &ceiling)];
    let cell = Workcell { max_lift: 0.6, ..workcell(&machine, &tool, obstacles) };
    let test = PoseTest::new(&cell);
    let at = |tilt: f64| test.try_posture(&cc, posture_deg(tilt, 0.0), None, &mut Hints::default());
    assert_eq!(at(10.2).map(|pose| pose.lift), Ok(0.0));
    assert!(matches!(at(9.8), Err(Infeasible::Gouge { obstacle: 2, .. })), "{:?}", at(9.8));
    let map = map(&test, &cc, range_deg([9.3, 10.3], [-0.5, 0.5]), 0.05f64.to_radians(), &Silent).unwrap();
    let mut tested = Tested::default();
    assert_true(&test, &cc, &map, &mut Random(51), &mut tested);
    let fractions = map.fractions();
    assert!(fractions.free > 0.2 && fractions.blocked > 0.3 && fractions.uncertain < 0.2, "{fractions:?}");
}

/// The machine with nothing on it: limits only.
fn without_bodies() -> Machine {
    let mut file = machine().to_file();
    file.bed_bodies.clear();
    file.workpiece_chain.rows.iter_mut().for_each(|row| row.bodies.clear());
    file.tool_chains.iter_mut().flat_map(|c| &mut c.rows).for_each(|row| row.bodies.clear());
    Machine::from_file(file).unwrap()
}
