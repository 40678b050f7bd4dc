//! `facemill paths`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use facemill::formats::{PathsFile, moved_job};
use facemill::strategies::{
    CompareRequest, ComparisonSteps, NamedStrategy, compare_paths, default_strategies, fastest, lay_paths,
    listed_strategies,
};
use facemill::{Failure, Job, JobSetting, PlanSettings, Planned, files};

use crate::cli::arguments::option_lengths::above_zero;
use crate::cli::output::{default_out, say};
use crate::cli::progress::Progress;

/// Text on exit codes behind the options.
pub(crate) const EXIT_CODES: &str = "\
Exit codes:
  0    done; with --compare at least one strategy has a plan without faults
  1    no strategy has such a plan, or none is complete for --best-out
  2    wrong input or command line
  3    a file cannot be written, or an internal failure
  130  interrupted";

#[derive(Args)]
pub(crate) struct PathsArguments {
    /// Job file, or a folder with job.json
    job: PathBuf,
    /// Plan the job by several strategies and print a table: length, efficiency, times, cusps.
    /// Without it, passes are laid but not planned: path files and pictures in a moment
    #[arg(long)]
    compare: bool,
    /// Strategies to compare, by a file of settings for each (facemill schema strategies); default:
    /// the job's own, levels, edge fill, planes along, across and diagonal to the region and, where
    /// that is another direction, as the rotary axes move least, with edge fill and without
    /// (levels), and constant scallop from its border, in both orders
    #[arg(long, value_name = "FILE", requires = "compare")]
    with: Option<PathBuf>,
    /// Compare only these, by name, separated by commas
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "compare")]
    strategies: Vec<String>,
    /// Also turn the mounting about z of the table by these angles in degrees, separated by commas;
    /// 0 is the job's mounting
    #[arg(long, value_name = "DEG", value_delimiter = ',', allow_negative_numbers = true, value_parser = angle, requires = "compare")]
    mounting_angles: Vec<f64>,
    /// Write the job of least machine time among the complete ones to this new file: its strategy,
    /// and its mounting with --mounting-angles; files that it names stay the same
    #[arg(long, value_name = "FILE", requires = "compare")]
    best_out: Option<PathBuf>,
    /// Output folder for path files and pictures; default: out/<name of the job's folder>/paths.
    /// With --compare: folder for compared.json and a picture of each strategy; default: none
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace a value of the job file, as `plan` does
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<JobSetting>,
    /// Do not run the programs on the virtual machine, nor cut the stock: faster, but links go over
    /// the clearance surface, and faults stay unseen
    #[arg(long, requires = "compare")]
    no_verify: bool,
    /// Cut the stock on lines so far apart, as `plan` does
    #[arg(long, value_name = "MM", allow_negative_numbers = true, requires = "compare", conflicts_with = "no_verify", value_parser = above_zero)]
    stock_cell_mm: Option<f64>,
    /// Threads, 1 to 1024; default: all processors
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print errors only
    #[arg(short, long)]
    quiet: bool,
    /// Print the result as JSON (facemill schema paths), and nothing else, on standard output
    #[arg(long)]
    json: bool,
}

/// Reads an angle, deg.
fn angle(text: &str) -> Result<f64, String> {
    let value: f64 = text.trim().parse().map_err(|e| format!("{e}"))?;
    if (-360.0..=360.0).contains(&value) { Ok(value) } else { Err("must be from -360 to 360".to_owned()) }
}

/// Lays or compares the passes of a job.
///
/// # Errors
/// If the job is wrong, or a file cannot be written; a strategy without a plan is no error.
pub(crate) fn run(arguments: &PathsArguments) -> Result<ExitCode, Failure> {
    if let Some(n) = arguments.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(n)).build_global();
        pool.map_err(|e| Failure::Internal(e.to_string()))?;
    }
    crate::cli::progress::watch_interrupts().map_err(Failure::Internal)?;
    let job = Job::read_with(&arguments.job, &arguments.settings)?;
    if arguments.compare { compare(arguments, &job) } else { lay_operation(arguments, &job) }
}

fn lay_operation(arguments: &PathsArguments, job: &Job) -> Result<ExitCode, Failure> {
    let out = arguments.out.clone().unwrap_or_else(|| default_out(&arguments.job).join("paths"));
    files::check_folder(&out)?;
    let laid = lay_paths(job, &Progress::new(arguments.quiet))?;
    write(&out, &laid.files)?;
    let names: Vec<&str> = laid.files.iter().map(|(name, _)| name.as_str()).collect();
    let written = format!("  written to {}: {}\n", out.display(), names.join(", "));
    let file = PathsFile { laid: laid.passes, ..PathsFile::new(&job.file.name) };
    show(arguments, &file, &written)?;
    Ok(ExitCode::SUCCESS)
}

