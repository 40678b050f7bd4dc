//! How much the cutter takes at a time, along its way.

use std::collections::VecDeque;

use crate::motion::setup::RemovalLimit;

/// Part of its radius that the cutter goes over which a removal rate is taken. Shorter: the lines of the stock show; longer:
/// short loads are evened out.
const WINDOW: f64 = 0.5;

/// The same in cells of the stock: what lies on the border of what is taken is off by about a third of a cell at either end.
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
    parts: VecDeque<Part>,
}

/// A part of a cutting move.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    /// Way of the tip, and of the rim by the turn of the tool axis, mm.
    pub(crate) way: f64,
    /// Of the tip alone, mm.
    pub(crate) tip_way: f64,
    /// What was taken, mm³.
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

    /// The removal rate over the last window as a share of the limit, where that is more than allowed. The tip's slowest speed is
    /// allowed at any rate, and a run that is shorter than the window is not judged.
    pub(crate) fn cut(&mut self, part: Part) -> Option<f64> {
        if part.time <= 0.0 || part.time.is_nan() {
            // Without a feed there is no rate; it is a fault of its own.
            self.lift();
            return None;
        }
        self.parts.push_back(part);
        let sum = |of: fn(&Part) -> f64, parts: &VecDeque<Part>| parts.iter().map(of).sum::<f64>();
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
mod tests {
    use crate::stock::engagement::*;

    const LIMIT: RemovalLimit = RemovalLimit { largest: 20e3, slowest: 200.0 };

    /// 1 mm at a feed in mm/min with a chip of this section, mm².
    fn part(feed: f64, section: f64) -> Part {
        Part { way: 1.0, tip_way: 1.0, volume: section, time: 60.0 / feed }
    }

    fn ratios(feed: f64, sections: impl Iterator<Item = f64>) -> Vec<Option<f64>> {
        let mut engagement = Engagement::new(LIMIT, 0.1, 25.0, 0.5);
        sections.map(|section| engagement.cut(part(feed, section))).collect()
    }

    #[test]
    fn rates_above_the_limit_are_told_from_the_first_window_on() {
        // 1000 mm/min times 23 mm² is 1.15 times the limit; 21 mm² are within the slack.
        let found = ratios(1000.0, std::iter::repeat_n(23.0, 30));
        assert_eq!(found.iter().position(Option::is_some), Some(12), "the window is 12.5 mm");
        assert!(found[12..].iter().all(|r| r.is_some_and(|r| (r - 1.15).abs() < 1e-9)));
        assert!(ratios(1000.0, std::iter::repeat_n(21.0, 30)).iter().all(Option::is_none));
    }

    #[test]
    fn a_load_shorter_than_the_window_is_evened_out_and_the_slowest_feed_is_free() {
        let spike = (0..40).map(|k| if k == 20 { 100.0 } else { 10.0 });
        assert!(ratios(1000.0, spike).iter().all(Option::is_none));
        assert!(ratios(200.0, std::iter::repeat_n(500.0, 30)).iter().all(Option::is_none));
        assert!(ratios(210.0, std::iter::repeat_n(500.0, 30)).iter().any(Option::is_some));
    }

    #[test]
    fn runs_begin_anew_behind_a_lift() {
        let mut engagement = Engagement::new(LIMIT, 0.1, 25.0, 0.5);
        for k in 0..60 {
            assert_eq!(engagement.cut(part(1000.0, 50.0)), None);
            if k % 12 == 11 {
                engagement.lift();
            }
        }
    }
}
