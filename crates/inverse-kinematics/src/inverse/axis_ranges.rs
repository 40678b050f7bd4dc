//! Axis values over a set of tool poses, bounded from outside.
//!
//! For tool axes within a cone and tips within a ball: the second rotary axis depends,
//! monotonically, only on the angle between tool axis and first rotary axis; the first depends on
//! that angle and on the tool axis' azimuth, which a cone beside the pole bounds. The motion of the
//! tip about both rotary axes bounds the compensating motion of the linear axes.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use facemill_cl_data::{Aabb, ClPoint};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::axes::axis::{Axis, AxisKind, Carrier};
use crate::axes::axis_values::{AxisValues, MAX_AXES};
use crate::machine::Machine;
use crate::solver::Solver;
use crate::solver::direction_pair::DirectionPair;
use crate::solver::inverse_solution::{Branch, InverseSolution, Unreachable};
use crate::solver::screw_chain::Screw;

/// Tool poses in the table frame: axes within an angle of one, tips within a distance of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseSet {
    /// The pose in the middle.
    pub cl: ClPoint,
    /// Largest angle between the tool axis and that in the middle, rad.
    pub turn: f64,
    /// Largest distance between the tip and that in the middle, mm.
    pub shift: f64,
}

/// Axis values of one branch over a [`PoseSet`]; limits are not tested.
///
/// The poses do not determine axes that do not [move the tool](Machine::moves_tool): these are at
/// home, with 0 for the half. A caller that moves them sets both before calling
/// [`Machine::body_travel`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisRange {
    /// The branch.
    pub branch: Branch,
    /// Values in the middle, at the turns nearest to home.
    pub middle: AxisValues,
    /// Largest difference of each value from that in the middle, up to full turns.
    pub half: AxisValues,
}

/// Knowledge of the axis values over a [`PoseSet`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "copied about on the stack only, where a box would cost more")]
pub enum AxisRanges {
    /// Every pose has exactly these two solutions, limits aside.
    Both([AxisRange; 2]),
    /// No pose of the set is in reach, whatever the limits.
    OutOfReach(Unreachable),
    /// Nothing is proven: the set reaches to the pole or to the edge of the reach, or the machine's
    /// order of joints is not supported (a rotary joint between two linear ones, or three rotary
    /// joints).
    Unknown,
}

/// Axis limits over an [`AxisRange`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LimitVerdict {
    /// All values of all axes can be taken within the limits.
    Within,
    /// One axis is beyond its limits for all values; holds its values in the middle.
    Beyond(Unreachable),
    /// Neither is proven.
    Unknown,
}

/// Margin added to every half range, mm or rad: rounding of the closed forms, which is 1e-12 of
/// some metres, and the excess over a limit that counts as rounding (2e-10).
const SLACK: f64 = 1e-8;

/// Distance that the cone keeps from the pole and from the edge of the reach, rad: nearer, angles
/// are noise.
const FROM_POLE: f64 = 1e-6;

impl Machine {
    /// Bounds the axis values of all tool poses of a set: closed form, conservative.
    pub fn axis_ranges(&self, set: &PoseSet, tool_length: f64) -> AxisRanges {
        // Also refuses NaN.
        if !(set.turn >= 0.0 && set.turn < FRAC_PI_2 && set.shift >= 0.0 && set.shift.is_finite()) {
            return AxisRanges::Unknown;
        }
        let Solver::Closed { rotaries, .. } = &self.solver else { return AxisRanges::Unknown };
        let solutions = match self.unlimited_pair(rotaries, &set.cl, tool_length, &self.home()) {
            Ok((first, Some(second))) => [first, second],
            Err(why @ Unreachable::Direction { by, .. }) if by > set.turn + FROM_POLE => {
                return AxisRanges::OutOfReach(why);
            }
            _ => return AxisRanges::Unknown,
        };
        let ranges = solutions.map(|s| self.range_of(rotaries, set, tool_length, &s));
        match ranges {
            [Some(first), Some(second)] => AxisRanges::Both([first, second]),
            _ => AxisRanges::Unknown,
        }
    }

