//! Scheduler: which task runs when, with how many threads, and again.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::process::Command;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use facemill_job::failure::Failure;

use crate::format::result_file::{FailedFile, FailureFormat, FailureKind};
use crate::given::GivenTask;
use crate::key::KeyedTask;
use crate::memory::peak_mib;
use crate::run::cause::{Cause, cause_of, code_and_signal, is_stop_request};
use crate::run::worker::{Worker, WorkerEnd};
use crate::store::Store;
use crate::store::task_lock::SignsOfLife;

/// Exit code of a process that found its task locked by another one.
pub const LOCKED_CODE: u8 = 75;

/// Time between looks at the memory of processes, at cancellation and at locks of other runs.
const LOOK: Duration = Duration::from_millis(100);

/// Time within which a signal that ended a process also reaches the scheduler.
const UNTIL_CANCELLED: Duration = Duration::from_millis(300);

/// Settings of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RunSettings {
    /// Number of tasks at once; `None`: one for each processor.
    pub at_once: Option<usize>,
    /// Threads of each task; `None`: the processors shared out among the tasks at work.
    pub threads: Option<usize>,
    /// Bound of each task's address space, MiB.
    pub max_memory_mib: Option<u64>,
    /// Number of tries after the first for a task whose process is killed or runs out of memory.
    pub retries: usize,
    /// Start no more tasks after one without exit code 0.
    pub fail_fast: bool,
    /// Also run tasks again whose input was wrong before and is the same.
    pub retry_failed: bool,
    /// Time without a sign of life after which a task is taken over from another run, whose process
    /// or machine is frozen; `None`: it is waited for.
    pub lock_patience: Option<Duration>,
}

/// Event of a run.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum RunEvent<'a> {
    /// The run begins.
    Began {
        /// Tasks of the batch; those of one key count once.
        tasks: usize,
        /// Tasks whose result or final failure is there already.
        already: usize,
    },
    /// A process starts.
    Started {
        /// Its task.
        task: &'a KeyedTask,
        /// Its threads.
        threads: usize,
        /// Number of the try, from 1.
        attempt: usize,
    },
    /// Another run was faster to start a task; its result is waited for.
    PutAside {
        /// The task.
        task: &'a KeyedTask,
    },
    /// A task is at its end, or its process is and the task will be tried again.
    Ended {
        /// The task.
        task: &'a KeyedTask,
        /// Its end.
        end: &'a EndOfTask,
        /// Time of the process, s; 0 without one.
        wall_s: f64,
        /// Whether it will be tried again.
        again: bool,
    },
    /// Time passes.
    Tick,
}

/// End of a task in a run.
#[derive(Clone, Debug, PartialEq)]
pub enum EndOfTask {
    /// It has a result with this exit code.
    Filed(u8),
    /// It failed.
    Failed(Box<FailedFile>),
}

