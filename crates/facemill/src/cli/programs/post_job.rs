//! Machine, tools and control of a CL file that is posted, and the part that it is run against.

use std::path::Path;

use facemill::cl_data::CuttingLaw;
use facemill::cl_post::{PostScene, PostTool, Posted, machine_words, post_on};
use facemill::inverse_kinematics::{AxisValues, Machine};
use facemill::job::load::work_offset;
use facemill::job_file::STOCK_TOLERANCE;
use facemill::machines::read_machine;
use facemill::nc_program::dialect::{DialectFile, PostFile, Template};
use facemill::nc_program::{FeedMode, PostSettings, WordMap};
use facemill::tool_model::{ToolAssembly, ToolFile};
use facemill::{
    AD_HOC_GOUGE_LIMIT, AdHocSetup, CutRequest, Failure, Job, Scene, Setup, VerifyRequest, files, read_dialect_file,
    verify_program,
};
use nalgebra::{Isometry3, Point3};

use crate::cli::arguments::ad_hoc_setup::WORK_REGISTER;
use crate::cli::arguments::program::setups_of;
use crate::cli::programs::post_command::PostArguments;
use crate::cli::progress::Progress;

/// Machine, tools and control of a program.
pub(crate) struct PostStage {
    machine: Machine,
    table_from_work: Isometry3<f64>,
    post: PostSettings,
    tools: Vec<StageTool>,
    /// Job with the part; `None` without one.
    job: Option<Job>,
}

/// A tool, its words, and its setup in the job.
struct StageTool {
    tool: ToolAssembly,
    words: WordMap,
    setup: usize,
}

impl PostStage {
    /// Reads the files that the arguments name.
    pub(crate) fn read(arguments: &PostArguments) -> Result<Self, Failure> {
        match (&arguments.job, &arguments.machine) {
            (Some(job), _) => Self::of_job(Job::read(job)?, arguments.setup.as_deref()),
            (None, Some(machine)) => Self::of_files(arguments, machine),
            // clap requires one of them.
            (None, None) => Err(Failure::input(&arguments.cl_file, "needs --machine or --job")),
        }
    }

    fn of_job(job: Job, setup: Option<&str>) -> Result<Self, Failure> {
        let post = post_on(&job.machine, &job.post).map_err(|e| job.wrong(e.to_string()))?;
        let setups = setups_of(&job, setup)?;
        let mut tools = Vec::new();
        let mut table_from_work = Isometry3::identity();
        for index in setups {
            let view = job.for_setup(index);
            let read = Setup::read(&view, index)?;
            let scene = Scene::new(&view, &read, index)?;
            table_from_work = read.table_from_work;
            tools.push(StageTool { tool: view.tool.clone(), words: scene.words.clone(), setup: index });
        }
        Ok(Self { machine: job.machine.clone(), table_from_work, post, tools, job: Some(job) })
    }

    fn of_files(arguments: &PostArguments, machine_path: &Path) -> Result<Self, Failure> {
        let mut heads = read_machine(machine_path)?.heads;
        if heads.len() != 1 {
            return Err(Failure::input(machine_path, "it has several heads; CL files are posted for one"));
        }
        let machine = heads.remove(0);
        let post =
            post_on(&machine, &post_settings(arguments, &machine)?).map_err(|e| Failure::input(machine_path, e))?;
        let register = arguments.work_register.as_deref().unwrap_or(WORK_REGISTER);
        let register = work_offset(register).ok_or_else(|| {
            Failure::input(
                &arguments.cl_file,
                format!("--work-register {register}: must be G54 to G59, or G54.1 P1 to P300"),
            )
        })?;
        let [x, y, z] = arguments.mount.unwrap_or_default();
        let table_from_work = Isometry3::translation(x, y, z);
        let zero = arguments.work_offset.unwrap_or_else(|| program_zero(&machine, &table_from_work));
        let offset = offset_values(&machine, zero);
        let mut tools: Vec<StageTool> = Vec::new();
        for named in &arguments.tool {
            let tool = read_tool(named)?;
            if tools.iter().any(|other| other.tool.number() == tool.number()) {
                let what = format!("--tool {named}: T{} is given twice; give NUMBER=FILE", tool.number());
                return Err(Failure::input(&arguments.cl_file, what));
            }
            let words = machine_words(&machine, &offset, register, tool.gauge_length());
            let words = words.map_err(|e| Failure::input(machine_path, e))?;
            tools.push(StageTool { tool, words, setup: 0 });
        }
        let job = ad_hoc_job(arguments, machine_path, &post, zero)?;
        Ok(Self { machine, table_from_work, post, tools, job })
    }

