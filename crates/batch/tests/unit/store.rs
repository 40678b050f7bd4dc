use super::*;
use crate::format::result_file::{FailureFormat, FailureKind, ResultFormat, TaskFigures};

/// A key that begins with these digits.
fn key(digits: &str) -> String {
    format!("{digits:0<64}")
}

fn result(key: &str) -> (String, Vec<u8>) {
    result_of(key, &[])
}

fn result_of(key: &str, files: &[&str]) -> (String, Vec<u8>) {
    let file = ResultFile {
        format: ResultFormat::V1,
        key: key.to_owned(),
        exit_code: 1,
        message: None,
        job: String::new(),
        setup: String::new(),
        figures: TaskFigures::default(),
        files: files.iter().map(|name| (*name).to_owned()).collect(),
    };
    (RESULT.to_owned(), to_json(&file).into_bytes())
}

#[test]
fn a_result_is_there_when_it_is_filed_and_takes_the_place_of_a_failure() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let k = &*key("a");
    let task = serde_json::from_str(
        r#"{"number":1,"job":"j","name":"j","axes":{},"settings":[],"setup":0,"kind":{"plan":{}},"program":null}"#,
    );
    let failed = crate::format::result_file::FailedFile {
        format: FailureFormat::V1,
        key: k.to_owned(),
        task: task.unwrap(),
        kind: FailureKind::Machine,
        cause: "killed".to_owned(),
        exit_code: None,
        signal: Some(9),
        tries: 1,
        peak_mib: None,
    };
    store.record_failure(&failed).unwrap();
    assert_eq!(store.failure(k), Some(failed));
    assert!(store.result(k).is_none());
    store.file(k, &[result(k), ("program.nc".to_owned(), b"M30".to_vec())]).unwrap();
    assert_eq!(store.result(k).unwrap().exit_code, 1);
    assert_eq!(store.failure(k), None);
    assert_eq!((store.keys(), names_in(&folder.path().join("tmp")).len()), (vec![k.to_owned()], 0));
}

#[test]
fn results_that_are_passed_on_are_filed_whole_too() {
    let folder = tempfile::tempdir().unwrap();
    let k = &*key("a");
    let all = [result(k), ("program.nc".to_owned(), b"M30".to_vec())];
    let store = Store::open_passing(folder.path()).unwrap();
    store.file(k, &all).unwrap();
    for (name, bytes) in &all {
        assert_eq!(&std::fs::read(store.task_folder(k).join(name)).unwrap(), bytes);
    }
    assert_eq!((names_in(&store.task_folder(k)).len(), names_in(&folder.path().join("tmp")).len()), (2, 0));
    // What cannot be written leaves nothing.
    std::fs::remove_dir_all(store.task_folder(k)).unwrap();
    store.file(k, &[result(k), ("no/folder".to_owned(), Vec::new())]).unwrap_err();
    assert!(store.result(k).is_none() && names_in(&folder.path().join("tmp")).is_empty());
}

#[test]
fn a_lock_excludes_others_names_its_process_and_ends_when_it_is_dropped() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let mut lock = store.lock("k").unwrap();
    assert!(lock.is_some() && store.is_locked("k") && !store.is_locked("other"));
    assert!(store.lock("k").unwrap().is_none() && store.lock("other").unwrap().is_some());
    assert_eq!(store.holder("k"), None);
    lock.iter_mut().for_each(TaskLock::show);
    assert_eq!(store.holder("k"), Some(Holder::own()));
    drop(lock);
    assert!(!store.is_locked("k") && store.lock("k").unwrap().is_some());
    assert!(names_in(&folder.path().join("locks")).is_empty());
}

/// The clock of the machine that holds the lock may be another.
#[test]
fn a_sign_of_life_is_any_change_of_a_locks_time() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let lock = store.lock("k").unwrap();
    let mut signs = SignsOfLife::watch();
    store.without_sign("k", &mut signs);
    let pause = Duration::from_millis(30);
    std::thread::sleep(pause);
    assert!(store.without_sign("k", &mut signs) >= pause);
    let file = std::fs::File::options().write(true).open(folder.path().join("locks/k")).unwrap();
    file.set_modified(std::time::SystemTime::UNIX_EPOCH).unwrap();
    assert!(store.without_sign("k", &mut signs) < pause);
    drop(lock);
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
fn unfinished_results_are_cleared_when_their_process_is_gone_or_they_are_old() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let Holder { host, process } = Holder::own();
    let name = |digits: &str, host: &str, process: u32| format!("{}.{host}-{process}-0", key(digits));
    // No process has this number.
    let gone = u32::MAX;
    let all = [
        name("a", &host, gone),
        name("b", &host, process),
        name("c", "else-where", gone),
        name("d", "else-where", gone),
        "notes".to_owned(),
    ];
    for name in &all {
        std::fs::create_dir(folder.path().join("tmp").join(name)).unwrap();
        std::fs::write(folder.path().join("tmp").join(name).join("program.nc"), "half").unwrap();
    }
    let days = std::time::SystemTime::now() - 2 * LEFT_BEHIND;
    std::fs::File::open(folder.path().join("tmp").join(&all[3])).unwrap().set_modified(days).unwrap();
    let lock = store.lock(&key("a")).unwrap();
    assert_eq!(store.clear_left_behind().unwrap(), 1);
    assert_eq!(names_in(&folder.path().join("tmp")), [&all[0], &all[1], &all[2], "notes"]);
    drop(lock);
    assert_eq!(store.clear_left_behind().unwrap(), 1);
    assert_eq!(names_in(&folder.path().join("tmp")), [&all[1], &all[2], "notes"]);
}

