//! Expansion, tasks and results of batches.

use std::path::{Component, Path, PathBuf};

use facemill::batch::expand::{Batch, BatchBounds};
use facemill::batch::format::result_file::{FailedFile, FailureKind, ResultFile};
use facemill::batch::format::task_file::{ListedTask, TASKS_FORMAT, TasksFile};
use facemill::batch::given::GivenTask;
use facemill::batch::key::{KeyedTask, Keys};
use facemill::batch::perform::{TaskEnd, perform};
use facemill::batch::run::cause::cause_of;
use facemill::batch::store::names::is_key;
use facemill::batch::store::{RESULT, Store, TIMES};
use facemill::file_format::{from_json, to_json};
use facemill::{Failure, files};
use pyo3::prelude::*;

use crate::failure::{raised, wrong};
use crate::interrupt::interruptible;

/// Confines jobs of this process to their own folder and these, for good.
#[pyfunction]
pub fn confine(allowed: Vec<PathBuf>) {
    files::confine_jobs(allowed);
}

/// Bounds the address space of this process.
///
/// # Errors
/// If the system does not permit it.
#[pyfunction]
pub fn bound_memory(py: Python<'_>, mib: u64) -> PyResult<()> {
    facemill::batch::memory::bound_memory(mib).map_err(|failure| raised(py, &failure))
}

/// Returns the checksum of bytes, by which files and keys are named.
#[pyfunction]
pub fn checksum(bytes: &[u8]) -> String {
    facemill::formats::checksum(bytes)
}

/// Returns the tasks of a batch with their keys, as `facemill batch expand --json` lists them.
///
/// # Errors
/// As [`Batch::read`].
#[pyfunction]
pub fn expand(py: Python<'_>, batch: PathBuf, max_tasks: usize, allow_outside: bool) -> PyResult<String> {
    let tasks = interruptible(py, |_| {
        let batch = Batch::read(&batch, BatchBounds { tasks: max_tasks, outside: allow_outside })?;
        let mut keys = Keys::default();
        let listed = batch.tasks().map(|task| {
            let KeyedTask { task, key, inputs, unreadable } = keys.of(task);
            ListedTask { task, key, inputs, unreadable }
        });
        Ok(listed.collect())
    })?;
    Ok(to_json(&TasksFile { format: TASKS_FORMAT, tasks }))
}

