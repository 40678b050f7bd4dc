//! Task that a scheduler gives to a process.

use std::io::{BufRead, Read};

use facemill_file_format::from_json;
use facemill_job::failure::Failure;
use facemill_job::format::made_from::InputFile;
use serde::{Deserialize, Serialize};

use crate::format::task_file::Task;
use crate::perform::TaskTerms;

/// Task with the terms on which it is run.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GivenTask {
    /// The task.
    pub task: Task,
    /// Key that it must have.
    pub key: String,
    /// Its inputs when it had this key.
    #[serde(default)]
    pub inputs: Vec<InputFile>,
    /// Whether it is run although another process has its lock.
    #[serde(default)]
    pub is_taken_over: bool,
}

impl GivenTask {
    /// Returns the terms on which it is run.
    pub fn terms(&self) -> TaskTerms<'_> {
        TaskTerms { key: Some(&self.key), inputs: &self.inputs, is_taken_over: self.is_taken_over }
    }
}

/// Most bytes of a task.
const MOST: u64 = 1 << 24;

/// Reads a task from the first line of an input, as
/// [`run_tasks`](crate::run::scheduler::run_tasks) writes it.
///
/// # Errors
/// If the line cannot be read or is none.
pub fn given_task(input: &mut dyn BufRead) -> Result<GivenTask, Failure> {
    let mut line = Vec::new();
    let read = input.take(MOST).read_until(b'\n', &mut line);
    let wrong = |why: String| Failure::Internal(format!("standard input has no task: {why}"));
    read.map_err(|e| wrong(e.to_string()))?;
    from_json(&line).map_err(|e| wrong(e.to_string()))
}
