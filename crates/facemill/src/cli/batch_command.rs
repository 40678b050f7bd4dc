//! `facemill batch`.

mod run_progress;
mod run_tasks;
mod single_task;
mod tables;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Subcommand, ValueEnum};
use facemill::Failure;
use facemill::batch::expand::{Batch, BatchBounds};
use facemill::batch::format::report_file::Measure;
use facemill::batch::format::task_file::{ListedTask, TASKS_FORMAT, TasksFile};
use facemill::batch::key::{KeyedTask, Keys};
use facemill::batch::report::batch_report;
use facemill::batch::report::html::html;
use facemill::batch::report::table::csv;
use facemill::batch::store::Store;
use facemill::file_format::to_json;
use facemill::files;

use crate::cli::batch_command::run_tasks::RunArguments;
use crate::cli::batch_command::single_task::TaskArguments;
use crate::cli::batch_command::tables::{best_lines, counts_line, failure_lines, task_lines};
use crate::cli::output::say;

/// Text on exit codes behind the options of `batch run`.
const RUN_CODES: &str = "\
Exit codes:
  0    every task has a result of exit code 0
  1    all tasks are at their end, but some do not meet their job (exit codes 1 and 4) or have
       wrong input (2)
  2    wrong batch or command line
  3    a task failed otherwise (killed, out of memory, not written, its input changed), or was not
       run; run the same command again
  130  interrupted; run the same command to go on";

/// Text on exit codes behind the options of `batch task`.
const TASK_CODES: &str = "\
Exit codes:
  0, 1, 4  the result is there; the code is that of the task, as of `facemill plan`
  2        wrong input
  3        the result cannot be written, an input changed, or an internal failure
  75       another process works on the task
  130      interrupted";

#[derive(Args)]
pub(crate) struct BatchArguments {
    #[command(subcommand)]
    command: BatchCommand,
}

#[derive(Subcommand)]
enum BatchCommand {
    /// Runs the tasks that have no result yet
    #[command(after_help = RUN_CODES)]
    Run(RunArguments),
    /// Lists the tasks, their keys and the files that they need
    Expand {
        #[command(flatten)]
        batch: BatchOptions,
        /// Print JSON (facemill schema batch-tasks)
        #[arg(long, conflicts_with = "numbers")]
        json: bool,
        /// Print the numbers alone, one on each line
        #[arg(long)]
        numbers: bool,
    },
    /// Shows the state of every task
    Status {
        #[command(flatten)]
        batch: BatchOptions,
        #[command(flatten)]
        out: OutOption,
        /// Print JSON (facemill schema batch-report)
        #[arg(long)]
        json: bool,
    },
    /// Compares the results: writes report.csv, report.json and report.html beside them
    Report {
        #[command(flatten)]
        batch: BatchOptions,
        #[command(flatten)]
        out: OutOption,
        /// Find the best value of this axis for each combination of the others; default: the best
        /// task of each job
        #[arg(long, value_name = "AXIS")]
        best_of: Option<String>,
        /// Figure whose least value is the best
        #[arg(long, value_enum, default_value = "time")]
        by: MeasureOption,
    },
    /// Removes what killed processes left behind
    Clean {
        #[command(flatten)]
        batch: BatchOptions,
        #[command(flatten)]
        out: OutOption,
        /// Also remove records of failures
        #[arg(long)]
        failed: bool,
        /// Also remove results and failures of tasks that the batch does not have
        #[arg(long)]
        unneeded: bool,
        /// With --unneeded: also if inputs of the batch cannot be read, or another batch was run
        /// last
        #[arg(long, requires = "unneeded")]
        force: bool,
    },
    /// Runs one task in this process
    #[command(after_help = TASK_CODES)]
    Task(TaskArguments),
}

#[derive(Args)]
struct BatchOptions {
    /// Batch file
    batch: PathBuf,
    /// Permit the batch and its jobs to name files outside the batch's folder
    #[arg(long)]
    allow_outside: bool,
    /// Largest number of tasks
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    max_tasks: usize,
}

