//! Smoothing of a sequence of numbers over time.

/// Returns the sequence y that minimises `Σ weightₖ·(yₖ − targetₖ)² + τ⁴·Σ hₖ·y″ₖ²`, with y″ its
/// second differences over the times and hₖ the time that each represents: the targets without
/// changes faster than τ.
///
/// Times ascend strictly, weights are above 0; all slices are equally long. Straight sequences (up
/// to two targets, or targets on a line) come back as they are. Linear cost: the normal equations
/// are positive definite with five diagonals.
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
#[path = "../../tests/unit/passes/band.rs"]
mod tests;
