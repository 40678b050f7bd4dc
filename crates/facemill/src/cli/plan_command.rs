//! `facemill plan`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use facemill::formats::{
    JobReport, JoinedProgramSummary, JoinedSectionSummary, SUMMARY_FORMAT, SetupSummary, SummaryFile, not_met,
};
use facemill::planner::plan_job_with_setups;
use facemill::report::Report;
use facemill::report::outcome::Outcome;
use facemill::report_page::job_page::job_html;
use facemill::setup_programs::{
    ControlTables, JoinedProgram, JoinedSection, calling_programs, control_tables, job_report, joined_programs,
};
use facemill::{Failure, Job, JobSetting, PlanSettings, Planned, files, summary};

use crate::cli::arguments::option_lengths::above_zero;
use crate::cli::output::{default_out, say};
use crate::cli::page_commands::{JOB_PAGE, JOB_REPORT, KeptForPages, PagesOfPlan, page_names_of, pages_of_plan};
use crate::cli::progress::Progress;

/// Text on exit codes behind the options.
pub(crate) const EXIT_CODES: &str = "\
Exit codes:
  0    done: the program meets the job
  1    no fault, but the job is not met: more points are left out or more material is left than
       it permits, or blocks are less straight than required; or the job is infeasible, and
       nothing is written
  2    wrong input or command line
  3    a file cannot be written, or an internal failure
  4    the program has faults: it is written as program.rejected.* and must not be run
  130  interrupted";

#[derive(Args)]
pub(crate) struct PlanArguments {
    /// Job file, or a folder with job.json
    job: PathBuf,
    /// Output folder; default: out/<name of the job's folder>
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace a value of the job file: KEY as operations[0].tolerances.cusp_mm or as a JSON
    /// pointer, VALUE as JSON or a string; null removes the key. Can be given several times; the
    /// report lists the settings
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<JobSetting>,
    /// Threads, 1 to 1024; default: all processors
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Do not run the written program on the virtual machine, nor cut the stock (program, report
    /// and summary say so)
    #[arg(long)]
    no_verify: bool,
    /// Cut the stock on lines so far apart; default: as the job says, or suited to the cut region
    #[arg(long, value_name = "MM", allow_negative_numbers = true, conflicts_with = "no_verify", value_parser = above_zero)]
    stock_cell_mm: Option<f64>,
    /// Prove the motion of every block between its ends, and write certificates.json
    #[arg(long)]
    certificates: bool,
    /// Write chips.csv: chip area, tip feed and removal rate at every CC point
    #[arg(long)]
    chips: bool,
    /// Do not write report.html, setup-sheet.html, job-report.html and postures.json
    #[arg(long)]
    no_html: bool,
    /// Output file for machine, part and tool in motion, for other viewers; of a job with one setup
    #[arg(long, value_name = "FILE.glb")]
    animation: Option<PathBuf>,
    /// Print errors only
    #[arg(short, long)]
    quiet: bool,
    /// Print the summary as JSON (facemill schema summary), and nothing else, on standard output
    #[arg(long)]
    json: bool,
    /// Report the progress as JSON on standard error, an object on each line (docs/batch.md)
    #[arg(long)]
    json_progress: bool,
}

/// Plans a job and writes the result.
///
/// # Errors
/// If it cannot be planned or written; a program with faults is no error.
pub(crate) fn run(arguments: &PlanArguments) -> Result<ExitCode, Failure> {
    if let Some(n) = arguments.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(n)).build_global();
        pool.map_err(|e| Failure::Internal(e.to_string()))?;
    }
    let out = arguments.out.clone().unwrap_or_else(|| default_out(&arguments.job));
    crate::cli::progress::watch_interrupts().map_err(Failure::Internal)?;
    // A job that cannot be read leaves the folder unchanged.
    let job = Job::read_with(&arguments.job, &arguments.settings)?;
    files::check_folder(&out)?;
    if !arguments.no_html {
        files::check_pages(&out, &page_names_of(&job))?;
    }
    if let Some(animation) = &arguments.animation {
        if job.file.setups.len() > 1 {
            let message = "has several setups: use `facemill view --animation` for the program of one";
            return Err(Failure::input(&job.path, message));
        }
        files::check_outputs([animation.as_path()])?;
    }
    let earlier = files::set_aside_earlier(&out)?;
    plan(arguments, &job, &out).inspect_err(|_| tell_earlier(&out, &earlier))
}

