//! Turns of two heads at once, from the end of one pass of each to the start of its next, with both
//! tools down.
//!
//! Each head goes along the curve of a turn of its own (`TurnCurve`). The axis that both share
//! has one value, so at every place of the curves both postures are moved by the least change of
//! tilt and rotate with which it is the same for both: along the gradient of the difference of the
//! values that the heads need. Where the value of one head is largest over its rotates, its tilt
//! makes up for the difference.

use facemill_cl_data::{CcPoint, ClPoint, Posture};
use facemill_cutter_location::links::approach::{RAMP_SLACK, descent};
use facemill_cutter_location::{Configuration, Hints, Infeasible, PairPose, PairTest, rewound_axis};
use facemill_inverse_kinematics::{AxisKind, AxisValues};
use nalgebra::Vector4;

use crate::linearity::{Linearity, endless_near};
use crate::moves::turn::{
    BODY_STEP, LARGEST_STEP, LIFTS, MAX_TESTS, NoTurn, SAME_AXES, SIZES, UPRIGHT, is_beside, rotary_turn,
};
use crate::moves::turn_curve::{AS_PLANNED, CurveEnd, TurnCurve, swings};

/// Both heads where a turn begins or ends.
#[derive(Clone, Copy, Debug)]
pub struct PairTurnEnd {
    /// CC point of each head.
    pub cc: [CcPoint; 2],
    /// Tested pose of both heads.
    pub pose: PairPose,
    /// Straight line of each head beyond its pass, mm.
    pub straight: [f64; 2],
}

/// Turn of both heads.
#[derive(Clone, Debug)]
pub struct PairTurn {
    /// Values of all axes at places between the last cut of both passes and the first one of the
    /// next, both excluded.
    pub places: Vec<AxisValues>,
    /// Largest deviation of either cutter between two of them, mm.
    pub linearisation: f64,
}

/// Search for turns of both heads.
pub struct PairTurnSearch<'t, 'a> {
    /// Both heads.
    pub test: PairTest<'t, 'a>,
    /// Distance between tested poses, mm.
    pub test_step: f64,
    /// Permitted deviation of each head's motion between two places.
    pub linearity: [Linearity; 2],
}

/// Largest change of a posture for the common value of the shared axis, rad.
const MOST_MOVED: f64 = 0.3;

/// Step for slopes of the shared axis over tilt and rotate, rad.
const SLOPE_STEP: f64 = 1e-5;

/// Least slope of the difference of both values, rad of the axis for each rad of posture, or mm.
const LEAST_SLOPE: f64 = 1e-3;

/// Largest difference of the values of both heads, rad or mm: the limit of a double.
const SAME_VALUE: f64 = 1e-10;

/// Steps of the secant method; it converges in four to six.
const SECANTS: usize = 20;

/// Both heads on the way, each with the configuration that it has alone.
#[derive(Clone, Copy)]
struct PairPlace {
    poses: [ClPoint; 2],
    configurations: [Configuration; 2],
    axes: AxisValues,
}

impl PairTurnSearch<'_, '_> {
    /// Returns the first feasible turn from one pass of both heads to their next that is not slower
    /// than a link, with the lowest height above the surface. The straight lines at its ends are
    /// parts of it.
    ///
    /// Positions no farther apart than the test step are tested as the axes take them: each head as
    /// one head is, and both heads against each other.
    ///
    /// # Errors
    /// The reason why there is none.
    pub fn find(
        &self,
        from: &PairTurnEnd,
        to: &PairTurnEnd,
        is_slower: &dyn Fn(&PairTurn) -> bool,
    ) -> Result<PairTurn, String> {
        let of_head = |(head, why): (usize, NoTurn)| format!("head {}: {}", head + 1, why.text(self.test.tests[head]));
        self.found(from, to, is_slower).map_err(of_head)
    }

