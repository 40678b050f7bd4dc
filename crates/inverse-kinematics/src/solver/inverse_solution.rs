use crate::axes::axis::{AxisKind, AxisLetter};
use crate::axes::axis_values::{AxisValues, MAX_AXES};

/// Axis values that bring the tool to a CL point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseSolution {
    /// Axis values, within the limits. Those of axes that do not move the tool are the reference's.
    pub values: AxisValues,
    /// The side of the rotary axis nearest to the tool.
    pub branch: Branch,
    /// At the pole, where the tool axis lies along the rotary axis nearest to the workpiece: the
    /// index of that axis. Any of its values is a solution; `values` holds the reference value,
    /// with the linear values that belong to it.
    ///
    /// With three rotary axes: the axis that can move on while the others compensate, where
    /// solutions form a whole curve. `values` holds those at its reference value, or at one near
    /// that.
    pub free_axis: Option<usize>,
}

/// The two ways to reach a tool axis: the rotary axis nearest to the tool turns the spindle to its
/// positive or its negative side, counted from where the spindle is nearest to the other rotary
/// axis. On a B-head, C-table machine: B ≥ 0 or B ≤ 0.
///
/// With three rotary axes it is the side of the last one as seen from the middle one, or of the sum
/// of both where they are parallel; there may be several solutions on each side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Branch {
    /// B ≥ 0.
    Positive,
    /// B ≤ 0.
    Negative,
}

/// Branch to take where there is no previous position to stay near to.
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

/// All solutions within the limits, each once.
///
/// With two rotary axes one or two, the positive branch first. With three up to [`MAX_SOLUTIONS`],
/// several on a branch, in the order of the time to reach them from the reference position, so the
/// first one on a branch continues the machine's present position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseSolutions {
    // Entries from `n` on are empty.
    items: [Packed; MAX_SOLUTIONS],
    n: usize,
    kept: Kept,
}

/// Number of joints between the workpiece and every tool that is solved here.
pub(crate) const N_JOINTS: usize = 5;

/// Common part of all solutions for one head of two.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Kept {
    own: OwnAxes,
    /// 0 where all axes move the tool; the rest is unused then.
    n_axes: u8,
    /// Values of the axes that do not move the tool, ascending.
    others: [f64; MAX_AXES - N_JOINTS],
}

impl Kept {
    const NONE: Self = Self { own: [0; N_JOINTS], n_axes: 0, others: [0.0; MAX_AXES - N_JOINTS] };

    #[cold]
    #[inline(never)]
    fn new(values: &AxisValues, own: OwnAxes) -> Self {
        let mut kept = Self { own, n_axes: values.len() as u8, others: [0.0; MAX_AXES - N_JOINTS] };
        let is_other = |k: &usize| !own.iter().any(|o| usize::from(*o) == *k);
        for (to, k) in kept.others.iter_mut().zip((0..values.len()).filter(is_other)) {
            *to = values[k];
        }
        kept
    }

    /// Returns all values, with `own` for the axes that move the tool.
    #[inline(never)]
    fn with(&self, own: &[f64; N_JOINTS]) -> AxisValues {
        let (mut others, mut moving) = (self.others.iter(), self.own.iter().zip(own).peekable());
        AxisValues::from_fn(usize::from(self.n_axes), |k| match moving.next_if(|(o, _)| usize::from(**o) == k) {
            Some((_, value)) => *value,
            None => others.next().copied().unwrap_or_default(),
        })
    }
}

/// Indices of the axes that move the tool, ascending.
pub(crate) type OwnAxes = [u8; N_JOINTS];

/// A solution in less than half the space, because solutions are made and copied by the million.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Packed {
    values: [f64; N_JOINTS],
    branch: Branch,
    free_axis: Option<u8>,
}

impl Packed {
    const EMPTY: Self = Self { values: [0.0; N_JOINTS], branch: Branch::Positive, free_axis: None };

