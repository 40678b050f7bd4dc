//! Batches of small jobs, run by the command, and the bytes of their results.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use serde_json::{Value, json};

use crate::jobs::JobFolder;
use crate::program::facemill;
use crate::variants::blink_patch;

/// Files of results by task's key and name, without those of times.
pub type Results = BTreeMap<String, Vec<u8>>;

/// A job planned in a blink, in a folder with `batch.json`: `n` variants of its feed.
///
/// # Panics
/// When it cannot be written.
pub fn blink_batch(n: usize) -> JobFolder {
    let job = blink_patch();
    let range = json!({ "key": "operations[0].feeds.cutting_mm_min", "from": 1000.0, "to": 1200.0, "count": n });
    let axes = json!([{ "name": "feed", "values": { "range": range } }]);
    // Stock, and material left on a large region, take most of the time of so small a plan.
    let region = json!({ "box": { "min_mm": [-12, -2, -50], "max_mm": [12, 3, 50] } });
    job.set(
        "job.json",
        &[
            ("/verification/cut_stock", json!(false)),
            ("/operations/0/path/strategy/region", region),
            ("/operations/0/path/strategy/min_pass_length_mm", json!(2.0)),
        ],
    );
    write_batch(&job, &json!({ "sweep": { "job": "job.json", "axes": axes } }));
    job
}

/// Writes `batch.json` of these jobs, whose programs are not verified.
///
/// # Panics
/// When it cannot be written.
pub fn write_batch(job: &JobFolder, jobs: &Value) {
    let task = json!({ "plan": { "verify": false } });
    let batch = json!({ "format": "facemill-batch/1", "jobs": jobs, "task": task });
    job.write("batch.json", facemill::file_format::to_json(&batch).as_bytes());
}

/// The command `facemill batch WHAT` on the batch of a folder, with results in its folder `out`.
pub fn batch_command(job: &JobFolder, what: &str, out: &str, more: &[&str]) -> Command {
    let mut command = Command::new(facemill());
    command.args(["batch", what]).arg(job.path("batch.json"));
    if what != "expand" {
        command.arg("--out").arg(job.path(out));
    }
    command.args(more).stdin(Stdio::null());
    command
}

/// Runs a command of a batch to its end.
///
/// # Panics
/// When it cannot be started.
pub fn batch(job: &JobFolder, what: &str, out: &str, more: &[&str]) -> Output {
    batch_command(job, what, out, more).output().expect("facemill starts")
}

/// Names of the results' folders.
pub fn keys_in(out: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(out.join("tasks")).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// All files of all results, but those of times and memory.
///
/// # Panics
/// When a file cannot be read.
pub fn results_in(out: &Path) -> Results {
    let mut results = Results::new();
    for key in keys_in(out) {
        for entry in std::fs::read_dir(out.join("tasks").join(&key)).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            if name != "times.json" {
                results.insert(format!("{key}/{name}"), std::fs::read(&path).expect("a file"));
            }
        }
    }
    results
}

/// Fails unless every result that is there is whole: its files are those that it lists.
///
/// # Panics
/// When one is not.
pub fn assert_whole(out: &Path) {
    for key in keys_in(out) {
        let folder = out.join("tasks").join(&key);
        let text = std::fs::read(folder.join("result.json")).unwrap_or_else(|e| panic!("{key}: no result: {e}"));
        let result: Value = serde_json::from_slice(&text).unwrap_or_else(|e| panic!("{key}: half a result: {e}"));
        assert_eq!(result["key"], json!(key));
        let mut listed: Vec<String> =
            result["files"].as_array().expect("files").iter().map(|f| f.as_str().expect("a name").to_owned()).collect();
        listed.extend(["result.json", "times.json"].map(str::to_owned));
        listed.sort();
        let entries = std::fs::read_dir(&folder).expect("a folder");
        let mut there: Vec<String> =
            entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
        there.sort();
        assert_eq!(there, listed, "{key}");
    }
}

/// Fails if a process left something behind: a file that is not whole, or a lock.
///
/// # Panics
/// When one did.
pub fn assert_clean(out: &Path) {
    for name in ["tmp", "locks"] {
        let left: Vec<PathBuf> =
            std::fs::read_dir(out.join(name)).into_iter().flatten().flatten().map(|e| e.path()).collect();
        assert!(left.is_empty(), "{left:?}");
    }
}

/// Runs every task of a batch alone, one behind the other, each by `batch task`: the results that
/// all others must equal.
///
/// # Panics
/// When one fails.
pub fn one_by_one(job: &JobFolder, n: usize) -> Results {
    for number in 1..=n {
        let output = batch(job, "task", "alone", &[&number.to_string(), "--quiet"]);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code().is_some_and(|code| [0, 1, 4].contains(&code)), "task {number}: {errors}");
    }
    results_in(&job.path("alone"))
}

/// A batch at work, in a process group of its own.
pub struct BatchAtWork(Child);

impl BatchAtWork {
    /// Starts `facemill batch run`.
    ///
    /// # Panics
    /// When it cannot be started.
    pub fn start(job: &JobFolder, more: &[&str]) -> Self {
        let mut command = batch_command(job, "run", "out", more);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        Self(command.spawn().expect("facemill starts"))
    }

    /// Kills it with all its processes, or alone, or one of its workers; returns whether it was at
    /// work.
    ///
    /// # Panics
    /// When signals cannot be sent.
    pub fn kill(&mut self, whom: Victim) -> bool {
        if self.0.try_wait().expect("a child").is_some() {
            return false;
        }
        let own = self.0.id();
        let target = match whom {
            Victim::Group => format!("-{own}"),
            Victim::Scheduler => own.to_string(),
            Victim::Worker => {
                let Some(first) = self.worker() else { return false };
                first
            }
        };
        let killed = send_signal("KILL", &target);
        if !matches!(whom, Victim::Worker) {
            self.0.wait().expect("a child");
        }
        killed
    }

    /// Returns the number of one of its workers.
    pub fn worker(&self) -> Option<String> {
        let own = self.0.id();
        let children = std::fs::read_to_string(format!("/proc/{own}/task/{own}/children")).unwrap_or_default();
        children.split_whitespace().next().map(str::to_owned)
    }

    /// Sends Ctrl-C to it and all its processes, as a terminal does, and returns its exit code.
    ///
    /// # Panics
    /// When signals cannot be sent, or it was killed.
    pub fn interrupt(self) -> i32 {
        assert!(send_signal("INT", &format!("-{}", self.0.id())));
        self.code()
    }

    /// Waits for its end, and returns its exit code.
    ///
    /// # Panics
    /// When it was killed.
    pub fn code(mut self) -> i32 {
        self.0.wait().expect("a child").code().expect("an exit code")
    }
}

/// Sends a signal to a process or, with a minus, to a group; returns whether it was there.
///
/// # Panics
/// When there is no shell.
pub fn send_signal(signal: &str, target: &str) -> bool {
    let status = Command::new("sh").args(["-c", &format!("kill -{signal} {target} 2>/dev/null")]).status();
    status.expect("a shell").success()
}

/// Processes that a kill ends.
#[derive(Clone, Copy, Debug)]
pub enum Victim {
    /// All of them.
    Group,
    /// The scheduler alone: its workers must end by themselves.
    Scheduler,
    /// One worker.
    Worker,
}
