//! Tasks of a batch: what `batch expand --json` lists and a worker is given.

use std::collections::BTreeMap;

use facemill_job::format::made_from::InputFile;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::format::batch_file::TaskKindFile;

/// Value of the key `format` in a list of tasks.
pub const TASKS_FORMAT: &str = "facemill-batch-tasks/1";

/// Tasks of a batch, in their order.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TasksFile {
    /// Always `"facemill-batch-tasks/1"`.
    pub format: &'static str,
    /// The tasks.
    pub tasks: Vec<ListedTask>,
}

/// A task with its key and files.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ListedTask {
    /// The task.
    #[serde(flatten)]
    pub task: Task,
    /// Key of its result, 64 hexadecimal digits.
    pub key: String,
    /// Files that it reads, relative to the folder of its job, with their checksums.
    pub inputs: Vec<InputFile>,
    /// Reason why the job cannot be read; such a task fails without being run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unreadable: Option<String>,
}

/// One setup of one variant of a job, and the work on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// Number, from 1, by which `batch task` takes it.
    pub number: usize,
    /// Job file.
    pub job: String,
    /// Name of the job for tables: its path in the batch.
    pub name: String,
    /// Labels of the axes' values, by axis; empty without axes.
    pub axes: BTreeMap<String, String>,
    /// Values that replace those of the job.
    pub settings: Vec<TaskSetting>,
    /// Index of the setup, from 0.
    pub setup: usize,
    /// Work on it.
    pub kind: TaskKindFile,
    /// Program to verify or to find lengths for; `null` if the setup is planned.
    pub program: Option<String>,
}

/// Value that replaces one of the job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TaskSetting {
    /// Key, as `plan --set` takes it.
    pub key: String,
    /// Value; `null` removes the key.
    pub value: Value,
}
