//! Programs with subprograms: calls expanded before they are run.

use std::path::Path;

use facemill::Failure;
use facemill::called_program::CalledProgram;
use facemill::feeds::FeedRewriteError;

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

/// Returns a fault that new feeds have in the text that runs, with the file, the line and the block
/// that it is of.
pub(crate) fn feed_fault(called: &CalledProgram, path: &Path, why: FeedRewriteError) -> Failure {
    match why {
        FeedRewriteError::Text(why) => called.unread(why),
        FeedRewriteError::Line { line, why, block_text } => {
            let (file, line_of_file) = called.place(line);
            // Lines of a control that numbers them have another number in the text that runs.
            let block_text = block_text.map(|_| called.written_text(line));
            Failure::input(&file, FeedRewriteError::Line { line: line_of_file, why, block_text })
        }
        other => Failure::input(path, other),
    }
}
