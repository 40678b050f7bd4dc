use super::*;
use crate::contact::cl_from_cc;
use crate::silhouette::{SilhouetteCurvature, silhouette_curvature};
use facemill_cl_data::CcPoint;
use nalgebra::Point3;

const CUTTERS: [(f64, f64, f64); 4] = [(25.0, 2.0, 50.0), (80.0, 6.0, 6.0), (10.0, 0.0, 5.0), (8.0, 8.0, 12.0)];
const TILTS: [f64; 6] = [0.0, 1e-7, 0.01, 0.05, 0.26, 1.0];
const ROTATES: [f64; 7] = [0.0, -0.3, -1.0, -1.4835, 0.7, 2.0, std::f64::consts::PI];

fn cases() -> impl Iterator<Item = (Cutter, Posture)> {
    CUTTERS.into_iter().flat_map(|(radius, corner, flute)| {
        let cutter = Cutter::new(radius, corner, flute).unwrap();
        TILTS
            .into_iter()
            .flat_map(move |tilt| ROTATES.into_iter().map(move |rotate| (cutter, Posture { tilt, rotate })))
    })
}

/// Points of the cutter's surface for the contact in the origin, N = z.
fn surface_points(cutter: &Cutter, posture: Posture, feed: Vector3<f64>, n: u32) -> Vec<Point3<f64>> {
    let cc = CcPoint::new(Point3::origin(), Vector3::z(), feed).unwrap();
    let cl = cl_from_cc(cutter, &cc, posture);
    let u = cl.axis.cross(&Vector3::new(0.3, 0.9, 0.2)).normalize();
    let v = cl.axis.cross(&u);
    let mut points = Vec::new();
    for i in 0..n {
        let (sin, cos) = (f64::from(i) / f64::from(n) * std::f64::consts::TAU).sin_cos();
        let out = u * cos + v * sin;
        for k in 0..=n / 8 {
            let (s, c) = (f64::from(k) / f64::from(n / 8) * FRAC_PI_2).sin_cos();
            let r = cutter.corner_radius();
            let (radial, z) = (cutter.rim_radius() + r * s, r - r * c);
            points.push(cl.tip + out * radial + cl.axis.into_inner() * z);
        }
        points.push(cl.tip + out * cutter.radius() + cl.axis.into_inner() * cutter.flute_length());
    }
    points
}

#[test]
fn outline_is_the_hull_of_the_sampled_cutter() {
    for (cutter, posture) in cases() {
        let outline = Outline::new(&cutter, posture);
        let points = surface_points(&cutter, posture, Vector3::x(), 480);
        // Nothing is below the outline, and in every direction of the lower half something comes
        // near it.
        for p in points.iter().step_by(7) {
            if let Some(z) = outline.height_at(p.y) {
                let vertical = p.y - outline.extent().0 < 1e-6 || outline.extent().1 - p.y < 1e-6;
                assert!(vertical || p.z >= z - 1e-9, "{cutter:?} {posture:?}: {p} is below {z}");
            } else {
                let (low, high) = outline.extent();
                assert!((low - p.y).max(p.y - high) < 1e-9, "{cutter:?} {posture:?}: {p} outside");
            }
        }
        for k in -30..=30 {
            let phi = f64::from(k) / 30.0 * FRAC_PI_2;
            let (sin, cos) = phi.sin_cos();
            let reach = points.iter().map(|p| p.y * sin - p.z * cos).fold(f64::NEG_INFINITY, f64::max);
            let q = outline.point_at(phi);
            let exact = q.x * sin - q.y * cos;
            // Chord error of the sampling: R·(1 − cos(π/480)) and r·(1 − cos(π/240)).
            assert!(reach <= exact + 1e-9, "{cutter:?} {posture:?} {phi}: {reach} beyond {exact}");
            assert!(reach >= exact - 1e-4 * cutter.radius(), "{cutter:?} {posture:?} {phi}: {reach} of {exact}");
        }
    }
}

#[test]
fn tip_and_axis_are_those_of_the_cl_point() {
    for (cutter, posture) in cases() {
        let cc = CcPoint::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
        let (cl, outline) = (cl_from_cc(&cutter, &cc, posture), Outline::new(&cutter, posture));
        assert!((outline.axis() - cl.axis.into_inner()).norm() < 1e-14, "{cutter:?} {posture:?}");
        let apart = (outline.tip().x - cl.tip.y).abs().max((outline.tip().y - cl.tip.z).abs());
        assert!(apart < 1e-12 * cutter.radius(), "{cutter:?} {posture:?}: {apart}");
    }
}

#[test]
fn height_at_inverts_the_parametric_form() {
    for (cutter, posture) in cases() {
        let outline = Outline::new(&cutter, posture);
        for k in -299..300 {
            let phi = f64::from(k) / 300.0 * FRAC_PI_2;
            let p = outline.point_at(phi);
            let z = outline.height_at(p.x).unwrap();
            // By convexity the height lies on or above the tangent, and not above a point of the
            // outline.
            let slack = 1e-11 * cutter.radius() * (1.0 + phi.tan().abs());
            assert!((z - p.y).abs() <= slack, "{cutter:?} {posture:?} {phi}: {z} for {}", p.y);
        }
        let (low, high) = outline.extent();
        assert_eq!(outline.height_at(low - 1e-6), None);
        assert_eq!(outline.height_at(high + 1e-6), None);
        assert_eq!(outline.height_at(f64::NAN), None);
    }
}

