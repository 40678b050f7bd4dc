//! `facemill post`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{ArgGroup, Args};
use facemill::cl_file::{ClUnit, is_cl_file, read_apt_in};
use facemill::cl_post::{MAX_RETRACT, PostFault, PostOptions, Posted, TOLERANCES, post_cl};
use facemill::formats::ProgramStamp;
use facemill::inverse_kinematics::BranchPreference;
use facemill::job_file::{UnitFile, UpAxisFile};
use facemill::nc_program::{Dialect, FeedMode};
use facemill::{AdHocStock, Failure, Stages, files};

use crate::cli::arguments::ad_hoc_setup::{place, stock, unit, up_axis};
use crate::cli::arguments::dialect::dialect;
use crate::cli::arguments::option_lengths::above_zero;
use crate::cli::output::say;
use crate::cli::programs::post_job::{PostStage, verify_posted};
use crate::cli::progress::Progress;

/// Exit codes of the command.
pub(crate) const EXIT_CODES: &str = "\
Exit codes:
  0  the program is written, and is what the CL file says
  1  the program lacks something (cycles, words), is for another cutter than the file's, turns
     rotary axes in a rapid without a lift, differs from the file (it is then written with
     .rejected in its name), or has faults against the part
  2  the CL file or another input is wrong, or the machine cannot follow the file; nothing is written
  3  a file could not be written";

