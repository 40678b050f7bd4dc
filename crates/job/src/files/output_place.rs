//! Where an output goes: no device, and nothing that was read.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

use crate::failure::Failure;

/// Files that were read or will be, as they were named and as the system knows them.
#[derive(Default)]
pub(super) struct Inputs(Vec<[PathBuf; 2]>);

impl Inputs {
    pub(super) fn note(&mut self, file: &Path) {
        // What was read and is gone since can be overwritten by nobody.
        let Ok(known) = file.canonicalize() else { return };
        if self.0.iter().all(|[_, other]| *other != known) {
            self.0.push([file.to_owned(), known]);
        }
    }

    /// Refuses an output, that goes to this place, where it is an input.
    pub(super) fn refuse(&self, file: &Path, place: &Path) -> Result<(), Failure> {
        let Ok(known) = place.canonicalize() else { return Ok(()) };
        match self.0.iter().find(|[_, other]| *other == known) {
            Some([named, _]) => {
                let what = format!(
                    "is to be written, and is {}, which is an input; give another file to write to",
                    named.display()
                );
                Err(Failure::input(file, what))
            }
            None => Ok(()),
        }
    }
}

/// The inputs of the process; none are kept until this is set.
static INPUTS: OnceLock<Mutex<Inputs>> = OnceLock::new();

/// From now on every file that is read here, or named by a job that is, counts as an input of this
/// process, and none of them is written over. For a process that does one thing, as a command does;
/// without it nothing is kept.
pub fn guard_inputs() {
    INPUTS.get_or_init(Mutex::default);
}

/// Counts a file as an input.
pub fn note_input(file: &Path) {
    if let Some(inputs) = INPUTS.get() {
        inputs.lock().unwrap_or_else(PoisonError::into_inner).note(file);
    }
}

/// Refuses an output that cannot be one. A symbolic link is one: it is replaced.
///
/// # Errors
/// [`Failure::Write`] where a folder has the name; [`Failure::Input`] where something else that is
/// no regular file has it, also behind a link, or a link of the system, or it is an input.
pub(super) fn check_place(file: &Path) -> Result<(), Failure> {
    let failed = |source: std::io::Error| Failure::Write { file: file.to_owned(), source };
    let no_file = || Failure::input(file, "is no regular file; give the name of a file to write to");
    match std::fs::metadata(file) {
        Ok(there) if there.is_dir() => return Err(failed(ErrorKind::IsADirectory.into())),
        Ok(there) if !there.is_file() || is_of_system(file) => return Err(no_file()),
        // What may not be looked at is told here. A link that leads nowhere, or round in circles,
        // is replaced.
        Err(e) if !file.is_symlink() && !matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            return Err(failed(e));
        }
        _ => {}
    }
    match INPUTS.get() {
        Some(inputs) => inputs.lock().unwrap_or_else(PoisonError::into_inner).refuse(file, file),
        None => Ok(()),
    }
}

/// Whether a file is among the system's own: its links (`/dev/stdout`) are no files of the user,
/// even where they lead to one.
fn is_of_system(file: &Path) -> bool {
    let folder = folder_of(file).canonicalize().unwrap_or_default();
    ["/dev", "/proc", "/sys"].iter().any(|system| folder.starts_with(system))
}

/// Whether two paths are of one file, by their folders as the system knows them and their names
/// without case.
pub(super) fn is_same_place(a: &Path, b: &Path) -> bool {
    let folder = |file: &Path| folder_of(file).canonicalize().unwrap_or_else(|_| folder_of(file).to_owned());
    let name = |file: &Path| file.file_name().map(|n| n.to_string_lossy().to_lowercase());
    name(a) == name(b) && folder(a) == folder(b)
}

/// The folder that a file is in.
pub(super) fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
