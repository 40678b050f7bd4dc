//! Format of the report on a job with several programs, `"format": "facemill-job-report/1"`: all of
//! its clampings and tools in their order.

use std::fmt::{self, Display, Formatter};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::duration_text::clock;
use crate::format::incomplete::not_met;
use crate::format::job_file::FinishFile;
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
    /// Outcome of the plan: the worst of its programs, where limits of operations that later
    /// programs keep count as kept.
    pub outcome: Outcome,
    /// Reasons why all programs together do less than the job requires, in words.
    #[serde(default)]
    pub incomplete_because: Vec<String>,
    /// Machine time of all programs and their tool changes, s. A person's time is not counted.
    pub total_time_s: f64,
    /// Changes to another tool within clampings: the first tool of each is not counted.
    pub tool_changes: usize,
    /// Time of one (`tool_change_s` of the machine), s; `null` if the machine file does not say it,
    /// and then changes are not in the total.
    pub tool_change_s: Option<f64>,
    /// The clampings, in the order in which they are cut.
    pub clampings: Vec<ClampingReport>,
    /// Operations whose own program does not keep their limits, with the material on their regions
    /// after all programs of the job.
    #[serde(default)]
    pub left_at_end: Vec<LeftAtEnd>,
}

/// Region of an operation whose own program does not keep its limits, after all programs of the job
/// that cut the same stock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LeftAtEnd {
    /// Name of the setup with the operation.
    pub setup: String,
    /// Operation.
    pub operation: String,
    /// Area of the region, mm²; where the region is a line its length, mm. 0 if no sample lies in
    /// it.
    pub region: f64,
    /// Largest height of a finished region, mm, as in `remaining` of the report.
    pub limit_mm: f64,
    /// Limits of the operation.
    pub allowed: FinishFile,
    /// Whether its own program leaves more on it than these permit.
    pub exceeded: bool,
    /// Fraction above the limit after its own program.
    pub above_fraction: f64,
    /// Fraction above the limit after all programs.
    pub above_at_end: f64,
    /// Fraction that neither this program cuts, nor one before or after it.
    pub never_cut_at_end: f64,
    /// Highest place above the limit after all programs; `null` if there is none.
    pub highest_at_end: Option<LeftAtEndPlace>,
    /// Cusps that are predicted to be higher than permitted, and that its own text is not measured
    /// to keep; `null` if there are none.
    pub cusps: Option<CuspsAtEnd>,
    /// Setups whose programs cut deeper on it later.
    pub lowered_by: Vec<String>,
    /// Whether all programs together leave more on it than the operation's limits permit.
    pub exceeded_at_end: bool,
}

/// A place with material left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LeftAtEndPlace {
    /// Its height, mm.
    pub height_mm: f64,
    /// The place, workpiece frame of the setup with the operation, mm.
    pub at_mm: [f64; 3],
}

/// Predicted cusps of an operation after all programs of the job.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CuspsAtEnd {
    /// Points beside which they are predicted.
    pub points: usize,
    /// Whether later programs are measured to keep the cusp beside all of them; of more than 4,000
    /// points, whether they cut all of the region deeper.
    pub kept: bool,
    /// Largest cusp permitted, mm.
    pub limit_mm: f64,
    /// Highest of the places beside them after all programs, or of all of the region where a point
    /// has no place; `null` of more than 4,000 points, and where places do not show all.
    pub highest_at_end: Option<LeftAtEndPlace>,
}

impl CuspsAtEnd {
    /// Describes it in words.
    #[must_use]
    pub fn in_words(&self) -> String {
        let Self { points, kept, limit_mm, highest_at_end } = self;
        let state = if *kept { "within" } else { "not known to be within" };
        let highest = highest_at_end
            .map_or_else(String::new, |highest| format!(", the highest place measured for them {highest}"));
        format!("predicted cusps at {points} points are {state} {limit_mm:.3} mm after all programs{highest}")
    }
}

impl Display for LeftAtEndPlace {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.at_mm;
        write!(f, "{:.3} mm at ({x:.1}, {y:.1}, {z:.1})", self.height_mm)
    }
}

impl LeftAtEnd {
    /// Returns whether the operation's limits are kept after all programs.
    #[must_use]
    pub fn is_kept(&self) -> bool {
        !self.exceeded_at_end && self.cusps.is_none_or(|cusps| cusps.kept)
    }

    /// Describes it in words.
    #[must_use]
    pub fn in_words(&self) -> String {
        let Self { setup, operation, limit_mm, allowed, .. } = self;
        let percent = |share: f64| 100.0 * share;
        let by = match self.lowered_by.as_slice() {
            [] => "no later program cuts deeper on it".to_owned(),
            setups => format!("cut deeper by {}", setups.join(", ")),
        };
        let mut parts = Vec::new();
        if self.exceeded {
            let highest = self.highest_at_end.map_or_else(String::new, |highest| format!(", up to {highest}"));
            parts.push(format!(
                "{:.2} % above {limit_mm:.3} mm after its own program, {:.2} % after all (allowed {:.2} %){highest}; {:.2} % never cut \
                 (allowed {:.2} %)",
                percent(self.above_fraction),
                percent(self.above_at_end),
                percent(allowed.max_above_fraction),
                percent(self.never_cut_at_end),
                percent(allowed.max_never_cut_fraction)
            ));
        }
        parts.extend(self.cusps.map(|cusps| cusps.in_words()));
        format!("{setup}, operation \"{operation}\": {}; {by}", parts.join("; "))
    }
}

impl JobReport {
    /// Returns the lines of the summary.
    #[must_use]
    pub fn summary_lines(&self) -> Vec<String> {
        let mut lines = vec![self.time_line()];
        if !self.left_at_end.is_empty() {
            lines.push("  left at the end, of operations whose own programs leave more than their limits:".to_owned());
            lines.extend(self.left_at_end.iter().map(|left| format!("    {}", left.in_words())));
        }
        if self.outcome == Outcome::Incomplete {
            lines.extend(not_met(self.incomplete_because.iter().cloned()));
        }
        lines
    }

    fn time_line(&self) -> String {
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

/// Tool of the second head of a machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SecondToolReport {
    /// Number of the tool.
    pub number: u32,
    /// Name of the tool.
    pub name: String,
    /// Length of the tool from the gauge line to the tip, mm.
    pub gauge_length_mm: f64,
}

impl SecondToolReport {
    /// Returns the tool in words.
    #[must_use]
    pub fn in_words(&self) -> String {
        format!("T{} {} of {:.3} mm", self.number, self.name, self.gauge_length_mm)
    }
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
    /// Tool of the second head; absent on a machine with one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_tool: Option<SecondToolReport>,
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
