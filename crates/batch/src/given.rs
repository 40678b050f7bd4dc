//! Task that a scheduler gives to a process.

use std::io::{BufRead, Read};

use facemill_file_format::from_json;
use facemill_job::failure::Failure;

use crate::format::task_file::Task;

/// Most bytes of a task.
const MOST: u64 = 1 << 24;

/// Reads key and task from the first line of an input, as
/// [`run_tasks`](crate::run::scheduler::run_tasks) writes it.
///
/// # Errors
/// If the line cannot be read or is none.
pub fn given_task(input: &mut dyn BufRead) -> Result<(String, Task), Failure> {
    let mut line = Vec::new();
    let read = input.take(MOST).read_until(b'\n', &mut line);
    let wrong = |why: String| Failure::Internal(format!("standard input has no task: {why}"));
    read.map_err(|e| wrong(e.to_string()))?;
    from_json(&line).map_err(|e| wrong(e.to_string()))
}
