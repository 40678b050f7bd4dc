//! Inverse solution: axis values of a tool pose.

pub(crate) mod all_solutions;
pub(crate) mod axis_ranges;
pub(crate) mod axis_reach;
pub(crate) mod control_choice;
pub(crate) mod numeric_inverse;
pub(crate) mod tip_held;
pub(crate) mod ways_on_bed;
pub(crate) mod windings;

pub use crate::inverse::axis_ranges::{AxisRange, AxisRanges, LimitVerdict, PoseSet};
pub use crate::inverse::axis_reach::{AxisReach, SingularDirection};

use std::f64::consts::{PI, TAU};

use facemill_cl_data::ClPoint;
use nalgebra::Vector3;

use crate::axes::axis::{Axis, AxisKind, Carrier};
use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;
use crate::solver::Solver;
use crate::solver::direction_pair::{DirectionPair, PairSolution, Turned};
use crate::solver::inverse_solution::{
    Branch, BranchPreference, InverseSolution, InverseSolutions, TIP_ACCURACY, Unreachable,
};

/// The same for the tool axis, rad.
const AXIS_ACCURACY: f64 = 1e-12;

/// Excess over a limit that counts as rounding and is cut off, mm or rad. Above the accuracies it
/// would break their guarantee; far below it a pose computed from a limit value would be refused.
const LIMIT_SLACK: [f64; 2] = [2e-10, 2e-13];

/// Differences of cosines from those at the poles and at the edges of the reach above which the
/// shorter formulas are used: they lose the digits by which these differ from 1. The accuracies
/// leave two digits, unchecked solutions four.
const FAR_FROM_SINGULAR: f64 = 1e-2;

const BESIDE_SINGULAR: f64 = 1e-4;

impl Machine {
    /// Returns all solutions within the limits for a tool pose in the table frame, each at the
    /// winding nearest to home. A [free](InverseSolution::free_axis) rotary axis is at home, as are
    /// axes that do not [move the tool](Machine::moves_tool).
    ///
    /// Closed form for three linear and two rotary axes; for two and three all roots of a
    /// polynomial of degree 12. No allocation. The forward solution of every result differs from
    /// `cl` by at most 1e-9 mm and 1e-12 rad (and by the rounding of a rotary value that has wound
    /// up many turns).
    ///
    /// # Errors
    /// When no solution is within the limits; see [`Unreachable`].
    pub fn inverse(&self, cl: &ClPoint, tool_length: f64) -> Result<InverseSolutions, Unreachable> {
        self.inverse_near(cl, tool_length, &self.home())
    }

    /// Returns all solutions for a tool pose in the table frame without regard to limits, each at
    /// the winding nearest to home.
    ///
    /// For three linear and two rotary axes the forward solution is not evaluated either: away from
    /// singular poses it differs from `cl` by some rounding (1e-15 of the lengths), near them by
    /// more. Two linear and three rotary axes are solved as by [`Machine::inverse`].
    ///
    /// Shows how far an axis is beyond its limit where [`Machine::inverse`] refuses a pose:
    ///
    /// ```
    /// use facemill_cl_data::ClPoint;
    /// use facemill_inverse_kinematics::Machine;
    /// use nalgebra::{Point3, Vector3};
    ///
    /// let machine = Machine::head_b_table_c()?;
    /// let pose = ClPoint { tip: Point3::new(0.0, 0.0, 5000.0), axis: Vector3::z_axis() };
    /// assert!(machine.inverse(&pose, 250.0).is_err());
    /// let z_axis = &machine.axes()[2];
    /// let above = |z: f64| z - z_axis.max;
    /// let all = machine.inverse_unchecked(&pose, 250.0)?;
    /// assert!(all.iter().all(|s| above(s.values[2]) > 1000.0), "Z lacks more than a metre");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When there is none; see [`Unreachable`].
    pub fn inverse_unchecked(&self, cl: &ClPoint, tool_length: f64) -> Result<InverseSolutions, Unreachable> {
        let home = self.home();
        if is_finite(cl, tool_length)
            && let Some([positive, negative]) = self.both_regular(cl, tool_length, &home, BESIDE_SINGULAR)
        {
            let on = |values, branch| InverseSolution { values, branch, free_axis: None };
            let mut both = InverseSolutions::one(&on(positive, Branch::Positive), self.own_axes());
            both.push(&on(negative, Branch::Negative));
            return Ok(both);
        }
        self.unlimited(cl, tool_length, &home)
    }

