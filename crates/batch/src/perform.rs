//! One task, in this process: its job is read whole, its result is filed.

use std::path::Path;
use std::time::Instant;

use facemill_file_format::to_json;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::STOCK_TOLERANCE;
use facemill_job::format::made_from::InputFile;
use facemill_job::format::program_times::ProgramTimes;
use facemill_job::format::report::Report;
use facemill_job::format::report::remaining::RemainingReport;
use facemill_job::format::summary_file::SetupSummary;
use facemill_job::load::job::Job;
use facemill_job::stages::Stages;
use facemill_nc_rewrite::lengths::{LengthsRequest, lengths_of_program};
use facemill_planner::{PlanSettings, Planned, plan_job_setup};
use facemill_verification::program::{VerifyRequest, verify_program};
use facemill_verification::stock_run::CutRequest;

use crate::format::batch_file::{LengthsTaskFile, PlanTaskFile, TaskKindFile, VerifyTaskFile};
use crate::format::result_file::{
    FailedFile, FailureFormat, FailureKind, ResultFile, ResultFormat, TaskFigures, TaskTimes,
};
use crate::format::task_file::Task;
use crate::key::{Keys, TaskProgram, key_of, settings_of};
use crate::memory::peak_mib;
use crate::store::task_lock::TaskLock;
use crate::store::{RESULT, Store, TIMES};

/// End of a task.
#[derive(Debug)]
pub enum TaskEnd {
    /// It has a result, with this exit code: made now, or before.
    Filed(u8),
    /// Another process works on it.
    Locked,
    /// It has none: an input changed since the task was expanded. Nothing was filed.
    InputChanged,
}

/// Terms on which a task is run.
#[derive(Clone, Copy, Debug, Default)]
pub struct TaskTerms<'a> {
    /// Key that it must have; `None`: any.
    pub key: Option<&'a str>,
    /// Its inputs when it had this key; if it has another, the first one that differs is named.
    pub inputs: &'a [InputFile],
    /// Whether to run it although another process has its lock, which gave no sign of life: should
    /// that process go on, both have the same result, and one stays.
    pub is_taken_over: bool,
}

/// Runs a task and files its result; if there is one already, leaves it. Every input is read once,
/// before anything is computed: the key of the result is that of these bytes. `seen` is called when
/// all is read.
///
/// # Errors
/// If the input is wrong, the result cannot be written, or the stages are cancelled; the failure is
/// recorded in the store if it can be. An infeasible job is a result.
pub fn perform(
    task: &Task,
    terms: TaskTerms<'_>,
    store: &Store,
    stages: &dyn Stages,
    seen: &dyn Fn(&Task),
) -> Result<TaskEnd, Failure> {
    let began = Instant::now();
    let read = read_whole(task);
    let key = match &read {
        Ok(read) => read.key.clone(),
        Err(_) => Keys::default().of(task.clone()).key,
    };
    if let Some(expected) = terms.key.filter(|expected| **expected != key) {
        let cause = change_of(&read, terms.inputs);
        store.record_failure(&failed(task, expected, FailureKind::InputChanged, cause, 3))?;
        return Ok(TaskEnd::InputChanged);
    }
    if let Some(result) = store.result(&key) {
        return Ok(TaskEnd::Filed(result.exit_code));
    }
    let mut lock = store.lock(&key)?;
    if lock.is_none() && !terms.is_taken_over {
        return Ok(TaskEnd::Locked);
    }
    lock.iter_mut().for_each(TaskLock::show);
    // The process that had the lock may have filed it.
    if let Some(result) = store.result(&key) {
        return Ok(TaskEnd::Filed(result.exit_code));
    }
    let performed = read.and_then(|read| {
        seen(task);
        let Work { mut files, exit_code, message, figures, stages_s } = work(task, &read, stages)?;
        files.sort_by(|a, b| a.0.cmp(&b.0));
        let result = ResultFile {
            format: ResultFormat::V1,
            key: key.clone(),
            exit_code,
            message,
            job: read.job.file.name.clone(),
            setup: read.job.file.setups[task.setup].name.clone(),
            figures,
            files: files.iter().map(|(name, _)| name.clone()).collect(),
        };
        let times = TaskTimes {
            wall_s: began.elapsed().as_secs_f64(),
            peak_mib: peak_mib(std::process::id()),
            threads: rayon::current_num_threads(),
            stages_s,
        };
        files.push((RESULT.to_owned(), to_json(&result).into_bytes()));
        files.push((TIMES.to_owned(), to_json(&times).into_bytes()));
        store.file(&key, &files)?;
        Ok(TaskEnd::Filed(exit_code))
    });
    // A task that the user stops has not failed: it waits for the next run.
    if let Err(failure) = &performed
        && !matches!(failure, Failure::Interrupted)
    {
        let (kind, code) = kind_of(failure);
        // A full disk takes no record, either; whoever waits for the process sees its exit code.
        let _ = store.record_failure(&failed(task, &key, kind, failure.to_string(), code));
    }
    performed
}

