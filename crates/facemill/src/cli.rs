//! Command line.

pub(crate) mod arguments;
mod batch_command;
mod chip_area_command;
mod deviation_command;
mod equipment;
mod new_command;
pub(crate) mod output;
mod page_commands;
mod paths_command;
mod plan_command;
mod programs;
mod progress;
mod verify_command;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use batch_command::BatchArguments;
use chip_area_command::ChipAreaArguments;
use clap::{CommandFactory, Parser, Subcommand, ValueEnum};
use equipment::machine_commands::MachineCommand;
use equipment::tool_commands::ToolCommand;
use new_command::NewArguments;
use page_commands::{ReportArguments, ViewArguments};
use paths_command::PathsArguments;
use plan_command::PlanArguments;
use programs::feedrate_command::{self, FeedrateArguments};
use programs::lengths_command::{self, LengthsArguments};
use programs::post_command::{self, PostArguments};
use programs::rapids_command::{self, RapidsArguments};
use progress::Progress;
use verify_command::VerifyArguments;

use crate::cli::output::{default_out, say};
use facemill::formats::VerificationFile;
use facemill::job_file::JobFile;
use facemill::report::{CertificatesFile, Report};
use facemill::solution_space_file::SolutionSpaceFile;
use facemill::{Failure, Job, JobSetting, SolutionSpaceRequest, files};