    /// Returns the view for posting.
    pub(crate) fn scene(&self) -> PostScene<'_> {
        let tools = self.tools.iter().map(|t| PostTool { tool: &t.tool, words: t.words.clone() });
        PostScene {
            machine: &self.machine,
            table_from_work: self.table_from_work,
            tools: tools.collect(),
            post: &self.post,
        }
    }
}

/// Decimals of a program's zero, as a factor: a thousandth of the last decimal of words.
const ZERO_DECIMALS: f64 = 1e6;

/// Returns the machine's X, Y and Z at which words are 0 with the tip at the zero of the CL file
/// and the rotary axes at 0, mm: words are then coordinates of the file while no axis is turned. 0
/// on a machine whose linear axes cannot hold the tip.
fn program_zero(machine: &Machine, table_from_work: &Isometry3<f64>) -> [f64; 3] {
    let axes = machine.axes();
    let zeros = AxisValues::zeros(axes.len());
    let at = machine.with_tip_at(&zeros, &(table_from_work * Point3::origin()), 0.0);
    let of = |letter: &str| {
        let value = machine.axis_index(letter).zip(at.as_ref()).map_or(0.0, |(k, at)| at[k]);
        (value * ZERO_DECIMALS).round() / ZERO_DECIMALS
    };
    ["X", "Y", "Z"].map(of)
}

/// Machine values at the program's zero.
fn offset_values(machine: &Machine, linear: [f64; 3]) -> AxisValues {
    let axes = machine.axes();
    let of = |k: usize| "XYZ".find(axes[k].letter.as_str()).and_then(|at| linear.get(at)).copied().unwrap_or(0.0);
    AxisValues::from_fn(axes.len(), of)
}

/// Settings of the dialect that the options name.
fn post_settings(arguments: &PostArguments, machine: &Machine) -> Result<PostSettings, Failure> {
    let dialect = arguments.dialect.unwrap_or_default();
    let own = arguments.dialect_file.as_deref();
    let rules = match own {
        Some(path) => read_dialect_file(path, dialect, "--dialect")?,
        None => dialect.file(),
    };
    let template = match &arguments.template {
        Some(path) => {
            let text = String::from_utf8(files::read(path)?)
                .map_err(|e| Failure::input(path, format!("not UTF-8 text: {e}")))?;
            Template { name: path.display().to_string(), text }
        }
        None => dialect.template(),
    };
    let defaults = PostFile::default();
    let file = PostFile {
        dialect,
        feed_mode: arguments.feed_mode.unwrap_or_else(|| default_feed_mode(&rules, machine)),
        program_number: arguments.program_number.unwrap_or(defaults.program_number),
        ..defaults
    };
    let named = own.or(arguments.template.as_deref()).unwrap_or(&arguments.cl_file);
    file.settings_of(rules, template).map_err(|e| Failure::input(named, e))
}

/// RTCP where control and machine have it, else per minute, else inverse time.
fn default_feed_mode(rules: &DialectFile, machine: &Machine) -> FeedMode {
    if rules.feeds.rtcp.is_some() && machine.motion_law().cutting != CuttingLaw::AxesLinear {
        FeedMode::Rtcp
    } else if rules.feeds.g94.is_some() {
        FeedMode::G94
    } else {
        FeedMode::G93
    }
}

