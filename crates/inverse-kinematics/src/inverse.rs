use std::f64::consts::TAU;

use facemill_cl_data::ClPoint;

use crate::{
    Axis, AxisKind, AxisValues, Branch, BranchPreference, InverseSolution, InverseSolutions, Machine, Unreachable,
    direction_pair::PairSolution,
};

/// Largest difference between a CL point and the forward solution of its axis values, mm.
const TIP_ACCURACY: f64 = 1e-9;
/// The same for the tool axis, rad.
const AXIS_ACCURACY: f64 = 1e-12;
/// Excess over a limit that is rounding and cut off, mm or rad. Above the accuracies it would break their promise; far
/// below it a pose computed from a limit value would be refused.
const LIMIT_SLACK: [f64; 2] = [2e-10, 2e-13];

impl Machine {
    /// All branches within the limits for a tool pose in the table frame. Rotary values are those nearest to home; where
    /// one is [free](InverseSolution::free_axis) it stands at home.
    ///
    /// Closed form, no allocation. The forward solution of every result differs from `cl` by at most 1e-9 mm and
    /// 1e-12 rad (and by the rounding of a rotary value that has wound up many turns).
    ///
    /// # Errors
    /// When no branch is within the limits; see [`Unreachable`].
    pub fn inverse(&self, cl: &ClPoint, tool_length: f64) -> Result<InverseSolutions, Unreachable> {
        self.inverse_near(cl, tool_length, &self.home())
    }

    /// As [`Machine::inverse`], with the rotary values within the limits that are nearest to those of `reference`; a
    /// free axis stays where it is there.
    ///
    /// # Errors
    /// As [`Machine::inverse`].
    pub fn inverse_near(
        &self,
        cl: &ClPoint,
        tool_length: f64,
        reference: &AxisValues,
    ) -> Result<InverseSolutions, Unreachable> {
        // A free axis stays at the reference, so that has to be within the limits.
        let reference = AxisValues::from_fn(self.axes.len(), |k| {
            let axis = &self.axes[k];
            let value = reference.get_or_zero(k);
            if value.is_finite() { value.clamp(axis.min, axis.max) } else { axis.home }
        });
        let (first, second) = self.unlimited(cl, tool_length, &reference)?;
        let first = self.within_limits(first);
        let second = second.map(|s| self.within_limits(s));
        match (first, second) {
            (Ok(first), None | Some(Err(_))) => Ok(InverseSolutions { first, second: None }),
            (Ok(first), Some(Ok(second))) => Ok(InverseSolutions { first, second: Some(second) }),
            (Err(_), Some(Ok(first))) => Ok(InverseSolutions { first, second: None }),
            (Err(e), None) => Err(e),
            (Err(e), Some(Err(other))) => Err(if self.excess(&other) < self.excess(&e) { other } else { e }),
        }
    }

    /// The one solution to take.
    ///
    /// With a previous position: the solution that is reached from it first, every axis moving at its largest speed; full
    /// turns are unrolled and at the pole the free axis stays. Without: the preferred branch.
    ///
    /// # Errors
    /// As [`Machine::inverse`].
    pub fn nearest_inverse(
        &self,
        cl: &ClPoint,
        tool_length: f64,
        previous: Option<&AxisValues>,
        preferred: BranchPreference,
    ) -> Result<AxisValues, Unreachable> {
        let reference = previous.copied().unwrap_or_else(|| self.home());
        let solutions = self.inverse_near(cl, tool_length, &reference)?;
        let preferred = match (previous, preferred) {
            (None, BranchPreference::Positive) => solutions.on_branch(Branch::Positive),
            (None, BranchPreference::Negative) => solutions.on_branch(Branch::Negative),
            _ => None,
        };
        let time = |s: &InverseSolution| self.travel_time(&reference, &s.values);
        let nearest = match &solutions.second {
            Some(second) if time(second) < time(&solutions.first) => second,
            _ => &solutions.first,
        };
        Ok(preferred.unwrap_or(nearest).values)
    }

    /// The branch that a position is on; at the border between the two, and at the pole, the positive one.
    pub fn branch_of(&self, q: &AxisValues) -> Branch {
        let second = q.get_or_zero(self.rotaries.second.axis);
        if self.rotaries.is_positive(second) { Branch::Positive } else { Branch::Negative }
    }

    /// Time in which every axis has got from one position to another at its largest speed, s (no acceleration).
    pub fn travel_time(&self, from: &AxisValues, to: &AxisValues) -> f64 {
        let time = |k: usize| (to.get_or_zero(k) - from.get_or_zero(k)).abs() / self.axes[k].max_velocity;
        (0..self.axes.len()).map(time).fold(0.0, f64::max)
    }

