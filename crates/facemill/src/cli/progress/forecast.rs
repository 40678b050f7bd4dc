//! When a stage of a plan will be done, told so that it can be believed.

/// Time before which nothing is told, s: the first steps say little of the others.
const SILENCE: f64 = 2.0;

/// Share of the steps before which nothing is told.
const LEAST_SHARE: f64 = 0.02;

/// Time in which what is told comes near to what is now known, s. Shorter, it jumps where steps
/// take unequal time.
const SETTLING: f64 = 10.0;

/// The time that is left of a stage. It counts down with the clock, and is drawn toward the
/// estimate from all steps so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Forecast {
    /// When something was told last, s since the start of the stage, and the time that was left, s.
    told: Option<[f64; 2]>,
}

impl Forecast {
    /// Time that is left, s, `elapsed` s after the start with this share of the steps done; `None`
    /// where too little is known.
    pub(crate) fn left(&mut self, elapsed: f64, share: f64) -> Option<f64> {
        if elapsed < SILENCE || share < LEAST_SHARE {
            return None;
        }
        let estimate = elapsed * (1.0 - share.min(1.0)) / share;
        let left = self.told.map_or(estimate, |[at, left]| {
            let passed = (elapsed - at).max(0.0);
            let counted = (left - passed).max(0.0);
            counted + (estimate - counted) * -(-passed / SETTLING).exp_m1()
        });
        self.told = Some([elapsed, left]);
        Some(left)
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/cli/progress/forecast.rs"]
mod tests;
