//! Proofs over a range of postures about the machine: limits, and bodies that move with its axes.

use facemill_cl_data::Solid;
use facemill_interference::{Interference, Verdict, penetration};
use facemill_inverse_kinematics::inverse::{AxisRange, AxisRanges, LimitVerdict, PoseSet};
use nalgebra::{Isometry3, Point3};

use crate::pose::pose_test::PoseTest;
use crate::pose::workcell::{Body, Infeasible};
use crate::search::cell_proof::{MARGIN, PostureCell};

/// Positions of the machine in the postures of a cell, lifted by up to some amount.
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
    /// The body, dilated by clearance and allowance.
    solid: Solid,
    obstacle_from_solid: Isometry3<f64>,
    /// Largest motion of the two against each other within the range, mm.
    travel: f64,
}

impl<'t, 'a> OnMachine<'t, 'a> {
    pub(crate) fn new(cell: &PostureCell<'t, 'a>, max_lift: f64) -> Self {
        let set = cell.pose_set(max_lift);
        let machine = cell.test.cell.machine;
        let mut ranges = machine.axis_ranges(&set, cell.test.cell.tool.gauge_length());
        // The other head does not move.
        if let AxisRanges::Both(branches) = &mut ranges {
            for k in (0..machine.axes().len()).filter(|&k| !machine.moves_tool(k)) {
                branches.iter_mut().for_each(|range| range.middle[k] = cell.others.get_or_zero(k));
            }
        }
        Self { test: cell.test, set, ranges }
    }

    /// Returns whether on one branch all postures are within the limits and no machine body touches
    /// anything. Either branch will do: the test of a posture tries both.
    pub(crate) fn is_free(&self) -> bool {
        let AxisRanges::Both(branches) = &self.ranges else { return false };
        branches.iter().any(|range| {
            self.test.cell.machine.limits_over(range) == LimitVerdict::Within
                && self.pairs(range).iter().all(Pair::is_free)
        })
    }

    /// Returns a limit that every posture exceeds, on both branches.
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

    /// Returns a collision in all postures: on each branch one of its own, or a limit.
    pub(crate) fn hit(&self) -> Option<Infeasible> {
        let AxisRanges::Both(branches) = &self.ranges else { return None };
        let [first, second] = branches.each_ref().map(|range| self.beyond(range).or_else(|| self.hit_on(range)));
        let (first, second) = (first?, second?);
        let is_hit = |why: &Infeasible| matches!(why, Infeasible::Collision { .. });
        Some(if is_hit(&first) || !is_hit(&second) { first } else { second })
    }

    fn hit_on(&self, range: &AxisRange) -> Option<Infeasible> {
        let frames = self.test.machine_frames(&range.middle);
        self.pairs(range).iter().find_map(|pair| {
            let place = self.test.at_work(pair.obstacle, &frames, &pair.witness()?);
            Some(Infeasible::Collision { body: pair.body, obstacle: pair.obstacle, place })
        })
    }

    /// Returns the pairs that single postures are tested for, except those that [`PostureCell`]
    /// bounds more sharply: bodies that turn with the tool against the workpiece.
    fn pairs(&self, range: &AxisRange) -> Vec<Pair<'t>> {
        let test = self.test;
        let (n_own, n_all) = (test.cell.obstacles.len(), test.n_obstacles());
        let frames = test.machine_frames(&range.middle);
        let work_from_tool = test.work_from_tool(&range.middle);
        let cutter = test.cutter.iter().map(|solid| (Body::Cutter, solid, work_from_tool, &test.meetings.cutter));
        let placed = test.placed(&range.middle).zip(&test.meetings.bodies);
        let placed = placed.map(|(p, meets)| (p.body, p.solid, p.work_from_body, meets));
        let mut pairs = Vec::new();
        for (body, solid, work_from_solid, meets) in placed.chain(cutter) {
            let first = if body == Body::Cutter || self.is_spun(body) { n_own } else { 0 };
            let travel = self.travel(range, body, solid, &work_from_solid);
            for k in (first..n_all).filter(|k| meets[*k]) {
                let (mesh, allowance) = test.obstacle(k);
                pairs.push(Pair {
                    body,
                    obstacle: k,
                    mesh,
                    solid: solid.dilated(allowance),
                    obstacle_from_solid: test.seen_from_obstacle(k, &frames, &work_from_solid),
                    travel: travel + self.obstacle_travel(range, k),
                });
            }
        }
        pairs
    }

    fn is_spun(&self, body: Body) -> bool {
        self.test.spun_bodies.iter().any(|spun| spun.body == body)
    }

    /// Returns the largest motion of a body within a range.
    fn travel(&self, range: &AxisRange, body: Body, solid: &Solid, work_from_solid: &Isometry3<f64>) -> f64 {
        let cell = self.test.cell;
        let by_machine = |k: usize| cell.machine.body_travel(k, range, &self.set, cell.tool.gauge_length());
        match body {
            Body::Machine(k) if self.is_spun(body) => by_machine(k).min(self.spun_travel(solid, work_from_solid)),
            Body::Machine(k) => by_machine(k),
            // There is none; nothing would be proven for one that is not round.
            Body::Tool(_) if !self.is_spun(body) => f64::INFINITY,
            Body::Cutter | Body::Tool(_) => self.spun_travel(solid, work_from_solid),
        }
    }

    fn obstacle_travel(&self, range: &AxisRange, obstacle: usize) -> f64 {
        let cell = self.test.cell;
        obstacle.checked_sub(cell.obstacles.len()).map_or(0.0, |own| {
            let body = self.test.machine_obstacles[own].body;
            cell.machine.body_travel(body, range, &self.set, cell.tool.gauge_length())
        })
    }

    /// Returns the largest motion of a body of revolution of the tool: with the tip, and about it
    /// with the turn of the tool axis.
    fn spun_travel(&self, solid: &Solid, work_from_solid: &Isometry3<f64>) -> f64 {
        let bounds = solid.aabb();
        let center = work_from_solid * nalgebra::center(&bounds.min, &bounds.max);
        let tip = self.test.work_from_table() * self.set.cl.tip;
        self.set.shift + self.set.turn * ((center - tip).norm() + 0.5 * (bounds.max - bounds.min).norm())
    }
}

impl Pair<'_> {
    /// Returns whether the two do not touch anywhere in the range.
    fn is_free(&self) -> bool {
        self.mesh.verdict(&self.solid.dilated(self.travel + MARGIN), &self.obstacle_from_solid, None).is_free()
    }

    /// Returns a point of the obstacle, in its frame, that is in the body everywhere in the range.
    fn witness(&self) -> Option<Point3<f64>> {
        let Verdict::Hit(hit) = self.mesh.verdict(&self.solid, &self.obstacle_from_solid, None) else { return None };
        let deepest = || penetration(self.mesh, &self.solid, &self.obstacle_from_solid).map(|p| p.point);
        let is_deep = |p: &Point3<f64>| {
            self.solid.depth(&self.obstacle_from_solid.inverse_transform_point(p)) > self.travel + MARGIN
        };
        Some(hit.point).filter(is_deep).or_else(|| deepest().filter(is_deep))
    }
}