    /// One or two solutions, their rotary values at the winding nearest to the finite `reference`; limits are not asked.
    pub(crate) fn unlimited(
        &self,
        cl: &ClPoint,
        tool_length: f64,
        reference: &AxisValues,
    ) -> Result<(InverseSolution, Option<InverseSolution>), Unreachable> {
        let finite = cl.tip.coords.iter().chain(cl.axis.iter()).all(|v| v.is_finite()) && tool_length.is_finite();
        if !finite {
            return Err(Unreachable::NotFinite);
        }
        let first_axis = self.rotaries.first.axis;
        let solve = |pair, free| self.with_rotaries(cl, tool_length, reference, pair, free);
        match self.rotaries.solve(&cl.axis) {
            PairSolution::Two { positive, negative } => match (solve(positive, None), solve(negative, None)) {
                (Ok(positive), negative) => Ok((positive, negative.ok())),
                (Err(_), Ok(negative)) => Ok((negative, None)),
                (Err(e), Err(_)) => Err(e),
            },
            PairSolution::One(pair) => Ok((solve(pair, None)?, None)),
            PairSolution::FirstFree(second) => {
                Ok((solve([reference.get_or_zero(first_axis), second], Some(first_axis))?, None))
            }
            PairSolution::Beyond(by) => Err(Unreachable::Direction {
                first: self.axes[first_axis].letter,
                second: self.axes[self.rotaries.second.axis].letter,
                by,
            }),
        }
    }

    /// The linear values for a pair of rotary values, checked by the forward solution.
    fn with_rotaries(
        &self,
        cl: &ClPoint,
        tool_length: f64,
        reference: &AxisValues,
        pair: [f64; 2],
        free_axis: Option<usize>,
    ) -> Result<InverseSolution, Unreachable> {
        let (first, second) = (self.rotaries.first.axis, self.rotaries.second.axis);
        let mut values = AxisValues::zeros(self.axes.len());
        for (axis, value) in [(first, pair[0]), (second, pair[1])] {
            values[axis] = nearest_turn(value, reference.get_or_zero(axis));
        }
        let map = self.linear_map(&values, tool_length);
        let linears = map.solve(&cl.tip).ok_or(Unreachable::Singular)?;
        for (k, &axis) in self.linears.iter().enumerate() {
            values[axis] = linears[k];
        }
        let tip_error = (map.tip(&linears) - cl.tip.coords).norm();
        let axis_error = (map.tool_axis - cl.axis.into_inner()).norm();
        // After many turns of an endless axis the rounding of its value alone exceeds the accuracy.
        let rounding = f64::EPSILON * (values[first].abs() + values[second].abs());
        let exact =
            tip_error <= TIP_ACCURACY - LIMIT_SLACK[0] && axis_error <= AXIS_ACCURACY - LIMIT_SLACK[1] + rounding;
        if !exact {
            return Err(Unreachable::Inaccurate);
        }
        let branch = if self.rotaries.is_positive(pair[1]) { Branch::Positive } else { Branch::Negative };
        Ok(InverseSolution { values, branch, free_axis })
    }

    fn within_limits(&self, mut solution: InverseSolution) -> Result<InverseSolution, Unreachable> {
        for (index, axis) in self.axes.iter().enumerate() {
            let value = match axis.kind {
                AxisKind::Linear => solution.values[index],
                AxisKind::Rotary => turn_within(axis, solution.values[index]),
            };
            let inside = value.clamp(axis.min, axis.max);
            if (value - inside).abs() > slack(axis) {
                let &Axis { letter, kind, min, max, .. } = axis;
                return Err(Unreachable::AxisLimit { axis: letter, index, kind, value, min, max });
            }
            solution.values[index] = inside;
        }
        Ok(solution)
    }

    /// Time of travel by which a limit is exceeded, s.
    fn excess(&self, e: &Unreachable) -> f64 {
        match *e {
            Unreachable::AxisLimit { index, value, min, max, .. } => {
                (value - value.clamp(min, max)).abs() / self.axes[index].max_velocity
            }
            _ => f64::INFINITY,
        }
    }
}

fn slack(axis: &Axis) -> f64 {
    match axis.kind {
        AxisKind::Linear => LIMIT_SLACK[0],
        AxisKind::Rotary => LIMIT_SLACK[1],
    }
}

/// The value plus full turns that is nearest to `reference`.
pub(crate) fn nearest_turn(value: f64, reference: f64) -> f64 {
    value + TAU * ((reference - value) / TAU).round()
}

/// The value plus the fewest full turns that bring it within the limits, or, where no turn does, nearest to them.
fn turn_within(axis: &Axis, value: f64) -> f64 {
    if axis.holds(value) {
        return value;
    }
    let slack = slack(axis);
    let (fewest, most) = (((axis.min - slack - value) / TAU).ceil(), ((axis.max + slack - value) / TAU).floor());
    if fewest <= most {
        return value + TAU * 0.0_f64.clamp(fewest, most);
    }
    // No turn fits: `most` is the last one below the range, `fewest` the first one above it.
    let (below, above) = (value + TAU * most, value + TAU * fewest);
    if axis.min - below <= above - axis.max { below } else { above }
}
