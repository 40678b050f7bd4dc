use facemill_cl_data::{CcPoint, ClPoint, PlacedSolid, Posture, Solid};
use facemill_interference::{Interference, Verdict};
use facemill_inverse_kinematics::{AxisValues, BranchPreference, InverseSolutions};
use facemill_tool_model::cl_from_cc;
use facemill_z_map::certainly_free;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::pose::machine_obstacles::{Ball, MachineObstacle, Meetings, is_moved_along};
use crate::pose::spun_bodies::{SpunBody, spun_bodies};
use crate::pose::widened::{Widened, Widths};
use crate::pose::workcell::{
    Body, Configuration, FeasiblePose, Hints, Infeasible, Workcell, angle_between, tool_frame,
};

/// A workcell with everything precomputed that does not change from pose to pose.
pub struct PoseTest<'a> {
    /// The workcell.
    pub cell: &'a Workcell<'a>,
    /// The cutter at the gouge tolerance, and as it is.
    pub(crate) test_bodies: Vec<Solid>,
    pub(crate) cutter: Vec<Solid>,
    pub(crate) tool_bodies: Vec<PlacedSolid>,
    pub(crate) work_from_table: Isometry3<f64>,
    pub(crate) machine_obstacles: Vec<MachineObstacle>,
    pub(crate) meetings: Meetings,
    /// Balls around the bodies that are tested for collision, in their order, and around the
    /// cutter.
    balls: Vec<Ball>,
    cutter_ball: Ball,
    pub(crate) spun_bodies: Vec<SpunBody>,
    pub(crate) widths: Widths,
    /// Half angle of the cone about the singular direction that postures avoid, rad.
    pole_cone: f64,
}

/// A placed body.
pub(crate) struct Placed<'b> {
    pub(crate) body: Body,
    pub(crate) solid: &'b Solid,
    pub(crate) work_from_body: Isometry3<f64>,
}

impl<'a> PoseTest<'a> {
    /// Prepares the bodies of the workcell.
    pub fn new(cell: &'a Workcell<'a>) -> Self {
        let tool_bodies = cell.tool.collision_bodies();
        let cutter = cell.tool.cutter().test_bodies(0.0);
        let of_machine = cell.machine.bodies().iter().filter(|b| is_moved_along(b)).map(|b| &b.body.solid);
        let machine_obstacles = MachineObstacle::all(cell.machine);
        Self {
            cell,
            spun_bodies: spun_bodies(cell, &tool_bodies),
            test_bodies: cell.tool.cutter().test_bodies(cell.gouge_tolerance),
            balls: tool_bodies.iter().map(|b| &b.solid).chain(of_machine).map(Ball::around).collect(),
            cutter_ball: Ball::around_all(&cutter),
            cutter,
            meetings: Meetings::new(cell, &machine_obstacles),
            tool_bodies,
            work_from_table: cell.table_from_work.inverse(),
            machine_obstacles,
            widths: Widths::default(),
            pole_cone: 0.0,
        }
    }

    /// Returns the same test for choosing postures away from the pole: a posture whose tool axis is
    /// within this angle (rad) of the rotary axis nearest to the workpiece is not feasible. With
    /// three rotary axes nothing is avoided. Use a test without this for a path that has to enter
    /// the cone all the same.
    #[must_use]
    pub fn avoiding_pole(self, half_angle: f64) -> Self {
        Self { pole_cone: half_angle, ..self }
    }

    /// Returns the half angle of the cone about the pole that postures avoid, rad.
    pub fn pole_cone(&self) -> f64 {
        self.pole_cone
    }

    /// Returns the CC points of all searches with a proof made with this test so far for which
    /// `SearchSettings::certified` was too narrow to be reached; `None` where there were none. Does
    /// not depend on the order of the searches.
    pub fn widened(&self) -> Option<Widened> {
        self.widths.widened()
    }

    /// Returns the name of a body for messages.
    pub fn body_name(&self, body: Body) -> &str {
        match body {
            Body::Cutter => "cutter",
            Body::Tool(k) => &self.tool_bodies[k].name,
            Body::Machine(k) => self.cell.machine.bodies()[k].name(),
        }
    }

