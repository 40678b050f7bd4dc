//! `facemill view` and `facemill report`, and the pages of a plan.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{ArgGroup, Args};
use facemill::called_program::CalledProgram;
use facemill::formats::{JOB_REPORT_FORMAT, JobReport, ProgramStamp};
use facemill::job::validate::setup_names::file_stem;
use facemill::job_file::STOCK_TOLERANCE;
use facemill::planner::{ReadSetup, posture_maps};
use facemill::report::CertifiedReport;
use facemill::report_page::animation::animation_glb;
use facemill::report_page::document::{PageData, PageSource, page_data};
use facemill::report_page::format::{VerdictState, WrittenLines};
use facemill::report_page::html::{report_html, sheet_html};
use facemill::report_page::job_page::job_html;
use facemill::report_page::stamp_line;
use facemill::solution_space_file::PostureMapsFile;
use facemill::virtual_machine::Assumption;
use facemill::{CutRequest, DeviationRequest, Failure, Job, Planned, VerifyRequest, files, verify_program};
use serde_json::Value;

use crate::cli::arguments::ad_hoc_setup::StandArguments;
use crate::cli::arguments::called_files::expand_in_place;
use crate::cli::arguments::option_lengths::above_zero;
use crate::cli::arguments::plan_folder::{check_inputs, check_program, program_of, reports_in, settings_of};
use crate::cli::arguments::program::{ProgramArguments, ProgramOfJob};
use crate::cli::output::say;
use crate::cli::progress::Progress;

#[derive(Args)]
#[command(group = ArgGroup::new("run on").args(["job", "part"]).required(true))]
pub(crate) struct ViewArguments {
    #[command(flatten)]
    program: ProgramArguments,
    #[command(flatten)]
    stand: StandArguments,
    /// Prove the motion of every block between its ends, and colour the path by it
    #[arg(long)]
    certificates: bool,
    /// Cut the stock on lines so far apart, and test against the stock of every moment; without it
    /// faults are those against the initial stock
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = above_zero)]
    stock_cell_mm: Option<f64>,
    /// Output file; default: the program's name with .html
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Output file for the setup sheet alone
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,
    /// Output file for machine, part and tool in motion, for other viewers
    #[arg(long, value_name = "FILE.glb")]
    animation: Option<PathBuf>,
}

#[derive(Args)]
pub(crate) struct ReportArguments {
    /// Folder that `facemill plan` wrote
    out: PathBuf,
    /// Job file, or a folder with job.json, of the plan; default: job.json in the folder or above
    #[arg(long, value_name = "FILE")]
    job: Option<PathBuf>,
    /// Output file for machine, part and tool in motion, for other viewers; of a plan with one
    /// setup
    #[arg(long, value_name = "FILE.glb")]
    animation: Option<PathBuf>,
}

