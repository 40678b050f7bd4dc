//! Command lines of `facemill` about the files of a job's folder.

use std::ffi::OsString;

use crate::jobs::JobFolder;
use crate::program::{code_and_errors, run};

/// How a command ended.
pub struct CommandOutput {
    /// Exit code.
    pub code: i32,
    /// Standard output.
    pub printed: String,
    /// Standard error.
    pub errors: String,
}

/// Endings of words that are files of the folder.
const FILES: [&str; 6] = [".nc", ".json", ".stock", ".obj", ".stl", ".glb"];

/// Runs `facemill` with these words, apart by spaces; a name of a file stands for its path in the
/// folder.
///
/// # Panics
/// When it cannot be started, was killed, or prints no text.
pub fn facemill_in(job: &JobFolder, words: &str) -> CommandOutput {
    let is_file = |word: &str| FILES.iter().any(|ending| word.ends_with(ending));
    let place = |word: &str| if is_file(word) { job.path(word).into_os_string() } else { word.into() };
    let output = run(&words.split_whitespace().map(place).collect::<Vec<OsString>>());
    let (code, errors) = code_and_errors(&output);
    CommandOutput { code, printed: String::from_utf8(output.stdout).expect("text"), errors }
}

/// Names and bytes of all files of the folder, by name.
///
/// # Panics
/// When it cannot be read.
pub fn files_of(job: &JobFolder) -> Vec<(OsString, Vec<u8>)> {
    let entries = std::fs::read_dir(job.path("")).expect("a folder").map(|entry| entry.expect("an entry"));
    let bytes = |entry: std::fs::DirEntry| (entry.file_name(), std::fs::read(entry.path()).expect("a file"));
    let mut files: Vec<(OsString, Vec<u8>)> = entries.map(bytes).collect();
    files.sort();
    files
}

impl CommandOutput {
    /// Whether a line of what was printed has all of these words.
    #[must_use]
    pub fn prints(&self, words: &[&str]) -> bool {
        self.printed.lines().any(|line| words.iter().all(|word| line.contains(word)))
    }

    /// Whether the command refused its input, exit code 2, printed nothing, and said all of these
    /// words about it.
    #[must_use]
    pub fn is_refused_for(&self, words: &[&str]) -> bool {
        let said = words.iter().all(|word| self.errors.contains(word));
        self.code == 2 && self.printed.is_empty() && said && !self.errors.contains("panicked")
    }
}