    /// Returns the name of an obstacle for messages, with its piece at a place.
    pub fn obstacle_name(&self, obstacle: usize, place: &Point3<f64>) -> String {
        match self.cell.obstacles.get(obstacle) {
            Some(o) => o.pieces.map_or_else(|| o.name.clone(), |pieces| pieces.name_at(place)),
            None => {
                let body = self.machine_obstacles[obstacle - self.cell.obstacles.len()].body;
                self.cell.machine.bodies()[body].name().to_owned()
            }
        }
    }

    /// Says in one sentence why a posture is infeasible.
    pub fn describe(&self, why: &Infeasible) -> String {
        match why {
            Infeasible::OutsideCone { excess } => {
                format!("tool axis {:.3} deg outside the job's cone", excess.to_degrees())
            }
            Infeasible::Singular { within } => {
                let angle = (self.pole_cone - within).to_degrees();
                format!("tool axis only {angle:.3} deg from the pole of the rotary axes")
            }
            Infeasible::Unreachable(u) => u.to_string(),
            Infeasible::OtherBranch(_) => {
                "the pose can only be reached with the head turned to its other side".to_owned()
            }
            Infeasible::Rewind { axis } => {
                format!("axis {} would have to turn back at its limit", self.cell.machine.axes()[*axis].letter)
            }
            Infeasible::FromBelow => "the tool axis does not point out of the surface there".to_owned(),
            Infeasible::TooLong => "the way is too long to be tested".to_owned(),
            Infeasible::Gouge { obstacle, place } => format!("cutter gouges {}", self.obstacle_name(*obstacle, place)),
            Infeasible::Ramp { angle } => format!("ramp of {:.2} deg into stock", angle.to_degrees()),
            Infeasible::Collision { body, obstacle, place } => {
                format!("{} hits {}", self.body_name(*body), self.obstacle_name(*obstacle, place))
            }
        }
    }

    /// Tests one posture at a CC point: cone, limits, gouge with seating, collision (CLOPT,
    /// feasibility test).
    ///
    /// `near` is the configuration to stay close to. Its branch is tried first, because the machine
    /// can change to the other one only through the pole.
    ///
    /// # Errors
    /// The first reason found, in the order of the tests.
    pub fn try_posture(
        &self,
        cc: &CcPoint,
        posture: Posture,
        near: Option<&Configuration>,
        hints: &mut Hints,
    ) -> Result<FeasiblePose, Infeasible> {
        let cl = cl_from_cc(self.cell.tool.cutter(), cc, posture);
        self.within_cone(&cl)?;
        // Limits before gouge: they cost a microsecond, and a lift of hundredths of a millimetre
        // hardly changes them.
        let _ = self.configurations(&cl, near)?;
        let lift = self.seat(&cl, &cc.normal, hints)?;
        let seated = cl.translated(cc.normal.into_inner() * lift);
        let mut reason = None;
        for configuration in self.configurations(&seated, near)? {
            match self.collision(&configuration.axes, hints) {
                None => return Ok(FeasiblePose { posture, cl: seated, configuration, lift }),
                Some(hit) => reason = reason.or(Some(hit)),
            }
        }
        Err(reason.expect("configurations() gives at least one"))
    }

    /// Returns the configurations in which a posture at a CC point is free at the largest lift,
    /// with cone, limits and collision judged there, hundredths of a millimetre above where
    /// [`PoseTest::try_posture`] would seat it. For choosing among postures; the chosen one is
    /// tested again as seated.
    ///
    /// # Errors
    /// The first reason found, in the order of the tests.
    pub(crate) fn configurations_of(
        &self,
        cc: &CcPoint,
        posture: Posture,
        hints: &mut Hints,
    ) -> Result<Vec<Configuration>, Infeasible> {
        let cl = cl_from_cc(self.cell.tool.cutter(), cc, posture);
        self.within_cone(&cl)?;
        let cl = cl.translated(cc.normal.into_inner() * self.cell.max_lift);
        let configurations = self.configurations(&cl, None)?;
        if let Some((obstacle, place)) = self.gouge(&cl, hints) {
            return Err(Infeasible::Gouge { obstacle, place });
        }
        let mut free = Vec::new();
        let mut reason = None;
        for configuration in configurations {
            match self.collision(&configuration.axes, hints) {
                None => free.push(configuration),
                Some(hit) => reason = reason.or(Some(hit)),
            }
        }
        if free.is_empty() { Err(reason.expect("configurations() gives at least one")) } else { Ok(free) }
    }

