//! Machine file and its faults.

pub(crate) mod assumed;
pub(crate) mod axis_lines;
pub(crate) mod error;
pub(crate) mod line_chain;
pub(crate) mod lines_of_rows;
pub(crate) mod mesh_shape;

pub use crate::machine_file::assumed::{AssumedFile, AssumedValue};
pub use crate::machine_file::error::FieldProblem;
pub use crate::machine_file::line_chain::{LineChain, LineFile, PlaceFile};
pub use crate::machine_file::mesh_shape::{BodyMesh, MeshShapeFile, MeshUnitFile};

use facemill_cl_data::{ControlTolerance, CuttingLaw, MotionLaw, RapidLaw};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::axes::axis::Rollover;
use crate::machine_file::line_chain::{ToolChainText, WorkpieceChainText};

/// Machine file: kinematic chains, axes, bodies and motion laws of a machine tool.
///
/// Two chains start at the bed: the workpiece's ends at the table frame, the tool's at the spindle
/// nose. A chain is given by rows, each one transform of Craig's modified Denavit-Hartenberg
/// convention, or by the lines of its axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MachineFile {
    /// Always `"facemill-machine/1"`.
    pub format: MachineFormat,
    /// Name of the machine in reports.
    #[schemars(length(min = 1))]
    pub name: String,
    /// Source of the numbers.
    #[schemars(length(min = 1))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Typical values that are not those of the machine, to be replaced before a program is run;
    /// nothing depends on the list, `machine check` prints it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub assumed: Vec<AssumedFile>,
    /// Transforms from the bed to the table. With no rows or lines the workpiece lies on the bed.
    pub workpiece_chain: WorkpieceChain,
    /// Transforms from the bed to the spindle nose: one chain, or one for each of two heads
    /// (docs/machines.md#two-heads). The frame of the nose has its origin in the centre of its face
    /// and z into the spindle.
    #[schemars(length(min = 1, max = 2))]
    pub tool_chains: Vec<ToolChain>,
    /// Bodies that do not move.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bed_bodies: Vec<BodyFile>,
    /// Motion of the control between two programmed positions.
    pub motion: MotionFile,
    /// Feeds that the control accepts.
    pub feed: FeedFile,
    /// Time of a tool change, from cut to cut, without the way home: times of whole jobs count it.
    /// Default: changes are not counted.
    #[schemars(range(min = 0, max = 3_600))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool_change_s: Option<f64>,
}

/// Name and version of the machine file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub enum MachineFormat {
    /// The first version.
    #[serde(rename = "facemill-machine/1")]
    V1,
}

/// Transforms from the bed to the table. With no rows the workpiece lies on the bed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "WorkpieceChainText", into = "WorkpieceChainText")]
pub struct WorkpieceChain {
    /// Rows from the bed outward; none where there are lines.
    pub rows: Vec<DhRow>,
    /// Lines of the axes, in place of rows. A [`Machine`](crate::Machine) has rows made from them.
    pub lines: Option<LineChain>,
}

/// Transforms from the bed to the spindle nose: its origin is the centre of the nose's face, its z
/// points into the spindle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "ToolChainText", into = "ToolChainText")]
pub struct ToolChain {
    /// Channel of the control that programs this head, from 1.
    pub channel: u32,
    /// Tool interface of the spindle nose (HSK-A100, SK 50, Capto C8); nothing depends on it,
    /// `machine check` prints it.
    pub tool_interface: Option<String>,
    /// Rows from the bed outward; none where there are lines.
    pub rows: Vec<DhRow>,
    /// Lines of the axes, in place of rows. A [`Machine`](crate::Machine) has rows made from them.
    pub lines: Option<LineChain>,
}

/// One transform RotX(alpha) · TransX(a) · RotZ(theta) · TransZ(d) from a link's frame to the one
/// before it.
///
/// A prismatic joint adds its value to d, a revolute one to theta. A row without a joint is fixed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DhRow {
    /// Offset along the previous x axis.
    #[serde(default)]
    pub a_mm: f64,
    /// Turn about the previous x axis.
    #[schemars(range(min = -360, max = 360))]
    #[serde(default)]
    pub alpha_deg: f64,
    /// Offset along this row's z axis; a prismatic joint adds to it.
    #[serde(default)]
    pub d_mm: f64,
    /// Turn about this row's z axis; a revolute joint adds to it.
    #[schemars(range(min = -360, max = 360))]
    #[serde(default)]
    pub theta_deg: f64,
    /// Axis that moves along or about this row's z axis. Default: none, the row is fixed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<Joint>,
    /// Bodies in this row's frame, moving with its joint.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<BodyFile>,
}