/// Writes the page of a program.
///
/// # Errors
/// If job or program cannot be read, or the page cannot be written; faults are exit code 1.
pub(crate) fn view(arguments: &ViewArguments) -> Result<ExitCode, Failure> {
    crate::cli::progress::watch_interrupts().map_err(Failure::Internal)?;
    let mut read = arguments.program.read_with(&arguments.stand)?.of_one_tool()?;
    let program = &arguments.program.program;
    let called = expand_in_place(&mut read, program)?;
    let ProgramOfJob { job, setup, dialect, text, .. } = read;
    // The page shows the text that runs, which is no file.
    let shown = if called.is_some() { with_calls_expanded(program) } else { program.clone() };
    let deviation =
        Some(DeviationRequest::default()).filter(|_| job.operations_of(&job.file.setups[setup]).count() > 0);
    let cut =
        arguments.stock_cell_mm.map(|cell| CutRequest { deviation, ..CutRequest::on_lines(cell, STOCK_TOLERANCE) });
    let request = VerifyRequest {
        setup,
        gouge_limit: arguments.stand.gouge_limit(),
        certificates: arguments.certificates,
        time_law: true,
        cut,
        ..VerifyRequest::new(&shown, dialect)
    };
    let out = arguments.out.clone().unwrap_or_else(|| program.with_extension("html"));
    let paths = [Some(&out), arguments.sheet.as_ref(), arguments.animation.as_ref()];
    files::check_outputs(paths.into_iter().flatten().map(PathBuf::as_path))?;
    let mut verified = verify_program(&job, &text, &request, &Progress::new(false))?;
    let text_that_runs = called.iter().map(|called| Assumption { line: None, text: called.text_that_runs() });
    verified.complete(arguments.stand.assumptions(arguments.program.dialect).into_iter().chain(text_that_runs));
    let mut result = value(&verified.file)?;
    // A page has the sums; a million certificates would fill it.
    let certificates = result.as_object_mut().and_then(|file| file.remove("certificates"));
    if let Some(certificates) = &verified.file.certificates {
        result["certified"] = value(&CertifiedReport::new(certificates))?;
    }
    let source = PageSource {
        job: &job,
        setup,
        dialect,
        program: &shown,
        text: &text,
        written: called.as_ref().map_or_else(Vec::new, written_lines),
        result,
        certificates,
        chips: None,
        postures: None,
        pictures: Vec::new(),
        read: None,
        left: verified.left.take(),
    };
    let data = page_data(source)?;
    let mut outputs: Vec<(&Path, Vec<u8>)> = vec![(&out, report_html(&data))];
    outputs.extend(arguments.sheet.as_ref().map(|sheet| (sheet.as_path(), sheet_html(&data))));
    outputs.extend(arguments.animation.as_ref().map(|file| (file.as_path(), animation_glb(&data, &job.machine))));
    if !crate::cli::progress::start_writing() {
        return Err(Failure::Interrupted);
    }
    files::write_each(&outputs)?;
    // What the page says, and no other count.
    let verdict = &data.document.verdict;
    say(&format!("{}\nwritten to {}\n", stamp_line(verdict), out.display()))?;
    Ok(exit_code(verdict.state == VerdictState::Faulty))
}

/// Returns the places of the lines of a text that runs in the written files.
fn written_lines(called: &CalledProgram) -> Vec<WrittenLines> {
    let run = |first_line: u32| {
        let (file, line) = called.place(first_line);
        let file = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        WrittenLines { first_line, file, line }
    };
    called.first_lines().map(run).collect()
}

/// Returns the name of the text that runs for a program that calls subprograms.
fn with_calls_expanded(program: &Path) -> PathBuf {
    let name = program.file_name().unwrap_or(program.as_os_str()).to_string_lossy();
    program.with_file_name(format!("{name} with its calls expanded"))
}

/// Returns the exit code of a command that writes pages: 1 if one of them says `REJECTED`.
fn exit_code(is_rejected: bool) -> ExitCode {
    if is_rejected { ExitCode::from(1) } else { ExitCode::SUCCESS }
}

