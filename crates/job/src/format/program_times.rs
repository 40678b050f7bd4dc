//! How long a program takes, as its text says it: the same for who plans it and for who verifies
//! it.

use schemars::JsonSchema;
use serde::Serialize;

use crate::duration_text::clock;

/// Times of a program. Cuts are all blocks at a feed: passes, entries and exits; rapids are all at
/// rapid rate, with the ways to the part and home.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct ProgramTimes {
    /// Cuts within velocity, acceleration and jerk of every axis, s; `null` where that is not
    /// known.
    pub cutting_s: Option<f64>,
    /// Rapids within the same, s.
    pub rapid_s: Option<f64>,
    /// Cuts at their programmed feeds, without acceleration, s.
    pub constant_cutting_s: f64,
    /// Rapids at the axes' largest velocities, without acceleration, s.
    pub constant_rapid_s: f64,
    /// Why nothing is known within acceleration and jerk; empty where it is.
    pub no_law_because: Vec<String>,
}

impl ProgramTimes {
    /// Times at constant speed, [cuts, rapids] in s, of which no other ones are known.
    pub fn constant([cutting, rapid]: [f64; 2], why: Vec<String>) -> Self {
        Self { constant_cutting_s: cutting, constant_rapid_s: rapid, no_law_because: why, ..Self::default() }
    }

    /// Times at constant speed and within the limits of the axes, each [cuts, rapids] in s.
    pub fn by_law(constant: [f64; 2], [cutting, rapid]: [f64; 2]) -> Self {
        Self { cutting_s: Some(cutting), rapid_s: Some(rapid), ..Self::constant(constant, Vec::new()) }
    }

    /// Lines for a person.
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