/// The axis of a row.
// Exhaustive for callers: motion must not be taken for another joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Joint {
    /// Moves along the row's z axis, or along the line.
    Prismatic(PrismaticJoint),
    /// Turns about the row's z axis, or about the line.
    Revolute(RevoluteJoint),
}

/// An axis that moves along its row's z axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrismaticJoint {
    /// Address in NC text: one of X Y Z A B C U V W, with a digit 1 to 9 for a second head (X2).
    pub axis: String,
    /// Direction in which a positive word moves the axis.
    #[serde(default)]
    pub sense: Sense,
    /// Lower end of the travel.
    pub min_mm: f64,
    /// Upper end of the travel.
    pub max_mm: f64,
    /// Home position, within the travel.
    #[serde(default)]
    pub home_mm: f64,
    /// Largest speed.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub max_velocity_mm_min: f64,
    /// Largest acceleration; without it for every axis, programs are not timed by the time law
    /// (docs/time-law.md).
    #[schemars(range(min = 0.1, max = 1_000_000))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_acceleration_mm_s2: Option<f64>,
    /// Largest jerk; needed as the acceleration is.
    #[schemars(range(min = 0.1, max = 1e9))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_jerk_mm_s3: Option<f64>,
}

/// An axis that turns about its row's z axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RevoluteJoint {
    /// Address in NC text: one of X Y Z A B C U V W, with a digit 1 to 9 for a second head (B2).
    pub axis: String,
    /// Direction in which a positive word turns the link. By ISO 841 axes describe the tool's
    /// motion relative to a still workpiece, so a table that turns about a row with z up is
    /// `negative`.
    #[serde(default)]
    pub sense: Sense,
    /// Travel.
    pub range: RevoluteRange,
    /// How the control takes a word of an endless axis. Without it words wind on, and runs on which
    /// that matters list it as an assumption.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rollover: Option<Rollover>,
    /// Largest number of turns that an endless axis may be from home, for its cables or its
    /// counter: plans turn it back on links, and programs that go beyond have an `axis_limit`. Not
    /// with rollover.
    #[schemars(range(min = 1, max = 1_000))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_wind_up_turns: Option<f64>,
    /// Home position, within the travel.
    #[schemars(range(min = -360_000, max = 360_000))]
    #[serde(default)]
    pub home_deg: f64,
    /// Largest speed.
    #[schemars(range(min = 1, max = 10_000_000))]
    pub max_velocity_deg_min: f64,
    /// Largest acceleration; without it for every axis, programs are not timed by the time law
    /// (docs/time-law.md).
    #[schemars(range(min = 0.01, max = 1_000_000))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_acceleration_deg_s2: Option<f64>,
    /// Largest jerk; needed as the acceleration is.
    #[schemars(range(min = 0.01, max = 1e9))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_jerk_deg_s3: Option<f64>,
}

/// Sense of an axis relative to its row's z, which is the direction of its line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sense {
    /// Along or right-handed about +z of the row, or the direction of the line.
    #[default]
    Positive,
    /// Against it.
    Negative,
}

impl Sense {
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Positive => 1.0,
            Self::Negative => -1.0,
        }
    }
}

/// How far a revolute axis turns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum RevoluteRange {
    /// Between two stops.
    Limited {
        /// Lower end of the travel.
        #[schemars(range(min = -360_000, max = 360_000))]
        min_deg: f64,
        /// Upper end of the travel.
        #[schemars(range(min = -360_000, max = 360_000))]
        max_deg: f64,
    },
    /// Without stops.
    Endless,
}

/// A body of the machine that must not touch anything.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyFile {
    /// Name in findings.
    #[schemars(length(min = 1))]
    pub name: String,
    /// Shape in the body's own frame.
    pub shape: ShapeFile,
    /// Origin of the body's frame in the link's frame.
    #[serde(default)]
    pub position_mm: [f64; 3],
    /// Turns of the body's frame about the link's fixed x, then y, then z axis.
    #[schemars(inner(range(min = -360, max = 360)))]
    #[serde(default)]
    pub rotation_xyz_deg: [f64; 3],
    /// Distance that everything keeps from the body.
    #[schemars(range(min = 0))]
    #[serde(default)]
    pub clearance_mm: f64,
}

