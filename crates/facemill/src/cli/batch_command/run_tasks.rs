//! `facemill batch run`.

use std::ffi::OsStr;
use std::path::PathBuf;
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

use clap::Args;
use facemill::batch::format::report_file::Measure;
use facemill::batch::memory::can_bound_memory;
use facemill::batch::report::batch_report;
use facemill::batch::run::scheduler::{EndOfTask, RunSettings, RunSummary, Watch, run_tasks};
use facemill::batch::store::Store;
use facemill::{Failure, clock};

use crate::cli::batch_command::run_progress::RunProgress;
use crate::cli::batch_command::tables::{counts_line, failure_lines};
use crate::cli::batch_command::{BatchOptions, OutOption, keyed};
use crate::cli::output::say;

#[derive(Args)]
pub(super) struct RunArguments {
    #[command(flatten)]
    pub(super) batch: BatchOptions,
    #[command(flatten)]
    out: OutOption,
    /// Tasks at once, 1 to 1024; default: one for each processor
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Threads of each task, 1 to 1024; default: the processors, shared out among the tasks at work
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Bound of each task's address space: a task beyond it ends as out of memory, and the others
    /// go on
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(64..))]
    max_memory: Option<u64>,
    /// Tries after the first for tasks that are killed or run out of memory
    #[arg(long, value_name = "N", default_value_t = 0)]
    retries: usize,
    /// Start no more tasks after one with an exit code other than 0
    #[arg(long, conflicts_with = "keep_going")]
    fail_fast: bool,
    /// Run all tasks, whatever becomes of others (the default)
    #[arg(long)]
    keep_going: bool,
    /// Also run tasks again whose input was wrong, and is the same
    #[arg(long)]
    retry_failed: bool,
    /// Time after which a task is taken over from another run whose process gives no sign of life:
    /// it or its machine is frozen
    #[arg(long, value_name = "S", default_value_t = 300, value_parser = clap::value_parser!(u64).range(1..))]
    lock_patience: u64,
    /// Report the progress as JSON on standard error, an object on each line (docs/batch.md)
    #[arg(long)]
    json_progress: bool,
    /// Print errors only
    #[arg(short, long)]
    quiet: bool,
}

pub(super) fn run(arguments: &RunArguments, allow: &[PathBuf]) -> Result<ExitCode, Failure> {
    crate::cli::progress::watch_interrupts().map_err(Failure::Internal)?;
    arguments.max_memory.map_or(Ok(()), |_| can_bound_memory())?;
    let began = Instant::now();
    let batch = arguments.batch.read()?;
    let folder = arguments.out.folder(&arguments.batch);
    let store = Store::open(&folder)?;
    store.clear_left_behind()?;
    store.keep_batch(&batch.text)?;
    let tasks = keyed(&batch);
    let program = own_program()?;
    let command = || {
        let mut command = Command::new(&program);
        #[cfg(unix)]
        std::os::unix::process::CommandExt::arg0(&mut command, "facemill");
        command.args(allow.iter().flat_map(|folder| [OsStr::new("--allow"), folder.as_os_str()]));
        command.args(["batch", "task", "--given", "--out"]).arg(&folder).arg(&arguments.batch.batch);
        if arguments.batch.allow_outside {
            command.arg("--allow-outside");
        }
        if let Some(mib) = arguments.max_memory {
            command.args(["--max-memory", &mib.to_string()]);
        }
        command
    };
    let settings = RunSettings {
        at_once: arguments.jobs.map(usize::from),
        threads: arguments.threads.map(usize::from),
        max_memory_mib: arguments.max_memory,
        retries: arguments.retries,
        fail_fast: arguments.fail_fast,
        retry_failed: arguments.retry_failed,
        lock_patience: Some(Duration::from_secs(arguments.lock_patience)),
    };
    let progress = RunProgress::new(arguments.quiet, arguments.json_progress);
    // From now on the scheduler ends the processes and itself, and not the handler.
    if !crate::cli::progress::start_writing() {
        return Err(Failure::Interrupted);
    }
    let summary = match run_tasks(&tasks, &store, settings, &command, &progress as &dyn Watch) {
        Err(Failure::Interrupted) => {
            progress.finish();
            progress.ended(130);
            eprintln!("facemill: interrupted; results so far are kept, and the same command goes on");
            return Ok(ExitCode::from(130));
        }
        summary => summary?,
    };
    progress.finish();
    let code = summary.exit_code(&tasks);
    progress.ended(code);
    if !arguments.quiet {
        let report = batch_report(&batch, &tasks, &store, None, Measure::Time)?;
        let RunSummary { started, ends } = &summary;
        let time = clock(began.elapsed().as_secs_f64());
        let place = folder.display();
        let run = format!("{started} processes in {time}; results in {place}\n");
        say(&[counts_line(&report.counts), failure_lines(&report), unrecorded(&store, ends), run].concat())?;
    }
    Ok(ExitCode::from(code))
}

/// Returns the path of this program: of the one that runs, also if another one has its name since.
fn own_program() -> Result<PathBuf, Failure> {
    if cfg!(target_os = "linux") {
        return Ok(PathBuf::from("/proc/self/exe"));
    }
    std::env::current_exe().map_err(|e| Failure::Internal(format!("cannot find this program: {e}")))
}

/// Returns lines on the failures that could not be recorded, as on a full disk.
fn unrecorded(store: &Store, ends: &std::collections::BTreeMap<String, EndOfTask>) -> String {
    let line = |(key, end): (&String, &EndOfTask)| match end {
        EndOfTask::Failed(failed) if store.failure(key).is_none() => {
            Some(format!("  task {} failed, which could not be recorded: {}\n", failed.task.number, failed.cause))
        }
        _ => None,
    };
    ends.iter().filter_map(line).collect()
}
