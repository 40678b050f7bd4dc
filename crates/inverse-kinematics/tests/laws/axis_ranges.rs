//! Axis values over sets of tool poses against single inverse solutions.

use crate::common::*;
use facemill_cl_data::{ClPoint, ConvexPolyhedron, Solid};
use facemill_inverse_kinematics::inverse::{AxisRanges, LimitVerdict, PoseSet};
use facemill_inverse_kinematics::machine_file::{BodyFile, MeshShapeFile, ShapeFile};
use facemill_inverse_kinematics::*;
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

const TOOL: f64 = 137.0;

/// A hull off its frame's origin.
fn hull() -> ShapeFile {
    let tips = [[90.0, 0.0, 10.0], [-60.0, 20.0, 0.0], [0.0, 70.0, -30.0], [10.0, -50.0, 40.0], [5.0, 5.0, 130.0]];
    let hull = ConvexPolyhedron::around(&tips.map(Point3::from), []).unwrap();
    let (file, hull) = ("casting.stl".to_owned(), Some(std::sync::Arc::new(hull)));
    ShapeFile::Mesh(MeshShapeFile { file, unit: None, groups: None, hull })
}

/// The families, with a box or a hull on every link.
fn families_with_bodies() -> Vec<Machine> {
    let body = |k: usize| BodyFile {
        name: format!("body {k}"),
        clearance_mm: 3.0,
        position_mm: [20.0 * k as f64, -35.0, 60.0],
        rotation_xyz_deg: [10.0, 25.0 * k as f64, 0.0],
        shape: if k.is_multiple_of(2) { ShapeFile::Box { size_mm: [80.0, 50.0, 120.0] } } else { hull() },
    };
    let with_bodies = |machine: &Machine| {
        let mut file = machine.to_file();
        file.bed_bodies.push(body(0));
        let rows = file.workpiece_chain.rows.iter_mut().chain(file.tool_chains[0].rows.iter_mut());
        for (k, row) in rows.enumerate() {
            row.bodies.push(body(k + 1));
        }
        Machine::from_file(file).unwrap()
    };
    families().iter().map(with_bodies).collect()
}

/// Returns a pose of a set; every third on its border.
fn pose_of(set: &PoseSet, r: &mut Random, k: usize) -> ClPoint {
    let share = |r: &mut Random| if k.is_multiple_of(3) { 1.0 } else { r.between(0.0, 1.0) };
    let across = Unit::new_normalize(set.cl.axis.cross(&r.direction()));
    let turn = UnitQuaternion::from_axis_angle(&across, set.turn * share(r));
    ClPoint { axis: turn * set.cl.axis, tip: set.cl.tip + r.direction().into_inner() * (set.shift * share(r)) }
}

fn random_set(machine: &Machine, r: &mut Random) -> PoseSet {
    let cl = cl_by_matrices(machine, &random_values(r, machine), TOOL);
    let size = 10f64.powf(r.between(-4.0, -0.7));
    PoseSet { cl, turn: size * r.between(0.0, 1.0), shift: 100.0 * size * r.between(0.0, 1.0) }
}

/// Returns the farthest way of a corner of a body between two positions.
fn way_of(machine: &Machine, body: usize, from: &AxisValues, to: &AxisValues) -> f64 {
    let at = |q: &AxisValues| machine.body_poses(q).nth(body).unwrap().table_from_solid;
    let (from, to) = (at(from), at(to));
    let solid = &machine.bodies()[body].body.solid;
    let bounds = solid.aabb();
    let pick = |k: usize, axis: usize| if k >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
    let corners = match solid {
        Solid::Hull(hull) => hull.core.vertices().to_vec(),
        _ => (0..8).map(|k| Point3::new(pick(k, 0), pick(k, 1), pick(k, 2))).collect(),
    };
    corners.iter().map(|p| (to * p - from * p).norm()).fold(0.0, f64::max)
}

