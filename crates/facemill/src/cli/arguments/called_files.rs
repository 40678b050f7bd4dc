//! Programs with subprograms: calls expanded before they are run.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::path::Path;

use facemill::formats::{CalledFile, ProgramStamp, VerificationFile};
use facemill::nc_program::Dialect;
use facemill::nc_program::read::ReadError;
use facemill::nc_subprograms::{ExpandedProgram, expand, renumbered};
use facemill::{Failure, Job, files};

use crate::cli::arguments::program::ProgramOfJob;
use crate::cli::output::say;

/// Remark of a command that writes a new program.
pub(crate) const CALLS_IN_PLACE: &str = "the new program has the blocks of subprograms in place of their calls\n";

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
        let Some((called, text)) = Self::expanded(path, text, dialect)? else { return Ok(None) };
        job.read_program(&text, dialect).map_err(|e| called.fault(e))?;
        Ok(Some((called, text)))
    }

    /// Expands the calls of a program as [`CalledProgram::of`] does, without reading the text that
    /// runs.
    ///
    /// # Errors
    /// If calls are nested without end: with the line of the file.
    pub(crate) fn expanded(path: &'a Path, text: &[u8], dialect: Dialect) -> Result<Option<(Self, Vec<u8>)>, Failure> {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        // Listed once, and only if something is called.
        let files_beside = OnceCell::new();
        let beside = |names: &[String]| {
            let there: &FilesBeside = files_beside.get_or_init(|| FilesBeside::of(folder));
            let found = there.named(names, dialect == Dialect::LinuxCnc)?;
            Some((found.to_owned(), files::read(&folder.join(found)).ok()?))
        };
        let expanded = expand(text, &name, dialect, &beside).map_err(|e| Failure::input(path, e))?;
        let Some(mut expanded) = expanded else { return Ok(None) };
        let text = std::mem::take(&mut expanded.text);
        Ok(Some((Self { path, expanded }, text)))
    }

    /// Expands the calls of a job's program, and prints where the lines of called files begin.
    ///
    /// # Errors
    /// As [`CalledProgram::of`].
    pub(crate) fn in_place(read: &mut ProgramOfJob, path: &'a Path) -> Result<Option<Self>, Failure> {
        let Some((called, text)) = Self::of(&read.job, path, &read.text, read.dialect)? else { return Ok(None) };
        read.text = text;
        say(&called.summary_line())?;
        Ok(Some(called))
    }

    /// Returns the text that runs for a new program: lines of a control that numbers every line
    /// count on.
    pub(crate) fn numbered(text: Vec<u8>, dialect: Dialect) -> Vec<u8> {
        if dialect == Dialect::Heidenhain { renumbered(&text) } else { text }
    }

    /// Returns the line of the written files, which count on, for a line of the text that runs.
    pub(crate) fn written(&self, line: u32) -> u32 {
        self.expanded.lines.written(line)
    }

    /// Names the written program, and its checksum.
    pub(crate) fn stamp(&self) -> ProgramStamp {
        ProgramStamp::new(self.path, self.expanded.files.first().map_or(&[][..], |main| &main.text[..]))
    }

    /// Returns an error of the expanded text with the file and line that it is of.
    fn fault(&self, why: ReadError) -> Failure {
        let (file, line) = self.expanded.place(self.expanded.lines.written(why.line));
        Failure::input(&self.path.with_file_name(file), ReadError { line, ..why })
    }

    /// Gives the results the lines of the files.
    pub(crate) fn complete(&self, file: &mut VerificationFile) {
        let [_, called @ ..] = self.expanded.files.as_slice() else { return };
        file.map_lines(|line| self.written(line));
        file.program = self.stamp();
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

/// Files in the folder of a program, by their names in lower case.
#[derive(Default)]
struct FilesBeside(BTreeMap<String, Vec<String>>);

impl FilesBeside {
    /// Lists the regular files of a folder. A link is none: it may lead out of the folder.
    fn of(folder: &Path) -> Self {
        let mut files = Self::default();
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let regular = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_file()));
        for name in regular.filter_map(|entry| entry.file_name().into_string().ok()) {
            files.0.entry(name.to_ascii_lowercase()).or_default().push(name);
        }
        files
    }

    /// Returns the file that has the first of these names that exists: in this case, else, where
    /// the control does not tell cases apart, in any if it is the only one.
    fn named(&self, names: &[String], has_cases: bool) -> Option<&str> {
        names.iter().find_map(|name| {
            let alike = self.0.get(&name.to_ascii_lowercase())?;
            let exact = alike.iter().find(|file| *file == name);
            let only = if has_cases || alike.len() > 1 { None } else { alike.first() };
            exact.or(only).map(String::as_str)
        })
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/cli/arguments/called_files.rs"]
mod tests;
