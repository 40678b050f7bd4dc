//! Format of the report, `"format": "facemill-report/1"`: the plan and the behaviour of the written
//! program. Deterministic; wall times go to a separate file.

pub mod chips;
pub mod cl_paths;
pub mod cusps;
pub mod deviation;
pub mod efficiency;
pub mod left_above;
pub mod links;
pub mod lost_time;
mod mesh_summary;
pub mod operations;
pub mod outcome;
pub mod pairs;
pub mod remaining;
pub mod rotary_reversals;
pub mod stock;

use std::collections::BTreeMap;

use facemill_cl_data::ErrorBudget;
use facemill_surface_model::{ImportSettings, LengthUnit, RepairReport, UpAxis};
use facemill_tool_path::moves::order::PassOrderReport;
use facemill_virtual_machine::{Assumption, Certificates, Finding, WindUp};
use schemars::JsonSchema;
use serde::Serialize;

use crate::format::job_file::PostureModeFile;
use crate::format::job_settings::JobSetting;
use crate::format::made_from::MadeFrom;
use crate::format::program_stamp::ProgramStamp;
use crate::format::program_times::ProgramTimes;
use crate::format::report::cl_paths::ClPathReport;
use crate::format::report::efficiency::EfficiencyReport;
use crate::format::report::left_above::LeftAboveReport;
use crate::format::report::links::LinksReport;
use crate::format::report::pairs::PairReport;
use crate::format::report::remaining::RemainingReport;
use crate::format::report::stock::PlannedStockReport;

pub use crate::format::report::chips::{ChipsReport, FeedsSetByReport, SpreadReport};
pub use crate::format::report::cusps::{CuspReasonReport, CuspsKeptReport, WidthRoundReport};
pub use crate::format::report::lost_time::{LostTimeCause, LostTimeReport};
pub use crate::format::report::operations::OperationReport;
pub use crate::format::report::rotary_reversals::{RewindReport, RewindsReport, SingularBlocks};

/// Value of the key `format` in a report.
pub const REPORT_FORMAT: &str = "facemill-report/1";

/// Value of the key `format` in a file of certificates.
pub const CERTIFICATES_FORMAT: &str = "facemill-certificates/1";

/// Proofs for each block of a program, as it is written.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CertificatesFile {
    /// Always `"facemill-certificates/1"`.
    pub format: &'static str,
    /// The program described; for a control with two channels, the additional channel programs have
    /// the same motions.
    pub programs: Vec<ProgramStamp>,
    /// Sums, and one certificate for each block.
    #[serde(flatten)]
    pub certificates: Certificates,
}