/// Returns the kind of a failure and its exit code.
pub(crate) fn kind_of(failure: &Failure) -> (FailureKind, i32) {
    match failure {
        Failure::Input { .. } | Failure::Read { .. } => (FailureKind::Input, 2),
        Failure::Interrupted => (FailureKind::Interrupted, 130),
        _ => (FailureKind::Internal, 3),
    }
}

pub(crate) fn failed(task: &Task, key: &str, kind: FailureKind, cause: String, exit_code: i32) -> FailedFile {
    FailedFile {
        format: FailureFormat::V1,
        key: key.to_owned(),
        task: task.clone(),
        kind,
        cause,
        exit_code: Some(exit_code),
        signal: None,
        tries: 1,
        peak_mib: None,
    }
}

/// Returns why a task is not run, with the first of its inputs that differs.
fn change_of(read: &Result<ReadTask, Failure>, before: &[InputFile]) -> String {
    let what = match read {
        Err(failure) => failure.to_string(),
        Ok(read) => {
            let other = |of: &[InputFile], input: &&InputFile| !of.contains(input);
            let new = read.inputs.iter().find(|input| other(before, input));
            let first = new.or_else(|| before.iter().find(|input| other(&read.inputs, input)));
            first.filter(|_| !before.is_empty()).map_or_else(String::new, |input| input.file.clone())
        }
    };
    let what = if what.is_empty() { what } else { format!(" ({what})") };
    format!("input changed while it ran{what}; run the batch again")
}

/// Job and program in memory.
struct ReadTask {
    job: Job,
    program: Option<TaskProgram>,
    inputs: Vec<InputFile>,
    key: String,
}

fn read_whole(task: &Task) -> Result<ReadTask, Failure> {
    let settings = settings_of(task)?;
    let (job, inputs) = Job::read_whole(Path::new(&task.job), &settings)?;
    if task.setup >= job.file.setups.len() {
        return Err(job.wrong(format!("has no setup {} with these settings", task.setup + 1)));
    }
    let program = task.program.as_ref().map(|program| TaskProgram::read(Path::new(program), job.post.dialect()));
    let program = program.transpose()?;
    let key = key_of(task, &job.file, &settings, &inputs, program.as_ref());
    Ok(ReadTask { job, program, inputs, key })
}

/// Files and figures of a task.
#[derive(Default)]
struct Work {
    files: Vec<(String, Vec<u8>)>,
    exit_code: u8,
    message: Option<String>,
    figures: TaskFigures,
    stages_s: Vec<(String, f64)>,
}

fn work(task: &Task, read: &ReadTask, stages: &dyn Stages) -> Result<Work, Failure> {
    let program = || -> Result<(&Path, &TaskProgram), Failure> {
        let both = task.program.as_ref().zip(read.program.as_ref());
        let (path, program) = both.ok_or_else(|| read.job.wrong("no program is named"))?;
        if let Some(called) = &program.called {
            let text = read.job.read_program(&program.text, read.job.post.dialect());
            text.map_err(|why| called.unread(why))?;
        }
        Ok((Path::new(path), program))
    };
    let done = match &task.kind {
        TaskKindFile::Plan(plan) => planned(read, task.setup, plan, stages),
        TaskKindFile::Verify(verify) => verified(read, task.setup, program()?, verify, stages),
        TaskKindFile::Lengths(lengths) => lengths_found(read, task.setup, program()?, lengths, stages),
    };
    match done {
        Err(Failure::Infeasible(why)) => Ok(Work { exit_code: 1, message: Some(why), ..Work::default() }),
        Err(Failure::NothingToCut(why)) => Ok(Work { message: Some(why), ..Work::default() }),
        done => done,
    }
}

fn planned(read: &ReadTask, setup: usize, plan: &PlanTaskFile, stages: &dyn Stages) -> Result<Work, Failure> {
    let settings = PlanSettings { verify: plan.verify, certificates: plan.certificates };
    let planned = plan_job_setup(&read.job, setup, settings, plan.stock_cell_mm, stages)?;
    // A file that could not be read at first is not in memory, and may be there since.
    if planned.report.made_from.inputs != read.inputs {
        return Err(Failure::Internal("an input changed while it was read; run the batch again".to_owned()));
    }
    let (exit_code, figures) = (planned.outcome().exit_code(), figures_of(&planned.report));
    let Planned { mut files, chip_table, timings, .. } = planned;
    files.extend(plan.chips.then_some(chip_table));
    let stages_s = timings.into_iter().map(|(name, s)| (name.to_owned(), s)).collect();
    Ok(Work { files, exit_code, message: None, figures, stages_s })
}

