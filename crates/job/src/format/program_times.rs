//! Time that a program takes according to its text: planner and verification compute the same.

use schemars::JsonSchema;
use serde::Serialize;

use crate::duration_text::clock;

/// Times of a program. Cuts are all blocks at a feed: passes, entries and exits; rapids are all at
/// rapid rate, with the moves to the part and home.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct ProgramTimes {
    /// Cuts (all blocks at a feed: passes, entries and exits) within velocity, acceleration and
    /// jerk of every axis, s; `null` if unknown.
    pub cutting_s: Option<f64>,
    /// Rapids within the same limits, s.
    pub rapid_s: Option<f64>,
    /// Cuts at their programmed feeds, without acceleration, s.
    pub constant_cutting_s: f64,
    /// Rapids at the axes' largest velocities, without acceleration, s.
    pub constant_rapid_s: f64,
    /// Reasons why times within acceleration and jerk are unknown; empty if they are known.
    pub no_law_because: Vec<String>,
}

impl ProgramTimes {
    /// Returns times at constant speed, [cuts, rapids] in s, without others.
    pub fn constant([cutting, rapid]: [f64; 2], why: Vec<String>) -> Self {
        Self { constant_cutting_s: cutting, constant_rapid_s: rapid, no_law_because: why, ..Self::default() }
    }

    /// Returns times at constant speed and within the limits of the axes, each [cuts, rapids] in s.
    pub fn by_law(constant: [f64; 2], [cutting, rapid]: [f64; 2]) -> Self {
        Self { cutting_s: Some(cutting), rapid_s: Some(rapid), ..Self::constant(constant, Vec::new()) }
    }

    /// Returns lines for a person.
    pub fn summary_lines(&self) -> Vec<String> {
        let line = |what: &str, law: Option<f64>, constant: f64| match law {
            Some(time) => format!("  {what:<17} {} (at constant speed {})", clock(time), clock(constant)),
            None => format!("  {what:<17} {} at constant speed", clock(constant)),
        };
        let mut lines = vec![
            line("cutting time", self.cutting_s, self.constant_cutting_s),
            line("rapid time", self.rapid_s, self.constant_rapid_s),
        ];
        lines.extend(self.no_law_because.iter().map(|why| format!("  least times       {why}")));
        lines
    }
}

#[cfg(test)]
#[path = "../../tests/unit/format/program_times.rs"]
mod tests;
