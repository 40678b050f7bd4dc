//! How much the cutter takes at a time, along its way.

use std::collections::VecDeque;

use crate::motion::setup::RemovalLimit;

/// Part of its radius that the cutter goes over which a removal rate is taken. Shorter: the lines
/// of the stock show; longer: short loads are evened out.
const WINDOW: f64 = 0.5;

/// The same in cells of the stock: what lies on the border of what is taken is off by about a third
/// of a cell at either end.
const CELLS: f64 = 10.0;

/// Speeds of the tip that count as the slowest, as a share above it: rounding of F.
const SLOWEST: f64 = 0.01;

/// Removal rates along runs of cuts, over the last way of at least the window.
#[derive(Debug)]
pub(crate) struct Engagement {
    limit: RemovalLimit,
    slack: f64,
    /// mm.
    window: f64,
    parts: VecDeque<CutShare>,
}

/// A part of a cutting move.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CutShare {
    /// Way of the tip, and of the rim by the turn of the tool axis, mm.
    pub(crate) way: f64,
    /// Of the tip alone, mm.
    pub(crate) tip_way: f64,
    /// Removed volume, mm³.
    pub(crate) volume: f64,
    /// s.
    pub(crate) time: f64,
}

impl Engagement {
    /// `slack` is the share above the limit that is no finding, lengths are in mm.
    pub(crate) fn new(limit: RemovalLimit, slack: f64, cutter_radius: f64, cell: f64) -> Self {
        let window = (WINDOW * cutter_radius).max(CELLS * cell);
        Self { limit, slack, window, parts: VecDeque::new() }
    }

    /// Ends a run of cuts.
    pub(crate) fn lift(&mut self) {
        self.parts.clear();
    }

    /// The removal rate over the last window as a share of the limit, where that is more than
    /// allowed. The tip's slowest speed is allowed at any rate, and a run that is shorter than the
    /// window is not judged.
    pub(crate) fn cut(&mut self, part: CutShare) -> Option<f64> {
        if part.time <= 0.0 || part.time.is_nan() {
            // Without a feed there is no rate; it is a fault of its own.
            self.lift();
            return None;
        }
        self.parts.push_back(part);
        let sum = |of: fn(&CutShare) -> f64, parts: &VecDeque<CutShare>| parts.iter().map(of).sum::<f64>();
        let mut way = sum(|p| p.way, &self.parts);
        while let Some(first) = self.parts.front().filter(|first| way - first.way >= self.window) {
            way -= first.way;
            self.parts.pop_front();
        }
        let is_slowest = 60.0 * part.tip_way <= self.limit.slowest * (1.0 + SLOWEST) * part.time;
        if way < self.window || is_slowest {
            return None;
        }
        let rate = 60.0 * sum(|p| p.volume, &self.parts) / sum(|p| p.time, &self.parts);
        let ratio = rate / self.limit.largest;
        (ratio > 1.0 + self.slack).then_some(ratio)
    }
}

#[cfg(test)]
#[path = "../../tests/unit/stock/engagement.rs"]
mod tests;
