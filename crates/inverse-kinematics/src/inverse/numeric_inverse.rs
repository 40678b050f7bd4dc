use std::f64::consts::TAU;

use facemill_cl_data::ClPoint;
use nalgebra::SVector;

use crate::axes::axis::AxisKind;
use crate::axes::axis_values::AxisValues;
use crate::inverse::{is_exact, is_finite};
use crate::machine::Machine;
use crate::solver::NumericSolver;
use crate::solver::inverse_solution::{InverseSolution, InverseSolutions, Unreachable};
use crate::solver::rotary_triples::{RotaryTriple, Target};
use crate::solver::screw_chain::METRE;

/// Largest turn of any rotary axis for which the solution of Newton's method is taken without
/// comparing the others.
const CONTINUED: f64 = 5.0 * TAU / 360.0;

/// Largest number of steps of Newton's method on all joints before a solution is given up.
const MOST_REFINEMENTS: usize = 4;

/// Values of a free axis tried over a turn for solutions within the limits.
const ROW: u32 = 180;

/// Singular value below which joints hardly move the tool.
const HARDLY: f64 = 1e-8;

/// Distance of the tip that may be rounding, mm.
const ALMOST: f64 = 1e-2;

/// Poses tried on each branch for the distance by which a tip is missed.
const POSES_TRIED: usize = 90;

impl Machine {
    /// Returns all solutions of a machine with three rotary joints, without testing limits.
    pub(crate) fn unlimited_numeric(
        &self,
        numeric: &NumericSolver,
        cl: &ClPoint,
        tool_length: f64,
        reference: &AxisValues,
    ) -> Result<InverseSolutions, Unreachable> {
        if !is_finite(cl, tool_length) {
            return Err(Unreachable::NotFinite);
        }
        let by = numeric.out_of_reach(&cl.axis);
        // Nearer than this the edge of the reach is itself a solution.
        if by > 1e-12 {
            return Err(self.direction_missed(numeric.rotaries[0], numeric.rotaries[2], by));
        }
        let at = numeric.rotaries.map(|k| reference.get_or_zero(k));
        self.numeric_at(numeric, cl, tool_length, reference, at)
    }

    /// Returns the solutions; on a curve of them those at these values of its free joints. Windings
    /// are those nearest to the reference.
    fn numeric_at(
        &self,
        numeric: &NumericSolver,
        cl: &ClPoint,
        tool_length: f64,
        reference: &AxisValues,
        at: [f64; 3],
    ) -> Result<InverseSolutions, Unreachable> {
        let target = numeric.target(&cl.tip, &cl.axis, tool_length);
        let triples = numeric.solve(&target, at);
        let mut all: Option<InverseSolutions> = None;
        let mut why = None;
        for triple in triples.as_slice() {
            match (self.with_triple(numeric, cl, tool_length, reference, triple), &mut all) {
                (Ok(solution), Some(all)) => all.push(&solution),
                (Ok(solution), None) => all = Some(InverseSolutions::one(&solution, self.own_axes())),
                (Err(e), _) => why = Some(e),
            }
        }
        match (all, why) {
            (Some(all), _) => Ok(all),
            (None, Some(e)) => Err(e),
            (None, None) => self.almost(numeric, cl, &target, tool_length, reference),
        }
    }

    /// Returns solutions within the limits on a curve whose solutions at the reference are not: at
    /// the nearest of a row of values of a free axis. Solutions between two of the row may be
    /// missed.
    pub(crate) fn along_curve(
        &self,
        numeric: &NumericSolver,
        cl: &ClPoint,
        tool_length: f64,
        reference: &AxisValues,
        beyond: &InverseSolutions,
    ) -> Option<InverseSolutions> {
        let free: Vec<usize> =
            (0..3).filter(|&k| beyond.iter().any(|s| s.free_axis == Some(numeric.rotaries[k]))).collect();
        let at = numeric.rotaries.map(|k| reference.get_or_zero(k));
        let offs = (1..=ROW / 2).flat_map(|k| [f64::from(k), -f64::from(k)]).map(|k| k * TAU / f64::from(ROW));
        let mut tried = offs.flat_map(|off| free.iter().map(move |&k| (k, off)));
        tried.find_map(|(k, off)| {
            let mut at = at;
            at[k] += off;
            let all = self.numeric_at(numeric, cl, tool_length, reference, at).ok()?;
            self.all_within_limits(all.iter()).ok()
        })
    }

    /// Returns the solution that continues a position, if it is near and within the limits.
    pub(crate) fn continued(
        &self,
        numeric: &NumericSolver,
        cl: &ClPoint,
        tool_length: f64,
        previous: &AxisValues,
    ) -> Option<AxisValues> {
        if !is_finite(cl, tool_length) || !previous.is_finite() {
            return None;
        }
        let target = numeric.target(&cl.tip, &cl.axis, tool_length);
        let triple = numeric.near(&target, numeric.rotaries.map(|k| previous.get_or_zero(k)))?;
        let solution = self.with_triple(numeric, cl, tool_length, previous, &triple).ok()?;
        let solution = self.within_limits(solution).ok()?;
        let turn = |&k: &usize| (solution.values[k] - previous.get_or_zero(k)).abs();
        numeric.rotaries.iter().all(|k| turn(k) < CONTINUED).then_some(solution.values)
    }