#[test]
fn a_result_that_lost_files_or_is_another_ones_counts_as_none_and_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let k = &*key("a");
    let all = [result_of(k, &["program.nc"]), ("program.nc".to_owned(), b"M30".to_vec())];
    std::fs::create_dir(store.task_folder(k)).unwrap();
    for damaged in [b"damaged".to_vec(), result(&key("b")).1, all[0].1.clone()] {
        std::fs::write(store.task_folder(k).join(RESULT), damaged).unwrap();
        assert!(store.result(k).is_none());
        store.file(k, &all).unwrap();
        assert!(store.result(k).is_some() && names_in(&folder.path().join("tmp")).is_empty());
        std::fs::remove_file(store.task_folder(k).join("program.nc")).unwrap();
    }
    let lock = store.lock(k).unwrap();
    assert!(!store.remove(k).unwrap(), "it is locked");
    drop(lock);
    assert!(store.remove(k).unwrap());
    assert!(store.keys().is_empty() && names_in(&folder.path().join("tmp")).is_empty());
}

/// As on two machines whose locks do not reach each other.
#[test]
fn of_many_that_file_one_result_at_once_one_stays_and_none_fails() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open_passing(folder.path()).unwrap();
    for round in 0..50 {
        let k = &*key(&format!("{round:02}"));
        std::thread::scope(|scope| {
            for writer in 0..4 {
                let store = &store;
                let all = [result_of(k, &["by"]), ("by".to_owned(), vec![writer])];
                scope.spawn(move || store.file(k, &all).unwrap());
            }
        });
        assert!(store.result(k).is_some());
    }
    assert!(names_in(&folder.path().join("tmp")).is_empty());
}

#[test]
fn a_folder_with_other_files_is_no_folder_of_results() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("tmp/mydata")).unwrap();
    let why = Store::open(folder.path()).unwrap_err().to_string();
    assert!(why.contains("\"tmp\"") && why.contains("give a new or empty folder"), "{why}");
    assert!(Store::existing(folder.path()).unwrap_err().to_string().contains(MARKER));
    assert_eq!(names_in(folder.path()), ["tmp"]);
    // Made one by its user.
    std::fs::write(folder.path().join(MARKER), r#"{"format": "facemill-results/1"}"#).unwrap();
    let store = Store::open(folder.path()).unwrap();
    Store::existing(folder.path()).unwrap();
    assert_eq!(store.clear_left_behind().unwrap(), 0);
    assert!(folder.path().join("tmp/mydata").exists(), "of the user");
    std::fs::write(folder.path().join(MARKER), r#"{"format": "facemill-results/9"}"#).unwrap();
    Store::open(folder.path()).unwrap_err();
}

/// As many processes of a cluster that begin at once.
#[test]
fn a_new_folder_can_be_opened_by_many_at_once() {
    let folder = tempfile::tempdir().unwrap();
    for round in 0..100 {
        let place = folder.path().join(round.to_string());
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| Store::open(&place).unwrap());
            }
        });
    }
}

#[test]
fn names_that_are_no_keys_are_none_of_results() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    for name in ["tasks/todo", "tasks/.keep", "failed/notes.json", "locks/door"] {
        std::fs::create_dir_all(folder.path().join(name)).unwrap();
    }
    std::fs::create_dir(store.task_folder(&key("a"))).unwrap();
    assert_eq!((store.keys(), store.failed_keys()), (vec![key("a")], Vec::new()));
    store.clear_left_behind().unwrap();
    assert!(folder.path().join("locks/door").exists());
}

#[test]
fn copies_of_batches_replace_no_other_file() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    std::fs::write(folder.path().join("batch.json"), "mine").unwrap();
    assert!(!store.is_last_batch(b"one"));
    for text in [&b"one"[..], b"two", b"one"] {
        store.keep_batch(text).unwrap();
        assert!(store.is_last_batch(text));
    }
    assert!(!store.is_last_batch(b"two"));
    assert_eq!(names_in(&folder.path().join("batches")).len(), 2);
    assert_eq!(std::fs::read(folder.path().join("batch.json")).unwrap(), b"mine");
}

#[test]
fn a_file_in_the_place_of_the_folder_is_a_failure() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("file");
    std::fs::write(&place, "").unwrap();
    assert!(matches!(Store::open(&place), Err(Failure::Write { .. })));
}
