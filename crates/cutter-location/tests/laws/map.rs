//! The map of the feasible set: what it says of a cell holds for every posture in it.

use facemill_cl_data::{CcPoint, Posture, Silent};
use facemill_cutter_location::map::{CellState, MapCell, MapError, PostureRange, SolutionMap, map};
use facemill_cutter_location::{AxisCone, Body, Hints, Infeasible, PoseTest, Workcell, tool_frame};
use facemill_interference::{MeshTree, ParryMesh};
use facemill_inverse_kinematics::{BodyFile, Machine};
use facemill_sample_parts::{AnalyticPart, AnalyticShape, MaterialSide, PatchSpec, patch};
use facemill_surface_model::TriMesh;
use facemill_tool_model::{Section, Stack, ToolAssembly, cl_from_cc};
use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use crate::kit::{
    Ball, MOUNT, Random, cc_on_patch, cc_on_plane, machine, obstacle, plane, posture_deg, tool, workcell,
};
use crate::machine_bodies::with_post;

fn range_deg(tilt: [f64; 2], rotate: [f64; 2]) -> PostureRange {
    PostureRange { tilt: tilt.map(f64::to_radians), rotate: rotate.map(f64::to_radians) }
}

fn at_random(range: &PostureRange, random: &mut Random) -> Posture {
    // Corners and edges as often as the inside.
    let mut pick = |[from, to]: [f64; 2]| match random.between(0.0, 4.0) as u32 {
        0 => from,
        1 => to,
        _ => random.between(from, to),
    };
    Posture { tilt: pick(range.tilt), rotate: pick(range.rotate) }
}

/// Counts of postures tested in free and in blocked cells.
#[derive(Default)]
struct Tested {
    free: usize,
    blocked: usize,
}

/// Tests random postures of certified cells by themselves.
fn assert_true(test: &PoseTest<'_>, cc: &CcPoint, map: &SolutionMap, random: &mut Random, tested: &mut Tested) {
    for cell in &map.cells {
        for _ in 0..3 {
            let posture = at_random(&cell.range, random);
            let single = test.try_posture(cc, posture, None, &mut Hints::default());
            match cell.state {
                CellState::Free => {
                    assert!(single.is_ok(), "{posture:?} in {cell:?}: {single:?}");
                    tested.free += 1;
                }
                CellState::Blocked(_) => {
                    assert!(single.is_err(), "{posture:?} in {cell:?}");
                    tested.blocked += 1;
                }
                CellState::Uncertain(_) => {}
            }
        }
    }
}

fn needle(at: Point3<f64>) -> TriMesh {
    let (u, v) = (Vector3::new(0.005, 0.0, 0.0), Vector3::new(0.0, 0.005, 0.0));
    TriMesh::new(vec![at, at - u - Vector3::z() * 40.0, at + v - Vector3::z() * 40.0], vec![[0, 1, 2]]).unwrap()
}

#[test]
fn every_posture_of_a_certified_cell_is_as_the_cell_says() {
    let spec = PatchSpec::new([240.0, 240.0], 9.0, [2.0, 1.5]).unwrap();
    let fine = MeshTree::new(&patch(&spec, 120, 120).unwrap());
    let coarse = MeshTree::new(&patch(&spec, 24, 24).unwrap());
    let flat = MeshTree::new(&plane(400.0));
    let machine = machine();
    let mut random = Random(41);
    let mut tested = Tested::default();
    let mut uncertain = 0.0;
    for round in 0..12 {
        let tool = [tool(16.0, 2.0, 12.0), tool(25.0, 0.0, 12.0), tool(10.0, 10.0, 14.0)][round % 3].clone();
        let (x, y) = (random.between(-70.0, 70.0), random.between(-70.0, 70.0));
        let (part, cc) = match round % 4 {
            0 | 1 => (&fine, cc_on_patch(&spec, x, y, random.vector())),
            2 => (&coarse, cc_on_patch(&spec, x, y, random.vector())),
            _ => (&flat, cc_on_plane(x, y)),
        };
        let near = cc.position + Vector3::new(random.between(-40.0, 40.0), random.between(-40.0, 40.0), 0.0);
        let ball = Ball { center: near + Vector3::z() * random.between(20.0, 90.0), radius: 9.0 };
        let ball = MeshTree::new(&ball.mesh());
        let spike = MeshTree::new(&needle(near + Vector3::new(9.0, -4.0, random.between(0.5, 12.0))));
        let obstacles = vec![obstacle("part", part), obstacle("ball", &ball), obstacle("needle", &spike)];
        let cone = AxisCone { axis: Unit::new_normalize(Vector3::new(0.1, 0.2, 1.0)), half_angle: 0.45 };
        let cell = Workcell { axis_cone: (round % 5 == 4).then_some(cone), ..workcell(&machine, &tool, obstacles) };
        let test = PoseTest::new(&cell);
        let range = range_deg([0.0, 30.0], if round % 2 == 0 { [-90.0, 0.0] } else { [-40.0, 130.0] });
        let map = map(&test, &cc, range, 0.5f64.to_radians(), &Silent).unwrap();
        assert_covers(&map);
        assert_true(&test, &cc, &map, &mut random, &mut tested);
        uncertain += map.fractions().uncertain / 12.0;
    }
    assert!(tested.free > 3000 && tested.blocked > 3000, "{} free, {} blocked", tested.free, tested.blocked);
    assert!(uncertain < 0.3, "{uncertain} of the area uncertain");
}