    /// Returns all configurations of a posture at a CC point at the largest lift within the limits,
    /// nothing else tested: those of [`PoseTest::configurations_of`] are among them, in the same
    /// order.
    pub(crate) fn lifted_configurations(&self, cc: &CcPoint, posture: Posture) -> Vec<Configuration> {
        let cl = cl_from_cc(self.cell.tool.cutter(), cc, posture);
        let lifted = cl.translated(cc.normal.into_inner() * self.cell.max_lift);
        self.configurations(&lifted, None).map(Iterator::collect).unwrap_or_default()
    }

    /// Checks that the tool axis is in the job's cone, and outside the one about the pole that
    /// postures avoid.
    ///
    /// # Errors
    /// When it is not.
    pub fn within_cone(&self, cl: &ClPoint) -> Result<(), Infeasible> {
        if let Some(cone) = &self.cell.axis_cone {
            let excess = angle_between(&cl.axis, &cone.axis) - cone.half_angle;
            if excess > 0.0 {
                return Err(Infeasible::OutsideCone { excess });
            }
        }
        if self.pole_cone > 0.0 {
            let angle = self.cell.machine.angle_to_singular(&cl.transformed(&self.cell.table_from_work));
            let within = angle.map_or(0.0, |angle| self.pole_cone - angle);
            if within > 0.0 {
                return Err(Infeasible::Singular { within });
            }
        }
        Ok(())
    }

    fn inverse(&self, cl: &ClPoint, reference: &AxisValues) -> Result<InverseSolutions, Infeasible> {
        let cl = cl.transformed(&self.cell.table_from_work);
        let length = self.cell.tool.gauge_length();
        self.cell.machine.inverse_near(&cl, length, reference).map_err(Infeasible::Unreachable)
    }

    /// Returns the configurations for a pose, at least one: with `near`, the one on its branch
    /// comes first; without, the preferred one.
    fn configurations(
        &self,
        cl: &ClPoint,
        near: Option<&Configuration>,
    ) -> Result<impl Iterator<Item = Configuration> + use<>, Infeasible> {
        let machine = self.cell.machine;
        let all = self.inverse(cl, &near.map_or_else(|| machine.home(), |near| near.axes))?;
        let first = match near {
            Some(near) => on_branch(&all, near.branch),
            None => self.preferred(cl, &all),
        };
        let others: Vec<Configuration> = all
            .iter()
            .map(|s| Configuration { axes: s.values, branch: s.branch })
            .filter(|c| first.is_none_or(|f| f.axes != c.axes))
            .collect();
        Ok(first.into_iter().chain(others))
    }

    fn preferred(&self, cl: &ClPoint, all: &InverseSolutions) -> Option<Configuration> {
        let branch = match self.cell.preferred_branch {
            BranchPreference::Positive => facemill_inverse_kinematics::Branch::Positive,
            BranchPreference::Negative => facemill_inverse_kinematics::Branch::Negative,
            BranchPreference::Nearest => {
                let cl = cl.transformed(&self.cell.table_from_work);
                let length = self.cell.tool.gauge_length();
                let axes = self.cell.machine.nearest_inverse(&cl, length, None, BranchPreference::Nearest).ok()?;
                return all
                    .iter()
                    .find(|s| s.values == axes)
                    .map(|s| Configuration { axes: s.values, branch: s.branch });
            }
        };
        on_branch(all, branch)
    }

    /// Returns the machine's configuration at a pose on the branch of `near`, its rotary axes at
    /// the turns nearest to it.
    ///
    /// When the pose is out of reach, or in reach only on the other branch.
    pub fn configuration_like(&self, cl: &ClPoint, near: &Configuration) -> Result<Configuration, Infeasible> {
        on_branch(&self.inverse(cl, &near.axes)?, near.branch).ok_or(Infeasible::OtherBranch(near.branch))
    }