#[derive(Args)]
#[command(group = ArgGroup::new("machine of").args(["job", "machine"]).required(true))]
pub(crate) struct PostArguments {
    /// CL file (APT) of any CAM system
    pub(crate) cl_file: PathBuf,
    /// Unit of a CL file without UNITS: mm, inch, cm; refused if UNITS says another one. Default:
    /// mm, with a note
    #[arg(long, value_name = "UNIT", value_parser = cl_unit)]
    pub(crate) cl_unit: Option<ClUnit>,
    /// Machine file
    #[arg(long, value_name = "FILE", requires_all = ["tool", "dialect"])]
    pub(crate) machine: Option<PathBuf>,
    /// Tool file; of several tools each as NUMBER=FILE, with its number of LOADTL
    #[arg(long, value_name = "FILE|NUMBER=FILE", conflicts_with = "job")]
    pub(crate) tool: Vec<String>,
    /// Control of the program: fanuc, haas, mazak, linuxcnc, siemens_840d, heidenhain
    #[arg(long, value_name = "NAME", value_parser = dialect, conflicts_with = "job")]
    pub(crate) dialect: Option<Dialect>,
    /// Meaning of F: g94 (all axes), g93 (inverse time), rtcp (the tip). Default: rtcp if the
    /// control has it and motion.cutting of the machine file is for it, else g94, else g93
    #[arg(long, value_name = "MODE", value_parser = feed_mode, conflicts_with = "job")]
    pub(crate) feed_mode: Option<FeedMode>,
    /// Dialect file of the control; default: the dialect's own
    #[arg(long, value_name = "FILE", conflicts_with = "job")]
    pub(crate) dialect_file: Option<PathBuf>,
    /// NC template; default: the dialect's own
    #[arg(long, value_name = "FILE", conflicts_with = "job")]
    pub(crate) template: Option<PathBuf>,
    /// Number of the program
    #[arg(long, value_name = "N", conflicts_with = "job")]
    pub(crate) program_number: Option<u32>,
    /// Position of the CL file's frame on the machine's table, mm; default: 0,0,0
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true, conflicts_with = "job")]
    pub(crate) mount: Option<[f64; 3]>,
    /// Machine's X, Y and Z at the program's zero, mm. Default: those at the zero of the CL file
    /// with the rotary axes at 0, so that words are its coordinates while no axis is turned
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true, conflicts_with = "job")]
    pub(crate) work_offset: Option<[f64; 3]>,
    /// Register of the work offset: G54, G54.1 P1 and so on; default: G54
    #[arg(long, value_name = "NAME", conflicts_with = "job")]
    pub(crate) work_register: Option<String>,
    /// Job file, or a folder with job.json, in place of machine, tools and dialect: also their part
    /// and fixtures, against which the program is then run
    #[arg(long, value_name = "FILE")]
    pub(crate) job: Option<PathBuf>,
    /// Setup of the job: its name, or its number in the list of `facemill check`
    #[arg(long, value_name = "SETUP", requires = "job")]
    pub(crate) setup: Option<String>,
    /// Mesh of the part (.obj, .stl, .gltf, .glb, .3mf) in the CL file's frame: the program is run
    /// against it
    #[arg(long, value_name = "MESH", requires_all = ["machine", "stock"])]
    pub(crate) part: Option<PathBuf>,
    /// Material before the program: box (the smallest around the part), offset:MM (a layer on the
    /// part), or a mesh
    #[arg(long, value_name = "MESH|box|offset:MM", value_parser = stock, requires = "part")]
    pub(crate) stock: Option<AdHocStock>,
    /// Mesh that nothing may touch, such as a clamp; several can be given
    #[arg(long, value_name = "MESH", requires = "part")]
    pub(crate) fixture: Vec<PathBuf>,
    /// Unit of all meshes: metre, centimetre, millimetre, inch
    #[arg(long, value_name = "UNIT", value_parser = unit, requires = "part")]
    pub(crate) mesh_unit: Option<UnitFile>,
    /// Up axis of all meshes: x, y, z
    #[arg(long, value_name = "AXIS", value_parser = up_axis, requires = "part")]
    pub(crate) mesh_up: Option<UpAxisFile>,
    /// Prove the motion of every block between its ends, with a part
    #[arg(long)]
    pub(crate) certificates: bool,
    /// Cut the stock on lines so far apart, and test against the stock of every moment
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = above_zero)]
    pub(crate) stock_cell_mm: Option<f64>,
    /// Largest deviation of tip and rim of the cutter from the file's path in cuts
    #[arg(long, value_name = "MM", default_value_t = 0.01, allow_negative_numbers = true, value_parser = tolerance)]
    pub(crate) tolerance_mm: f64,
    /// The same in rapids, or none: each RAPID is then one block, in which the tip leaves its line
    #[arg(long, value_name = "MM|none", default_value = "0.5", allow_negative_numbers = true, value_parser = rapid_tolerance)]
    pub(crate) rapid_tolerance_mm: RapidTolerance,
    /// Lift the tool so far along its axis where rotary axes have to turn anew, and where the file
    /// begins or ends in a cut; default: refused
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = retract)]
    pub(crate) retract_mm: Option<f64>,
    /// Branch of the rotary axes at the first point of each tool: nearest (to home), positive or
    /// negative (side of the rotary axis next to the tool)
    #[arg(long, value_name = "BRANCH", default_value = "nearest", value_parser = branch)]
    pub(crate) branch: BranchPreference,
    /// Keep feeds that the axes do not reach within acceleration and jerk
    #[arg(long)]
    pub(crate) given_feeds: bool,
    /// Post for a tool that is not the cutter of the file, such as a reground one: the difference
    /// of the tool with this number is a note, and not a fault; may be repeated
    #[arg(long, value_name = "NUMBER")]
    pub(crate) other_cutter: Vec<u32>,
    /// Output file for the program; its report (JSON) has the same name with .post.json
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: PathBuf,
}

fn cl_unit(text: &str) -> Result<ClUnit, String> {
    match text {
        "mm" => Ok(ClUnit::Millimetre),
        "inch" => Ok(ClUnit::Inch),
        "cm" => Ok(ClUnit::Centimetre),
        _ => Err("must be mm, inch or cm".to_owned()),
    }
}

fn feed_mode(text: &str) -> Result<FeedMode, String> {
    let known = [FeedMode::G94, FeedMode::G93, FeedMode::Rtcp].into_iter().find(|mode| mode.name() == text);
    known.ok_or_else(|| "must be g94, g93 or rtcp".to_owned())
}

/// Tolerance of rapids, mm; `None`: not kept. A type of its own, because clap takes an `Option` for
/// an option that may be left out.
#[derive(Clone, Copy)]
pub(crate) struct RapidTolerance(Option<f64>);

