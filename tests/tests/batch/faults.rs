//! Tasks that fail in every way: the others finish, and the table has the cause of each.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use facemill_tests::batches::{batch, batch_command, blink_batch, keys_in, write_batch};
use facemill_tests::jobs::JobFolder;
use facemill_tests::program::code_and_errors;
use serde_json::{Value, json};

/// Rows of the report, by number from 1.
fn rows(job: &JobFolder) -> Vec<Value> {
    let output = batch(job, "status", "out", &["--json"]);
    assert_eq!(code_and_errors(&output).0, 0);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    report["tasks"].as_array().unwrap().clone()
}

/// Ten variants, of which task 10 has a cusp below 0.
fn batch_with_a_bad_job() -> JobFolder {
    let job = blink_batch(1);
    let cusps: Vec<Value> = (0..9).map(|k| json!(0.05 + 0.01 * f64::from(k))).chain([json!(-1)]).collect();
    let each = json!({ "key": "operations[0].tolerances.cusp_mm", "values": cusps });
    let axes = json!([{ "name": "cusp", "values": { "each": each } }]);
    write_batch(&job, &json!({ "sweep": { "job": "job.json", "axes": axes } }));
    job
}

#[test]
#[cfg_attr(not(debug_assertions), ignore = "faults are planted in debug builds alone")]
fn an_abort_a_panic_too_much_memory_and_bad_input_leave_the_others_alone() {
    let job = batch_with_a_bad_job();
    let mut command = batch_command(&job, "run", "out", &["--retries", "1", "--max-memory", "1000"]);
    let output = command.env("FACEMILL_PLANTED_FAULT", "abort 3; panic 4; allocate 5").output().unwrap();
    let (code, errors) = code_and_errors(&output);
    assert_eq!(code, 3, "{errors}");
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(printed.contains("10 tasks: 6 done, 0 not met, 1 with wrong input, 3 failed otherwise"), "{printed}");
    let tasks = rows(&job);
    for (number, kind, words) in [
        (3, "internal", "signal 6 (abort)"),
        (4, "internal", "panicked"),
        (5, "machine", "out of memory within --max-memory 1000 MiB"),
        (10, "input", "cusp_mm: must be from"),
    ] {
        let row = &tasks[number - 1];
        assert_eq!((&row["state"], &row["failure"]), (&json!("failed"), &json!(kind)), "{row}");
        assert!(row["cause"].as_str().unwrap().contains(words), "{row}");
        assert!(printed.contains(&format!("task {number} failed: ")), "{printed}");
    }
    // Tried again: what a machine may do better the next time, and nothing else.
    let tries = |number: usize| {
        let name = format!("out/failed/{}.json", tasks[number - 1]["key"].as_str().unwrap());
        job.json(&name)["tries"].as_u64().unwrap()
    };
    assert_eq!([3, 4, 5, 10].map(tries), [1, 1, 2, 1]);
    assert!(!errors.contains("task 6 failed") && errors.contains("it is tried again"), "{errors}");
    // The next run does these three, and leaves bad input.
    let output = batch(&job, "run", "out", &[]);
    assert_eq!(code_and_errors(&output).0, 1);
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(printed.contains("9 done") && printed.contains("\n3 processes in "), "{printed}");
}

#[test]
fn a_run_that_fails_fast_starts_nothing_after_the_first_failure() {
    let job = batch_with_a_bad_job();
    let output = batch(&job, "run", "out", &["--fail-fast", "--jobs", "1"]);
    assert_eq!(code_and_errors(&output).0, 3, "tasks were not run");
    // The bad job is known before any process starts.
    assert_eq!(keys_in(&job.path("out")).len(), 0);
    assert_eq!(rows(&job).iter().filter(|row| row["state"] == "waiting").count(), 9);
}

/// Runs a batch of three tasks one behind the other, and calls `change` when the first has ended.
fn run_and(job: &JobFolder, change: impl FnOnce()) -> i32 {
    let mut command = batch_command(job, "run", "out", &["--jobs", "1", "--json-progress", "--quiet"]);
    // Workers that wait after they have read their inputs leave time to change these.
    command.env("FACEMILL_PLANTED_FAULT", "pause all");
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut change = Some(change);
    for line in BufReader::new(child.stderr.take().unwrap()).lines() {
        let event: Value = serde_json::from_str(&line.unwrap()).unwrap();
        if event["event"] == "task_ended" {
            change.take().into_iter().for_each(|change| change());
        }
    }
    child.wait().unwrap().code().unwrap()
}

