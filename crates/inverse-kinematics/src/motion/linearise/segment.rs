use std::f64::consts::FRAC_PI_2;

use facemill_cl_data::{ClPoint, CuttingLaw, RapidLaw};
use nalgebra::Vector3;

use crate::axes::axis::{AxisKind, AxisLetter};
use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;
use crate::motion::deviation::{Deviation, deviation_bound};
use crate::motion::linearise::{Linearisation, LineariseError, PoseFraction};
use crate::motion::{BlockLaw, Motion, OPPOSITE_COSINE, Turn};
use crate::solver::inverse_solution::{Branch, InverseSolution, Unreachable};

/// A position and the branch of the way there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trial {
    pub(super) values: AxisValues,
    branch: Branch,
}

/// One block of the way from a pose to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// Fraction of the way at its end.
    pub(super) to: f64,
    /// Position at its end.
    pub(super) stand: Trial,
    pub(super) deviation: Deviation,
    /// Fraction of the tolerance that it uses up.
    pub(super) used: f64,
}

/// The motion from a pose to the next one.
pub(super) struct Segment<'a> {
    machine: &'a Machine,
    settings: &'a Linearisation,
    pose: usize,
    ends: [&'a ClPoint; 2],
    tip_way: Vector3<f64>,
    turn: Turn,
    start: Trial,
}

/// The way to the next pose: nearly always one block.
pub(super) enum Steps {
    One([Step; 1]),
    Many(Vec<Step>),
}

/// Shortest step, as a fraction of the way between two poses. Larger would give up beside a pole
/// that can be passed; a smaller one is lost in the rounding of the poses.
const SHORTEST: f64 = 1e-9;

/// Margins over the estimated number of blocks, one for each attempt to place positions anew and
/// even out the use of the tolerance.
const MARGINS: [f64; 6] = [1.0, 1.0, 1.0, 1.003, 1.01, 1.03];

/// Largest ratio of the longest to the shortest block between two poses before they are evened out.
const EVEN: f64 = 1.1;

/// Factor by which an estimate may miss the sufficient number of blocks: within it one block fewer
/// is tried.
const TRY_FEWER: f64 = 1.01;

/// Attempts after the blocks hold, with fewer of them or to even them out.
const AFTER: usize = 2;

/// Largest turn of a rotary axis in a block where the control turns the tool vector itself, rad.
/// Beyond half a turn its sense is ambiguous.
const LARGEST_TURN: f64 = FRAC_PI_2;

/// The same: largest distance of a rotary axis from the mean of its ends in the middle of a block,
/// as a fraction of its turn. For a jump at one end it is half.
const LARGEST_BEND: f64 = 0.25;

/// The same: distance, rad, that is always allowed where an axis turns back within the block.
const NO_BEND: f64 = 0.005;

impl Steps {
    pub(super) fn as_slice(&self) -> &[Step] {
        match self {
            Self::One(step) => step,
            Self::Many(steps) => steps,
        }
    }
}

impl From<InverseSolution> for Trial {
    fn from(solution: InverseSolution) -> Self {
        Self { values: solution.values, branch: solution.branch }
    }
}

