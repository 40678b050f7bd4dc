use crate::section::elliptic::*;
use std::f64::consts::FRAC_PI_2;

#[test]
fn arc_is_the_length_of_the_polygon() {
    for s in [0.0, 1e-6, 0.02, 0.3, 0.9, 1.0] {
        for end in [-FRAC_PI_2, -1.2, -0.01, 0.3, 1.0, 1.5] {
            // Gauss's two points in each of many parts: ∫√(cos² + s²·sin²).
            let n = 20_000;
            let h = end / f64::from(n);
            let speed = |t: f64| t.cos().hypot(s * t.sin());
            let gauss = 0.5 / 3f64.sqrt();
            let length: f64 = (0..n)
                .map(|i| (f64::from(i) + 0.5) * h)
                .map(|t| 0.5 * h * (speed(t - gauss * h) + speed(t + gauss * h)))
                .sum();
            let (sin, cos) = end.sin_cos();
            assert!((ellipse_arc(sin, cos.max(0.0), s) - length).abs() < 1e-11, "{s} {end}");
        }
    }
}

#[test]
fn arc_of_a_circle_is_the_angle_and_of_a_flat_ellipse_the_sine() {
    for t in [-1.5, -0.4, 1e-9, 0.8] {
        let (sin, cos) = f64::sin_cos(t);
        assert!((ellipse_arc(sin, cos, 1.0) - t).abs() < 4e-16 * (1.0 + t.abs()));
        assert!((ellipse_arc(sin, cos, 0.0) - sin).abs() < 4e-16);
    }
    assert_eq!(ellipse_arc(1.0, 0.0, 0.0), 1.0);
}
