use crate::section::quadrature::*;

#[test]
fn powers_are_integrated_exactly() {
    for power in 0..=22 {
        let (area, _) = rules(&|x: f64| x.powi(power), 0.0, 2.0);
        let exact = 2f64.powi(power + 1) / f64::from(power + 1);
        assert!((area - exact).abs() < 1e-14 * exact, "{power}: {area}, {exact}");
        if power <= 13 {
            assert!(rules(&|x: f64| x.powi(power), 0.0, 2.0).1 < 1e-13 * exact, "{power}");
        }
    }
}

#[test]
fn the_error_covers_kinks_steps_and_roots() {
    let cases: [(&dyn Fn(f64) -> f64, f64); 4] = [
        (&|x| (x - 0.3).abs(), 0.29),
        (&|x| f64::from(u8::from(x > 0.7123)), 0.2877),
        (&|x| (x - 0.21).max(0.0).sqrt(), 2.0 / 3.0 * 0.79f64.powf(1.5)),
        (&|x| x.exp(), 1f64.exp() - 1.0),
    ];
    for (i, (f, exact)) in cases.into_iter().enumerate() {
        for accuracy in [1e-4, 1e-7, 1e-10] {
            let (area, error) = integral(f, &[0.0, 0.21, 1.0], accuracy);
            assert!(error <= accuracy, "case {i}: {error}");
            assert!((area - exact).abs() <= error + 1e-15, "case {i}: {area}, {exact}, {error}");
        }
    }
}