impl Trial {
    /// Returns the position of the first pose that is reached first from `start`.
    pub(super) fn first(
        machine: &Machine,
        poses: &[ClPoint],
        start: &AxisValues,
        tool_length: f64,
    ) -> Result<Self, LineariseError> {
        let unreachable = |pose: usize| {
            move |cause| LineariseError::Unreachable { place: PoseFraction { pose, fraction: 0.0 }, cause }
        };
        let mut reference = *start;
        let mut branch = None;
        // At the pole, the free axis takes the value that the first pose beside the pole needs.
        for (k, cl) in poses.iter().enumerate() {
            let solutions = machine.inverse_near(cl, tool_length, start).map_err(unreachable(k))?;
            let time = |s: &InverseSolution| machine.travel_time(start, &s.values);
            let nearest = solutions.iter().min_by(|a, b| time(a).total_cmp(&time(b)));
            let Some(nearest) = nearest else { break };
            match nearest.free_axis {
                Some(_) => {}
                None if k == 0 => return Ok(nearest.into()),
                None => {
                    branch = Some(nearest.branch);
                    for axis in (0..start.len()).filter(|&a| machine.is_rotary(a)) {
                        reference[axis] = nearest.values[axis];
                    }
                    break;
                }
            }
        }
        let solutions = machine.inverse_near(&poses[0], tool_length, &reference).map_err(unreachable(0))?;
        let mut stand = solutions.iter().next().map(Self::from).ok_or(Unreachable::Singular).map_err(unreachable(0))?;
        stand.branch = branch.unwrap_or(stand.branch);
        Ok(stand)
    }
}

impl<'a> Segment<'a> {
    pub(super) fn new(
        machine: &'a Machine,
        settings: &'a Linearisation,
        pose: usize,
        ends: [&'a ClPoint; 2],
        start: Trial,
    ) -> Result<Self, LineariseError> {
        let [a, b] = ends;
        if a.axis.dot(&b.axis) < OPPOSITE_COSINE {
            return Err(LineariseError::Reverses { place: PoseFraction { pose, fraction: 0.0 } });
        }
        let turn = Turn::new(&a.axis, &b.axis);
        Ok(Self { machine, settings, pose, ends, tip_way: b.tip - a.tip, turn, start })
    }

    /// Returns blocks that hold the tolerance, few and even.
    pub(super) fn steps(&self) -> Result<Steps, LineariseError> {
        let whole = self.step(&self.start, 1.0).map_err(|cause| LineariseError::Unreachable {
            place: PoseFraction { pose: self.pose + 1, fraction: 0.0 },
            cause,
        })?;
        if whole.used <= 1.0 {
            return Ok(Steps::One([whole]));
        }
        if let Some(steps) = self.even(vec![whole], None) {
            return Ok(Steps::Many(steps));
        }
        let steps = self.longest_steps()?;
        Ok(Steps::Many(self.even(steps.clone(), Some(steps.clone())).unwrap_or(steps)))
    }

    /// Returns the ideal pose at a fraction of the way.
    fn meant(&self, t: f64) -> ClPoint {
        if t >= 1.0 {
            return *self.ends[1];
        }
        ClPoint { tip: self.ends[0].tip + self.tip_way * t, axis: self.turn.at(t) }
    }

    /// Returns the block to a fraction of the way: on its present branch, unless that does not hold
    /// the tolerance and the other does.
    fn step(&self, from: &Trial, to: f64) -> Result<Step, Unreachable> {
        let solutions = self.machine.inverse_near(&self.meant(to), self.settings.tool_length, &from.values)?;
        let block = |solution: InverseSolution| {
            // At the pole the two branches are one: the way stays on its own.
            let branch = if solution.free_axis.is_some() { from.branch } else { solution.branch };
            self.block(&from.values, to, Trial { values: solution.values, branch })
        };
        let own = solutions.iter().find(|s| s.branch == from.branch).map(block);
        if let Some(own) = own.filter(|own| own.used <= 1.0) {
            return Ok(own);
        }
        // Through the pole, and close to it, the other branch is the one that turns less.
        let turn = |values: &AxisValues| self.largest_turn(&from.values, values).1;
        let most = own.map_or(f64::INFINITY, |own| turn(&own.stand.values));
        let other = solutions.iter().find(|s| s.branch != from.branch && turn(&s.values) < most).map(block);
        other.filter(|other| other.used <= 1.0).or(own).or(other).ok_or(Unreachable::Singular)
    }

    fn block(&self, from: &AxisValues, to: f64, stand: Trial) -> Step {
        let settings = self.settings;
        let deviation = deviation_bound(self.machine, settings.law, from, &stand.values, settings.tool_length);
        let mut used = settings.tolerance.used_by(&deviation);
        if settings.law == BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned) {
            used = used.max(self.doubt(from, &stand.values));
        }
        Step { to, stand, deviation, used }
    }