    /// Applies Newton's method to all five joints, for poses in which the tip condition alone is
    /// not enough: where the linear axes are nearly parallel.
    pub(crate) fn refined(
        &self,
        cl: &ClPoint,
        tool_length: f64,
        mut values: AxisValues,
        turned: f64,
    ) -> Result<AxisValues, Unreachable> {
        for _ in 0..MOST_REFINEMENTS {
            let at = self.cl_point(&values, tool_length);
            let (tip, axis) = (cl.tip - at.tip, cl.axis.into_inner() - at.axis.into_inner());
            if is_exact(&tip, &axis, turned) {
                return Ok(values);
            }
            let (velocities, across) = self.chain.tool_velocities(&values, tool_length);
            let off = [across[0].dot(&axis), across[1].dot(&axis), tip.x / METRE, tip.y / METRE, tip.z / METRE];
            // Without the directions in which the joints hardly move the tool: steps along them
            // would be noise.
            let Ok(step) = velocities.svd(true, true).solve(&SVector::from(off), HARDLY) else { break };
            for (k, screw) in self.chain.screws.iter().enumerate() {
                values[screw.axis] += step[k] * if screw.kind == AxisKind::Linear { METRE } else { 1.0 };
            }
        }
        Err(Unreachable::Inaccurate)
    }

    fn with_triple(
        &self,
        numeric: &NumericSolver,
        cl: &ClPoint,
        tool_length: f64,
        reference: &AxisValues,
        triple: &RotaryTriple,
    ) -> Result<InverseSolution, Unreachable> {
        let rotary = numeric.rotaries.into_iter().zip(triple.values);
        let values = self.with_rotaries(cl, tool_length, reference, rotary)?;
        Ok(InverseSolution { values, branch: triple.branch, free_axis: triple.free.map(|k| numeric.rotaries[k]) })
    }

    /// Handles a tip condition without a root: returns the solution at its least value, or the
    /// distance by which the tip is missed there. There is a solution only where the condition
    /// hardly depends on the unknown and rounding decides.
    fn almost(
        &self,
        numeric: &NumericSolver,
        cl: &ClPoint,
        target: &Target<'_>,
        tool_length: f64,
        reference: &AxisValues,
    ) -> Result<InverseSolutions, Unreachable> {
        let (by, rotary) = self.nearest_miss(numeric, cl, target, tool_length);
        if by < ALMOST {
            let rotary = numeric.rotaries.into_iter().zip(rotary);
            if let Ok(values) = self.with_rotaries(cl, tool_length, reference, rotary) {
                let branch = self.branch_of(&values);
                let solution = InverseSolution { values, branch, free_axis: None };
                return Ok(InverseSolutions::one(&solution, self.own_axes()));
            }
        }
        let [first, second] = numeric.linears.map(|k| self.axes[k].letter);
        Err(Unreachable::Tip { first, second, by })
    }

    /// Returns the distance of the tip from the plane of the two linear axes, and the rotary
    /// values, at the best pose found: the best of equidistant ones, refined between its neighbours
    /// by golden section.
    fn nearest_miss(
        &self,
        numeric: &NumericSolver,
        cl: &ClPoint,
        target: &Target<'_>,
        tool_length: f64,
    ) -> (f64, [f64; 3]) {
        let distance = |value: f64, positive: bool| -> (f64, [f64; 3]) {
            let Some(rotary) = numeric.values_at(target, value, positive) else { return (f64::INFINITY, [0.0; 3]) };
            let mut q = AxisValues::zeros(self.axes.len());
            for (k, value) in numeric.rotaries.into_iter().zip(rotary) {
                q[k] = value;
            }
            let map = self.linear_map(&q, tool_length);
            let nearest = self.solve_linears(&map, &cl.tip);
            (nearest.map_or(f64::INFINITY, |linears| (map.tip(&linears) - cl.tip.coords).norm()), rotary)
        };
        let step = TAU / POSES_TRIED as f64;
        let (mut best, mut at) = ((f64::INFINITY, [0.0; 3]), (0.0, true));
        for k in 0..2 * POSES_TRIED {
            let (value, positive) = ((k / 2) as f64 * step, k % 2 == 0);
            let tried = distance(value, positive);
            if tried.0 < best.0 {
                (best, at) = (tried, (value, positive));
            }
        }
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut low, mut high) = (at.0 - step, at.0 + step);
        for _ in 0..60 {
            let (a, b) = (high - golden * (high - low), low + golden * (high - low));
            let (at_a, at_b) = (distance(a, at.1), distance(b, at.1));
            for tried in [at_a, at_b] {
                if tried.0 < best.0 {
                    best = tried;
                }
            }
            if at_a.0 < at_b.0 {
                high = b;
            } else {
                low = a;
            }
        }
        best
    }
}