#[derive(Args)]
struct OutOption {
    /// Folder of the results; default: out/<name of the batch file>
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum MeasureOption {
    Time,
    Cusp,
    Length,
    Efficiency,
}

impl From<MeasureOption> for Measure {
    fn from(option: MeasureOption) -> Self {
        match option {
            MeasureOption::Time => Self::Time,
            MeasureOption::Cusp => Self::Cusp,
            MeasureOption::Length => Self::Length,
            MeasureOption::Efficiency => Self::Efficiency,
        }
    }
}

impl BatchArguments {
    /// Returns the folders in which jobs may name files, besides their own.
    pub(crate) fn allowed(&self, allow: &[PathBuf]) -> Vec<PathBuf> {
        let options = match &self.command {
            BatchCommand::Run(run) => &run.batch,
            BatchCommand::Task(task) => &task.batch,
            BatchCommand::Expand { batch, .. }
            | BatchCommand::Status { batch, .. }
            | BatchCommand::Report { batch, .. }
            | BatchCommand::Clean { batch, .. } => batch,
        };
        let own = facemill::batch::expand::folder(&options.batch);
        let own = if own.as_os_str().is_empty() { PathBuf::from(".") } else { own };
        let anywhere = options.allow_outside.then(|| PathBuf::from("/"));
        allow.iter().cloned().chain([own]).chain(anywhere).collect()
    }
}

impl BatchOptions {
    fn read(&self) -> Result<Batch, Failure> {
        Batch::read(&self.batch, BatchBounds { tasks: self.max_tasks, outside: self.allow_outside })
    }
}

impl OutOption {
    fn folder(&self, batch: &BatchOptions) -> PathBuf {
        let name = batch.batch.file_stem().map_or_else(|| PathBuf::from("batch"), PathBuf::from);
        self.out.clone().unwrap_or_else(|| Path::new("out").join(name))
    }

