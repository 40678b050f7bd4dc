use std::fmt;
use std::sync::Arc;

use facemill_cl_data::{ClPoint, Posture};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::{AxisValues, Branch, BranchPreference, Machine, Unreachable};
use facemill_tool_model::ToolAssembly;
use facemill_z_map::ZMap;
use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use crate::pose::obstacle::{Obstacle, table_bodies};

/// Allowed directions of the tool axis, workpiece frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisCone {
    /// Middle of the cone.
    pub axis: Unit<Vector3<f64>>,
    /// Angle from the middle to the border, rad.
    pub half_angle: f64,
}

/// Everything that decides about a pose.
#[derive(Clone)]
pub struct Workcell<'a> {
    /// Machine.
    pub machine: &'a Machine,
    /// Pose of the workpiece frame on the machine's table (or workpiece holder).
    pub table_from_work: Isometry3<f64>,
    /// Tool assembly.
    pub tool: &'a ToolAssembly,
    /// Obstacles, which must not be cut or hit. Bodies of the table that do not move against the
    /// workpiece belong here; tool and head are always tested against machine bodies that do.
    pub obstacles: Vec<Obstacle<'a>>,
    /// Branch of the inverse solution for poses without a predecessor.
    pub preferred_branch: BranchPreference,
    /// Cone of allowed directions of the tool axis.
    pub axis_cone: Option<AxisCone>,
    /// Tolerance t of the cutter's test body, mm.
    pub gouge_tolerance: f64,
    /// Largest lift along the normal by which a pose may be seated, mm.
    pub max_lift: f64,
    /// Accuracy of the seating lift, mm.
    pub lift_resolution: f64,
    /// Z-map of all obstacles, not dilated, with its pose: proves quickly that bodies far above it
    /// are free.
    pub z_map: Option<(&'a ZMap, Isometry3<f64>)>,
}

/// Tolerance t of the cutter's test body in a new workcell, mm.
pub const GOUGE_TOLERANCE: f64 = 0.02;

/// Largest lift of a pose in a new workcell, mm.
pub const MAX_LIFT: f64 = 0.06;

impl<'a> Workcell<'a> {
    /// Returns a workcell whose only obstacles are the machine's own: the bodies of its table that
    /// do not move against the workpiece, with the clearances of the machine file. The test takes
    /// those that do move from the machine itself.
    ///
    /// `table_from_work` is the pose of the workpiece frame on the machine's table. Push the part,
    /// fixtures and stock to `obstacles` ([`Obstacle::part`]). The other values start with
    /// defaults: [`GOUGE_TOLERANCE`], [`MAX_LIFT`] with a thirtieth of it as resolution, the
    /// configuration nearest to the machine's home position, no cone of directions and no Z-map.
    pub fn new(machine: &'a Machine, tool: &'a ToolAssembly, table_from_work: Isometry3<f64>) -> Self {
        let table = table_bodies(machine, &table_from_work).map(|body| Obstacle {
            gouge_allowance: Some(body.clearance),
            collision_allowance: body.clearance,
            machine_body: Some(body.index),
            ..Obstacle::part(body.name, Arc::new(MeshTree::new(&body.mesh)))
        });
        Self {
            machine,
            table_from_work,
            tool,
            obstacles: table.collect(),
            preferred_branch: BranchPreference::Nearest,
            axis_cone: None,
            gouge_tolerance: GOUGE_TOLERANCE,
            max_lift: MAX_LIFT,
            lift_resolution: MAX_LIFT / 30.0,
            z_map: None,
        }
    }
}

/// Configuration of a machine at a pose: axis values, and their branch of the inverse solution. At
/// the pole both branches have the same values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Configuration {
    /// Axis values.
    pub axes: AxisValues,
    /// Branch.
    pub branch: Branch,
}

/// A pose that has been tested and found feasible.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FeasiblePose {
    /// Tilt and rotate.
    pub posture: Posture,
    /// Tool pose in the workpiece frame, seated.
    pub cl: ClPoint,
    /// Configuration of the machine.
    pub configuration: Configuration,
    /// How far the pose was lifted along the normal to free it of facets, mm.
    pub lift: f64,
}