fn rapid_tolerance(text: &str) -> Result<RapidTolerance, String> {
    if text == "none" {
        return Ok(RapidTolerance(None));
    }
    tolerance(text).map(|mm| RapidTolerance(Some(mm))).map_err(|why| format!("{why}, or none"))
}

fn branch(text: &str) -> Result<BranchPreference, String> {
    match text {
        "nearest" => Ok(BranchPreference::Nearest),
        "positive" => Ok(BranchPreference::Positive),
        "negative" => Ok(BranchPreference::Negative),
        _ => Err("must be nearest, positive or negative".to_owned()),
    }
}

fn tolerance(text: &str) -> Result<f64, String> {
    let tolerance = text.parse().ok().filter(|mm| TOLERANCES.contains(mm));
    tolerance.ok_or_else(|| format!("must be a length from {} to {} mm", TOLERANCES.start(), TOLERANCES.end()))
}

fn retract(text: &str) -> Result<f64, String> {
    let retract = text.parse().ok().filter(|mm: &f64| *mm > 0.0 && *mm <= MAX_RETRACT);
    retract.ok_or_else(|| format!("must be a length above 0, at most {MAX_RETRACT} mm"))
}

pub(crate) fn run(arguments: &PostArguments) -> Result<ExitCode, Failure> {
    crate::cli::progress::watch_interrupts().map_err(Failure::Internal)?;
    let cl_path = &arguments.cl_file;
    let text = files::read(cl_path)?;
    if !is_cl_file(&text) {
        let what = "is no CL file (APT): none of its first lines begins with PARTNO, GOTO, FEDRAT or another such word";
        return Err(Failure::input(cl_path, what));
    }
    let file = read_apt_in(&text, arguments.cl_unit).map_err(|e| Failure::input(cl_path, e))?;
    let stamp = ProgramStamp::new(cl_path, &text);
    drop(text);
    let stage = PostStage::read(arguments)?;
    let report_path = arguments.out.with_extension("post.json");
    files::check_outputs([arguments.out.as_path(), report_path.as_path()])?;
    let options = PostOptions {
        tolerance: arguments.tolerance_mm,
        rapid_tolerance: arguments.rapid_tolerance_mm.0,
        retract: arguments.retract_mm,
        branch: arguments.branch,
        law_feeds: !arguments.given_feeds,
        other_cutters: arguments.other_cutter.clone(),
        ..PostOptions::new(cl_path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned()))
    };
    let monitor = Progress::new(false).start("post the points", file.points.len());
    let posted = post_cl(&file, stamp, &arguments.out, &stage.scene(), &options, &*monitor);
    drop(monitor);
    let mut posted = posted.map_err(|fault| match fault {
        PostFault::Cancelled(_) => Failure::Interrupted,
        fault => Failure::input(cl_path, fault),
    })?;
    drop(file);
    if posted.is_as_meant {
        verify_posted(arguments, &stage, &mut posted)?;
    }
    write(arguments, &report_path, posted)
}

fn write(arguments: &PostArguments, report_path: &Path, mut posted: Posted) -> Result<ExitCode, Failure> {
    let out = &arguments.out;
    let rejected = rejected_name(out);
    let is_clean = posted.report.is_clean();
    let program = if posted.is_as_meant { out } else { &rejected };
    posted.report.program = ProgramStamp::new(program, posted.text.as_bytes());
    if !crate::cli::progress::start_writing() {
        return Err(Failure::Interrupted);
    }
    let summary = posted.report.summary();
    let report = facemill::file_format::to_json(&posted.report).into_bytes();
    files::write_each(&[(program.as_path(), posted.text.into_bytes()), (report_path, report)])?;
    let other = if posted.is_as_meant { &rejected } else { out };
    files::remove_earlier(other)?;
    say(&summary)?;
    say(&format!("  written to        {}, {}\n", program.display(), report_path.display()))?;
    Ok(if is_clean { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// Name of a program that is not what the file says.
fn rejected_name(out: &Path) -> PathBuf {
    let stem = out.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let extension = out.extension().map_or_else(String::new, |end| format!(".{}", end.to_string_lossy()));
    out.with_file_name(format!("{stem}{}{extension}", files::REJECTED))
}
