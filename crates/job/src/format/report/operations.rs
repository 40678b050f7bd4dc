//! Operations of a report: time and removal of each, by the text of the program.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::duration_text::clock;

/// Part of the program that an operation takes: from its first line to that of the next one. The
/// move to the part counts for the first operation, that home for the last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OperationReport {
    /// Operation; of two at once both names, with ` + ` between them.
    pub operation: String,
    /// Line of the program at which it begins.
    pub first_line: u32,
    /// Time in passes, by the time law if there is one, else at constant speed (`times`), s.
    pub passes_time_s: f64,
    /// Time in entries and exits, s.
    pub approach_time_s: f64,
    /// Time in rapids, s.
    pub rapid_time_s: f64,
    /// Share of the time in passes that blocks in air take (`stock.cut.blocks_in_air`), from 0 to
    /// 1. It is an estimate. `null` if the stock was not cut, and without passes.
    pub air_share: Option<f64>,
    /// Volume that it removes, mm³; `null` if the stock was not cut.
    pub removed_mm3: Option<f64>,
}

impl OperationReport {
    /// Returns all of its time, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.passes_time_s + self.approach_time_s + self.rapid_time_s
    }

    /// Returns the line of the summary.
    #[must_use]
    pub fn summary_line(&self) -> String {
        let air = self.air_share.map_or_else(String::new, |share| format!(", about {:.1} % in air", 100.0 * share));
        let removed = self.removed_mm3.map_or_else(String::new, |mm3| format!("; {:.1} cm3 cut", mm3 / 1000.0));
        format!(
            "  operation         \"{}\" {}, {} in passes{air}{removed}",
            self.operation,
            clock(self.time_s()),
            clock(self.passes_time_s)
        )
    }
}
