//! Smoothing of a sequence of numbers over time.

/// The sequence y that makes `Σ weightₖ·(yₖ − targetₖ)² + τ⁴·Σ hₖ·y″ₖ²` smallest, y″ its second differences over the times
/// and hₖ the time that one stands for: the targets without what changes faster than τ.
///
/// Times ascend strictly, weights are above 0; all slices are equally long. Straight sequences (up to two targets, or targets
/// on a line) come back as they are. Linear cost: the normal equations are positive definite with five diagonals.
pub(crate) fn smoothed(times: &[f64], targets: &[f64], weights: &[f64], tau: f64) -> Vec<f64> {
    let n = times.len();
    if n < 3 {
        return targets.to_vec();
    }
    // Row k: entries at k, k + 1, k + 2.
    let mut rows = vec![[0.0; 3]; n];
    let mut right: Vec<f64> = weights.iter().zip(targets).map(|(w, t)| w * t).collect();
    for (row, weight) in rows.iter_mut().zip(weights) {
        row[0] = *weight;
    }
    let stiffness = tau.powi(4);
    for k in 1..n - 1 {
        let (before, after) = (times[k] - times[k - 1], times[k + 1] - times[k]);
        let span = 0.5 * (before + after);
        // y″ = c[0]·y(k−1) + c[1]·y(k) + c[2]·y(k+1)
        let c = [1.0 / (before * span), -(1.0 / before + 1.0 / after) / span, 1.0 / (after * span)];
        for i in 0..3 {
            for j in i..3 {
                rows[k - 1 + i][j - i] += stiffness * span * c[i] * c[j];
            }
        }
    }
    // LDLᵀ in place: rows[k][0] becomes Dₖ, the others the factors of the rows below.
    for k in 0..n {
        let [d, first, second] = rows[k];
        let (l1, l2) = (first / d, second / d);
        if k + 1 < n {
            rows[k + 1][0] -= l1 * first;
            rows[k + 1][1] -= l1 * second;
            right[k + 1] -= l1 * right[k];
        }
        if k + 2 < n {
            rows[k + 2][0] -= l2 * second;
            right[k + 2] -= l2 * right[k];
        }
        rows[k] = [d, l1, l2];
    }
    for k in (0..n).rev() {
        let ahead = |j: usize| if k + j < n { rows[k][j] * right[k + j] } else { 0.0 };
        right[k] = right[k] / rows[k][0] - ahead(1) - ahead(2);
    }
    right
}

#[cfg(test)]
mod tests {
    use crate::passes::band::*;

    /// What the smoothed sequence is to make smallest, by its definition.
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
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
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
}