/// Writes the pages of a plan again, and says the verdict of each setup.
///
/// # Errors
/// If the folder has no report, the job is not found or not that of the plan, or a file cannot be
/// read or written; faults are exit code 1.
pub(crate) fn report(arguments: &ReportArguments) -> Result<ExitCode, Failure> {
    let folder = &arguments.out;
    let reports = reports_in(folder)?;
    if arguments.animation.is_some() && reports.len() > 1 {
        return Err(Failure::input(
            folder,
            "has several setups: use `facemill view --animation` for the program of one",
        ));
    }
    let of_job = job_page(folder)?;
    let mut names: Vec<String> = reports.iter().flat_map(|(suffix, _)| page_names(suffix)).collect();
    names.extend(of_job.as_ref().map(|_| JOB_PAGE.to_owned()));
    files::check_pages(folder, &names)?;
    let names = names.iter().map(|name| folder.join(name));
    let written: Vec<PathBuf> = names.chain(arguments.animation.clone()).collect();
    files::check_outputs(written.iter().map(PathBuf::as_path))?;
    let mut outputs: Vec<(PathBuf, Vec<u8>)> = Vec::new();
    let programs = programs_of(folder, &reports)?;
    let (mut stamps, mut is_rejected) = (String::new(), false);
    for (suffix, result) in reports {
        let path = folder.join(format!("report{suffix}.json"));
        let wrong = |what: String| Failure::input(&path, what);
        let settings = settings_of(&result).map_err(&wrong)?;
        let job = Job::read_with(&job_of(arguments, folder)?, &settings)?;
        check_inputs(&job, &result).map_err(&wrong)?;
        let mut job = job;
        for index in 0..job.file.setups.len() {
            let program = programs.get(&job.file.setups[index].name).cloned();
            job.programs.add(index, program, job.post.dialect());
        }
        let name = program_of(&result).ok_or_else(|| wrong("names no program".to_owned()))?;
        let text = files::read(&folder.join(name))?;
        check_program(&result, name, &text).map_err(&wrong)?;
        let beside = |name: String| folder.join(&name).is_file().then(|| files::read(&folder.join(name)));
        let of_blocks = format!("certificates{suffix}.json");
        let certificates = beside(of_blocks.clone()).transpose()?;
        let certificates = certificates.map(|bytes| serde_json::from_slice(&bytes)).transpose();
        let certificates = certificates.map_err(|e| wrong(format!("its certificates are no JSON: {e}")))?;
        if let Some(certificates) = &certificates {
            check_program_of(certificates, (name, &text), " with --certificates")
                .map_err(|e| Failure::input(&folder.join(of_blocks), e))?;
        }
        let chips = beside(format!("chips{suffix}.csv")).transpose()?;
        let maps = format!("postures{suffix}.json");
        let postures = beside(maps.clone()).transpose()?;
        let postures = postures.map(|bytes| serde_json::from_slice(&bytes)).transpose();
        let postures = postures.map_err(|e| wrong(format!("{maps} is no JSON: {e}")))?;
        if let Some(postures) = &postures {
            check_program_of(postures, (name, &text), "").map_err(|e| Failure::input(&folder.join(&maps), e))?;
        }
        let picture = format!("solution-space{suffix}.svg");
        let svg = beside(picture.clone()).transpose()?;
        let setup = result.get("setup").and_then(Value::as_str).unwrap_or_default();
        let index = job.file.setups.iter().position(|s| s.name == setup);
        let source = PageSource {
            job: &job,
            setup: index.ok_or_else(|| wrong(format!("the job has no setup \"{setup}\"")))?,
            dialect: job.post.dialect(),
            program: Path::new(name),
            text: &text,
            written: Vec::new(),
            result: result.clone(),
            certificates,
            chips: chips.as_deref(),
            postures,
            pictures: svg.iter().map(|svg| (picture.clone(), svg.as_slice())).collect(),
            read: None,
            left: None,
        };
        let data = page_data(source)?;
        let verdict = &data.document.verdict;
        stamps += &format!("{setup}: {}\n", stamp_line(verdict));
        is_rejected |= verdict.state == VerdictState::Faulty;
        outputs.extend(pages(&suffix, &data).map(|(name, bytes)| (folder.join(name), bytes)));
        outputs.extend(arguments.animation.as_ref().map(|file| (file.clone(), animation_glb(&data, &job.machine))));
    }
    outputs.extend(of_job);
    let outputs: Vec<(&Path, Vec<u8>)> = outputs.iter().map(|(path, bytes)| (path.as_path(), bytes.clone())).collect();
    files::write_each(&outputs)?;
    let names: Vec<String> = outputs.iter().map(|(path, _)| path.display().to_string()).collect();
    say(&format!("{stamps}written: {}\n", names.join(", ")))?;
    Ok(exit_code(is_rejected))
}

/// Returns the programs that reports in a folder are of, by their setups.
fn programs_of(folder: &Path, reports: &[(String, Value)]) -> Result<BTreeMap<String, (PathBuf, Vec<u8>)>, Failure> {
    let of = |(_, result): &(String, Value)| {
        let setup = result.get("setup").and_then(Value::as_str)?;
        let path = folder.join(program_of(result).filter(|name| !name.contains(files::REJECTED))?);
        Some(files::read(&path).map(|text| (setup.to_owned(), (path, text))))
    };
    reports.iter().filter_map(of).collect()
}