/// The report of one setup's program.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Report {
    /// Always `"facemill-report/1"`.
    pub format: &'static str,
    /// Name of the job.
    pub job: String,
    /// Name of the setup.
    pub setup: String,
    /// Inputs and version that the program was made from.
    pub made_from: MadeFrom,
    /// Settings that replaced values of the job file (`--set`).
    pub settings: Vec<JobSetting>,
    /// The program described; with channel programs for a control with two channels, these, too.
    pub programs: Vec<ProgramStamp>,
    /// Whether the program was run on the virtual machine after it was written: not with
    /// `--no-verify`; program and APT file then say `NOT VERIFIED`.
    pub verified: bool,
    /// Stock that it cuts (docs/dexel.md), with two heads both at once (docs/dexel.md#two-heads).
    pub stock: PlannedStockReport,
    /// Links between passes, before and after (docs/rapids.md#in-plans).
    pub links: LinksReport,
    /// Order of the passes of each operation, if the setup's `links.order` is `shortest`
    /// (docs/rapids.md#order-of-passes).
    pub orders: Vec<PassOrderReport>,
    /// Proofs of the motion between positions; `null` if not requested.
    pub certified: Option<CertifiedReport>,
    /// Sums over the program.
    pub totals: Totals,
    /// Time that it takes, by its text, as `verify` reports it, too
    /// (docs/formats.md#verification-of-a-program).
    pub times: ProgramTimes,
    /// Each operation's part of that time, in their order in the program, and its removal.
    pub operations: Vec<OperationReport>,
    /// Times of the program within velocity, acceleration and jerk of every axis; `null` if the
    /// machine file lacks a limit.
    pub time_law: Option<TimeLawReport>,
    /// Missing limits. All times are then lower bounds, at constant speeds.
    pub no_time_law: Vec<String>,
    /// Extreme values, each with its place.
    pub worst: Worst,
    /// Material that the written program leaves on the regions of its operations
    /// (docs/method.md#material-left-on-the-surface), even if the program was not run; `null` if
    /// the setup has none.
    pub remaining: Option<RemainingReport>,
    /// Length of each operation's passes over the least that the cusp permits in their postures
    /// (docs/method.md#efficiency).
    pub efficiency: Vec<EfficiencyReport>,
    /// Regions that the job limits to places where stock is left (`left_above`); absent without
    /// any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_above: Vec<LeftAboveReport>,
    /// Deviations of the operations whose path is a CL file from this file; absent without any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cl_paths: Vec<ClPathReport>,
    /// How the postures of each operation were chosen, and the resulting motion of the rotary axes.
    pub postures: Vec<PosturesReport>,
    /// Whether each operation's passes keep the permitted cusp, the measures taken for it, and
    /// reasons if they do not.
    pub cusps: Vec<CuspsKeptReport>,
    /// Chips and removal rates along the passes of each operation.
    pub chips: Vec<ChipsReport>,
    /// Operations that two heads cut at once; empty on a machine with one.
    pub pairs: Vec<PairReport>,
    /// How far each rotary axis without stops winds in the written program; empty if this was not
    /// verified.
    pub wind_up: Vec<WindUp>,
    /// Reversals of limited rotary axes, and the number of changes to the machine's other branch.
    pub rewinds: RewindsReport,
    /// Blocks along passes in which the tool axis is so near to the pole of the rotary axes that
    /// one of them must turn fast.
    pub singular_blocks: Vec<SingularBlocks>,
    /// Causes for which the tip is slower than the programmed feed, if one takes more than a tenth
    /// of an operation's time in passes, and remedies. For programs of one head.
    pub lost_times: Vec<LostTimeReport>,
    /// Error budget of each operation, and the part of it that the written program uses.
    pub budgets: Vec<BudgetReport>,
    /// Faults found in the written program, those with the cut stock among them, in program order.
    pub findings: Vec<Finding>,
    /// Behaviour that the written program leaves to the control, and the values assumed for it
    /// (docs/dialects.md#verified-programs-and-assumptions): a template of one's own may omit more
    /// than the built-in ones. Also that stock given as an allowance is on both sides of surfaces
    /// that are not closed.
    pub assumptions: Vec<Assumption>,
    /// CC points left out, by reason.
    pub infeasible: Vec<InfeasibleReport>,
    /// Reports on the mesh files.
    pub meshes: Vec<MeshReport>,
    /// Each pass, in cutting order.
    pub passes: Vec<PassReport>,
}

/// Proofs of the program's motion at every time.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CertifiedReport {
    /// Blocks with a motion, or with a fault that may hide one.
    pub blocks: usize,
    /// Blocks for which depth and clearances are proven.
    pub certified: usize,
    /// Largest proven depth of the cutter; `null` if a block has none.
    pub largest_depth_mm: Option<f64>,
    /// Blocks that are not certified, as ranges of lines with the same reason.
    pub uncertified: Vec<UncertifiedReport>,
}

/// Consecutive blocks that are not certified for the same reason.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct UncertifiedReport {
    /// First line.
    pub first_line: u32,
    /// Last line.
    pub last_line: u32,
    /// Number of blocks.
    pub blocks: usize,
    /// The reason.
    pub reason: String,
}

impl CertifiedReport {
    /// Returns the sums of certificates.
    pub fn new(certificates: &Certificates) -> Self {
        let mut uncertified: Vec<UncertifiedReport> = Vec::new();
        let mut last = None;
        for (k, c) in certificates.certificates.iter().enumerate().filter(|(_, c)| !c.certified) {
            let reason = c.reason.clone().unwrap_or_default();
            let follows = k.checked_sub(1) == last.replace(k);
            match uncertified.last_mut().filter(|u| follows && u.reason == reason) {
                Some(run) => (run.last_line, run.blocks) = (c.line, run.blocks + 1),
                None => {
                    uncertified.push(UncertifiedReport { first_line: c.line, last_line: c.line, blocks: 1, reason });
                }
            }
        }
        Self {
            blocks: certificates.blocks,
            certified: certificates.certified,
            largest_depth_mm: certificates.largest_depth_mm,
            uncertified,
        }
    }
}

