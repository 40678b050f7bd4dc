use std::f64::consts::FRAC_PI_2;

use facemill_cl_data::ClPoint;
use nalgebra::{Point3, Unit, Vector3};

use crate::axes::axis_values::AxisValues;
use crate::inverse::nearest_turn;
use crate::machine::Machine;
use crate::motion::turned_axis;
use crate::solver::Solver;
use crate::solver::direction_pair::PairSolution;
use crate::solver::inverse_solution::{Branch, InverseSolution, InverseSolutions};

/// A solution of a pose, its rotary values at any winding.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Base {
    pub(crate) values: AxisValues,
    pub(crate) branch: Branch,
    /// The branches meet here, or the first rotary axis is free: the way continues along either
    /// branch.
    pub(crate) meets: bool,
    pub(crate) free_axis: Option<usize>,
    /// With three rotary axes: largest difference of a rotary value to the nearest other solution,
    /// rad.
    pub(crate) apart: f64,
    /// Whether it is within the limits at some winding.
    pub(crate) within: bool,
}

/// The ideal motion between two poses: tip straight, tool axis turning evenly in the plane of its
/// ends.
struct Ideal<'a> {
    from: &'a ClPoint,
    to: &'a ClPoint,
    angle: f64,
}

/// The continuous solution at a place of the way.
#[derive(Clone, Copy)]
struct FollowedPosition {
    values: AxisValues,
    branch: Branch,
    meets: bool,
    apart: f64,
}

/// Turn of a rotary axis, rad, below which the nearest turn is the continuous one. With two rotary
/// axes, on a way of at most 90° along which the angle to the first axis only grows or only
/// shrinks, no value changes by more than 270° (90° of azimuth, 180° in the triangle), so an
/// apparent change of less than 90° is not one minus a full turn.
const SURE_STEP: f64 = FRAC_PI_2;

/// The same with three rotary axes, where no bound on the change is known: an estimate.
const SMALL_STEP: f64 = 10.0 * FRAC_PI_2 / 90.0;

/// With three rotary axes the other solutions at both ends must be farther apart than a step by
/// this factor, or the way is subdivided.
const CLEARLY_FARTHER: f64 = 3.0;

/// Largest number of evaluated places of a way: more than halving down to rounding takes with two
/// rotary axes. With three, a solution may need more where it runs close to another one; it then
/// counts as not continued.
const MOST_LOOKS: usize = 200;

/// Cosine below which two tool axes count as opposite, as for the motion of a block.
const OPPOSITE_COSINE: f64 = -1.0 + 5e-15;

/// Distance from the pole at which the limit of the free axis is read, rad: the error of the limit;
/// large enough for the azimuth to be known to 1e-8.
const BESIDE_POLE: f64 = 1e-7;

/// Smallest difference of rotary values, apart from full turns, between two solutions of one pose,
/// rad.
const SAME: f64 = 1e-6;

impl Ideal<'_> {
    fn at(&self, t: f64) -> ClPoint {
        let tip = self.from.tip + (self.to.tip - self.from.tip) * t;
        ClPoint { tip, axis: turned_axis(&self.from.axis, &self.to.axis, t) }
    }

    /// Returns where between the ends the angle to a direction is least or largest.
    fn turning_point(&self, w: &Vector3<f64>) -> Option<f64> {
        let n = self.from.axis.cross(&self.to.axis);
        let (here, there) = (n.cross(&self.from.axis).dot(w), n.cross(&self.to.axis).dot(w));
        if here * there >= 0.0 {
            return None;
        }
        let along = Unit::try_new(n, 1e-300)?.cross(&self.from.axis);
        let turn = (along.dot(w)).atan2(self.from.axis.dot(w)).rem_euclid(std::f64::consts::PI);
        let t = turn / self.angle;
        (t > 0.0 && t < 1.0).then_some(t)
    }
}

/// Returns the angle between two directions.
pub(crate) fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

