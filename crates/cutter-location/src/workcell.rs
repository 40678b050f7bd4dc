use facemill_cl_data::{CcPoint, ClPoint, PlacedSolid, Posture, Solid};
use facemill_interference::{Interference, Verdict};
use facemill_inverse_kinematics::{AxisValues, BranchPreference, Carrier, InverseSolution, Machine, Unreachable};
use facemill_tool_model::{Cutter, ToolAssembly, cl_from_cc};
use facemill_z_map::{ZMap, certainly_free};
use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

/// Something that must not be cut or hit, as a mesh in the workpiece frame.
pub struct Obstacle<'a> {
    /// What a finding calls it.
    pub name: String,
    /// The mesh.
    pub mesh: &'a dyn Interference,
    /// Distance that the cutter's test body keeps from the mesh, mm; `None` where the cutter may go (stock).
    pub gouge_allowance: Option<f64>,
    /// Distance that every dilated non-cutting body keeps from the mesh, mm: the thickness of the stock on it.
    pub collision_allowance: f64,
}

/// Directions the tool axis may point in, workpiece frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisCone {
    /// Middle of the cone.
    pub axis: Unit<Vector3<f64>>,
    /// Angle from the middle to the border, rad.
    pub half_angle: f64,
}

/// Everything a pose is judged by.
pub struct Workcell<'a> {
    /// Machine.
    pub machine: &'a Machine,
    /// Pose of the workpiece frame on the machine's table (or workpiece holder).
    pub table_from_work: Isometry3<f64>,
    /// Tool assembly.
    pub tool: &'a ToolAssembly,
    /// What must not be cut or hit.
    pub obstacles: Vec<Obstacle<'a>>,
    /// Branch of the inverse solution to take where nothing comes before.
    pub preferred_branch: BranchPreference,
    /// Directions allowed to the tool axis.
    pub axis_cone: Option<AxisCone>,
    /// Tolerance t of the cutter's test body, mm.
    pub gouge_tolerance: f64,
    /// Largest lift along the normal by which a pose may be seated, mm.
    pub max_lift: f64,
    /// Accuracy of the seating lift, mm.
    pub lift_resolution: f64,
    /// Z-map of all obstacles, dilated nowhere, with its pose: answers first for bodies that are far above it.
    pub z_map: Option<(&'a ZMap, Isometry3<f64>)>,
}

/// A pose that has been tested and found feasible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeasiblePose {
    /// Tilt and rotate.
    pub posture: Posture,
    /// Tool pose in the workpiece frame, seated.
    pub cl: ClPoint,
    /// Axis values of the machine.
    pub axes: AxisValues,
    /// How far the pose was lifted along the normal to free it of facets, mm.
    pub lift: f64,
}

/// Why a posture cannot be taken: a result, not an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Infeasible {
    /// The tool axis leaves the job's cone by `excess` rad.
    OutsideCone {
        /// Angle outside the cone, rad.
        excess: f64,
    },
    /// No axis values within the limits give this pose.
    Unreachable(Unreachable),
    /// The cutter's test body cuts an obstacle, and the largest lift does not free it.
    Gouge {
        /// Index of the obstacle.
        obstacle: usize,
        /// A point of the obstacle inside the test body, workpiece frame, at the largest lift.
        place: Point3<f64>,
    },
    /// An entry goes down into the stock more steeply than the tool may.
    Ramp {
        /// Angle below the cutter's bottom plane, rad.
        angle: f64,
    },
    /// A dilated non-cutting body hits an obstacle.
    Collision {
        /// The body.
        body: Body,
        /// Index of the obstacle.
        obstacle: usize,
        /// A point of the obstacle inside the dilated body, workpiece frame.
        place: Point3<f64>,
    },
}

/// A non-cutting body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Body {
    /// Of the tool assembly, by index.
    Tool(usize),
    /// Of the machine, by index.
    Machine(usize),
}

/// The triangles that answered last, one per pair of body and obstacle: neighbouring poses are usually blocked by the same.
#[derive(Clone, Debug, Default)]
pub struct Hints {
    gouge: Vec<Option<u32>>,
    collision: Vec<Option<u32>>,
    distance: Vec<Option<u32>>,
}