    /// Returns the distance of the rotary axes from even motion where the control turns the tool
    /// vector itself; up to 1 there is no doubt about their sense. The distance is largest for
    /// jumps at the pole, which stay however short the block is.
    fn doubt(&self, from: &AxisValues, to: &AxisValues) -> f64 {
        let turn = self.largest_turn(from, to).1;
        let motion = Motion::new(self.machine, self.settings.law, from, to, self.settings.tool_length);
        let Some(middle) = motion.ok().and_then(|m| m.at(0.5).ok()) else { return f64::INFINITY };
        let off = self.largest_turn(&from.lerp(to, 0.5), &middle).1;
        let parts = [turn / LARGEST_TURN, off / (LARGEST_BEND * turn).max(NO_BEND)];
        parts.into_iter().fold(0.0, f64::max).powi(2)
    }

    /// Returns the rotary axis that turns farthest, and its turn, rad.
    fn largest_turn(&self, from: &AxisValues, to: &AxisValues) -> (AxisLetter, f64) {
        let axes = self.machine.axes().iter().enumerate();
        let turns = axes.filter(|(_, a)| a.kind == AxisKind::Rotary).map(|(k, a)| (a.letter, (to[k] - from[k]).abs()));
        turns.fold((self.machine.axes()[0].letter, 0.0), |most, turn| if turn.1 > most.1 { turn } else { most })
    }

    /// Returns a length that adds up: the deviation grows with the square of a block's length, at
    /// bends in proportion to it.
    fn length(&self, step: &Step) -> f64 {
        if self.settings.law == BlockLaw::Rapid(RapidLaw::PerAxis) { step.used } else { step.used.sqrt() }
    }

    /// Cuts the blocks anew into few of equal length; `None` where that does not converge.
    ///
    /// The sum of the lengths of the blocks gives the necessary number. Their ends are then placed
    /// at equal parts of it, each block's length spread evenly over it, which becomes more accurate
    /// as blocks get shorter.
    fn even(&self, mut steps: Vec<Step>, mut held: Option<Vec<Step>>) -> Option<Vec<Step>> {
        let mut n_after = 0;
        for margin in MARGINS {
            let length: f64 = steps.iter().map(|s| self.length(s)).sum();
            let mut n = (length * margin).ceil().max(2.0);
            if let Some(held) = &held {
                // A single block is the one that did not hold at first.
                let fewer = (held.len() - 1) as f64;
                let try_fewer = fewer >= 2.0 && length <= fewer * TRY_FEWER;
                if n_after == AFTER || !try_fewer && self.is_even(held) {
                    break;
                }
                n = if try_fewer { n.min(fewer) } else { held.len() as f64 };
                n_after += 1;
            }
            if n.is_nan() || n > self.settings.max_between as f64 + 1.0 {
                break;
            }
            let Some(cut) = self.cut(&steps, length, n as usize) else { break };
            steps = cut;
            if steps.iter().all(|s| s.used <= 1.0) {
                held = Some(steps.clone());
            }
        }
        held
    }

    fn is_even(&self, steps: &[Step]) -> bool {
        let lengths = steps.iter().map(|s| self.length(s));
        let (shortest, longest) = lengths.fold((f64::INFINITY, 0.0_f64), |(a, b), l| (a.min(l), b.max(l)));
        longest <= EVEN * shortest
    }