impl Machine {
    /// Returns all solutions of a pose, including those beyond the limits.
    pub(crate) fn bases(
        &self,
        cl: &ClPoint,
        tool_length: f64,
    ) -> Result<Vec<Base>, crate::solver::inverse_solution::Unreachable> {
        let all = self.unlimited(cl, tool_length, &self.home())?;
        let is_closed = self.is_closed();
        let meets = match &self.solver {
            Solver::Closed { rotaries, .. } if all.len() == 1 => {
                !matches!(rotaries.solve(&cl.axis), PairSolution::Two { .. })
            }
            _ => false,
        };
        let base = |solution: InverseSolution| {
            let inside = self.within_limits(solution);
            Base {
                values: inside.map_or(solution.values, |s| s.values),
                branch: solution.branch,
                meets,
                apart: if is_closed { f64::INFINITY } else { self.apart(&solution, &all) },
                free_axis: solution.free_axis,
                within: inside.is_ok(),
            }
        };
        Ok(all.iter().map(base).collect())
    }

    /// Returns the solutions among `ends`, those of pose `to`, that continue `start` along the
    /// ideal motion from pose `from`, and their values with the rotary ones unrolled from those of
    /// `start`. At most one, or two from a pose where branches meet.
    pub(crate) fn followed(
        &self,
        (from, start): (&ClPoint, &Base),
        (to, ends): (&ClPoint, &[Base]),
        tool_length: f64,
    ) -> impl Iterator<Item = (usize, AxisValues)> {
        let one = |start| self.followed_on((from, &start), (to, ends), tool_length);
        let other = match start.branch {
            Branch::Positive => Branch::Negative,
            Branch::Negative => Branch::Positive,
        };
        let own = one(Base { meets: start.free_axis.is_some(), ..*start });
        let other = if start.meets { one(Base { branch: other, meets: false, ..*start }) } else { None };
        own.into_iter().chain(other.filter(|(k, _)| own.is_none_or(|(own, _)| own != *k)))
    }

    fn followed_on(
        &self,
        (from, start): (&ClPoint, &Base),
        (to, ends): (&ClPoint, &[Base]),
        tool_length: f64,
    ) -> Option<(usize, AxisValues)> {
        if from.axis.dot(&to.axis) < OPPOSITE_COSINE {
            return None;
        }
        let ideal = Ideal { from, to, angle: angle(&from.axis, &to.axis) };
        let mut place =
            FollowedPosition { values: start.values, branch: start.branch, meets: start.meets, apart: start.apart };
        let turning = match &self.solver {
            Solver::Closed { rotaries, .. } => ideal.turning_point(&rotaries.first.direction),
            Solver::Numeric(_) => None,
        };
        let (mut reached, mut looks) = (0.0, MOST_LOOKS);
        if let Some(t) = turning {
            place = self.advanced(&ideal, &place, [0.0, t], ends, tool_length, &mut looks)?;
            reached = t;
        }
        let place = self.advanced(&ideal, &place, [reached, 1.0], ends, tool_length, &mut looks)?;
        // Beside the edge of the reach two solutions are this close to each other.
        let turn = |end: &Base| self.largest_turn(&end.values, &place.values);
        let (index, nearest) = ends.iter().enumerate().min_by(|a, b| turn(a.1).total_cmp(&turn(b.1)))?;
        (turn(nearest) < SAME).then_some((index, place.values))
    }

    /// Returns the distance of a solution to the nearest other one.
    fn apart(&self, solution: &InverseSolution, all: &InverseSolutions) -> f64 {
        let others = all.iter().filter(|other| other.values != solution.values);
        others.map(|other| self.largest_turn(&solution.values, &other.values)).fold(f64::INFINITY, f64::min)
    }

    /// Returns the largest difference of rotary values, apart from full turns.
    fn largest_turn(&self, a: &AxisValues, b: &AxisValues) -> f64 {
        let rotary = (0..a.len()).filter(|&k| self.is_rotary(k));
        rotary.map(|k| (nearest_turn(b[k], a[k]) - a[k]).abs()).fold(0.0, f64::max)
    }

    fn is_closed(&self) -> bool {
        matches!(self.solver, Solver::Closed { .. })
    }

    /// Returns whether the rotary values are the same, apart from full turns.
    pub(crate) fn same_rotaries(&self, a: &AxisValues, b: &AxisValues) -> bool {
        self.largest_turn(a, b) < SAME
    }

