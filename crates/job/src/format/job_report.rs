//! Format of the report on a job with several programs, `"format": "facemill-job-report/1"`: all of
//! its clampings and tools in their order.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::duration_text::clock;
use crate::format::report::operations::OperationReport;
use crate::format::report::outcome::Outcome;

/// Value of the key `format` in a report on a job.
pub const JOB_REPORT_FORMAT: &str = "facemill-job-report/1";

/// Report on a job with several programs: of several clampings, or of several tools.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JobReport {
    /// Always `"facemill-job-report/1"`.
    pub format: String,
    /// Name of the job.
    pub job: String,
    /// Name of the machine.
    pub machine: String,
    /// Outcome of the plan: the worst of its programs.
    pub outcome: Outcome,
    /// Machine time of all programs and their tool changes, s. A person's time is not counted.
    pub total_time_s: f64,
    /// Changes to another tool within clampings: the first tool of each is not counted.
    pub tool_changes: usize,
    /// Time of one (`tool_change_s` of the machine), s; `null` if the machine file does not say it,
    /// and then changes are not in the total.
    pub tool_change_s: Option<f64>,
    /// The clampings, in the order in which they are cut.
    pub clampings: Vec<ClampingReport>,
}

impl JobReport {
    /// Returns the line of the summary.
    #[must_use]
    pub fn summary_line(&self) -> String {
        let programs: usize = self.clampings.iter().map(|c| c.programs.len()).sum();
        let changes = match self.tool_change_s {
            Some(time) => format!("{} tool change(s) of {time} s among them", self.tool_changes),
            None => format!("{} tool change(s) not counted (tool_change_s of the machine)", self.tool_changes),
        };
        let (time, n) = (clock(self.total_time_s), self.clampings.len());
        format!("{}: {time} on the machine, {programs} program(s) in {n} clamping(s), {changes}", self.job)
    }
}

/// Clamping of the part, with the programs of all its tools.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClampingReport {
    /// Name of the setup in the job file.
    pub name: String,
    /// Machine time of its programs and the tool changes between them, s.
    pub time_s: f64,
    /// Position of the part on the machine.
    pub placement: PlacementReport,
    /// Stock before it, in words.
    pub stock: String,
    /// Finished surfaces by which the part is located, connected piece by piece.
    pub datums: Vec<DatumReport>,
    /// Fixtures that the tool keeps clear of, by their files.
    pub fixtures: Vec<String>,
    /// File of the program with all of its tools, if one is written.
    pub joined_program: Option<String>,
    /// BLAKE3 checksum of it, 64 hexadecimal digits; `null` if there is none.
    pub joined_blake3: Option<String>,
    /// Reason why there is none; `null` also for one tool.
    pub not_joined_because: Option<String>,
    /// The programs of its tools, in their order.
    pub programs: Vec<ToolProgramReport>,
    /// Its setups with a tool that has nothing to cut, and no program.
    pub without_program: Vec<String>,
}

/// Connected piece of a group of a datum, on the table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DatumReport {
    /// Mesh file.
    pub file: String,
    /// Group of it that the piece is of.
    pub group: String,
    /// Shape that fits its corners.
    pub shape: DatumShapeReport,
    /// Centre of its area, on the axis of a cylinder; in the frame of the table.
    pub place_mm: [f64; 3],
    /// Direction of a plane out of the material, or of a cylinder's axis; `null` of any other
    /// shape.
    pub direction: Option<[f64; 3]>,
    /// Radius of a cylinder; `null` of any other shape.
    pub radius_mm: Option<f64>,
    /// Largest distance of its corners from the shape.
    pub deviation_mm: f64,
    /// Whether the first clamping locates the part by it, too.
    pub in_first: bool,
}

/// Shape of a datum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DatumShapeReport {
    /// A plane.
    Plane,
    /// A cylinder.
    Cylinder,
    /// Any other surface.
    Other,
}

impl DatumReport {
    /// Returns the datum in words.
    #[must_use]
    pub fn in_words(&self) -> String {
        let place = |p: [f64; 3]| format!("({:.3}, {:.3}, {:.3})", p[0], p[1], p[2]);
        let at = place(self.place_mm);
        let direction = self.direction.map(place).unwrap_or_default();
        let shape = match (self.shape, self.radius_mm) {
            (DatumShapeReport::Plane, _) => format!("plane through {at}, facing {direction}"),
            (DatumShapeReport::Cylinder, Some(radius)) => {
                format!("cylinder of radius {radius:.3} mm, axis through {at} along {direction}")
            }
            _ => format!("surface with its middle at {at}"),
        };
        format!("{} of {}: {shape}", self.group, self.file)
    }
}

/// Position of the part in a clamping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlacementReport {
    /// Register of the work offset: its origin is that of the workpiece frame.
    pub work_offset: String,
    /// Pose of the part's frame in the workpiece frame.
    pub work_from_part: PoseReport,
    /// Pose of the workpiece frame on the table.
    pub table_from_work: PoseReport,
    /// Clamping that this one is compared with: the first one; `null` for that itself.
    pub compared_with: Option<String>,
    /// Motion of the part on the table from its position in that clamping to the one in this:
    /// first the turn about the table's origin, then the translation. `null` for the first one.
    pub moved_by: Option<PoseReport>,
}

/// A pose: a turn about an axis through the origin, then a translation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PoseReport {
    /// Translation.
    pub translation_mm: [f64; 3],
    /// Direction of the axis.
    pub rotation_axis: [f64; 3],
    /// Angle, 0 to 180.
    pub rotation_deg: f64,
}

/// Program of one tool in a clamping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ToolProgramReport {
    /// Name of the setup with this tool, as in its report.
    pub setup: String,
    /// Its file, and those of further channels.
    pub programs: Vec<String>,
    /// BLAKE3 checksum of the first of them, 64 hexadecimal digits; `null` if there is none.
    pub blake3: Option<String>,
    /// Line of the joined program with the change to this tool; `null` if that is not written.
    pub line_in_joined: Option<u32>,
    /// File of its report.
    pub report: String,
    /// Number of the tool.
    pub tool_number: u32,
    /// Name of the tool.
    pub tool: String,
    /// Length of the tool from the gauge line to the tip, mm.
    pub gauge_length_mm: f64,
    /// Stock on which it is planned.
    pub planned_on: String,
    /// Machine time, s.
    pub time_s: f64,
    /// Volume that it removes, mm³; `null` if the stock was not cut.
    pub removed_mm3: Option<f64>,
    /// Whether the program was run on the virtual machine.
    pub verified: bool,
    /// Findings that are faults.
    pub faults: usize,
    /// Findings that are none.
    pub other_findings: usize,
    /// Blocks, and those of them that are certified; `null` if certificates were not requested.
    pub certified_blocks: Option<[usize; 2]>,
    /// Share of the CC points that is planned, from 0 to 1.
    pub planned_fraction: f64,
    /// Reasons why the program does less than the job requires, in words.
    pub incomplete_because: Vec<String>,
    /// Its operations, in their order.
    pub operations: Vec<OperationReport>,
}
