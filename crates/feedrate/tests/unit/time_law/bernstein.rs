use super::*;

#[test]
fn bounds_hold_and_are_tight() {
    let mut state = facemill_test_kit::Random(1);
    let mut random = || state.unit() - 0.5;
    for _ in 0..300 {
        let powers: Vec<f64> = (0..7).map(|_| random()).collect();
        let other: Vec<f64> = (0..3).map(|_| random()).collect();
        let b = Bernstein::from_powers(&powers);
        let product = b.times(&b).times(&Bernstein::from_powers(&other));
        let at = |c: &[f64], s: f64| c.iter().rev().fold(0.0, |sum, c| sum * s + c);
        let sampled = (0..=4000)
            .map(|k| f64::from(k) / 4000.0)
            .map(|s| at(&powers, s).powi(2) * at(&other, s))
            .fold(f64::NEG_INFINITY, f64::max);
        let bound = product.upper_bound(f64::NEG_INFINITY, 1e-6);
        assert!(bound >= sampled - 1e-14, "{bound} {sampled}");
        assert!(bound <= sampled + 1e-5 * sampled.abs() + 1e-6, "{bound} {sampled}");
    }
}
