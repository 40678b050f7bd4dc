//! Choice of solutions along a path: settings, result and errors.

use crate::axes::axis::AxisLetter;
use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;
use crate::solver::inverse_solution::Unreachable;

/// Kind of a segment between two neighbouring poses of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SegmentKind {
    /// The tool cuts: the axes have to move on continuously.
    Cut,
    /// The tool is clear of the part: anything may turn.
    Link,
}

/// Motion of the axes between two poses that differs from the ideal one: the tip on a straight
/// line, the tool axis turning evenly in the plane of its ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Change {
    /// A limited rotary axis turns back, or on, by full turns in addition to the motion. Holds the
    /// axis with the most turns; where two turn in one segment, the values show the other.
    Rewind {
        /// Index of the axis.
        axis: usize,
        /// Full turns, in the axis's sense.
        turns: i32,
    },
    /// The next pose is reached by another solution than that of the continued motion, or the
    /// motion leaves the reach of the rotary axes.
    Flip,
}

/// A change between pose `segment` and the one behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathChange {
    /// Index of the segment.
    pub segment: usize,
    /// Kind of the change.
    pub change: Change,
}

/// The turn of a rotary axis while the tool axis lies along it, which leaves the tool where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeTurn {
    /// First pose of the stretch in which the axis is free.
    pub first: usize,
    /// Last pose of it. If it is the first one, the axis turns while the tip is at rest there, and
    /// the values hold `from`.
    pub last: usize,
    /// Index of the axis.
    pub axis: usize,
    /// Value at its start, rad.
    pub from: f64,
    /// Value at its end, rad.
    pub to: f64,
}

/// Poses near the singular direction, along the rotary axis nearest to the workpiece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingularStretch {
    /// First pose within the cone.
    pub first: usize,
    /// Last pose within the cone.
    pub last: usize,
    /// Smallest angle of a pose's tool axis to the singular direction, rad.
    pub smallest_angle: f64,
    /// Largest turn of a rotary axis per way of the tip in a cut that begins or ends in the
    /// stretch, rad/mm; infinite where an axis turns while the tip is at rest.
    pub largest_speed: f64,
}

/// The axis values of a whole path.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PathChoice {
    /// Axis values of every pose; endless axes are unrolled.
    pub values: Vec<AxisValues>,
    /// Changes in cuts: the tool has to be retracted there, the axes turned, and the tool returned.
    pub breaks: Vec<PathChange>,
    /// Changes on links.
    pub link_turns: Vec<PathChange>,
    /// Turns of a free axis.
    pub free_turns: Vec<FreeTurn>,
    /// Stretches within [`PathSettings::singular_cone`], ascending.
    pub singular: Vec<SingularStretch>,
    /// Last criterion of the choice: sum over segments of the weighted time of the slowest axis, s.
    pub weighted_time: f64,
}

/// Cost settings of a path in addition to its changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSettings {
    /// Factor on the travel time of every axis, 0 or more.
    pub weights: AxisValues,
    /// Half angle of the cone about the singular direction within which poses are reported, rad.
    pub singular_cone: f64,
    /// Whether the path begins with the solution at `start`, with any full turns, if that is one of
    /// the first pose.
    pub begins_at_start: bool,
}

impl PathSettings {
    /// Returns weights of 1, a cone of 5°, and any solution at the start.
    pub fn new(machine: &Machine) -> Self {
        let weights = AxisValues::from_fn(machine.axes().len(), |_| 1.0);
        Self { weights, singular_cone: 5.0_f64.to_radians(), begins_at_start: false }
    }
}

/// Reason why no axis values are chosen for a path.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PathError {
    /// There are no poses.
    #[error("the path has no poses")]
    NoPoses,
    /// The number of segments is not one between every two neighbouring poses.
    #[error("{poses} poses have {} segments between them, not {segments}", poses - 1)]
    SegmentCount {
        /// Number of poses.
        poses: usize,
        /// Number of segments given.
        segments: usize,
    },
    /// A weight is missing, below 0 or not finite.
    #[error("the weight of axis {axis} is {value}, but has to be a number of 0 or more")]
    Weight {
        /// The axis.
        axis: AxisLetter,
        /// The weight.
        value: f64,
    },
    /// The cone is not an angle.
    #[error("the cone about the singular direction is {0}, but has to be an angle of 0 or more, rad")]
    Cone(f64),
    /// The start position is not one finite value for each axis.
    #[error("the start position is not {n_axes} finite axis values")]
    Start {
        /// Number of axes of the machine.
        n_axes: usize,
    },
    /// A pose has no solution.
    #[error("pose {index} (counted from 0) cannot be reached: {reason}")]
    Unreachable {
        /// Index of the pose.
        index: usize,
        /// The reason.
        reason: Unreachable,
    },
    /// The limits of the rotary axes allow more positions than are evaluated.
    #[error(
        "pose {index} has {found} or more positions within the limits of the rotary axes, {most} are looked at; narrow \
         the limits"
    )]
    TooManyWindings {
        /// Index of the pose.
        index: usize,
        /// Positions found.
        found: usize,
        /// Largest number of positions evaluated.
        most: usize,
    },
}