/// The workcell with what does not change from pose to pose worked out.
pub struct PoseTest<'a> {
    /// The workcell.
    pub cell: &'a Workcell<'a>,
    test_bodies: Vec<Solid>,
    tool_bodies: Vec<PlacedSolid>,
    work_from_table: Isometry3<f64>,
}

impl<'a> PoseTest<'a> {
    /// Prepares the bodies of the workcell.
    pub fn new(cell: &'a Workcell<'a>) -> Self {
        Self {
            cell,
            test_bodies: test_bodies(cell.tool.cutter(), cell.gouge_tolerance),
            tool_bodies: cell.tool.collision_bodies(),
            work_from_table: cell.table_from_work.inverse(),
        }
    }

    /// Name of a body for messages.
    pub fn body_name(&self, body: Body) -> &str {
        match body {
            Body::Tool(k) => &self.tool_bodies[k].name,
            Body::Machine(k) => self.cell.machine.bodies()[k].name(),
        }
    }

    /// One sentence on why a posture cannot be taken.
    pub fn describe(&self, why: &Infeasible) -> String {
        let name = |obstacle: usize| self.cell.obstacles[obstacle].name.as_str();
        match why {
            Infeasible::OutsideCone { excess } => {
                format!("tool axis {:.3} deg outside the job's cone", excess.to_degrees())
            }
            Infeasible::Unreachable(u) => u.to_string(),
            Infeasible::Gouge { obstacle, .. } => format!("cutter gouges {}", name(*obstacle)),
            Infeasible::Ramp { angle } => format!("ramp of {:.2} deg into stock", angle.to_degrees()),
            Infeasible::Collision { body, obstacle, .. } => {
                format!("{} hits {}", self.body_name(*body), name(*obstacle))
            }
        }
    }

    /// Tests one posture at a CC point: cone, limits, gouge with seating, collision (CLOPT, feasibility test).
    ///
    /// `near` are the axis values to stay close to; of several branches the nearest feasible one is taken.
    ///
    /// # Errors
    /// The first reason found, in the order of the tests.
    pub fn try_posture(
        &self,
        cc: &CcPoint,
        posture: Posture,
        near: Option<&AxisValues>,
        hints: &mut Hints,
    ) -> Result<FeasiblePose, Infeasible> {
        let cl = cl_from_cc(self.cell.tool.cutter(), cc, posture);
        if let Some(cone) = &self.cell.axis_cone {
            let excess = angle_between(&cl.axis, &cone.axis) - cone.half_angle;
            if excess > 0.0 {
                return Err(Infeasible::OutsideCone { excess });
            }
        }
        // Limits before gouge: they cost a microsecond, and a lift of hundredths of a millimetre hardly changes them.
        let _ = self.solutions(&cl, near)?;
        let lift = self.seat(&cl, &cc.normal, hints)?;
        let seated = cl.translated(cc.normal.into_inner() * lift);
        let mut reason = None;
        for axes in self.solutions(&seated, near)? {
            match self.collision(&axes, hints) {
                None => return Ok(FeasiblePose { posture, cl: seated, axes, lift }),
                Some(hit) => reason = reason.or(Some(hit)),
            }
        }
        Err(reason.expect("solutions() gives at least one"))
    }

    /// Axis values for a pose, at least one: with `near`, those on its branch come first, because going over to the other
    /// one is only possible through the pole; without, the preferred ones.
    fn solutions(
        &self,
        cl: &ClPoint,
        near: Option<&AxisValues>,
    ) -> Result<impl Iterator<Item = AxisValues> + use<>, Infeasible> {
        let machine = self.cell.machine;
        let cl = cl.transformed(&self.cell.table_from_work);
        let reference = near.copied().unwrap_or_else(|| machine.home());
        let length = self.cell.tool.gauge_length();
        let all = machine.inverse_near(&cl, length, &reference).map_err(Infeasible::Unreachable)?;
        let best = match near.and_then(|near| all.on_branch(machine.branch_of(near))) {
            Some(solution) => solution.values,
            None => machine
                .nearest_inverse(&cl, length, near, self.cell.preferred_branch)
                .map_err(Infeasible::Unreachable)?,
        };
        let others: Vec<AxisValues> =
            all.iter().map(|s: &InverseSolution| s.values).filter(|values| *values != best).collect();
        Ok(std::iter::once(best).chain(others))
    }

