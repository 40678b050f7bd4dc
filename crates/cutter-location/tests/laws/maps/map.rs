//! The map of the feasible set: its verdict on a cell holds for every posture in it.

use facemill_cl_data::{CcPoint, Posture, Silent};
use facemill_cutter_location::search::map::{CellState, MapCell, MapError, MapRange, SolutionMap, map};
use facemill_cutter_location::{AxisCone, Body, Hints, Infeasible, PoseTest, Workcell, tool_frame};
use facemill_interference::{MeshTree, ParryMesh};
use facemill_inverse_kinematics::Machine;
use facemill_inverse_kinematics::machine_file::BodyFile;
use facemill_sample_parts::{PatchSpec, patch};
use facemill_surface_model::TriMesh;
use facemill_tool_model::cl_from_cc;
use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use crate::kit::{Ball, MOUNT, Random, cc_on_patch, cc_on_plane, machine, obstacle, plane, tool, workcell};
use crate::machine_bodies::with_post;

pub(crate) fn range_deg(tilt: [f64; 2], rotate: [f64; 2]) -> MapRange {
    MapRange { tilt: tilt.map(f64::to_radians), rotate: rotate.map(f64::to_radians) }
}

fn at_random(range: &MapRange, random: &mut Random) -> Posture {
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
pub(crate) struct Tested {
    pub(crate) free: usize,
    pub(crate) blocked: usize,
}

/// Tests random postures of certified cells by themselves.
pub(crate) fn assert_true(
    test: &PoseTest<'_>,
    cc: &CcPoint,
    map: &SolutionMap,
    random: &mut Random,
    tested: &mut Tested,
) {
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
            0 | 1 => (&fine, cc_on_patch(&spec, x, y, random.vector(1.0))),
            2 => (&coarse, cc_on_patch(&spec, x, y, random.vector(1.0))),
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

/// Checks that the cells fill the range, and that no uncertain one is larger than the resolution.
fn assert_covers(map: &SolutionMap) {
    let area = |r: &MapRange| (r.tilt[1] - r.tilt[0]) * (r.rotate[1] - r.rotate[0]);
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

#[test]
fn what_blocks_a_cell_blocks_each_of_its_postures_alone() {
    let spec = PatchSpec::new([240.0, 240.0], 9.0, [2.0, 1.5]).unwrap();
    let part = MeshTree::new(&patch(&spec, 120, 120).unwrap());
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let mut random = Random(43);
    let (mut gouges, mut collisions, mut by_machine, mut same) = (0, 0, 0, 0);
    for round in 0..8 {
        let cc = cc_on_patch(&spec, random.between(-60.0, 60.0), random.between(-60.0, 60.0), random.vector(1.0));
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
        // Far out, where X ends at 2600 mm, or near the post; the part leans, so C does not turn
        // freely.
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
