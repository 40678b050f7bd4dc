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
    let task = keyed("k");
    let line = facemill_file_format::to_json(&(&task.key, &task.task)).replace('\n', " ") + "\nmore";
    let (key, read) = crate::given::given_task(&mut line.as_bytes()).unwrap();
    assert_eq!((key, read), (task.key, task.task));
    assert!(crate::given::given_task(&mut &b""[..]).is_err());
}