    /// Least lift along `normal` that frees the test body.
    fn seat(&self, cl: &ClPoint, normal: &Unit<Vector3<f64>>, hints: &mut Hints) -> Result<f64, Infeasible> {
        if self.gouge(cl, hints).is_none() {
            return Ok(0.0);
        }
        let lifted = |lift: f64| cl.translated(normal.into_inner() * lift);
        if let Some((obstacle, place)) = self.gouge(&lifted(self.cell.max_lift), hints) {
            return Err(Infeasible::Gouge { obstacle, place });
        }
        let (mut blocked, mut free) = (0.0, self.cell.max_lift);
        while free - blocked > self.cell.lift_resolution {
            let middle = 0.5 * (blocked + free);
            if self.gouge(&lifted(middle), hints).is_some() { blocked = middle } else { free = middle }
        }
        Ok(free)
    }

    /// First obstacle that the cutter's test body cuts, with a point of it inside the body (workpiece frame).
    pub fn gouge(&self, cl: &ClPoint, hints: &mut Hints) -> Option<(usize, Point3<f64>)> {
        let work_from_tool = tool_frame(cl);
        hints.gouge.resize(self.cell.obstacles.len(), None);
        for (k, obstacle) in self.cell.obstacles.iter().enumerate() {
            let Some(allowance) = obstacle.gouge_allowance else { continue };
            for body in &self.test_bodies {
                let body = body.dilated(allowance);
                if let Verdict::Hit(witness) = obstacle.mesh.verdict(&body, &work_from_tool, hints.gouge[k]) {
                    hints.gouge[k] = Some(witness.triangle);
                    return Some((k, witness.point));
                }
            }
        }
        None
    }

    /// First collision of a non-cutting body at these axis values.
    pub fn collision(&self, axes: &AxisValues, hints: &mut Hints) -> Option<Infeasible> {
        let gauge_length = self.cell.tool.gauge_length();
        let work_from_tool = self.work_from_table * self.cell.machine.forward(axes, gauge_length);
        let machine_bodies = self
            .cell
            .machine
            .body_poses(axes)
            .enumerate()
            .filter(|(_, pose)| pose.body.carrier() == Some(Carrier::Head))
            .map(|(k, pose)| (Body::Machine(k), &pose.body.body.solid, self.work_from_table * pose.table_from_solid));
        let tool_bodies = self
            .tool_bodies
            .iter()
            .enumerate()
            .map(|(k, b)| (Body::Tool(k), &b.solid, work_from_tool * b.frame_from_solid));
        let n_obstacles = self.cell.obstacles.len();
        for (slot, (body, solid, work_from_body)) in tool_bodies.chain(machine_bodies).enumerate() {
            if self.proven_free(solid, &work_from_body) {
                continue;
            }
            hints.collision.resize(hints.collision.len().max((slot + 1) * n_obstacles), None);
            for (k, obstacle) in self.cell.obstacles.iter().enumerate() {
                let hint = &mut hints.collision[slot * n_obstacles + k];
                let dilated = solid.dilated(obstacle.collision_allowance);
                if let Verdict::Hit(witness) = obstacle.mesh.verdict(&dilated, &work_from_body, *hint) {
                    *hint = Some(witness.triangle);
                    return Some(Infeasible::Collision { body, obstacle: k, place: witness.point });
                }
            }
        }
        None
    }

    /// Whether the Z-map's maxima prove that a body is above everything.
    fn proven_free(&self, solid: &Solid, work_from_body: &Isometry3<f64>) -> bool {
        let thickest = self.cell.obstacles.iter().map(|o| o.collision_allowance).fold(0.0, f64::max);
        self.cell.z_map.is_some_and(|(map, map_from_work)| {
            certainly_free(map, &solid.dilated(thickest), &(map_from_work * work_from_body))
        })
    }

