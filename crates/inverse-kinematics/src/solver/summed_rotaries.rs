use nalgebra::{Unit, Vector3};

use crate::solver::direction_pair::{DirectionPair, PairFault, PairSolution, SAME_DIRECTION};
use crate::solver::free_plane::FreePlane;
use crate::solver::inverse_solution::Branch;
use crate::solver::rotary_triples::{RotaryTriple, Target, Triples};
use crate::solver::tip_condition::{functions, value_and_gradient};
use crate::solver::trig_roots::{SAMPLES, real_roots, sample_angle};

/// Fraction of the largest coefficient of the tip condition below which it counts as zero all along
/// a line.
const NO_CONDITION: f64 = 1e-11;

/// Fraction of it that counts as rounding.
const MET: f64 = 1e-13;

/// Rounding of a direction, rad.
const DIRECTION_ROUNDING: f64 = 5e-16;

/// Steps of Newton's method.
const MOST_STEPS: usize = 12;

/// Three rotary joints, the middle one parallel to one of its neighbours, that turn the tool to a
/// direction and bring the tip into the plane of motion of two linear joints.
///
/// Only the sum of the two parallel ones turns the tool axis, so that sum and the third value
/// follow from it in closed form. Along each of the two branches the tip condition is a
/// trigonometric polynomial of degree 2 in one of the summands.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SummedRotaries {
    pair: DirectionPair,
    /// Whether the middle joint is parallel to the first one; else to the last one.
    first_two: bool,
    /// +1, or −1 where the parallel joints turn opposite ways.
    sign: f64,
}

/// Rotary values `base + θ·direction`.
#[derive(Clone, Copy)]
pub(crate) struct RotaryLine {
    pub(crate) base: [f64; 3],
    pub(crate) direction: [f64; 3],
    /// Index of the joint whose value is θ.
    pub(crate) unknown: usize,
    pub(crate) branch: Branch,
    pub(crate) free: Option<usize>,
}

impl SummedRotaries {
    /// Takes directions of the rotary joints from the table to the tool, and the spindle, at the
    /// machine's zero pose.
    pub(crate) fn new(
        w: [Unit<Vector3<f64>>; 3],
        spindle: &Unit<Vector3<f64>>,
        first_two: bool,
    ) -> Result<Self, PairFault> {
        let beside = if first_two { w[0] } else { w[2] };
        let second = if first_two { w[2] } else { w[1] };
        let pair = DirectionPair::new((0, w[0]), (1, second), spindle)?;
        Ok(Self { pair, first_two, sign: w[1].dot(&beside).signum() })
    }

    /// Returns the uncertainty of the first value: rounding of a direction over the sine of its
    /// angle to the first axis. At the pole that value is free.
    fn open(&self, tool_axis: &Vector3<f64>) -> f64 {
        let across = tool_axis.cross(&self.pair.first.direction).norm();
        DIRECTION_ROUNDING / across.max(SAME_DIRECTION)
    }

    /// Returns all solutions for a target. On a whole curve of them, those at the reference value
    /// of its free joint; with the tool along the first axis those of [`FreePlane::solve`].
    pub(crate) fn solve(&self, target: &Target<'_>, reference: [f64; 3]) -> Triples {
        let mut all = Triples::new();
        if let PairSolution::FirstFree(second) = self.pair.solve(&target.tool_axis) {
            self.free_plane(second).solve(target, reference, &mut all);
            return all;
        }
        let open = self.open(&target.tool_axis);
        for line in self.lines(target, reference).into_iter().flatten() {
            along(target, &line, reference, open, &mut all);
        }
        all
    }

    /// Returns the solution nearest to a reference position on its line; `None` where Newton's
    /// method does not find one.
    pub(crate) fn near(&self, target: &Target<'_>, reference: [f64; 3]) -> Option<RotaryTriple> {
        let branch = self.branch_of(reference);
        let line = self.lines(target, reference).into_iter().flatten().find(|l| l.branch == branch)?;
        let (value, error) = line.polished(target, reference[line.unknown]);
        (error < 1e-12).then(|| line.triple(value, line.free))
    }

    pub(crate) fn branch_of(&self, values: [f64; 3]) -> Branch {
        let second = if self.first_two { values[2] } else { values[1] + self.sign * values[2] };
        if self.pair.is_positive(second) { Branch::Positive } else { Branch::Negative }
    }

    /// Returns the angle by which a direction is out of reach, 0 within.
    pub(crate) fn out_of_reach(&self, tool_axis: &Vector3<f64>) -> f64 {
        match self.pair.solve(tool_axis) {
            PairSolution::Beyond(by) => by,
            _ => 0.0,
        }
    }

