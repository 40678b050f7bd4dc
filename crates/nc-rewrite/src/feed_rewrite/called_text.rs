//! Faults of a program whose calls were expanded, by the written files.

use std::path::Path;

use facemill_called_program::CalledProgram;
use facemill_job::failure::Failure;

use crate::feed_rewrite::FeedRewriteError;

impl FeedRewriteError {
    /// Returns the fault of the text that runs with the written file, its line and the block as it
    /// is written there; `path` is the program.
    #[must_use]
    pub fn of_called(self, called: &CalledProgram, path: &Path) -> Failure {
        match self {
            Self::Text(why) => called.unread(why),
            Self::Line { line, why, block_text } => {
                let (file, line_of_file) = called.place(line);
                // Lines of a control that numbers them have another number in the text that runs.
                let block_text = block_text.map(|_| called.written_text(line));
                Failure::input(&file, Self::Line { line: line_of_file, why, block_text })
            }
            other => Failure::input(path, other),
        }
    }
}
