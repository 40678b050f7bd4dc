//! Turns from the end of one pass to the start of the next with the tool down.

use facemill_cl_data::{CcPoint, ClPoint, Posture};
use facemill_cutter_location::links::approach::{Approach, RAMP_SLACK, descent};
use facemill_cutter_location::links::link::{Waypoint, between};
use facemill_cutter_location::{Configuration, FeasiblePose, Hints, Infeasible, PoseTest, rewound_axis};
use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine};
use nalgebra::Point3;

use crate::linearity::endless_near;
use crate::links::clock::LinkClock;
use crate::moves::reached::Reached;
use crate::moves::turn_curve::{AS_PLANNED, CurveEnd, TurnCurve, swings};
use crate::segments::Cut;

/// Settings of turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnSettings {
    /// Speed of the tip in turns, mm/s.
    pub feed: f64,
    /// Speed of the tip in the entries and exits that turns replace, mm/s.
    pub approach_feed: f64,
    /// Distance between tested poses on the way, mm.
    pub test_step: f64,
}

/// Way from the last cut of a pass to the first one of the next, both excluded.
pub(crate) struct Turn {
    pub(crate) poses: Vec<Waypoint>,
}

/// Turn to a piece, or the reason why there is none; `None` where none is sought.
pub(crate) type TurnTo = Option<Result<Turn, String>>;

/// Pieces that turns join, each with the turn to it.
pub(crate) type TurnChain = Vec<(Reached, TurnTo)>;

/// Reason why there is a link in place of a turn.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum NoTurn {
    /// The next pass does not start beside the end of this one, in the opposite direction.
    NotBeside,
    /// No way is feasible; the reason of the first one tried.
    Blocked(Infeasible),
    /// The rotary axes would have to turn too fast, or by a full turn too much.
    Postures,
    /// A link is not slower.
    Slower,
}

impl NoTurn {
    /// Returns whether a higher way, or another curve with the same swing, may be feasible.
    pub(crate) fn may_be_lifted(&self) -> bool {
        matches!(self, Self::Blocked(Infeasible::Gouge { .. } | Infeasible::Collision { .. } | Infeasible::Ramp { .. }))
    }

    /// Returns the reason in words.
    pub(crate) fn text(&self, test: &PoseTest<'_>) -> String {
        match self {
            Self::NotBeside => "the next pass does not start beside the end of the one before".to_owned(),
            Self::Blocked(why) => format!("on the turn: {}", test.describe(why)),
            Self::Postures => "the rotary axes cannot follow the turn from one posture to the other".to_owned(),
            Self::Slower => "a link is not slower".to_owned(),
        }
    }
}

/// Largest distance between the ends of two passes across the feed, in radii of the cutter: farther
/// apart, the next pass does not begin beside what is cut.
const MOST_ASIDE: f64 = 2.0;

/// Largest distance between them along the feed, as a multiple of the distance across: where the
/// other end is farther away, no border runs from one to the other.
const MOST_AHEAD: f64 = 3.0;

/// Least cosine between the feed at the end and the reversed feed at the start.
const LEAST_OPPOSED: f64 = 0.5;

/// Least distance between the ends across the feed, mm.
const LEAST_ASIDE: f64 = 1e-3;

/// Heights of the turn above the surface that are tried, mm: 0 first, then as much as facets or a
/// surface that rises beyond the border need.
pub(crate) const LIFTS: [f64; 8] = [0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0];

/// Shares of the roomiest curve of contact points that are tried.
pub(crate) const SIZES: [f64; 2] = [1.0, 0.5];

/// Largest turn of a rotary axis between two poses, rad: more is a jump beside the pole.
pub(crate) const LARGEST_STEP: f64 = 0.35;

/// Tilt below which the lean has no direction, rad.
pub(crate) const UPRIGHT: f64 = 1e-6;

/// Searches for turns in a workcell.
pub(crate) struct TurnSearch<'t, 'a> {
    test: &'t PoseTest<'a>,
    settings: &'t TurnSettings,
}

impl<'t, 'a> TurnSearch<'t, 'a> {
    pub(crate) fn new(test: &'t PoseTest<'a>, settings: &'t TurnSettings) -> Self {
        Self { test, settings }
    }

