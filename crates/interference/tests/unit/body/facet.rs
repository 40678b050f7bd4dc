use crate::body::facet::*;
use crate::body::{Placed, for_body};
use crate::test_kit::{Random, brute_triangle_distance, odd_triangle, sample_solids};
use facemill_cl_data::Solid;
use nalgebra::Isometry3;

fn nearest(solid: &Solid, pose: &Isometry3<f64>, corners: &[Point3<f64>; 3], goal: Goal) -> Option<Sample> {
    for_body!(Placed::new(solid, pose), |b| nearest_on_triangle(&b, corners, goal))
}

const ALL: Goal = Goal { enough: 0.0, beyond: f64::INFINITY };

fn assert_exact(solid: &Solid, pose: &Isometry3<f64>, corners: &[Point3<f64>; 3]) {
    let brute = brute_triangle_distance(solid, pose, corners);
    let found = nearest(solid, pose, corners, ALL).unwrap();
    assert!((found.distance - brute).abs() < 1e-9, "{solid:?} {pose} {corners:?}: {} for {brute}", found.distance);
    // The point named is of the triangle and has that distance.
    let there = solid.core_distance(&pose.inverse_transform_point(&found.point));
    assert!((there - found.distance).abs() < 1e-9);
    for (offset, free) in [(-1e-8, true), (1e-8, false)] {
        let rounding = brute + offset;
        if rounding < 0.0 {
            continue;
        }
        let verdict = nearest(solid, pose, corners, Goal { enough: rounding, beyond: rounding });
        assert_eq!(verdict.is_none(), free, "{solid:?} {pose} {corners:?} at {rounding} of {brute}");
    }
}

#[test]
fn distance_and_verdict_are_those_of_golden_sections() {
    let mut lcg = Random(31);
    for solid in sample_solids() {
        for k in 0..640 {
            assert_exact(&solid, &lcg.pose(25.0), &odd_triangle(&mut lcg, k));
        }
    }
}

#[test]
fn parallel_and_coplanar_triangles_are_exact() {
    let mut lcg = Random(32);
    for solid in sample_solids() {
        let aabb = solid.dilated(-solid.rounding()).aabb();
        for k in 0..200 {
            // Level with an end, just beyond it, or through the middle, from tiny to larger than
            // the body.
            let level = [aabb.min.z, aabb.max.z, aabb.min.z - 1e-7, aabb.max.z + 0.3, aabb.center().z][k % 5];
            let reach = [0.5, 5.0, 60.0][k % 3];
            let corner = |lcg: &mut Random| Point3::new(lcg.between(-reach, reach), lcg.between(-reach, reach), level);
            let corners = [corner(&mut lcg), corner(&mut lcg), corner(&mut lcg)];
            assert_exact(&solid, &Isometry3::identity(), &corners);
            let pose = lcg.pose(25.0);
            assert_exact(&solid, &pose, &corners.map(|p| pose * p));
        }
    }
}

#[test]
fn needles_through_the_body_meet_it() {
    let mut lcg = Random(33);
    for solid in sample_solids() {
        for _ in 0..40 {
            let pose = lcg.pose(20.0);
            let inside = pose * solid.interior_point();
            let (u, v) = (lcg.direction().into_inner() * 80.0, lcg.direction().into_inner() * 1e-6);
            let found = nearest(&solid, &pose, &[inside - u, inside + u + v, inside + u - v], ALL).unwrap();
            assert!(found.distance <= 1e-6, "{solid:?}: {}", found.distance);
        }
    }
}