fn plan(arguments: &PlanArguments, job: &Job, out: &Path) -> Result<ExitCode, Failure> {
    let settings = PlanSettings { verify: !arguments.no_verify, certificates: arguments.certificates };
    // Depends on the job alone: a table that cannot be written is no reason to plan in vain.
    let tables = control_tables(job)?;
    let mut outcome = Outcome::Done;
    let mut all_files = Vec::new();
    let mut timings = Vec::new();
    let mut setups = Vec::new();
    let mut all_planned = Vec::new();
    let mut texts = Vec::new();
    let progress = if arguments.json_progress { Progress::json() } else { Progress::new(arguments.quiet) };
    let wants_pages = !arguments.no_html || arguments.animation.is_some();
    let keep = |planned: &Planned, read| wants_pages.then(|| KeptForPages::of(job, planned, read));
    for (planned, kept) in plan_job_with_setups(job, settings, arguments.stock_cell_mm, &progress, keep)? {
        outcome = outcome.max(planned.outcome_at_end());
        texts.push(summary(&planned.report));
        setups.push(SetupSummary::of(&planned.report));
        timings.push(serde_json::json!({
            "setup": planned.report.setup,
            "programs": planned.report.programs,
            "stages_s": planned.timings.iter().map(|(name, s)| ((*name).to_owned(), serde_json::json!(s))).collect::<serde_json::Map<_, _>>(),
        }));
        all_files.extend(planned.files.iter().cloned());
        all_files.extend(arguments.chips.then(|| planned.chip_table.clone()));
        all_planned.push((planned, kept));
    }
    let joined_programs = joined_programs(job, &all_planned)?;
    let of_job = job_report(job, &all_planned, &joined_programs)?;
    texts.extend(add_beside(job, &all_planned, (&joined_programs, tables), &mut all_files)?);
    let joined = joined_summaries(joined_programs, &all_planned, &mut all_files);
    texts.extend(joined.iter().map(|joined| joined.lines().join("\n")));
    if let Some(report) = &of_job {
        texts.extend(report.summary_lines());
        all_files.push((JOB_REPORT.to_owned(), facemill::file_format::to_json(report).into_bytes()));
    }
    let reasons: Vec<String> = all_planned.iter().flat_map(|(planned, _)| planned.incomplete_at_end()).collect();
    if of_job.is_none() && outcome == Outcome::Incomplete {
        texts.extend(not_met(reasons.iter().cloned()));
    }
    let timings = serde_json::json!({ "format": "facemill-timings/1", "setups": timings });
    all_files.push(("timings.json".to_owned(), facemill::file_format::to_json(&timings).into_bytes()));
    if !crate::cli::progress::start_writing() {
        return Err(Failure::Interrupted);
    }
    files::write_plan(out, &all_files)?;
    // Program and report are safe before pages are made: these can be made again.
    let names: Vec<String> =
        all_files.into_iter().map(|(name, _)| name).chain(pages(arguments, job, out, (all_planned, of_job))).collect();
    let output = match (arguments.json, arguments.quiet) {
        (true, _) => json((outcome, reasons), out, names, (setups, joined)),
        (false, true) => String::new(),
        (false, false) => format!("{}\n  written to {}: {}\n", texts.join("\n"), out.display(), in_words(&names)),
    };
    say(&output)?;
    Ok(ExitCode::from(outcome.exit_code()))
}

/// Most files that a summary names one by one.
const MOST_NAMES: usize = 40;

/// Returns the names of files, or how many of each kind there are if they are too many to read.
fn in_words(names: &[String]) -> String {
    if names.len() <= MOST_NAMES {
        return names.join(", ");
    }
    let mut kinds: Vec<(&str, usize)> = Vec::new();
    for name in names {
        let kind = name.rsplit_once('.').map_or("", |(_, kind)| kind);
        match kinds.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, n)) => *n += 1,
            None => kinds.push((kind, 1)),
        }
    }
    let kinds: Vec<String> = kinds.iter().map(|(kind, n)| format!("{n} .{kind}")).collect();
    let page = names.iter().find(|name| *name == JOB_PAGE).map(|page| format!("; the whole job is in {page}"));
    format!("{} files, {}{}", names.len(), kinds.join(", "), page.unwrap_or_default())
}

/// A planned setup, with what is kept for its pages if they are wanted.
type KeptPlan<'j> = (Planned, Option<KeptForPages<'j>>);

