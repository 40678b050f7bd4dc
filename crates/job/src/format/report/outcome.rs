//! Outcome of a plan.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Outcome of a plan; of several setups the worst counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Outcome {
    /// The program meets the job.
    Done,
    /// The program has no fault, but leaves out more points or leaves more material than the job
    /// permits, or its blocks are not close enough for the linearisation tolerance.
    Incomplete,
    /// The program has faults, and must not be run: its name says so.
    Faulty,
}

impl Outcome {
    /// Returns the exit code of `facemill plan`: 0 done, 1 incomplete, 4 faulty.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Incomplete => 1,
            Self::Faulty => 4,
        }
    }
}
