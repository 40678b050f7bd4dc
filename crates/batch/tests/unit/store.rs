use super::*;
use crate::format::result_file::{FailureFormat, FailureKind, ResultFormat, TaskFigures};

fn result(key: &str) -> (String, Vec<u8>) {
    let file = ResultFile {
        format: ResultFormat::V1,
        key: key.to_owned(),
        exit_code: 1,
        message: None,
        job: String::new(),
        setup: String::new(),
        figures: TaskFigures::default(),
        files: Vec::new(),
    };
    (RESULT.to_owned(), to_json(&file).into_bytes())
}

#[test]
fn a_result_is_there_when_it_is_filed_and_takes_the_place_of_a_failure() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let task = serde_json::from_str(
        r#"{"number":1,"job":"j","name":"j","axes":{},"settings":[],"setup":0,"kind":{"plan":{}},"program":null}"#,
    );
    let failed = crate::format::result_file::FailedFile {
        format: FailureFormat::V1,
        key: "k".to_owned(),
        task: task.unwrap(),
        kind: FailureKind::Machine,
        cause: "killed".to_owned(),
        exit_code: None,
        signal: Some(9),
        tries: 1,
        peak_mib: None,
    };
    store.record_failure(&failed).unwrap();
    assert_eq!(store.failure("k"), Some(failed));
    let lock = store.lock("k").unwrap().unwrap();
    assert!(store.result("k").is_none());
    store.file(&lock, "k", &[result("k"), ("program.nc".to_owned(), b"M30".to_vec())]).unwrap();
    drop(lock);
    assert_eq!(store.result("k").unwrap().exit_code, 1);
    assert_eq!(store.failure("k"), None);
    assert_eq!((store.keys(), names_in(&folder.path().join("tmp")).len()), (vec!["k".to_owned()], 0));
}

#[test]
fn results_that_are_passed_on_are_filed_whole_too() {
    let folder = tempfile::tempdir().unwrap();
    let all = [result("k"), ("program.nc".to_owned(), b"M30".to_vec())];
    let store = Store::open_passing(folder.path()).unwrap();
    let lock = store.lock("k").unwrap().unwrap();
    store.file(&lock, "k", &all).unwrap();
    for (name, bytes) in &all {
        assert_eq!(&std::fs::read(store.task_folder("k").join(name)).unwrap(), bytes);
    }
    assert_eq!((names_in(&store.task_folder("k")).len(), names_in(&folder.path().join("tmp")).len()), (2, 0));
    // What cannot be written leaves nothing.
    std::fs::remove_dir_all(store.task_folder("k")).unwrap();
    store.file(&lock, "k", &[result("k"), ("no/folder".to_owned(), Vec::new())]).unwrap_err();
    assert!(store.result("k").is_none() && names_in(&folder.path().join("tmp")).is_empty());
}

#[test]
fn a_lock_excludes_others_and_ends_when_it_is_dropped() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let lock = store.lock("k").unwrap();
    assert!(lock.is_some() && store.is_locked("k") && !store.is_locked("other"));
    assert!(store.lock("k").unwrap().is_none() && store.lock("other").unwrap().is_some());
    drop(lock);
    assert!(!store.is_locked("k") && store.lock("k").unwrap().is_some());
    assert!(names_in(&folder.path().join("locks")).is_empty());
}

/// Removal of the lock's file under the lock is where two processes could both have it.
#[test]
fn of_many_that_lock_at_once_one_has_the_lock() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let (inside, entered) = (std::sync::atomic::AtomicUsize::new(0), std::sync::atomic::AtomicUsize::new(0));
    let order = std::sync::atomic::Ordering::SeqCst;
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..500 {
                    if let Some(lock) = store.lock("k").unwrap() {
                        assert_eq!(inside.fetch_add(1, order), 0);
                        entered.fetch_add(1, order);
                        inside.fetch_sub(1, order);
                        drop(lock);
                    }
                }
            });
        }
    });
    assert!(entered.into_inner() > 0);
}

#[test]
fn unfinished_results_are_cleared_only_when_their_lock_is_free() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    for key in ["dead", "alive"] {
        std::fs::create_dir(folder.path().join("tmp").join(key)).unwrap();
        std::fs::write(folder.path().join("tmp").join(key).join("program.nc"), "half").unwrap();
    }
    let alive = store.lock("alive").unwrap();
    assert_eq!(store.clear_left_behind().unwrap(), 1);
    assert_eq!(names_in(&folder.path().join("tmp")), ["alive"]);
    drop(alive);
    assert_eq!(store.clear_left_behind().unwrap(), 1);
}

#[test]
fn a_folder_without_a_result_is_replaced_and_a_removed_result_is_gone() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    std::fs::create_dir(store.task_folder("k")).unwrap();
    std::fs::write(store.task_folder("k").join(RESULT), "damaged").unwrap();
    assert!(store.result("k").is_none());
    let lock = store.lock("k").unwrap().unwrap();
    store.file(&lock, "k", &[result("k")]).unwrap();
    assert!(store.result("k").is_some());
    assert!(!store.remove("k").unwrap(), "it is locked");
    drop(lock);
    assert!(store.remove("k").unwrap());
    assert!(store.keys().is_empty());
}

#[test]
fn a_file_in_the_place_of_the_folder_is_a_failure() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("file");
    std::fs::write(&place, "").unwrap();
    assert!(matches!(Store::open(&place), Err(Failure::Write { .. })));
}