#[test]
fn every_pose_of_a_set_has_its_values_within_the_ranges_and_moves_no_body_farther() {
    let mut r = Random(31);
    let (mut checked, mut known, mut tight) = (0, 0, 0);
    for machine in families_with_bodies() {
        let mut known_here = 0;
        for _ in 0..120 {
            let set = random_set(&machine, &mut r);
            let AxisRanges::Both(ranges) = machine.axis_ranges(&set, TOOL) else { continue };
            known_here += 1;
            let travels: Vec<Vec<f64>> = ranges
                .iter()
                .map(|range| (0..machine.bodies().len()).map(|b| machine.body_travel(b, range, &set, TOOL)).collect())
                .collect();
            for k in 0..20 {
                let Ok(solutions) = machine.inverse(&pose_of(&set, &mut r, k), TOOL) else { continue };
                for solution in solutions.iter() {
                    let n = ranges.iter().position(|range| range.branch == solution.branch).unwrap();
                    let range = &ranges[n];
                    for (a, axis) in machine.axes().iter().enumerate() {
                        let mut off = solution.values[a] - range.middle[a];
                        if axis.kind == AxisKind::Rotary {
                            off -= std::f64::consts::TAU * (off / std::f64::consts::TAU).round();
                        }
                        assert!(off.abs() <= range.half[a], "{}: {off} beyond {}", axis.letter, range.half[a]);
                        tight += usize::from(off.abs() > 0.3 * range.half[a]);
                    }
                    for (body, travel) in travels[n].iter().enumerate() {
                        let way = way_of(&machine, body, &range.middle, &solution.values);
                        assert!(way <= *travel, "body {body}: {way} beyond {travel}");
                    }
                    checked += 1;
                }
            }
        }
        known += usize::from(known_here > 20);
    }
    // Machines with a rotary joint between two linear ones are not supported.
    assert!(checked > 5000 && known >= 6 && tight > 2000, "{checked} checked on {known} machines, {tight} tight");
}

#[test]
fn limits_over_a_range_are_those_of_every_pose_in_it() {
    let mut r = Random(32);
    let (mut within, mut beyond) = (0, 0);
    for machine in families() {
        for _ in 0..200 {
            let mut set = random_set(&machine, &mut r);
            // Often near or outside of the linear limits, which are 2000 mm and more.
            set.cl.tip += r.direction().into_inner() * r.between(0.0, 4000.0);
            let AxisRanges::Both(ranges) = machine.axis_ranges(&set, TOOL) else { continue };
            for k in 0..10 {
                let solutions = machine.inverse(&pose_of(&set, &mut r, k), TOOL);
                for range in &ranges {
                    let reached = solutions.is_ok_and(|s| s.on_branch(range.branch).is_some());
                    match machine.limits_over(range) {
                        LimitVerdict::Within => {
                            assert!(reached, "{range:?} {solutions:?}");
                            within += 1;
                        }
                        LimitVerdict::Beyond(Unreachable::AxisLimit { index, value, min, max, .. }) => {
                            assert!(!reached, "{range:?} {solutions:?}");
                            assert!(!(min..=max).contains(&value), "axis {index}: {value}");
                            beyond += 1;
                        }
                        LimitVerdict::Beyond(other) => panic!("{other}"),
                        LimitVerdict::Unknown => {}
                    }
                }
            }
        }
    }
    assert!(within > 2000 && beyond > 2000, "{within} within, {beyond} beyond");
}

#[test]
fn sets_that_hold_the_pole_are_unknown_and_those_out_of_reach_are_reported() {
    let machine = Machine::head_b_table_c().unwrap();
    let set = |tilt: f64, turn: f64| PoseSet {
        cl: ClPoint {
            tip: Point3::new(500.0, 100.0, 900.0),
            axis: Unit::new_normalize(Vector3::new(tilt.sin(), 0.0, tilt.cos())),
        },
        turn,
        shift: 0.1,
    };
    assert_eq!(machine.axis_ranges(&set(0.0, 0.01), TOOL), AxisRanges::Unknown);
    assert_eq!(machine.axis_ranges(&set(0.01, 0.0101), TOOL), AxisRanges::Unknown);
    assert!(matches!(machine.axis_ranges(&set(0.01, 0.009), TOOL), AxisRanges::Both(_)));
    assert_eq!(machine.axis_ranges(&set(0.1, f64::NAN), TOOL), AxisRanges::Unknown);
    assert_eq!(machine.axis_ranges(&set(0.1, -1.0), TOOL), AxisRanges::Unknown);
    // A head that leans by 45° at most on half of the sphere: turned about an axis at 45° it
    // reaches down to the horizontal.
    let nutating = nutating_head();
    let down = |below: f64| PoseSet {
        cl: ClPoint { axis: Unit::new_normalize(Vector3::new(below.cos(), 0.0, -below.sin())), ..set(0.0, 0.0).cl },
        turn: 0.05,
        shift: 0.1,
    };
    assert!(matches!(nutating.axis_ranges(&down(0.1), TOOL), AxisRanges::OutOfReach(Unreachable::Direction { .. })));
    assert_eq!(nutating.axis_ranges(&down(0.03), TOOL), AxisRanges::Unknown);
    assert!(matches!(nutating.axis_ranges(&down(-0.1), TOOL), AxisRanges::Both(_)));
}
