use crate::axes::axis::AxisLetter;
use crate::motion::linearise::PoseFraction;
use crate::solver::inverse_solution::Unreachable;

/// Reason why poses cannot be linearised.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LineariseError {
    /// A tolerance is not above 0, or too small to distinguish from rounding.
    #[error("tolerance `{field}` has to be at least 1e-6 mm or 1e-9 rad, a radius finite and not below 0")]
    BadTolerance {
        /// Field of [`MotionTolerance`](crate::motion::linearise::MotionTolerance).
        field: &'static str,
    },
    /// The start position is no position of the machine, or the tool length is not finite.
    #[error("the start is not {n_axes} finite axis values, or the tool length is not finite")]
    BadStart {
        /// Number of axes of the machine.
        n_axes: usize,
    },
    /// The machine does not reach a pose.
    #[error("{place}: {cause}; move the part, choose another posture there, or end the pass before")]
    Unreachable {
        /// The place.
        place: PoseFraction,
        /// The reason.
        cause: Unreachable,
    },
    /// The branch of the pass, or its number of full turns, ends at a limit.
    #[error(
        "{place}: axis {axis} would have to jump by {:.1} deg, because the way that it is on ends at a limit; start on \
         the other branch or another full turn, or retract there and turn", by.to_degrees()
    )]
    Jump {
        /// The place.
        place: PoseFraction,
        /// The rotary axis that jumps farthest.
        axis: AxisLetter,
        /// Angle of the jump, rad.
        by: f64,
    },
    /// The rotary axes cannot follow the tool axis, however close positions are: it is at, or too
    /// near to, the rotary axis nearest to the workpiece.
    #[error(
        "{place}: no step is short enough, because the tool axis is {:.4} deg from rotary axis {axis}, which would \
         have to jump; tilt the tool away from that axis there, or retract and turn", from.to_degrees()
    )]
    Singular {
        /// The place.
        place: PoseFraction,
        /// The rotary axis nearest to the workpiece.
        axis: AxisLetter,
        /// Angle between tool axis and rotary axis, rad.
        from: f64,
    },
    /// Neighbouring tool axes are opposite, which leaves the plane of the turn undefined.
    #[error("{place}: the tool axis reverses to the next pose; put a pose between the two")]
    Reverses {
        /// The place.
        place: PoseFraction,
    },
    /// More positions would be needed than are allowed.
    #[error(
        "{place}: more than {limit} positions are needed to the next pose; allow more, a larger tolerance, or tilt the \
         tool away from the rotary axis nearest to the workpiece"
    )]
    TooMany {
        /// The place.
        place: PoseFraction,
        /// [`Linearisation::max_between`](crate::motion::linearise::Linearisation::max_between).
        limit: usize,
    },
}