    /// Returns the rotary values at a value of the unknown on one branch; with the tool along the
    /// first axis those that meet the tip condition best there.
    pub(crate) fn values_at(&self, target: &Target<'_>, value: f64, positive: bool) -> Option<[f64; 3]> {
        if let PairSolution::FirstFree(second) = self.pair.solve(&target.tool_axis) {
            return Some(self.free_plane(second).best_at(target, value)[usize::from(!positive)]);
        }
        let lines = self.lines(target, [0.0; 3]);
        let line = if positive { lines[0] } else { lines[1].or(lines[0]) };
        line.map(|l| l.values(value))
    }

    fn lines(&self, target: &Target<'_>, reference: [f64; 3]) -> [Option<RotaryLine>; 2] {
        let line = |[first, second]: [f64; 2], branch| self.line(first, second, branch);
        match self.pair.solve(&target.tool_axis) {
            PairSolution::Two { positive, negative } => {
                [Some(line(positive, Branch::Positive)), Some(line(negative, Branch::Negative))]
            }
            PairSolution::One(pair) => {
                let line = line(pair, Branch::Positive);
                [Some(RotaryLine { branch: self.branch_of(line.base), ..line }), None]
            }
            PairSolution::FirstFree(second) => [Some(self.free_plane(second).first_at(reference)), None],
            PairSolution::Beyond(_) => [None, None],
        }
    }

    fn line(&self, first: f64, second: f64, branch: Branch) -> RotaryLine {
        let s = self.sign;
        if self.first_two {
            let base = [0.0, s * first, second];
            RotaryLine { base, direction: [1.0, -s, 0.0], unknown: 0, branch, free: None }
        } else {
            let base = [first, second, 0.0];
            RotaryLine { base, direction: [0.0, -s, 1.0], unknown: 2, branch, free: None }
        }
    }

    /// Returns the free values where the tool axis lies on the first axis: that one, and one of the
    /// parallel joints.
    fn free_plane(&self, second: f64) -> FreePlane {
        let base = if self.first_two { [0.0, 0.0, second] } else { [0.0, second, 0.0] };
        FreePlane::new(base, self.branch_of(base), self.first_two, self.sign)
    }
}

/// Adds the solutions on one line, whose place is known to `open`, rad. Two that come so near to
/// each other that they may be one, or just missed, are added too.
pub(crate) fn along(target: &Target<'_>, line: &RotaryLine, reference: [f64; 3], open: f64, all: &mut Triples) {
    let mut samples = [0.0; SAMPLES];
    for (k, sample) in samples.iter_mut().enumerate() {
        *sample = line.condition(target, sample_angle(k)).0;
    }
    let size = samples.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    // Besides a curve of solutions there are single ones away from the reference.
    let at_reference = reference[line.unknown];
    if size < NO_CONDITION * target.scale && line.condition(target, at_reference).0.abs() < MET * target.scale {
        all.push(line.triple(at_reference, line.free.or(Some(line.unknown))));
        return;
    }
    for &seed in real_roots(&samples, (4e-15 + open) * target.scale).as_slice() {
        let (value, error) = line.polished(target, seed);
        if error < 1e-12 + 2.0 * open {
            all.push(line.triple(value, line.free));
        }
    }
}

impl RotaryLine {
    fn values(&self, value: f64) -> [f64; 3] {
        [0, 1, 2].map(|k| self.base[k] + value * self.direction[k])
    }

    fn triple(&self, value: f64, free: Option<usize>) -> RotaryTriple {
        RotaryTriple { values: self.values(value), branch: self.branch, free }
    }

    /// Returns the tip condition and its derivative along the line.
    fn condition(&self, target: &Target<'_>, value: f64) -> (f64, f64) {
        let (f, gradient) = value_and_gradient(&target.t, &self.values(value).map(functions));
        (f, gradient.dot(&Vector3::from(self.direction)))
    }

    /// Applies Newton's method; also returns the residual of the tip condition over its scale.
    fn polished(&self, target: &Target<'_>, start: f64) -> (f64, f64) {
        let (mut best, (mut f, mut slope)) = (start, self.condition(target, start));
        let mut step = -f / slope;
        for _ in 0..MOST_STEPS {
            if !step.is_finite() || step.abs() < 1e-15 || f == 0.0 {
                break;
            }
            let next = best + step.clamp(-0.3, 0.3);
            let (next_f, next_slope) = self.condition(target, next);
            if next_f.abs() < f.abs() {
                (best, f, slope) = (next, next_f, next_slope);
                step = -f / slope;
            } else if f.abs() > 1e-14 * target.scale {
                step *= 0.25;
            } else {
                break;
            }
        }
        (best, f.abs() / target.scale)
    }
}
