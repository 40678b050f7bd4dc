use crate::solver::trig_roots::*;

/// Returns Π over the roots of sin((φ − root)/2), an even number of them.
fn samples_of(roots: &[f64], factor: impl Fn(f64) -> f64) -> [f64; SAMPLES] {
    std::array::from_fn(|k| {
        let at = sample_angle(k);
        factor(at) * roots.iter().map(|r| (0.5 * (at - r)).sin()).product::<f64>()
    })
}

fn apart(a: f64, b: f64) -> f64 {
    (0.5 * (a - b)).sin().abs() * 2.0
}

fn noise(samples: &[f64; SAMPLES]) -> f64 {
    1e-14 * samples.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
}

#[test]
fn simple_roots_are_found_and_nothing_else() {
    let mut seed = facemill_test_kit::Random(1);
    let mut random = || seed.unit();
    for round in 0..2000 {
        let n = 2 * (round % 7);
        let roots: Vec<f64> = (0..n).map(|k| TAU * (k as f64 + 0.8 * random()) / n as f64).collect();
        // A factor without roots where there is room for one.
        let shift = TAU * random();
        let positive = |at: f64| if n <= 2 * DEGREE - 2 { 1.05 + (at - shift).cos() } else { 1.0 };
        let samples = samples_of(&roots, positive);
        let found = real_roots(&samples, noise(&samples));
        assert!(!found.cut_off);
        assert_eq!(found.as_slice().len(), roots.len(), "{roots:?} {found:?}");
        for r in &roots {
            let nearest = found.as_slice().iter().map(|f| apart(*f, *r)).fold(9.0, f64::min);
            assert!(nearest < 1e-7, "{r} of {roots:?}: {nearest:e}");
        }
    }
}

#[test]
fn double_roots_and_near_ones_and_near_misses_are_found() {
    for at in [0.0, 0.3, std::f64::consts::PI / 7.0, 1.1, 3.0, 5.5] {
        for gap in [0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3] {
            let roots = [at, at + gap, at + 1.3, at + 2.9];
            let samples = samples_of(&roots, |_| 1.0);
            let found = real_roots(&samples, noise(&samples));
            assert!(!found.cut_off);
            for r in roots {
                let nearest = found.as_slice().iter().map(|f| apart(*f, r)).fold(9.0, f64::min);
                assert!(nearest < 2e-6, "{r}: {nearest:e} {found:?}");
            }
        }
        // No root at all, but nearer than the rounding can resolve.
        let samples = samples_of(&[at + 1.3, at + 2.9], |x| 1.0 + 1e-15 - (x - at).cos());
        let found = real_roots(&samples, noise(&samples));
        assert!(found.as_slice().iter().any(|f| apart(*f, at) < 2e-6), "{at}");
    }
}

#[test]
fn zero_has_the_whole_circle_as_roots() {
    let found = real_roots(&[0.0; SAMPLES], 1e-300);
    let (low, high) = (found.as_slice()[0], found.as_slice()[4]);
    assert!((high - low - TAU).abs() < 1e-12 && found.as_slice().len() == 5);
}
