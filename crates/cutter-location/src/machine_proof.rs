//! Proofs over a range of postures that have to do with the machine: limits, and bodies that move with its axes.

use facemill_cl_data::Solid;
use facemill_interference::{Interference, Verdict, penetration};
use facemill_inverse_kinematics::{AxisRange, AxisRanges, LimitVerdict, PoseSet};
use nalgebra::{Isometry3, Point3};

use crate::cell_proof::{MARGIN, PostureCell};
use crate::{Body, Infeasible, PoseTest};

/// How the machine stands in the postures of a cell, lifted by up to some amount.
pub(crate) struct OnMachine<'t, 'a> {
    test: &'t PoseTest<'a>,
    set: PoseSet,
    ranges: AxisRanges,
}

/// A body against an obstacle, in the middle of a range.
struct Pair<'p> {
    body: Body,
    obstacle: usize,
    mesh: &'p dyn Interference,
    /// Dilated by clearance and allowance.
    solid: Solid,
    obstacle_from_solid: Isometry3<f64>,
    /// How far the two move against each other within the range, mm.
    travel: f64,
}

impl<'t, 'a> OnMachine<'t, 'a> {
    pub(crate) fn new(cell: &PostureCell<'t, 'a>, max_lift: f64) -> Self {
        let set = cell.pose_set(max_lift);
        let ranges = cell.test.cell.machine.axis_ranges(&set, cell.test.cell.tool.gauge_length());
        Self { test: cell.test, set, ranges }
    }

    /// Whether on one branch all postures are within the limits and nothing of the machine is touched. Which branch that is does
    /// not matter: the test of a posture tries both.
    pub(crate) fn is_free(&self) -> bool {
        let AxisRanges::Both(branches) = &self.ranges else { return false };
        branches.iter().any(|range| {
            self.test.cell.machine.limits_over(range) == LimitVerdict::Within
                && self.pairs(range, |pair| (!pair.is_free()).then_some(())).is_none()
        })
    }

    /// The limit that no posture keeps on either branch.
    pub(crate) fn beyond_limits(&self) -> Option<Infeasible> {
        match &self.ranges {
            AxisRanges::OutOfReach(why) => Some(Infeasible::Unreachable(*why)),
            AxisRanges::Unknown => None,
            AxisRanges::Both(branches) => {
                let [first, second] = branches.each_ref().map(|range| self.beyond(range));
                second.and(first)
            }
        }
    }

    fn beyond(&self, range: &AxisRange) -> Option<Infeasible> {
        match self.test.cell.machine.limits_over(range) {
            LimitVerdict::Beyond(why) => Some(Infeasible::Unreachable(why)),
            LimitVerdict::Within | LimitVerdict::Unknown => None,
        }
    }

    /// A collision in all postures: on each branch one of its own, or a limit.
    pub(crate) fn hit(&self) -> Option<Infeasible> {
        let AxisRanges::Both(branches) = &self.ranges else { return None };
        let [first, second] = branches.each_ref().map(|range| self.beyond(range).or_else(|| self.hit_on(range)));
        let (first, second) = (first?, second?);
        let is_hit = |why: &Infeasible| matches!(why, Infeasible::Collision { .. });
        Some(if is_hit(&first) || !is_hit(&second) { first } else { second })
    }

    fn hit_on(&self, range: &AxisRange) -> Option<Infeasible> {
        let frames = self.test.machine_frames(&range.middle);
        self.pairs(range, |pair| {
            let place = self.test.at_work(pair.obstacle, &frames, &pair.witness()?);
            Some(Infeasible::Collision { body: pair.body, obstacle: pair.obstacle, place })
        })
    }

    /// The first answer for a pair of bodies of which at least one is the machine's.
    fn pairs<T>(&self, range: &AxisRange, mut answer: impl FnMut(&Pair<'_>) -> Option<T>) -> Option<T> {
        let test = self.test;
        let (machine, length) = (test.cell.machine, test.cell.tool.gauge_length());
        let (n_own, n_all) = (test.cell.obstacles.len(), test.n_obstacles());
        let frames = test.machine_frames(&range.middle);
        let travel = |body: Body, solid: &Solid, frame: &Isometry3<f64>| match body {
            Body::Machine(k) => machine.body_travel(k, range, &self.set, length),
            Body::Cutter | Body::Tool(_) => self.tool_travel(solid, frame),
        };
        let of_obstacle = |k: usize| match k.checked_sub(n_own) {
            None => 0.0,
            Some(own) => machine.body_travel(test.machine_obstacles[own].body, range, &self.set, length),
        };
        for (slot, placed) in test.placed(&range.middle).enumerate() {
            // Of the tool's bodies only against the machine: against the workpiece they are turned more sharply.
            let first = if matches!(placed.body, Body::Tool(_)) { n_own } else { 0 };
            let own_travel = travel(placed.body, placed.solid, &placed.work_from_body);
            for k in (first..n_all).filter(|k| test.meetings.bodies[slot][*k]) {
                let (mesh, allowance) = test.obstacle(k);
                let found = answer(&Pair {
                    body: placed.body,
                    obstacle: k,
                    mesh,
                    solid: placed.solid.dilated(allowance),
                    obstacle_from_solid: test.seen_from_obstacle(k, &frames, &placed.work_from_body),
                    travel: own_travel + of_obstacle(k),
                });
                if found.is_some() {
                    return found;
                }
            }
        }
        let work_from_tool = test.work_from_tool(&range.middle);
        for k in (n_own..n_all).filter(|k| test.meetings.cutter[*k]) {
            let (mesh, allowance) = test.obstacle(k);
            for solid in &test.cutter {
                let found = answer(&Pair {
                    body: Body::Cutter,
                    obstacle: k,
                    mesh,
                    solid: solid.dilated(allowance),
                    obstacle_from_solid: test.seen_from_obstacle(k, &frames, &work_from_tool),
                    travel: travel(Body::Cutter, solid, &work_from_tool) + of_obstacle(k),
                });
                if found.is_some() {
                    return found;
                }
            }
        }
        None
    }

    /// How far a body of revolution of the tool moves: with the tip, and with the tool axis' turn about it.
    fn tool_travel(&self, solid: &Solid, work_from_solid: &Isometry3<f64>) -> f64 {
        let bounds = solid.aabb();
        let center = work_from_solid * nalgebra::center(&bounds.min, &bounds.max);
        let tip = self.test.work_from_table() * self.set.cl.tip;
        self.set.shift + self.set.turn * ((center - tip).norm() + 0.5 * (bounds.max - bounds.min).norm())
    }
}

impl Pair<'_> {
    /// Whether the two do not touch anywhere in the range.
    fn is_free(&self) -> bool {
        self.mesh.verdict(&self.solid.dilated(self.travel + MARGIN), &self.obstacle_from_solid, None).is_free()
    }

    /// A point of the obstacle, in its frame, that is in the body everywhere in the range.
    fn witness(&self) -> Option<Point3<f64>> {
        let Verdict::Hit(hit) = self.mesh.verdict(&self.solid, &self.obstacle_from_solid, None) else { return None };
        let deepest = || penetration(self.mesh, &self.solid, &self.obstacle_from_solid).map(|p| p.point);
        let is_deep = |p: &Point3<f64>| {
            self.solid.depth(&self.obstacle_from_solid.inverse_transform_point(p)) > self.travel + MARGIN
        };
        Some(hit.point).filter(is_deep).or_else(|| deepest().filter(is_deep))
    }
}