fn compare(arguments: &PathsArguments, job: &Job) -> Result<ExitCode, Failure> {
    let table = arguments.out.as_ref().filter(|_| arguments.best_out.is_some()).map(|out| out.join("compared.json"));
    files::check_outputs(arguments.best_out.as_deref().into_iter().chain(table.as_deref()))?;
    if let Some(out) = arguments.best_out.as_deref().filter(|out| out.exists()) {
        return Err(Failure::input(out, "exists, and a job may be written by hand: name another file, or remove it"));
    }
    let strategies = chosen(arguments, job)?;
    arguments.out.iter().try_for_each(|out| files::check_folder(out))?;
    let angles = match arguments.mounting_angles.as_slice() {
        [] => vec![0.0],
        angles => angles.to_vec(),
    };
    let request = CompareRequest {
        strategies,
        mounting_angles_deg: angles,
        settings: PlanSettings { verify: !arguments.no_verify, certificates: false },
        stock_cell: arguments.stock_cell_mm,
    };
    let steps = Steps { quiet: arguments.quiet, pictures: std::cell::RefCell::default() };
    let compared = compare_paths(job, &request, &Progress::new(arguments.quiet), &steps)?;
    let fastest = fastest(job, &request, &compared);
    let file = PathsFile { compared, fastest, ..PathsFile::new(&job.file.name) };
    let mut written = best_job(arguments, job, &request, &file)?;
    if let Some(out) = &arguments.out {
        let mut all = vec![("compared.json".to_owned(), facemill::file_format::to_json(&file).into_bytes())];
        all.extend(steps.pictures.into_inner());
        write(out, &all)?;
        written += &format!("  written to {}: compared.json and {} pictures\n", out.display(), all.len() - 1);
    }
    show(arguments, &file, &written)?;
    let is_clean = file.compared.iter().any(|c| c.failed.is_none() && c.setups.iter().all(|s| s.faults == 0));
    let is_written = arguments.best_out.is_none() || file.fastest.is_some();
    Ok(ExitCode::from(u8::from(!(is_clean && is_written))))
}

/// Writes the job of the fastest complete plan to the requested file, if there is one; returns the
/// line on it.
fn best_job(
    arguments: &PathsArguments,
    job: &Job,
    request: &CompareRequest,
    file: &PathsFile,
) -> Result<String, Failure> {
    let Some(out) = &arguments.best_out else { return Ok(String::new()) };
    if !crate::cli::progress::start_writing() {
        return Err(Failure::Interrupted);
    }
    let Some(best) = file.fastest.as_ref().and_then(|f| request.job_of(f.index)) else {
        return Ok(format!("  no plan is complete: {} is not written\n", out.display()));
    };
    let best = moved_job(&best, &job.path, out);
    files::write_one(out, facemill::file_format::to_json(&best).into_bytes())?;
    let unverified = if arguments.no_verify { "; no program was run, so plan it before you cut" } else { "" };
    Ok(format!("  job written to {}{unverified}\n", out.display()))
}

/// Returns the strategies to compare.
fn chosen(arguments: &PathsArguments, job: &Job) -> Result<Vec<NamedStrategy>, Failure> {
    let all = match &arguments.with {
        Some(path) => {
            let bytes = files::read_text(path)?;
            listed_strategies(job, &bytes).map_err(|e| Failure::input(path, e))?
        }
        None => default_strategies(job)?,
    };
    if arguments.strategies.is_empty() {
        return Ok(all);
    }
    let names: Vec<&str> = all.iter().map(|s| s.name.as_str()).collect();
    let named = |name: &String| match all.iter().find(|s| s.name == name.trim()) {
        Some(strategy) => Ok(strategy.clone()),
        None => Err(job.wrong(format!("--strategies: there is no \"{name}\"; there are {}", names.join(", ")))),
    };
    arguments.strategies.iter().map(named).collect()
}

/// Heading of each plan on standard error, and the pictures of all.
struct Steps {
    quiet: bool,
    pictures: std::cell::RefCell<Vec<(String, Vec<u8>)>>,
}

impl ComparisonSteps for Steps {
    fn begin(&self, number: usize, n_plans: usize, strategy: &str) {
        if !self.quiet {
            eprintln!("plan {} of {n_plans}: {strategy}", number + 1);
        }
    }

    fn planned(&self, number: usize, planned: &[Planned]) {
        let of_passes = |name: &&(String, Vec<u8>)| name.0.starts_with("passes") && name.0.ends_with(".svg");
        let pictures = planned.iter().flat_map(|p| p.files.iter().filter(of_passes));
        let named = pictures.map(|(name, svg)| (format!("compared-{}-{name}", number + 1), svg.clone()));
        self.pictures.borrow_mut().extend(named);
    }
}

fn write(out: &std::path::Path, all: &[(String, Vec<u8>)]) -> Result<(), Failure> {
    if !crate::cli::progress::start_writing() {
        return Err(Failure::Interrupted);
    }
    files::write_all(out, all)
}

/// Prints the result: JSON, a table with the written files, or nothing.
fn show(arguments: &PathsArguments, file: &PathsFile, written: &str) -> Result<(), Failure> {
    match (arguments.json, arguments.quiet) {
        (true, _) => say(&facemill::file_format::to_json(file)),
        (false, true) => Ok(()),
        (false, false) => say(&format!("{}{written}", file.table())),
    }
}