/// Sums over the program.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct Totals {
    /// Passes as cut (a trimmed pass counts once for each of its pieces).
    pub passes: usize,
    /// CC points of the path.
    pub cc_points: usize,
    /// CC points with a pose in the program.
    pub planned_points: usize,
    /// CC points left out.
    pub trimmed_points: usize,
    /// Fraction of the CC points that is planned, 0 to 1.
    pub planned_fraction: f64,
    /// Whether an operation leaves out more than the job allows.
    pub trims_too_much: bool,
    /// Largest fraction of the CC points that the job permits to be left out; of several operations
    /// the smallest.
    pub max_trimmed_fraction: f64,
    /// Points with a strip between them and a pass beside (docs/method.md#passes-beside-a-point)
    /// cut before that stays uncut.
    pub uncut_points: usize,
    /// Pieces of passes dropped because they are shorter than `min_pass_length_mm`.
    pub dropped_pieces: usize,
    /// Blocks halved because the program, as run or as proven, would have cut too deep in them.
    pub mended_blocks: usize,
    /// Blocks with a motion in the program, as a verification counts them.
    pub blocks: usize,
    /// Length of the tip's path at a feed, in passes, entries and exits, as a verification measures
    /// it; for a program that is not run, the sum of its written positions' distances.
    pub cutting_length_mm: f64,
    /// Length of the tip's path in passes alone.
    pub passes_length_mm: f64,
    /// Time in passes at the written feeds, without entries and exits. With `approach_time_s`, by
    /// the text, it is `times.constant_cutting_s`.
    pub passes_time_s: f64,
    /// Time of the passes' path at the programmed feeds, whatever the axes reach; where two heads
    /// cut at once, that of the head with the longer time.
    pub passes_feed_time_s: f64,
    /// Time in passes, by the time law if there is one, over `passes_feed_time_s`: 1 where the tip
    /// keeps its feed. Above 1.1 the axes cost more than a tenth, and `facemill paths --compare`
    /// finds faster directions and mountings; `lost_times` has the causes. `null` without passes.
    pub time_over_feed: Option<f64>,
    /// Time in entries and exits at the written feeds.
    pub approach_time_s: f64,
    /// Time in rapids at the axes' largest velocities, without acceleration, with the moves to the
    /// part and home, as `verify` and `feedrate` count them; if the tip is kept on a line under
    /// RTCP, that of the axis that has to be fastest for it anywhere on the way.
    pub rapid_time_s: f64,
}

/// Times of a motion from rest to rest in which no axis exceeds a limit, with corners blended
/// within the control's tolerance. The motion stops between rapids and cutting moves, and where
/// spindle or coolant change.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct TimeLawReport {
    /// The whole program, without tool change, spindle and coolant.
    pub total_time_s: f64,
    /// Passes, without entries and exits.
    pub passes_time_s: f64,
    /// Entries and exits.
    pub approach_time_s: f64,
    /// Rapids, with the moves to the part and home.
    pub rapid_time_s: f64,
    /// Whether the axes stop at every corner, because the machine's `control_tolerance` is 0.
    pub stops_at_corners: bool,
    /// Blocks whose feed was lowered to one that the axes reach.
    pub lowered_blocks: usize,
    /// Limiting factors of the passes, the largest share of their time first.
    pub held_back_by: Vec<HeldBackReport>,
    /// Effect of rounding tool vectors; absent if the program has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool_vectors: Option<VectorTimeReport>,
}

/// Cost of the decimals of tool vectors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct VectorTimeReport {
    /// Decimals of their components.
    pub decimals: u8,
    /// Largest turn of the tool by the rounding, deg.
    pub turn_deg: f64,
    /// Additional time of feed moves compared with exact vectors, at the requested feeds, s; 0 if
    /// there is none.
    pub added_time_s: f64,
}

/// Constraint that is the active one in some of the blocks.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct HeldBackReport {
    /// `tip feed`, `range of F`, or `velocity`, `acceleration` or `jerk` of an axis.
    pub limit: String,
    /// Share of the cutting time in these blocks.
    pub share: f64,
}