    /// Returns the results, which must be there.
    fn existing(&self, batch: &BatchOptions) -> Result<Store, Failure> {
        Store::existing(&self.folder(batch))
    }
}

/// Returns all tasks with their keys.
fn keyed(batch: &Batch) -> Vec<KeyedTask> {
    let mut keys = Keys::default();
    batch.tasks().map(|task| keys.of(task)).collect()
}

pub(crate) fn run(arguments: &BatchArguments, allow: &[PathBuf]) -> Result<ExitCode, Failure> {
    match &arguments.command {
        BatchCommand::Run(arguments) => return run_tasks::run(arguments, allow),
        BatchCommand::Task(arguments) => return single_task::run(arguments),
        BatchCommand::Expand { batch, json, numbers } => expand(&batch.read()?, *json, *numbers)?,
        BatchCommand::Status { batch, out, json } => {
            let (read, store) = (batch.read()?, out.existing(batch)?);
            let report = batch_report(&read, &keyed(&read), &store, None, Measure::Time)?;
            if *json {
                say(&to_json(&report))?;
            } else {
                let lines = [task_lines(&report), counts_line(&report.counts)];
                say(&lines.concat())?;
            }
        }
        BatchCommand::Report { batch, out, best_of, by } => {
            let (read, store) = (batch.read()?, out.existing(batch)?);
            write_report(&read, &store, best_of.as_deref(), (*by).into())?;
        }
        BatchCommand::Clean { batch, out, failed, unneeded, force } => {
            let (read, store) = (batch.read()?, out.existing(batch)?);
            let needed = unneeded.then(|| needed_keys(&read, &store, *force)).transpose()?;
            say(&clean(&store, *failed, needed.as_ref())?)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn expand(batch: &Batch, json: bool, numbers: bool) -> Result<(), Failure> {
    if numbers {
        let numbers: String = (1..=batch.n_tasks()).map(|number| format!("{number}\n")).collect();
        return say(&numbers);
    }
    let tasks = keyed(batch);
    if json {
        let listed = tasks.into_iter().map(|KeyedTask { task, key, inputs, unreadable }| ListedTask {
            task,
            key,
            inputs,
            unreadable,
        });
        return say(&to_json(&TasksFile { format: TASKS_FORMAT, tasks: listed.collect() }));
    }
    let line = |keyed: &KeyedTask| {
        let axes: Vec<String> = keyed.task.axes.iter().map(|(axis, label)| format!("{axis} {label}")).collect();
        let setup = keyed.task.setup + 1;
        let program = keyed.task.program.as_ref().map_or(String::new(), |program| format!(", {program}"));
        let why = keyed.unreadable.as_ref().map_or(String::new(), |why| format!("  CANNOT BE READ: {why}"));
        let (number, name) = (keyed.task.number, &keyed.task.name);
        format!("{number:>6}  {:.12}  {name}, setup {setup}{program}  {}{why}\n", keyed.key, axes.join(", "))
    };
    say(&tasks.iter().map(line).collect::<String>())
}

fn write_report(batch: &Batch, store: &Store, best_of: Option<&str>, measure: Measure) -> Result<(), Failure> {
    let report = batch_report(batch, &keyed(batch), store, best_of, measure)?;
    let title = batch.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let written = [
        ("report.csv".to_owned(), csv(&report).into_bytes()),
        ("report.json".to_owned(), to_json(&report).into_bytes()),
        ("report.html".to_owned(), html(&report, &title).into_bytes()),
    ];
    files::write_all(store.folder(), &written)?;
    let place = format!("written to {}: report.csv, report.json, report.html\n", store.folder().display());
    say(&[counts_line(&report.counts), failure_lines(&report), best_lines(&report), place].concat())
}

/// Returns the keys of the batch.
///
/// # Errors
/// If they are not sure to be those of its results, unless forced: a file of a job cannot be read
/// or may not be named here, or the results are those of another batch.
fn needed_keys(batch: &Batch, store: &Store, force: bool) -> Result<BTreeSet<String>, Failure> {
    let tasks = keyed(batch);
    if !force {
        let force = "nothing was removed; --force removes all results that it does not have";
        if let Some((task, why)) = tasks.iter().find_map(|task| Some((task, task.unreadable.as_ref()?))) {
            let number = task.task.number;
            let what = format!("task {number} cannot be read, so its results are not known ({why}); {force}");
            return Err(Failure::input(&batch.path, what));
        }
        if !store.is_last_batch(&batch.text) {
            let what = "is not the batch that was run last in this folder; run it, so that its results are known";
            return Err(Failure::input(&batch.path, format!("{what}; {force}")));
        }
    }
    Ok(tasks.into_iter().map(|task| task.key).collect())
}

/// Removes what is left behind, records of failures, and results and failures of other keys than
/// those needed. Returns lines on them.
fn clean(store: &Store, failed: bool, needed: Option<&BTreeSet<String>>) -> Result<String, Failure> {
    let unfinished = store.clear_left_behind()?;
    let is_unneeded = |key: &&String| needed.is_some_and(|needed| !needed.contains(*key));
    let (mut lines, mut results, mut failures) = (String::new(), 0, 0);
    for key in store.keys().iter().filter(is_unneeded) {
        let of = store.result(key).map(|result| format!("{}, {}", result.job, result.setup)).unwrap_or_default();
        if store.remove(key)? {
            lines += &format!("  result {key:.12}  {of}\n");
            results += 1;
        }
    }
    for key in store.failed_keys().iter().filter(|key| failed || is_unneeded(key)) {
        store.forget_failure(key)?;
        lines += &format!("  failure {key:.12}\n");
        failures += 1;
    }
    let counts =
        format!("removed {unfinished} unfinished results, {results} results, {failures} records of failures\n");
    Ok(counts + &lines)
}