    /// Returns the first feasible turn from one piece to the next that is faster than a link, with
    /// the lowest height above the surface; the straight lines of exit and entry are parts of it.
    ///
    /// Contact points go in a curve from the end of the pass to the start of the next one, tangent
    /// to both, in the tangent planes at its ends. Tilt changes evenly. The lean swings about the
    /// normal with the feed, slowly at both ends, so that the tip leaves along the pass. Poses no
    /// farther apart than the test step are tested as those of entries are.
    ///
    /// # Errors
    /// The reason why there is none.
    pub(crate) fn find(&self, from: &Reached, to: &Reached) -> Result<Turn, NoTurn> {
        let (Some(last), Some(first)) = (from.piece.cuts.last(), to.piece.cuts.first()) else {
            return Err(NoTurn::NotBeside);
        };
        let radius = self.test.cell.tool.cutter().radius();
        if from.piece.copy != to.piece.copy || !is_beside(&last.cc, &first.cc, radius) {
            return Err(NoTurn::NotBeside);
        }
        let ends = self.ends((from, last), (to, first))?;
        if ends[0].configuration.branch != ends[1].configuration.branch {
            return Err(NoTurn::Postures);
        }
        let (mut refused, mut is_slower) = (None, false);
        for swing in swings(&ends) {
            for size in SIZES {
                match self.lowest((&ends, swing, size), (from, last), (to, first)) {
                    Ok(turn) if self.is_slower(&turn, (from, last), (to, first)) => is_slower = true,
                    Ok(turn) => return Ok(turn),
                    Err(why) => {
                        let is_blocked = why.may_be_lifted();
                        refused.get_or_insert(why);
                        if !is_blocked {
                            break;
                        }
                    }
                }
            }
        }
        if is_slower { Err(NoTurn::Slower) } else { Err(refused.unwrap_or(NoTurn::Postures)) }
    }

    /// Returns the turn of a swing and size with the lowest height at which it is feasible.
    fn lowest(
        &self,
        (ends, swing, size): (&[CurveEnd; 2], f64, f64),
        from: (&Reached, &Cut),
        to: (&Reached, &Cut),
    ) -> Result<Turn, NoTurn> {
        let mut refused = None;
        for lift in LIFTS {
            match self.tested(&TurnCurve::new(self.test, ends, swing, size, lift), from, to) {
                Ok(turn) => return Ok(turn),
                Err(why) if why.may_be_lifted() => {
                    refused.get_or_insert(why);
                }
                Err(why) => return Err(why),
            }
        }
        Err(refused.unwrap_or(NoTurn::Postures))
    }

    /// Returns both ends of the curve: those of the straight lines.
    fn ends(&self, (from, last): (&Reached, &Cut), (to, first): (&Reached, &Cut)) -> Result<[CurveEnd; 2], NoTurn> {
        let end = |approach: &Approach, cut: &Cut, sign: f64| {
            let cl = approach.on_line.checked_sub(1).map_or(cut.pose.cl, |k| approach.outward[k]);
            let configuration = self.test.configuration_like(&cl, &cut.pose.configuration).map_err(NoTurn::Blocked)?;
            let (position, ahead) = (cut.cc.position + (cl.tip - cut.pose.cl.tip), approach.ahead.into_inner());
            // Across the end of a line, which may be bent.
            let normal = cut.cc.normal.into_inner() - ahead * ahead.dot(&cut.cc.normal);
            let cc = CcPoint::new(position, normal, ahead * sign).map_err(|_| NoTurn::NotBeside)?;
            let posture = cc.posture_of(&cl.axis);
            // Upright, the posture says where on the rim the contact is.
            let rotate = if posture.tilt < UPRIGHT { cut.pose.posture.rotate } else { posture.rotate };
            Ok(CurveEnd { cc, posture: Posture { rotate, ..posture }, cl, configuration })
        };
        Ok([end(&from.exit, last, 1.0)?, end(&to.entry, first, -1.0)?])
    }