/// The cells fill the range, and none is uncertain that is larger than the resolution.
fn assert_covers(map: &SolutionMap) {
    let area = |r: &PostureRange| (r.tilt[1] - r.tilt[0]) * (r.rotate[1] - r.rotate[0]);
    let sum: f64 = map.cells.iter().map(|c| area(&c.range)).sum();
    assert!((sum / area(&map.range) - 1.0).abs() < 1e-9);
    for cell in &map.cells {
        assert!(cell.range.tilt[0] >= map.range.tilt[0] && cell.range.tilt[1] <= map.range.tilt[1]);
        assert!(cell.range.rotate[0] >= map.range.rotate[0] && cell.range.rotate[1] <= map.range.rotate[1]);
        if matches!(cell.state, CellState::Uncertain(_)) {
            let widest = (cell.range.tilt[1] - cell.range.tilt[0]).max(cell.range.rotate[1] - cell.range.rotate[0]);
            assert!(widest <= map.resolution * (1.0 + 1e-6));
        }
    }
}

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
    // The circle of corner centres lies in a ball of radius RADIUS − r, through one point of it: the farthest one is
    // 2·(R − r) away along a chord at the angle of the tilt.
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

/// The machine with nothing on it: limits only.
fn without_bodies() -> Machine {
    let mut file = machine().to_file();
    file.bed_bodies.clear();
    file.workpiece_chain.rows.iter_mut().for_each(|row| row.bodies.clear());
    file.tool_chains.iter_mut().flat_map(|c| &mut c.rows).for_each(|row| row.bodies.clear());
    Machine::from_file(file).unwrap()
}

