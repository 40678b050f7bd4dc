//! Cusps of a report: whether passes keep the operation's limit.

use schemars::JsonSchema;
use serde::Serialize;

/// Cusps that the passes of an operation leave with the planned postures.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CuspsKeptReport {
    /// Name of the operation.
    pub operation: String,
    /// Passes moved beside trimmed ones (docs/method.md#added-passes), as near to them as postures
    /// permit, in one place of the pattern; of pairs in the place with most.
    pub moved_passes: usize,
    /// Passes inserted between others (docs/method.md#added-passes), or over high places beside
    /// them (docs/method.md#rounds-of-widths), where the chosen postures leave more than `cusp_mm`,
    /// in one place of the pattern; of pairs in the place with most.
    pub passes_between: usize,
    /// Points with a higher ridge than permitted toward a pass cut before, or with a strip that
    /// stays uncut. With any the exit code is 1, unless the text is measured to keep the cusp.
    pub points_beyond: usize,
    /// Whether the text is measured to leave at most `cusp_mm` beside each of these points, across
    /// the strips and within the step-over, so that they do not count. A point beside which no
    /// place of the region is measured is kept if all of the region of a strategy is.
    pub kept_by_text: bool,
    /// Reasons why no pass was inserted there.
    pub reasons: Vec<CuspReasonReport>,
    /// Rounds of laying, each with narrower strips where the one before left more than `cusp_mm`
    /// (docs/method.md#rounds-of-widths); empty if passes were laid once.
    pub width_rounds: Vec<WidthRoundReport>,
}

/// A round of laying, in the first place of the pattern.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct WidthRoundReport {
    /// Passes as laid.
    pub passes: usize,
    /// Passes added, beside trimmed ones and for the cusp.
    pub passes_added: usize,
    /// Length of all passes, mm.
    pub length_mm: f64,
    /// Time of all passes by the machine's motion law, with an estimate of entries, exits and
    /// links, s.
    pub time_s: f64,
    /// Largest height that the text leaves on the region where it is cut, farther than half the
    /// largest step-over from points without a posture: passes may lower it there.
    pub largest_mm: f64,
    /// Share of that area with more than `cusp_mm` left, 0..=1.
    pub above_fraction: f64,
    /// Points without a posture.
    pub points_without_posture: usize,
    /// Whether this round is cut.
    pub is_cut: bool,
}

/// Reason why the permitted cusp is exceeded at some points.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CuspReasonReport {
    /// The reason.
    pub reason: String,
    /// Points of this reason.
    pub points: usize,
    /// Highest ridge among them; `null` if strips stay uncut at all of them.
    pub cusp_mm: Option<f64>,
    /// Place of the highest ridge, or of the first strip that stays uncut.
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