    /// Solves as [`Machine::inverse`], with the rotary values within the limits that are nearest to
    /// those of `reference`. A free axis keeps its value there, as do axes that do not move the
    /// tool, whatever their limits (home for a value that is not finite). With three rotary axes a
    /// free axis moves from there if nothing else is reached: with the tool along the first of
    /// parallel ones to the nearest solution, on another curve of solutions by steps of 2°.
    ///
    /// # Errors
    /// As [`Machine::inverse`].
    pub fn inverse_near(
        &self,
        cl: &ClPoint,
        tool_length: f64,
        reference: &AxisValues,
    ) -> Result<InverseSolutions, Unreachable> {
        let reference = self.inside(reference);
        match &self.solver {
            Solver::Closed { rotaries, .. } => {
                let (first, second) = self.unlimited_pair(rotaries, cl, tool_length, &reference)?;
                self.pair_within_limits(first, second)
            }
            Solver::Numeric(numeric) => {
                let all = self.unlimited_numeric(numeric, cl, tool_length, &reference)?;
                let mut within = match self.all_within_limits(all.iter()) {
                    Err(beyond) => self.along_curve(numeric, cl, tool_length, &reference, &all).ok_or(beyond)?,
                    Ok(within) => within,
                };
                within.sort_by_measure(|s| self.travel_time(&reference, &s.values));
                Ok(within)
            }
        }
    }

    /// Selects as [`Machine::all_within_limits`], from one or two solutions.
    fn pair_within_limits(
        &self,
        first: InverseSolution,
        second: Option<InverseSolution>,
    ) -> Result<InverseSolutions, Unreachable> {
        let own = self.own_axes();
        match (self.within_limits(first), second.map(|second| self.within_limits(second))) {
            (Ok(first), Some(Ok(second))) => {
                let mut both = InverseSolutions::one(&first, own);
                both.push(&second);
                Ok(both)
            }
            (Ok(only), _) | (Err(_), Some(Ok(only))) => Ok(InverseSolutions::one(&only, own)),
            (Err(first), Some(Err(second))) if self.excess(&second) < self.excess(&first) => Err(second),
            (Err(first), _) => Err(first),
        }
    }

    /// Returns the solutions within the limits, or the excess of the nearest to them.
    pub(crate) fn all_within_limits(
        &self,
        solutions: impl Iterator<Item = InverseSolution>,
    ) -> Result<InverseSolutions, Unreachable> {
        let mut within: Option<InverseSolutions> = None;
        let mut why = Unreachable::Inaccurate;
        let mut least = f64::INFINITY;
        for solution in solutions {
            match (self.within_limits(solution), &mut within) {
                (Ok(solution), Some(within)) => within.push(&solution),
                (Ok(solution), None) => within = Some(InverseSolutions::one(&solution, self.own_axes())),
                (Err(e), _) if self.excess(&e) < least => (least, why) = (self.excess(&e), e),
                (Err(_), _) => {}
            }
        }
        within.ok_or(why)
    }