    /// Tests a turn along a curve, with the straight lines at its ends.
    fn tested(
        &self,
        curve: &TurnCurve<'_>,
        (from, last): (&Reached, &Cut),
        (to, first): (&Reached, &Cut),
    ) -> Result<Turn, NoTurn> {
        let n = curve.poses(self.settings.test_step);
        let lead = from.exit.outward[..from.exit.on_line].iter().copied();
        let places = (1..n).map(|k| k as f64 / n as f64);
        let inner = places.clone().map(|s| curve.at(s));
        let tail = to.entry.outward[..to.entry.on_line].iter().rev().copied();
        // Both ends of the curve are poses of the lines, or the cuts themselves.
        let mut hints = Hints::default();
        let mut at = Waypoint { cl: last.pose.cl, configuration: last.pose.configuration };
        let mut poses = Vec::new();
        for cl in lead.chain(inner).chain(tail) {
            at = self.step(&at, &cl, &mut hints)?;
            poses.push(at);
        }
        let end = self.step(&at, &first.pose.cl, &mut hints)?;
        self.check_heel(curve, places, &mut hints)?;
        let test = self.test;
        let goal = endless_near(test, &first.pose.configuration.axes, &end.configuration.axes);
        let is_there = end.configuration.branch == first.pose.configuration.branch
            && (0..goal.len()).all(|k| (goal[k] - end.configuration.axes[k]).abs() <= SAME_AXES);
        if is_there { Ok(Turn { poses }) } else { Err(NoTurn::Postures) }
    }

    /// Tests the way to the next pose, tip straight and axis turned evenly, at poses between which
    /// the tip moves by no more than the test step, and no point of the tool or the table by more
    /// than 5 mm; returns the pose.
    fn step(&self, from: &Waypoint, to: &ClPoint, hints: &mut Hints) -> Result<Waypoint, NoTurn> {
        self.test.within_cone(to).map_err(NoTurn::Blocked)?;
        let goal = self.test.configuration_like(to, &from.configuration).map_err(NoTurn::Blocked)?;
        let turned = rotary_turn(self.test.cell.machine, &from.configuration.axes, &goal.axes);
        let steps = (to.tip - from.cl.tip).norm() / self.settings.test_step;
        let body_steps = turned * self.test.reach() / BODY_STEP;
        if !(steps + body_steps).is_finite() {
            return Err(NoTurn::Postures);
        }
        let n = steps.max(body_steps).ceil().clamp(1.0, MAX_TESTS) as usize;
        let mut near = from.configuration;
        for k in 1..=n {
            let cl = between(&from.cl, to, k as f64 / n as f64);
            near = self.test.try_pose(&cl, &near, hints).map_err(NoTurn::Blocked)?;
        }
        self.check_axes(&from.configuration, &near)?;
        self.check_ramp(from, to, hints)?;
        Ok(Waypoint { cl: *to, configuration: near })
    }

    /// Checks that the side of the cutter's bottom away from the contact descends, relative to the
    /// bottom, by at most the ramp angle where the cutter is in the stock: it sinks where the tilt
    /// falls, although the tip may not.
    fn check_heel(
        &self,
        curve: &TurnCurve<'_>,
        places: impl Iterator<Item = f64>,
        hints: &mut Hints,
    ) -> Result<(), NoTurn> {
        let steepest = self.test.cell.tool.max_ramp_angle() + RAMP_SLACK;
        let mut from = curve.heel(0.0, AS_PLANNED);
        for s in places.chain([1.0]) {
            let to = curve.heel(s, AS_PLANNED);
            let angle = descent(&from, &to);
            if angle > steepest && self.test.cutter_in_stock(&curve.at(s), hints) {
                return Err(NoTurn::Blocked(Infeasible::Ramp { angle }));
            }
            from = to;
        }
        Ok(())
    }

    /// Checks that rotary axes move from one pose to the next as the tool does: not in a jump, and
    /// not in the opposite direction at a limit.
    fn check_axes(&self, from: &Configuration, to: &Configuration) -> Result<(), NoTurn> {
        let machine = self.test.cell.machine;
        let is_jump = rotary_turn(machine, &from.axes, &to.axes) > LARGEST_STEP;
        let is_beyond = machine.first_beyond_limit(&to.axes).is_some();
        if is_jump || is_beyond || rewound_axis(machine, &from.axes, &to.axes).is_some() {
            return Err(NoTurn::Postures);
        }
        Ok(())
    }