    /// Returns the least lift along `normal` that frees the test body.
    fn seat(&self, cl: &ClPoint, normal: &Unit<Vector3<f64>>, hints: &mut Hints) -> Result<f64, Infeasible> {
        if self.gouge(cl, hints).is_none() {
            return Ok(0.0);
        }
        let lifted = |lift: f64| cl.translated(normal.into_inner() * lift);
        if let Some((obstacle, place)) = self.gouge(&lifted(self.cell.max_lift), hints) {
            return Err(Infeasible::Gouge { obstacle, place });
        }
        let (mut blocked, mut free) = (0.0, self.cell.max_lift);
        for _ in 0..MAX_HALVINGS {
            if free - blocked <= self.cell.lift_resolution {
                break;
            }
            let middle = 0.5 * (blocked + free);
            if self.gouge(&lifted(middle), hints).is_some() { blocked = middle } else { free = middle }
        }
        Ok(free)
    }

    /// Returns the first obstacle that the cutter's test body cuts, with a point of it inside the
    /// body (workpiece frame). [`PoseTest::collision`], which knows their places, tests bodies of
    /// the machine that move against the workpiece.
    pub fn gouge(&self, cl: &ClPoint, hints: &mut Hints) -> Option<(usize, Point3<f64>)> {
        let work_from_tool = tool_frame(cl);
        hints.gouge.resize(self.cell.obstacles.len(), None);
        for (k, obstacle) in self.cell.obstacles.iter().enumerate() {
            let Some(allowance) = obstacle.gouge_allowance.filter(|_| self.meetings.cutter[k]) else { continue };
            let verdict = obstacle.mesh.verdict_of_all(&self.test_bodies, allowance, &work_from_tool, hints.gouge[k]);
            if let Verdict::Hit(witness) = verdict {
                hints.gouge[k] = Some(witness.triangle);
                return Some((k, witness.point));
            }
        }
        None
    }

    /// Returns the pose of the tool frame in the workpiece frame.
    pub(crate) fn work_from_tool(&self, axes: &AxisValues) -> Isometry3<f64> {
        self.work_from_table * self.cell.machine.forward(axes, self.cell.tool.gauge_length())
    }

    /// Returns every body that is tested for collision: those of the tool assembly, then those of
    /// the machine that move against the workpiece.
    pub(crate) fn placed<'b>(&'b self, axes: &'b AxisValues) -> impl Iterator<Item = Placed<'b>> {
        let work_from_tool = self.work_from_tool(axes);
        let tool = self.tool_bodies.iter().enumerate().map(move |(k, b)| Placed {
            body: Body::Tool(k),
            solid: &b.solid,
            work_from_body: work_from_tool * b.frame_from_solid,
        });
        let machine = self.cell.machine.body_poses(axes).enumerate();
        let moving = machine.filter(|(_, pose)| is_moved_along(pose.body)).map(|(k, pose)| Placed {
            body: Body::Machine(k),
            solid: &pose.body.body.solid,
            work_from_body: self.work_from_table * pose.table_from_solid,
        });
        tool.chain(moving)
    }

    /// Returns the first collision of a non-cutting body at these axis values, or of the cutter
    /// with a body of the machine.
    pub fn collision(&self, axes: &AxisValues, hints: &mut Hints) -> Option<Infeasible> {
        let frames = self.machine_frames(axes);
        for (slot, placed) in self.placed(axes).enumerate() {
            let proven = self.proven_free(placed.solid, &placed.work_from_body);
            let first = if proven { self.cell.obstacles.len() } else { 0 };
            for k in first..self.n_obstacles() {
                if !self.meetings.bodies[slot][k] {
                    continue;
                }
                let (mesh, allowance) = self.obstacle(k);
                let pose = self.seen_from_obstacle(k, &frames, &placed.work_from_body);
                if self.is_beyond(k, &self.balls[slot], &pose) {
                    continue;
                }
                let hint = hint_at(&mut hints.collision, slot * self.n_obstacles() + k);
                if let Verdict::Hit(witness) = mesh.verdict(&placed.solid.dilated(allowance), &pose, *hint) {
                    *hint = Some(witness.triangle);
                    let place = self.at_work(k, &frames, &witness.point);
                    return Some(Infeasible::Collision { body: placed.body, obstacle: k, place });
                }
            }
        }
        self.cutter_at_machine(axes, &frames)
    }