    fn advanced(
        &self,
        ideal: &Ideal<'_>,
        place: &FollowedPosition,
        [start, end]: [f64; 2],
        ends: &[Base],
        tool_length: f64,
        looks: &mut usize,
    ) -> Option<FollowedPosition> {
        *looks = looks.checked_sub(1)?;
        if !self.is_closed() || ideal.angle * (end - start) <= FRAC_PI_2 {
            let there = if end == 1.0 {
                self.step(place, ends)
            } else {
                self.step(place, &self.bases(&ideal.at(end), tool_length).ok()?)
            };
            if there.is_some() {
                return there;
            }
        }
        let middle = 0.5 * (start + end);
        if middle <= start || middle >= end {
            return None;
        }
        let half = self.advanced(ideal, place, [start, middle], ends, tool_length, looks)?;
        self.advanced(ideal, &half, [middle, end], ends, tool_length, looks)
    }

    /// Returns the solution that is surely the continuous one, if it can be identified.
    fn step(&self, place: &FollowedPosition, ends: &[Base]) -> Option<FollowedPosition> {
        let is_closed = self.is_closed();
        let turned = ends.iter().map(|end| {
            let mut values = end.values;
            let mut most = 0.0_f64;
            for k in (0..values.len()).filter(|&k| self.is_rotary(k)) {
                // A free axis keeps its value.
                values[k] = if is_closed && end.free_axis == Some(k) {
                    place.values[k]
                } else {
                    nearest_turn(values[k], place.values[k])
                };
                most = most.max((values[k] - place.values[k]).abs());
            }
            (most, FollowedPosition { values, branch: end.branch, meets: end.meets, apart: end.apart })
        });
        if is_closed {
            let near = || turned.clone().filter(|(step, _)| *step < SURE_STEP);
            let own = near().find(|(_, end)| end.branch == place.branch || end.meets);
            let other = || if place.meets { near().next() } else { None };
            return own.or_else(other).map(|(_, end)| end);
        }
        let nearest = turned.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let clear = CLEARLY_FARTHER * nearest.0 < place.apart.min(nearest.1.apart);
        (nearest.0 < SMALL_STEP && clear).then_some(nearest.1)
    }

    /// Returns the values at which a solution arrives at a pose with a free axis, on the ideal
    /// motion: the limit of that axis, and the others' values at the pose.
    pub(crate) fn arrival(
        &self,
        (from, start): (&ClPoint, &Base),
        (pole, at_pole): (&ClPoint, &Base),
        tool_length: f64,
    ) -> Option<AxisValues> {
        let ideal = Ideal { from, to: pole, angle: angle(&from.axis, &pole.axis) };
        let mut values = start.values;
        if start.free_axis.is_none() && ideal.angle > 2.0 * BESIDE_POLE {
            let beside = ideal.at(1.0 - BESIDE_POLE / ideal.angle);
            let ends = self.bases(&beside, tool_length).ok()?;
            (_, values) = self.followed((from, start), (&beside, &ends), tool_length).next()?;
        }
        for k in (0..values.len()).filter(|&k| self.is_rotary(k) && at_pole.free_axis != Some(k)) {
            values[k] = nearest_turn(at_pole.values[k], values[k]);
        }
        self.at_rotaries(pole, tool_length, &values)
    }

    /// Returns the values with the linear axes that belong to these rotary ones, checked by the
    /// forward solution.
    pub(crate) fn at_rotaries(&self, cl: &ClPoint, tool_length: f64, rotary: &AxisValues) -> Option<AxisValues> {
        let turns = (0..rotary.len()).filter(|&k| self.is_rotary(k)).map(|k| (k, rotary[k]));
        self.with_rotaries(cl, tool_length, rotary, turns).ok()
    }

    /// Returns the angle between the tool axis of a CL point (table frame) and the nearer end of
    /// the rotary axis nearest to the workpiece, rad: along it that axis may have any value, and
    /// near it turns 1/sin of the angle times as fast as the tool axis. `None` with three rotary
    /// axes, which are singular in poses, not in directions.
    pub fn angle_to_singular(&self, cl: &ClPoint) -> Option<f64> {
        let Solver::Closed { rotaries, .. } = &self.solver else { return None };
        let w = rotaries.first.direction;
        Some(w.cross(&cl.axis).norm().atan2(w.dot(&cl.axis).abs()))
    }
}

/// Returns the distance of two tips.
pub(crate) fn distance(a: &Point3<f64>, b: &Point3<f64>) -> f64 {
    (a - b).norm()
}
