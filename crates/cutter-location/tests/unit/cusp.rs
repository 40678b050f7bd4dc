use super::*;
use crate::search::bezier::SearchOrder;
use nalgebra::{Matrix3, Point3, Unit, Vector3};

fn point(x: f64, y: f64, tilt: f64) -> CutPoint {
    let cc = CcPoint::new(Point3::new(x, y, 0.0), Vector3::z(), Vector3::x()).unwrap();
    CutPoint { cc, posture: Posture { tilt, rotate: 0.0 } }
}

#[test]
fn ridge_of_a_tilted_disc_on_a_plane_is_that_of_its_ellipse() {
    let cutter = Cutter::new(80.0, 0.0, 10.0).unwrap();
    let tilt = 2f64.to_radians();
    let line = |y: f64| (0..20).map(|k| point(5.0 * f64::from(k), y, tilt)).collect::<Vec<_>>();
    let found = ridges(&cutter, &line(40.0)[2..18], &line(0.0), 60.0);
    // Height of the rim at y = 20: R·sin α·(1 − cos t) with sin t = 20/80.
    let expected = 80.0 * tilt.sin() * (1.0 - (1.0f64 - (20.0f64 / 80.0).powi(2)).sqrt());
    for r in found {
        let r = r.expect("the neighbour is within reach");
        assert!((r.step_over - 40.0).abs() < 1e-9);
        let Cusp::Height(h) = r.cusp else { panic!("the strip is cut") };
        assert!((h - expected).abs() < 1e-7, "{h} {expected}");
    }
}

#[test]
fn a_neighbour_beyond_reach_is_none() {
    let cutter = Cutter::new(80.0, 6.0, 10.0).unwrap();
    let line = |y: f64| (0..5).map(|k| point(5.0 * f64::from(k), y, 0.05)).collect::<Vec<_>>();
    assert!(ridges(&cutter, &line(100.0), &line(0.0), 60.0).iter().all(Option::is_none));
}

#[test]
fn expected_posture_clears_a_concave_cylinder_along_the_feed() {
    // Radius 500 along the feed: the rear rim of a disc of radius 80 at tilt α clears it for tan α
    // ≥ 80/500 about.
    let cutter = Cutter::new(80.0, 0.0, 10.0).unwrap();
    let cc = CcPoint::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let tensor = CurvatureTensor {
        normal: Unit::new_normalize(Vector3::z()),
        tensor: Matrix3::from_diagonal(&Vector3::new(-1.0 / 500.0, 0.0, 0.0)),
    };
    let deg = |t: f64| Posture { tilt: t.to_radians(), rotate: 0.0 };
    let curve = SearchCurve::new(deg(0.0), deg(20.0), SearchOrder::TiltFirst, 1.0).unwrap();
    let tilt = expected_posture(&cutter, &cc, Some(&tensor), &curve).tilt;
    let closed_form = (80.0f64 / 500.0).atan();
    assert!(tilt >= closed_form - 0.01 && tilt < closed_form + 0.03, "{tilt} {closed_form}");
}
