//! Reversals of rotary axes, and the pole, in a report.

use schemars::JsonSchema;
use serde::Serialize;

/// Reversals of limited rotary axes by more than half a turn, because their limits do not let them
/// continue. None is in a cut.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct RewindsReport {
    /// Number of reversals in the whole program.
    pub count: usize,
    /// Number of them for which a pass was ended; the rest are between passes anyway.
    pub inserted: usize,
    /// Number of changes to the machine's other branch between passes.
    pub branch_changes: usize,
    /// All reversals, in program order.
    pub rewinds: Vec<RewindReport>,
}

/// One reversal, at rapid rate and clear of everything.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RewindReport {
    /// Operation.
    pub operation: String,
    /// Line of the program in which the axis turns.
    pub line: u32,
    /// The axis that turns farthest.
    pub axis: String,
    /// Value before, as the machine's scale shows it.
    pub from_deg: f64,
    /// Value after.
    pub to_deg: f64,
    /// Whether a pass was ended for it, and continues behind it.
    pub inserted: bool,
}

/// Consecutive blocks along passes within `singular_cone_deg` of the pole of the rotary axes, or
/// within 5° where an axis cannot follow the programmed feed.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SingularBlocks {
    /// Operation.
    pub operation: String,
    /// First line.
    pub first_line: u32,
    /// Last line.
    pub last_line: u32,
    /// Number of blocks.
    pub blocks: usize,
    /// Smallest angle between the tool axis and the rotary axis nearest to the workpiece, at an end
    /// of a block.
    pub smallest_angle_deg: f64,
    /// The rotary axis with the most motion in them.
    pub axis: String,
    /// Its largest turn per mm of the tool tip's path; `null` if the tip is at rest.
    pub largest_step_deg_per_mm: Option<f64>,
}

impl SingularBlocks {
    /// Adds the blocks that follow.
    pub fn join(&mut self, next: &Self) {
        let larger = |a: &Self, b: &Self| {
            a.largest_step_deg_per_mm.is_some_and(|a| b.largest_step_deg_per_mm.is_none_or(|b| b > a))
        };
        if larger(self, next) {
            self.axis.clone_from(&next.axis);
            self.largest_step_deg_per_mm = next.largest_step_deg_per_mm;
        }
        self.smallest_angle_deg = self.smallest_angle_deg.min(next.smallest_angle_deg);
        (self.last_line, self.blocks) = (next.last_line, self.blocks + next.blocks);
    }
}