/// Extreme values. `null` if there is none.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct Worst {
    /// Largest depth of the cutter below the part's mesh (or its allowance) in the written program.
    pub gouge_mm: Option<f64>,
    /// Line of the program with that depth.
    pub gouge_line: Option<u32>,
    /// Smallest distance of a non-cutting body from part, check surface, fixture, table or other
    /// head in the written program; stock does not count.
    pub clearance_mm: Option<f64>,
    /// That body and the nearest obstacle.
    pub clearance_between: Option<String>,
    /// Line of the program with that distance.
    pub clearance_line: Option<u32>,
    /// Largest cusp predicted from the outlines of neighbouring passes; `remaining` has the
    /// material that the text leaves.
    pub cusp_mm: Option<f64>,
    /// Whether that cusp, or a strip that stays uncut, exceeds an operation's `cusp_mm`, and the
    /// text is not measured to keep it (`cusps[].kept_by_text`); then `plan` exits with 1.
    pub cusp_exceeded: bool,
    /// Largest height of the material that the first pass of a root leaves in a corner without a
    /// fillet, by the angle between both surfaces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub corner_rest_mm: Option<f64>,
    /// Largest lift of a pose off the facets: excess left on the part.
    pub lift_mm: f64,
    /// Largest distance between neighbouring passes.
    pub step_over_mm: Option<f64>,
    /// Largest deviation of the cutter from the straight path between two blocks, including
    /// rounding of the words.
    pub linearisation_mm: f64,
    /// Whether that deviation exceeds an operation's budget: near a pole, more blocks do not help.
    pub linearisation_exceeded: bool,
    /// Largest chip section across the feed.
    pub chip_area_mm2: Option<f64>,
    /// Largest removal rate at the speed that the tip reaches there.
    pub removal_rate_mm3_min: Option<f64>,
}

/// How postures were chosen, and the resulting motion of the rotary axes.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PosturesReport {
    /// Operation.
    pub operation: String,
    /// Mode of the job; `null` where the axes are those of a CL file.
    pub mode: Option<PostureModeFile>,
    /// Distance of the sequence of postures of the first place of a pattern from the optimum;
    /// `null` in modes that seek none, and for operations in a pair.
    pub optimum: Option<OptimumReport>,
    /// Proven fineness of the searches along the curve; `null` if the job sets no
    /// `certified_u_width`.
    pub search_proof: Option<SearchProofReport>,
    /// Rotary axes in passes, all places of the pattern, at the programmed feed.
    pub rotary: Vec<RotaryReport>,
}

/// Cost of the postures of the first place of the pattern: seconds of cutting, weighted with the
/// square of the cusp against the permitted one, and with the squares of the axes' speeds against
/// speeds that are high for them.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct OptimumReport {
    /// The cheapest of all sequences in the graph of tested postures.
    pub graph_s: f64,
    /// The planned, smoothed sequence, at the same points.
    pub planned_s: f64,
    /// Excess cost of the planned sequence, as a fraction of the graph's; below 0 if smoothing made
    /// it cheaper.
    pub gap: f64,
    /// Steps on which the tool axis turns relative to the surface by more than
    /// `max_turn_deg_per_mm`, or an axis would have to exceed its largest speed at
    /// `cutting_mm_min`.
    pub jumps: usize,
}

/// Proven fineness of the searches along the curve at the path's CC points, in all places of the
/// pattern: no longer feasible stretch was missed.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SearchProofReport {
    /// `certified_u_width` of the job.
    pub asked_u_width: f64,
    /// Largest width that was needed: at no CC point of the path searched along the curve was so
    /// long a feasible stretch missed. Poses inserted between CC points do not count here.
    pub largest_u_width: f64,
    /// CC points that needed more than the requested width, because the proof would have taken too
    /// many tests.
    pub wider_points: usize,
}

/// Motion of a rotary axis along passes, at the programmed feed of the tool tip, regardless of the
/// axis' limits.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RotaryReport {
    /// The axis.
    pub axis: String,
    /// Turning points within passes, without those of less than 0.01 degrees.
    pub reversals: usize,
    /// Largest speed.
    pub largest_velocity_deg_s: f64,
    /// Largest acceleration, each from the positions of three cuts.
    pub largest_acceleration_deg_s2: f64,
    /// Root of the mean square of the acceleration over time.
    pub mean_acceleration_deg_s2: f64,
}

/// Error budget of an operation.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct BudgetReport {
    /// Operation.
    pub operation: String,
    /// Deviation of facets from the true surface, as in the job.
    pub mesh_chord_mm: f64,
    /// Deviation of the straight path between CC points, as in the job.
    pub path_chord_mm: f64,
    /// Deviation of the control's motion between blocks, as in the job.
    pub linearisation_mm: f64,
    /// Control tolerance of the machine: path + cutter radius × orientation.
    pub control_mm: f64,
    /// Tolerance of the cutter's test body, as in the job.
    pub gouge_mm: f64,
    /// Their sum: the largest depth below the true surface that the program may reach.
    pub total_mm: f64,
    /// Part of it that the programmed motion may use against the mesh: all but `mesh_chord_mm` and
    /// `control_mm`. Greater depth is a finding of kind `gouge`.
    pub against_mesh_mm: f64,
    /// Largest depth of the cutter below the part's mesh in the operation's blocks; `null` if it
    /// was nowhere below, or the program was not run.
    pub largest_gouge_mm: Option<f64>,
}