    /// Tests the cutter, which may touch no part of the machine, against the bodies that move
    /// against the workpiece.
    fn cutter_at_machine(&self, axes: &AxisValues, frames: &[Isometry3<f64>]) -> Option<Infeasible> {
        let work_from_tool = self.work_from_tool(axes);
        for k in self.cell.obstacles.len()..self.n_obstacles() {
            let (mesh, allowance) = self.obstacle(k);
            let pose = self.seen_from_obstacle(k, frames, &work_from_tool);
            if !self.meetings.cutter[k] || self.is_beyond(k, &self.cutter_ball, &pose) {
                continue;
            }
            if let Verdict::Hit(witness) = mesh.verdict_of_all(&self.cutter, allowance, &pose, None) {
                let place = self.at_work(k, frames, &witness.point);
                return Some(Infeasible::Collision { body: Body::Cutter, obstacle: k, place });
            }
        }
        None
    }

    /// Returns whether balls alone prove that a body at this place in the frame of an obstacle does
    /// not touch it. They prove nothing for obstacles of the workcell.
    fn is_beyond(&self, obstacle: usize, ball: &Ball, obstacle_from_body: &Isometry3<f64>) -> bool {
        let own = obstacle.checked_sub(self.cell.obstacles.len());
        own.is_some_and(|own| ball.is_beyond(&self.machine_obstacles[own].ball, obstacle_from_body, 0.0))
    }

    /// Counts the obstacles of the workcell and of the machine.
    pub(crate) fn n_obstacles(&self) -> usize {
        self.cell.obstacles.len() + self.machine_obstacles.len()
    }

    /// Returns the mesh of an obstacle and the distance that dilated bodies keep from it.
    pub(crate) fn obstacle(&self, k: usize) -> (&dyn Interference, f64) {
        match self.cell.obstacles.get(k) {
            Some(o) => (&*o.mesh, o.collision_allowance),
            None => {
                let o = &self.machine_obstacles[k - self.cell.obstacles.len()];
                (&o.mesh, o.clearance)
            }
        }
    }

    /// Returns the pose of each machine obstacle's frame in the workpiece frame.
    pub(crate) fn machine_frames(&self, axes: &AxisValues) -> Vec<Isometry3<f64>> {
        if self.machine_obstacles.is_empty() {
            return Vec::new();
        }
        let all: Vec<Isometry3<f64>> =
            self.cell.machine.body_poses(axes).map(|b| self.work_from_table * b.table_from_solid).collect();
        self.machine_obstacles.iter().map(|o| all[o.body]).collect()
    }

    /// Returns a body's pose in the frame of an obstacle.
    pub(crate) fn seen_from_obstacle(
        &self,
        k: usize,
        frames: &[Isometry3<f64>],
        work_from_body: &Isometry3<f64>,
    ) -> Isometry3<f64> {
        match k.checked_sub(self.cell.obstacles.len()) {
            None => *work_from_body,
            Some(own) => frames[own].inv_mul(work_from_body),
        }
    }

    /// Returns a point of an obstacle in the workpiece frame.
    pub(crate) fn at_work(&self, k: usize, frames: &[Isometry3<f64>], p: &Point3<f64>) -> Point3<f64> {
        match k.checked_sub(self.cell.obstacles.len()) {
            None => *p,
            Some(own) => frames[own] * p,
        }
    }

    /// Returns whether the Z-map's maxima prove that a body is above all obstacles of the workcell.
    fn proven_free(&self, solid: &Solid, work_from_body: &Isometry3<f64>) -> bool {
        let thickest = self.cell.obstacles.iter().map(|o| o.collision_allowance).fold(0.0, f64::max);
        self.cell.z_map.is_some_and(|(map, map_from_work)| {
            certainly_free(map, &solid.dilated(thickest), &(map_from_work * work_from_body))
        })
    }

