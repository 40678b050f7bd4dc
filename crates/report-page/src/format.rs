//! Data document of a page, `"format": "facemill-page/1"` (docs/report-page.md#data).

use std::collections::BTreeMap;

use facemill_inverse_kinematics::machine_file::{DhRow, MachineFile};
use facemill_job::format::job_file::{OperationFile, SetupFile};
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::format::solution_space_file::PostureMap;
use facemill_tool_model::ToolFile;
use serde::Serialize;
use serde_json::Value;

use crate::packed::{ByteArray, NumberArray};

/// Value of the key `format`.
pub const PAGE_FORMAT: &str = "facemill-page/1";

/// All that a page shows, but for the arrays.
#[derive(Clone, Debug, Serialize)]
pub struct PageDocument {
    /// Always `"facemill-page/1"`.
    pub format: &'static str,
    /// Version of facemill that wrote the page.
    pub facemill: &'static str,
    /// Name of the job.
    pub job: String,
    /// Verdict on the program.
    pub verdict: Verdict,
    /// The report of the plan or the verification, as its file says it.
    ///
    /// Of a verification with certificates, their list is left out: `certified` has their sums and
    /// the blocks that are not certified, as in a report.
    pub result: Value,
    /// Whether each finding of `result` is a fault.
    pub finding_faults: Vec<bool>,
    /// The program that is played.
    pub program: ProgramData,
    /// The machine.
    pub machine: MachineData,
    /// The setup.
    pub setup: SetupData,
    /// Texts of the lines that findings, assumptions and the first motion name, by line from 1.
    pub line_texts: BTreeMap<u32, String>,
    /// Settings of the control that the program relies on, besides the work offset.
    pub control_settings: Vec<ControlSetting>,
    /// Tool of each head.
    pub tools: Vec<ToolData>,
    /// Times of each part of the program that cuts an operation, as far as comments tell.
    pub operation_times: Vec<OperationTimes>,
    /// End of the first motion; `null` without any.
    pub first_motion: Option<FirstMotion>,
    /// Surfaces in the workpiece frame.
    pub meshes: Vec<MeshData>,
    /// Motions of the program.
    pub motion: MotionData,
    /// The stock; `null` with a reason in `not_shown`.
    pub stock: Option<StockData>,
    /// Deviation of the part from the cut stock; `null` without stock.
    pub deviation: Option<DeviationData>,
    /// Maps of feasible postures along the passes; `null` without them.
    pub postures: Option<PosturesData>,
    /// Pictures of the plan, such as the map of feasible postures: SVG text.
    pub pictures: Vec<PictureData>,
    /// Items shown with less detail than they have.
    pub thinned: Vec<String>,
    /// Items that are not shown, with reasons.
    pub not_shown: Vec<String>,
}

/// Verdict on a program.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// `good`, `partly_tested`, `incomplete`, `not_verified` or `faulty`.
    pub state: VerdictState,
    /// Its words for a person.
    pub stamp: &'static str,
    /// Reasons, one sentence each.
    pub because: Vec<String>,
    /// Facts that a person should know besides, such as `3 near misses`.
    pub notes: Vec<String>,
}

/// State of a program, the worst last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum VerdictState {
    /// Run on the virtual machine without a fault.
    Good,
    /// Run without a fault, but a test was not made, or a block not proven.
    PartlyTested,
    /// Without a fault, but the job is not met.
    Incomplete,
    /// Not run on the virtual machine.
    NotVerified,
    /// With faults: must not be run.
    Faulty,
}

impl VerdictState {
    /// Returns its words for a person.
    #[must_use]
    pub fn stamp(self) -> &'static str {
        match self {
            Self::Good => "VERIFIED: NO FAULT FOUND",
            Self::PartlyTested => "NO FAULT FOUND, BUT NOT ALL IS TESTED",
            Self::Incomplete => "NO FAULT, BUT THE JOB IS NOT MET",
            Self::NotVerified => "NOT VERIFIED",
            Self::Faulty => "REJECTED: DO NOT RUN",
        }
    }
}

/// The program that is played.
#[derive(Clone, Debug, Serialize)]
pub struct ProgramData {
    /// Name and checksum.
    #[serde(flatten)]
    pub stamp: ProgramStamp,
    /// Control that it is read for.
    pub dialect: String,
    /// Its bytes.
    pub text: ByteArray,
    /// Lines.
    pub lines: usize,
    /// Parts of the program that cut an operation, as far as its comments say so.
    pub operations: Vec<OperationLines>,
    /// First lines of passes with their numbers, from 1, as far as comments say so.
    pub passes: Vec<PassLine>,
    /// Places of its lines in the written files, in order of lines; empty where the text is a file
    /// as it is.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub written: Vec<WrittenLines>,
}