    fn found(
        &self,
        from: &PairTurnEnd,
        to: &PairTurnEnd,
        is_slower: &dyn Fn(&PairTurn) -> bool,
    ) -> Result<PairTurn, (usize, NoTurn)> {
        for head in 0..2 {
            let radius = self.test.tests[head].cell.tool.cutter().radius();
            if !is_beside(&from.cc[head], &to.cc[head], radius) {
                return Err((head, NoTurn::NotBeside));
            }
        }
        let leads = [self.lead(from, 1.0)?, self.lead(to, -1.0)?];
        let ends = [self.ends([from, to], &leads, 0)?, self.ends([from, to], &leads, 1)?];
        let (mut refused, mut slower) = (None, false);
        for of_first in swings(&ends[0]) {
            for of_second in swings(&ends[1]) {
                for size in SIZES {
                    match self.lowest((&ends, [of_first, of_second], size), &leads, to) {
                        Ok(turn) if is_slower(&turn) => slower = true,
                        Ok(turn) => return Ok(turn),
                        Err((head, why)) => {
                            let is_blocked = why.may_be_lifted();
                            refused.get_or_insert((head, why));
                            if !is_blocked {
                                break;
                            }
                        }
                    }
                }
            }
        }
        if slower { Err((0, NoTurn::Slower)) } else { Err(refused.unwrap_or((0, NoTurn::Postures))) }
    }

    /// Returns the turn of these swings with the lowest height at which it is feasible.
    fn lowest(
        &self,
        (ends, swing, size): (&[[CurveEnd; 2]; 2], [f64; 2], f64),
        leads: &[Vec<PairPlace>; 2],
        to: &PairTurnEnd,
    ) -> Result<PairTurn, (usize, NoTurn)> {
        let mut refused = None;
        for lift in LIFTS {
            let curve = |h: usize| TurnCurve::new(self.test.tests[h], &ends[h], swing[h], size, lift);
            match self.tested(&[curve(0), curve(1)], leads, to) {
                Ok(turn) => return Ok(turn),
                Err((head, why)) if why.may_be_lifted() => {
                    refused.get_or_insert((head, why));
                }
                Err(why) => return Err(why),
            }
        }
        Err(refused.unwrap_or((0, NoTurn::Postures)))
    }

    /// Returns the places along the straight lines at an end, from the pass outward, the cut itself
    /// first; the rotary axes rest. `sign` is 1 behind a pass, −1 before one.
    fn lead(&self, end: &PairTurnEnd, sign: f64) -> Result<Vec<PairPlace>, (usize, NoTurn)> {
        let cut = PairPlace {
            poses: end.pose.poses.map(|pose| pose.cl),
            configurations: end.pose.poses.map(|pose| pose.configuration),
            axes: end.pose.axes,
        };
        let longest = end.straight[0].max(end.straight[1]);
        let n = (longest / self.test_step).ceil().clamp(0.0, MAX_TESTS) as usize;
        let mut places = vec![cut];
        for k in 1..=n {
            let share = sign * k as f64 / n as f64;
            let poses =
                [0, 1].map(|h| cut.poses[h].translated(end.cc[h].feed.into_inner() * (end.straight[h] * share)));
            let place = self.place(poses, &cut)?;
            let turned = (0..place.axes.len()).any(|k| {
                let is_rotary = self.test.tests[0].cell.machine.axes()[k].kind == AxisKind::Rotary;
                is_rotary && (place.axes[k] - cut.axes[k]).abs() > SAME_AXES
            });
            if turned {
                return Err((0, NoTurn::Postures));
            }
            places.push(place);
        }
        Ok(places)
    }

    /// Returns both ends of a head's curve: those of the straight lines.
    fn ends(
        &self,
        ends: [&PairTurnEnd; 2],
        leads: &[Vec<PairPlace>; 2],
        head: usize,
    ) -> Result<[CurveEnd; 2], (usize, NoTurn)> {
        let end = |k: usize| {
            let (cut, pose) = (&ends[k].cc[head], &ends[k].pose.poses[head]);
            let place = leads[k].last()?;
            let (cl, feed) = (place.poses[head], cut.feed.into_inner());
            let cc = CcPoint::new(cut.position + (cl.tip - pose.cl.tip), cut.normal.into_inner(), feed).ok()?;
            let posture = cc.posture_of(&cl.axis);
            // Upright, the posture says where on the rim the contact is.
            let rotate = if posture.tilt < UPRIGHT { pose.posture.rotate } else { posture.rotate };
            let configuration = place.configurations[head];
            Some(CurveEnd { cc, posture: Posture { rotate, ..posture }, cl, configuration })
        };
        match (end(0), end(1)) {
            (Some(from), Some(to)) if from.configuration.branch == to.configuration.branch => Ok([from, to]),
            (Some(_), Some(_)) => Err((head, NoTurn::Postures)),
            _ => Err((head, NoTurn::NotBeside)),
        }
    }