/// Watcher of a run.
pub trait Watch {
    /// Takes note of an event.
    fn see(&self, event: RunEvent<'_>);
    /// Returns whether the run is to stop.
    fn is_cancelled(&self) -> bool;
}

/// Result of a run.
#[derive(Clone, Debug, Default)]
pub struct RunSummary {
    /// Ends by key. Tasks that were not run have none.
    pub ends: BTreeMap<String, EndOfTask>,
    /// Number of processes that were started.
    pub started: usize,
}

impl RunSummary {
    /// Returns the exit code of the run for these tasks: 0 if every task has a result of exit code
    /// 0; 3 if one failed for another reason than its input, or was not run; else 1.
    pub fn exit_code(&self, tasks: &[KeyedTask]) -> u8 {
        let code = |task: &KeyedTask| match self.ends.get(&task.key) {
            Some(EndOfTask::Filed(0)) => 0,
            Some(EndOfTask::Filed(_)) => 1,
            Some(EndOfTask::Failed(failed)) if failed.kind == FailureKind::Input => 1,
            Some(EndOfTask::Failed(_)) => 3,
            None => 3,
        };
        tasks.iter().map(code).max().unwrap_or(0)
    }
}

/// Runs the tasks that have no result yet, each in a process of its own, several at once. Tasks of
/// one key are run once. A task that another run works on is waited for, and its result taken.
///
/// `command` makes the command line of a process, which reads key and task from the first line of
/// its standard input (see [`given_task`](crate::given::given_task)) and ends when that is closed.
///
/// # Errors
/// [`Failure::Interrupted`] if the watcher cancels: the processes have ended then; if a process
/// cannot be started.
pub fn run_tasks(
    tasks: &[KeyedTask],
    store: &Store,
    settings: RunSettings,
    command: &dyn Fn() -> Command,
    watch: &dyn Watch,
) -> Result<RunSummary, Failure> {
    let (sender, receiver) = channel();
    let mut run = BatchRun {
        tasks,
        store,
        settings,
        watch,
        summary: RunSummary::default(),
        waiting: VecDeque::new(),
        elsewhere: Vec::new(),
        taken_over: BTreeSet::new(),
        working: BTreeMap::new(),
        attempts: BTreeMap::new(),
        is_stopping: false,
    };
    run.take_known();
    run.all(command, &sender, &receiver)?;
    Ok(run.summary)
}

/// Process at work on a task.
struct AtWork {
    worker: Worker,
    began: Instant,
    threads: usize,
}

/// State of a run. Tasks are indices of the first task of each key.
struct BatchRun<'a> {
    tasks: &'a [KeyedTask],
    store: &'a Store,
    settings: RunSettings,
    watch: &'a dyn Watch,
    summary: RunSummary,
    waiting: VecDeque<usize>,
    /// Tasks that another run works on.
    elsewhere: Vec<(usize, SignsOfLife)>,
    /// Tasks that are taken over from another run.
    taken_over: BTreeSet<usize>,
    working: BTreeMap<usize, AtWork>,
    attempts: BTreeMap<usize, usize>,
    is_stopping: bool,
}

