use crate::{AxisKind, AxisLetter, AxisValues};

/// Axis values that bring the tool to a CL point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseSolution {
    /// Axis values, within the limits.
    pub values: AxisValues,
    /// The side of the rotary axis nearest to the tool.
    pub branch: Branch,
    /// At the pole, where the tool axis lies along the rotary axis nearest to the workpiece: the index of that axis. Any
    /// value of it does; `values` holds the reference value, with the linear values that belong to it.
    pub free_axis: Option<usize>,
}

/// The two ways to reach a tool axis: the rotary axis nearest to the tool turns the spindle to its positive or its
/// negative side, counted from where the spindle is nearest to the other rotary axis. On a B-head, C-table machine:
/// B ≥ 0 or B ≤ 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Branch {
    /// B ≥ 0.
    Positive,
    /// B ≤ 0.
    Negative,
}

/// Which branch to take where there is no previous position to stay near to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BranchPreference {
    /// The one nearest to home.
    #[default]
    Nearest,
    /// The positive one, else the negative one.
    Positive,
    /// The negative one, else the positive one.
    Negative,
}

/// All branches within the limits, each once: one or two for a machine with two rotary axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseSolutions {
    pub(crate) first: InverseSolution,
    pub(crate) second: Option<InverseSolution>,
}

/// Why there are no axis values for a CL point.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unreachable {
    /// An axis would leave its limits on every branch; told is the branch with the smallest excess in time of travel.
    #[error(
        "axis {axis} would have to be at {:.4} {unit}, its limits are {:.4} to {:.4}",
        to_word(*kind, *value), to_word(*kind, *min), to_word(*kind, *max),
        unit = if *kind == AxisKind::Linear { "mm" } else { "deg" }
    )]
    AxisLimit {
        /// The axis.
        axis: AxisLetter,
        /// Its index.
        index: usize,
        /// Linear or rotary.
        kind: AxisKind,
        /// Value it would need, mm or rad.
        value: f64,
        /// Lower limit.
        min: f64,
        /// Upper limit.
        max: f64,
    },
    /// No values of the rotary axes turn the tool to this direction.
    #[error("the tool axis is {:.4} deg outside the directions the rotary axes {first} and {second} reach", by.to_degrees())]
    Direction {
        /// Rotary axis nearer to the workpiece.
        first: AxisLetter,
        /// Rotary axis nearer to the tool.
        second: AxisLetter,
        /// Smallest turn that brings the direction into reach, rad.
        by: f64,
    },
    /// In the pose of the rotary axes the linear axes lie in one plane.
    #[error("the linear axes lie in one plane in the pose that the tool axis asks for")]
    Singular,
    /// The CL point is so far away that rounding exceeds the promised accuracy.
    #[error("no solution is accurate to 1e-9 mm and 1e-12 rad there")]
    Inaccurate,
    /// The CL point or the tool length is NaN or infinite.
    #[error("the tool pose has a coordinate that is not finite")]
    NotFinite,
}

impl InverseSolutions {
    /// The solutions; at least one.
    pub fn iter(&self) -> impl Iterator<Item = &InverseSolution> + '_ {
        std::iter::once(&self.first).chain(self.second.as_ref())
    }

    /// Number of solutions.
    #[expect(clippy::len_without_is_empty, reason = "there is always at least one")]
    pub fn len(&self) -> usize {
        1 + usize::from(self.second.is_some())
    }

    /// The solution on this branch, if it is within the limits.
    pub fn on_branch(&self, branch: Branch) -> Option<&InverseSolution> {
        self.iter().find(|s| s.branch == branch)
    }
}

fn to_word(kind: AxisKind, value: f64) -> f64 {
    if kind == AxisKind::Linear { value } else { value.to_degrees() }
}
