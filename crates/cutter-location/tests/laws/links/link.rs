use facemill_cl_data::{ClPoint, RapidLaw};
use facemill_cutter_location::links::link::{ClearanceSurface, LinkBlocked, LinkSettings, Linker};
use facemill_cutter_location::{Hints, Infeasible, PoseTest, Workcell};
use facemill_interference::{Interference, MeshTree};
use facemill_tool_model::ToolAssembly;
use nalgebra::{Point3, Unit, Vector3};

use crate::kit::{Ball, Random, distance_to_balls, machine, obstacle, smallest_distance, stand, tool, workcell};

const CLEARANCE: f64 = 10.0;

/// Poses of a link are tested at most 1 mm of motion apart near the clearance, so half of it may
/// lack.
const HALF_STEP: f64 = 0.5;

fn settings(clearance: ClearanceSurface) -> LinkSettings {
    LinkSettings { clearance, rapid_clearance: CLEARANCE, rapid_law: RapidLaw::Linear.into() }
}

fn high_plane(height: f64) -> ClearanceSurface {
    ClearanceSurface::Plane { origin: Point3::new(0.0, 0.0, height), normal: Vector3::z_axis() }
}

fn pose(x: f64, y: f64, z: f64, axis: [f64; 3]) -> ClPoint {
    ClPoint { tip: Point3::new(x, y, z), axis: Unit::new_normalize(Vector3::from(axis)) }
}

fn cell_with_balls<'a>(
    machine: &'a facemill_inverse_kinematics::Machine,
    tool: &'a ToolAssembly,
    trees: &'a [MeshTree],
) -> Workcell<'a> {
    workcell(machine, tool, trees.iter().map(|t| obstacle("ball", t as &dyn Interference)).collect())
}

fn trees(balls: &[Ball]) -> Vec<MeshTree> {
    balls.iter().map(|b| MeshTree::new(&b.mesh())).collect()
}

/// A link on the positive branch.
fn linked(
    cell: &Workcell<'_>,
    clearance: ClearanceSurface,
    from: &ClPoint,
    to: &ClPoint,
) -> Result<Vec<ClPoint>, LinkBlocked> {
    let (test, settings) = (PoseTest::new(cell), settings(clearance));
    let way = Linker::new(&test, &settings).link(&stand(cell, from), &stand(cell, to))?;
    Ok(way.iter().map(|w| w.cl).collect())
}

/// The whole way of a link, ends included.
fn whole(from: ClPoint, way: &[ClPoint], to: ClPoint) -> Vec<ClPoint> {
    [&[from], way, &[to]].concat()
}

#[test]
fn a_free_link_is_direct() {
    let (machine, tool) = (machine(), tool(25.0, 2.0, 20.0));
    let balls = [Ball { center: Point3::new(0.0, 0.0, -60.0), radius: 40.0 }];
    let trees = trees(&balls);
    let cell = cell_with_balls(&machine, &tool, &trees);
    let (from, to) = (pose(-200.0, 10.0, 20.0, [0.1, 0.0, 1.0]), pose(180.0, -30.0, 30.0, [-0.1, 0.2, 1.0]));
    let way = linked(&cell, high_plane(500.0), &from, &to).unwrap();
    assert_eq!(way, vec![]);
    assert!(smallest_distance(&cell, &[from, to], 2000, &balls) >= CLEARANCE);
}

#[test]
fn a_link_is_lifted_over_obstacles_and_no_higher_than_twice_as_needed() {
    let (machine, tool) = (machine(), tool(25.0, 2.0, 20.0));
    for radius in [15.0, 45.0, 100.0] {
        let balls = [Ball { center: Point3::new(0.0, 0.0, 0.0), radius }];
        let trees = trees(&balls);
        let cell = cell_with_balls(&machine, &tool, &trees);
        let (from, to) = (pose(-300.0, 0.0, 0.0, [0.0, 0.0, 1.0]), pose(300.0, 5.0, 0.0, [0.05, 0.0, 1.0]));
        assert!(smallest_distance(&cell, &[from, to], 1000, &balls) < 0.0, "it does stand between");
        let found = linked(&cell, high_plane(900.0), &from, &to);
        let way = whole(from, &found.unwrap(), to);
        assert_eq!(way.len(), 4);
        let smallest = smallest_distance(&cell, &way, 2000, &balls);
        assert!(smallest >= CLEARANCE - HALF_STEP, "{smallest}");
        let top = way.iter().map(|p| p.tip.z).fold(0.0, f64::max);
        // The tip must pass the ball's top by the clearance; the first lift is 25 mm, and each at
        // most 2.4 times the last.
        assert!(top >= radius + CLEARANCE - HALF_STEP && top <= (2.5 * (radius + CLEARANCE)).max(25.0) + 1.0, "{top}");
    }
}