    /// Tests a pose that is not at a CC point (an approach): cone excepted, as [`PoseTest::try_posture`] without seating.
    ///
    /// # Errors
    /// The first reason found.
    pub fn try_pose(&self, cl: &ClPoint, hints: &mut Hints) -> Result<AxisValues, Infeasible> {
        if let Some((obstacle, place)) = self.gouge(cl, hints) {
            return Err(Infeasible::Gouge { obstacle, place });
        }
        let mut reason = None;
        for axes in self.solutions(cl, None)? {
            match self.collision(&axes, hints) {
                None => return Ok(axes),
                Some(hit) => reason = reason.or(Some(hit)),
            }
        }
        Err(reason.expect("solutions() gives at least one"))
    }

    /// What is nearer than `clearance` to the whole tool, cutter included, at a pose in rapid: stock counts for the cutter,
    /// too.
    pub fn rapid_blocked(&self, cl: &ClPoint, clearance: f64, hints: &mut Hints) -> Option<Infeasible> {
        match self.rapid_distance(cl, clearance, hints) {
            Err(why) => Some(why),
            Ok((distance, nearest)) => nearest.filter(|_| distance < clearance),
        }
    }

    /// Distance from the whole tool and head, dilated as they are and cutter included, to the nearest obstacle or the stock
    /// on it, searched up to `at_most`, and what that is.
    ///
    /// # Errors
    /// When no axis values give the pose.
    pub fn rapid_distance(
        &self,
        cl: &ClPoint,
        at_most: f64,
        hints: &mut Hints,
    ) -> Result<(f64, Option<Infeasible>), Infeasible> {
        let axes = self.rapid_axes(cl)?;
        let work_from_tool = self.work_from_table * self.cell.machine.forward(&axes, self.cell.tool.gauge_length());
        let mut nearest = (at_most, None);
        let mut slot = 0;
        let n_obstacles = self.cell.obstacles.len();
        let mut consider = |body: Option<Body>, solid: &Solid, work_from_body: &Isometry3<f64>| {
            hints.distance.resize(hints.distance.len().max((slot + 1) * n_obstacles), None);
            for (k, obstacle) in self.cell.obstacles.iter().enumerate() {
                let skin = solid.rounding() + obstacle.collision_allowance;
                let hint = &mut hints.distance[slot * n_obstacles + k];
                let found = obstacle.mesh.core_distance(solid, work_from_body, nearest.0 + skin, *hint);
                if let Some(s) = found.filter(|s| s.distance - skin < nearest.0) {
                    *hint = Some(s.triangle);
                    let why = match body {
                        Some(body) => Infeasible::Collision { body, obstacle: k, place: s.point },
                        None => Infeasible::Gouge { obstacle: k, place: s.point },
                    };
                    nearest = (s.distance - skin, Some(why));
                }
            }
            slot += 1;
        };
        for cutter in test_bodies(self.cell.tool.cutter(), 0.0) {
            consider(None, &cutter, &work_from_tool);
        }
        for (k, b) in self.tool_bodies.iter().enumerate() {
            consider(Some(Body::Tool(k)), &b.solid, &(work_from_tool * b.frame_from_solid));
        }
        for (k, pose) in self.cell.machine.body_poses(&axes).enumerate() {
            if pose.body.carrier() == Some(Carrier::Head) {
                consider(
                    Some(Body::Machine(k)),
                    &pose.body.body.solid,
                    &(self.work_from_table * pose.table_from_solid),
                );
            }
        }
        Ok(nearest)
    }

    /// The axis values that a pose in rapid is judged at.
    fn rapid_axes(&self, cl: &ClPoint) -> Result<AxisValues, Infeasible> {
        Ok(self.solutions(cl, None)?.next().expect("solutions() gives at least one"))
    }

    /// Where tool and head are at a pose in rapid.
    ///
    /// # Errors
    /// When no axis values give the pose.
    pub(crate) fn stance(&self, cl: &ClPoint) -> Result<Stance, Infeasible> {
        let axes = self.rapid_axes(cl)?;
        let head_bodies =
            self.cell.machine.body_poses(&axes).filter(|pose| pose.body.carrier() == Some(Carrier::Head)).map(|pose| {
                let work_from_body = self.work_from_table * pose.table_from_solid;
                let tip = work_from_body.inverse_transform_point(&cl.tip);
                let bounds = pose.body.body.solid.aabb();
                let farthest = (bounds.min - tip).abs().sup(&(bounds.max - tip).abs()).norm();
                PlacedBody { rotation: work_from_body.rotation, tip, farthest }
            });
        Ok(Stance { cl: *cl, tool_reach: self.reach(), head_bodies: head_bodies.collect() })
    }

