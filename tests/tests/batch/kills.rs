//! Batches that are killed at random times, or run twice at once.

use std::collections::BTreeMap;
use std::time::{Duration, SystemTime};

use facemill_test_kit::Random;
use facemill_tests::batches::{
    BatchAtWork, Victim, assert_clean, assert_whole, batch, blink_batch, keys_in, one_by_one, results_in, send_signal,
};
use facemill_tests::jobs::JobFolder;
use facemill_tests::program::code_and_errors;

const TASKS: usize = 6;

/// Times at which results were written, by key.
fn written(job: &JobFolder) -> BTreeMap<String, SystemTime> {
    let out = job.path("out");
    let time = |key: &String| std::fs::metadata(out.join("tasks").join(key).join("result.json")).unwrap().modified();
    keys_in(&out).into_iter().map(|key| (key.clone(), time(&key).unwrap())).collect()
}

/// Kills of the whole group, of the scheduler alone and of a worker, until all is done.
#[test]
fn a_batch_that_is_killed_goes_on_and_has_every_result_once_and_whole() {
    let job = blink_batch(TASKS);
    let expected = one_by_one(&job, TASKS);
    let mut random = Random(20);
    let mut finished = BTreeMap::new();
    let mut kills = 0;
    for round in 0..8 {
        let victim = [Victim::Group, Victim::Scheduler, Victim::Worker][round % 3];
        let mut run = BatchAtWork::start(&job, &["--quiet"]);
        std::thread::sleep(Duration::from_secs_f64(random.between(0.05, 1.0)));
        kills += usize::from(run.kill(victim));
        // The others of a killed worker go on; they are stopped here, so that there is something
        // left to kill.
        run.kill(Victim::Group);
        assert_whole(&job.path("out"));
        for (key, time) in written(&job) {
            assert_eq!(*finished.entry(key).or_insert(time), time, "a finished task was run again");
        }
    }
    assert!(kills > 0);
    assert_eq!(BatchAtWork::start(&job, &["--quiet"]).code(), 0);
    assert_whole(&job.path("out"));
    assert_clean(&job.path("out"));
    let last = written(&job);
    assert!(finished.iter().all(|(key, time)| last[key] == *time), "a finished task was run again");
    assert!(results_in(&job.path("out")) == expected, "the results differ from those of tasks run one by one");
    // Nothing is left to do.
    let output = batch(&job, "run", "out", &[]);
    assert_eq!(code_and_errors(&output).0, 0);
    assert!(String::from_utf8_lossy(&output.stdout).contains("\n0 processes in "));
    assert_eq!(written(&job), last);
}

#[test]
fn an_interrupted_batch_has_exit_code_130_records_no_failure_and_goes_on() {
    let job = blink_batch(TASKS);
    // Interrupted when the first worker has its lock.
    let run = BatchAtWork::start(&job, &["--quiet", "--jobs", "2"]);
    while std::fs::read_dir(job.path("out/locks")).map_or(0, Iterator::count) == 0 {
        std::thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(run.interrupt(), 130);
    assert_whole(&job.path("out"));
    assert!(keys_in(&job.path("out")).len() < TASKS);
    assert_eq!(std::fs::read_dir(job.path("out/failed")).unwrap().count(), 0);
    assert_eq!(BatchAtWork::start(&job, &["--quiet"]).code(), 0);
    assert_eq!(keys_in(&job.path("out")).len(), TASKS);
    assert_clean(&job.path("out"));
}

#[test]
fn two_runs_in_one_folder_share_the_tasks_and_both_have_all_results() {
    let job = blink_batch(TASKS);
    let expected = one_by_one(&job, TASKS);
    let runs = [1, 2].map(|_| BatchAtWork::start(&job, &["--quiet", "--jobs", "1"]));
    assert_eq!(runs.map(BatchAtWork::code), [0, 0]);
    assert_whole(&job.path("out"));
    assert_clean(&job.path("out"));
    assert!(results_in(&job.path("out")) == expected);
}

/// Stops a worker while it has the lock of a task; returns its number.
fn stopped_with_lock(run: &BatchAtWork, job: &JobFolder) -> String {
    let locks = || std::fs::read_dir(job.path("out/locks")).map_or(0, Iterator::count);
    loop {
        if locks() > 0
            && let Some(worker) = run.worker()
            && send_signal("STOP", &worker)
        {
            std::thread::sleep(Duration::from_millis(50));
            // It may have been stopped before the lock had its name.
            let status = batch(job, "status", "out", &[]);
            if locks() > 0 && String::from_utf8_lossy(&status.stdout).contains(&format!("process {worker} on ")) {
                return worker;
            }
            send_signal("CONT", &worker);
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn the_task_of_a_frozen_process_is_taken_over_and_has_one_result_when_it_goes_on() {
    let job = blink_batch(2);
    let expected = one_by_one(&job, 2);
    let frozen = BatchAtWork::start(&job, &["--quiet", "--jobs", "1"]);
    let worker = stopped_with_lock(&frozen, &job);
    let status = batch(&job, "status", "out", &[]);
    let status = String::from_utf8_lossy(&status.stdout).into_owned();
    assert!(status.contains(&format!("process {worker} on ")), "{status}");
    assert_eq!(BatchAtWork::start(&job, &["--quiet", "--lock-patience", "1"]).code(), 0);
    assert!(results_in(&job.path("out")) == expected);
    let before = written(&job);
    assert!(send_signal("CONT", &worker));
    assert_eq!(frozen.code(), 0);
    assert_eq!(written(&job), before);
    assert_whole(&job.path("out"));
    assert_clean(&job.path("out"));
}

/// As a scheduler of machines or a guard of memory does.
#[test]
fn a_worker_that_is_told_to_end_is_tried_again() {
    let job = blink_batch(2);
    let run = BatchAtWork::start(&job, &["--quiet", "--jobs", "1", "--retries", "1"]);
    while std::fs::read_dir(job.path("out/locks")).map_or(0, Iterator::count) == 0 {
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(run.worker().is_some_and(|worker| send_signal("TERM", &worker)));
    assert_eq!(run.code(), 0);
    assert_eq!(keys_in(&job.path("out")).len(), 2);
    assert_clean(&job.path("out"));
}
