//! Smoothest values within given tolerances.

/// Number of points in a third difference: one more than its order.
const POINTS: usize = 4;

/// Squared weight of a value's deviation against its third difference, where nothing else fixes it:
/// waves longer than some 60 points stay as they are. Smaller evens out longer waves and takes more
/// passes to return to the values; larger keeps steps that extend over many points.
const LOOSE: f64 = 1e-6;

/// The same for known values. They are reset exactly after the last pass.
const HELD: f64 = 1e6;

/// Largest number of passes. A value then still beyond its width is cut off there, which leaves
/// small bends.
const PASSES: usize = 40;

/// Fraction of its width from which on a value is held more, to save passes.
const NEARLY: f64 = 0.95;

/// Largest factor by which the hold on a value grows from one pass to the next.
const FIRMER: f64 = 1e3;

/// Returns values, each within its width of the given one, whose third differences over `at` are
/// small: an estimate of a smooth motion before its values were rounded. Widths of 0 keep values to
/// the last bit.
///
/// It minimises the squares of each value's deviation from the parabola through its neighbours;
/// values beyond their widths are held more from pass to pass, and at last cut off at them. It
/// guarantees that no value leaves its width, but not that none are smoother. Where values on
/// parabolas lie within the widths, they are nearly found; a bend that the widths do not hide
/// stays. Linear cost.
///
/// `at` ascends strictly, and all slices are equally long. Fewer than four values are returned
/// unchanged, as are those whose third differences do not become smaller.
///
/// # Panics
/// When the slices differ in length.
///
/// ```
/// use facemill_feedrate::smoothest_within;
///
/// let at: Vec<f64> = (0..40).map(f64::from).collect();
/// let slope: Vec<f64> = at.iter().map(|x| 0.037 * x).collect();
/// let rounded: Vec<f64> = slope.iter().map(|y| (10.0 * y).round() / 10.0).collect();
/// let mut widths = vec![0.05; 40];
/// (widths[0], widths[39]) = (0.0, 0.0);
/// let smooth = smoothest_within(&at, &rounded, &widths);
/// let step = |y: &[f64]| y.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).fold(0.0, f64::max);
/// assert!(step(&rounded) > 0.09 && step(&smooth) < 0.01);
/// ```
#[must_use]
pub fn smoothest_within(at: &[f64], values: &[f64], widths: &[f64]) -> Vec<f64> {
    let n = values.len();
    assert!(at.len() == n && widths.len() == n, "{} places, {n} values, {} widths", at.len(), widths.len());
    if n < POINTS || widths.iter().all(|w| *w <= 0.0) {
        return values.to_vec();
    }
    let (band, right) = normal_equations(at, values);
    let mut holds: Vec<f64> = widths.iter().map(|w| if *w > 0.0 { LOOSE } else { HELD }).collect();
    let mut moved = Vec::new();
    for _ in 0..PASSES {
        moved = solved(&band, &holds, &right);
        if !hold_more(&mut holds, &moved, widths) {
            break;
        }
    }
    let within = |k: usize| if widths[k] > 0.0 { values[k] + moved[k].clamp(-widths[k], widths[k]) } else { values[k] };
    let smooth: Vec<f64> = (0..n).map(within).collect();
    if roughness(at, &smooth) < roughness(at, values) { smooth } else { values.to_vec() }
}

/// Returns the weights of four values in their third difference, scaled such that their absolute
/// values sum up to 8, as those of 1, 3, 3 and 1 do.
fn third_difference(at: &[f64]) -> [f64; POINTS] {
    let weight = |j: usize| (0..POINTS).filter(|&m| m != j).map(|m| 1.0 / (at[j] - at[m])).product::<f64>();
    let weights: [f64; POINTS] = std::array::from_fn(weight);
    let sum: f64 = weights.iter().map(|w| w.abs()).sum();
    weights.map(|w| 8.0 * w / sum)
}

/// Returns the sum of the squares of all third differences.
fn roughness(at: &[f64], values: &[f64]) -> f64 {
    let each = at.windows(POINTS).zip(values.windows(POINTS));
    each.map(|(at, v)| third_difference(at).iter().zip(v).map(|(w, v)| w * v).sum::<f64>().powi(2)).sum()
}

/// Returns matrix and right side whose solution is the change of the values for the least
/// roughness: row k has the entries at k to k + 3, those before are the same.
fn normal_equations(at: &[f64], values: &[f64]) -> (Vec<[f64; POINTS]>, Vec<f64>) {
    let n = values.len();
    let (mut band, mut right) = (vec![[0.0; POINTS]; n], vec![0.0; n]);
    for (k, (at, v)) in at.windows(POINTS).zip(values.windows(POINTS)).enumerate() {
        let weights = third_difference(at);
        let difference: f64 = weights.iter().zip(v).map(|(w, v)| w * v).sum();
        for i in 0..POINTS {
            right[k + i] -= weights[i] * difference;
            for j in i..POINTS {
                band[k + i][j - i] += weights[i] * weights[j];
            }
        }
    }
    (band, right)
}

/// Raises the hold on values that have moved beyond their widths, or nearly; returns whether any is
/// beyond.
fn hold_more(holds: &mut [f64], moved: &[f64], widths: &[f64]) -> bool {
    let mut is_beyond = false;
    for ((hold, moved), width) in holds.iter_mut().zip(moved).zip(widths).filter(|(_, width)| **width > 0.0) {
        let share = moved.abs() / width;
        if share > NEARLY {
            *hold *= (share / NEARLY).powi(2).min(FIRMER);
        }
        is_beyond |= share > 1.0;
    }
    is_beyond
}

/// Solves the equations with `holds` on the diagonal by LDLᵀ; positive definite, as these are
/// above 0.
fn solved(band: &[[f64; POINTS]], holds: &[f64], right: &[f64]) -> Vec<f64> {
    let n = band.len();
    let mut rows = band.to_vec();
    rows.iter_mut().zip(holds).for_each(|(row, hold)| row[0] += hold);
    let mut x = right.to_vec();
    for k in 0..n {
        let row = rows[k];
        for i in 1..POINTS.min(n - k) {
            let factor = row[i] / row[0];
            for j in i..POINTS {
                rows[k + i][j - i] -= factor * row[j];
            }
            x[k + i] -= factor * x[k];
            rows[k][i] = factor;
        }
    }
    for k in (0..n).rev() {
        let behind: f64 = (1..POINTS.min(n - k)).map(|j| rows[k][j] * x[k + j]).sum();
        x[k] = x[k] / rows[k][0] - behind;
    }
    x
}

#[cfg(test)]
#[path = "../tests/unit/tube_laws.rs"]
mod laws;