/// File of the report on a job with several programs.
pub(crate) const JOB_REPORT: &str = "job-report.json";

/// Page of that report.
pub(crate) const JOB_PAGE: &str = "job-report.html";

/// Returns the names of the pages of a job's setups, and of the job if it has several.
pub(crate) fn page_names_of(job: &Job) -> Vec<String> {
    let setups = &job.file.setups;
    let suffix = |name: &str| if setups.len() > 1 { format!("-{}", file_stem(name)) } else { String::new() };
    let of_job = (setups.len() > 1).then(|| JOB_PAGE.to_owned());
    setups.iter().flat_map(|setup| page_names(&suffix(&setup.name))).chain(of_job).collect()
}

/// Returns the page of the report on the job in a folder, if it has one.
fn job_page(folder: &Path) -> Result<Option<(PathBuf, Vec<u8>)>, Failure> {
    let path = folder.join(JOB_REPORT);
    if !path.is_file() {
        return Ok(None);
    }
    let wrong = |what: String| Failure::input(&path, what);
    let report: JobReport =
        serde_json::from_slice(&files::read(&path)?).map_err(|e| wrong(format!("is no report on a job: {e}")))?;
    if report.format != JOB_REPORT_FORMAT {
        let found = &report.format;
        return Err(wrong(format!(
            "format is \"{found}\", and this version reads \"{JOB_REPORT_FORMAT}\": plan again"
        )));
    }
    let programs = report.clampings.iter().flat_map(|clamping| &clamping.programs);
    let programs = programs.map(|program| (program.programs.first(), &program.blake3));
    let joined = report.clampings.iter().map(|clamping| (clamping.joined_program.as_ref(), &clamping.joined_blake3));
    for (name, blake3) in programs.chain(joined) {
        let (Some(name), Some(blake3)) = (name, blake3) else { continue };
        if ProgramStamp::new(Path::new(name), &files::read(&folder.join(name))?).blake3 != *blake3 {
            return Err(wrong(format!("describes another program than {name}: plan again")));
        }
    }
    Ok(Some((folder.join(JOB_PAGE), job_html(&report))))
}

/// Files that are made of a plan for a person.
#[derive(Default)]
pub(crate) struct PagesOfPlan {
    /// Pages, and the maps of postures that they show, by name.
    pub(crate) files: Vec<(String, Vec<u8>)>,
    /// Machine, part and tool in motion.
    pub(crate) animation: Option<Vec<u8>>,
}

/// Kept of a setup for its pages when it has been planned.
pub(crate) struct KeptForPages<'j> {
    /// Maps of postures.
    maps: Option<Result<PostureMapsFile, Failure>>,
    /// The setup, of a job with no other: several take too much memory together, and are read
    /// again.
    read: Option<ReadSetup<'j>>,
}

impl<'j> KeptForPages<'j> {
    pub(crate) fn of(job: &Job, planned: &Planned, read: Option<ReadSetup<'j>>) -> Self {
        let maps = read.as_ref().map(|read| posture_maps(job, read, planned));
        Self { maps, read: read.filter(|_| job.file.setups.len() == 1) }
    }
}

