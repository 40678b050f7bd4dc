//! `facemill batch task`.

use std::io::Read;
use std::process::ExitCode;

use clap::Args;
use facemill::Failure;
use facemill::batch::format::task_file::Task;
use facemill::batch::given::given_task;
use facemill::batch::memory::bound_memory;
use facemill::batch::perform::{TaskEnd, TaskTerms, perform};
use facemill::batch::run::scheduler::LOCKED_CODE;
use facemill::batch::store::Store;

use crate::cli::batch_command::{BatchOptions, OutOption};
use crate::cli::output::say;
use crate::cli::progress::Progress;

#[derive(Args)]
pub(super) struct TaskArguments {
    #[command(flatten)]
    pub(super) batch: BatchOptions,
    /// Number of the task, from 1
    #[arg(required_unless_present = "given")]
    number: Option<usize>,
    #[command(flatten)]
    out: OutOption,
    /// Run it only if this is its key, as `batch expand` lists it
    #[arg(long, value_name = "KEY")]
    expect: Option<String>,
    /// Bound of the process's address space
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(64..))]
    max_memory: Option<u64>,
    /// Read key and task from standard input, and end when it is closed
    #[arg(long, hide = true, conflicts_with_all = ["number", "expect"])]
    given: bool,
    /// Print errors only
    #[arg(short, long)]
    quiet: bool,
}

pub(super) fn run(arguments: &TaskArguments) -> Result<ExitCode, Failure> {
    if let Some(mib) = arguments.max_memory {
        bound_memory(mib)?;
    }
    crate::cli::progress::watch_interrupts().map_err(Failure::Internal)?;
    let given = arguments.given.then(|| given_task(&mut std::io::stdin().lock())).transpose()?;
    let (terms, task) = match &given {
        Some(given) => {
            end_with_input();
            (given.terms(), given.task.clone())
        }
        None => (TaskTerms { key: arguments.expect.as_deref(), ..TaskTerms::default() }, numbered(arguments)?),
    };
    let store = Store::open(&arguments.out.folder(&arguments.batch))?;
    let progress = Progress::new(arguments.quiet || arguments.given);
    let end = perform(&task, terms, &store, &progress, &planted_fault)?;
    let code = match end {
        TaskEnd::Filed(code) => {
            if !arguments.given && !arguments.quiet {
                say(&format!("task {}: exit code {code}\n", task.number))?;
            }
            code
        }
        TaskEnd::Locked => {
            eprintln!("facemill: another process works on task {}", task.number);
            LOCKED_CODE
        }
        TaskEnd::InputChanged => {
            eprintln!("facemill: an input of task {} is not as it was expanded; expand the batch again", task.number);
            3
        }
    };
    Ok(ExitCode::from(code))
}

fn numbered(arguments: &TaskArguments) -> Result<Task, Failure> {
    let batch = arguments.batch.read()?;
    let number = arguments.number.unwrap_or_default();
    let n = batch.n_tasks();
    batch.task(number).ok_or_else(|| Failure::input(&batch.path, format!("has tasks 1 to {n}, and no {number}")))
}

/// Ends the process when its standard input is closed: its scheduler is gone, however it went. A
/// result gets its name at once, so none is half written.
fn end_with_input() {
    std::thread::spawn(|| {
        let mut input = std::io::stdin().lock();
        let mut buffer = [0; 64];
        while matches!(input.read(&mut buffer), Ok(1..)) {}
        std::process::exit(130);
    });
}

/// Faults that tests plant in processes of a debug build: `FACEMILL_PLANTED_FAULT` has kinds with
/// numbers of tasks, as in `abort 3 5; panic 4`.
#[cfg(debug_assertions)]
fn planted_fault(task: &Task) {
    let planted = std::env::var("FACEMILL_PLANTED_FAULT").unwrap_or_default();
    for fault in planted.split(';') {
        let mut words = fault.split_whitespace();
        let kind = words.next().unwrap_or_default();
        if !words.any(|word| word.parse() == Ok(task.number) || word == "all") {
            continue;
        }
        match kind {
            "abort" => std::process::abort(),
            "panic" => panic!("planted"),
            "pause" => std::thread::sleep(std::time::Duration::from_millis(300)),
            // Far beyond the bounds that tests set, and far from the memory of a machine.
            "allocate" => {
                let blocks: Vec<Vec<u8>> = (0..32).map(|_| vec![1; 64 << 20]).collect();
                panic!("{} blocks are there", blocks.len());
            }
            other => panic!("unknown fault {other}"),
        }
    }
}

#[cfg(not(debug_assertions))]
fn planted_fault(_: &Task) {}