#[test]
fn no_link_among_scattered_balls_comes_nearer_than_the_rapid_clearance() {
    let (machine, tool) = (machine(), tool(16.0, 16.0, 30.0));
    let mut random = Random(11);
    let (mut direct, mut lifted, mut refused) = (0, 0, 0);
    for _ in 0..60 {
        // On the table, and some as high as holder and head.
        let balls: Vec<Ball> = (0..4)
            .map(|k| Ball {
                center: Point3::new(
                    random.between(-400.0, 400.0),
                    random.between(-400.0, 400.0),
                    if k < 2 { 0.0 } else { random.between(100.0, 800.0) },
                ),
                radius: random.between(20.0, 80.0),
            })
            .collect();
        let trees = trees(&balls);
        let cell = cell_with_balls(&machine, &tool, &trees);
        let mut end = || {
            let axis = [random.between(-0.8, 0.8), random.between(-0.8, 0.8), 1.0];
            pose(random.between(-300.0, 300.0), random.between(-300.0, 300.0), 40.0, axis)
        };
        let (from, to) = (end(), end());
        let clear = |p: &ClPoint| distance_to_balls(&cell, p, &balls) > CLEARANCE + 0.5;
        if !clear(&from) || !clear(&to) {
            continue;
        }
        let found = linked(&cell, high_plane(700.0), &from, &to);
        let Ok(way) = found else {
            refused += 1;
            continue;
        };
        if way.is_empty() {
            direct += 1
        } else {
            lifted += 1
        }
        let smallest = smallest_distance(&cell, &whole(from, &way, to), 1500, &balls);
        assert!(smallest >= CLEARANCE - HALF_STEP, "{smallest} over {way:?} among {balls:?}");
    }
    assert!(direct >= 8 && lifted >= 5, "{direct} direct, {lifted} lifted, {refused} refused");
}

#[test]
fn the_head_is_farther_from_the_tip_than_the_tool_and_moves_farther_in_a_turn() {
    // The tip stays nearly where it is, the axis turns by 80°, and the head, 150 to 900 mm away,
    // swings past a ball that it meets at only one moment of the turn.
    let (machine, tool) = (machine(), tool(16.0, 2.0, 20.0));
    let mut random = Random(12);
    let mut judged = 0;
    for _ in 0..150 {
        let (radius, far) = (random.between(15.0, 60.0), random.between(300.0, 850.0));
        let lean: f64 = random.between(-0.5, 0.5);
        let side = random.between(130.0, 300.0) * random.between(-1.0, 1.0).signum();
        let center = Point3::new(far * lean.sin(), side, far * lean.cos());
        let balls = [Ball { center, radius }];
        let trees = trees(&balls);
        let cell = cell_with_balls(&machine, &tool, &trees);
        let (from, to) = (pose(-5.0, 0.0, 0.0, [-0.8, 0.0, 0.8]), pose(5.0, 0.0, 0.0, [0.8, 0.02, 0.8]));
        let clear = |p: &ClPoint| distance_to_balls(&cell, p, &balls) > CLEARANCE + 0.5;
        if !clear(&from) || !clear(&to) {
            continue;
        }
        let found = linked(&cell, high_plane(700.0), &from, &to);
        let Ok(way) = found else { continue };
        let smallest = smallest_distance(&cell, &whole(from, &way, to), 1500, &balls);
        assert!(smallest >= CLEARANCE - HALF_STEP, "{smallest} over {way:?} beside {balls:?}");
        judged += 1;
    }
    assert!(judged > 40, "{judged}");
}

#[test]
fn the_whole_flute_counts_for_the_rapid_clearance() {
    // A ball-end mill beside a small ball at the upper rim of its flute, where no corner is
    // rounded.
    let (machine, tool) = (machine(), tool(30.0, 30.0, 60.0));
    let upright = pose(0.0, 0.0, 0.0, [0.0, 0.0, 1.0]);
    for lacking in [2.0, 0.5, -0.5] {
        let diagonal = std::f64::consts::FRAC_1_SQRT_2 * (4.0 + CLEARANCE - lacking);
        let balls = [Ball { center: Point3::new(30.0 + diagonal, 0.0, 60.0 + diagonal), radius: 4.0 }];
        let trees = trees(&balls);
        let cell = cell_with_balls(&machine, &tool, &trees);
        let test = PoseTest::new(&cell);
        assert!((distance_to_balls(&cell, &upright, &balls) - (CLEARANCE - lacking)).abs() < 1e-9);
        let axes = stand(&cell, &upright).configuration.axes;
        let (distance, nearest) = test.rapid_distance(&axes, 2.0 * CLEARANCE, &mut Hints::default());
        assert!((distance - (CLEARANCE - lacking)).abs() < 2e-2 && nearest.is_some(), "{lacking}: {distance}");
        // Stock of the clearance's thickness around the ball is touched by the same part of the
        // flute.
        let mut cell = cell;
        cell.obstacles[0].collision_allowance = CLEARANCE;
        cell.obstacles[0].gouge_allowance = None;
        let in_stock = PoseTest::new(&cell).cutter_in_stock(&upright, &mut Hints::default());
        assert_eq!(in_stock, lacking > 0.0, "{lacking}");
    }
}

