//! Regions of a report that are limited to what is left.

use schemars::JsonSchema;
use serde::Serialize;

/// Stock that an operation found left on its region (docs/method.md#what-earlier-cuts-left), in one
/// place of its pattern, and how much of it the planned passes reach.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LeftAboveReport {
    /// Name of the operation.
    pub operation: String,
    /// Height above which stock counts as left, of the job.
    pub height_mm: f64,
    /// Distance around it that passes cover, of the job.
    pub overlap_mm: f64,
    /// Places on which heights were measured.
    pub measured_places: usize,
    /// Area on which stock is left, without the overlap; 0 if the operation has nothing to cut.
    pub area_mm2: f64,
    /// Number of islands of it: parts whose overlaps do not meet.
    pub islands: usize,
    /// Part of that area within half a strip of a planned pass.
    pub reached_mm2: f64,
    /// Number of islands, or parts of islands, that no planned pass reaches.
    pub islands_not_reached: usize,
    /// These, the largest first, at most 16.
    pub not_reached: Vec<NotReachedReport>,
}

/// Part of what is left that no planned pass reaches.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct NotReachedReport {
    /// Its area.
    pub area_mm2: f64,
    /// Its highest place.
    pub place_mm: [f64; 3],
    /// Why there is no pass.
    pub reason: String,
}

impl LeftAboveReport {
    /// Returns the lines for a summary.
    pub fn summary_lines(&self) -> Vec<String> {
        let Self { operation, height_mm, area_mm2, islands, .. } = self;
        if self.area_mm2 == 0.0 && self.islands == 0 {
            return vec![format!(
                "  left above        operation \"{operation}\": nothing is left above {height_mm} mm, so it has no passes"
            )];
        }
        let mut lines = vec![format!(
            "  left above        operation \"{operation}\": {height_mm} mm on {:.1} cm2 in {islands} islands, {:.1} cm2 of it reached by passes",
            area_mm2 / 100.0,
            self.reached_mm2 / 100.0
        )];
        lines.extend(self.not_reached.iter().take(MOST_LINES).map(|n| {
            let [x, y, z] = n.place_mm;
            format!("    not reached: {:.2} cm2 at ({x:.1}, {y:.1}, {z:.1}): {}", n.area_mm2 / 100.0, n.reason)
        }));
        lines
    }
}

/// Largest number of parts in a summary; the report has more.
const MOST_LINES: usize = 3;