/// Run of lines that follow each other in one written file of a program whose calls were expanded.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct WrittenLines {
    /// First line in the text that runs, from 1.
    pub first_line: u32,
    /// File that has them.
    pub file: String,
    /// First line in the file, from 1.
    pub line: u32,
}

/// Part of a program that cuts an operation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OperationLines {
    /// Name of the operation.
    pub operation: String,
    /// First line, from 1.
    pub first_line: u32,
}

/// Begin of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct PassLine {
    /// Line of its comment, from 1.
    pub line: u32,
    /// Pass, from 1.
    pub pass: u32,
    /// Place of the pattern, from 1.
    pub place: u32,
}

/// The machine.
#[derive(Clone, Debug, Serialize)]
pub struct MachineData {
    /// Its name.
    pub name: String,
    /// Axes in the order of values.
    pub axes: Vec<AxisData>,
    /// Transforms from the bed to the table.
    pub workpiece_rows: Vec<DhRow>,
    /// Transforms from the bed to the spindle nose of each head.
    pub tool_rows: Vec<Vec<DhRow>>,
    /// Bodies.
    pub bodies: Vec<BodyData>,
    /// Values of its file that are typical and not the machine's.
    pub assumed: Vec<String>,
}

impl MachineData {
    /// Returns the transforms of a machine file.
    pub(crate) fn rows(file: &MachineFile) -> (Vec<DhRow>, Vec<Vec<DhRow>>) {
        let bare = |rows: &[DhRow]| rows.iter().map(|r| DhRow { bodies: Vec::new(), ..r.clone() }).collect();
        (bare(&file.workpiece_chain.rows), file.tool_chains.iter().map(|c| bare(&c.rows)).collect())
    }
}

/// An axis. Values are mm and s, or rad and s.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisData {
    /// Its address.
    pub letter: String,
    /// Whether it turns.
    pub is_rotary: bool,
    /// Limits; `null` of an axis without stops.
    pub limits: [Option<f64>; 2],
    /// Home position.
    pub home: f64,
    /// Largest speed.
    pub max_velocity: f64,
    /// Largest acceleration, if the machine file has one.
    pub max_acceleration: Option<f64>,
    /// Least and greatest value at ends of blocks, from the first block of the program that names
    /// a position to the last; `null` without motion.
    pub travel: Option<[f64; 2]>,
}

/// A body of the machine, without its clearance.
#[derive(Clone, Debug, Serialize)]
pub struct BodyData {
    /// Its name.
    pub name: String,
    /// Chain that carries it: `bed`, `table`, `head` or `other_head`.
    pub carrier: &'static str,
    /// Row of the chain that it moves with, from 0.
    pub row: usize,
    /// Pose in the row's frame.
    pub pose: Matrix,
    /// Shape.
    pub shape: ShapeData,
    /// Distance that everything keeps from it, mm.
    pub clearance: f64,
}

/// Rows of the upper 3 × 4 part of a transform, one after the other, mm.
pub type Matrix = [f64; 12];

/// A shape in its own frame, mm.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ShapeData {
    /// Frustum about z: lower and upper end, radii there.
    Frustum([f64; 4]),
    /// Box about the origin: half of its edges.
    Box([f64; 3]),
    /// Vertices and triangles of a hull.
    Hull {
        /// Coordinates.
        vertices: Vec<[f64; 3]>,
        /// Corners.
        triangles: Vec<[u32; 3]>,
    },
}

/// The setup.
#[derive(Clone, Debug, Serialize)]
pub struct SetupData {
    /// Its content in the job file.
    pub file: SetupFile,
    /// Number in the job, from 1, and number of setups.
    pub number: [usize; 2],
    /// Its operations.
    pub operations: Vec<OperationFile>,
    /// Pose of the workpiece frame on the table.
    pub table_from_work: Matrix,
    /// Frame of X, Y and Z words under RTCP on the table; `null` if the machine has none.
    pub table_from_words: Option<Matrix>,
    /// Work offset of the control.
    pub work_offset: WorkOffsetData,
    /// Box around the part, workpiece frame: low and high corner.
    pub part_box: Option<[[f64; 3]; 2]>,
    /// Box around the stock, workpiece frame.
    pub stock_box: Option<[[f64; 3]; 2]>,
    /// Outlines for the drawing of the setup, table frame.
    pub outlines: Vec<OutlineData>,
}

