//! Cusps of a report: whether passes keep what the operation allows.

use schemars::JsonSchema;
use serde::Serialize;

/// Cusps of an operation as its passes leave them, by the postures planned.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CuspsKeptReport {
    /// Name of the operation.
    pub operation: String,
    /// Passes put beside trimmed ones, as near to them as there are postures, in one place of the
    /// pattern.
    pub moved_passes: usize,
    /// Passes put between others where the postures taken leave more than the allowed cusp, in one
    /// place of the pattern.
    pub passes_between: usize,
    /// Points with a higher ridge than allowed toward a pass before, or with a strip that stays
    /// uncut.
    pub points_beyond: usize,
    /// Why no pass was put where they are.
    pub reasons: Vec<CuspReasonReport>,
}

/// Why the allowed cusp is not kept at some points.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CuspReasonReport {
    /// Why.
    pub reason: String,
    /// Points of this reason.
    pub points: usize,
    /// Highest ridge among them; `null` where strips stay uncut at all of them.
    pub cusp_mm: Option<f64>,
    /// Where the ridge is highest, or the first strip that stays uncut.
    pub place_mm: [f64; 3],
    /// Step-over there.
    pub step_over_mm: f64,
}

impl CuspReasonReport {
    /// Adds the points of another one for the same reason.
    pub fn take(&mut self, other: Self) {
        self.points += other.points;
        // A strip that stays uncut is worse than any ridge.
        let is_worse = match (self.cusp_mm, other.cusp_mm) {
            (Some(own), Some(other)) => other > own,
            (own, other) => own.is_some() && other.is_none(),
        };
        if is_worse {
            (self.place_mm, self.step_over_mm) = (other.place_mm, other.step_over_mm);
        }
        self.cusp_mm = match (self.cusp_mm, other.cusp_mm) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (a, b) => a.or(b),
        };
    }
}