    /// How far above a clearance surface the tip has to be for the whole cutter to be outside, whatever its axis, mm.
    pub fn clearance_margin(&self) -> f64 {
        self.cell.tool.cutter().radius()
    }

    /// Whether the cutter touches the stock, or what it is on, at a pose.
    pub fn cutter_in_stock(&self, cl: &ClPoint, hints: &mut Hints) -> bool {
        let work_from_tool = tool_frame(cl);
        let cutter = test_bodies(self.cell.tool.cutter(), 0.0);
        hints.gouge.resize(self.cell.obstacles.len(), None);
        self.cell.obstacles.iter().zip(&hints.gouge).any(|(obstacle, hint)| {
            let touches = |body: &Solid| {
                let body = body.dilated(obstacle.collision_allowance);
                !obstacle.mesh.verdict(&body, &work_from_tool, *hint).is_free()
            };
            cutter.iter().any(touches)
        })
    }

    /// Distance from the tool tip to the farthest point of the tool assembly, mm.
    pub fn reach(&self) -> f64 {
        let top = |b: &PlacedSolid| {
            let corner = b.solid.aabb();
            (b.frame_from_solid * corner.min).coords.norm().max((b.frame_from_solid * corner.max).coords.norm())
        };
        self.tool_bodies.iter().map(top).fold(self.cell.tool.gauge_length(), f64::max)
    }

    /// Pose of the workpiece frame on the table, inverted.
    pub fn work_from_table(&self) -> &Isometry3<f64> {
        &self.work_from_table
    }

    /// The tool's non-cutting bodies, dilated by their clearance, tool frame.
    pub fn tool_bodies(&self) -> &[PlacedSolid] {
        &self.tool_bodies
    }
}

/// Where tool and head are at one pose.
pub(crate) struct Stance {
    cl: ClPoint,
    tool_reach: f64,
    head_bodies: Vec<PlacedBody>,
}

/// A body of the head, seen from the tool tip.
struct PlacedBody {
    /// Of the workpiece from the body.
    rotation: UnitQuaternion<f64>,
    /// The tool tip in the body's frame.
    tip: Point3<f64>,
    /// Distance from the tip to the body's farthest point, mm.
    farthest: f64,
}

impl Stance {
    /// Largest distance in the workpiece frame that any point of tool and head covers on the way to another stance, mm, as
    /// long as every body turns one way and the tip goes straight.
    ///
    /// A point moves with the tip, turns about it with its body, and moves as the body does against the tip (a ram that does
    /// not tilt with the tool). The tool is round: turning about its own axis moves nothing.
    pub(crate) fn motion_to(&self, other: &Self) -> f64 {
        let of_tool = angle_between(&self.cl.axis, &other.cl.axis) * self.tool_reach;
        let of_head = self
            .head_bodies
            .iter()
            .zip(&other.head_bodies)
            .map(|(a, b)| a.rotation.angle_to(&b.rotation) * a.farthest.max(b.farthest) + (b.tip - a.tip).norm());
        (other.cl.tip - self.cl.tip).norm() + of_head.fold(of_tool, f64::max)
    }
}

/// The bodies that together stand for the cutter at a tolerance.
fn test_bodies(cutter: &Cutter, tolerance: f64) -> Vec<Solid> {
    std::iter::once(cutter.test_body(tolerance)).chain(cutter.upper_test_body(tolerance)).map(Solid::Frustum).collect()
}

/// A tool frame at a pose: origin at the tip, z along the axis, x anywhere. For bodies of revolution only.
pub fn tool_frame(cl: &ClPoint) -> Isometry3<f64> {
    let rotation = UnitQuaternion::rotation_between(&Vector3::z(), &cl.axis)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    Isometry3::from_parts(cl.tip.into(), rotation)
}

/// Angle between two directions, rad, accurate near 0 and π.
pub fn angle_between(a: &Unit<Vector3<f64>>, b: &Unit<Vector3<f64>>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}
