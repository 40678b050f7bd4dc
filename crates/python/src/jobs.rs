//! Jobs, plans, verification and feeds.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use facemill::called_program::{CallableFiles, CalledProgram};
use facemill::feeds::{FeedLaw, FeedRewriteSettings, TipFeed, rewrite_feed_lines};
use facemill::file_format::{from_json, to_json};
use facemill::job_file::{JobFile, STOCK_TOLERANCE};
use facemill::nc_program::Dialect;
use facemill::new_job::{NewJob, Series};
use facemill::planner::plan_job_setup;
use facemill::{
    CutRequest, Failure, Job, JobFiles, JobSetting, PlanSettings, VerifyRequest, files, summary, verify_program,
};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::failure::{raised, wrong};
use crate::interrupt::interruptible;
use crate::kinematics::Machine;

/// Job as Python gives it: a path, or text with the files that it names in memory and a folder for
/// the others.
#[derive(Debug, FromPyObject)]
pub struct GivenJob {
    path: Option<PathBuf>,
    text: Option<Vec<u8>>,
    folder: Option<PathBuf>,
    files: BTreeMap<String, Vec<u8>>,
    settings: Vec<String>,
}

impl GivenJob {
    /// Reads the job.
    ///
    /// # Errors
    /// As [`Job::read_with`] and [`Job::of_values`].
    pub fn read(&self) -> Result<Job, Failure> {
        let settings: Result<Vec<JobSetting>, String> = self.settings.iter().map(|s| s.parse()).collect();
        let path = self.path.clone().unwrap_or_else(|| PathBuf::from("job.json"));
        let settings = settings.map_err(|why| Failure::input(&path, why))?;
        let Some(text) = &self.text else { return Job::read_with(&path, &settings) };
        let file: JobFile = from_json(text).map_err(|e| Failure::input(&path, e))?;
        let folder = self.folder.as_ref().map_or_else(JobFiles::default, JobFiles::in_folder);
        let files = self.files.iter().fold(folder, |files, (name, bytes)| files.with(name, bytes.clone()));
        Job::of_values(&file, files)
    }
}

/// Returns the setup of an index.
fn check_setup(job: &Job, setup: usize) -> Result<(), Failure> {
    match job.file.setups.len() {
        n if setup < n => Ok(()),
        n => Err(job.wrong(format!("setup: has {n} setups, the first of index 0, and none of index {setup}"))),
    }
}

/// Plans a setup; returns outcome, report, summary and files.
///
/// # Errors
/// As [`plan_job_setup`].
#[pyfunction]
pub fn plan<'py>(
    py: Python<'py>,
    job: GivenJob,
    setup: usize,
    verify: bool,
    certificates: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let planned = interruptible(py, |stages| {
        let job = job.read()?;
        check_setup(&job, setup)?;
        plan_job_setup(&job, setup, PlanSettings { verify, certificates }, None, stages)
    })?;
    let result = PyDict::new(py);
    result.set_item("exit_code", planned.outcome().exit_code())?;
    result.set_item("report", to_json(&planned.report))?;
    result.set_item("summary", summary(&planned.report))?;
    let files = PyDict::new(py);
    for (name, bytes) in &planned.files {
        files.set_item(name, PyBytes::new(py, bytes))?;
    }
    result.set_item("files", files)?;
    Ok(result)
}

/// Writes the files of a plan, as the command does.
///
/// # Errors
/// If they cannot be written.
#[pyfunction]
pub fn write_plan(py: Python<'_>, folder: PathBuf, all: BTreeMap<String, Vec<u8>>) -> PyResult<()> {
    let all: Vec<(String, Vec<u8>)> = all.into_iter().collect();
    py.detach(|| files::write_plan(&folder, &all)).map_err(|failure| raised(py, &failure))
}

/// Runs a program in a job's setup, with subprograms of its text and of files in memory or of a
/// folder in place of their calls; returns the content of `verification.json`.
///
/// # Errors
/// As [`CalledProgram::of_files`] and [`verify_program`].
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "options by name in Python")]
pub fn verify(
    py: Python<'_>,
    program: Vec<u8>,
    name: PathBuf,
    job: GivenJob,
    setup: usize,
    dialect: Option<&str>,
    certificates: bool,
    stock_cell_mm: Option<f64>,
    subprograms: BTreeMap<String, Vec<u8>>,
    subprogram_folder: Option<PathBuf>,
) -> PyResult<String> {
    let dialect = dialect.map(dialect_of).transpose()?;
    let file = interruptible(py, |stages| {
        let job = job.read()?;
        check_setup(&job, setup)?;
        let dialect = dialect.unwrap_or_else(|| job.post.dialect());
        let request = VerifyRequest {
            setup,
            certificates,
            time_law: true,
            cut: stock_cell_mm.map(|cell| CutRequest::on_lines(cell, STOCK_TOLERANCE)),
            ..VerifyRequest::new(&name, dialect)
        };
        let callable = callable(&subprograms, subprogram_folder.as_deref());
        let (called, text) = match CalledProgram::of_files(&job, &name, &program, dialect, callable)? {
            Some((called, text)) => (Some(called), text),
            None => (None, program),
        };
        let mut verified = verify_program(&job, &text, &request, stages)?;
        verified.complete([]);
        if let Some(called) = &called {
            called.complete(&mut verified.file);
        }
        Ok(verified.file)
    })?;
    let faults = file.verification.faults().count();
    Ok(format!("{{\"faults\": {faults}, \"verification\": {}}}", to_json(&file)))
}