/// Reason why a posture is infeasible: a result, not an error.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Infeasible {
    /// The tool axis leaves the job's cone by `excess` rad.
    OutsideCone {
        /// Angle outside the cone, rad.
        excess: f64,
    },
    /// The tool axis is so near to the rotary axis nearest to the workpiece that this axis would
    /// have to turn fast; only where the test avoids that
    /// ([`PoseTest::avoiding_pole`](crate::pose::pose_test::PoseTest::avoiding_pole)).
    Singular {
        /// Angle inside the cone to avoid, rad.
        within: f64,
    },
    /// The tool axis of the requested posture is 90° or more from the surface's normal, or has no
    /// direction at all.
    FromBelow,
    /// No axis values within the limits give this pose.
    Unreachable(Unreachable),
    /// The pose can be reached, but only on the other branch, while its way is on this one.
    OtherBranch(Branch),
    /// The cutter's test body cuts an obstacle, and the largest lift does not free it.
    Gouge {
        /// Index of the obstacle; those of the machine come behind those of the workcell.
        obstacle: usize,
        /// A point of the obstacle inside the test body, workpiece frame, at the largest lift.
        place: Point3<f64>,
    },
    /// A way has more steps than can be tested.
    TooLong,
    /// A limited rotary axis would have to turn back on the way.
    Rewind {
        /// Index of the axis.
        axis: usize,
    },
    /// An entry, exit or turn descends into the stock more steeply than the tool may.
    Ramp {
        /// Angle below the cutter's bottom plane, rad.
        angle: f64,
    },
    /// A dilated non-cutting body hits an obstacle, or the cutter hits one that it must not touch.
    Collision {
        /// The body.
        body: Body,
        /// Index of the obstacle; those of the machine come behind those of the workcell.
        obstacle: usize,
        /// A point of the obstacle inside the dilated body, workpiece frame.
        place: Point3<f64>,
    },
}

/// Identifies bodies and obstacles by their index; [`PoseTest::describe`] gives their names.
///
/// [`PoseTest::describe`]: crate::pose::pose_test::PoseTest::describe
impl fmt::Display for Infeasible {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = |p: &Point3<f64>| format!("({:.3}, {:.3}, {:.3}) mm", p.x, p.y, p.z);
        match self {
            Self::OutsideCone { excess } => {
                write!(f, "tool axis {:.3} deg outside the permitted cone", excess.to_degrees())
            }
            Self::Singular { within } => {
                write!(f, "tool axis {:.3} deg inside the cone about the pole of the rotary axes", within.to_degrees())
            }
            Self::FromBelow => write!(f, "the tool axis does not point out of the surface"),
            Self::Unreachable(why) => why.fmt(f),
            Self::OtherBranch(_) => write!(f, "the pose can only be reached with the head turned to its other side"),
            Self::Gouge { obstacle, place } => write!(f, "cutter gouges obstacle {obstacle} at {}", at(place)),
            Self::TooLong => write!(f, "the way is too long to be tested"),
            Self::Rewind { axis } => write!(f, "axis {axis} would have to turn back at its limit"),
            Self::Ramp { angle } => write!(f, "ramp of {:.2} deg into stock", angle.to_degrees()),
            Self::Collision { body, obstacle, place } => write!(f, "{body} hits obstacle {obstacle} at {}", at(place)),
        }
    }
}

impl std::error::Error for Infeasible {}

/// A body of tool or machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Body {
    /// The cutter.
    Cutter,
    /// Of the tool assembly, by index.
    Tool(usize),
    /// Of the machine, by index.
    Machine(usize),
}

impl fmt::Display for Body {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cutter => write!(f, "cutter"),
            Self::Tool(k) => write!(f, "tool body {k}"),
            Self::Machine(k) => write!(f, "machine body {k}"),
        }
    }
}

/// Triangles of the last hits, one per pair of body and obstacle, and the places at which ways from
/// the end of a pass were refused last: neighbouring poses are usually blocked by the same.
#[derive(Clone, Debug, Default)]
pub struct Hints {
    pub(crate) gouge: Vec<Option<u32>>,
    pub(crate) collision: Vec<Option<u32>>,
    pub(crate) distance: Vec<Option<u32>>,
    /// By the number of the way, in the order in which they are tried.
    pub(crate) refused: Vec<Option<RefusedAt>>,
}

/// Place on a way from the end of a pass that the tool cannot take: a fraction of the straight move
/// to a pose of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum RefusedAt {
    /// On the move to a pose of the arc or of the line behind it.
    Arc {
        /// Number of the pose.
        pose: usize,
        /// Fraction of the move.
        share: f64,
    },
    /// On a step of the retract.
    Retract {
        /// Number of the step, from 1.
        step: usize,
        /// Fraction of the step.
        share: f64,
    },
}

/// Returns a tool frame at a pose: origin at the tip, z along the axis, x anywhere. For bodies of
/// revolution only.
pub fn tool_frame(cl: &ClPoint) -> Isometry3<f64> {
    let rotation = UnitQuaternion::rotation_between(&Vector3::z(), &cl.axis)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    Isometry3::from_parts(cl.tip.into(), rotation)
}

/// Returns the angle between two directions, rad, accurate near 0 and π.
pub fn angle_between(a: &Unit<Vector3<f64>>, b: &Unit<Vector3<f64>>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}