/// Plans five-axis face milling of sculptured surfaces: mesh and path in, machine NC out.
#[derive(Parser)]
#[command(name = "facemill", version, about, max_term_width = 100)]
pub(crate) struct Arguments {
    /// Permit a job to name files in this folder, too, besides its own; can be given several times
    #[arg(long, global = true, value_name = "DIR")]
    allow: Vec<PathBuf>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Plans a job and writes program, APT file, report and pictures
    #[command(after_help = crate::cli::plan_command::EXIT_CODES)]
    Plan(PlanArguments),
    /// Runs many jobs, or many variants of one, each in a process of its own; resumes where it was
    /// killed
    Batch(Box<BatchArguments>),
    /// Lays a job's passes as path files and pictures, or compares strategies by their plans
    #[command(after_help = crate::cli::paths_command::EXIT_CODES)]
    Paths(Box<PathsArguments>),
    /// Reads a job and all files that it names, and reports faults or a description
    Check {
        /// Job file, or a folder with job.json
        job: PathBuf,
        /// Replace a value of the job file, as `plan` does
        #[arg(long = "set", value_name = "KEY=VALUE")]
        settings: Vec<JobSetting>,
    },
    /// Maps tilt and rotate at one CC point: proven feasible, or proven blocked and by what
    SolutionSpace {
        /// Job file, or a folder with job.json
        job: PathBuf,
        /// Name of the operation, or its number from 1
        #[arg(long, value_name = "OPERATION")]
        operation: String,
        /// Pass, from 1 as in the program's comments
        #[arg(long, value_name = "I", allow_negative_numbers = true)]
        pass: usize,
        /// CC point of the pass, from 1
        #[arg(long, value_name = "K", allow_negative_numbers = true)]
        point: usize,
        /// Finest cells, 0.05 to 10
        #[arg(long, value_name = "DEG", default_value_t = 0.25, allow_negative_numbers = true, value_parser = resolution)]
        resolution_deg: f64,
        /// Output folder; default: out/<name of the job's folder>
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Posts a CL file (APT) to a program of any machine and control, and reads it back
    #[command(after_help = crate::cli::programs::post_command::EXIT_CODES)]
    Post(Box<PostArguments>),
    /// Gives an existing program new feeds: its tip moves at the programmed speed. Only F words
    /// change
    Feedrate(FeedrateArguments),
    /// Runs a program from any source on the virtual machine in a job's setup, and reports faults
    Verify(Box<VerifyArguments>),
    /// Writes a page (HTML) that shows a program from any source on the machine, with its faults
    View(Box<ViewArguments>),
    /// Writes the pages (HTML) of a plan again, from the files of its folder; exit code 1 if one
    /// of them says REJECTED
    Report(ReportArguments),
    /// Gives an existing program faster links: each the fastest path that is free of stock, part,
    /// fixtures and machine
    Rapids(RapidsArguments),
    /// Finds the shortest lengths of the tool assembly for an existing program, and the block that
    /// forces each
    Lengths(LengthsArguments),
    /// Computes the section area of the chip of a pass: one case, or a table of them
    ChipArea(ChipAreaArguments),
    /// Writes an example: a complete job folder
    New(NewArguments),
    /// Checks machine files, and converts them from other formats
    Machine {
        #[command(subcommand)]
        what: MachineCommand,
    },
    /// Reads tool libraries of Fusion, lists, shows and draws tools, and writes tool tables of
    /// controls
    Tool {
        #[command(subcommand)]
        what: ToolCommand,
    },
    /// Prints the JSON Schema of a file format
    Schema {
        /// Format
        format: Format,
    },
    /// Prints a completion script
    Completions {
        /// Shell
        shell: clap_complete::Shell,
    },
}

#[derive(Clone, Copy, ValueEnum)]
enum Format {
    Job,
    Tool,
    Machine,
    Path,
    Paths,
    Strategies,
    Batch,
    BatchReport,
    BatchTasks,
    Dialect,
    Report,
    Certificates,
    SolutionSpace,
    Verification,
    Holders,
    Lengths,
    Rapids,
    Summary,
    JobReport,
    Propeller,
    Post,
}

/// Runs the command of the arguments.
///
/// # Errors
/// If it cannot be done; a result with findings has exit code 1 and is no error.
pub(crate) fn run(arguments: Arguments) -> Result<ExitCode, Failure> {
    let allowed = match &arguments.command {
        Command::Batch(batch) => batch.allowed(&arguments.allow),
        _ => arguments.allow.clone(),
    };
    files::confine_jobs(allowed);
    match arguments.command {
        Command::Batch(batch) => batch_command::run(&batch, &arguments.allow),
        Command::Plan(arguments) => plan_command::run(&arguments),
        Command::Paths(arguments) => paths_command::run(&arguments),
        Command::Check { job, settings } => check(&job, &settings),
        Command::SolutionSpace { job, operation, pass, point, resolution_deg, out } => {
            solution_space(&job, &SolutionSpaceRequest { operation, pass, point, resolution_deg }, out)
        }
        Command::Post(arguments) => post_command::run(&arguments),
        Command::Feedrate(arguments) => feedrate_command::run(&arguments),
        Command::Verify(arguments) => verify_command::run(&arguments),
        Command::View(arguments) => page_commands::view(&arguments),
        Command::Report(arguments) => page_commands::report(&arguments),
        Command::Rapids(arguments) => rapids_command::run(&arguments),
        Command::Lengths(arguments) => lengths_command::run(&arguments),
        Command::ChipArea(arguments) => chip_area_command::run(&arguments),
        Command::New(arguments) => new_command::run(arguments),
        Command::Machine { what } => equipment::machine_commands::run(what),
        Command::Tool { what } => equipment::tool_commands::run(what),
        Command::Schema { format } => {
            say(&schema(format))?;
            Ok(ExitCode::SUCCESS)
        }
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Arguments::command(), "facemill", &mut script);
            say(&String::from_utf8_lossy(&script))?;
            Ok(ExitCode::SUCCESS)
        }
    }
}

/// Returns a resolution of the map, deg.
fn resolution(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|e| format!("{e}"))?;
    if (0.05..=10.0).contains(&value) { Ok(value) } else { Err("must be from 0.05 to 10".to_owned()) }
}