impl BudgetReport {
    /// Returns the report of a budget and of the largest gouge against it.
    pub fn new(operation: &str, budget: &ErrorBudget, largest_gouge_mm: Option<f64>) -> Self {
        Self {
            operation: operation.to_owned(),
            mesh_chord_mm: budget.mesh_chord,
            path_chord_mm: budget.path_chord,
            linearisation_mm: budget.linearisation,
            control_mm: budget.control,
            gouge_mm: budget.gouge_tolerance,
            total_mm: budget.total(),
            against_mesh_mm: budget.simulated(),
            largest_gouge_mm,
        }
    }
}

/// Points left out for one reason.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct InfeasibleReport {
    /// The reason, with the blocking body.
    pub reason: String,
    /// Number of CC points.
    pub points: usize,
    /// The first of them, workpiece frame.
    pub first_place_mm: [f64; 3],
    /// Changes, each alone, that give that point a posture on its search curve: with 95 % of the
    /// change the curve is proven blocked except for feasible stretches shorter than 0.01 of it
    /// (docs/method.md#search).
    pub would_help: Vec<HelpReport>,
}

/// A change of range or tool.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct HelpReport {
    /// The field of job or tool file.
    pub field: &'static str,
    /// Its value with the change; for a radius with the body narrower in proportion, for a
    /// stick-out with the body longer in proportion; for `search.certified_u_width`, the width with
    /// which the search finds what its steps missed.
    pub value: f64,
}

/// Report on a mesh file.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct MeshReport {
    /// The file, as the job names it.
    pub file: String,
    /// Unit assumed for its numbers.
    pub unit: LengthUnit,
    /// Axis assumed to point up.
    pub up_axis: UpAxis,
    /// Whether all its triangles were reversed, as the job says.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub reverse_winding: bool,
    /// Counts of faults and repairs.
    #[schemars(with = "RepairReport")]
    pub repair: BTreeMap<String, serde_json::Value>,
}

impl MeshReport {
    /// Returns the report of a mesh file read with these settings.
    pub fn new(file: &str, taken: ImportSettings, repair: &RepairReport) -> Self {
        let counts = match serde_json::to_value(repair) {
            Ok(serde_json::Value::Object(map)) => map.into_iter().collect(),
            _ => BTreeMap::new(),
        };
        let file = file.to_owned();
        Self { file, unit: taken.unit, up_axis: taken.up_axis, reverse_winding: false, repair: counts }
    }

    /// Returns whether a component of the mesh bounds no volume.
    pub fn is_open(&self) -> bool {
        let count = |key: &str| self.repair.get(key).and_then(serde_json::Value::as_u64);
        count("n_closed") < count("n_components")
    }
}

/// One pass as cut.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PassReport {
    /// Operation.
    pub operation: String,
    /// Place in the pattern, from 0.
    pub copy: u32,
    /// Pass of the path, from 0.
    pub pass: usize,
    /// CC points in this piece.
    pub points: usize,
    /// Length along the CC points.
    pub length_mm: f64,
    /// Smallest and largest tilt.
    pub tilt_deg: [f64; 2],
    /// Smallest and largest rotate (docs/formats.md#climb-and-the-sign-of-rotate).
    pub rotate_deg: [f64; 2],
    /// Largest lift.
    pub lift_mm: f64,
    /// Largest predicted cusp toward a pass beside (docs/method.md#passes-beside-a-point) cut
    /// before; `null` if there is none.
    pub cusp_mm: Option<f64>,
    /// Points with a strip between them and a pass beside cut before that stays uncut.
    pub uncut_points: usize,
    /// Largest distance from a pass beside cut before; `null` if there is none.
    pub step_over_mm: Option<f64>,
    /// Mean and largest chip section across the feed.
    pub chip_area_mm2: Option<[f64; 2]>,
    /// Smallest and largest speed of the tool tip at the written feeds; less than programmed where
    /// an axis cannot follow.
    pub tip_feed_mm_min: Option<[f64; 2]>,
}
