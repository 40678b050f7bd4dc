//! Laws of ranges of turns that are proven to touch nothing.

use facemill_interference::{Interference, MeshTree, SweepVerdict, TurnRange};
use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::kit::{Random, cube, frustum, sample_solids, sheet, square};

fn turned_pose(range: &TurnRange, a: f64, b: f64, shift: Vector3<f64>) -> Isometry3<f64> {
    let turn =
        UnitQuaternion::from_scaled_axis(range.turns[1] * b) * UnitQuaternion::from_scaled_axis(range.turns[0] * a);
    let to_center = Translation3::from(range.center.coords);
    Translation3::from(shift) * to_center * turn * to_center.inverse() * range.mesh_from_solid
}

#[test]
fn what_is_clear_is_touched_in_no_sampled_pose() {
    let tree = MeshTree::new(&sheet());
    let mut lcg = Random(81);
    let (mut clear, mut near) = (0, 0);
    for solid in sample_solids() {
        for _ in 0..400 {
            let middle = lcg.pose(45.0);
            let range = TurnRange {
                mesh_from_solid: middle,
                center: middle * lcg.point(20.0),
                turns: [
                    lcg.direction().into_inner() * lcg.between(0.0, 0.2),
                    lcg.direction().into_inner() * lcg.between(0.0, 0.2),
                ],
                shift: lcg.between(0.0, 0.5),
            };
            if tree.turn(&solid, &range, None) != SweepVerdict::Clear {
                continue;
            }
            clear += 1;
            let mut least = f64::INFINITY;
            for k in 0..81 {
                // A grid with the corners, where the turns are largest.
                let (a, b) = (f64::from(k / 9) / 4.0 - 1.0, f64::from(k % 9) / 4.0 - 1.0);
                let pose = turned_pose(&range, a, b, lcg.direction().into_inner() * range.shift);
                assert!(tree.verdict(&solid, &pose, None).is_free(), "{solid:?} at {a}, {b}");
                let near = tree.core_distance(&solid, &pose, solid.rounding() + 5.0, None);
                least = least.min(near.map_or(5.0, |s| s.distance - solid.rounding()));
            }
            near += usize::from(least < 1.0);
        }
    }
    assert!(clear > 1000 && near > 25, "{clear} clear, {near} of them near");
}

#[test]
fn a_mill_that_turns_about_its_contact_is_cleared_over_degrees() {
    // R 25, r 2, smaller by 0.02 as its test body, leaning by 6° on a plane, its corner's centre 2
    // mm above the contact.
    let mill = frustum([2.0, 48.0], [23.0, 23.0], 1.98);
    let center = Point3::new(0.0, 0.0, 2.0);
    let tilt = 6f64.to_radians();
    let at = |tilt: f64, turns: [f64; 2]| {
        let lean = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), tilt);
        let from_contact = Translation3::new(-23.0, 0.0, -2.0);
        TurnRange {
            mesh_from_solid: Translation3::from(center.coords) * lean * from_contact,
            center,
            turns: [Vector3::y() * turns[0], Vector3::z() * turns[1]],
            shift: 0.0,
        }
    };
    for mesh in [square(500.0), square(60.0)] {
        let tree = MeshTree::new(&mesh);
        for turns in [[0.02, 0.02], [0.04, 0.0], [0.0, 0.08], [0.001, 0.001]] {
            assert_eq!(tree.turn(&mill, &at(tilt, turns), None), SweepVerdict::Clear, "{turns:?}");
        }
        // Down to below the plane: at −0.1° the trailing edge is 46·sin(0.1°) = 0.08 mm in it.
        let below = tilt + 0.1f64.to_radians();
        assert!(matches!(tree.turn(&mill, &at(tilt, [below, 0.0]), None), SweepVerdict::Unproven(Some(_))));
        assert!(matches!(tree.turn(&mill, &at(-0.002, [1e-4; 2]), None), SweepVerdict::Unproven(Some(_))));
    }
}

