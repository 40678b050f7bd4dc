//! How many positions a motion needs, from a bound on how fast the tool moves relative to the
//! workpiece.

use facemill_cl_data::CuttingLaw;
use facemill_inverse_kinematics::{AxisKind, AxisValues, BlockLaw, Machine, Motion};
use nalgebra::{Isometry3, Vector3};

use crate::motion::spans::{Repeated, Spans};

/// How far apart positions may be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spacing {
    /// Of tip and rim, mm.
    pub(crate) max_step: f64,
    /// Of the tool axis, rad.
    pub(crate) max_turn: f64,
    /// By how much the tip may leave the straight way from one position to the next, mm.
    pub(crate) max_bulge: f64,
    /// Distance of the rim from the tip, mm.
    pub(crate) reach: f64,
}

/// The positions of a motion: fractions of its time, the last one 1.
#[derive(Clone, Debug)]
pub(crate) struct Positions {
    parts: Vec<StepInterval>,
    /// Steps per position, at most 1.
    stride: f64,
    /// Whether the motion was bounded all over.
    pub(crate) is_bounded: bool,
    /// Turns without positions, because the last positions repeat them.
    pub(crate) repeated: Option<Repeated>,
    n: u64,
    /// Positions given so far.
    given: u64,
    /// Part the next position is searched from, and the steps before it.
    part: usize,
    steps_before: f64,
}

/// An interval of a motion, and how many of the longest allowed steps it takes at its bound on the
/// speed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct StepInterval {
    from: f64,
    to: f64,
    steps: f64,
}

impl Positions {
    fn new(parts: Vec<StepInterval>, is_bounded: bool) -> Self {
        let steps: f64 = parts.iter().map(|p| p.steps).sum();
        // The cast saturates.
        let n = (steps.ceil() as u64).max(1);
        Self { parts, stride: steps / n as f64, is_bounded, repeated: None, n, given: 0, part: 0, steps_before: 0.0 }
    }

    /// Number of positions of the whole motion.
    pub(crate) fn n(&self) -> u64 {
        self.n
    }
}

impl Iterator for Positions {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        if self.given == self.n {
            return None;
        }
        self.given += 1;
        if self.given == self.n {
            return Some(1.0);
        }
        let steps = self.given as f64 * self.stride;
        while let Some(p) = self.parts.get(self.part) {
            let within = steps - self.steps_before;
            if within <= p.steps {
                return Some(p.from + (p.to - p.from) * (within / p.steps).clamp(0.0, 1.0));
            }
            self.steps_before += p.steps;
            self.part += 1;
        }
        // Rounding alone gets here.
        Some(1.0)
    }
}

/// Bounds over an interval.
#[derive(Clone, Copy, Debug)]
struct Bound {
    /// Way of the tip, mm.
    tip: f64,
    /// Turn of the tool axis, rad.
    turn: f64,
    /// Part of `tip` that comes from not knowing how the velocity changes.
    slack: f64,
}

/// Splits of a part of a motion in half, none of which turns farther than once; more would fill the
/// memory with parts.
const MAX_SPLITS: u32 = 20;

/// Largest turn of all rotary axes together over which speeds are bounded at once, rad. The bound
/// is of second order in it.
pub(crate) const MAX_TURN: f64 = 0.25;

/// Positions of the motion from `start` to `end` under `law` such that neither tip nor rim move
/// farther, nor the tool axis turns farther, than `spacing` allows from one position to the next,
/// relative to the table (and so to the workpiece); nor all rotary axes together farther than the
/// tool axis may, nor the linear axes of the other head together than the tip.
///
/// The motion is cut into parts with a bound on the speed in each, in longest steps per time; the
/// positions lie evenly on the sum of the steps, so that from one to the next it is at most one.
/// Where an axis turns on and on alone, they lie on its last turn, which repeats those before.
pub(crate) fn positions(
    machine: &Machine,
    motion: &Motion<'_>,
    law: BlockLaw,
    ends: [&AxisValues; 2],
    tool_length: f64,
    spacing: &Spacing,
) -> Positions {
    let walk = Walk { machine, motion, law, tool_length, spacing };
    let (mut parts, mut is_bounded) = (Vec::new(), true);
    let spans = Spans::new(machine, law, ends, tool_length);
    for [from, to] in &spans.parts {
        is_bounded &= walk.split(*from, *to, 0, &mut parts);
    }
    Positions { repeated: spans.repeated, ..Positions::new(parts, is_bounded) }
}

