//! Where an output goes: no device, no link, and nothing that was read.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

use crate::Failure;

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

/// From now on every file that is read here, or named by a job that is, counts as an input of this process, and none of them is written over. For a
/// process that does one thing, as a command does; without it nothing is kept.
pub fn guard_inputs() {
    INPUTS.get_or_init(Mutex::default);
}

/// Counts a file as an input.
pub(crate) fn note_input(file: &Path) {
    if let Some(inputs) = INPUTS.get() {
        inputs.lock().unwrap_or_else(PoisonError::into_inner).note(file);
    }
}

/// Where the bytes of an output go: behind all symbolic links.
///
/// # Errors
/// [`Failure::Write`] where a folder has the name, or links go round in circles; [`Failure::Input`] where something else that is
/// no regular file has it, or it is an input.
pub(super) fn place_of(file: &Path) -> Result<PathBuf, Failure> {
    let failed = |source: std::io::Error| Failure::Write { file: file.to_owned(), source };
    match std::fs::metadata(file) {
        Ok(there) if there.is_dir() => return Err(failed(ErrorKind::IsADirectory.into())),
        Ok(there) if !there.is_file() => {
            return Err(Failure::input(file, "is no regular file; give the name of a file to write to"));
        }
        // A link that goes round in circles is told here, and what may not be looked at.
        Err(e) if !matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => return Err(failed(e)),
        _ => {}
    }
    let place = behind_links(file).map_err(failed)?;
    if let Some(inputs) = INPUTS.get() {
        inputs.lock().unwrap_or_else(PoisonError::into_inner).refuse(file, &place)?;
    }
    Ok(place)
}

/// Links that are followed at most, as many as Linux follows.
const LINKS: usize = 40;

/// What a path leads to, which need not be there.
fn behind_links(file: &Path) -> std::io::Result<PathBuf> {
    let mut place = file.to_owned();
    for _ in 0..LINKS {
        if !place.is_symlink() {
            return Ok(place);
        }
        // An absolute target replaces the folder.
        place = folder_of(&place).join(std::fs::read_link(&place)?);
    }
    Err(std::io::Error::other("too many symbolic links"))
}

/// Whether two paths are of one file, by their folders as the system knows them and their names without case.
pub(super) fn is_same_place(a: &Path, b: &Path) -> bool {
    let folder = |file: &Path| folder_of(file).canonicalize().unwrap_or_else(|_| folder_of(file).to_owned());
    let name = |file: &Path| file.file_name().map(|n| n.to_string_lossy().to_lowercase());
    name(a) == name(b) && folder(a) == folder(b)
}

/// The folder that a file is in.
pub(super) fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
