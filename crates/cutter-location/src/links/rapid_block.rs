//! A rapid block as the control drives it.

use facemill_inverse_kinematics::{AxisKind, AxisValues, BlockLaw, Machine, Motion, Unreachable};

use crate::links::link::{FAR, LegWalk, LinkBlocked, Linker, MAX_STEPS, least_advance};
use crate::links::rewind::rewound_axis;
use crate::pose::placed_machine::PlacedMachine;
use crate::pose::workcell::{Configuration, Infeasible};

/// Largest turn of all rotary axes together in a step of a rapid block, rad.
const LARGEST_TURN: f64 = 0.06;

/// Factor by which a point may move farther than to its end on a step that turns by so little: the
/// tip moves on an arc.
const ARC_FACTOR: f64 = 1.1;

/// Turn of all rotary axes together, rad, that is too large even for the smallest step: next to the
/// pole they turn fast, and no turn of the tool leads to another branch or winding.
const JUMP: f64 = 2.0 * LARGEST_TURN;

/// Way of a point, mm, that is too long for the smallest step where that distance is not free.
const UNTESTED: f64 = 1.0;

/// Fraction of the arrow between the middle of a step and that of its chord by which an axis may
/// move beyond both ends and the middle: a quarter where the way is a parabola, and as much again.
const BEYOND_MIDDLE: f64 = 0.5;

impl Linker<'_, '_> {
    /// Tests a rapid block as the control drives it, such as the one from one branch to the other.
    /// The tested positions are so close that the free distance beyond `clearance` covers the
    /// machine's motion to the next one. Where the control keeps the tip on a line, and linear axes
    /// therefore move beyond both ends, the block's limits are tested, too.
    ///
    /// # Errors
    /// The first position that is nearer than `clearance` to something, beyond a limit, or where
    /// the axes would have to jump; the start where there is no motion.
    pub fn rapid_block(&mut self, from: &AxisValues, to: &AxisValues, clearance: f64) -> Result<(), LinkBlocked> {
        let test = self.test;
        let machine = test.cell.machine;
        let length = test.cell.tool.gauge_length();
        let pose_at = |axes: &AxisValues| machine.cl_point(axes, length).transformed(test.work_from_table());
        let law = self.settings.rapid_law;
        let Ok(motion) = Motion::new(machine, law, from, to, length) else {
            return Err(LinkBlocked { pose: pose_at(from), why: Infeasible::TooLong });
        };
        let keeps_tip = matches!(law, BlockLaw::Cutting(_));
        let at = |t: f64| {
            let axes = motion.at(t).map_err(Infeasible::Unreachable)?;
            Ok(Configuration { axes, branch: machine.branch_of(&axes) })
        };
        let largest_step = (LARGEST_TURN / turn(machine, from, to)).min(1.0);
        let mut walk = LegWalk { t: 0.0, step: largest_step };
        let mut here = Configuration { axes: *from, branch: machine.branch_of(from) };
        for _ in 0..MAX_STEPS {
            let (distance, nearest) = test.rapid_distance(&here.axes, clearance + FAR, &mut self.hints);
            let pose = pose_at(&here.axes);
            let blocked = |why: Infeasible| LinkBlocked { pose, why };
            if let Some(why) = nearest.filter(|_| distance < clearance) {
                return Err(blocked(why));
            }
            if walk.t >= 1.0 {
                return Ok(());
            }
            let stance = PlacedMachine::new(test, &here);
            let moved = |t: f64| {
                let next: Configuration = at(t)?;
                // Axes that follow the turning tool vector do not turn evenly.
                let is_far = keeps_tip && turn(machine, &here.axes, &next.axes) > JUMP;
                Ok(if is_far { f64::INFINITY } else { ARC_FACTOR * stance.motion_to(&PlacedMachine::new(test, &next)) })
            };
            walk.step = walk.step.min(largest_step);
            let (free, before) = ((distance - clearance).max(least_advance(clearance)), walk.t);
            walk.advance(free, moved).map_err(blocked)?;
            let next = at(walk.t).map_err(blocked)?;
            if keeps_tip {
                let middle = at(0.5 * (before + walk.t)).map_err(blocked)?;
                if moved(walk.t).map_err(blocked)? > free.max(UNTESTED) {
                    return Err(blocked(why_jump(machine, &here.axes, to)));
                }
                within_limits(machine, [&here.axes, &middle.axes, &next.axes]).map_err(blocked)?;
            }
            here = next;
        }
        Err(LinkBlocked { pose: pose_at(to), why: Infeasible::TooLong })
    }
}

/// Returns the turn of all rotary axes together.
fn turn(machine: &Machine, from: &AxisValues, to: &AxisValues) -> f64 {
    let rotary = |k: &usize| machine.axes()[*k].kind == AxisKind::Rotary;
    (0..from.len()).filter(rotary).map(|k| (to.get_or_zero(k) - from.get_or_zero(k)).abs()).sum()
}

/// Explains that axes would have to jump on their way.
fn why_jump(machine: &Machine, from: &AxisValues, to: &AxisValues) -> Infeasible {
    let other_branch = Infeasible::OtherBranch(machine.branch_of(to));
    rewound_axis(machine, from, to).map_or(other_branch, |axis| Infeasible::Rewind { axis })
}

/// Checks that the linear axes stay within their limits over a step, given by its start, middle and
/// end.
fn within_limits(machine: &Machine, [start, middle, end]: [&AxisValues; 3]) -> Result<(), Infeasible> {
    for (k, axis) in machine.axes().iter().enumerate().filter(|(_, a)| a.kind == AxisKind::Linear) {
        let beyond = BEYOND_MIDDLE * (middle[k] - 0.5 * (start[k] + end[k])).abs();
        let (low, high) = (start[k].min(middle[k]).min(end[k]), start[k].max(middle[k]).max(end[k]));
        let value = if low - beyond < axis.min { low - beyond } else { high + beyond };
        if !axis.holds(value) {
            let (letter, kind) = (axis.letter, axis.kind);
            let (min, max) = (axis.min, axis.max);
            let limit = Unreachable::AxisLimit { axis: letter, index: k, kind, value, min, max };
            return Err(Infeasible::Unreachable(limit));
        }
    }
    Ok(())
}
