//! Credible forecast of the end of a plan's stage.

/// Time before the first forecast, s: the first steps say little of the others.
const SILENCE: f64 = 2.0;

/// Share of the steps before the first forecast.
const LEAST_SHARE: f64 = 0.02;

/// Time in which the forecast approaches the present estimate, s. Shorter: it jumps if steps take
/// unequal time.
const SETTLING: f64 = 10.0;

/// Remaining time of a stage. It counts down with the clock, and is drawn toward the estimate from
/// all steps so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Forecast {
    /// Time of the last forecast, s since the start of the stage, and its remaining time, s.
    last: Option<[f64; 2]>,
}

impl Forecast {
    /// Returns the remaining time, s, `elapsed` s after the start with this share of the steps
    /// done; `None` if too little is known.
    pub(crate) fn left(&mut self, elapsed: f64, share: f64) -> Option<f64> {
        if elapsed < SILENCE || share < LEAST_SHARE {
            return None;
        }
        let estimate = elapsed * (1.0 - share.min(1.0)) / share;
        let left = self.last.map_or(estimate, |[at, left]| {
            let passed = (elapsed - at).max(0.0);
            let counted = (left - passed).max(0.0);
            counted + (estimate - counted) * -(-passed / SETTLING).exp_m1()
        });
        self.last = Some([elapsed, left]);
        Some(left)
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/cli/progress/forecast.rs"]
mod tests;
