//! Format of the report on a batch, `"format": "facemill-batch-report/1"`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use crate::format::result_file::{FailureKind, TaskFigures};

/// Value of the key `format` in a report on a batch.
pub const BATCH_REPORT_FORMAT: &str = "facemill-batch-report/1";

/// Headings of a table's columns before those of the axes; the last one only if there are programs.
pub const TASK_HEADINGS: [&str; 4] = ["task", "job", "setup", "program"];

/// Headings of a table's columns behind those of the axes.
pub const FIGURE_HEADINGS: [&str; 14] = [
    "state",
    "exit code",
    "machine min",
    "planned %",
    "largest cusp mm",
    "largest height left mm",
    "largest gouge mm",
    "findings",
    "length m",
    "efficiency",
    "gauge length mm",
    "wall s",
    "peak MiB",
    "cause",
];

/// Report on a batch.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct BatchReport {
    /// Always `"facemill-batch-report/1"`.
    pub format: &'static str,
    /// Names of the axes, in their order.
    pub axes: Vec<String>,
    /// Axis whose best value is taken in each group; `null`: groups are jobs.
    pub best_of: Option<String>,
    /// Figure by which the best is taken.
    pub measure: Measure,
    /// Numbers of tasks by state.
    pub counts: Counts,
    /// The tasks, in their order.
    pub tasks: Vec<TaskRow>,
    /// Best task of each group, in the order of the groups' first tasks; groups without a task of
    /// exit code 0 have none.
    pub best: Vec<BestRow>,
}

/// Figure by which tasks are compared; the least is the best.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Measure {
    /// Time of the program on the machine.
    #[default]
    Time,
    /// Largest cusp.
    Cusp,
    /// Length of the tip's path at a feed.
    Length,
    /// Length of the passes over the least that the cusp permits.
    Efficiency,
}

/// Numbers of tasks by state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Counts {
    /// All tasks.
    pub tasks: usize,
    /// Tasks with a result of exit code 0.
    pub done: usize,
    /// Tasks with a result of another exit code.
    pub not_met: usize,
    /// Tasks that failed by their input.
    pub wrong_input: usize,
    /// Tasks that failed otherwise.
    pub failed: usize,
    /// Tasks without a result that a process works on.
    pub running: usize,
    /// Tasks without a result.
    pub waiting: usize,
}

/// State of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum TaskState {
    /// Its result has exit code 0.
    Done,
    /// Its result has another exit code.
    NotMet,
    /// It failed.
    Failed,
    /// A process works on it.
    Running,
    /// It has not been run.
    Waiting,
}

/// A task in a report.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TaskRow {
    /// Number, from 1.
    pub number: usize,
    /// Key of its result.
    pub key: String,
    /// Job.
    pub job: String,
    /// Number of the setup, from 1.
    pub setup: usize,
    /// Program that is verified or given lengths; `null` if the setup is planned.
    pub program: Option<String>,
    /// Labels of its values, by axis.
    pub axes: BTreeMap<String, String>,
    /// State.
    pub state: TaskState,
    /// Exit code; `null` if it has not ended with one.
    pub exit_code: Option<i32>,
    /// Kind of its failure; `null` if it did not fail.
    pub failure: Option<FailureKind>,
    /// Cause of its failure, reason why it has no program, or the process that works on it.
    pub cause: Option<String>,
    /// Figures.
    pub figures: TaskFigures,
    /// Wall time of its process.
    pub wall_s: Option<f64>,
    /// Largest memory of its process.
    pub peak_mib: Option<u64>,
    /// Its programs and pictures, relative to the folder of the results.
    pub files: Vec<String>,
}

/// Best task of a group.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct BestRow {
    /// Job and labels that the tasks of the group have in common.
    pub group: String,
    /// Number of tasks in the group.
    pub tasks: usize,
    /// Number of the best one.
    pub number: usize,
    /// Its label on the axis that the group leaves open; its number if groups are jobs.
    pub label: String,
    /// Its figure.
    pub value: f64,
    /// The largest figure of a task of exit code 0 in the group over this one.
    pub worst_over_best: f64,
}
