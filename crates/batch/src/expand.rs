//! Batches read and expanded into tasks.

pub mod axes;
pub(crate) mod pattern;

use std::path::{Component, Path, PathBuf};

use facemill_file_format::from_json;
use facemill_job::failure::Failure;
use facemill_job::files;
use facemill_job::format::job_file::JobFile;
use facemill_job::load::job_source::job_path;
use facemill_job::validate::tools::n_programs;
use serde_json::Value;

use crate::expand::axes::{Variants, axis_names, variants};
use crate::expand::pattern::matches;
use crate::format::batch_file::{BatchFile, JobsFile, TaskKindFile};
use crate::format::task_file::{Task, TaskSetting};

/// Bounds of a batch, which may come from someone else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BatchBounds {
    /// Largest number of tasks.
    pub tasks: usize,
    /// Whether the batch may name files outside its folder.
    pub outside: bool,
}

impl Default for BatchBounds {
    /// Returns 100,000 tasks, and no files outside.
    fn default() -> Self {
        Self { tasks: 100_000, outside: false }
    }
}

/// Batch with its jobs and programs found. A task is computed from its number, so a batch of many
/// variants takes no memory.
#[derive(Clone, Debug)]
pub struct Batch {
    /// The batch file.
    pub path: PathBuf,
    /// Its content.
    pub file: BatchFile,
    /// Its text.
    pub text: Vec<u8>,
    jobs: Vec<JobOfBatch>,
    variants: Variants,
    /// Programs, relative to the batch; `None` alone if setups are planned.
    programs: Vec<Option<String>>,
    n_tasks: usize,
}

/// Job of a batch.
#[derive(Clone, Debug)]
struct JobOfBatch {
    /// Path relative to the batch.
    name: String,
    n_setups: usize,
    /// Number of tasks of the jobs before.
    before: usize,
}

impl Batch {
    /// Reads a batch, finds its jobs and programs, and counts their setups. A job that cannot be
    /// read counts as one task, which fails.
    ///
    /// # Errors
    /// If the file cannot be read or is wrong, names files outside its folder against the bounds,
    /// has no task, or more than the bounds permit; the message names file and field.
    pub fn read(path: &Path, bounds: BatchBounds) -> Result<Self, Failure> {
        let text = files::read_text(path)?;
        let file: BatchFile = from_json(&text).map_err(|e| Failure::input(path, e))?;
        let wrong = |message: String| Failure::input(path, message);
        let names = match &file.jobs {
            JobsFile::List(names) => names.clone(),
            JobsFile::Pattern(pattern) => {
                found(path, "jobs.pattern", pattern, bounds)?.into_iter().filter(|name| name != &own(path)).collect()
            }
            JobsFile::Sweep(sweep) => vec![sweep.job.clone()],
        };
        let variants = match &file.jobs {
            JobsFile::Sweep(sweep) => variants(sweep).map_err(wrong)?,
            JobsFile::List(_) | JobsFile::Pattern(_) => Variants::default(),
        };
        check_numbers(&file.task).map_err(wrong)?;
        let programs = match &file.task {
            TaskKindFile::Plan(_) => vec![None],
            TaskKindFile::Verify(verify) => programs(path, "task.verify.programs", &verify.programs, bounds)?,
            TaskKindFile::Lengths(lengths) => programs(path, "task.lengths.programs", &lengths.programs, bounds)?,
        };
        let mut jobs = Vec::new();
        let mut n_tasks: usize = 0;
        for (k, name) in names.into_iter().enumerate() {
            let field = match &file.jobs {
                JobsFile::List(_) => format!("jobs.list[{k}]"),
                JobsFile::Pattern(_) => "jobs.pattern".to_owned(),
                JobsFile::Sweep(_) => "jobs.sweep.job".to_owned(),
            };
            check_inside(path, &field, &name, bounds)?;
            // The file that is read: of a folder that is named, its job may be a link.
            let read = job_path(&folder(path).join(&name));
            let own = read.strip_prefix(folder(path)).unwrap_or(&read);
            check_inside(path, &field, &own.to_string_lossy(), bounds)?;
            let n_setups = n_setups(&read);
            let of_job = variants.len().checked_mul(n_setups).and_then(|n| n.checked_mul(programs.len()));
            jobs.push(JobOfBatch { name, n_setups, before: n_tasks });
            let sum = of_job.and_then(|n| n.checked_add(n_tasks)).filter(|n| *n <= bounds.tasks);
            n_tasks = sum.ok_or_else(|| {
                let most = bounds.tasks;
                wrong(format!("jobs: has more than {most} tasks; make several batches of it, or raise --max-tasks"))
            })?;
        }
        if n_tasks == 0 {
            return Err(wrong("jobs: there are none; give at least one".to_owned()));
        }
        Ok(Self { path: path.to_owned(), file, text, jobs, variants, programs, n_tasks })
    }

    /// Returns the number of tasks.
    pub fn n_tasks(&self) -> usize {
        self.n_tasks
    }

