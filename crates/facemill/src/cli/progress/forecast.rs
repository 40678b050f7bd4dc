//! When a stage of a plan will be done, told so that it can be believed.

/// Time before which nothing is told, s: the first steps say little of the others.
const SILENCE: f64 = 2.0;

/// Share of the steps before which nothing is told.
const LEAST_SHARE: f64 = 0.02;

/// Time in which what is told comes near to what is now known, s. Shorter, it jumps where steps take unequal time.
const SETTLING: f64 = 10.0;

/// The time that is left of a stage. It counts down with the clock, and is drawn toward the estimate from all steps so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Forecast {
    /// When something was told last, s since the start of the stage, and the time that was left, s.
    told: Option<[f64; 2]>,
}

impl Forecast {
    /// Time that is left, s, `elapsed` s after the start with this share of the steps done; `None` where too little is known.
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
mod tests {
    use crate::cli::progress::forecast::*;

    /// What is told every 0.2 s of a stage whose share at a time is known, with the times.
    fn told(end: f64, share: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let mut forecast = Forecast::default();
        let times = (0..).map(|k| 0.2 * f64::from(k)).take_while(|t| *t <= end);
        times.filter_map(|t| Some((t, forecast.left(t, share(t))?))).collect()
    }

    #[test]
    fn of_even_steps_the_end_is_told_as_it_comes() {
        let all = told(60.0, |t| t / 60.0);
        assert!(all.len() > 280 && all.iter().all(|(t, left)| (t + left - 60.0).abs() < 0.5), "{all:?}");
    }

    /// The second half of the steps takes three times as long as the first; the end then moves, and does not jump.
    #[test]
    fn of_uneven_steps_the_end_moves_slowly() {
        let all = told(80.0, |t| if t < 20.0 { t / 40.0 } else { 0.5 + (t - 20.0) / 120.0 });
        for pair in all.windows(2) {
            let [before, after] = [pair[0].0 + pair[0].1, pair[1].0 + pair[1].1];
            assert!((after - before).abs() < 1.0, "the end goes from {before:.1} to {after:.1} s in 0.2 s");
        }
        assert!(all.last().is_some_and(|(_, left)| *left < 2.0), "{:?}", all.last());
    }

    #[test]
    fn nothing_is_told_of_the_first_steps() {
        let mut forecast = Forecast::default();
        assert_eq!([forecast.left(1.0, 0.5), forecast.left(30.0, 0.001), forecast.left(30.0, 0.0)], [None; 3]);
        assert_eq!(forecast.left(30.0, 1.0), Some(0.0));
    }
}
