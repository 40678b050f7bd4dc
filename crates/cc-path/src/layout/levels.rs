use rayon::prelude::*;

use crate::error::PathError;
use crate::strategy::size::{MAX_CROSSINGS, MAX_LEVELS, StepOverCause};

/// A piece of the surface: the levels it reaches over and the largest step of level that keeps
/// passes on it close enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Band {
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// Allowed width × slope, above zero.
    pub(crate) limit: f64,
    /// The same before width and slope were raised to their smallest values.
    pub(crate) requested: f64,
    /// Gain of level per way up the piece, above zero.
    pub(crate) slope: f64,
}

/// Largest step between the levels that a piece reaches over.
#[derive(Clone, Copy)]
struct LevelLimit {
    low: f64,
    high: f64,
    limit: f64,
}

/// Levels from `first` to `last`, both included and `first` ≤ `last`, in rising order: each step is
/// the largest that no band it reaches into forbids.
///
/// With `even`, the limits are shrunk alike until the same number of steps fits without a rest.
///
/// # Errors
/// When there would be more than [`MAX_LEVELS`], or they would cross more than [`MAX_CROSSINGS`]
/// bands.
pub(crate) fn plan_levels(
    bands: &[Band],
    cause: StepOverCause,
    first: f64,
    last: f64,
    even: bool,
) -> Result<Vec<f64>, PathError> {
    let limit = |b: &Band| LevelLimit { low: b.low, high: b.high, limit: b.limit };
    let mut sorted: Vec<LevelLimit> = bands.iter().map(limit).collect();
    sorted.par_sort_by(|a, b| a.low.total_cmp(&b.low).then(a.limit.total_cmp(&b.limit)));
    let Some(largest) = step_through(&sorted, first, last, 1.0, MAX_LEVELS) else {
        let remedy = cause.remedy(least_factor(&sorted, first, last));
        let (limit, most_crossings) = (MAX_LEVELS, MAX_CROSSINGS);
        return Err(PathError::TooManyPasses { limit, most_crossings, span: last - first, remedy });
    };
    if !even || largest.len() < 3 {
        return Ok(largest);
    }
    // The number of steps falls with the limits' factor, so bisection finds the smallest factor
    // with no more steps. Forty halvings leave the last step full to twelve digits.
    let (mut low, mut high, mut best) = (0.5, 1.0, largest);
    for _ in 0..40 {
        let factor = 0.5 * (low + high);
        match step_through(&sorted, first, last, factor, best.len()) {
            Some(levels) => (high, best) = (factor, levels),
            None => low = factor,
        }
    }
    Ok(best)
}

/// How many times as large limits have to be, about, for the levels to be few enough; 1 is not.
fn least_factor(sorted: &[LevelLimit], first: f64, last: f64) -> f64 {
    let fits = |factor: f64| step_through(sorted, first, last, factor, MAX_LEVELS).is_some();
    let (mut low, mut high) = (1.0, 10.0);
    while !fits(high) {
        (low, high) = (high, 10.0 * high);
    }
    // To a hundredth.
    for _ in 0..8 {
        let middle = f64::sqrt(low * high);
        if fits(middle) { high = middle } else { low = middle }
    }
    high
}

/// The triangles that reach each of the levels (in rising order), those in rising order. A triangle
/// reaches a level that is above its lowest corner and not above its highest.
pub(crate) fn triangles_at(bands: &[Band], levels: &[f64]) -> Vec<Vec<u32>> {
    let mut at = vec![Vec::new(); levels.len()];
    for (t, b) in bands.iter().enumerate() {
        let reached = levels.partition_point(|&l| l <= b.low)..levels.partition_point(|&l| l <= b.high);
        reached.for_each(|k| at[k].push(t as u32));
    }
    at
}

/// Counts the steps between levels (in rising order) that are larger than allowed.
pub(crate) fn count_wide(bands: &[Band], levels: &[f64]) -> usize {
    let mut wide = vec![false; levels.len().saturating_sub(1)];
    for b in bands.iter().filter(|b| b.requested < b.limit) {
        for k in steps_into(b, levels) {
            // Rounding of levels up to 1e4 mm is no excess.
            wide[k] |= levels[k + 1] - levels[k] > b.requested + 1e-9;
        }
    }
    wide.into_iter().filter(|&w| w).count()
}

/// Longest way up a piece from one of the levels (in rising order) to the next, as if the piece
/// reached over both.
pub(crate) fn widest_strip(bands: &[Band], levels: &[f64]) -> f64 {
    let way = |b: &Band| steps_into(b, levels).map(|k| (levels[k + 1] - levels[k]) / b.slope).fold(0.0, f64::max);
    bands.iter().map(way).fold(0.0, f64::max)
}

/// The steps, by the index of their lower level, that share more than a border with the band.
fn steps_into(b: &Band, levels: &[f64]) -> std::ops::Range<usize> {
    let n_steps = levels.len().saturating_sub(1);
    let first = levels.partition_point(|&l| l <= b.low).saturating_sub(1);
    let end = levels.partition_point(|&l| l < b.high).min(n_steps);
    first.min(end)..end
}

/// `None` when there are more than `max_levels`, or they cross too many bands.
fn step_through(sorted: &[LevelLimit], first: f64, last: f64, factor: f64, max_levels: usize) -> Option<Vec<f64>> {
    let mut levels = vec![first];
    let mut active: Vec<LevelLimit> = Vec::new();
    let (mut next, mut n_crossings) = (0, 0);
    let mut level = first;
    while level < last {
        let reached = sorted[next..].iter().take_while(|b| b.low <= level);
        next += reached.map(|b| active.push(*b)).count();
        let mut narrowest = f64::INFINITY;
        active.retain(|b| {
            let remains = b.high > level;
            narrowest = if remains && b.limit < narrowest { b.limit } else { narrowest };
            remains
        });
        let mut step = (narrowest * factor).min(last - level);
        for b in &sorted[next..] {
            if b.low - level >= step {
                break;
            }
            // The step may go as far as the band without a say of it.
            step = step.min((b.limit * factor).max(b.low - level));
        }
        // A step lost in rounding would never end.
        let stepped = level + step;
        level = if step >= last - level { last } else { stepped.max(level.next_up()) };
        levels.push(level);
        n_crossings += active.len();
        if levels.len() > max_levels || n_crossings > MAX_CROSSINGS {
            return None;
        }
    }
    Some(levels)
}

#[cfg(test)]
#[path = "../../tests/unit/layout/levels.rs"]
mod tests;