/// Runs a task on the terms with which it is given, and files its result or failure in a folder of
/// results, written through to the disk unless it is passed on. Returns `filed`, `locked` or
/// `changed`.
///
/// # Errors
/// As [`perform`].
#[pyfunction]
pub fn run_task(py: Python<'_>, given: &str, out: PathBuf, passing: bool) -> PyResult<&'static str> {
    let given: GivenTask = from_json(given.as_bytes()).map_err(wrong)?;
    let end = interruptible(py, |stages| {
        let store = if passing { Store::open_passing(&out) } else { Store::open(&out) }?;
        perform(&given.task, given.terms(), &store, stages, &|_| {})
    })?;
    Ok(match end {
        TaskEnd::Filed(_) => "filed",
        TaskEnd::Locked => "locked",
        TaskEnd::InputChanged => "changed",
    })
}

/// Makes a folder of results ready, and keeps a copy of the batch there.
///
/// # Errors
/// If it cannot be written to.
#[pyfunction]
pub fn prepare_store(py: Python<'_>, out: PathBuf, batch: &[u8]) -> PyResult<()> {
    let prepare = || {
        let store = Store::open(&out)?;
        store.clear_left_behind()?;
        store.keep_batch(batch)
    };
    py.detach(prepare).map_err(|failure| raised(py, &failure))
}

/// Returns the exit code of each key's result, or -1 for a failure that its input causes, or `None`
/// for a task that is to be run.
#[pyfunction]
pub fn stored(py: Python<'_>, out: PathBuf, keys: Vec<String>) -> Vec<Option<i16>> {
    let store = Store::at(&out);
    let state = |key: &String| {
        let failed_by_input = || store.failure(key).filter(|failed| failed.kind == FailureKind::Input).map(|_| -1);
        store.result(key).map(|result| i16::from(result.exit_code)).or_else(failed_by_input)
    };
    py.detach(|| keys.iter().map(state).collect())
}

/// Returns kind and text of the cause for which a process ended, by its exit code or signal and the
/// end of its standard error.
#[pyfunction]
pub fn cause_of_end(
    exit_code: Option<i32>,
    signal: Option<i32>,
    errors: &str,
    max_memory: Option<u64>,
) -> (FailureKindName, String) {
    let cause = cause_of((exit_code, signal), errors, max_memory);
    (to_json(&cause.kind).trim().trim_matches('"').to_owned(), cause.text)
}

/// Name of a kind of failures, as in files.
type FailureKindName = String;

/// Returns the exit code of a result that a worker has filed in a shared folder, by the text of its
/// `result.json`.
///
/// # Errors
/// If it is not the result of this key.
#[pyfunction]
pub fn exit_code_of(key: &str, text: &[u8]) -> PyResult<u8> {
    let result: ResultFile = from_json(text).map_err(|e| wrong(format!("{key}: result.json: {e}")))?;
    if result.key == key { Ok(result.exit_code) } else { Err(wrong(format!("{key}: has the key {}", result.key))) }
}

/// Files a result that came from elsewhere, whole, under its key; if there is one already, leaves
/// it. Returns its exit code.
///
/// # Errors
/// If it is not the result of this key, has other files than it lists or names outside its folder,
/// or cannot be written.
#[pyfunction]
pub fn file_result(py: Python<'_>, out: PathBuf, key: &str, all: Vec<(String, Vec<u8>)>) -> PyResult<u8> {
    let filed = py.detach(|| {
        let result = check_result(key, &all).map_err(|why| Failure::input(Path::new(key), why))?;
        let store = Store::open(&out)?;
        if let Some(result) = store.result(key) {
            return Ok(result.exit_code);
        }
        store.file(key, &all)?;
        Ok(result.exit_code)
    });
    filed.map_err(|failure: Failure| raised(py, &failure))
}

/// Checks a result from elsewhere.
fn check_result(key: &str, all: &[(String, Vec<u8>)]) -> Result<ResultFile, String> {
    if !is_key(key) {
        return Err("is no key".to_owned());
    }
    let text = all.iter().find(|(name, _)| name == RESULT).ok_or("has no result.json")?;
    let result: ResultFile = from_json(&text.1).map_err(|e| format!("result.json: {e}"))?;
    if result.key != key {
        return Err(format!("result.json: has the key {}", result.key));
    }
    let mut names: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).collect();
    names.sort_unstable();
    let mut listed: Vec<&str> = result.files.iter().map(String::as_str).chain([RESULT, TIMES]).collect();
    listed.sort_unstable();
    if names != listed {
        return Err(format!("has the files {}, and lists {}", names.join(", "), listed.join(", ")));
    }
    let is_plain = |name: &&str| {
        let mut parts = Path::new(name).components();
        matches!((parts.next(), parts.next()), (Some(Component::Normal(_)), None)) && !name.contains('\\')
    };
    match names.iter().find(|name| !is_plain(name)) {
        Some(name) => Err(format!("has a file named {name}")),
        None => Ok(result),
    }
}

/// Records the failure of a task of this key.
///
/// # Errors
/// If the text is no failure of this key, or cannot be written.
#[pyfunction]
pub fn file_failure(py: Python<'_>, out: PathBuf, key: &str, text: &[u8]) -> PyResult<()> {
    let failed: FailedFile = from_json(text).map_err(wrong)?;
    if failed.key != key {
        return Err(wrong(format!("failure of the key {}, and not of {key}", failed.key)));
    }
    let record = || Store::open(&out)?.record_failure(&failed);
    py.detach(record).map_err(|failure| raised(py, &failure))
}
