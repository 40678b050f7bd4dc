//! What the report says of rotary axes that turn back, and of the pole.

use schemars::JsonSchema;
use serde::Serialize;

/// Where limited rotary axes turn back by more than half a turn, because their limits do not let
/// them go on. None of that is in a cut.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct RewindsReport {
    /// How often, in the whole program.
    pub count: usize,
    /// Of these, how many a pass was ended for; the rest are between passes anyway.
    pub inserted: usize,
    /// How often the machine goes over to its other branch between passes.
    pub branch_changes: usize,
    /// Each, in program order.
    pub rewinds: Vec<RewindReport>,
}

/// One turn back, at rapid rate and clear of everything.
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
    /// Value behind.
    pub to_deg: f64,
    /// Whether a pass was ended for it, and goes on behind it.
    pub inserted: bool,
}

/// Blocks that follow each other near the pole of the rotary axes.
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
    /// The rotary axis that has the most to do in them.
    pub axis: String,
    /// Its largest turn per mm of the tool tip's way; `null` where the tip stands.
    pub largest_step_deg_per_mm: Option<f64>,
}

impl SingularBlocks {
    /// Adds blocks that follow.
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
