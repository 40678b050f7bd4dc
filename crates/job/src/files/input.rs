//! Bounded reading of regular files, and the folders in which a job may name files: its own and
//! those that the user allowed.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

use crate::failure::Failure;

/// Largest file of text that people write (job, tool, machine, template), bytes.
pub(super) const MOST_TEXT: u64 = 64 << 20;

/// Largest file of any other kind (mesh, path, program, stock), bytes.
pub(super) const MOST: u64 = 2 << 30;

/// Reads a regular file of at most so many bytes. Opens nothing else: a pipe would block, and a
/// device may have no end.
///
/// # Errors
/// As the system reports; [`ErrorKind::InvalidInput`] if it is no regular file,
/// [`ErrorKind::FileTooLarge`] if it has more bytes.
pub(super) fn read_at_most(file: &Path, most: u64) -> Result<Vec<u8>> {
    let opened = open_at_most(file, most)?;
    let mut bytes = Vec::new();
    // Its length may change, and the length of a system file means nothing.
    opened.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(too_large(most));
    }
    Ok(bytes)
}

/// Opens a regular file whose metadata claims at most so many bytes.
///
/// # Errors
/// As [`read_at_most`].
pub(super) fn open_at_most(file: &Path, most: u64) -> Result<File> {
    if !std::fs::metadata(file)?.is_file() {
        return Err(Error::new(ErrorKind::InvalidInput, "it is not a regular file; give one"));
    }
    let opened = File::open(file)?;
    if opened.metadata()?.len() > most { Err(too_large(most)) } else { Ok(opened) }
}

fn too_large(most: u64) -> Error {
    let what = format!("it has more than {most} bytes, the most that a file of its kind may have");
    Error::new(ErrorKind::FileTooLarge, what)
}

/// Folders in which a job may name files.
#[derive(Default)]
pub(super) struct Places {
    folders: Vec<PathBuf>,
}

impl Places {
    /// Returns a job's folder and the allowed ones; a folder that does not exist allows nothing.
    pub(super) fn new(job: &Path, allowed: impl IntoIterator<Item = PathBuf>) -> Self {
        let job = if job.as_os_str().is_empty() { Path::new(".") } else { job };
        let folders = std::iter::once(job.to_owned()).chain(allowed);
        Self { folders: folders.filter_map(|folder| folder.canonicalize().ok()).collect() }
    }

    /// Refuses a file outside of all these folders, after resolving links. Leaves a missing file to
    /// its reader.
    ///
    /// # Errors
    /// [`Failure::Input`], which names the option.
    pub(super) fn check(&self, file: &Path) -> std::result::Result<(), Failure> {
        let Ok(known) = file.canonicalize() else { return Ok(()) };
        if self.folders.iter().any(|folder| known.starts_with(folder)) {
            return Ok(());
        }
        let folder = known.parent().unwrap_or(&known).display().to_string();
        let what = format!(
            "is outside the job's folder, in {folder}; allow it with --allow {folder}, or put the file beside the job"
        );
        Err(Failure::input(file, what))
    }
}

/// Folders that the process allows, and the folders in force for the job read last; `None` until a
/// job is read. Without [`confine_jobs`] there is no bound.
static ALLOWED: OnceLock<(Vec<PathBuf>, Mutex<Option<Places>>)> = OnceLock::new();

/// Confines jobs from now on to files in their own folder and in these. For a process that runs the
/// jobs of others, as a command does; without it a job may name every file.
pub fn confine_jobs(allowed: Vec<PathBuf>) {
    ALLOWED.get_or_init(|| (allowed, Mutex::default()));
}

/// Confines the files that a job names to this job's folder from now on.
pub fn enter_job(job: &Path) {
    if let Some((allowed, places)) = ALLOWED.get() {
        let new = Places::new(job.parent().unwrap_or(Path::new("")), allowed.iter().cloned());
        *places.lock().unwrap_or_else(PoisonError::into_inner) = Some(new);
    }
}

/// Refuses a file that a job may not name; permits every file if no job was read from a file.
///
/// # Errors
/// As [`Places::check`].
pub(super) fn check_named(file: &Path) -> std::result::Result<(), Failure> {
    let Some((_, places)) = ALLOWED.get() else { return Ok(()) };
    let places = places.lock().unwrap_or_else(PoisonError::into_inner);
    places.as_ref().map_or(Ok(()), |places| places.check(file))
}