    /// Tests a turn along the curves of both heads, with the straight lines at their ends.
    fn tested(
        &self,
        curves: &[TurnCurve<'_>; 2],
        leads: &[Vec<PairPlace>; 2],
        to: &PairTurnEnd,
    ) -> Result<PairTurn, (usize, NoTurn)> {
        let n = curves[0].poses(self.test_step).max(curves[1].poses(self.test_step));
        let mut hints = [Hints::default(), Hints::default()];
        let (Some(first), Some(goal)) = (leads[0].first(), leads[1].first()) else {
            return Err((0, NoTurn::NotBeside));
        };
        let (mut at, mut turn, mut worst) = (*first, Vec::new(), 0.0f64);
        let mut go = |place: PairPlace, at: &mut PairPlace| {
            worst = worst.max(self.check_step(at, &place, &mut hints)?);
            turn.push(place.axes);
            *at = place;
            Ok::<_, (usize, NoTurn)>(())
        };
        for place in &leads[0][1..] {
            go(*place, &mut at)?;
        }
        let mut heels = curves.each_ref().map(|curve| curve.heel(0.0, AS_PLANNED));
        for k in 1..n {
            let s = k as f64 / n as f64;
            let (place, moved) = self.on_curves(curves, s, &at)?;
            go(place, &mut at)?;
            for h in 0..2 {
                let heel = curves[h].heel(s, moved[h]);
                self.check_ramp(h, (&heels[h], &heel), &place.poses[h])?;
                heels[h] = heel;
            }
        }
        for (h, curve) in curves.iter().enumerate() {
            self.check_ramp(h, (&heels[h], &curve.heel(1.0, AS_PLANNED)), &curve.at(1.0))?;
        }
        for place in leads[1].iter().rev() {
            // On the winding of the way there.
            let place = self.place(place.poses, &at)?;
            go(place, &mut at)?;
        }
        let end = endless_near(self.test.tests[0], &to.pose.axes, &at.axes);
        let is_there = (0..end.len()).all(|k| (end[k] - at.axes[k]).abs() <= SAME_AXES)
            && (0..2).all(|h| at.configurations[h].branch == goal.configurations[h].branch);
        // The last one is the first cut.
        turn.pop();
        if is_there { Ok(PairTurn { places: turn, linearisation: worst }) } else { Err((0, NoTurn::Postures)) }
    }

    /// Returns both heads at a parameter of their curves, with postures moved so that the shared
    /// axis has one value; and these changes.
    fn on_curves(
        &self,
        curves: &[TurnCurve<'_>; 2],
        s: f64,
        near: &PairPlace,
    ) -> Result<(PairPlace, [Posture; 2]), (usize, NoTurn)> {
        let shared = self.test.shared;
        let moved = |x: &Vector4<f64>| [Posture { tilt: x[0], rotate: x[1] }, Posture { tilt: x[2], rotate: x[3] }];
        let value = |h: usize, by: Posture| {
            let cl = curves[h].moved(s, by);
            let found = self.test.tests[h].configuration_like(&cl, &near.configurations[h]);
            found.map(|c| c.axes.get_or_zero(shared)).map_err(|why| (h, NoTurn::Blocked(why)))
        };
        let excess = |x: &Vector4<f64>| {
            let [first, second] = moved(x);
            Ok::<_, (usize, NoTurn)>(value(0, first)? - value(1, second)?)
        };
        let origin = Vector4::zeros();
        let at_origin = excess(&origin)?;
        let mut slope = Vector4::zeros();
        for k in 0..4 {
            let mut x = origin;
            x[k] = SLOPE_STEP;
            slope[k] = (excess(&x)? - at_origin) / SLOPE_STEP;
        }
        if slope.norm() < LEAST_SLOPE {
            return Err((0, NoTurn::Postures));
        }
        let along = slope / slope.norm_squared();
        // Secant method along the slope, from both sides of the first estimate.
        let (mut a, mut at_a) = (0.0, at_origin);
        let (mut b, mut at_b) = (-at_origin, excess(&(along * -at_origin))?);
        for _ in 0..SECANTS {
            if at_b.abs() <= SAME_VALUE {
                break;
            }
            if at_a == at_b || b.abs() > MOST_MOVED * slope.norm() {
                return Err((0, NoTurn::Postures));
            }
            let next = b - at_b * (b - a) / (at_b - at_a);
            (a, at_a) = (b, at_b);
            (b, at_b) = (next, excess(&(along * next))?);
        }
        let x = along * b;
        if at_b.abs() > SAME_VALUE || x.norm() > MOST_MOVED {
            return Err((0, NoTurn::Postures));
        }
        let moved = moved(&x);
        let place = self.place([0, 1].map(|h| curves[h].moved(s, moved[h])), near)?;
        Ok((place, moved))
    }

    /// Tests the way of both heads to the next place, all axes evenly, at positions between which
    /// neither tip moves by more than the test step, and no point of a tool or the table by more
    /// than 5 mm. Returns the largest deviation of either head from the straight way of its tip.
    fn check_step(&self, from: &PairPlace, to: &PairPlace, hints: &mut [Hints; 2]) -> Result<f64, (usize, NoTurn)> {
        let machine = |h: usize| self.test.tests[h].cell.machine;
        let turned = rotary_turn(machine(0), &from.axes, &to.axes);
        let steps = |h: usize| {
            let test = self.test.tests[h];
            let tip = (to.poses[h].tip - from.poses[h].tip).norm() / self.test_step;
            tip + turned * test.reach() / BODY_STEP
        };
        let steps = steps(0).max(steps(1));
        let is_beyond = (0..2).any(|h| machine(h).first_beyond_limit(&to.axes).is_some());
        if !steps.is_finite() || turned > LARGEST_STEP || is_beyond {
            return Err((0, NoTurn::Postures));
        }
        if rewound_axis(machine(0), &from.axes, &to.axes).is_some() {
            return Err((0, NoTurn::Postures));
        }
        let mut worst = 0.0f64;
        for h in 0..2 {
            let (deviation, is_too_far) = self.linearity[h].judge(self.test.tests[h], &from.axes, &to.axes);
            if is_too_far {
                return Err((h, NoTurn::Postures));
            }
            worst = worst.max(deviation);
        }
        let n = steps.ceil().clamp(1.0, MAX_TESTS) as usize;
        for k in 1..=n {
            let axes = from.axes.lerp(&to.axes, k as f64 / n as f64);
            for (h, hints) in hints.iter_mut().enumerate() {
                let test = self.test.tests[h];
                let blocked = |why: Infeasible| (h, NoTurn::Blocked(why));
                let near = &from.configurations[h];
                let on_table = test.cell.machine.cl_point(&axes, test.cell.tool.gauge_length());
                let cl = on_table.transformed(test.work_from_table());
                test.within_cone(&cl).map_err(blocked)?;
                test.try_pose(&cl, near, hints).map_err(blocked)?;
            }
            if let Some((head, why)) = self.test.blocked(&axes, hints) {
                return Err((head, NoTurn::Blocked(why)));
            }
        }
        for h in 0..2 {
            self.check_ramp(h, (&from.poses[h], &to.poses[h]), &to.poses[h])?;
        }
        Ok(worst)
    }

    /// Checks that a head descends, relative to its cutter's bottom, by at most its ramp angle
    /// where its cutter is in the stock.
    fn check_ramp(&self, head: usize, (from, to): (&ClPoint, &ClPoint), at: &ClPoint) -> Result<(), (usize, NoTurn)> {
        let test = self.test.tests[head];
        let angle = descent(from, to);
        let is_steep = angle > test.cell.tool.max_ramp_angle() + RAMP_SLACK;
        if is_steep && test.cutter_in_stock(at, &mut Hints::default()) {
            return Err((head, NoTurn::Blocked(Infeasible::Ramp { angle })));
        }
        Ok(())
    }

    /// Returns the axes of both heads at poses, near another place.
    fn place(&self, poses: [ClPoint; 2], near: &PairPlace) -> Result<PairPlace, (usize, NoTurn)> {
        let stand = |h: usize| {
            let found = self.test.tests[h].configuration_like(&poses[h], &near.configurations[h]);
            found.map_err(|why| (h, NoTurn::Blocked(why)))
        };
        let mut configurations = [stand(0)?, stand(1)?];
        let shared = self.test.shared;
        if (configurations[0].axes[shared] - configurations[1].axes[shared]).abs() > SAME_AXES {
            return Err((0, NoTurn::Postures));
        }
        configurations[1].axes[shared] = configurations[0].axes[shared];
        let axes = self.test.joined([&configurations[0].axes, &configurations[1].axes]);
        Ok(PairPlace { poses, configurations, axes })
    }
}