#[test]
fn over_something_large_the_way_follows_the_clearance_surface() {
    let (machine, tool) = (machine(), tool(25.0, 2.0, 20.0));
    let balls = [Ball { center: Point3::new(0.0, 0.0, 0.0), radius: 650.0 }];
    let trees = trees(&balls);
    let cell = cell_with_balls(&machine, &tool, &trees);
    // Lying toward the ball's sides: no lift along these axes leads over it.
    let (from, to) = (pose(-700.0, 0.0, 100.0, [-1.0, 0.0, 0.6]), pose(700.0, 0.0, 100.0, [1.0, 0.0, 0.6]));
    for clearance in [
        ClearanceSurface::Sphere { center: Point3::origin(), radius: 680.0 },
        ClearanceSurface::Cylinder { origin: Point3::origin(), axis: Vector3::y_axis(), radius: 680.0 },
    ] {
        let test = PoseTest::new(&cell);
        let found = linked(&cell, clearance, &from, &to);
        let found = found.unwrap_or_else(|b| panic!("{clearance:?}: {}", test.describe(&b.why)));
        assert!(found.len() > 10);
        for p in &found[1..found.len() - 1] {
            assert!(clearance.height(&p.tip) >= test.clearance_margin() - 1e-6);
        }
        let smallest = smallest_distance(&cell, &whole(from, &found, to), 300, &balls);
        assert!(smallest >= CLEARANCE - HALF_STEP, "{clearance:?}: {smallest}");
    }
}

#[test]
fn a_link_from_where_nothing_is_clear_says_what_blocks() {
    let (machine, tool) = (machine(), tool(25.0, 2.0, 20.0));
    let balls = [Ball { center: Point3::new(0.0, 45.0, 100.0), radius: 10.0 }];
    let trees = trees(&balls);
    let cell = cell_with_balls(&machine, &tool, &trees);
    let test = PoseTest::new(&cell);
    let (from, to) = (pose(0.0, 0.0, 0.0, [0.0, 0.0, 1.0]), pose(300.0, 0.0, 0.0, [0.0, 0.0, 1.0]));
    // 45 mm beside the axis: the holder of radius 30 comes within 3 mm, its own clearance of 2 mm
    // included.
    let blocked = linked(&cell, high_plane(500.0), &from, &to).unwrap_err();
    assert!(matches!(blocked.why, Infeasible::Collision { obstacle: 0, .. }));
    assert_eq!(test.describe(&blocked.why), "holder section 1 hits ball");
    assert!((blocked.pose.tip - from.tip).norm() < 1e-9);
}

#[test]
fn a_way_out_ends_outside_the_clearance_surface_with_the_whole_cutter() {
    let (machine, tool) = (machine(), tool(25.0, 2.0, 20.0));
    let balls = [Ball { center: Point3::new(0.0, 0.0, 0.0), radius: 60.0 }];
    let trees = trees(&balls);
    let cell = cell_with_balls(&machine, &tool, &trees);
    let test = PoseTest::new(&cell);
    let from = stand(&cell, &pose(-120.0, 0.0, 12.0, [0.05, 0.02, 1.0]));
    for clearance in [
        high_plane(120.0),
        ClearanceSurface::Cylinder { origin: Point3::origin(), axis: Vector3::x_axis(), radius: 150.0 },
        ClearanceSurface::Sphere { center: Point3::origin(), radius: 260.0 },
        // A job that is meant to be wrong: the way is far, and it ends.
        high_plane(1e300),
    ] {
        let settings = settings(clearance);
        match Linker::new(&test, &settings).way_out(&from) {
            Ok(way) => {
                let end = way.last().unwrap();
                assert!(clearance.height(&end.cl.tip) >= tool.cutter().radius() - 1e-6, "{clearance:?}");
                assert_eq!(end.configuration.branch, from.configuration.branch);
            }
            Err(blocked) => {
                assert_eq!(clearance, high_plane(1e300));
                assert!(matches!(blocked.why, Infeasible::Unreachable(_)), "{blocked:?}");
            }
        }
    }
}
