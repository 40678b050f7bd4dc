//! Results and failures of tasks.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::format::task_file::Task;

/// Format of a result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub enum ResultFormat {
    /// The first version.
    #[default]
    #[serde(rename = "facemill-batch-result/1")]
    V1,
}

/// Format of a folder of results.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub enum ResultsFormat {
    /// The first version.
    #[default]
    #[serde(rename = "facemill-results/1")]
    V1,
}

/// Content of `facemill-results.json`, by which a folder of results is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ResultsFile {
    /// Always `"facemill-results/1"`.
    pub format: ResultsFormat,
    /// Checksum of the batch that was run last; `null` of a folder of single tasks.
    #[serde(default)]
    pub batch: Option<String>,
}

/// Format of a failure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub enum FailureFormat {
    /// The first version.
    #[default]
    #[serde(rename = "facemill-batch-failure/1")]
    V1,
}

/// Result of a task, `result.json` in its folder: the same bytes whenever, wherever and however
/// often the task is run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ResultFile {
    /// Always `"facemill-batch-result/1"`.
    pub format: ResultFormat,
    /// Key of the task.
    pub key: String,
    /// Exit code that the command of the task's kind has: of `plan` 0, 1 or 4, of `verify` and
    /// `lengths` 0 or 1.
    pub exit_code: u8,
    /// Reason why there is no program; `null` if there is one.
    pub message: Option<String>,
    /// Name of the job.
    pub job: String,
    /// Name of the setup.
    pub setup: String,
    /// Figures.
    pub figures: TaskFigures,
    /// Names of the other files of the folder, without `times.json`.
    pub files: Vec<String>,
}

/// Figures of a task; `null` if its kind has none, or there is no program.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TaskFigures {
    /// Time of the program on the machine, with acceleration if it is known.
    pub machine_s: Option<f64>,
    /// Share of the CC points that is planned, 0 to 1.
    pub planned_fraction: Option<f64>,
    /// Largest cusp predicted from neighbouring passes.
    pub cusp_mm: Option<f64>,
    /// Largest height of the material that the program leaves on a region.
    pub left_mm: Option<f64>,
    /// Largest depth of the cutter below the part.
    pub gouge_mm: Option<f64>,
    /// Number of findings.
    pub findings: Option<usize>,
    /// Number of them that are faults.
    pub faults: Option<usize>,
    /// Length of the tip's path at a feed.
    pub cutting_length_mm: Option<f64>,
    /// Length of the passes over the least that the cusp permits; of several operations the
    /// largest.
    pub efficiency: Option<f64>,
    /// Length of the tool assembly that the program needs, to the spindle.
    pub gauge_length_mm: Option<f64>,
}

/// Times and memory of the process that made a result, `times.json` in its folder: not
/// deterministic.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TaskTimes {
    /// Time from the start of the task to its last file.
    pub wall_s: f64,
    /// Largest memory of its process; `null` where the system does not report it.
    pub peak_mib: Option<u64>,
    /// Threads that it had.
    pub threads: usize,
    /// Wall time of each stage.
    pub stages_s: Vec<(String, f64)>,
}

/// Kind of a failure: decides whether a task is run again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum FailureKind {
    /// Job or a file that it names is wrong. The same inputs fail again, so the task is not run
    /// again before they change.
    Input,
    /// An input changed between the expansion of the batch and the task; the next run has the new
    /// key.
    InputChanged,
    /// The process was killed or ran out of memory: tried again `--retries` times, and by the next
    /// run.
    Machine,
    /// A file could not be written, or the program has a fault of its own: tried again by the next
    /// run.
    Internal,
    /// The user stopped it: it waits for the next run, without a record.
    Interrupted,
}

/// Failure of a task, `failed/KEY.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FailedFile {
    /// Always `"facemill-batch-failure/1"`.
    pub format: FailureFormat,
    /// Key of the task.
    pub key: String,
    /// The task.
    pub task: Task,
    /// Kind of the failure.
    pub kind: FailureKind,
    /// Cause, in words.
    pub cause: String,
    /// Exit code of the process; `null` if a signal ended it.
    pub exit_code: Option<i32>,
    /// Signal that ended it.
    pub signal: Option<i32>,
    /// Number of tries.
    pub tries: usize,
    /// Largest memory that the process was seen with.
    pub peak_mib: Option<u64>,
}
