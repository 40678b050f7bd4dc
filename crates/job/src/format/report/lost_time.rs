//! Lost time of a report, by cause.

use schemars::JsonSchema;
use serde::Serialize;

use crate::duration_text::clock;

/// Time that the passes of an operation lose to one cause.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LostTimeReport {
    /// Name of the operation.
    pub operation: String,
    /// Reason why the tip is slower than the programmed feed.
    pub cause: LostTimeCause,
    /// The axis that turns fast beside the pole, or that is at its largest velocity; `null` if it
    /// is not one alone.
    pub axis: Option<String>,
    /// Time lost compared with the programmed feed, s; that of feeds by chips does not count. By
    /// the time law if the machine file has its limits.
    pub lost_s: f64,
    /// Fraction of the operation's time in passes.
    pub share: f64,
    /// Line of the block that loses most.
    pub line: u32,
    /// Possible remedy: mounting, cone and tilt, blocks and tolerance.
    pub remedy: String,
}

/// Reason why the tip is slower than the programmed feed.
// Exhaustive for callers: reports advise on each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LostTimeCause {
    /// The tool axis is within 10° of the pole of the rotary axes, where one of them turns much
    /// faster than the tool.
    NearPole,
    /// A rotary axis is at its largest velocity.
    RotaryVelocity,
    /// A linear axis is at its largest velocity.
    LinearVelocity,
    /// Axes cannot change their speeds faster from block to block within acceleration, jerk and the
    /// control's tolerance.
    Acceleration,
}

impl LostTimeReport {
    /// Returns the line of the summary.
    pub fn summary_line(&self) -> String {
        let axis = self.axis.as_deref().unwrap_or("");
        let why = match self.cause {
            LostTimeCause::NearPole => format!("axis {axis} turns fast beside the pole"),
            LostTimeCause::RotaryVelocity | LostTimeCause::LinearVelocity => {
                format!("axis {axis} is at its largest velocity")
            }
            LostTimeCause::Acceleration => "axes change their speeds no faster".to_owned(),
        };
        let Self { operation, line, remedy, .. } = self;
        let (time, percent) = (clock(self.lost_s), 100.0 * self.share);
        format!(
            "  below the feed    {time}, {percent:.0} % of the passes of \"{operation}\": {why}, most at line {line}; to \
             save it, {remedy}"
        )
    }
}
