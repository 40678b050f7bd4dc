//! Efficiency of passes, for reports.

use schemars::JsonSchema;
use serde::Serialize;

/// Length of an operation's passes over the least length that the cusp permits
/// (docs/method.md#efficiency), in all places of its pattern.
///
/// The floor is ∫ dA / w over the region that the operation is to cut, with w the widest strip
/// that the tool leaves within `cusp_mm`, at most `max_step_over_mm`. Where a part of the region
/// stays uncut, passes are shorter than for all of it: `remaining` has its share.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct EfficiencyReport {
    /// Operation.
    pub operation: String,
    /// Area of the region.
    pub area_mm2: f64,
    /// Number of places at which the width is taken.
    pub samples: usize,
    /// Length of the passes over the surface.
    pub passes_length_mm: f64,
    /// The same with the tip's path in entries and exits; absent where the text alone is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cutting_length_mm: Option<f64>,
    /// Least length with feed directions and postures as cut: w is the width across the feed of
    /// the nearest pass, in its posture.
    pub floor_mm: f64,
    /// Least length over all feed directions at the tilt as cut: w is the width across the least
    /// curvature, with the axis leaning along the feed.
    pub least_floor_mm: f64,
    /// `passes_length_mm` / `floor_mm`: 1 is the least of passes in these directions and postures,
    /// 1.2 is a fifth more.
    pub efficiency: f64,
    /// `cutting_length_mm` / `floor_mm`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub with_entries: Option<f64>,
    /// `passes_length_mm` / `least_floor_mm`.
    pub over_least_floor: f64,
}

impl EfficiencyReport {
    /// Returns the line of a summary; `several` names the operation.
    pub fn summary_line(&self, several: bool) -> String {
        let of = if several { format!(", operation \"{}\"", self.operation) } else { String::new() };
        let with_entries = self.with_entries.map_or(String::new(), |e| format!(" (with entries {e:.3})"));
        format!(
            "  efficiency        passes of {:.1} m are {:.3} times their floor of {:.1} m{with_entries}; floor of the best directions {:.1} \
             m{of}",
            self.passes_length_mm / 1000.0,
            self.efficiency,
            self.floor_mm / 1000.0,
            self.least_floor_mm / 1000.0
        )
    }
}
