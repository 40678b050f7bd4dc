use super::*;

fn sample(x: f64, y: f64, factor: f64) -> WidthSample {
    WidthSample { position: Point3::new(x, y, 0.0), normal: Vector3::z_axis(), factor }
}

#[test]
fn equal_factors_are_kept_between_samples_and_fade_to_one_at_the_end_of_the_reach() {
    let samples = (0..100).map(|k| sample(f64::from(k % 10) * 5.0, f64::from(k / 10) * 20.0, 0.7)).collect();
    let field = WidthField::new(samples, 30.0);
    let at = |x: f64, y: f64| field.at(&Point3::new(x, y, 0.0), &Vector3::z_axis());
    for k in 0..40 {
        let (x, y) = (1.1 * f64::from(k), 4.3 * f64::from(k));
        assert!((at(x, y) - 0.7).abs() < 0.01, "{x} {y}: {}", at(x, y));
    }
    assert_eq!(at(-31.0, 0.0), 1.0);
    let outward: Vec<f64> = (0..=30).map(|d| at(-f64::from(d), 90.0)).collect();
    assert!(outward.windows(2).all(|w| w[1] >= w[0] - 1e-12 && w[1] - w[0] < 0.15), "{outward:?}");
    assert_eq!(field.at(&Point3::new(20.0, 20.0, 0.0), &-Vector3::z_axis()), 1.0, "the other side of a thin wall");
}

#[test]
fn a_narrow_place_counts_more_than_the_wide_ones_around_it() {
    let mut samples: Vec<WidthSample> = (0..11).map(|k| sample(f64::from(k) * 5.0 - 25.0, 0.0, 1.0)).collect();
    samples[5].factor = 0.6;
    let narrow = WidthField::new(samples, 30.0).at(&Point3::origin(), &Vector3::z_axis());
    assert!((0.6..0.72).contains(&narrow), "{narrow}");
}