    /// Tests a pose that is not at a CC point (an approach), on the branch of `near`: as
    /// [`PoseTest::try_posture`], but without cone and seating.
    ///
    /// # Errors
    /// The first reason found.
    pub fn try_pose(&self, cl: &ClPoint, near: &Configuration, hints: &mut Hints) -> Result<Configuration, Infeasible> {
        if let Some((obstacle, place)) = self.gouge(cl, hints) {
            return Err(Infeasible::Gouge { obstacle, place });
        }
        let configuration = self.configuration_like(cl, near)?;
        match self.collision(&configuration.axes, hints) {
            None => Ok(configuration),
            Some(hit) => Err(hit),
        }
    }

    /// Returns the distance from the whole tool and the machine's bodies, dilated and with the
    /// cutter, to the nearest obstacle or the stock on it, searched up to `at_most`, and the
    /// blocking pair.
    pub fn rapid_distance(&self, axes: &AxisValues, at_most: f64, hints: &mut Hints) -> (f64, Option<Infeasible>) {
        let frames = self.machine_frames(axes);
        let work_from_tool = self.work_from_tool(axes);
        let mut nearest = (at_most, None);
        let n_obstacles = self.n_obstacles();
        let mut consider = |slot: usize, placed: &Placed<'_>, meets: &[bool]| {
            for k in (0..n_obstacles).filter(|&k| meets[k]) {
                let (mesh, allowance) = self.obstacle(k);
                let skin = placed.solid.rounding() + allowance;
                let hint = hint_at(&mut hints.distance, slot * n_obstacles + k);
                let pose = self.seen_from_obstacle(k, &frames, &placed.work_from_body);
                let found = mesh.core_distance(placed.solid, &pose, nearest.0 + skin, *hint);
                if let Some(s) = found.filter(|s| s.distance - skin < nearest.0) {
                    *hint = Some(s.triangle);
                    let place = self.at_work(k, &frames, &s.point);
                    nearest =
                        (s.distance - skin, Some(Infeasible::Collision { body: placed.body, obstacle: k, place }));
                }
            }
        };
        for (slot, placed) in self.placed(axes).enumerate() {
            consider(slot, &placed, &self.meetings.bodies[slot]);
        }
        for (k, solid) in self.cutter.iter().enumerate() {
            let placed = Placed { body: Body::Cutter, solid, work_from_body: work_from_tool };
            consider(self.meetings.bodies.len() + k, &placed, &self.meetings.cutter);
        }
        nearest
    }

    /// Returns the height of the tip above a clearance surface at which the whole cutter is
    /// outside, whatever its axis, mm.
    pub fn clearance_margin(&self) -> f64 {
        self.cell.tool.cutter().radius()
    }

    /// Returns the distance from the tool tip to the farthest point of the tool assembly, mm.
    pub fn reach(&self) -> f64 {
        let top = |b: &PlacedSolid| {
            let corner = b.solid.aabb();
            (b.frame_from_solid * corner.min).coords.norm().max((b.frame_from_solid * corner.max).coords.norm())
        };
        self.tool_bodies.iter().map(top).fold(self.cell.tool.gauge_length(), f64::max)
    }

    /// Returns the pose of the workpiece frame on the table, inverted.
    pub fn work_from_table(&self) -> &Isometry3<f64> {
        &self.work_from_table
    }

    /// Returns the tool's non-cutting bodies, dilated by their clearance, tool frame.
    pub fn tool_bodies(&self) -> &[PlacedSolid] {
        &self.tool_bodies
    }
}

/// Bisections of a lift: enough to exhaust a double.
const MAX_HALVINGS: u32 = 200;

/// Returns the solution on a branch; at the pole, where both are one, it is on either.
fn on_branch(all: &InverseSolutions, branch: facemill_inverse_kinematics::Branch) -> Option<Configuration> {
    let at_pole = || all.iter().find(|s| s.free_axis.is_some());
    all.on_branch(branch).or_else(at_pole).map(|s| Configuration { axes: s.values, branch })
}

pub(crate) fn hint_at<T: Clone>(hints: &mut Vec<Option<T>>, slot: usize) -> &mut Option<T> {
    if hints.len() <= slot {
        hints.resize(slot + 1, None);
    }
    &mut hints[slot]
}