/// Returns the pages of a planned setup and its animation, as far as they are wanted; none, with a
/// note on standard error, if they cannot be made: a plan is not lost for want of a picture.
pub(crate) fn pages_of_plan(
    job: &Job,
    (planned, kept): (&mut Planned, Option<KeptForPages<'_>>),
    [wants_pages, wants_animation]: [bool; 2],
) -> PagesOfPlan {
    let mut made = PagesOfPlan::default();
    if !wants_pages && !wants_animation {
        return made;
    }
    match data_of_plan(job, planned, kept) {
        Ok((suffix, maps, data)) => {
            if wants_pages {
                made.files.extend(pages(&suffix, &data));
                made.files.extend(maps.map(|maps| (format!("postures{suffix}.json"), maps)));
            }
            made.animation = wants_animation.then(|| animation_glb(&data, &job.machine));
        }
        Err(why) => eprintln!("facemill: no pages for setup \"{}\": {why}", planned.report.setup),
    }
    made
}

/// Returns the suffix of a setup's files, the file of its maps of postures, and the data of its
/// page.
fn data_of_plan(
    job: &Job,
    planned: &mut Planned,
    kept: Option<KeptForPages<'_>>,
) -> Result<(String, Option<Vec<u8>>, PageData), Failure> {
    let missing = |what: &str| Failure::Internal(format!("the plan has no {what}"));
    let (maps, read) = kept.map_or((None, None), |kept| (kept.maps, kept.read));
    let maps = maps.transpose()?;
    let left = planned.left.take();
    let file = |begin: &str, end: &str| planned.files.iter().find(|(n, _)| n.starts_with(begin) && n.ends_with(end));
    let (name, report) = file("report", ".json").ok_or_else(|| missing("report"))?;
    let suffix = name.trim_start_matches("report").trim_end_matches(".json").to_owned();
    let result: Value = serde_json::from_slice(report).map_err(|e| Failure::Internal(e.to_string()))?;
    let program = planned.report.programs.first().ok_or_else(|| missing("program"))?;
    let (_, text) = file(&program.file, "").ok_or_else(|| missing("program"))?;
    let certificates = file("certificates", ".json").map(|(_, bytes)| serde_json::from_slice(bytes)).transpose();
    let pictures = file("solution-space", ".svg").map(|(name, svg)| (name.clone(), svg.as_slice()));
    let setup = job.file.setups.iter().position(|s| s.name == planned.report.setup);
    let source = PageSource {
        job,
        setup: setup.ok_or_else(|| missing("setup"))?,
        dialect: job.post.dialect(),
        program: Path::new(&program.file),
        text,
        written: Vec::new(),
        result,
        certificates: certificates.map_err(|e| Failure::Internal(e.to_string()))?,
        chips: Some(&planned.chip_table.1),
        postures: maps.as_ref().map(value).transpose()?,
        pictures: pictures.into_iter().collect(),
        read: read.as_ref().map(|read| &read.setup),
        left,
    };
    let data = page_data(source)?;
    Ok((suffix, maps.map(|maps| facemill::file_format::to_json(&maps).into_bytes()), data))
}

fn pages(suffix: &str, data: &PageData) -> [(String, Vec<u8>); 2] {
    let [report, sheet] = page_names(suffix);
    [(report, report_html(data)), (sheet, sheet_html(data))]
}

fn page_names(suffix: &str) -> [String; 2] {
    [format!("report{suffix}.html"), format!("setup-sheet{suffix}.html")]
}

fn job_of(arguments: &ReportArguments, folder: &Path) -> Result<PathBuf, Failure> {
    if let Some(job) = &arguments.job {
        return Ok(job.clone());
    }
    let folder = folder.canonicalize().map_err(|source| Failure::Read { file: folder.to_owned(), source })?;
    let found = folder.ancestors().map(|above| above.join("job.json")).find(|job| job.is_file());
    found.ok_or_else(|| Failure::input(&arguments.out, "no job.json is in it or above: name the plan's job with --job"))
}

/// Checks that a file beside a program is of it: another would say what it does not do.
fn check_program_of(file: &Value, (name, text): (&str, &[u8]), option: &str) -> Result<(), String> {
    let stamp = ProgramStamp::new(Path::new(name), text);
    let listed = file.get("programs").and_then(Value::as_array).into_iter().flatten();
    let mut checksums = listed.filter_map(|p| p.get("blake3")?.as_str());
    if checksums.any(|blake3| blake3 == stamp.blake3) {
        return Ok(());
    }
    Err(format!("describes another program than {name}: plan again{option}, or remove this file"))
}

fn value<T: serde::Serialize>(file: &T) -> Result<Value, Failure> {
    serde_json::to_value(file).map_err(|e| Failure::Internal(e.to_string()))
}
