use std::f64::consts::TAU;

use facemill_cl_data::ClPoint;

use crate::{
    AxisValues, InverseSolution, InverseSolutions, Machine, Unreachable,
    inverse::is_finite,
    solver::{NumericSolver, Solver},
    three_rotaries::{RotaryTriple, Target},
};

/// Largest turn of any rotary axis for which the solution that Newton's method finds is taken without a look at the others.
const CONTINUED: f64 = 5.0 * TAU / 360.0;

/// Poses tried on each branch for the distance by which a tip is missed.
const POSES_TRIED: usize = 90;

impl Machine {
    /// All solutions of a machine with three rotary joints; limits are not asked.
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
        let target = numeric.target(&cl.tip, &cl.axis, tool_length);
        let triples = numeric.solve(&target, numeric.rotaries.map(|k| reference.get_or_zero(k)));
        let mut all: Option<InverseSolutions> = None;
        let mut why = None;
        for triple in triples.as_slice() {
            match (self.with_triple(numeric, cl, tool_length, reference, triple), &mut all) {
                (Ok(solution), Some(all)) => all.push(solution),
                (Ok(solution), None) => all = Some(InverseSolutions::one(solution)),
                (Err(e), _) => why = Some(e),
            }
        }
        match (all, why) {
            (Some(all), _) => Ok(all),
            (None, Some(e)) => Err(e),
            (None, None) => Err(self.tip_missed(numeric, cl, &target, tool_length)),
        }
    }

    /// The solution that a position goes on to, if it is near and within the limits.
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

    /// Puts the solutions of a machine with three rotary joints in order of the time in which they are reached.
    pub(crate) fn nearest_first(&self, solutions: &mut InverseSolutions, reference: &AxisValues) {
        if let Solver::Numeric(_) = self.solver {
            let time = |s: &InverseSolution| self.travel_time(reference, &s.values);
            solutions.as_mut_slice().sort_unstable_by(|a, b| time(a).total_cmp(&time(b)));
        }
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

    /// The distance of the tip from the plane of the two linear axes, at the best pose found: equidistant ones, and the
    /// smallest between the neighbours of the best of them by golden section.
    fn tip_missed(&self, numeric: &NumericSolver, cl: &ClPoint, target: &Target, tool_length: f64) -> Unreachable {
        let distance = |value: f64, positive: bool| -> f64 {
            let Some(rotary) = numeric.values_at(target, value, positive) else { return f64::INFINITY };
            let mut q = AxisValues::zeros(self.axes.len());
            for (k, value) in numeric.rotaries.into_iter().zip(rotary) {
                q[k] = value;
            }
            let map = self.linear_map(&q, tool_length);
            let nearest = self.solve_linears(&map, &cl.tip);
            nearest.map_or(f64::INFINITY, |linears| (map.tip(&linears) - cl.tip.coords).norm())
        };
        let step = TAU / POSES_TRIED as f64;
        let tried = (0..2 * POSES_TRIED).map(|k| {
            let (value, positive) = ((k / 2) as f64 * step, k % 2 == 0);
            (distance(value, positive), value, positive)
        });
        let nearest = |a: (f64, f64, bool), b: (f64, f64, bool)| if b.0 < a.0 { b } else { a };
        let (mut by, value, positive) = tried.fold((f64::INFINITY, 0.0, true), nearest);
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut low, mut high) = (value - step, value + step);
        for _ in 0..60 {
            let (a, b) = (high - golden * (high - low), low + golden * (high - low));
            let (at_a, at_b) = (distance(a, positive), distance(b, positive));
            by = by.min(at_a).min(at_b);
            if at_a < at_b {
                high = b;
            } else {
                low = a;
            }
        }
        let [first, second] = numeric.linears.map(|k| self.axes[k].letter);
        Unreachable::Tip { first, second, by }
    }
}