/// Returns the files that calls may mean.
fn callable<'a>(subprograms: &'a BTreeMap<String, Vec<u8>>, folder: Option<&'a Path>) -> CallableFiles<'a> {
    folder.map_or(CallableFiles::Named(subprograms), CallableFiles::InFolder)
}

fn dialect_of(name: &str) -> PyResult<Dialect> {
    let known = Dialect::ALL.into_iter().find(|dialect| dialect.name() == name);
    known.ok_or_else(|| {
        let names: Vec<&str> = Dialect::ALL.into_iter().map(Dialect::name).collect();
        wrong(format!("dialect: must be one of {}, is {name}", names.join(", ")))
    })
}

/// Gives a program new feeds, with subprograms in place of their calls as [`verify`]; returns its
/// text, a summary, and the files of the subprograms.
///
/// # Errors
/// As [`CalledProgram::expanded_files`] and [`rewrite_feed_lines`].
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "options by name in Python")]
pub fn feedrate<'py>(
    py: Python<'py>,
    program: Vec<u8>,
    machine: &Machine,
    tool_length_mm: f64,
    tip_feed: Option<f64>,
    keep: bool,
    dialect: &str,
    time_law: bool,
    blend_tolerance_mm: Option<f64>,
    work_offset: BTreeMap<String, f64>,
    name: PathBuf,
    subprograms: BTreeMap<String, Vec<u8>>,
    subprogram_folder: Option<PathBuf>,
) -> PyResult<(Bound<'py, PyBytes>, String, String)> {
    if !(tool_length_mm > 0.0 && tool_length_mm <= facemill::feeds::MAX_TOOL_LENGTH) {
        let most = facemill::feeds::MAX_TOOL_LENGTH;
        return Err(wrong(format!("tool_length_mm: must be above 0, at most {most}, is {tool_length_mm}")));
    }
    let settings = FeedRewriteSettings {
        machine: machine.inner(),
        tool_length: tool_length_mm,
        tip_feed: match tip_feed {
            _ if keep => TipFeed::Keep,
            Some(feed) if feed > 0.0 && feed.is_finite() => TipFeed::Given(feed),
            Some(feed) => return Err(wrong(format!("tip_feed: must be a speed above 0 mm/min, is {feed}"))),
            None => TipFeed::Programmed,
        },
        work_offset: work_offset.into_iter().collect(),
        dialect: dialect_of(dialect)?,
        dialect_file: None,
        time_law: time_law.then_some(FeedLaw { blend_tolerance: blend_tolerance_mm }),
    };
    let rewrite = || {
        let callable = callable(&subprograms, subprogram_folder.as_deref());
        let expanded = CalledProgram::expanded_files(&name, &program, settings.dialect, callable)?;
        let (called, text) = match expanded {
            Some((called, text)) => (Some(called), CalledProgram::numbered(text, settings.dialect)),
            None => (None, program),
        };
        let mut new = Vec::with_capacity(text.len() + text.len() / 8);
        let summary = rewrite_feed_lines(|| Ok(text.as_slice()), &settings, &mut new).map_err(|why| match &called {
            Some(called) => why.of_called(called, &name),
            None => Failure::input(&name, why),
        })?;
        let called_files = called.map_or_else(Vec::new, |called| called.called_files());
        Ok((new, to_json(&summary), to_json(&called_files)))
    };
    let (text, summary, called_files) = py.detach(rewrite).map_err(|failure: Failure| raised(py, &failure))?;
    Ok((PyBytes::new(py, &text), summary, called_files))
}

/// Returns the files of an example job.
///
/// # Errors
/// If the part is unknown, or the numbers describe none.
#[pyfunction]
pub fn example_job<'py>(py: Python<'py>, part: &str, size_mm: f64) -> PyResult<Bound<'py, PyDict>> {
    let job = match part {
        "patch" => NewJob::Patch { size_mm },
        "propeller" => NewJob::Propeller { series: Series::Dtmb4119, diameter_mm: size_mm },
        _ => return Err(wrong(format!("part: must be patch or propeller, is {part}"))),
    };
    let files = PyDict::new(py);
    for (name, bytes) in facemill::new_job::new_job(&job).map_err(wrong)? {
        files.set_item(name, PyBytes::new(py, &bytes))?;
    }
    Ok(files)
}
