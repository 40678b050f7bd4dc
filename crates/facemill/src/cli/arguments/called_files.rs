//! Programs with subprograms: calls expanded before they are run.

use std::path::Path;

use facemill::Failure;
use facemill::called_program::CalledProgram;

use crate::cli::arguments::program::ProgramOfJob;
use crate::cli::output::say;

/// Remark of a command that writes a new program.
pub(crate) const CALLS_IN_PLACE: &str = "the new program has the blocks of subprograms in place of their calls\n";

/// Expands the calls of a job's program, and prints where the lines of called files begin.
///
/// # Errors
/// As [`CalledProgram::of`].
pub(crate) fn expand_in_place(read: &mut ProgramOfJob, path: &Path) -> Result<Option<CalledProgram>, Failure> {
    let Some((called, text)) = CalledProgram::of(&read.job, path, &read.text, read.dialect)? else { return Ok(None) };
    read.text = text;
    say(&called.summary_line())?;
    Ok(Some(called))
}