#[test]
fn outline_touches_the_contact_from_above() {
    for (cutter, posture) in cases() {
        let outline = Outline::new(&cutter, posture);
        let (low, high) = outline.extent();
        let at_contact = outline.height_at(0.0).unwrap_or(0.0);
        assert!(at_contact.abs() < 1e-9, "{cutter:?} {posture:?}: {at_contact}");
        for k in 0..=100 {
            let y = low + (high - low) * f64::from(k) / 100.0;
            assert!(outline.height_at(y).is_none_or(|z| z >= -1e-11 * cutter.radius()));
        }
    }
}

#[test]
fn curvature_at_the_contact_is_the_silhouette_curvature() {
    let mut n_round = 0;
    for (cutter, posture) in cases() {
        let SilhouetteCurvature::Round(k) = silhouette_curvature(&cutter, posture) else { continue };
        let outline = Outline::new(&cutter, posture);
        // Divided difference of the turn of the normal over the arc length, from the parametric
        // form alone.
        let h = 1e-5 * posture.tilt.min(1.0) + 1e-9 * f64::from(u8::from(posture.tilt == 0.0));
        let arc = (outline.point_at(h) - outline.point_at(-h)).norm();
        let measured = 2.0 * h / arc;
        if arc > 1e-7 {
            assert!((measured / k - 1.0).abs() < 1e-4, "{cutter:?} {posture:?}: {measured} for {k}");
            n_round += 1;
        }
    }
    assert!(n_round > 50, "{n_round}");
}

#[test]
fn curvature_is_that_of_a_sampled_silhouette() {
    // Independent of the outline: radius of curvature h + h'' of the samples' support function h
    // seen along the feed.
    let cutter = Cutter::new(25.0, 2.0, 20.0).unwrap();
    for (tilt, rotate) in [(0.05, 0.0), (0.1, -0.5), (0.2, -1.2)] {
        let posture = Posture { tilt, rotate };
        let points = surface_points(&cutter, posture, Vector3::x(), 6000);
        let support = |phi: f64| {
            let (sin, cos) = phi.sin_cos();
            points.iter().map(|p| p.y * sin - p.z * cos).fold(f64::NEG_INFINITY, f64::max)
        };
        let step = 0.1 * tilt;
        let radius = support(0.0) + (support(step) + support(-step) - 2.0 * support(0.0)) / (step * step);
        let exact = silhouette_curvature(&cutter, posture).radius();
        // The second difference is off by its step squared, the samples by less.
        assert!((radius / exact - 1.0).abs() < 0.03, "{posture:?}: {radius} for {exact}");
    }
}

#[test]
fn degenerate_curvatures_are_named() {
    let at = |radius: f64, corner: f64, tilt: f64, rotate: f64| {
        silhouette_curvature(&Cutter::new(radius, corner, 20.0).unwrap(), Posture { tilt, rotate })
    };
    assert_eq!(at(10.0, 2.0, 0.0, 0.0), SilhouetteCurvature::Flat);
    assert_eq!(at(10.0, 0.0, 0.1, -FRAC_PI_2), SilhouetteCurvature::Sharp);
    assert_eq!(at(10.0, 10.0, 0.0, 0.0), SilhouetteCurvature::Round(0.1));
    let SilhouetteCurvature::Round(k) = at(10.0, 0.0, 0.1, 0.0) else { panic!() };
    assert!((k - 0.1f64.sin() / 10.0).abs() < 1e-15);
    let SilhouetteCurvature::Round(k) = at(10.0, 2.0, 0.1, -FRAC_PI_2) else { panic!() };
    assert!((k - 0.5).abs() < 1e-15);
}

#[test]
fn turned_frame_sees_the_same_outline() {
    for (cutter, posture) in cases().step_by(5) {
        let outline = Outline::new(&cutter, posture);
        let (origin, turn) = (Point2::new(0.7, -0.2), 0.05);
        let seen = outline.seen_from(origin, turn);
        let (sin, cos) = turn.sin_cos();
        for k in -20..=20 {
            let phi = f64::from(k) / 20.0;
            let p = outline.point_at(phi) - origin;
            let q = seen.point_at(phi - turn);
            let edge_on = outline.axis_along == 0.0;
            let moved = Point2::new(cos * p.x + sin * p.y, cos * p.y - sin * p.x);
            assert!(edge_on || (moved - q).norm() < 1e-6, "{cutter:?} {posture:?} {phi}: {moved} {q}");
        }
    }
}

#[test]
fn opposite_feed_shows_the_mirrored_outline() {
    for (cutter, posture) in cases().filter(|(_, p)| p.tilt >= 0.01) {
        let outline = Outline::new(&cutter, posture).mirrored();
        let points = surface_points(&cutter, posture, -Vector3::x(), 240);
        for k in -10..=10 {
            let (sin, cos) = (0.15 * f64::from(k)).sin_cos();
            let reach = points.iter().map(|p| p.y * sin - p.z * cos).fold(f64::NEG_INFINITY, f64::max);
            let q = outline.point_at(0.15 * f64::from(k));
            let missed = q.x * sin - q.y * cos - reach;
            assert!(missed > -1e-9 && missed < 4e-4 * cutter.radius(), "{cutter:?} {posture:?} {k}: {missed}");
        }
        assert_eq!(outline.mirrored(), Outline::new(&cutter, posture));
    }
}
