//! Programs with subprograms: calls expanded before they are run.

use std::path::Path;

use facemill::formats::{CalledFile, ProgramStamp, VerificationFile};
use facemill::nc_program::Dialect;
use facemill::nc_program::read::ReadError;
use facemill::nc_subprograms::{ExpandedProgram, expand};
use facemill::{Failure, Job, files};

/// A program whose calls were expanded.
pub(crate) struct CalledProgram<'a> {
    path: &'a Path,
    expanded: ExpandedProgram,
}

impl<'a> CalledProgram<'a> {
    /// Expands the calls of a program: subprograms in its text and in files beside it. Returns it
    /// with the text that runs, `None` without such calls.
    ///
    /// # Errors
    /// If calls are nested without end, or the text cannot be read: with the line of the file.
    pub(crate) fn of(
        job: &Job,
        path: &'a Path,
        text: &[u8],
        dialect: Dialect,
    ) -> Result<Option<(Self, Vec<u8>)>, Failure> {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let beside = |names: &[String]| file_beside(path, names);
        let expanded = expand(text, &name, dialect, &beside).map_err(|e| Failure::input(path, e))?;
        let Some(mut expanded) = expanded else { return Ok(None) };
        let text = std::mem::take(&mut expanded.text);
        let called = Self { path, expanded };
        job.read_program(&text, dialect).map_err(|e| called.fault(e))?;
        Ok(Some((called, text)))
    }

    /// Returns an error of the expanded text with the file and line that it is of.
    fn fault(&self, why: ReadError) -> Failure {
        let (file, line) = self.expanded.place(self.expanded.lines.written(why.line));
        Failure::input(&self.path.with_file_name(file), ReadError { line, ..why })
    }

    /// Gives the results the lines of the files.
    pub(crate) fn complete(&self, file: &mut VerificationFile) {
        let [main, called @ ..] = self.expanded.files.as_slice() else { return };
        file.map_lines(|line| self.expanded.lines.written(line));
        file.program = ProgramStamp::new(self.path, &main.text);
        let one = |called: &facemill::nc_subprograms::ExpandedFile| CalledFile {
            program: ProgramStamp::new(Path::new(&called.name), &called.text),
            first_line: called.first_line,
        };
        file.called_files = called.iter().map(one).collect();
    }

    /// Describes the calls, in a line for people.
    pub(crate) fn summary_line(&self) -> String {
        let shown: Vec<String> = self.expanded.files[1..]
            .iter()
            .take(SHOWN)
            .map(|f| format!("{} from line {}", f.name, f.first_line))
            .collect();
        let n = self.expanded.n_calls;
        let others = self.expanded.files.len().saturating_sub(1 + shown.len());
        let and = if others > 0 { format!(" and {others} more") } else { String::new() };
        let files =
            if shown.is_empty() { String::new() } else { format!("; lines count on in {}{and}", shown.join(", ")) };
        format!("subprograms: {n} calls expanded{files}\n")
    }
}

/// Most files that are named.
const SHOWN: usize = 4;

/// Returns the file beside a program that has one of these names, whatever its case.
fn file_beside(path: &Path, names: &[String]) -> Option<(String, Vec<u8>)> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut there: Vec<String> = std::fs::read_dir(folder)
        .ok()?
        .flatten()
        .filter(|entry| entry.file_type().is_ok_and(|kind| !kind.is_dir()))
        .filter_map(|entry| entry.file_name().into_string().ok())
        .collect();
    there.sort();
    let found = names.iter().find_map(|name| there.iter().find(|file| file.eq_ignore_ascii_case(name)))?;
    let text = files::read(&folder.join(found)).ok()?;
    Some((found.clone(), text))
}
