//! How many positions a motion needs, from a bound on how fast the tool moves relative to the workpiece.

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
    parts: Vec<Part>,
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

/// An interval of a motion, and how many of the longest allowed steps it takes at its bound on the speed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Part {
    from: f64,
    to: f64,
    steps: f64,
}

impl Positions {
    fn new(parts: Vec<Part>, is_bounded: bool) -> Self {
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

/// Splits of a part of a motion in half, none of which turns farther than once; more would fill the memory with parts.
const MAX_SPLITS: u32 = 20;

/// Largest turn of all rotary axes together over which speeds are bounded at once, rad. The bound is of second order in it.
pub(crate) const MAX_TURN: f64 = 0.25;

/// Positions of the motion from `start` to `end` under `law` such that neither tip nor rim move farther, nor the tool axis
/// turns farther, than `spacing` allows from one position to the next, relative to the table (and so to the workpiece);
/// nor all rotary axes together farther than the tool axis may, nor the linear axes of the other head together than the tip.
///
/// The motion is cut into parts with a bound on the speed in each, in longest steps per time; the positions lie evenly on
/// the sum of the steps, so that from one to the next it is at most one. Where an axis turns on and on alone, they lie on its last
/// turn, which repeats those before.
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
    fn split(&self, from: f64, to: f64, depth: u32, parts: &mut Vec<Part>) -> bool {
        let (Ok(start), Ok(end)) = (self.motion.at(from), self.motion.at(to)) else {
            // The axes cannot follow: the position at the end of the part will show it.
            parts.push(Part { from, to, steps: 1.0 });
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
        // A table that turns about the tool moves neither tip nor tool axis, but clamps and cheeks past the head.
        let turn = b.turn.max(ways(self.machine, &start, &end)[1]);
        // So does the other head, which moves neither.
        let [other_way, _] = ways_of(self.machine, &start, &end, |k| !self.machine.moves_tool(k));
        let steps = ((b.tip + self.spacing.reach * b.turn).max(other_way) / self.spacing.max_step)
            .max(turn / self.spacing.max_turn)
            // The velocity changes by at most the slack over the part: that is the largest acceleration.
            .max((b.slack / (8.0 * self.spacing.max_bulge)).sqrt());
        parts.push(Part { from, to, steps });
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

/// Bounds on the way of the tip and the turn of the tool axis while all axes go linearly from `start` to `end`.
///
/// With D the turn of all rotary and S the way of all linear axes, and L the largest distance of the tip from a rotary
/// axis: the tip's velocity is a sum of one vector per axis. Along the motion the vectors are turned by at most D, and the
/// levers of the rotary ones change by at most S + D·L, so that the velocity stays within 2·D·S + 2·D²·L of that at the
/// start. In the same way the velocity of the tool axis stays within 2·D² of its start. L itself is at most
/// (L at the start + S) / (1 − D).
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

/// Direction of a rotary axis and a point on it, table frame, as they show in the forward solution: a quarter turn of it
/// moves the tool by a rotation about that line.
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
mod tests {
    use crate::motion::stepping::*;
    use facemill_cl_data::RapidLaw;

    const SPACING: Spacing = Spacing { max_step: 0.5, max_turn: 0.0035, max_bulge: 0.005, reach: 82.0 };
    const LENGTH: f64 = 260.0;

    struct Lcg(u64);

    impl Lcg {
        fn between(&mut self, low: f64, high: f64) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            low + (high - low) * ((self.0 >> 11) as f64 / (1u64 << 53) as f64)
        }
    }

    /// Random start on the preset's table, and an end up to `mm` and `rad` away.
    fn random_ends(machine: &Machine, rng: &mut Lcg, mm: f64, rad: f64) -> [AxisValues; 2] {
        let n = machine.axes().len();
        let is_linear = |k: usize| machine.axes()[k].kind == AxisKind::Linear;
        let start =
            AxisValues::from_fn(
                n,
                |k| {
                    if is_linear(k) { rng.between(-1500.0, 1500.0) } else { rng.between(-1.2, 1.2) }
                },
            );
        let end = AxisValues::from_fn(n, |k| {
            start[k] + if is_linear(k) { rng.between(-mm, mm) } else { rng.between(-rad, rad) }
        });
        [start, end]
    }

    /// Largest step of tip and farthest rim point, and largest turn, between neighbouring positions; and what the sum of
    /// all steps would need at least.
    fn measure(machine: &Machine, law: BlockLaw, [start, end]: [&AxisValues; 2]) -> (f64, f64, f64, usize) {
        let motion = Motion::new(machine, law, start, end, LENGTH).unwrap();
        let all = positions(machine, &motion, law, [start, end], LENGTH, &SPACING);
        let told = all.n();
        let mut before = machine.cl_point(start, LENGTH);
        let (mut step, mut turn, mut needed, mut n) = (0.0_f64, 0.0_f64, 0.0, 0);
        for t in all {
            let cl = motion.cl_at(t).unwrap();
            let angle = before.axis.cross(&cl.axis).norm().atan2(before.axis.dot(&cl.axis));
            let way = (cl.tip - before.tip).norm();
            step = step.max(way + SPACING.reach * angle);
            turn = turn.max(angle);
            needed += ((way + SPACING.reach * angle) / SPACING.max_step).max(angle / SPACING.max_turn);
            n += 1;
            before = cl;
        }
        assert_eq!(motion.cl_at(1.0), Ok(before));
        assert_eq!(told, n as u64);
        (step, turn, needed, n)
    }

    #[test]
    fn positions_are_never_farther_apart_than_asked_and_not_many_more_than_needed() {
        let machine = Machine::head_b_table_c().unwrap();
        let mut rng = Lcg(5);
        for (mm, rad) in [(5.0, 0.003), (5.0, 0.05), (0.0, 0.3), (300.0, 0.0), (400.0, 2.5), (0.001, 0.0)] {
            for law in [
                BlockLaw::Cutting(CuttingLaw::AxesLinear),
                BlockLaw::Cutting(CuttingLaw::TipAndRotariesLinear),
                BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned),
                BlockLaw::Rapid(RapidLaw::Linear),
                BlockLaw::Rapid(RapidLaw::PerAxis),
            ] {
                for _ in 0..6 {
                    let [start, end] = random_ends(&machine, &mut rng, mm, rad);
                    let (step, turn, needed, n) = measure(&machine, law, [&start, &end]);
                    assert!(step <= SPACING.max_step * (1.0 + 1e-9), "{law:?} {mm} {rad}: {step}");
                    assert!(turn <= SPACING.max_turn * (1.0 + 1e-6), "{law:?} {mm} {rad}: {turn}");
                    assert!(n as f64 <= 1.5 * needed + 2.0, "{law:?} {mm} {rad}: {n} for {needed}");
                }
            }
        }
    }

    #[test]
    fn a_table_that_turns_about_the_tool_is_followed() {
        let machine = Machine::head_b_table_c().unwrap();
        let start = AxisValues::from([0.0, 0.0, 300.0, 0.0, 0.0]);
        let mut end = start;
        end[4] = 1.0;
        let law = BlockLaw::Rapid(RapidLaw::Linear);
        let (step, turn, _, n) = measure(&machine, law, [&start, &end]);
        assert!(step < 1e-9 && turn < 1e-9, "neither tip nor axis moves");
        assert!(n as f64 >= 1.0 / SPACING.max_turn, "{n} positions");
    }

    #[test]
    fn axes_that_cancel_at_the_tip_need_few_positions() {
        // The table turns half a degree and X and Y follow the tip, 1.4 m from the table's axis: 12 mm of axis travel for
        // a tip that hardly moves.
        let machine = Machine::head_b_table_c().unwrap();
        let start = AxisValues::from([1000.0, 1000.0, 300.0, 0.0, 0.0]);
        let mut turned = start;
        turned[4] = 0.5_f64.to_radians();
        let tip = machine.cl_point(&start, LENGTH).tip;
        let end = machine.with_tip_at(&turned, &tip, LENGTH).unwrap();
        assert!((end[0] - start[0]).hypot(end[1] - start[1]) > 10.0);
        let law = BlockLaw::Cutting(CuttingLaw::AxesLinear);
        let (_, _, _, n) = measure(&machine, law, [&start, &end]);
        assert!(n <= 4, "{n} positions");
    }
}