fn figures_of(report: &Report) -> TaskFigures {
    let summary = SetupSummary::of(report);
    TaskFigures {
        machine_s: Some(machine_time(&summary.times)),
        planned_fraction: Some(summary.totals.planned_fraction),
        cusp_mm: summary.worst.cusp_mm,
        left_mm: summary.remaining.as_ref().and_then(largest_left),
        gouge_mm: summary.worst.gouge_mm,
        findings: Some(summary.findings),
        faults: Some(summary.faults),
        cutting_length_mm: Some(summary.totals.cutting_length_mm),
        efficiency: largest(summary.efficiency.iter().map(|e| e.efficiency)),
        gauge_length_mm: None,
    }
}

/// Time on the machine, s: by the motion law where there is one, else at constant speed.
fn machine_time(times: &ProgramTimes) -> f64 {
    let by_law = times.cutting_s.zip(times.rapid_s).map(|(cutting, rapid)| cutting + rapid);
    by_law.unwrap_or(times.constant_cutting_s + times.constant_rapid_s)
}

/// Largest height that any operation leaves, mm.
fn largest_left(remaining: &RemainingReport) -> Option<f64> {
    largest(remaining.operations.iter().filter_map(|o| o.largest.as_ref()).map(|place| place.height_mm))
}

/// Returns the largest number; `None` of none.
fn largest(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    numbers.reduce(f64::max)
}

fn cut_on(cell: Option<f64>) -> Option<CutRequest> {
    cell.map(|cell| CutRequest::on_lines(cell, STOCK_TOLERANCE))
}

fn verified(
    read: &ReadTask,
    setup: usize,
    (path, program): (&Path, &TaskProgram),
    task: &VerifyTaskFile,
    stages: &dyn Stages,
) -> Result<Work, Failure> {
    let request = VerifyRequest {
        setup,
        certificates: task.certificates,
        time_law: true,
        cut: cut_on(task.stock_cell_mm),
        ..VerifyRequest::new(path, read.job.post.dialect())
    };
    let mut verified = verify_program(&read.job, &program.text, &request, stages)?;
    verified.complete([]);
    let mut file = verified.file;
    if let Some(called) = &program.called {
        called.complete(&mut file);
    }
    let verification = &file.verification;
    let faults = verification.faults().count();
    let figures = TaskFigures {
        machine_s: Some(machine_time(&file.times)),
        left_mm: file.remaining.as_ref().and_then(largest_left),
        gouge_mm: verification.largest_gouge.as_ref().map(|gouge| gouge.depth_mm),
        findings: Some(verification.findings.len()),
        faults: Some(faults),
        cutting_length_mm: Some(verification.cutting_length_mm),
        efficiency: largest(file.efficiency.iter().map(|e| e.efficiency)),
        ..TaskFigures::default()
    };
    let files = vec![("verification.json".to_owned(), to_json(&file).into_bytes())];
    Ok(Work { files, exit_code: u8::from(faults > 0), figures, ..Work::default() })
}

fn lengths_found(
    read: &ReadTask,
    setup: usize,
    (path, program): (&Path, &TaskProgram),
    task: &LengthsTaskFile,
    stages: &dyn Stages,
) -> Result<Work, Failure> {
    let request = LengthsRequest {
        program: path,
        dialect: read.job.post.dialect(),
        setup,
        margin: task.margin_mm,
        longest: task.longest_mm,
        cut: cut_on(task.stock_cell_mm),
        certificates: false,
        holders: None,
        also: Vec::new(),
    };
    let mut found = lengths_of_program(&read.job, &program.text, &request, stages)?;
    if let Some(called) = &program.called {
        found.file.map_lines(0, |line| called.written(line));
        (found.file.program, found.file.called_files) = (called.stamp(), called.called_files());
    }
    let faults = found.file.findings.iter().filter(|f| f.kind.is_fault()).count();
    let figures = TaskFigures {
        findings: Some(found.file.findings.len()),
        faults: Some(faults),
        gauge_length_mm: found.tool.as_ref().map(|tool| tool.gauge_length_mm),
        ..TaskFigures::default()
    };
    let exit_code = u8::from(found.tool.is_none() || faults > 0);
    let mut files = vec![("lengths.json".to_owned(), to_json(&found.file).into_bytes())];
    files.extend(found.tool.map(|tool| ("tool.json".to_owned(), to_json(&tool).into_bytes())));
    Ok(Work { files, exit_code, figures, ..Work::default() })
}
