//! Command line.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand, ValueEnum};
use facemill::job_file::JobFile;
use facemill::new_job::{NewJob, Series, new_job};
use facemill::report::{CertificatesFile, Report};
use facemill::solution_space_file::SolutionSpaceFile;
use facemill::{Failure, Job, PlanSettings, SolutionSpaceRequest, Stages, VerificationFile, files, plan_job, summary};

use crate::chip_area_command::{self, ChipAreaArguments};
use crate::feedrate_command::{self, FeedrateArguments};
use crate::lengths_command::{self, LengthsArguments};
use crate::machine_commands::{self, MachineCommand};
use crate::option_lengths::{above_zero, rotor_scale};
use crate::progress::Bar;
use crate::rapids_command::{self, RapidsArguments};
use crate::verify_command::{self, VerifyArguments};

/// Plans five-axis face milling of sculptured surfaces: mesh and path in, machine NC out.
#[derive(Parser)]
#[command(name = "facemill", version, about, max_term_width = 100)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Plans a job and writes program, APT file, report and picture
    Plan {
        /// Job file
        job: PathBuf,
        /// Folder to write to; out/<name of the job's folder> where it is not given
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Threads, 1 to 1024; all processors where it is not given
        #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
        threads: Option<u16>,
        /// Do not run the written program on the virtual machine, nor cut the stock (program, report and summary say so)
        #[arg(long)]
        no_verify: bool,
        /// Cut the stock on lines so far apart; as the job says, or as suits what is cut, where it is not given
        #[arg(long, value_name = "MM", allow_negative_numbers = true, conflicts_with = "no_verify", value_parser = above_zero)]
        stock_cell_mm: Option<f64>,
        /// Prove for every block what happens between its ends, and write certificates.json
        #[arg(long)]
        certificates: bool,
        /// Write chips.csv: chip area, tip feed and removal rate at every CC point
        #[arg(long)]
        chips: bool,
    },
    /// Reads a job and everything it names, and says what is wrong or what was found
    Check {
        /// Job file
        job: PathBuf,
    },
    /// Maps tilt and rotate at one CC point: proven feasible, proven blocked and by what
    SolutionSpace {
        /// Job file
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
        /// Folder to write to; out/<name of the job's folder> where it is not given
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Gives an existing program new feeds: its tip moves at the programmed speed. All but F words is kept byte for byte
    Feedrate(FeedrateArguments),
    /// Runs a program from anywhere on the virtual machine as a job's setup stands, and says what it would do
    Verify(Box<VerifyArguments>),
    /// Gives an existing program faster links: each the fastest way that is free of stock, part, fixtures and machine
    Rapids(RapidsArguments),
    /// Says how short the lengths of the tool assembly may be for an existing program, and which block forces each
    Lengths(LengthsArguments),
    /// Section area of the chip of a pass: one case, or a table of them
    ChipArea(ChipAreaArguments),
    /// Writes an example: a complete job folder
    New {
        #[command(subcommand)]
        part: NewPart,
    },
    /// Checks machine files, and makes them from those of another program
    Machine {
        #[command(subcommand)]
        what: MachineCommand,
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

#[derive(Subcommand)]
enum NewPart {
    /// A marine propeller, its suction side up
    Propeller {
        /// Folder to write to; it must be empty or not exist
        dir: PathBuf,
        /// Series
        #[arg(long, default_value = "dtmb4119")]
        series: SeriesName,
        /// Diameter
        #[arg(long, value_name = "MM", default_value_t = 3048.0, allow_negative_numbers = true, value_parser = above_zero)]
        diameter_mm: f64,
        /// Number of blades (Wageningen B only; 4 where it is not given)
        #[arg(long, value_name = "N")]
        blades: Option<u32>,
        /// Expanded area ratio (Wageningen B only; 0.55 where it is not given)
        #[arg(long, value_name = "RATIO")]
        area_ratio: Option<f64>,
        /// Pitch ratio (Wageningen B only; 1 where it is not given)
        #[arg(long, value_name = "RATIO")]
        pitch_ratio: Option<f64>,
    },
    /// A marine propeller on a mill with two heads, both sides at once
    PropellerDual {
        /// Folder to write to; it must be empty or not exist
        dir: PathBuf,
        /// Diameter
        #[arg(long, value_name = "MM", default_value_t = 1000.0, allow_negative_numbers = true, value_parser = above_zero)]
        diameter_mm: f64,
    },
    /// A wavy sculptured patch
    Patch {
        /// Folder to write to; it must be empty or not exist
        dir: PathBuf,
        /// Length of its sides
        #[arg(long, value_name = "MM", default_value_t = 400.0, allow_negative_numbers = true, value_parser = above_zero)]
        size_mm: f64,
    },
    /// The blade of NASA Rotor 37
    Rotor37 {
        /// Folder to write to; it must be empty or not exist
        dir: PathBuf,
        /// Scale; 1 is the real compressor
        #[arg(long, value_name = "FACTOR", default_value_t = 10.0, allow_negative_numbers = true, value_parser = rotor_scale)]
        scale: f64,
    },
}

#[derive(Clone, Copy, ValueEnum)]
enum SeriesName {
    Dtmb4119,
    Dtmb4382,
    Vp1304,
    WageningenB,
}

#[derive(Clone, Copy, ValueEnum)]
enum Format {
    Job,
    Tool,
    Machine,
    Path,
    Dialect,
    Report,
    Certificates,
    SolutionSpace,
    Verification,
    Holders,
    Lengths,
    Rapids,
}

/// Does what the arguments say.
///
/// # Errors
/// When it cannot be done; what was done with findings is exit code 1 and no error.
pub(crate) fn run(arguments: Arguments) -> Result<ExitCode, Failure> {
    match arguments.command {
        Command::Plan { job, out, threads, no_verify, stock_cell_mm, certificates, chips } => {
            if let Some(n) = threads {
                rayon::ThreadPoolBuilder::new()
                    .num_threads(usize::from(n))
                    .build_global()
                    .map_err(|e| Failure::Internal(e.to_string()))?;
            }
            let out = out.unwrap_or_else(|| default_out(&job));
            let settings = PlanSettings { verify: !no_verify, certificates };
            plan(&job, &out, settings, stock_cell_mm, chips).inspect_err(|_| tell_stale(&out))
        }
        Command::Check { job } => check(&job),
        Command::SolutionSpace { job, operation, pass, point, resolution_deg, out } => {
            solution_space(&job, &SolutionSpaceRequest { operation, pass, point, resolution_deg }, out)
        }
        Command::Feedrate(arguments) => feedrate_command::run(&arguments),
        Command::Verify(arguments) => verify_command::run(&arguments),
        Command::Rapids(arguments) => rapids_command::run(&arguments),
        Command::Lengths(arguments) => lengths_command::run(&arguments),
        Command::ChipArea(arguments) => chip_area_command::run(&arguments),
        Command::New { part } => write_new(part),
        Command::Machine { what } => machine_commands::run(what),
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

/// Writes to standard output. A reader that has had enough and closed it (`| head`) is no failure.
pub(crate) fn say(text: &str) -> Result<(), Failure> {
    say_bytes(text.as_bytes())
}

/// [`say`] of a file that need not be UTF-8.
pub(crate) fn say_bytes(text: &[u8]) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text).and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::Write { file: PathBuf::from("standard output"), source: e })
        }
        _ => Ok(()),
    }
}

