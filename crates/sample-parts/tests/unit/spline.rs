use super::*;

const KNOTS: [f64; 6] = [0.0, 0.3, 0.5, 1.1, 1.6, 2.0];

#[test]
fn a_cubic_is_reproduced_by_its_own_end_conditions() {
    let cubic = |x: f64| 1.0 - 2.0 * x + 0.5 * x * x - 0.7 * x.powi(3);
    let slope = |x: f64| -2.0 + x - 2.1 * x * x;
    let points = KNOTS.map(|x| (x, cubic(x)));
    for (start, end) in [
        (SplineEnd::NotAKnot, SplineEnd::NotAKnot),
        (SplineEnd::Slope(slope(0.0)), SplineEnd::Slope(slope(2.0))),
        (SplineEnd::Slope(slope(0.0)), SplineEnd::NotAKnot),
    ] {
        let spline = CubicSpline::new(points, start, end);
        for k in 0..=200 {
            let x = f64::from(k) * 0.01;
            assert!((spline.value(x) - cubic(x)).abs() < 1e-12, "{start:?} {end:?} at {x}");
        }
        assert!((spline.value(-0.5) - (cubic(0.0) - 0.5 * slope(0.0))).abs() < 1e-12);
        assert!((spline.value(2.5) - (cubic(2.0) + 0.5 * slope(2.0))).abs() < 1e-12);
    }
}

#[test]
fn two_derivatives_are_continuous_at_the_knots() {
    let values = [0.0, 1.0, -0.5, 0.2, 0.9, 0.1];
    let points = || KNOTS.into_iter().zip(values);
    for end in [SplineEnd::Natural, SplineEnd::NotAKnot, SplineEnd::Slope(0.4)] {
        let spline = CubicSpline::new(points(), end, end);
        let second =
            |x: f64, step: f64| (spline.value(x + step) - 2.0 * spline.value(x) + spline.value(x - step)) / step / step;
        let jump = |x: f64, step: f64| (second(x - step, step) - second(x + step, step)).abs();
        for (x, y) in points() {
            assert!((spline.value(x) - y).abs() < 1e-14);
        }
        // Across a knot the second derivative changes only as fast as the third lets it.
        for &x in &KNOTS[1..5] {
            assert!(jump(x, 1e-4) < 0.11 * jump(x, 1e-3) + 1e-6, "{end:?} at {x}");
        }
    }
}
