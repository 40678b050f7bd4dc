use facemill_job::format::made_from::InputFile;

use super::*;
use crate::format::task_file::Task;

fn keyed(key: &str) -> KeyedTask {
    let task: Task = serde_json::from_str(
        r#"{"number":1,"job":"j","name":"j","axes":{},"settings":[],"setup":0,"kind":{"plan":{}},"program":null}"#,
    )
    .unwrap();
    KeyedTask { task, key: key.to_owned(), inputs: Vec::new(), unreadable: None }
}

#[test]
fn the_exit_code_is_that_of_the_worst_task() {
    let failed = |kind: FailureKind| {
        EndOfTask::Failed(Box::new(crate::perform::failed(&keyed("").task, "", kind, String::new(), 2)))
    };
    for (ends, code) in [
        (vec![EndOfTask::Filed(0), EndOfTask::Filed(0)], 0),
        (vec![EndOfTask::Filed(0), EndOfTask::Filed(4)], 1),
        (vec![EndOfTask::Filed(1), failed(FailureKind::Input)], 1),
        (vec![failed(FailureKind::Input), failed(FailureKind::InputChanged)], 3),
        (vec![EndOfTask::Filed(0), failed(FailureKind::Machine)], 3),
        (vec![EndOfTask::Filed(0)], 3),
    ] {
        let ends = ends.into_iter().enumerate().map(|(k, end)| (k.to_string(), end)).collect();
        let summary = RunSummary { ends, started: 0 };
        assert_eq!(summary.exit_code(&[keyed("0"), keyed("1")]), code, "{summary:?}");
    }
}

/// The line that a worker reads is the one that the scheduler writes.
#[test]
fn a_given_task_is_read_as_it_was_written() {
    let inputs = vec![InputFile { file: "a b".to_owned(), blake3: "0".to_owned() }];
    let task = GivenTask { task: keyed("k").task, key: "k".to_owned(), inputs, is_taken_over: true };
    let line = facemill_file_format::to_json(&task).replace('\n', " ") + "\nmore";
    let read = crate::given::given_task(&mut line.as_bytes()).unwrap();
    assert_eq!((read.task, read.key, read.inputs, read.is_taken_over), (task.task, task.key, task.inputs, true));
    assert!(crate::given::given_task(&mut &b""[..]).is_err());
}

struct Unwatched;

impl Watch for Unwatched {
    fn see(&self, _: RunEvent<'_>) {}

    fn is_cancelled(&self) -> bool {
        false
    }
}

/// Cancels some time after the first process has started, as the signal that ended it would.
struct CancelledSoon(std::cell::OnceCell<std::time::Instant>);

impl Watch for CancelledSoon {
    fn see(&self, _: RunEvent<'_>) {
        self.0.get_or_init(std::time::Instant::now);
    }

    fn is_cancelled(&self) -> bool {
        self.0.get().is_some_and(|start| start.elapsed() > std::time::Duration::from_millis(60))
    }
}

/// A process that has just begun does not catch signals yet: by an interruption it ends like one
/// that someone else has ended.
#[cfg(unix)]
#[test]
fn processes_that_an_interruption_ends_are_no_failures() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let task = keyed(&"0".repeat(64));
    let command = || {
        let mut command = Command::new("sh");
        command.args(["-c", "kill -INT $$"]);
        command
    };
    let settings = RunSettings { at_once: Some(1), ..RunSettings::default() };
    let tasks = std::slice::from_ref(&task);
    let stopped = run_tasks(tasks, &store, settings, &command, &CancelledSoon(std::cell::OnceCell::new()));
    assert!(matches!(stopped, Err(Failure::Interrupted)));
    assert!(store.failure(&task.key).is_none());
    run_tasks(tasks, &store, settings, &command, &Unwatched).unwrap();
    assert_eq!(store.failure(&task.key).unwrap().kind, FailureKind::Machine);
}

/// One of two commands cannot be started, as when the system has too many processes.
#[cfg(unix)]
#[test]
fn a_process_that_cannot_be_started_fails_its_task_alone() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let tasks = ["0", "1", "2"].map(|digit| keyed(&digit.repeat(64)));
    let count = std::cell::Cell::new(0);
    let command = || {
        count.set(count.get() + 1);
        Command::new(if count.get() == 2 { "/no/such/program" } else { "false" })
    };
    let settings = RunSettings { at_once: Some(1), ..RunSettings::default() };
    let summary = run_tasks(&tasks, &store, settings, &command, &Unwatched).unwrap();
    let kinds: Vec<FailureKind> = tasks
        .iter()
        .map(|task| match &summary.ends[&task.key] {
            EndOfTask::Failed(failed) => failed.kind,
            EndOfTask::Filed(code) => panic!("{code}"),
        })
        .collect();
    assert_eq!(kinds, [FailureKind::Internal, FailureKind::Machine, FailureKind::Internal]);
    assert_eq!(summary.started, 2);
    let none = || Command::new("/no/such/program");
    let why = run_tasks(&tasks, &store, settings, &none, &Unwatched).unwrap_err().to_string();
    assert!(why.contains("cannot start a process"), "{why}");
}

/// A termination request that the user did not make.
#[cfg(unix)]
#[test]
fn a_process_that_is_told_to_end_is_tried_again() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let tasks = [keyed(&"0".repeat(64))];
    let command = || {
        let mut command = Command::new("sh");
        command.args(["-c", "exit 130"]);
        command
    };
    let settings = RunSettings { at_once: Some(1), retries: 1, ..RunSettings::default() };
    let summary = run_tasks(&tasks, &store, settings, &command, &Unwatched).unwrap();
    let failed = store.failure(&tasks[0].key).unwrap();
    assert_eq!((failed.kind, failed.tries, summary.started), (FailureKind::Machine, 2, 2));
}