#[test]
fn an_input_that_changes_meanwhile_gives_no_result_under_the_old_key() {
    let job = blink_batch(3);
    let tool = job.json("tool.json");
    let code = run_and(&job, || {
        job.set("tool.json", &[("/name", json!("another"))]);
    });
    assert_eq!(code, 3);
    let old = keys_in(&job.path("out"));
    assert!((1..3).contains(&old.len()), "{old:?}");
    // The first was made from the old tool: so says its report.
    let report = job.json(&format!("out/tasks/{}/report.json", old[0]));
    assert_eq!(report["made_from"]["tool"], tool["name"]);
    let failed: Vec<_> = std::fs::read_dir(job.path("out/failed")).unwrap().collect();
    assert!(!failed.is_empty());
    for entry in failed {
        let name = format!("out/failed/{}", entry.unwrap().file_name().to_string_lossy());
        let failed = job.json(&name);
        assert_eq!(failed["kind"], json!("input_changed"));
        assert!(failed["cause"].as_str().unwrap().contains("(tool.json)"), "{failed}");
    }
    // With the new tool all three are run, by keys of their own; with the old one again what is
    // missing.
    assert_eq!(code_and_errors(&batch(&job, "run", "out", &["--quiet"])).0, 0);
    let both = keys_in(&job.path("out")).len();
    assert_eq!(both, old.len() + 3);
    job.write("tool.json", facemill::file_format::to_json(&tool).as_bytes());
    assert_eq!(code_and_errors(&batch(&job, "run", "out", &["--quiet"])).0, 0);
    assert_eq!(keys_in(&job.path("out")).len(), 6);
    assert_eq!(code_and_errors(&batch(&job, "clean", "out", &["--unneeded"])).0, 0);
    assert_eq!(keys_in(&job.path("out")).len(), 3);
}

#[test]
fn results_are_not_taken_for_unneeded_when_the_batch_cannot_be_read_or_is_another() {
    let job = blink_batch(2);
    assert_eq!(code_and_errors(&batch(&job, "run", "out", &["--quiet"])).0, 0);
    let refused = |words: &str| {
        let (code, errors) = code_and_errors(&batch(&job, "clean", "out", &["--unneeded"]));
        assert!(code == 2 && errors.contains(words) && errors.contains("nothing was removed"), "{errors}");
        assert_eq!(keys_in(&job.path("out")).len(), 2);
    };
    let mesh = std::fs::read(job.path("patch.obj")).unwrap();
    std::fs::remove_file(job.path("patch.obj")).unwrap();
    refused("patch.obj");
    assert!(rows(&job).iter().all(|row| row["cause"].as_str().unwrap().contains("patch.obj")));
    job.write("patch.obj", &mesh);
    let text = std::fs::read(job.path("batch.json")).unwrap();
    write_batch(&job, &json!({ "list": ["job.json"] }));
    refused("is not the batch that was run last");
    job.write("batch.json", &text);
    assert_eq!(code_and_errors(&batch(&job, "clean", "out", &["--unneeded"])).0, 0);
    assert_eq!(keys_in(&job.path("out")).len(), 2);
    write_batch(&job, &json!({ "list": ["job.json"] }));
    let output = batch(&job, "clean", "out", &["--unneeded", "--force"]);
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(printed.contains("2 results") && printed.matches("\n  result ").count() == 2, "{printed}");
    assert_eq!(keys_in(&job.path("out")).len(), 0);
}

/// A project whose files have the names of ours.
#[test]
fn files_of_others_in_the_folder_of_results_are_left_alone() {
    let job = blink_batch(1);
    for name in ["tmp/mydata", "tasks/todo"] {
        std::fs::create_dir_all(job.path(name)).unwrap();
        job.write(&format!("{name}/notes"), b"mine");
    }
    let text = std::fs::read(job.path("batch.json")).unwrap();
    for what in ["run", "clean", "status", "report"] {
        let (code, errors) = code_and_errors(&batch(&job, what, "", &[]));
        assert!(code == 2 && errors.contains("facemill-results.json"), "{what}: {errors}");
    }
    job.write("facemill-results.json", br#"{"format": "facemill-results/1"}"#);
    for (what, more) in [("run", &["--quiet"][..]), ("clean", &["--failed", "--unneeded"])] {
        let (code, errors) = code_and_errors(&batch(&job, what, "", more));
        assert_eq!(code, 0, "{what}: {errors}");
    }
    for name in ["tmp/mydata", "tasks/todo"] {
        assert_eq!(std::fs::read(job.path(&format!("{name}/notes"))).unwrap(), b"mine");
    }
    assert_eq!(std::fs::read(job.path("batch.json")).unwrap(), text);
}

#[test]
fn a_deleted_input_fails_its_tasks_until_it_is_back() {
    let job = blink_batch(3);
    let mesh = std::fs::read(job.path("patch.obj")).unwrap();
    let code = run_and(&job, || std::fs::remove_file(job.path("patch.obj")).unwrap());
    assert_eq!(code, 3);
    // Gone from the beginning it is wrong input.
    let output = batch(&job, "run", "out", &[]);
    let (code, errors) = code_and_errors(&output);
    assert_eq!(code, 1, "{errors}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("3 with wrong input"));
    assert!(rows(&job).iter().all(|row| row["cause"].as_str().unwrap().contains("cannot read")), "{:?}", rows(&job));
    job.write("patch.obj", &mesh);
    assert_eq!(code_and_errors(&batch(&job, "run", "out", &["--quiet"])).0, 0);
    assert_eq!(keys_in(&job.path("out")).len(), 3);
}