/// Work offset of a setup.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorkOffsetData {
    /// Register as the control names it.
    pub register: String,
    /// Place on the table where X, Y and Z words are 0, mm; `null` of machines without X, Y and Z
    /// at right angles and of those with two heads.
    pub program_zero: Option<[f64; 3]>,
    /// Whether the frame of the words is the workpiece frame.
    pub is_same_frame: bool,
    /// Each axis of the machine.
    pub axes: Vec<OffsetAxis>,
}

/// Value of an axis in a work offset.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OffsetAxis {
    /// Its address.
    pub letter: String,
    /// Value in the register, mm or rad.
    pub value: f64,
    /// Value of its scale when the gauge line of the spindle is at the origin of the workpiece
    /// frame, the rotary axes at their offsets, mm or rad; `null` where `program_zero` is.
    pub reading_at_datum: Option<f64>,
    /// Change of this value for each mm of a probe in the spindle.
    pub probe_lengths: f64,
}

/// Outline of something on the table: hulls of its projections.
#[derive(Clone, Debug, Serialize)]
pub struct OutlineData {
    /// Its name.
    pub name: String,
    /// `table`, `part`, `check`, `fixture` or `stock`.
    pub role: &'static str,
    /// From above: x and y.
    pub top: Vec<[f64; 2]>,
    /// From the front: x and z.
    pub front: Vec<[f64; 2]>,
}

/// Something that a control must be set to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ControlSetting {
    /// Name of the setting.
    pub name: &'static str,
    /// To what, and who sets or checks it.
    pub value: String,
}

/// Times of a part of a program.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OperationTimes {
    /// Name of the operation; empty before the first.
    pub operation: String,
    /// Time at a feed, s.
    pub cut: f64,
    /// Time at rapid rate, s.
    pub rapid: f64,
}

/// End of the first motion of a program.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FirstMotion {
    /// Line of the program, from 1.
    pub line: u32,
    /// Values of the axes, mm or rad.
    pub position: Vec<f64>,
    /// Whether each axis moves.
    pub moves: Vec<bool>,
}

/// A tool.
#[derive(Clone, Debug, Serialize)]
pub struct ToolData {
    /// Its file.
    #[serde(flatten)]
    pub file: ToolFile,
    /// Place of its length in the control.
    pub length_place: String,
    /// Time at a feed and at rapid rate while it is in the spindle, s.
    pub times: [f64; 2],
}

/// A surface in the workpiece frame.
#[derive(Clone, Debug, Serialize)]
pub struct MeshData {
    /// Its name.
    pub name: String,
    /// `part`, `check`, `fixture` or `stock`.
    pub role: &'static str,
    /// x, y and z of its vertices, mm.
    pub positions: [NumberArray; 3],
    /// x, y and z of unit normals.
    pub normals: [NumberArray; 3],
    /// Corners of its triangles.
    pub triangles: NumberArray,
}

/// Motions of the program, one for each straight motion of the axes. All arrays but `path` have one
/// value for each.
#[derive(Clone, Debug, Serialize)]
pub struct MotionData {
    /// Number of motions.
    pub n: usize,
    /// Values of the axes at the start, mm or rad.
    pub start: Vec<f64>,
    /// Values of each axis at the ends of motions: mm, or degrees of a rotary axis.
    pub ends: Vec<NumberArray>,
    /// Lines of the program, from 1.
    pub lines: NumberArray,
    /// Kinds: 0 rapid, 1 cut, 2 other.
    pub kinds: NumberArray,
    /// Laws: 0 axes in proportion, 1 each axis at its largest speed, 2 tip straight and rotary axes
    /// in proportion, 3 tip straight and tool axis turned evenly.
    pub laws: NumberArray,
    /// Whether words are the tip's (RTCP), 0 or 1.
    pub rtcp: NumberArray,
    /// Times, s.
    pub times: NumberArray,
    /// Whether times are within velocity, acceleration and jerk of every axis.
    pub by_law: bool,
    /// Number of motions of which no time is known; `times` has 0.1 s for each of them.
    pub n_untimed: usize,
    /// Whether a motion is one of these, 0 or 1; `null` without any.
    pub untimed: Option<NumberArray>,
    /// Whether its block is not certified, 0 or 1, or 2 of a block that has no certificate, as one
    /// from where the program has named no position; `null` without certificates.
    pub uncertified: Option<NumberArray>,
    /// F in force, mm/min; not known in rapids and in inverse time.
    pub feeds: Option<NumberArray>,
    /// F in inverse time (G93), 1/min; `null` of a program without.
    pub inverse_feeds: Option<NumberArray>,
    /// Figures of each motion for colours, plots and the readout.
    pub figures: Vec<FigureData>,
    /// Limiting factor of each motion by the law of motion: 0 none, else its place in
    /// `limit_names` from 1.
    pub limits: NumberArray,
    /// Names of limiting factors.
    pub limit_names: Vec<String>,
    /// Path of each head's tip, workpiece frame.
    pub paths: Vec<PathData>,
    /// Line of the first motion of unknown path, with its reason.
    pub not_followed: Option<String>,
}

