use crate::passes::band::*;

/// Returns the energy that the smoothed sequence minimises, by its definition.
fn energy(times: &[f64], targets: &[f64], weights: &[f64], tau: f64, y: &[f64]) -> f64 {
    let near: f64 = (0..y.len()).map(|k| weights[k] * (y[k] - targets[k]).powi(2)).sum();
    let bend = |k: usize| {
        let (before, after) = (times[k] - times[k - 1], times[k + 1] - times[k]);
        let second = ((y[k + 1] - y[k]) / after - (y[k] - y[k - 1]) / before) / (0.5 * (before + after));
        0.5 * (before + after) * second * second
    };
    near + tau.powi(4) * (1..y.len() - 1).map(bend).sum::<f64>()
}

fn uneven(n: usize, seed: u64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let mut random = facemill_test_kit::Random(seed);
    let mut next = || random.unit();
    let mut time = 0.0;
    let times = (0..n)
        .map(|_| {
            time += 0.05 + next();
            time
        })
        .collect();
    (times, (0..n).map(|_| next() - 0.5).collect(), (0..n).map(|_| 0.1 + next()).collect())
}

#[test]
fn no_change_of_one_number_makes_the_energy_smaller() {
    for seed in 1..20 {
        let n = 3 + seed as usize * 4;
        let (times, targets, weights) = uneven(n, seed);
        for tau in [0.05, 0.7, 4.0] {
            let y = smoothed(&times, &targets, &weights, tau);
            let least = energy(&times, &targets, &weights, tau, &y);
            for k in 0..n {
                for change in [-1e-4, 1e-4] {
                    let mut other = y.clone();
                    other[k] += change;
                    let more = energy(&times, &targets, &weights, tau, &other);
                    assert!(more > least, "seed {seed} tau {tau} at {k}: {more} {least}");
                }
            }
        }
    }
}

#[test]
fn a_line_stays_and_a_jump_is_spread() {
    let (times, _, weights) = uneven(40, 9);
    let line: Vec<f64> = times.iter().map(|t| 3.0 - 0.25 * t).collect();
    for (y, expected) in smoothed(&times, &line, &weights, 3.0).iter().zip(&line) {
        assert!((y - expected).abs() < 1e-9, "{y} {expected}");
    }
    let jump: Vec<f64> = (0..40).map(|k| if k < 20 { 0.0 } else { 1.0 }).collect();
    let largest_step = |y: &[f64]| y.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
    assert!(largest_step(&smoothed(&times, &jump, &weights, 3.0)) < 0.3);
}