/// When each axis stops, as a fraction of the rapid's time.
pub(crate) fn stops<'a>(machine: &'a Machine, [start, end]: [&'a AxisValues; 2]) -> impl Iterator<Item = f64> + 'a {
    let time = machine.travel_time(start, end);
    let stop = move |k: usize| (end[k] - start[k]).abs() / machine.axes()[k].max_velocity / time;
    (0..start.len()).map(stop).filter(|t| *t > 0.0 && *t < 1.0)
}

struct Walk<'a> {
    machine: &'a Machine,
    motion: &'a Motion<'a>,
    law: BlockLaw,
    tool_length: f64,
    spacing: &'a Spacing,
}

impl Walk<'_> {
    /// Whether all of the interval has a bound.
    fn split(&self, from: f64, to: f64, depth: u32, parts: &mut Vec<StepInterval>) -> bool {
        let (Ok(start), Ok(end)) = (self.motion.at(from), self.motion.at(to)) else {
            // The axes cannot follow: the position at the end of the part will show it.
            parts.push(StepInterval { from, to, steps: 1.0 });
            return false;
        };
        let bound = self.bound([from, to], [&start, &end]);
        let tight = bound.is_some_and(|b| b.slack <= (0.25 * (b.tip - b.slack)).max(0.5 * self.spacing.max_step));
        if !tight && depth < MAX_SPLITS {
            let middle = 0.5 * (from + to);
            let first = self.split(from, middle, depth + 1, parts);
            return self.split(middle, to, depth + 1, parts) && first;
        }
        let is_bounded = bound.is_some();
        let b = bound.unwrap_or_else(|| Bound { tip: 0.0, turn: ways(self.machine, &start, &end)[1], slack: 0.0 });
        // A table that turns about the tool moves neither tip nor tool axis, but clamps and cheeks
        // past the head.
        let turn = b.turn.max(ways(self.machine, &start, &end)[1]);
        // So does the other head, which moves neither.
        let [other_way, _] = ways_of(self.machine, &start, &end, |k| !self.machine.moves_tool(k));
        let steps = ((b.tip + self.spacing.reach * b.turn).max(other_way) / self.spacing.max_step)
            .max(turn / self.spacing.max_turn)
            // The velocity changes by at most the slack over the part: that is the largest
            // acceleration.
            .max((b.slack / (8.0 * self.spacing.max_bulge)).sqrt());
        parts.push(StepInterval { from, to, steps });
        is_bounded
    }

    /// `None` where the interval turns too far for the bound.
    fn bound(&self, [from, to]: [f64; 2], [start, end]: [&AxisValues; 2]) -> Option<Bound> {
        let joint = joint_bound(self.machine, start, end, self.tool_length);
        let BlockLaw::Cutting(law) = self.law else { return joint };
        let (a, b) = (self.motion.ideal(from), self.motion.ideal(to));
        let tip = (b.tip - a.tip).norm();
        match law {
            CuttingLaw::AxesLinear => joint,
            CuttingLaw::TipAndRotariesLinear => Some(Bound { tip, turn: joint?.turn, slack: 0.0 }),
            CuttingLaw::TipLinearVectorTurned => {
                let turn = a.axis.cross(&b.axis).norm().atan2(a.axis.dot(&b.axis));
                Some(Bound { tip, turn, slack: 0.0 })
            }
        }
    }
}

