//! A program with its calls expanded.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use facemill_job::failure::Failure;
use facemill_job::files;
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::format::verification_file::{CalledFile, VerificationFile};
use facemill_job::load::job::Job;
use facemill_nc_program::Dialect;
use facemill_nc_program::read::ReadError;
use facemill_nc_subprograms::{ExpandedFile, ExpandedProgram, expand, renumbered};

use crate::files_beside::FilesBeside;

/// Files that calls of a program may mean, besides subprograms in its text.
#[derive(Clone, Copy, Debug)]
pub enum CallableFiles<'a> {
    /// Those in the folder of the program.
    Beside,
    /// Those in another folder.
    InFolder(&'a Path),
    /// Texts in memory, by file name.
    Named(&'a BTreeMap<String, Vec<u8>>),
}

/// A program whose calls were expanded.
///
/// Lines are counted from 1, in three ways: in the text that runs; in the written files, which
/// count on from file to file, the program first; and in one of these files.
#[derive(Clone, Debug)]
pub struct CalledProgram {
    path: PathBuf,
    expanded: ExpandedProgram,
}

impl CalledProgram {
    /// Expands the calls of a program: subprograms in its text and in files beside it. Returns it
    /// with the text that runs, `None` without such calls.
    ///
    /// # Errors
    /// If calls are nested without end, or the text cannot be read: with the line of the file.
    pub fn of(job: &Job, path: &Path, text: &[u8], dialect: Dialect) -> Result<Option<(Self, Vec<u8>)>, Failure> {
        Self::of_files(job, path, text, dialect, CallableFiles::Beside)
    }

    /// Expands the calls of a program as [`CalledProgram::of`] does, with subprograms of these
    /// files.
    ///
    /// # Errors
    /// As [`CalledProgram::of`].
    pub fn of_files(
        job: &Job,
        path: &Path,
        text: &[u8],
        dialect: Dialect,
        files: CallableFiles<'_>,
    ) -> Result<Option<(Self, Vec<u8>)>, Failure> {
        let Some((called, text)) = Self::expanded_files(path, text, dialect, files)? else { return Ok(None) };
        job.read_program(&text, dialect).map_err(|e| called.unread(e))?;
        Ok(Some((called, text)))
    }

    /// Expands the calls of a program as [`CalledProgram::of`] does, without reading the text that
    /// runs.
    ///
    /// # Errors
    /// If calls are nested without end: with the line of the file.
    pub fn expanded(path: &Path, text: &[u8], dialect: Dialect) -> Result<Option<(Self, Vec<u8>)>, Failure> {
        Self::expanded_files(path, text, dialect, CallableFiles::Beside)
    }

    /// Expands the calls of a program as [`CalledProgram::of_files`] does, without reading the text
    /// that runs.
    ///
    /// # Errors
    /// As [`CalledProgram::expanded`].
    pub fn expanded_files(
        path: &Path,
        text: &[u8],
        dialect: Dialect,
        callable: CallableFiles<'_>,
    ) -> Result<Option<(Self, Vec<u8>)>, Failure> {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let beside = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = if let CallableFiles::InFolder(folder) = callable { folder } else { beside };
        // Listed once, and only if something is called.
        let names_there = OnceCell::new();
        let file = |names: &[String]| {
            let there: &FilesBeside = names_there.get_or_init(|| match callable {
                CallableFiles::Named(texts) => FilesBeside::of_names(texts.keys()),
                CallableFiles::Beside | CallableFiles::InFolder(_) => FilesBeside::of(folder),
            });
            let found = there.named(names, dialect == Dialect::LinuxCnc)?;
            let text = match callable {
                CallableFiles::Named(texts) => texts.get(found)?.clone(),
                CallableFiles::Beside | CallableFiles::InFolder(_) => files::read(&folder.join(found)).ok()?,
            };
            Some((found.to_owned(), text))
        };
        let expanded = expand(text, &name, dialect, &file).map_err(|e| Failure::input(path, e))?;
        let Some(mut expanded) = expanded else { return Ok(None) };
        let text = std::mem::take(&mut expanded.text);
        Ok(Some((Self { path: path.to_owned(), expanded }, text)))
    }

    /// Returns the text that runs for a new program: lines of a control that numbers every line
    /// count on.
    #[must_use]
    pub fn numbered(text: Vec<u8>, dialect: Dialect) -> Vec<u8> {
        if dialect == Dialect::Heidenhain { renumbered(&text) } else { text }
    }

    /// Returns the line of the written files, which count on, for a line of the text that runs.
    #[must_use]
    pub fn written(&self, line: u32) -> u32 {
        self.expanded.lines.written(line)
    }

    /// Returns the file of a line of the text that runs, and the line in it.
    #[must_use]
    pub fn place(&self, line: u32) -> (PathBuf, u32) {
        let (file, line) = self.expanded.place(self.written(line));
        (self.path.with_file_name(file), line)
    }

    /// Returns the first lines of the runs of lines that follow each other in one written file too.
    pub fn first_lines(&self) -> impl Iterator<Item = u32> {
        self.expanded.lines.runs().map(|([first, _], _)| first)
    }

    /// Returns a line of the text that runs as it is written, without blanks at its ends.
    #[must_use]
    pub fn written_text(&self, line: u32) -> String {
        self.expanded.written_text(self.written(line))
    }

    /// Names the written program, and its checksum.
    #[must_use]
    pub fn stamp(&self) -> ProgramStamp {
        ProgramStamp::new(&self.path, self.expanded.files.first().map_or(&[][..], |main| &main.text[..]))
    }

    /// Returns the files of subprograms, with the lines where they begin, in the order of their
    /// first calls.
    #[must_use]
    pub fn called_files(&self) -> Vec<CalledFile> {
        let one = |called: &ExpandedFile| CalledFile {
            program: ProgramStamp::new(Path::new(&called.name), &called.text),
            first_line: called.first_line,
        };
        self.expanded.files.iter().skip(1).map(one).collect()
    }

    /// Describes the text that runs for people who see it in place of the written files: which of
    /// its lines are which lines of them, and their checksums.
    #[must_use]
    pub fn text_that_runs(&self) -> String {
        let run = |([first, last], written): ([u32; 2], u32)| {
            let (file, line) = self.expanded.place(written);
            format!("{first} to {last} are {file} {line} to {}", line + (last - first))
        };
        let n_runs = self.expanded.lines.runs().count();
        let mut runs: Vec<String> = self.expanded.lines.runs().take(SHOWN_RUNS).map(run).collect();
        if n_runs > SHOWN_RUNS {
            runs.push(format!("and so on, {n_runs} runs in all"));
        }
        let file = |file: &ExpandedFile| {
            let stamp = ProgramStamp::new(Path::new(&file.name), &file.text);
            format!("{} ({})", stamp.file, stamp.blake3)
        };
        let n_files = self.expanded.files.len();
        let mut files: Vec<String> = self.expanded.files.iter().take(SHOWN_RUNS).map(file).collect();
        if n_files > SHOWN_RUNS {
            files.push(format!("and {} more", n_files - SHOWN_RUNS));
        }
        format!(
            "{} calls of subprograms are taken to run the blocks of the written files, and lines are those of the text that \
             runs: {}; written files and their checksums: {}",
            self.expanded.n_calls,
            runs.join(", "),
            files.join(", ")
        )
    }

    /// Returns an error of the text that runs with the file and line that it is of.
    #[must_use]
    pub fn unread(&self, why: ReadError) -> Failure {
        let (file, line) = self.place(why.line);
        Failure::input(&file, ReadError { line, ..why })
    }

    /// Gives results of the text that runs the lines of the written files, and names these.
    pub fn complete(&self, file: &mut VerificationFile) {
        file.map_lines(|line| self.written(line));
        for reason in &mut file.times.no_law_because {
            reason.place(|line| {
                let (file, line) = self.expanded.place(self.written(line));
                (file.to_owned(), line)
            });
        }
        file.program = self.stamp();
        file.called_files = self.called_files();
    }

    /// Describes the calls, in a line for people.
    #[must_use]
    pub fn summary_line(&self) -> String {
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

/// Most runs of lines, and files, in a description of the text that runs.
const SHOWN_RUNS: usize = 20;