    fn range_of(
        &self,
        rotaries: &DirectionPair,
        set: &PoseSet,
        tool_length: f64,
        solution: &InverseSolution,
    ) -> Option<AxisRange> {
        let rotary = self.rotary_halves(set)?;
        let joints = Joints::new(self, &solution.values, tool_length);
        let linear = self.linear_halves(&joints, &rotary, set)?;
        let mut half = AxisValues::zeros(self.axes.len());
        let mut n_linear = 0;
        for screw in &self.chain.screws {
            half[screw.axis] = SLACK
                + match screw.kind {
                    AxisKind::Rotary if screw.axis == rotaries.first.axis => rotary[0],
                    AxisKind::Rotary => rotary[1],
                    AxisKind::Linear => {
                        n_linear += 1;
                        linear[n_linear - 1]
                    }
                };
        }
        half.is_finite().then_some(AxisRange { branch: solution.branch, middle: solution.values, half })
    }

    /// Returns the largest differences of the two rotary axes from their values in the middle.
    fn rotary_halves(&self, set: &PoseSet) -> Option<[f64; 2]> {
        let mut rotaries = self.chain.screws.iter().filter(|s| s.kind == AxisKind::Rotary);
        let (first, second) = (rotaries.next()?.direction, rotaries.next()?.direction);
        let sides = Sides { between: angle(&first, &second), spindle: angle(&self.chain.spindle_at_zero(), &second) };
        let to_first = angle(&set.cl.axis, &first);
        let (least, most) = (to_first - set.turn, to_first + set.turn);
        let (nearest, farthest) = sides.reach();
        let beside = least > nearest.max(0.0) + FROM_POLE && most < farthest.min(PI) - FROM_POLE;
        if !beside {
            return None;
        }
        let [first_half, second_half] = sides.halves(to_first, set.turn);
        let azimuth = (set.turn.sin() / to_first.sin()).min(1.0).asin();
        Some([azimuth + first_half, second_half])
    }

    /// Returns the largest differences of the three linear axes from their values in the middle, in
    /// chain order.
    ///
    /// For any motion of the rotaries, D·(linear rates) is the tip's rate minus the part due to
    /// each rotary, which is at most its own rate times the tip's distance from its axis.
    fn linear_halves(&self, joints: &Joints<'_>, rotary: &[f64; 2], set: &PoseSet) -> Option<[f64; 3]> {
        let screws = &self.chain.screws;
        let first = screws.iter().position(|s| s.kind == AxisKind::Linear)?;
        let last = screws.iter().rposition(|s| s.kind == AxisKind::Linear)?;
        // With a rotary joint between them their directions would not keep their angles.
        if last - first != 2 {
            return None;
        }
        let way = set.shift + joints.tip_ways(rotary, set.shift)?;
        let [x, y, z] = [0, 1, 2].map(|k| screws[first + k].direction.into_inner());
        let (yz, zx, xy) = (y.cross(&z), z.cross(&x), x.cross(&y));
        let determinant = x.dot(&yz).abs();
        (determinant > 1e-6).then(|| [yz, zx, xy].map(|row| way * row.norm() / determinant))
    }

    /// Compares a range of axis values with the limits. Axes that do not move the tool are not
    /// tested, as for a solution.
    pub fn limits_over(&self, range: &AxisRange) -> LimitVerdict {
        let mut all_within = true;
        for (index, axis) in self.axes.iter().enumerate().filter(|(k, _)| self.moves_tool(*k)) {
            let (value, half) = (range.middle.get_or_zero(index), range.half.get_or_zero(index));
            match on_axis(axis, value, half) {
                Some(true) => {}
                Some(false) => {
                    let &Axis { letter, kind, min, max, .. } = axis;
                    let value = if kind == AxisKind::Rotary { nearest_to(axis, value) } else { value };
                    return LimitVerdict::Beyond(Unreachable::AxisLimit { axis: letter, index, kind, value, min, max });
                }
                None => all_within = false,
            }
        }
        if all_within { LimitVerdict::Within } else { LimitVerdict::Unknown }
    }