    /// Returns blocks that end at equal parts of the length of these.
    fn cut(&self, steps: &[Step], length: f64, n: usize) -> Option<Vec<Step>> {
        let mut cut = Vec::with_capacity(n);
        let mut stand = self.start;
        let (mut begin, mut done, mut k) = (0.0, 0.0, 0);
        for part in 1..=n {
            let wanted = length * part as f64 / n as f64;
            while k + 1 < steps.len() && done + self.length(&steps[k]) < wanted {
                done += self.length(&steps[k]);
                begin = steps[k].to;
                k += 1;
            }
            let within = ((wanted - done) / self.length(&steps[k])).min(1.0);
            let to = if part == n { 1.0 } else { begin + (steps[k].to - begin) * within };
            let step = self.step(&stand, to).ok()?;
            stand = step.stand;
            cut.push(step);
        }
        Some(cut)
    }

    /// Returns consecutive blocks, each about as long as the tolerance allows.
    fn longest_steps(&self) -> Result<Vec<Step>, LineariseError> {
        let mut steps: Vec<Step> = Vec::new();
        let (mut from, mut stand, mut guess) = (0.0, self.start, 1.0);
        while from < 1.0 {
            if steps.len() > self.settings.max_between {
                let place = PoseFraction { pose: self.pose, fraction: from };
                return Err(LineariseError::TooMany { place, limit: self.settings.max_between });
            }
            let step = self.longest_step(&stand, from, guess).ok_or_else(|| self.cause(&stand, from))?;
            guess = 1.2 * (step.to - from);
            (from, stand) = (step.to, step.stand);
            steps.push(step);
        }
        Ok(steps)
    }

    /// Returns a block that holds the tolerance, within a few percent of the longest one.
    fn longest_step(&self, stand: &Trial, from: f64, guess: f64) -> Option<Step> {
        let (mut holds, mut beyond): (Option<Step>, f64) = (None, 1.0 + SHORTEST);
        let mut size = guess;
        loop {
            let to = if from + size > 1.0 - SHORTEST { 1.0 } else { from + size };
            let step = self.step(stand, to).ok();
            match step.filter(|s| s.used <= 1.0) {
                Some(step) if to >= 1.0 || step.used > 0.95 => return Some(step),
                Some(step) => holds = Some(step),
                None => beyond = to,
            }
            let low = holds.map_or(0.0, |s| s.to - from);
            let high = beyond - from;
            let wanted = step.map_or(0.0, |s| size * (0.98 / self.length(&s).max(0.01)));
            size = if beyond > 1.0 {
                wanted.max(1.1 * low)
            } else {
                wanted.clamp(0.9 * low + 0.1 * high, 0.5 * (low + high))
            };
            if high < 1.05 * low {
                return holds;
            }
            if high < SHORTEST {
                return None;
            }
        }
    }

    /// Returns the reason why no block that begins here holds the tolerance.
    fn cause(&self, stand: &Trial, from: f64) -> LineariseError {
        let place = PoseFraction { pose: self.pose, fraction: from };
        let next = (from + SHORTEST).min(1.0);
        let solutions = match self.machine.inverse_near(&self.meant(next), self.settings.tool_length, &stand.values) {
            Ok(solutions) => solutions,
            Err(cause) => return LineariseError::Unreachable { place, cause },
        };
        let turns = solutions.iter().map(|s| (s.branch == stand.branch, self.largest_turn(&stand.values, &s.values)));
        let (same, (axis, by)) =
            turns.min_by(|a, b| b.0.cmp(&a.0)).unwrap_or((true, (self.machine.axes()[0].letter, 0.0)));
        if !same || by > 1.5 * std::f64::consts::PI {
            return LineariseError::Jump { place, axis, by };
        }
        let screw = self.machine.chain.screws.iter().find(|s| s.kind == AxisKind::Rotary);
        let (axis, direction) =
            screw.map_or((axis, Vector3::z()), |s| (self.machine.axes()[s.axis].letter, s.direction.into_inner()));
        let tool = self.meant(from).axis;
        let from = tool.cross(&direction).norm().atan2(tool.dot(&direction).abs());
        LineariseError::Singular { place, axis, from }
    }
}
