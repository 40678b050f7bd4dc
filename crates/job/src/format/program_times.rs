//! Time that a program takes according to its text: planner and verification compute the same.

use std::fmt;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

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
    /// Reasons why times within acceleration and jerk are unknown; empty if they are known. Where
    /// calls were expanded, a line is that of the file named with it.
    #[schemars(with = "Vec<String>")]
    pub no_law_because: Vec<NoLawReason>,
}

/// Reason why times within acceleration and jerk are unknown: a text in files.
#[derive(Clone, Debug, PartialEq)]
pub enum NoLawReason {
    /// A text.
    Text(String),
    /// A line that is not timed.
    Line {
        /// Name of the file, where lines of several files run.
        file: Option<String>,
        /// Line, from 1.
        line: u32,
        /// Words behind it: how the text goes on.
        why: String,
    },
}

impl NoLawReason {
    /// Gives a reason of a line the file and the line that `place` returns for it.
    pub fn place(&mut self, place: impl Fn(u32) -> (String, u32)) {
        if let Self::Line { file, line, .. } = self {
            let (of_file, at) = place(*line);
            (*file, *line) = (Some(of_file), at);
        }
    }
}

impl fmt::Display for NoLawReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Line { file, line, why } => {
                let file = file.as_ref().map_or_else(String::new, |file| format!("{file}: "));
                write!(f, "unknown within acceleration: {file}line {line}{why}")
            }
        }
    }
}

impl Serialize for NoLawReason {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl ProgramTimes {
    /// Returns times at constant speed, [cuts, rapids] in s, without others.
    pub fn constant([cutting, rapid]: [f64; 2], why: Vec<NoLawReason>) -> Self {
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
