//! Wall times of stages.

use std::time::Instant;

/// Wall times of stages.
pub(crate) struct Clock {
    last: Instant,
    pub(crate) laps: Vec<(&'static str, f64)>,
}

impl Clock {
    pub(crate) fn new() -> Self {
        Self { last: Instant::now(), laps: Vec::new() }
    }

    /// Ends a stage that began at the end of the one before.
    pub(crate) fn lap(&mut self, what: &'static str) {
        let seconds = self.last.elapsed().as_secs_f64();
        match self.laps.iter_mut().find(|(name, _)| *name == what) {
            Some((_, sum)) => *sum += seconds,
            None => self.laps.push((what, seconds)),
        }
        self.last = Instant::now();
    }
}