/// Stages shown as bars.
pub(crate) struct Bars;

impl Stages for Bars {
    fn start(&self, what: &'static str, n: usize) -> Box<dyn facemill::cl_data::Monitor> {
        Box::new(Bar::new(what, n))
    }
}

/// Names the programs of earlier plans that a plan that failed leaves where they are.
fn tell_stale(out: &Path) {
    let left = files::programs_in(out);
    if !left.is_empty() {
        eprintln!("facemill: {} in {} is of an earlier plan", left.join(", "), out.display());
    }
}

fn plan(
    job_path: &Path,
    out: &Path,
    settings: PlanSettings,
    stock_cell: Option<f64>,
    chips: bool,
) -> Result<ExitCode, Failure> {
    crate::progress::watch_interrupts().map_err(Failure::Internal)?;
    let job = Job::read(job_path)?;
    let mut clean = true;
    let mut all_files = Vec::new();
    let mut timings = Vec::new();
    let mut texts = Vec::new();
    for planned in plan_job(&job, settings, stock_cell, &Bars)? {
        clean &= planned.is_clean();
        texts.push(summary(&planned.report));
        timings.push(serde_json::json!({
            "setup": planned.report.setup,
            "stages_s": planned.timings.iter().map(|(name, s)| ((*name).to_owned(), serde_json::json!(s))).collect::<serde_json::Map<_, _>>(),
        }));
        all_files.extend(planned.files);
        all_files.extend(chips.then_some(planned.chip_table));
    }
    let timings = serde_json::json!({ "format": "facemill-timings/1", "setups": timings });
    all_files.push(("timings.json".to_owned(), facemill::file_format::to_json(&timings).into_bytes()));
    if !crate::progress::start_writing() {
        return Err(Failure::Interrupted);
    }
    files::write_all(out, &all_files)?;
    files::remove_counterparts(out, &all_files)?;
    for text in texts {
        say(&format!("{text}\n"))?;
    }
    let names: Vec<&str> = all_files.iter().map(|(name, _)| name.as_str()).collect();
    say(&format!("  written to {}: {}\n", out.display(), names.join(", ")))?;
    Ok(if clean { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// A resolution of the map, deg.
fn resolution(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|e| format!("{e}"))?;
    if (0.05..=10.0).contains(&value) { Ok(value) } else { Err("must be from 0.05 to 10".to_owned()) }
}

fn solution_space(path: &Path, request: &SolutionSpaceRequest, out: Option<PathBuf>) -> Result<ExitCode, Failure> {
    crate::progress::watch_interrupts().map_err(Failure::Internal)?;
    let job = Job::read(path)?;
    let space = facemill::solution_space(&job, request, &Bars)?;
    let out = out.unwrap_or_else(|| default_out(path));
    let json = facemill::file_format::to_json(&space.file).into_bytes();
    let all = [("solution-space.svg".to_owned(), space.svg.into_bytes()), ("solution-space.json".to_owned(), json)];
    if !crate::progress::start_writing() {
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

/// `out/` and the name of the folder that the job is in.
fn default_out(job: &Path) -> PathBuf {
    let folder = job.canonicalize().ok().and_then(|p| p.parent().and_then(|f| f.file_name()).map(PathBuf::from));
    Path::new("out").join(folder.unwrap_or_else(|| PathBuf::from("job")))
}

fn check(job_path: &Path) -> Result<ExitCode, Failure> {
    let job = Job::read(job_path)?;
    say(&format!(
        "{}: job \"{}\" with {} operation(s)\n",
        job_path.display(),
        job.file.name,
        job.file.operations.len()
    ))?;
    for index in 0..job.file.setups.len() {
        for line in facemill::describe_setup(&job, index)? {
            say(&format!("  {line}\n"))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn write_new(part: NewPart) -> Result<ExitCode, Failure> {
    let (dir, job) = match part {
        NewPart::Propeller { dir, series, diameter_mm, blades, area_ratio, pitch_ratio } => {
            let series = match series {
                SeriesName::Dtmb4119 => Series::Dtmb4119,
                SeriesName::Dtmb4382 => Series::Dtmb4382,
                SeriesName::Vp1304 => Series::Vp1304,
                SeriesName::WageningenB => Series::WageningenB {
                    blades: blades.unwrap_or(4),
                    area_ratio: area_ratio.unwrap_or(0.55),
                    pitch_ratio: pitch_ratio.unwrap_or(1.0),
                },
            };
            let given = blades.is_some() || area_ratio.is_some() || pitch_ratio.is_some();
            if given && !matches!(series, Series::WageningenB { .. }) {
                let message = "--blades, --area-ratio and --pitch-ratio belong to --series wageningen-b; the others have \
                               their own";
                return Err(Failure::Input { file: dir, message: message.to_owned() });
            }
            (dir, NewJob::Propeller { series, diameter_mm })
        }
        NewPart::PropellerDual { dir, diameter_mm } => (dir, NewJob::DualPropeller { diameter_mm }),
        NewPart::Patch { dir, size_mm } => (dir, NewJob::Patch { size_mm }),
        NewPart::Rotor37 { dir, scale } => (dir, NewJob::Rotor37 { scale }),
    };
    let written = new_job(&job).map_err(|message| Failure::Input { file: dir.clone(), message })?;
    let occupied = std::fs::read_dir(&dir).is_ok_and(|mut entries| entries.next().is_some());
    if occupied {
        return Err(Failure::input(&dir, "the folder is not empty; name a new one"));
    }
    files::write_all(&dir, &written)?;
    let names: Vec<&str> = written.iter().map(|(n, _)| n.as_str()).collect();
    say(&format!("{}: {}\n", dir.display(), names.join(", ")))?;
    say(&format!("plan it with: facemill plan {}\n", dir.join("job.json").display()))?;
    Ok(ExitCode::SUCCESS)
}

fn schema(format: Format) -> String {
    match format {
        Format::Job => facemill::file_format::schema::<JobFile>(),
        Format::Tool => facemill::file_format::schema::<facemill::tool_model::ToolFile>(),
        Format::Machine => facemill::inverse_kinematics::machine_schema(),
        Format::Path => facemill::file_format::schema::<facemill::cc_path::PathFile>(),
        Format::Dialect => facemill::file_format::schema::<facemill::nc_program::DialectFile>(),
        Format::Report => facemill::file_format::schema::<Report>(),
        Format::Certificates => facemill::file_format::schema::<CertificatesFile>(),
        Format::SolutionSpace => facemill::file_format::schema::<SolutionSpaceFile>(),
        Format::Verification => facemill::file_format::schema::<VerificationFile>(),
        Format::Holders => facemill::file_format::schema::<facemill::tool_model::HoldersFile>(),
        Format::Lengths => facemill::file_format::schema::<facemill::lengths::LengthsFile>(),
        Format::Rapids => facemill::file_format::schema::<facemill::rapids::RapidsFile>(),
    }
}