#[test]
fn a_needle_that_is_met_within_the_range_is_never_cleared() {
    let spike = vec![Point3::new(30.0, 0.0, -5.0), Point3::new(30.01, 0.0, -5.0), Point3::new(30.0, 0.0, 0.5)];
    let tree = MeshTree::new(&TriMesh::new(spike, vec![[0, 1, 2]]).unwrap());
    let arm = frustum([-1.0, 1.0], [0.5, 0.5], 0.0);
    // At the end of an arm of 30 mm that turns about the origin.
    let at = |angle: f64, half: f64| TurnRange {
        mesh_from_solid: UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle) * Translation3::new(30.0, 0.0, 0.0),
        center: Point3::origin(),
        turns: [Vector3::zeros(), Vector3::z() * half],
        shift: 0.0,
    };
    let half_width = 0.5 / 30.0;
    assert!(matches!(tree.turn(&arm, &at(0.1, 0.1 - 0.9 * half_width), None), SweepVerdict::Unproven(_)));
    assert!(matches!(tree.turn(&arm, &at(0.1, 0.2), None), SweepVerdict::Unproven(_)));
    assert_eq!(tree.turn(&arm, &at(0.1, 0.05), None), SweepVerdict::Clear);
    for k in 0..200 {
        let angle = -0.2 + 0.002 * f64::from(k);
        if tree.turn(&arm, &at(angle, 0.001), None) == SweepVerdict::Clear {
            assert!(angle.abs() + 0.001 > half_width, "{angle}");
        } else {
            assert!(angle.abs() < half_width + 0.0015, "{angle}");
        }
    }
}

#[test]
fn a_point_that_comes_nearer_to_second_order_only_is_not_overlooked() {
    // Above a disc that turns about a point 50 mm below its top: to first order a point over the
    // middle goes sideways.
    let disc = frustum([40.0, 50.0], [30.0, 30.0], 0.0);
    for angle in [0.05f64, 0.1, 0.2] {
        let dip = 50.0 * (1.0 - angle.cos());
        for (gap, clear) in [(0.9 * dip, false), (1.2 * dip, true)] {
            let top = Point3::new(0.0, 0.0, 50.0 + gap);
            let speck = vec![top, top + Vector3::new(1e-3, 0.0, 0.0), top + Vector3::new(0.0, 1e-3, 0.0)];
            let tree = MeshTree::new(&TriMesh::new(speck, vec![[0, 1, 2]]).unwrap());
            let range = |turns: [f64; 2]| TurnRange {
                mesh_from_solid: Isometry3::identity(),
                center: Point3::origin(),
                turns: [Vector3::x() * turns[0], Vector3::x() * turns[1]],
                shift: 0.0,
            };
            // In one turn, or half of it in each.
            for turns in [[angle, 0.0], [0.0, angle], [0.5 * angle, 0.5 * angle]] {
                let verdict = tree.turn(&disc, &range(turns), None);
                assert_eq!(verdict == SweepVerdict::Clear, clear, "{angle} {gap} {verdict:?}");
                let met = tree.verdict(&disc, &turned_pose(&range(turns), 1.0, 1.0, Vector3::zeros()), None);
                assert_eq!(met.is_free(), clear, "{angle} {gap}");
            }
        }
    }
}

#[test]
fn a_body_inside_a_closed_part_and_numbers_that_are_none_are_not_cleared() {
    let tree = MeshTree::new(&cube(20.0, 1));
    let ball = frustum([0.0, 0.0], [0.0, 0.0], 1.0);
    let still = |x: f64, shift: f64| TurnRange {
        mesh_from_solid: Isometry3::translation(x, 0.0, 0.0),
        center: Point3::origin(),
        turns: [Vector3::zeros(), Vector3::z() * 0.01],
        shift,
    };
    assert!(matches!(tree.turn(&ball, &still(0.0, 0.0), None), SweepVerdict::Unproven(Some(_))));
    assert_eq!(tree.turn(&ball, &still(30.0, 0.0), None), SweepVerdict::Clear);
    assert_eq!(tree.turn(&ball, &still(30.0, f64::NAN), None), SweepVerdict::Unproven(None));
    assert_eq!(tree.turn(&ball, &still(f64::INFINITY, 0.0), None), SweepVerdict::Unproven(None));
}