fn solution_space(path: &Path, request: &SolutionSpaceRequest, out: Option<PathBuf>) -> Result<ExitCode, Failure> {
    crate::cli::progress::watch_interrupts().map_err(Failure::Internal)?;
    let job = Job::read(path)?;
    let space = facemill::solution_space(&job, request, &Progress::new(false))?;
    let out = out.unwrap_or_else(|| default_out(path));
    let json = facemill::file_format::to_json(&space.file).into_bytes();
    let all = [("solution-space.svg".to_owned(), space.svg.into_bytes()), ("solution-space.json".to_owned(), json)];
    if !crate::cli::progress::start_writing() {
        return Err(Failure::Interrupted);
    }
    files::write_all(&out, &all)?;
    let (file, percent) = (&space.file, |share: f64| 100.0 * share);
    let found = file.found.map_or("the search finds no posture".to_owned(), |p| {
        format!("the search finds tilt {:.3} deg, rotate {:.3} deg", p.tilt_deg, p.rotate_deg)
    });
    say(&format!(
        "operation \"{}\", pass {}, point {}: {:.1} % proven feasible, {:.1} % proven blocked, {:.1} % uncertain; {found}\n  \
         {} cells, {} postures tested; written to {}: solution-space.svg, solution-space.json\n",
        file.operation,
        file.pass,
        file.point,
        percent(file.area.free),
        percent(file.area.blocked),
        percent(file.area.uncertain),
        file.cells.len(),
        file.pose_tests,
        out.display()
    ))?;
    Ok(ExitCode::SUCCESS)
}

fn check(job_path: &Path, settings: &[JobSetting]) -> Result<ExitCode, Failure> {
    let job = Job::read_with(job_path, settings)?;
    say(&format!(
        "{}: job \"{}\" with {} operation(s)\n",
        job.path.display(),
        job.file.name,
        job.file.operations.len()
    ))?;
    for line in facemill::describe_job(&job)? {
        say(&format!("  {line}\n"))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn schema(format: Format) -> String {
    match format {
        Format::Job => facemill::file_format::schema::<JobFile>(),
        Format::Tool => facemill::file_format::schema::<facemill::tool_model::ToolFile>(),
        Format::Machine => facemill::inverse_kinematics::machine_file::machine_schema(),
        Format::Path => facemill::file_format::schema::<facemill::cc_path::files::PathFile>(),
        Format::Paths => facemill::file_format::schema::<facemill::formats::PathsFile>(),
        Format::Strategies => facemill::file_format::schema::<facemill::formats::StrategiesFile>(),
        Format::Batch => facemill::file_format::schema::<facemill::batch::format::batch_file::BatchFile>(),
        Format::BatchReport => facemill::file_format::schema::<facemill::batch::format::report_file::BatchReport>(),
        Format::BatchTasks => facemill::file_format::schema::<facemill::batch::format::task_file::TasksFile>(),
        Format::Dialect => facemill::file_format::schema::<facemill::nc_program::dialect::DialectFile>(),
        Format::Report => facemill::file_format::schema::<Report>(),
        Format::Certificates => facemill::file_format::schema::<CertificatesFile>(),
        Format::SolutionSpace => facemill::file_format::schema::<SolutionSpaceFile>(),
        Format::Verification => facemill::file_format::schema::<VerificationFile>(),
        Format::Holders => facemill::file_format::schema::<facemill::tool_model::HoldersFile>(),
        Format::Lengths => facemill::file_format::schema::<facemill::lengths::LengthsFile>(),
        Format::Summary => facemill::file_format::schema::<facemill::formats::SummaryFile>(),
        Format::JobReport => facemill::file_format::schema::<facemill::formats::JobReport>(),
        Format::Propeller => facemill::file_format::schema::<facemill::propeller_file::PropellerJson>(),
        Format::Post => facemill::file_format::schema::<facemill::cl_post::PostReport>(),
        Format::Rapids => facemill::file_format::schema::<facemill::rapids::RapidsFile>(),
    }
}
