use super::*;
use facemill_cl_data::Solid;
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

fn runner() -> TestRunner {
    let config = Config { cases: 2000, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, proptest::test_runner::TestRng::deterministic_rng(Default::default()))
}

fn vector() -> impl Strategy<Value = Vector3<f64>> {
    (-1.0..1.0, -1.0..1.0, -1.0..1.0).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

/// Tilts from zero and nearly zero to past half a right angle.
fn tilt() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), (-18.0..-1.0f64).prop_map(|e| 10f64.powf(e)), 0.0..1.2f64]
}

#[test]
fn cutter_touches_the_cc_point_with_the_surface_normal() {
    let cutter =
        prop_oneof![Just(0.0), Just(1.0), 0.0..1.0f64].prop_map(|share| Cutter::new(40.0, 40.0 * share, 60.0).unwrap());
    let case = (vector(), vector(), vector(), tilt(), -7.0..7.0f64, cutter);
    runner()
        .run(&case, |(p, normal, feed, tilt, rotate, cutter)| {
            let Ok(cc) = CcPoint::new(Point3::from(p * 300.0), normal, feed) else { return Ok(()) };
            let cl = cl_from_cc(&cutter, &cc, Posture { tilt, rotate });
            // The torus' core touches the ball of radius r that lies on the surface: its nearest
            // point is r above the contact along N, and the tangent plane is a supporting plane of
            // the cutter.
            let above = cc.position + cc.normal.into_inner() * cutter.corner_radius();
            let core = Solid::Frustum(cutter.core());
            let z = cl.axis.dot(&(above - cl.tip));
            let radial = (above - cl.tip - cl.axis.into_inner() * z).norm();
            prop_assert!(core.core_distance(&Point3::new(radial, 0.0, z)) < 1e-9);
            prop_assert!((radial - cutter.rim_radius()).abs() < 1e-9 && (z - cutter.corner_radius()).abs() < 1e-9);
            // Lowest height of the cutter over the tangent plane: that of the core's lower rim,
            // less r.
            let centre = (cl.tip - cc.position).dot(&cc.normal) + cutter.corner_radius() * tilt.cos();
            let lowest = centre - cutter.rim_radius() * tilt.sin() - cutter.corner_radius();
            prop_assert!(lowest.abs() < 1e-9, "tangent plane missed by {lowest}");
            prop_assert!((cl.axis.dot(&cc.normal) - tilt.cos()).abs() < 1e-12);
            Ok(())
        })
        .unwrap();
}

#[test]
fn sharp_cutter_meets_the_printed_formula() {
    runner()
        .run(&(vector(), vector(), 1e-3..1.5f64, -2.0..2.0f64), |(normal, feed, tilt, rotate)| {
            let Ok(cc) = CcPoint::new(Point3::new(3.0, 2.0, 1.0), normal, feed) else { return Ok(()) };
            let cl = cl_from_cc(&Cutter::new(25.0, 0.0, 9.0).unwrap(), &cc, Posture { tilt, rotate });
            // CLOPT (2) as printed.
            let across = cl.axis.cross(&cc.normal);
            let printed = cc.position + across.cross(&cl.axis) * (25.0 / across.norm());
            prop_assert!((printed - cl.tip).norm() < 1e-9);
            Ok(())
        })
        .unwrap();
}

#[test]
fn flat_limit_is_reached_continuously() {
    let cc = CcPoint::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let cutter = Cutter::new(25.0, 2.0, 9.0).unwrap();
    let flat = cl_from_cc(&cutter, &cc, Posture { tilt: 0.0, rotate: 0.3 });
    assert!((flat.tip - Point3::new(-23.0 * 0.3f64.cos(), -23.0 * 0.3f64.sin(), 0.0)).norm() < 1e-14);
    for exponent in 1..300 {
        let tilt = 10f64.powi(-exponent);
        let near = cl_from_cc(&cutter, &cc, Posture { tilt, rotate: 0.3 });
        assert!((near.tip - flat.tip).norm() <= 30.0 * tilt + 1e-14);
    }
}

#[test]
fn negative_tilt_is_the_positive_one_turned_by_half_a_turn() {
    let cc = CcPoint::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let cutter = Cutter::new(25.0, 2.0, 9.0).unwrap();
    let back = cl_from_cc(&cutter, &cc, Posture { tilt: -0.1, rotate: 0.3 });
    assert!((back.axis.into_inner() - cc.tool_axis(Posture { tilt: -0.1, rotate: 0.3 }).into_inner()).norm() < 1e-15);
    assert!(back.tip.x > 20.0);
}