#[test]
fn what_blocks_a_cell_blocks_each_of_its_postures_alone() {
    let spec = PatchSpec::new([240.0, 240.0], 9.0, [2.0, 1.5]).unwrap();
    let part = MeshTree::new(&patch(&spec, 120, 120).unwrap());
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let mut random = Random(43);
    let (mut gouges, mut collisions, mut by_machine, mut same) = (0, 0, 0, 0);
    for round in 0..8 {
        let cc = cc_on_patch(&spec, random.between(-60.0, 60.0), random.between(-60.0, 60.0), random.vector());
        let beside = Vector3::new(random.between(-30.0, 30.0), random.between(-30.0, 30.0), 0.0);
        let height = [6.0, 30.0, 90.0, 260.0][round % 4];
        let radius = [9.0, 9.0, 15.0, 60.0][round % 4];
        let ball = Ball { center: cc.position + beside + Vector3::z() * height, radius };
        let (ball_tree, ball_parry) = (MeshTree::new(&ball.mesh()), ParryMesh::new(&ball.mesh()));
        let obstacles = vec![obstacle("part", &part), obstacle("ball", &ball_tree)];
        let cell = workcell(&machine, &tool, obstacles.clone());
        let test = PoseTest::new(&cell);
        let map = map(&test, &cc, range_deg([0.0, 40.0], [-120.0, 30.0]), 1f64.to_radians(), &Silent).unwrap();
        let alone: Vec<Workcell<'_>> =
            obstacles.into_iter().map(|o| Workcell { obstacles: vec![o], ..cell.clone() }).collect();
        for MapCell { range, state } in &map.cells {
            let CellState::Blocked(why) = state else { continue };
            for _ in 0..2 {
                let posture = at_random(range, &mut random);
                let named = test.try_posture(&cc, posture, None, &mut Hints::default()).unwrap_err();
                let cl = cl_from_cc(tool.cutter(), &cc, posture);
                match why {
                    Infeasible::Gouge { obstacle, .. } => {
                        let only = PoseTest::new(&alone[*obstacle]);
                        let single = only.try_posture(&cc, posture, None, &mut Hints::default());
                        assert!(matches!(single, Err(Infeasible::Gouge { obstacle: 0, .. })), "{single:?} for {why:?}");
                        same += usize::from(matches!(named, Infeasible::Gouge { obstacle: o, .. } if o == *obstacle));
                        gouges += 1;
                    }
                    Infeasible::Collision { body: Body::Tool(k), obstacle: 1, .. } => {
                        let body = &tool.collision_bodies()[*k];
                        let pose = tool_frame(&cl) * body.frame_from_solid;
                        let hit = facemill_interference::Interference::verdict(&ball_parry, &body.solid, &pose, None);
                        assert!(!hit.is_free(), "{why:?} at {posture:?}");
                        same +=
                            usize::from(matches!(named, Infeasible::Collision { body: Body::Tool(b), .. } if b == *k));
                        collisions += 1;
                    }
                    Infeasible::Collision { body: Body::Tool(_), .. } => collisions += 1,
                    Infeasible::Collision { body: Body::Machine(k), obstacle: 1, .. } => {
                        let only = PoseTest::new(&alone[1]);
                        let single = only.try_posture(&cc, posture, None, &mut Hints::default());
                        assert!(matches!(single, Err(Infeasible::Collision { .. })), "{single:?} for {why:?}");
                        same += usize::from(
                            matches!(named, Infeasible::Collision { body: Body::Machine(b), .. } if b == *k),
                        );
                        by_machine += 1;
                    }
                    other => panic!("{other:?}"),
                }
            }
        }
    }
    let all = gouges + collisions + by_machine;
    assert!(gouges > 200 && collisions > 200 && by_machine > 50, "{gouges} {collisions} {by_machine}");
    assert!(2 * same > all, "{same} of {all} named by the test of the posture, too");
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
fn a_finer_map_leaves_less_uncertain_and_threads_change_nothing() {
    let spec = PatchSpec::new([240.0, 240.0], 9.0, [2.0, 1.5]).unwrap();
    let part = MeshTree::new(&patch(&spec, 120, 120).unwrap());
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let cell = workcell(&machine, &tool, Vec::new());
    let cc = cc_on_patch(&spec, 25.0, 20.0, Vector3::x());
    let ball = Ball { center: cc.position + Vector3::new(26.0, -26.0, 75.0), radius: 18.0 };
    let ball = MeshTree::new(&ball.mesh());
    let cell = Workcell { obstacles: vec![obstacle("part", &part), obstacle("ball", &ball)], ..cell };
    let test = PoseTest::new(&cell);
    let range = range_deg([0.0, 24.0], [-80.0, 0.0]);
    let at = |deg: f64| map(&test, &cc, range, deg.to_radians(), &Silent).unwrap();
    let maps = [4.0, 2.0, 1.0, 0.5].map(at);
    let uncertain = maps.each_ref().map(|m| m.fractions().uncertain);
    assert!(uncertain.windows(2).all(|w| w[1] < 0.8 * w[0]), "{uncertain:?}");
    let fractions = maps[3].fractions();
    assert!(fractions.free > 0.1 && fractions.blocked > 0.1, "{fractions:?}");
    assert!((fractions.free + fractions.blocked + fractions.uncertain - 1.0).abs() < 1e-9);
    let pool = |n: usize| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(|| at(0.5));
    assert_eq!(pool(1), maps[3]);
    assert_eq!(pool(3), maps[3]);
}

#[test]
fn ranges_that_make_no_map_are_refused() {
    let tree = MeshTree::new(&plane(400.0));
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let cell = workcell(&machine, &tool, vec![obstacle("part", &tree)]);
    let test = PoseTest::new(&cell);
    let refused = |tilt, rotate, resolution: f64| {
        map(&test, &cc_on_plane(0.0, 0.0), range_deg(tilt, rotate), resolution.to_radians(), &Silent).unwrap_err()
    };
    assert_eq!(refused([5.0, 5.0], [0.0, 10.0], 1.0), MapError::Tilt);
    assert_eq!(refused([-1.0, 5.0], [0.0, 10.0], 1.0), MapError::Tilt);
    assert_eq!(refused([0.0, 90.0], [0.0, 10.0], 1.0), MapError::Tilt);
    assert_eq!(refused([0.0, f64::NAN], [0.0, 10.0], 1.0), MapError::Tilt);
    assert_eq!(refused([0.0, 5.0], [10.0, 0.0], 1.0), MapError::Rotate);
    assert_eq!(refused([0.0, 5.0], [0.0, 361.0], 1.0), MapError::Rotate);
    assert_eq!(refused([0.0, 5.0], [f64::NEG_INFINITY, 0.0], 1.0), MapError::Rotate);
    for resolution in [0.0, -1.0, f64::NAN, 1e-3] {
        assert_eq!(refused([0.0, 5.0], [0.0, 10.0], resolution), MapError::Resolution);
    }
}

#[test]
fn limits_and_bodies_of_the_bed_are_proven_as_the_single_postures_say() {
    let flat = MeshTree::new(&plane(60.0));
    // On both sides, because the tool leans to either side by the branch.
    let mut file = with_post(200.0).to_file();
    let [x, y, z] = file.bed_bodies[0].position_mm;
    file.bed_bodies.push(BodyFile { position_mm: [-y, x, z], ..file.bed_bodies[0].clone() });
    file.bed_bodies[0].position_mm = [y, x, z];
    let machine = Machine::from_file(file).unwrap();
    let tool = tool(16.0, 2.0, 12.0);
    let mut random = Random(47);
    let mut tested = Tested::default();
    let (mut by_limits, mut by_post, mut known) = (0, 0, 0.0);
    for round in 0..8 {
        // Far out, where X ends at 2600 mm, or near the post; the part leans, so that C does not turn freely.
        let far = round % 2 == 0;
        let place = if far {
            Isometry3::translation(random.between(2500.0, 2900.0), random.between(-100.0, 100.0), MOUNT)
        } else {
            Isometry3::translation(random.between(-20.0, 20.0), random.between(-20.0, 20.0), MOUNT)
        };
        let lean = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), random.between(0.6, 0.9));
        let table_from_work = place * lean;
        let cell = Workcell { table_from_work, ..workcell(&machine, &tool, vec![obstacle("part", &flat)]) };
        let test = PoseTest::new(&cell);
        let cc = cc_on_plane(random.between(-20.0, 20.0), random.between(-20.0, 20.0));
        // Head and posts move by centimetres for a degree.
        let (range, resolution) = if far {
            (range_deg([0.0, 50.0], [-170.0, 170.0]), 2f64.to_radians())
        } else {
            let rotate = random.between(-170.0, 160.0);
            (range_deg([20.0, 28.0], [rotate, rotate + 8.0]), 0.25f64.to_radians())
        };
        let map = map(&test, &cc, range, resolution, &Silent).unwrap();
        assert_true(&test, &cc, &map, &mut random, &mut tested);
        let blocked_by = |pick: fn(&Infeasible) -> bool| {
            map.cells.iter().filter(|c| matches!(&c.state, CellState::Blocked(why) if pick(why))).count()
        };
        by_limits += blocked_by(|why| matches!(why, Infeasible::Unreachable(_)));
        by_post += blocked_by(|why| matches!(why, Infeasible::Collision { obstacle: 1 | 2, .. }));
        known += (1.0 - map.fractions().uncertain) / 8.0;
    }
    assert!(tested.free > 1000 && tested.blocked > 1000, "{} free, {} blocked", tested.free, tested.blocked);
    assert!(
        by_limits > 50 && by_post > 50 && known > 0.5,
        "{by_limits} by limits, {by_post} by the post, {known} known"
    );
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
    // Under the rear as high as the cutter at 10°, and as far above its upper end as half of the largest lift.
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
