//! Check of output files: no device, and no input.

use std::collections::HashMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

use crate::failure::Failure;

/// Files read or to be read, as the user named them, by the paths that the system resolves them to:
/// the expansion of a batch reads many.
#[derive(Default)]
pub(super) struct Inputs(HashMap<PathBuf, PathBuf>);

impl Inputs {
    pub(super) fn note(&mut self, file: &Path) {
        // A file that was read and is gone since cannot be overwritten.
        let Ok(known) = file.canonicalize() else { return };
        self.0.entry(known).or_insert_with(|| file.to_owned());
    }

    /// Refuses an output to this place if it is an input.
    pub(super) fn refuse(&self, file: &Path, place: &Path) -> Result<(), Failure> {
        let Ok(known) = place.canonicalize() else { return Ok(()) };
        match self.0.get(&known) {
            Some(named) => {
                let what = format!(
                    "is named as an output, but is {}, which is an input; give another file to write to",
                    named.display()
                );
                Err(Failure::input(file, what))
            }
            None => Ok(()),
        }
    }
}

/// Inputs of the process; not recorded until this is set.
static INPUTS: OnceLock<Mutex<Inputs>> = OnceLock::new();

/// Protects every file read from now on, or named by a job that is read, from being overwritten.
/// For a process that does one thing, as a command does; without it nothing is recorded.
pub fn guard_inputs() {
    INPUTS.get_or_init(Mutex::default);
}

/// Records a file as an input.
pub fn note_input(file: &Path) {
    if let Some(inputs) = INPUTS.get() {
        inputs.lock().unwrap_or_else(PoisonError::into_inner).note(file);
    }
}

/// Refuses a file that cannot be an output. A symbolic link can: it is replaced.
///
/// # Errors
/// [`Failure::Write`] if a folder has the name; [`Failure::Input`] if the name belongs to something
/// else that is no regular file, also behind a link, or to a link of the system, or to an input.
pub(super) fn check_place(file: &Path) -> Result<(), Failure> {
    let failed = |source: std::io::Error| Failure::Write { file: file.to_owned(), source };
    let no_file = || Failure::input(file, "is not a regular file; give the name of a file to write to");
    match std::fs::metadata(file) {
        Ok(there) if there.is_dir() => return Err(failed(ErrorKind::IsADirectory.into())),
        Ok(there) if !there.is_file() || is_of_system(file) => return Err(no_file()),
        // A path that may not be inspected is reported here. A link without a target, or in a
        // circle, is replaced.
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

/// Returns whether a file is among the system's own: its links (`/dev/stdout`) are no files of the
/// user, even if they lead to one.
fn is_of_system(file: &Path) -> bool {
    let folder = folder_of(file).canonicalize().unwrap_or_default();
    ["/dev", "/proc", "/sys"].iter().any(|system| folder.starts_with(system))
}

/// Returns whether two paths name one file, by their folders as the system resolves them and their
/// names without case.
pub(super) fn is_same_place(a: &Path, b: &Path) -> bool {
    let folder = |file: &Path| folder_of(file).canonicalize().unwrap_or_else(|_| folder_of(file).to_owned());
    let name = |file: &Path| file.file_name().map(|n| n.to_string_lossy().to_lowercase());
    name(a) == name(b) && folder(a) == folder(b)
}

/// Returns the folder of a file.
pub(crate) fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