    #[inline]
    fn new(solution: &InverseSolution, kept: &Kept) -> Self {
        let values = &solution.values;
        Self {
            values: match kept.n_axes {
                0 => std::array::from_fn(|k| values.get_or_zero(k)),
                _ => kept.own.map(|k| values.get_or_zero(usize::from(k))),
            },
            branch: solution.branch,
            free_axis: solution.free_axis.and_then(|k| u8::try_from(k).ok()),
        }
    }

    fn unpacked(&self, kept: &Kept) -> InverseSolution {
        let values = match kept.n_axes {
            0 => AxisValues::from(self.values),
            _ => kept.with(&self.values),
        };
        InverseSolution { values, branch: self.branch, free_axis: self.free_axis.map(usize::from) }
    }
}

/// Largest number of solutions of any pose, apart from windings: two with two rotary axes; with
/// three twelve, the roots of a polynomial.
pub const MAX_SOLUTIONS: usize = 12;

/// Reason why there are no axis values for a CL point.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unreachable {
    /// An axis would leave its limits on every branch; holds the branch with the smallest excess
    /// in time of travel.
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
    /// With two linear axes: no pose of the rotary axes with this tool axis has the tip in the
    /// plane in which they move it.
    #[error("the linear axes {first} and {second} miss the tip by {by:.4} mm in every pose that gives the tool axis")]
    Tip {
        /// Linear axis nearer to the workpiece.
        first: AxisLetter,
        /// Linear axis nearer to the tool.
        second: AxisLetter,
        /// Distance of the tip from the plane at the best of the poses tried, mm; a smaller one may
        /// be missed.
        by: f64,
    },
    /// In the pose of the rotary axes the linear axes lie in one plane.
    #[error("the linear axes are dependent in the pose that the tool axis asks for")]
    Singular,
    /// The CL point is so far away that rounding exceeds the promised accuracy.
    #[error("no solution is accurate to 1e-9 mm and 1e-12 rad there")]
    Inaccurate,
    /// The CL point or the tool length is NaN or infinite.
    #[error("the tool pose has a coordinate that is not finite")]
    NotFinite,
}

impl InverseSolutions {
    /// Stores a single solution; for one head of two only the axes that move its tool, the others
    /// as in the first solution of all.
    #[inline]
    pub(crate) fn one(first: &InverseSolution, own: Option<OwnAxes>) -> Self {
        let kept = own.map_or(Kept::NONE, |own| Kept::new(&first.values, own));
        let mut all = Self { items: [Packed::EMPTY; MAX_SOLUTIONS], n: 0, kept };
        all.push(first);
        all
    }

    /// Adds a solution; solutions that do not fit are dropped.
    #[inline]
    pub(crate) fn push(&mut self, solution: &InverseSolution) {
        if self.n < MAX_SOLUTIONS {
            self.items[self.n] = Packed::new(solution, &self.kept);
            self.n += 1;
        }
    }

    /// Sorts the solutions in ascending order of a measure; equal ones keep their order.
    pub(crate) fn sort_by_measure(&mut self, measure: impl Fn(&InverseSolution) -> f64) {
        let kept = self.kept;
        let of = |packed: &Packed| measure(&packed.unpacked(&kept));
        for k in 1..self.n {
            for i in (0..k).rev() {
                if of(&self.items[i + 1]) < of(&self.items[i]) {
                    self.items.swap(i, i + 1);
                } else {
                    break;
                }
            }
        }
    }

    /// Iterates over the solutions; at least one.
    pub fn iter(&self) -> impl Iterator<Item = InverseSolution> + '_ {
        self.items[..self.n].iter().map(|packed| packed.unpacked(&self.kept))
    }

    /// Returns the number of solutions.
    #[expect(clippy::len_without_is_empty, reason = "there is always at least one")]
    pub fn len(&self) -> usize {
        self.n
    }

    /// Returns the (first) solution on this branch that is within the limits.
    pub fn on_branch(&self, branch: Branch) -> Option<InverseSolution> {
        self.iter().find(|s| s.branch == branch)
    }
}

fn to_word(kind: AxisKind, value: f64) -> f64 {
    if kind == AxisKind::Linear { value } else { value.to_degrees() }
}

/// Largest difference between a CL point and the forward solution of its axis values, mm.
pub(crate) const TIP_ACCURACY: f64 = 1e-9;