    /// Returns a distance, mm, within which every point of a body of the machine stays from its
    /// place in the middle of the range, table frame. It is the smaller of two bounds: by the
    /// joints between table and body, or by tip and tool axis and the joints between tool and body.
    /// A body of the other head moves by its own axes too, as far as the range gives them.
    pub fn body_travel(&self, body: usize, range: &AxisRange, set: &PoseSet, tool_length: f64) -> f64 {
        let body = &self.bodies[body];
        let chain = self.chain_to(body);
        let pose = chain.motion_behind(body.n_joints, &range.middle) * body.table_from_solid_at_zero;
        let bounds = body.body.solid.aabb();
        let center = pose * nalgebra::center(&bounds.min, &bounds.max);
        let joints = Joints::new(self, &range.middle, tool_length);
        let lines = match &self.other {
            Some(other) if body.carrier() == Some(Carrier::OtherHead) => lines_of(&other.chain.screws, &range.middle),
            _ => joints.axes,
        };
        let half = |screw: &Screw| range.half.get_or_zero(screw.axis);
        // Each joint carries what is behind it; the distances from it grow with the joints on the
        // way.
        let reach = (bounds.max - bounds.min).norm() * 0.5;
        let way = |order: &mut dyn Iterator<Item = (&Screw, &JointAxisLine)>| {
            order.fold(0.0, |way, (screw, line)| {
                let rate = match screw.kind {
                    AxisKind::Linear => 1.0,
                    AxisKind::Rotary => distance(line, &center) + reach + way,
                };
                way + half(screw) * rate
            })
        };
        let to_body = || chain.screws[..body.n_joints].iter().zip(&lines);
        let by_table = way(&mut to_body().rev());
        let turn: f64 = self.chain.screws.iter().filter(|s| s.kind == AxisKind::Rotary).map(half).sum();
        // To the other head, the path runs from the tool back to the bed, where both chains part.
        let parts_at = match &self.other {
            Some(other) if body.carrier() == Some(Carrier::OtherHead) => other.n_shared,
            _ => body.n_joints,
        };
        let to_tool = self.chain.screws.iter().zip(&joints.axes).skip(parts_at);
        let against_tool = way(&mut to_body().skip(parts_at).rev().chain(to_tool));
        let from_tip = |p: &Point3<f64>| p - joints.tip;
        let tool_axis = self.linear_map(&range.middle, tool_length).tool_axis;
        // The tool's frame turns as its axis does, and about its axis by no more than its whole
        // turn and back.
        let all = corners(&bounds).map(|p| pose * p);
        let largest = |of: &dyn Fn(&Point3<f64>) -> f64| all.iter().map(of).fold(0.0, f64::max);
        let by_axis =
            largest(&|p| set.turn * from_tip(p).norm() + (turn + set.turn) * from_tip(p).cross(&tool_axis).norm());
        let by_tool = set.shift + by_axis.min(largest(&|p| turn * from_tip(p).norm())) + against_tool;
        by_table.min(by_tool) + SLACK
    }
}

fn corners(bounds: &Aabb) -> [Point3<f64>; 8] {
    let pick = |k: usize, axis: usize| if k >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
    std::array::from_fn(|k| Point3::new(pick(k, 0), pick(k, 1), pick(k, 2)))
}

/// Constant sides of the spherical triangle of first axis, second axis and tool axis.
#[derive(Debug)]
struct Sides {
    /// Between the two rotary axes.
    between: f64,
    /// Between spindle and second axis.
    spindle: f64,
}

impl Sides {
    /// Returns the least and largest angle between tool axis and first axis.
    fn reach(&self) -> (f64, f64) {
        let sum = self.between + self.spindle;
        ((self.between - self.spindle).abs(), sum.min(TAU - sum))
    }

    /// Returns the angles at the first and at the second axis (half-angle formulas).
    fn angles(&self, to_first: f64) -> [f64; 2] {
        let half = 0.5 * (to_first + self.between + self.spindle);
        let [first, between, spindle, all] =
            [half - to_first, half - self.between, half - self.spindle, PI - half].map(|m| m.max(0.0).sin().max(0.0));
        let at_first = 2.0 * (between * first).sqrt().atan2((all * spindle).sqrt());
        [at_first, 2.0 * (between * spindle).sqrt().atan2((all * first).sqrt())]
    }

    /// Returns the largest change of both angles from those at `to_first` when it changes by up to
    /// `turn`. The second is monotone; the first turns back at most once.
    fn halves(&self, to_first: f64, turn: f64) -> [f64; 2] {
        let (least, most) = (to_first - turn, to_first + turn);
        let at = self.angles(to_first);
        let turning = self.turning_point().filter(|a| least < *a && *a < most);
        let extremes = [least, most].into_iter().chain(turning);
        extremes
            .map(|a| self.angles(a))
            .fold([0.0, 0.0], |far: [f64; 2], e| [far[0].max((e[0] - at[0]).abs()), far[1].max((e[1] - at[1]).abs())])
    }

    /// Returns where the angle at the first axis is largest or smallest: its cosine (cos c − cos
    /// a·cos b)/(sin a·sin b) has the derivative (cos b − cos c·cos a)/(sin²a·sin b), with a the
    /// side to the tool axis, b between, c of the spindle.
    fn turning_point(&self) -> Option<f64> {
        let cosine = self.between.cos() / self.spindle.cos();
        (cosine.abs() <= 1.0).then(|| cosine.acos())
    }
}