/// Shape of a body in its own frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum ShapeFile {
    /// Box about the origin.
    Box {
        /// Edge lengths along x, y, z, each above 0.
        size_mm: [f64; 3],
    },
    /// Cylinder about z, from z = 0 up.
    Cylinder {
        /// Radius.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius_mm: f64,
        /// Height.
        #[schemars(extend("exclusiveMinimum" = 0))]
        height_mm: f64,
    },
    /// Frustum about z, from z = 0 up.
    Frustum {
        /// Radius at z = 0.
        #[schemars(range(min = 0))]
        radius_low_mm: f64,
        /// Radius at the upper end.
        #[schemars(range(min = 0))]
        radius_high_mm: f64,
        /// Height.
        #[schemars(extend("exclusiveMinimum" = 0))]
        height_mm: f64,
    },
    /// Convex hull of a mesh, in the mesh's frame (docs/machines.md#bodies-from-meshes). The hull
    /// encloses the mesh, so a body that is clear of it is clear of the mesh.
    Mesh(MeshShapeFile),
}

/// Motion of the control between two programmed positions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionFile {
    /// Motion in cutting moves.
    pub cutting: CuttingLawFile,
    /// Motion in rapids. Under RTCP some controls keep the tip on a line instead, as in cuts: the
    /// dialect (docs/dialects.md#motion-law) says which.
    pub rapid: RapidLawFile,
    /// Largest deviation by smoothing and blending; part of the error budget, and the tolerance
    /// within which the time law (docs/time-law.md#in-plans-and-new-feeds) blends corners (0: it
    /// stops there). Default: 0, 0.
    #[serde(default)]
    pub control_tolerance: ControlToleranceFile,
}

/// Motion of the control between two positions of a cutting move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum CuttingLawFile {
    /// All machine axes move linearly together: five-axis moves without RTCP.
    AxesLinear,
    /// RTCP: the tip moves on a straight line, the rotary axes linearly.
    TipAndRotariesLinear,
    /// RTCP: the tip moves on a straight line, the tool vector turns uniformly in the plane of its
    /// two ends.
    TipLinearVectorTurned,
}

/// Motion of the control between two positions of a rapid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum RapidLawFile {
    /// All axes start and end together.
    Linear,
    /// Each axis moves at its own speed and stops when it is there: the path bends.
    PerAxis,
}

/// Deviation of the control from the programmed motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlToleranceFile {
    /// Deviation of the tip.
    #[schemars(range(min = 0, max = 10))]
    pub path_mm: f64,
    /// Deviation of the tool axis.
    #[schemars(range(min = 0, max = 5))]
    pub orientation_deg: f64,
}

/// Feeds the control can be given, in the unit of the F word.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FeedFile {
    /// Smallest F.
    #[schemars(range(min = 0.001, max = 1_000_000))]
    pub min_mm_min: f64,
    /// Largest F.
    #[schemars(range(min = 0.001, max = 1_000_000))]
    pub max_mm_min: f64,
    /// Feed of linear rapids over all axes with 1 deg as 1 mm. Without it axis speeds alone limit
    /// rapids.
    #[schemars(range(min = 1, max = 1_000_000))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rapid_mm_min: Option<f64>,
}

impl MotionFile {
    /// The law in the pipeline's words.
    pub fn law(&self) -> MotionLaw {
        MotionLaw {
            cutting: match self.cutting {
                CuttingLawFile::AxesLinear => CuttingLaw::AxesLinear,
                CuttingLawFile::TipAndRotariesLinear => CuttingLaw::TipAndRotariesLinear,
                CuttingLawFile::TipLinearVectorTurned => CuttingLaw::TipLinearVectorTurned,
            },
            rapid: match self.rapid {
                RapidLawFile::Linear => RapidLaw::Linear,
                RapidLawFile::PerAxis => RapidLaw::PerAxis,
            },
            control_tolerance: ControlTolerance {
                path: self.control_tolerance.path_mm,
                orientation: self.control_tolerance.orientation_deg.to_radians(),
            },
        }
    }
}

/// JSON Schema (draft 2020-12) of the machine file.
#[must_use]
pub fn machine_schema() -> String {
    facemill_file_format::schema::<MachineFile>()
}