/// Sum of the ways of the linear axes (mm) and of the rotary axes (rad).
pub(crate) fn ways(machine: &Machine, start: &AxisValues, end: &AxisValues) -> [f64; 2] {
    ways_of(machine, start, end, |_| true)
}

/// The same of some axes.
pub(crate) fn ways_of(
    machine: &Machine,
    start: &AxisValues,
    end: &AxisValues,
    counts: impl Fn(usize) -> bool,
) -> [f64; 2] {
    let way = |kind: AxisKind| -> f64 {
        let of_kind = machine.axes().iter().enumerate().filter(|(k, a)| a.kind == kind && counts(*k));
        of_kind.map(|(k, _)| (end[k] - start[k]).abs()).sum()
    };
    [way(AxisKind::Linear), way(AxisKind::Rotary)]
}

/// Bounds on the way of the tip and the turn of the tool axis while all axes go linearly from
/// `start` to `end`.
///
/// With D the turn of all rotary and S the way of all linear axes, and L the largest distance of
/// the tip from a rotary axis: the tip's velocity is a sum of one vector per axis. Along the motion
/// the vectors are turned by at most D, and the levers of the rotary ones change by at most S +
/// D·L, so that the velocity stays within 2·D·S + 2·D²·L of that at the start. In the same way the
/// velocity of the tool axis stays within 2·D² of its start. L itself is at most (L at the start +
/// S) / (1 − D).
fn joint_bound(machine: &Machine, start: &AxisValues, end: &AxisValues, tool_length: f64) -> Option<Bound> {
    let axes = machine.axes();
    let [linear, turn] = ways_of(machine, start, end, |k| machine.moves_tool(k));
    // Written so that NaN is refused, too.
    if !(turn <= MAX_TURN && linear.is_finite()) {
        return None;
    }
    let cl = machine.cl_point(start, tool_length);
    let shifted = AxisValues::from_fn(axes.len(), |k| if axes[k].kind == AxisKind::Linear { end[k] } else { start[k] });
    let mut velocity = machine.cl_point(&shifted, tool_length).tip - cl.tip;
    let mut spin = Vector3::zeros();
    let mut lever = 0.0_f64;
    let table_from_tool = machine.forward(start, tool_length);
    for k in (0..axes.len()).filter(|&k| axes[k].kind == AxisKind::Rotary && end[k] != start[k]) {
        let (direction, point) = rotary_axis(machine, start, k, &table_from_tool, tool_length);
        let swing = direction.cross(&(cl.tip.coords - point));
        velocity += swing * (end[k] - start[k]);
        spin += direction * (end[k] - start[k]);
        lever = lever.max(swing.norm());
    }
    let lever = (lever + linear) / (1.0 - turn);
    let slack = 2.0 * turn * (linear + turn * lever);
    let turn = (spin.cross(&cl.axis).norm() + 2.0 * turn * turn).min(turn);
    Some(Bound { tip: velocity.norm() + slack, turn, slack })
}

/// Direction of a rotary axis and a point on it, table frame, as they show in the forward solution:
/// a quarter turn of it moves the tool by a rotation about that line.
pub(crate) fn rotary_axis(
    machine: &Machine,
    q: &AxisValues,
    axis: usize,
    table_from_tool: &Isometry3<f64>,
    tool_length: f64,
) -> (Vector3<f64>, Vector3<f64>) {
    let mut turned = *q;
    turned[axis] += std::f64::consts::FRAC_PI_2;
    let quarter = machine.forward(&turned, tool_length) * table_from_tool.inverse();
    let direction = quarter.rotation.axis().map_or_else(Vector3::zeros, |u| u.into_inner());
    let t = quarter.translation.vector;
    (direction, (t + direction.cross(&t)) * 0.5)
}

#[cfg(test)]
#[path = "../../tests/unit/motion/stepping.rs"]
mod tests;