/// Writes the pages and the animation of a plan; returns their names.
fn pages(
    arguments: &PlanArguments,
    job: &Job,
    out: &Path,
    (mut planned, of_job): (Vec<KeptPlan<'_>>, Option<JobReport>),
) -> Vec<String> {
    let mut job = job.clone();
    for (planned, _) in &planned {
        let setup = job.file.setups.iter().position(|setup| setup.name == planned.report.setup);
        let program = planned.program_to_run().map(|(name, text)| (name.into(), text.to_vec()));
        if let Some(setup) = setup {
            let dialect = job.post.dialect();
            job.programs.add(setup, program, dialect);
        }
    }
    let job = &job;
    let wanted = [!arguments.no_html, arguments.animation.is_some()];
    let mut placed: Vec<(String, PathBuf, Vec<u8>)> = Vec::new();
    for (planned, kept) in &mut planned {
        let PagesOfPlan { files, animation } = pages_of_plan(job, (planned, kept.take()), wanted);
        placed.extend(files.into_iter().map(|(name, bytes)| (name.clone(), out.join(name), bytes)));
        let animation = arguments.animation.as_ref().zip(animation);
        placed.extend(animation.map(|(file, bytes)| (file.display().to_string(), file.clone(), bytes)));
    }
    if let Some(report) = of_job.filter(|_| !arguments.no_html) {
        placed.push((JOB_PAGE.to_owned(), out.join(JOB_PAGE), job_html(&report)));
    }
    // Someone may have put a page of another program there meanwhile.
    let names = if arguments.no_html { Vec::new() } else { page_names_of(job) };
    let is_free = files::check_pages(out, &names);
    let files: Vec<(&Path, Vec<u8>)> =
        placed.iter_mut().map(|(_, path, bytes)| (path.as_path(), std::mem::take(bytes))).collect();
    match is_free.and_then(|()| files::write_each(&files)) {
        Ok(()) => placed.into_iter().map(|(name, ..)| name).collect(),
        Err(why) => {
            eprintln!("facemill: the plan is written, but not its pages: {why}");
            Vec::new()
        }
    }
}

/// Returns the summary as JSON.
fn json(
    (outcome, incomplete_because): (Outcome, Vec<String>),
    out: &Path,
    files: Vec<String>,
    (setups, joined_programs): (Vec<SetupSummary>, Vec<JoinedProgramSummary>),
) -> String {
    let (out, exit_code) = (out.display().to_string(), outcome.exit_code());
    let format = SUMMARY_FORMAT;
    facemill::file_format::to_json(&SummaryFile {
        format,
        outcome,
        exit_code,
        incomplete_because,
        out,
        files,
        setups,
        joined_programs,
    })
}

/// Adds main programs with their subprograms, and tables of planned clampings, to the files.
/// Returns reasons why a clamping has no main program.
fn add_beside(
    job: &Job,
    planned: &[KeptPlan<'_>],
    (joined, tables): (&[JoinedProgram], Vec<ControlTables>),
    files: &mut Vec<(String, Vec<u8>)>,
) -> Result<Vec<String>, Failure> {
    let mut reasons = Vec::new();
    for calling in calling_programs(job, planned, joined)? {
        match calling.files {
            Ok(made) => files.extend(made),
            Err(why) => reasons.push(format!("{}: no main program with subprograms: {why}", calling.setup)),
        }
    }
    let is_planned = |tables: &ControlTables| planned.iter().any(|(p, _)| tables.setups.contains(&p.report.setup));
    files.extend(tables.into_iter().filter(is_planned).flat_map(|tables| tables.files));
    Ok(reasons)
}

/// Returns the summaries of programs that change tools, and adds the programs to the files.
fn joined_summaries(
    joined_programs: Vec<JoinedProgram>,
    planned: &[KeptPlan<'_>],
    files: &mut Vec<(String, Vec<u8>)>,
) -> Vec<JoinedProgramSummary> {
    let mut summaries = Vec::new();
    for JoinedProgram { setup, setups, without, name, joined, apt } in joined_programs {
        let of = planned.iter().map(|(planned, _)| &planned.report).filter(|report| setups.contains(&report.setup));
        let time = |r: &Report| {
            let times = &r.times;
            let by_law = times.cutting_s.zip(times.rapid_s).map(|(cutting, rapid)| cutting + rapid);
            by_law.unwrap_or(times.constant_cutting_s + times.constant_rapid_s)
        };
        let total_time_s = of.map(time).sum();
        let (file, not_written_because, sections) = match joined {
            Ok((text, sections)) => {
                files.push((name.clone(), text));
                files.extend(apt);
                (Some(name), None, sections)
            }
            Err(why) => (None, Some(why), Vec::new()),
        };
        let section = |s: JoinedSection| JoinedSectionSummary {
            setup: s.setup,
            program: s.program,
            tool: s.tool,
            first_line: s.first_line,
        };
        let sections = sections.into_iter().map(section).collect();
        summaries.push(JoinedProgramSummary { setup, file, not_written_because, total_time_s, without, sections });
    }
    summaries
}

/// Lists the files of an earlier plan that were set aside for a plan that failed.
fn tell_earlier(out: &Path, names: &[String]) {
    if !names.is_empty() {
        let (names, out) = (names.join(", "), out.display());
        eprintln!("facemill: {names} in {out} belong to an earlier plan and now have .earlier in their names");
    }
}