    /// Checks that the tool descends, relative to the cutter's bottom, by at most its ramp angle
    /// where it is in the stock.
    fn check_ramp(&self, from: &Waypoint, to: &ClPoint, hints: &mut Hints) -> Result<(), NoTurn> {
        let angle = descent(&from.cl, to);
        let steepest = self.test.cell.tool.max_ramp_angle() + RAMP_SLACK;
        if angle > steepest && self.test.cutter_in_stock(to, hints) {
            return Err(NoTurn::Blocked(Infeasible::Ramp { angle }));
        }
        Ok(())
    }

    /// Returns whether exit, link and entry take no longer than a turn, even if nothing is in the
    /// way of the link.
    fn is_slower(&self, turn: &Turn, (from, last): (&Reached, &Cut), (to, first): (&Reached, &Cut)) -> bool {
        let cell = self.test.cell;
        let views = [(cell.machine, cell.tool.gauge_length())];
        let clock = LinkClock::new(&views);
        let [start, goal] = [from.exit.outer.axes, to.entry.outer.axes];
        let link = clock.least_time(&start, &endless_near(self.test, &goal, &start));
        let arc = |cut: &Cut, outward: &[ClPoint]| {
            let mut near = cut.pose.configuration;
            let mut poses = Vec::with_capacity(outward.len());
            for cl in outward {
                near = self.test.configuration_like(cl, &near).ok()?;
                poses.push((cl.tip, near.axes));
            }
            self.cut_time(&clock, &cut.pose, poses, self.settings.approach_feed)
        };
        let arcs = [arc(last, &from.exit.outward), arc(first, &to.entry.outward)];
        let arcs: f64 = arcs.into_iter().flatten().sum();
        let end = turn.poses.last().map_or(last.pose.configuration.axes, |w| w.configuration.axes);
        let goal = endless_near(self.test, &first.pose.configuration.axes, &end);
        let inner = turn.poses.iter().map(|w| (w.cl.tip, w.configuration.axes));
        let poses = inner.chain([(first.pose.cl.tip, goal)]).collect();
        let time = self.cut_time(&clock, &last.pose, poses, self.settings.feed);
        time.is_none_or(|time| time >= link + arcs)
    }

    /// Returns the time of cuts from a pose through others at a feed, from rest to rest, s.
    fn cut_time(
        &self,
        clock: &LinkClock<'_>,
        from: &FeasiblePose,
        poses: Vec<(Point3<f64>, AxisValues)>,
        feed: f64,
    ) -> Option<f64> {
        let mut at = from.cl.tip;
        let block =
            |(tip, axes): (Point3<f64>, AxisValues)| (axes, (tip - std::mem::replace(&mut at, tip)).norm() / feed);
        let blocks: Vec<(AxisValues, f64)> = poses.into_iter().map(block).collect();
        clock.cut_time(&from.configuration.axes, &blocks).ok()
    }
}

/// Largest difference of axis values at the first cut from those it was tested with, mm or rad:
/// rounding.
pub(crate) const SAME_AXES: f64 = 1e-6;

/// Largest way of a point of a body between two tested poses, mm.
pub(crate) const BODY_STEP: f64 = 5.0;

/// Tests between two poses, at most.
pub(crate) const MAX_TESTS: f64 = 2e4;

/// Returns the largest turn of a rotary axis between two positions, rad.
pub(crate) fn rotary_turn(machine: &Machine, from: &AxisValues, to: &AxisValues) -> f64 {
    let rotary = machine.axes().iter().enumerate().filter(|(_, axis)| axis.kind == AxisKind::Rotary);
    rotary.map(|(k, _)| (to[k] - from[k]).abs()).fold(0.0, f64::max)
}

/// Returns whether a pass that starts at `first` lies beside one that ends at `last`, in the
/// opposite direction.
pub(crate) fn is_beside(last: &CcPoint, first: &CcPoint, radius: f64) -> bool {
    let way = first.position - last.position;
    let (ahead, aside) = (last.feed.dot(&way), last.left().dot(&way).abs());
    // Both sides of a thin wall are no neighbours.
    last.normal.dot(&first.normal) > 0.0
        && -last.feed.dot(&first.feed) >= LEAST_OPPOSED
        && aside >= LEAST_ASIDE
        && way.norm() <= MOST_ASIDE * radius * MOST_AHEAD.hypot(1.0)
        && aside <= MOST_ASIDE * radius
        && ahead.abs() <= MOST_AHEAD * aside
}

#[cfg(test)]
#[path = "../../tests/unit/moves/turn.rs"]
mod tests;
