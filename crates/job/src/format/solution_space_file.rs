//! Formats of the file of a solution space, `"format": "facemill-solution-space/1"`, and of maps of
//! feasible postures along a program, `"format": "facemill-postures/1"`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::format::program_stamp::ProgramStamp;

/// Feasible set over tilt × rotate at one CC point. Angles are those of the paper: rotate is
/// positive to the left of the feed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolutionSpaceFile {
    /// Always `"facemill-solution-space/1"`.
    pub format: SolutionSpaceFormat,
    /// Name of the job.
    pub job: String,
    /// Name of the setup.
    pub setup: String,
    /// Name of the operation.
    pub operation: String,
    /// Pass of the path, from 1 as in the program's comments.
    pub pass: usize,
    /// CC point of the pass, from 1.
    pub point: usize,
    /// The CC point, workpiece frame.
    pub position_mm: [f64; 3],
    /// Normal out of the material.
    pub normal: [f64; 3],
    /// Feed direction.
    pub feed: [f64; 3],
    /// Smallest and largest tilt of the map.
    pub tilt_deg: [f64; 2],
    /// Smallest and largest rotate of the map (docs/formats.md#climb-and-the-sign-of-rotate).
    pub rotate_deg: [f64; 2],
    /// Largest side of an uncertain cell, 0.05 to 10.
    pub resolution_deg: f64,
    /// Number of postures tested, one in the middle of each tried range.
    pub pose_tests: usize,
    /// Parts of the map's area, 0 to 1.
    pub area: AreaFile,
    /// The posture that the operation's search finds at the point, before adaptation to its
    /// neighbours; `null` if it finds none.
    pub found: Option<PostureFile>,
    /// Cells that cover the map.
    pub cells: Vec<CellFile>,
}

/// Version of the format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub enum SolutionSpaceFormat {
    /// `facemill-solution-space/1`.
    #[default]
    #[serde(rename = "facemill-solution-space/1")]
    V1,
}

/// Parts of the map's area; their sum is 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AreaFile {
    /// Every posture is feasible: proven.
    pub free: f64,
    /// No posture is feasible: proven.
    pub blocked: f64,
    /// Neither is proven at the resolution.
    pub uncertain: f64,
}

/// A posture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PostureFile {
    /// Tilt.
    pub tilt_deg: f64,
    /// Rotate.
    pub rotate_deg: f64,
}

/// A cell of the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CellFile {
    /// Smallest and largest tilt.
    pub tilt_deg: [f64; 2],
    /// Smallest and largest rotate.
    pub rotate_deg: [f64; 2],
    /// Knowledge of its postures.
    pub state: StateFile,
    /// For a blocked cell, the reason that blocks every posture of it. For an uncertain cell, the
    /// reason that blocks the posture in its middle; missing if that is feasible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<ReasonFile>,
}

/// Knowledge of the postures of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StateFile {
    /// Every posture is feasible: proven.
    Free,
    /// No posture is feasible: proven.
    Blocked,
    /// Neither is proven.
    Uncertain,
}

/// Reason why a posture cannot be used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReasonFile {
    /// Kind of reason.
    pub kind: ReasonKind,
    /// The reason in words, with the values of the posture in the middle of the cell.
    pub text: String,
    /// The body that gouges or collides, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// The body that it gouges or hits, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub obstacle: Option<String>,
}

/// Kind of a reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ReasonKind {
    /// The cutter gouges, and seating does not free it.
    Gouge,
    /// Another body collides, or the cutter with the machine.
    Collision,
    /// No axis values within the limits.
    AxisLimit,
    /// The tool axis is outside the job's cone.
    Cone,
}

/// Value of the key `format` of [`PostureMapsFile`].
pub const POSTURE_MAPS_FORMAT: &str = "facemill-postures/1";

/// Maps of the feasible tilt and rotate where each pass has the narrowest choice.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PostureMapsFile {
    /// Always `"facemill-postures/1"`.
    pub format: &'static str,
    /// The programs that the passes are of.
    pub programs: Vec<ProgramStamp>,
    /// Number of pieces of passes; fewer are mapped if there are many.
    pub n_passes: usize,
    /// Curves along which postures are sought: points with tilt and rotate.
    pub curves_deg: Vec<Vec<[f64; 2]>>,
    /// Maps, in the order of the program.
    pub maps: Vec<PostureMap>,
}

/// Map at a CC point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PostureMap {
    /// Name of the operation.
    pub operation: String,
    /// Pass, from 1 as in the program's comments.
    pub pass: usize,
    /// Place of the pattern, from 1.
    pub place: usize,
    /// Tip of the tool in the taken posture, workpiece frame.
    pub tip_mm: [f64; 3],
    /// Tool axis there.
    pub axis: [f64; 3],
    /// Smallest and largest tilt.
    pub tilt_deg: [f64; 2],
    /// Smallest and largest rotate.
    pub rotate_deg: [f64; 2],
    /// Tilt and rotate that the program has there.
    pub taken_deg: [f64; 2],
    /// Curve of the search: its place among `curves_deg`, from 0.
    pub curve: usize,
    /// Number of cells along tilt and rotate.
    pub n_cells: [usize; 2],
    /// Fractions of the area that are proven feasible and proven blocked.
    pub proven: [f64; 2],
    /// A letter for each cell, in rows along tilt: `f` feasible, `g` the cutter gouges, `c` a body
    /// collides, `l` an axis cannot be there, `a` outside the cone of the tool axis. In upper case
    /// it is proven for all of the cell, in lower case tested in its middle.
    pub cells: String,
}
