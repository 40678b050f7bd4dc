use super::*;

/// The frustum's distance by brute force over points of its (radial, z) outline.
fn outline_distance(f: &RoundFrustum, radial: f64, z: f64) -> f64 {
    let n = 4000;
    let corners = [(0.0, f.z_low), (f.radius_low, f.z_low), (f.radius_high, f.z_high), (0.0, f.z_high)];
    let mut best = f64::INFINITY;
    for pair in corners.windows(2) {
        for k in 0..=n {
            let t = f64::from(k) / f64::from(n);
            let (r, h) = (pair[0].0 + t * (pair[1].0 - pair[0].0), pair[0].1 + t * (pair[1].1 - pair[0].1));
            best = best.min((radial - r).hypot(z - h));
        }
    }
    best
}

#[test]
fn depth_within_is_the_distance_to_the_outline_and_the_negative_distance_outside() {
    for (low, high) in [(10.0, 10.0), (10.0, 3.0), (3.0, 10.0), (0.0, 0.0), (0.0, 8.0)] {
        let f = RoundFrustum { z_low: 1.0, z_high: 7.0, radius_low: low, radius_high: high, rounding: 0.5 };
        for i in 0..40 {
            for j in 0..40 {
                let (x, z) = (0.3 * f64::from(i), -3.0 + 0.3 * f64::from(j));
                let (d, to_outline) = (f.core_distance(&Point3::new(0.0, x, z)), outline_distance(&f, x, z));
                // Near the outline the spacing of its points dominates.
                if to_outline < 0.05 {
                    continue;
                }
                let expected = 0.5 + if d > 0.0 { -to_outline } else { to_outline };
                let depth = Solid::Frustum(f).depth(&Point3::new(0.0, x, z));
                assert!((depth - expected).abs() < 1e-4, "{f:?} at {x}, {z}: {depth} for {expected}");
            }
        }
    }
    let boxed = Solid::Box(RoundBox { half_extents: Vector3::new(3.0, 2.0, 1.0), rounding: 0.5 });
    assert_eq!(boxed.depth(&Point3::new(0.5, 0.5, -0.25)), 1.25);
    assert_eq!(boxed.depth(&Point3::new(-2.5, 0.0, 0.0)), 1.0);
    assert_eq!(boxed.depth(&Point3::new(6.0, -6.0, 0.0)), -4.5);
}

#[test]
fn core_distance_outside_is_the_distance_to_the_outline() {
    for (low, high) in [(10.0, 10.0), (10.0, 3.0), (3.0, 10.0), (0.0, 0.0), (0.0, 8.0)] {
        let f = RoundFrustum { z_low: 1.0, z_high: 7.0, radius_low: low, radius_high: high, rounding: 0.0 };
        for i in 0..40 {
            for j in 0..40 {
                let (x, z) = (0.5 * f64::from(i), -6.0 + 0.5 * f64::from(j));
                let d = f.core_distance(&Point3::new(x, 0.0, z));
                if d > 0.0 {
                    assert!((d - outline_distance(&f, x, z)).abs() < 1e-4, "{f:?} at {x}, {z}: {d}");
                }
            }
        }
    }
}