    /// Returns the names of the axes, in their order; none if the batch is no sweep.
    pub fn axes(&self) -> Vec<String> {
        match &self.file.jobs {
            JobsFile::Sweep(sweep) => axis_names(sweep),
            JobsFile::List(_) | JobsFile::Pattern(_) => Vec::new(),
        }
    }

    /// Returns the task of a number from 1; `None` if there is none. The order is jobs, variants,
    /// setups, programs, the last changing fastest.
    pub fn task(&self, number: usize) -> Option<Task> {
        let index = number.checked_sub(1).filter(|index| *index < self.n_tasks)?;
        let job = &self.jobs[self.jobs.partition_point(|job| job.before <= index) - 1];
        let rest = index - job.before;
        let (rest, program) = (rest / self.programs.len(), rest % self.programs.len());
        let (variant, setup) = (rest / job.n_setups, rest % job.n_setups);
        let chosen = self.variants.variant(variant);
        let path = |name: &str| folder(&self.path).join(name).to_string_lossy().into_owned();
        Some(Task {
            number,
            job: job_path(Path::new(&path(&job.name))).to_string_lossy().into_owned(),
            name: job.name.clone(),
            axes: chosen.iter().map(|value| (value.axis.clone(), value.label.clone())).collect(),
            settings: chosen
                .into_iter()
                .flat_map(|value| value.settings)
                .map(|(key, value)| TaskSetting { key, value })
                .collect(),
            setup,
            kind: self.file.task.clone(),
            program: self.programs[program].as_deref().map(path),
        })
    }

    /// Returns all tasks in their order.
    pub fn tasks(&self) -> impl Iterator<Item = Task> {
        (1..=self.n_tasks).filter_map(|number| self.task(number))
    }
}

/// Refuses lengths out of their ranges.
fn check_numbers(task: &TaskKindFile) -> Result<(), String> {
    let (kind, cell) = match task {
        TaskKindFile::Plan(plan) => ("plan", plan.stock_cell_mm),
        TaskKindFile::Verify(verify) => ("verify", verify.stock_cell_mm),
        TaskKindFile::Lengths(lengths) => ("lengths", lengths.stock_cell_mm),
    };
    if let Some(cell) = cell.filter(|cell| !(*cell > 0.0 && cell.is_finite())) {
        return Err(format!("task.{kind}.stock_cell_mm: must be above 0, is {cell}"));
    }
    if let TaskKindFile::Lengths(lengths) = task {
        for (key, value) in [("margin_mm", lengths.margin_mm), ("longest_mm", lengths.longest_mm)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(format!("task.lengths.{key}: must be at least 0, is {value}"));
            }
        }
    }
    Ok(())
}

/// Returns the name of a file, without its folder.
fn own(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Returns the folder of a batch file.
pub fn folder(batch: &Path) -> PathBuf {
    batch.parent().map(Path::to_owned).unwrap_or_default()
}

/// Returns the programs that match a pattern.
fn programs(batch: &Path, field: &str, pattern: &str, bounds: BatchBounds) -> Result<Vec<Option<String>>, Failure> {
    Ok(found(batch, field, pattern, bounds)?.into_iter().map(Some).collect())
}

/// Returns the names that match a pattern, all of them inside.
fn found(batch: &Path, field: &str, pattern: &str, bounds: BatchBounds) -> Result<Vec<String>, Failure> {
    let wrong = |why: String| Failure::input(batch, format!("{field}: {why}"));
    check_inside(batch, field, pattern, bounds)?;
    let names = matches(&folder(batch), pattern, bounds.tasks).map_err(wrong)?;
    names.iter().try_for_each(|name| check_inside(batch, field, name, bounds))?;
    if names.is_empty() {
        return Err(wrong(format!("no file matches \"{pattern}\"")));
    }
    Ok(names)
}

/// Refuses a name that leads out of the folder of the batch, after links are resolved; a file that
/// does not exist, too, if its name has steps outside.
fn check_inside(batch: &Path, field: &str, name: &str, bounds: BatchBounds) -> Result<(), Failure> {
    if bounds.outside {
        return Ok(());
    }
    let base = folder(batch);
    let base = if base.as_os_str().is_empty() { Path::new(".") } else { &base };
    let path = base.join(name);
    let inside = match (base.canonicalize(), path.canonicalize()) {
        (Ok(base), Ok(path)) => path.starts_with(base),
        _ => Path::new(name).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir)),
    };
    if inside {
        return Ok(());
    }
    let what = format!("{field}: {name} is outside the folder of the batch; allow it with --allow-outside");
    Err(Failure::input(batch, what))
}

/// Returns the number of setups of a job, each with one tool; 1 if it cannot be read, which its
/// task reports.
fn n_setups(job: &Path) -> usize {
    let Ok(text) = files::read_text(job) else { return 1 };
    let of_value = || Some(from_json::<Value>(&text).ok()?.get("setups")?.as_array()?.len());
    from_json::<JobFile>(&text).ok().map(n_programs).or_else(of_value).unwrap_or(1).max(1)
}

#[cfg(test)]
#[path = "../tests/unit/expand.rs"]
mod tests;