/// A figure of each motion.
#[derive(Clone, Debug, Serialize)]
pub struct FigureData {
    /// Key.
    pub key: &'static str,
    /// Name for a person.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Whether small values are the critical ones.
    pub low_is_critical: bool,
    /// Explanation.
    pub note: String,
    /// Values.
    pub values: NumberArray,
}

/// Path of a tip.
#[derive(Clone, Debug, Serialize)]
pub struct PathData {
    /// x, y and z of its points, mm.
    pub points: [NumberArray; 3],
    /// Index of the motion that leads to each point.
    pub motions: NumberArray,
}

/// The stock: lines along z of the workpiece frame with the changes of each.
#[derive(Clone, Debug, Serialize)]
pub struct StockData {
    /// x and y of the corner of the first cell, mm.
    pub origin: [f64; 2],
    /// Distance of the lines, mm.
    pub cell: f64,
    /// Numbers of lines along x and y; lines are in rows along x.
    pub n_lines: [usize; 2],
    /// Number of intervals of each line before the program.
    pub first_counts: NumberArray,
    /// Bottoms and tops of these, mm.
    pub first_ends: NumberArray,
    /// Number of motions done at each key.
    pub keys: NumberArray,
    /// Number of changes of each line.
    pub change_counts: NumberArray,
    /// Key of each change.
    pub change_keys: NumberArray,
    /// Number of intervals behind each change.
    pub interval_counts: NumberArray,
    /// Bottoms and tops of these, mm.
    pub ends: NumberArray,
}

/// Deviation of the part's surface from the cut stock.
#[derive(Clone, Debug, Serialize)]
pub struct DeviationData {
    /// Index of the mesh of the part.
    pub mesh: usize,
    /// Deviation at each vertex, mm: material too much is positive.
    pub values: Option<NumberArray>,
    /// Whether the program has cut at each vertex, 0 or 1.
    pub cut: NumberArray,
    /// Deviation of the scale's middle, mm: `permitted`, or 0.1.
    pub tolerance: f64,
    /// Smallest of the deviations that the operations permit, mm; `null` without operations.
    pub permitted: Option<f64>,
    /// Five deepest gouges, then the five highest excesses, where the program has cut, each some
    /// cells from the others.
    pub worst: Vec<WorstPlace>,
    /// Cut area by deviation: from, to (mm), area (mm²); the outer ones hold all that is beyond.
    pub histogram: Vec<[f64; 3]>,
}

/// A place and its deviation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WorstPlace {
    /// Workpiece frame, mm.
    pub at: [f64; 3],
    /// Deviation, mm.
    pub value: f64,
}

/// Maps of feasible postures, each where a pass has the narrowest choice.
#[derive(Clone, Debug, Serialize)]
pub struct PosturesData {
    /// Number of pieces of passes in the program; fewer have maps if there are many.
    pub n_passes: usize,
    /// Curves along which postures are sought: points with tilt and rotate.
    pub curves_deg: Vec<Vec<[f64; 2]>>,
    /// The maps.
    pub maps: Vec<PostureMapData>,
}

/// A map of feasible postures at a point of a pass.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PostureMapData {
    /// Index of the motion that ends there; `null` if none does.
    pub motion: Option<u32>,
    /// The map, as the plan's file has it.
    #[serde(flatten)]
    pub map: PostureMap,
}

/// A picture.
#[derive(Clone, Debug, Serialize)]
pub struct PictureData {
    /// Name of its file.
    pub name: String,
    /// SVG.
    pub svg: ByteArray,
}
