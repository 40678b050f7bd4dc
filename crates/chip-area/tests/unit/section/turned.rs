use crate::section::turned::*;

#[test]
fn roots_that_are_close_together_are_found_between_samples() {
    // Two roots a little apart in the middle of a sampling interval or at a sample, and one alone.
    for (low, high) in [(0.3101, 0.3109), (0.4999, 0.5001), (0.62, 0.81)] {
        for sign in [1.0, -1.0] {
            let f = |x: f64| sign * (x - low) * (x - high) * (x - 2.0);
            let samples: Vec<[f64; 2]> = (0..=10).map(|i| 0.1 * f64::from(i)).map(|x| [x, f(x)]).collect();
            let mut roots = Vec::new();
            roots_between(&samples, f, &mut roots);
            roots.sort_by(f64::total_cmp);
            roots.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
            assert_eq!(roots.len(), 2, "{low} {high}: {roots:?}");
            assert!((roots[0] - low).abs() < 1e-12 && (roots[1] - high).abs() < 1e-12, "{roots:?}");
        }
    }
    let mut none = Vec::new();
    roots_between(&[[0.0, 1.0], [0.5, 0.25], [1.0, 1.0]], |x| 3.0 * (x - 0.5).powi(2) + 0.25, &mut none);
    assert_eq!(none, []);
}