/// Reads a tool named as a file, or as its number and the file.
fn read_tool(named: &str) -> Result<ToolAssembly, Failure> {
    let (number, path) = split_tool(named);
    let file: ToolFile = facemill::file_format::from_json(&files::read(path)?).map_err(|e| Failure::input(path, e))?;
    let file = match number {
        Some(number) => ToolFile { number, ..file },
        None => file,
    };
    ToolAssembly::new(file).map_err(|e| Failure::input(path, e))
}

fn split_tool(named: &str) -> (Option<u32>, &Path) {
    match named.split_once('=').and_then(|(number, path)| Some((number.trim().parse().ok()?, path))) {
        Some((number, path)) => (Some(number), Path::new(path)),
        None => (None, Path::new(named)),
    }
}

/// Job of the part that the options name; `None` without one.
fn ad_hoc_job(
    arguments: &PostArguments,
    machine: &Path,
    post: &PostSettings,
    work_offset: [f64; 3],
) -> Result<Option<Job>, Failure> {
    let (Some(part), Some(stock), Some(tool)) = (&arguments.part, &arguments.stock, arguments.tool.first()) else {
        return Ok(None);
    };
    let stand = AdHocSetup {
        part: part.clone(),
        fixtures: arguments.fixture.clone(),
        unit: arguments.mesh_unit,
        up_axis: arguments.mesh_up,
        stock: stock.clone(),
        machine: machine.to_owned(),
        tool: split_tool(tool).1.to_owned(),
        length_register: None,
        dialect: post.dialect(),
        dialect_file: arguments.dialect_file.clone(),
        mount: arguments.mount.unwrap_or_default(),
        work_offset,
        register: arguments.work_register.clone().unwrap_or_else(|| WORK_REGISTER.to_owned()),
    };
    Job::of_ad_hoc_setup(&stand).map(Some)
}

/// Runs a posted program against the part, if there is one: the part of each tool on the stock that
/// those before it leave, if stock is cut.
pub(crate) fn verify_posted(arguments: &PostArguments, stage: &PostStage, posted: &mut Posted) -> Result<(), Failure> {
    let Some(job) = &stage.job else {
        let needing =
            [("--certificates", arguments.certificates), ("--stock-cell-mm", arguments.stock_cell_mm.is_some())];
        return match needing.into_iter().find(|(_, is_given)| *is_given) {
            Some((option, _)) => Err(Failure::input(&arguments.cl_file, format!("{option} needs --job or --part"))),
            None => Ok(()),
        };
    };
    let n_parts = posted.report.tools.len();
    let mut rest = None;
    for k in 0..n_parts {
        let number = posted.report.tools[k].number;
        let Some(tool) = stage.tools.iter().find(|t| t.tool.number() == number) else { continue };
        let mut job = job.for_setup(tool.setup);
        job.tool = tool.tool.clone();
        let cut = arguments
            .stock_cell_mm
            .map(|cell| CutRequest { rest: rest.take(), ..CutRequest::on_lines(cell, STOCK_TOLERANCE) });
        let request = VerifyRequest {
            setup: tool.setup,
            section: (n_parts > 1).then_some(k),
            gouge_limit: arguments.part.as_ref().map(|_| AD_HOC_GOUGE_LIMIT),
            certificates: arguments.certificates,
            time_law: true,
            cut,
            ..VerifyRequest::new(&arguments.out, stage.post.dialect())
        };
        let mut verified = verify_program(&job, posted.text.as_bytes(), &request, &Progress::new(false))?;
        verified.complete([]);
        rest = verified.rest;
        posted.report.verifications.push(verified.file);
    }
    posted.report.checked_against_part = true;
    posted.take_proof();
    Ok(())
}
