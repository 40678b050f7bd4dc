use super::*;
use crate::cutter::Cutter;
use facemill_cl_data::Posture;

fn outline(radius: f64, corner: f64, tilt_deg: f64, rotate_deg: f64) -> Outline {
    let posture = Posture { tilt: f64::to_radians(tilt_deg), rotate: f64::to_radians(rotate_deg) };
    Outline::new(&Cutter::new(radius, corner, 40.0f64.max(radius)).unwrap(), posture)
}

fn height(cusp: Cusp) -> f64 {
    match cusp {
        Cusp::Height(h) => h,
        Cusp::Uncut => panic!("uncut"),
    }
}

#[test]
fn ball_cusp_on_plane_and_cylinders_is_the_closed_form() {
    let ball = outline(10.0, 10.0, 7.0, 20.0);
    for step in [0.1, 1.0, 6.0, 15.0] {
        let plane = 10.0 - (100.0f64 - 0.25 * step * step).sqrt();
        assert!((height(cusp_height_between(&ball, &ball, step, 0.0)) - plane).abs() < 1e-9);
        for radius in [30.0, -60.0, 1e7] {
            // Ball centres on the circle of radius rho + 10 about the section's centre, at half the
            // angle each.
            let (angle, centre) = (0.5 * step / radius, radius + 10.0);
            let across = centre * f64::sin(angle);
            let expected = centre * f64::cos(angle) - (100.0 - across * across).sqrt() - radius;
            let cusp = height(cusp_height_between(&ball, &ball, step, 1.0 / radius));
            // The closed form itself loses digits on the huge radius.
            let slack = 1e-9 + 1e-15 * f64::abs(radius);
            assert!((cusp - expected).abs() < slack, "{radius} {step}: {cusp} for {expected}");
        }
    }
}

#[test]
fn sharp_face_mill_cuts_the_ellipse_its_rim_is_seen_as() {
    let mill = outline(80.0, 0.0, 3.0, 0.0);
    for step in [1.0, 20.0, 40.0, 100.0] {
        let expected = 80.0 * 3f64.to_radians().sin() * (1.0 - (1.0 - (step / 160.0f64).powi(2)).sqrt());
        let cusp = height(cusp_height_between(&mill, &mill, step, 0.0));
        assert!((cusp - expected).abs() < 1e-9, "{step}: {cusp} for {expected}");
    }
}

/// Highest point above the plane or circle that neither outline clears, by dense sampling.
fn sampled_ridge(a: &Outline, b: &Outline, step: f64, curvature: f64) -> f64 {
    let section = CircularSection { right: a, left: b, step, curvature };
    let n = 20_000;
    (0..=n).map(|k| section.heights(step * f64::from(k) / f64::from(n))).map(|(p, q)| p.min(q)).fold(0.0, f64::max)
}

#[test]
fn ridge_is_the_highest_uncleared_point_of_a_dense_sampling() {
    let (a, b) = (outline(25.0, 2.0, 2.0, 0.0), outline(25.0, 2.0, 9.0, -40.0));
    let c = outline(25.0, 0.0, 5.0, 89.9);
    for (p, q) in [(&a, &b), (&b, &a), (&a, &a), (&c, &a), (&a, &c.mirrored()), (&c, &c)] {
        for (step, curvature) in [(3.0, 0.0), (12.0, 0.002), (20.0, -0.001)] {
            let exact = cusp_height_between(p, q, step, curvature);
            let sampled = sampled_ridge(p, q, step, curvature);
            if let Cusp::Height(h) = exact {
                assert!(h >= sampled - 1e-9, "{step} {curvature}: {h} below {sampled}");
                assert!(h <= sampled + 0.01 * step, "{step} {curvature}: {h} above {sampled}");
            } else {
                assert!(sampled.is_infinite());
            }
        }
    }
}

#[test]
fn passes_too_far_apart_leave_a_strip() {
    let mill = outline(25.0, 2.0, 2.0, 0.0);
    assert_eq!(cusp_height_between(&mill, &mill, 51.0, 0.0), Cusp::Uncut);
    assert_eq!(cusp_height_between(&mill, &mill, f64::NAN, 0.0), Cusp::Uncut);
    assert_eq!(cusp_height_between(&mill, &mill, -1.0, 0.0), Cusp::Uncut);
    assert_eq!(height(cusp_height_between(&mill, &mill, 0.0, 0.0)), 0.0);
}

#[test]
fn untilted_mill_leaves_no_ridge_on_a_plane() {
    let flat = outline(25.0, 2.0, 0.0, 0.0);
    assert!(height(cusp_height_between(&flat, &flat, 30.0, 0.0)) < 1e-12);
}

#[test]
fn step_over_meets_its_cusp() {
    let mill = outline(80.0, 6.0, 2.0, 0.0);
    let step = step_over_for_cusp(&mill, &mill, 0.1, 0.0005, 120.0);
    assert!(step > 10.0 && step < 120.0);
    assert!(cusp_height_between(&mill, &mill, step, 0.0005).is_within(0.1));
    assert!(!cusp_height_between(&mill, &mill, step + 2e-4, 0.0005).is_within(0.1));
    assert_eq!(step_over_for_cusp(&mill, &mill, 0.1, 0.0, 5.0), 5.0);
}