    /// Returns the one solution to take.
    ///
    /// With a previous position: the solution that is reached from it first, every axis moving at
    /// its largest speed; full turns are unrolled and at the pole the free axis stays. On a machine
    /// with three rotary axes, where Newton's method from that position finds a solution within 5°
    /// of it, that solution. Without a previous position: the preferred branch.
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
        if let (Solver::Numeric(numeric), Some(previous)) = (&self.solver, previous)
            && let Some(values) = self.continued(numeric, cl, tool_length, previous)
        {
            return Ok(values);
        }
        let solutions = self.inverse_near(cl, tool_length, &reference)?;
        let preferred = match (previous, preferred) {
            (None, BranchPreference::Positive) => solutions.on_branch(Branch::Positive),
            (None, BranchPreference::Negative) => solutions.on_branch(Branch::Negative),
            _ => None,
        };
        let time = |s: &InverseSolution| self.travel_time(&reference, &s.values);
        let sooner = |a: InverseSolution, b: InverseSolution| if time(&b) < time(&a) { b } else { a };
        match preferred.or_else(|| solutions.iter().reduce(sooner)) {
            Some(solution) => Ok(solution.values),
            None => Err(Unreachable::Inaccurate),
        }
    }

    /// Returns the branch of a position; at the border between the two, and at the pole, the
    /// positive one.
    pub fn branch_of(&self, q: &AxisValues) -> Branch {
        match &self.solver {
            Solver::Closed { rotaries, .. } if rotaries.is_positive(q.get_or_zero(rotaries.second.axis)) => {
                Branch::Positive
            }
            Solver::Closed { .. } => Branch::Negative,
            Solver::Numeric(numeric) => numeric.branch_of(numeric.rotaries.map(|k| q.get_or_zero(k))),
        }
    }

    /// Returns the time for every axis to move from one position to another at its largest speed, s
    /// (no acceleration).
    pub fn travel_time(&self, from: &AxisValues, to: &AxisValues) -> f64 {
        let time = |k: usize| (to.get_or_zero(k) - from.get_or_zero(k)).abs() / self.axes[k].max_velocity;
        (0..self.axes.len()).map(time).fold(0.0, f64::max)
    }

    /// Returns the solutions, their rotary values at the winding nearest to the finite `reference`,
    /// without testing limits.
    pub(crate) fn unlimited(
        &self,
        cl: &ClPoint,
        tool_length: f64,
        reference: &AxisValues,
    ) -> Result<InverseSolutions, Unreachable> {
        match &self.solver {
            Solver::Closed { rotaries, .. } => {
                let (first, second) = self.unlimited_pair(rotaries, cl, tool_length, reference)?;
                let mut all = InverseSolutions::one(&first, self.own_axes());
                if let Some(second) = second {
                    all.push(&second);
                }
                Ok(all)
            }
            Solver::Numeric(numeric) => self.unlimited_numeric(numeric, cl, tool_length, reference),
        }
    }

    /// Returns both solutions of two rotary joints, the positive one first, without a check; `None`
    /// near singular poses, which are recognised by cosines as in [`DirectionPair::solve_regular`].
    fn both_regular(
        &self,
        cl: &ClPoint,
        tool_length: f64,
        reference: &AxisValues,
        apart: f64,
    ) -> Option<[AxisValues; 2]> {
        let Solver::Closed { rotaries, linears, tables } = &self.solver else { return None };
        let [positive, negative] = rotaries.solve_regular(&cl.axis, apart)?;
        let tables = tables.at(&cl.tip, tool_length);
        let axes = [rotaries.first.axis, rotaries.second.axis];
        let of = |turned: [Turned; 2]| {
            let mut values = self.kept(reference);
            for (&axis, value) in linears.iter().zip(tables.solve(turned.map(|t| t.direction))?) {
                values[axis] = value;
            }
            for (axis, turned) in axes.into_iter().zip(turned) {
                values[axis] = nearest_turn(turned.value, reference.get_or_zero(axis));
            }
            Some(values)
        };
        Some([of(positive)?, of(negative)?])
    }

    /// Returns whether the forward solution is at `cl`, to the guaranteed accuracy.
    fn reaches(&self, values: &AxisValues, cl: &ClPoint, tool_length: f64, turned: f64) -> bool {
        let map = self.linear_map(values, tool_length);
        let linears = self.linears_of(values);
        is_exact(&(map.tip(&linears) - cl.tip.coords), &(map.tool_axis - cl.axis.into_inner()), turned)
    }

    /// Solves as [`Machine::unlimited`], for two rotary joints.
    pub(crate) fn unlimited_pair(
        &self,
        rotaries: &DirectionPair,
        cl: &ClPoint,
        tool_length: f64,
        reference: &AxisValues,
    ) -> Result<(InverseSolution, Option<InverseSolution>), Unreachable> {
        if !is_finite(cl, tool_length) {
            return Err(Unreachable::NotFinite);
        }
        let axes = [rotaries.first.axis, rotaries.second.axis];
        let solve = |pair: [f64; 2], free| {
            let branch = if rotaries.is_positive(pair[1]) { Branch::Positive } else { Branch::Negative };
            let values = self.with_rotaries(cl, tool_length, reference, axes.into_iter().zip(pair))?;
            Ok(InverseSolution { values, branch, free_axis: free })
        };
        if let Some([positive, negative]) = self.both_regular(cl, tool_length, reference, FAR_FROM_SINGULAR) {
            let turned = |q: &AxisValues| axes.iter().map(|&k| q.get_or_zero(k).abs()).sum();
            if [&positive, &negative].into_iter().all(|q| self.reaches(q, cl, tool_length, turned(q))) {
                let on = |values, branch| InverseSolution { values, branch, free_axis: None };
                return Ok((on(positive, Branch::Positive), Some(on(negative, Branch::Negative))));
            }
        }
        match rotaries.solve(&cl.axis) {
            PairSolution::Two { positive, negative } => match (solve(positive, None), solve(negative, None)) {
                (Ok(positive), negative) => Ok((positive, negative.ok())),
                (Err(_), Ok(negative)) => Ok((negative, None)),
                (Err(e), Err(_)) => Err(e),
            },
            PairSolution::One(pair) => Ok((solve(pair, None)?, None)),
            PairSolution::FirstFree(second) => {
                Ok((solve([reference.get_or_zero(axes[0]), second], Some(axes[0]))?, None))
            }
            PairSolution::Beyond(by) => Err(self.direction_missed(axes[0], axes[1], by)),
        }
    }

    /// Returns the values of all axes for these rotary ones, checked by the forward solution.
    pub(crate) fn with_rotaries(
        &self,
        cl: &ClPoint,
        tool_length: f64,
        reference: &AxisValues,
        rotary: impl Iterator<Item = (usize, f64)>,
    ) -> Result<AxisValues, Unreachable> {
        let mut values = self.kept(reference);
        let mut turned = 0.0;
        for (axis, value) in rotary {
            values[axis] = nearest_turn(value, reference.get_or_zero(axis));
            turned += values[axis].abs();
        }
        let map = self.linear_map(&values, tool_length);
        let linears = self.solve_linears(&map, &cl.tip).ok_or(Unreachable::Singular)?;
        for (k, &axis) in self.solver.linears().iter().enumerate() {
            values[axis] = linears[k];
        }
        let [tip_error, axis_error] = [map.tip(&linears) - cl.tip.coords, map.tool_axis - cl.axis.into_inner()];
        if is_exact(&tip_error, &axis_error, turned) {
            return Ok(values);
        }
        match self.solver {
            Solver::Closed { .. } => Err(Unreachable::Inaccurate),
            Solver::Numeric(_) => self.refined(cl, tool_length, values, turned),
        }
    }

    pub(crate) fn direction_missed(&self, first: usize, second: usize, by: f64) -> Unreachable {
        Unreachable::Direction { first: self.axes[first].letter, second: self.axes[second].letter, by }
    }

    /// Returns the position with every value within its limits: a free axis stays at the reference,
    /// so the reference has to be. Values of the other head are left as they are.
    fn inside(&self, reference: &AxisValues) -> AxisValues {
        AxisValues::from_fn(self.axes.len(), |k| {
            let axis = &self.axes[k];
            let value = reference.get_or_zero(k);
            match value.is_finite() {
                true if axis.carried_by == Carrier::OtherHead => value,
                true => value.clamp(axis.min, axis.max),
                false => axis.home,
            }
        })
    }

    /// Returns storage for the values of a solution, with axes that do not move the tool as in the
    /// reference.
    #[inline]
    fn kept(&self, reference: &AxisValues) -> AxisValues {
        let mut values = AxisValues::zeros(self.axes.len());
        if self.other.is_some() {
            self.keep_others(&mut values, reference);
        }
        values
    }

    // Kept out of the path of machines with one head, whose solutions take no longer for it.
    #[cold]
    #[inline(never)]
    fn keep_others(&self, values: &mut AxisValues, reference: &AxisValues) {
        (0..values.len()).for_each(|k| values[k] = reference.get_or_zero(k));
    }

    pub(crate) fn within_limits(&self, mut solution: InverseSolution) -> Result<InverseSolution, Unreachable> {
        for (index, axis) in self.axes.iter().enumerate() {
            if axis.carried_by == Carrier::OtherHead {
                continue;
            }
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

    /// Returns the time of travel by which a limit is exceeded, s.
    fn excess(&self, e: &Unreachable) -> f64 {
        match *e {
            Unreachable::AxisLimit { index, value, min, max, .. } => {
                (value - value.clamp(min, max)).abs() / self.axes[index].max_velocity
            }
            _ => f64::INFINITY,
        }
    }
}

pub(crate) fn is_finite(cl: &ClPoint, tool_length: f64) -> bool {
    let (p, a) = (&cl.tip, &cl.axis);
    let tip = p.x.is_finite() & p.y.is_finite() & p.z.is_finite();
    tip & a.x.is_finite() & a.y.is_finite() & a.z.is_finite() & tool_length.is_finite()
}

/// Returns whether a pose is met to the guaranteed accuracy, with an allowance for the rounding of
/// rotary values with this sum: after many turns of an endless axis it alone exceeds the accuracy.
pub(crate) fn is_exact(tip_error: &Vector3<f64>, axis_error: &Vector3<f64>, turned: f64) -> bool {
    tip_error.norm() <= TIP_ACCURACY - LIMIT_SLACK[0]
        && axis_error.norm() <= AXIS_ACCURACY - LIMIT_SLACK[1] + f64::EPSILON * turned
}

fn slack(axis: &Axis) -> f64 {
    match axis.kind {
        AxisKind::Linear => LIMIT_SLACK[0],
        AxisKind::Rotary => LIMIT_SLACK[1],
    }
}

/// Returns the value plus the full turns that bring it nearest to `reference`.
pub(crate) fn nearest_turn(value: f64, reference: f64) -> f64 {
    let way = reference - value;
    // Mostly there is nothing to turn; rounding is a call.
    if way.abs() < PI { value } else { value + TAU * (way / TAU).round() }
}

/// Returns the value plus the fewest full turns that bring it within the limits, or, where no turn
/// does, nearest to them.
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
