use crate::error::PathError;
use crate::layout::levels::Band;
use crate::strategy::settings::{LaySettings, LevelOrder};
use crate::strategy::size::{MAX_CROSSINGS, MAX_LEVELS, StepOverCause};

/// Accumulated width of a field: the number of strips that fit between two of its levels.
///
/// At each level it grows by the least step of level that a place there allows. The way from one
/// level to the next is, along each steepest line, at most the mean of the widths that it meets.
pub(crate) struct AccumulatedWidth {
    first: f64,
    step: f64,
    /// Strips below each level of a grid.
    sums: Vec<f64>,
    /// Strips at the last level.
    total: f64,
}

/// Levels of the grid.
const N_RANGES: usize = 4096;

impl AccumulatedWidth {
    /// Between two levels, the first below the last, by the limits at the ends of edges, each with
    /// its level; limits are linear on an edge.
    pub(crate) fn of(edges: impl Iterator<Item = [(f64, f64); 2]>, [first, last]: [f64; 2]) -> Self {
        let step = (last - first) / N_RANGES as f64;
        let mut density = vec![0.0f64; N_RANGES];
        let range = |level: f64| (((level - first) / step).max(0.0) as usize).min(N_RANGES - 1);
        for [a, b] in edges {
            let [low, high] = if a.0 <= b.0 { [a, b] } else { [b, a] };
            // Levels that are not known are in no range.
            if !(high.0 >= first && low.0 <= last) {
                continue;
            }
            let from = range(low.0);
            for (k, d) in (from..).zip(&mut density[from..=range(high.0)]) {
                let level = (first + step * (k as f64 + 0.5)).clamp(low.0, high.0);
                let share = (level - low.0) / (high.0 - low.0);
                let limit = low.1 + (high.1 - low.1) * if share.is_finite() { share } else { 0.0 };
                *d = d.max(1.0 / limit);
            }
        }
        let sums: Vec<f64> = std::iter::once(0.0)
            .chain(density.into_iter().scan(0.0, |sum, d| {
                *sum += d * step;
                Some(*sum)
            }))
            .collect();
        let total = sums[N_RANGES];
        Self { first, step, sums, total }
    }

    /// Number of steps that are as wide as allowed, or a little narrower, at least one.
    ///
    /// # Errors
    /// When they are too many, or their levels cross too many of the bands.
    pub(crate) fn n_steps(&self, bands: &[Band], cause: StepOverCause) -> Result<usize, PathError> {
        let n_crossings: f64 = bands.iter().map(|b| 1.0 + self.strips(b.high) - self.strips(b.low)).sum();
        let times = f64::max(self.total / MAX_LEVELS as f64, n_crossings / (MAX_CROSSINGS + bands.len()) as f64);
        if times > 1.0 || !self.total.is_finite() {
            let span = self.step * N_RANGES as f64;
            let remedy = cause.remedy(times);
            return Err(PathError::TooManyPasses { limit: MAX_LEVELS, most_crossings: MAX_CROSSINGS, span, remedy });
        }
        // Rounding must not make eleven steps out of ten.
        Ok(((self.total - 1e-9).ceil() as usize).max(1))
    }

    /// Strips below a level, continued beyond the first and the last.
    pub(crate) fn strips(&self, level: f64) -> f64 {
        let way = (level - self.first) / self.step;
        let k = (way.max(0.0) as usize).min(N_RANGES - 1);
        self.sums[k] + (self.sums[k + 1] - self.sums[k]) * (way - k as f64)
    }

    /// Strips between the first and the last level.
    pub(crate) fn total(&self) -> f64 {
        self.total
    }

    /// The level below which there are so many strips.
    fn level(&self, strips: f64) -> f64 {
        let k = self.sums.partition_point(|&s| s <= strips).clamp(1, N_RANGES) - 1;
        let share = (strips - self.sums[k]) / (self.sums[k + 1] - self.sums[k]);
        // A step that no triangle reaches into has no strips.
        self.first + self.step * (k as f64 + if share.is_finite() { share } else { 0.0 })
    }

    /// The first level, the last, and those between in rising order: evenly spread, or full strips
    /// from the side where cutting begins.
    pub(crate) fn levels(&self, n_steps: usize, settings: &LaySettings) -> Vec<f64> {
        let last = self.first + self.step * N_RANGES as f64;
        let full = if settings.even { self.total / n_steps as f64 } else { 1.0 };
        let strips = |k: usize| match settings.order {
            LevelOrder::Increasing => full * k as f64,
            LevelOrder::Decreasing => self.total - full * (n_steps - k) as f64,
        };
        let between = (1..n_steps).map(|k| self.level(strips(k)));
        std::iter::once(self.first).chain(between).chain([last]).collect()
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/layout/field/accumulated.rs"]
mod tests;