impl BatchRun<'_> {
    /// Takes the results and final failures that are there, and queues the others.
    fn take_known(&mut self) {
        let mut queued = BTreeSet::new();
        let mut unreadable = Vec::new();
        for (index, task) in self.tasks.iter().enumerate() {
            if !queued.insert(&task.key) {
                continue;
            }
            if let Some(result) = self.store.result(&task.key) {
                self.summary.ends.insert(task.key.clone(), EndOfTask::Filed(result.exit_code));
            } else if task.unreadable.is_some() {
                unreadable.push(index);
            } else if let Some(failed) = self.final_failure(task) {
                self.summary.ends.insert(task.key.clone(), EndOfTask::Failed(Box::new(failed)));
            } else {
                self.waiting.push_back(index);
            }
        }
        let already = self.summary.ends.len();
        self.watch.see(RunEvent::Began { tasks: queued.len(), already });
        for index in unreadable {
            let task = &self.tasks[index];
            let cause = task.unreadable.clone().unwrap_or_default();
            let failed = crate::perform::failed(&task.task, &task.key, FailureKind::Input, cause, 2);
            // As below: a full disk takes no record.
            let _ = self.store.record_failure(&failed);
            self.end(index, EndOfTask::Failed(Box::new(failed)), 0.0);
        }
    }

    fn final_failure(&self, task: &KeyedTask) -> Option<FailedFile> {
        let failed = self.store.failure(&task.key)?;
        (failed.kind == FailureKind::Input && !self.settings.retry_failed).then_some(failed)
    }

    fn all(
        &mut self,
        command: &dyn Fn() -> Command,
        sender: &Sender<WorkerEnd>,
        receiver: &Receiver<WorkerEnd>,
    ) -> Result<(), Failure> {
        loop {
            if self.watch.is_cancelled() {
                self.stop_all(receiver);
                return Err(Failure::Interrupted);
            }
            if let Err(failure) = self.start_some(command, sender) {
                self.stop_all(receiver);
                return Err(failure);
            }
            let nothing_to_start = self.waiting.is_empty() && self.elsewhere.is_empty();
            if self.working.is_empty() && (nothing_to_start || self.is_stopping) {
                return Ok(());
            }
            match receiver.recv_timeout(LOOK) {
                Ok(end) => self.ended(end)?,
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => self.look(),
            }
        }
    }

    /// Closes the inputs of all processes, on which they end, and waits for that.
    fn stop_all(&mut self, receiver: &Receiver<WorkerEnd>) {
        let n = self.working.len();
        self.working.clear();
        receiver.iter().take(n).for_each(drop);
    }

    /// Looks at the memory of processes and at the tasks of other runs.
    fn look(&mut self) {
        for at_work in self.working.values_mut() {
            let peak = peak_mib(at_work.worker.id);
            at_work.worker.peak_mib = at_work.worker.peak_mib.max(peak);
        }
        let elsewhere = std::mem::take(&mut self.elsewhere);
        for (index, mut signs) in elsewhere {
            let key = &self.tasks[index].key;
            if let Some(result) = self.store.result(key) {
                self.end(index, EndOfTask::Filed(result.exit_code), 0.0);
            } else if self.store.is_locked(key) {
                let without_sign = self.store.without_sign(key, &mut signs);
                if self.settings.lock_patience.is_some_and(|most| without_sign > most) {
                    self.taken_over.insert(index);
                    self.waiting.push_back(index);
                } else {
                    self.elsewhere.push((index, signs));
                }
            } else if let Some(failed) = self.final_failure(&self.tasks[index]) {
                self.end(index, EndOfTask::Failed(Box::new(failed)), 0.0);
            } else {
                self.waiting.push_back(index);
            }
        }
        self.watch.see(RunEvent::Tick);
    }

    fn start_some(&mut self, command: &dyn Fn() -> Command, sender: &Sender<WorkerEnd>) -> Result<(), Failure> {
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        let at_once = self.settings.at_once.unwrap_or(processors).max(1);
        while !self.is_stopping && self.working.len() < at_once {
            let Some(index) = self.waiting.pop_front() else { return Ok(()) };
            let task = &self.tasks[index];
            if let Some(result) = self.store.result(&task.key) {
                self.end(index, EndOfTask::Filed(result.exit_code), 0.0);
                continue;
            }
            let is_taken_over = self.taken_over.contains(&index);
            if !is_taken_over && self.store.is_locked(&task.key) {
                self.elsewhere.push((index, SignsOfLife::watch()));
                continue;
            }
            self.store.forget_failure(&task.key)?;
            let free = processors.saturating_sub(self.working.values().map(|w| w.threads).sum());
            let ready = (self.waiting.len() + 1).min(at_once - self.working.len());
            let threads = self.settings.threads.unwrap_or(free / ready).max(1);
            let mut command = command();
            command.env("RAYON_NUM_THREADS", threads.to_string());
            let KeyedTask { task: own, key, inputs, .. } = task;
            let given = GivenTask { task: own.clone(), key: key.clone(), inputs: inputs.clone(), is_taken_over };
            let attempt = self.attempts.entry(index).and_modify(|n| *n += 1).or_insert(1);
            let worker = match Worker::start(command, index, &given, sender.clone()) {
                Ok(worker) => worker,
                Err(e) => {
                    let text = format!("cannot start a process for task {}: {e}", own.number);
                    if self.summary.started == 0 {
                        return Err(Failure::Internal(text));
                    }
                    // Too many processes or too little memory, for now: not the fault of the task,
                    // which waits for the end of another.
                    if !self.working.is_empty() {
                        *attempt -= 1;
                        self.waiting.push_front(index);
                        return Ok(());
                    }
                    let cause = Cause { kind: FailureKind::Machine, text, exit_code: None, signal: None };
                    let tries = *attempt;
                    self.failed(index, failed_by(task, cause, tries), 0.0);
                    return Ok(());
                }
            };
            self.summary.started += 1;
            self.taken_over.remove(&index);
            self.watch.see(RunEvent::Started { task, threads, attempt: *attempt });
            self.working.insert(index, AtWork { worker, began: Instant::now(), threads });
        }
        Ok(())
    }

    /// Takes the end of a process.
    fn ended(&mut self, WorkerEnd { index, status, errors }: WorkerEnd) -> Result<(), Failure> {
        let Some(at_work) = self.working.remove(&index) else { return Ok(()) };
        let task = &self.tasks[index];
        let status = status.map_err(|e| Failure::Internal(format!("cannot wait for a process: {e}")))?;
        let wall_s = at_work.began.elapsed().as_secs_f64();
        if let Some(result) = self.store.result(&task.key) {
            self.end(index, EndOfTask::Filed(result.exit_code), wall_s);
            return Ok(());
        }
        if status.code() == Some(i32::from(LOCKED_CODE)) {
            self.watch.see(RunEvent::PutAside { task });
            self.attempts.remove(&index);
            self.elsewhere.push((index, SignsOfLife::watch()));
            return Ok(());
        }
        let tries = self.attempts.get(&index).copied().unwrap_or(1);
        let recorded = self.store.failure(&task.key);
        let failed = recorded.filter(|failed| failed.exit_code == status.code() && failed.exit_code.is_some());
        let failed = failed.map(|failed| FailedFile { tries, ..failed }).unwrap_or_else(|| {
            let mut cause = cause_of(code_and_signal(status), &errors, self.settings.max_memory_mib);
            // A process that has just begun does not catch signals yet, and is ended by them.
            let may_be_stopped = cause.kind == FailureKind::Interrupted || is_stop_request(cause.signal);
            if may_be_stopped && self.is_cancelled_soon() {
                cause.kind = FailureKind::Interrupted;
            } else if cause.kind == FailureKind::Interrupted {
                // Ended by someone else: by a scheduler of machines, or for want of memory.
                cause.kind = FailureKind::Machine;
                cause.text = "ended by a termination request".to_owned();
            }
            failed_by(task, cause, tries)
        });
        self.failed(index, FailedFile { peak_mib: at_work.worker.peak_mib, ..failed }, wall_s);
        Ok(())
    }

    /// Returns whether the user stops the run: the signal reaches processes and scheduler at about
    /// the same time.
    fn is_cancelled_soon(&self) -> bool {
        let began = Instant::now();
        loop {
            if self.watch.is_cancelled() || began.elapsed() > UNTIL_CANCELLED {
                return self.watch.is_cancelled();
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Takes a failure of a task: records it, and tries it again if a machine may do better.
    fn failed(&mut self, index: usize, failed: FailedFile, wall_s: f64) {
        let task = &self.tasks[index];
        if failed.kind != FailureKind::Interrupted {
            // A disk that is full takes no record; the end below has it for this run.
            let _ = self.store.record_failure(&failed);
        }
        let again = failed.kind == FailureKind::Machine && failed.tries <= self.settings.retries && !self.is_stopping;
        let end = EndOfTask::Failed(Box::new(failed));
        if again {
            self.watch.see(RunEvent::Ended { task, end: &end, wall_s, again });
            self.waiting.push_back(index);
        } else {
            self.end(index, end, wall_s);
        }
    }

    /// Takes the end of a task.
    fn end(&mut self, index: usize, end: EndOfTask, wall_s: f64) {
        let task = &self.tasks[index];
        self.watch.see(RunEvent::Ended { task, end: &end, wall_s, again: false });
        self.is_stopping |= self.settings.fail_fast && end != EndOfTask::Filed(0);
        self.summary.ends.insert(task.key.clone(), end);
    }
}

/// Returns the failure of a task by the cause for which its process ended.
fn failed_by(task: &KeyedTask, cause: Cause, tries: usize) -> FailedFile {
    let Cause { kind, text, exit_code, signal } = cause;
    FailedFile {
        format: FailureFormat::V1,
        key: task.key.clone(),
        task: task.task.clone(),
        kind,
        cause: text,
        exit_code,
        signal,
        tries,
        peak_mib: None,
    }
}

#[cfg(test)]
#[path = "../../tests/unit/run/scheduler.rs"]
mod tests;