/// Joints of a machine at given axis values, table frame.
struct Joints<'m> {
    screws: &'m [Screw],
    axes: [JointAxisLine; MAX_AXES],
    tip: Point3<f64>,
}

/// Direction and a point of a joint's axis.
pub(crate) type JointAxisLine = (Vector3<f64>, Point3<f64>);

/// Returns the lines of the joints of a chain at given axis values, table frame.
pub(crate) fn lines_of(screws: &[Screw], q: &AxisValues) -> [JointAxisLine; MAX_AXES] {
    let mut lines = [(Vector3::zeros(), Point3::origin()); MAX_AXES];
    let mut motion = Isometry3::identity();
    for (line, screw) in lines.iter_mut().zip(screws) {
        *line = (motion.rotation * screw.direction.into_inner(), motion * Point3::from(screw.point));
        motion *= screw.motion(q.get_or_zero(screw.axis));
    }
    lines
}

pub(crate) fn distance((direction, point): &JointAxisLine, p: &Point3<f64>) -> f64 {
    direction.cross(&(p - point)).norm()
}

impl<'m> Joints<'m> {
    fn new(machine: &'m Machine, q: &AxisValues, tool_length: f64) -> Self {
        let screws = &machine.chain.screws;
        Self { screws, axes: lines_of(screws, q), tip: machine.cl_point(q, tool_length).tip }
    }

    /// Returns the distance of a point from the axis of a rotary joint.
    fn distance_from(&self, k: usize, p: &Point3<f64>) -> f64 {
        distance(&self.axes[k], p)
    }

    /// Returns the sum of the ways by which the rotary joints move the tip, for their half ranges
    /// in chain order.
    ///
    /// The tip's distance from an axis changes with the joints behind it; or, seen from the link
    /// before the axis, with the tip and the joints in front of it. Linear joints, whose ways are
    /// not known yet, may be on one side only.
    fn tip_ways(&self, rotary: &[f64; 2], shift: f64) -> Option<f64> {
        let at: Vec<usize> = (0..self.screws.len()).filter(|&k| self.screws[k].kind == AxisKind::Rotary).collect();
        let (first, second) = (*at.first()?, *at.get(1)?);
        let linear_in = |from: usize, to: usize| self.screws[from..to].iter().any(|s| s.kind == AxisKind::Linear);
        let unless = |unknown: bool, reach: f64| if unknown { f64::INFINITY } else { reach };
        let (from_first, from_second) = (self.distance_from(first, &self.tip), self.distance_from(second, &self.tip));
        let n = self.screws.len();
        let front_first = unless(linear_in(0, first), from_first + shift);
        let back_second = unless(linear_in(second, n), from_second);
        let front_second = unless(linear_in(0, second), from_second + shift + rotary[0] * front_first);
        let back_first = unless(linear_in(first, n), from_first + rotary[1] * back_second);
        let (reach_first, reach_second) = (front_first.min(back_first), back_second.min(front_second));
        let ways = rotary[0] * reach_first + rotary[1] * reach_second;
        ways.is_finite().then_some(ways)
    }
}

/// Returns whether values within `half` of `value` can all be taken within the limits
/// (`Some(true)`), or none (`Some(false)`).
fn on_axis(axis: &Axis, value: f64, half: f64) -> Option<bool> {
    let value = if axis.kind == AxisKind::Rotary { nearest_to(axis, value) } else { value };
    if axis.min <= value - half && value + half <= axis.max {
        return Some(true);
    }
    // For a rotary axis, the turn nearest to the limits is outside: all others are farther, except
    // those on the other side.
    let beyond = |v: f64| v - half > axis.max || v + half < axis.min;
    let turns: &[f64] = if axis.kind == AxisKind::Rotary { &[-TAU, 0.0, TAU] } else { &[0.0] };
    turns.iter().all(|turn| beyond(value + turn)).then_some(false)
}

/// Returns the value plus the full turns that bring it nearest to the middle of the limits.
fn nearest_to(axis: &Axis, value: f64) -> f64 {
    let middle = if axis.min.is_finite() && axis.max.is_finite() { 0.5 * (axis.min + axis.max) } else { axis.home };
    crate::inverse::nearest_turn(value, middle)
}

fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

#[cfg(test)]
#[path = "../../tests/unit/inverse/axis_ranges.rs"]
mod tests;
