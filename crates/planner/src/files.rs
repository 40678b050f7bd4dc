//! Reading input files and writing output files: whole or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};

use facemill_nc_program::Dialect;

use crate::{Failure, REJECTED};

pub use output_place::guard_inputs;
pub(crate) use output_place::note_input;
use output_place::{folder_of, is_same_place, place_of};

mod output_place;

/// Reads a file that the user named.
///
/// # Errors
/// [`Failure::Read`].
pub fn read(file: &Path) -> Result<Vec<u8>, Failure> {
    read_beside(file).map_err(|source| Failure::Read { file: file.to_owned(), source })
}

/// Reads a file that another one names; it is an input as that one is.
pub(crate) fn read_beside(file: &Path) -> std::io::Result<Vec<u8>> {
    let bytes = std::fs::read(file)?;
    note_input(file);
    Ok(bytes)
}

/// Writes files into a folder, as [`write_each`] does; the folder is made where it is missing.
///
/// # Errors
/// As [`write_each`], and [`Failure::Internal`] when two files have one name, where case does not count, as it does not on
/// some systems.
pub fn write_all(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<(), Failure> {
    for (k, (name, _)) in files.iter().enumerate() {
        if files[..k].iter().any(|(other, _)| other.eq_ignore_ascii_case(name)) {
            return Err(Failure::Internal(format!("two files to be written are both called {name}")));
        }
    }
    std::fs::create_dir_all(folder).map_err(|source| Failure::Write { file: folder.to_owned(), source })?;
    let placed: Vec<(PathBuf, &[u8])> = files.iter().map(|(name, bytes)| (folder.join(name), &bytes[..])).collect();
    put_in_place(&placed)
}

/// Writes files that the user named, wherever they are, each to a temporary name beside it first; only when all are written
/// are they renamed, so that an interruption leaves whole old files or whole new ones, and a file that cannot be written
/// leaves all others as they were. A symbolic link stays one: its target is written.
///
/// # Errors
/// [`Failure::Write`], naming the file; [`Failure::Input`] when a path names no file, or something else than a regular file
/// (a device, a pipe), or an input ([`guard_inputs`]), or two are one and the same, where case does not count.
pub fn write_each(files: &[(&Path, Vec<u8>)]) -> Result<(), Failure> {
    check_outputs(files.iter().map(|(file, _)| *file))?;
    for folder in files.iter().map(|(file, _)| folder_of(file)) {
        std::fs::create_dir_all(folder).map_err(|source| Failure::Write { file: folder.to_owned(), source })?;
    }
    let placed: Vec<(PathBuf, &[u8])> = files.iter().map(|(file, bytes)| ((*file).to_owned(), &bytes[..])).collect();
    put_in_place(&placed)
}

/// Refuses names of files that [`write_each`] would refuse when it is called now: for a command that has read its inputs and has
/// long to compute.
///
/// # Errors
/// As [`write_each`], but for what is found out in writing.
pub fn check_outputs<'a>(files: impl IntoIterator<Item = &'a Path>) -> Result<(), Failure> {
    let files: Vec<&Path> = files.into_iter().collect();
    if let Some(file) = files.iter().find(|file| file.file_name().is_none()) {
        return Err(Failure::input(file, "is no name of a file; give one to write to"));
    }
    let places: Vec<PathBuf> = files.iter().map(|file| place_of(file)).collect::<Result<_, _>>()?;
    for (k, place) in places.iter().enumerate() {
        if places[..k].iter().any(|other| is_same_place(place, other)) {
            return Err(Failure::input(files[k], "is named for two files; give each a name of its own"));
        }
    }
    Ok(())
}

/// Writes one file, as [`write_each`] does.
///
/// # Errors
/// As [`write_each`].
pub fn write_one(file: &Path, bytes: Vec<u8>) -> Result<(), Failure> {
    write_each(&[(file, bytes)])
}

/// Writes files into folders that are there, all or none. What is told of a fault names a file as it was named, not the
/// temporary one or what a link leads to.
fn put_in_place(files: &[(PathBuf, &[u8])]) -> Result<(), Failure> {
    let failed = |file: &Path| {
        let file = file.to_owned();
        move |source: std::io::Error| Failure::Write { file, source: without_temporary(source) }
    };
    let mut waiting = Vec::with_capacity(files.len());
    for (file, bytes) in files {
        let place = place_of(file)?;
        let mut temporary = tempfile::NamedTempFile::new_in(folder_of(&place)).map_err(failed(file))?;
        temporary.write_all(bytes).map_err(failed(file))?;
        temporary.as_file().sync_all().map_err(failed(file))?;
        waiting.push((file, place, temporary));
    }
    for (file, place, temporary) in waiting {
        let written = temporary.persist(place).map_err(|e| failed(file)(e.error))?;
        make_readable(&written).map_err(failed(file))?;
    }
    Ok(())
}

/// What the system said, without the path of the temporary file that `tempfile` puts behind it.
fn without_temporary(said: std::io::Error) -> std::io::Error {
    match said.to_string().rsplit_once(" at path ") {
        Some((text, _)) => std::io::Error::new(said.kind(), text.to_owned()),
        None => said,
    }
}

/// Removes the programs that an earlier plan left in a folder and that the ones now written stand for: `program.nc` where
/// `program.rejected.nc` is among them, the other way round, and both where `program.mpf` is.
///
/// # Errors
/// [`Failure::Write`], naming the file.
pub fn remove_counterparts(folder: &Path, written: &[(String, Vec<u8>)]) -> Result<(), Failure> {
    for name in written.iter().map(|(name, _)| name) {
        let Some((stem, extension)) = name.rsplit_once('.').filter(|_| name.starts_with(PROGRAM)) else { continue };
        let clean = stem.strip_suffix(REJECTED).unwrap_or(stem);
        let others =
            if extension == APT { Vec::new() } else { Dialect::ALL.map(|d| d.file().program.extension).to_vec() };
        for other in others.iter().map(String::as_str).chain([extension]) {
            for counterpart in [format!("{clean}.{other}"), format!("{clean}{REJECTED}.{other}")] {
                if written.iter().all(|(name, _)| *name != counterpart) {
                    remove(folder.join(counterpart))?;
                }
            }
        }
    }
    Ok(())
}

/// Removes the file that an earlier run wrote under a name that the user gave again, where this run has nothing to write to it: what
/// is there would be taken for its result. A symbolic link stays one: its target goes. Says whether there was one.
///
/// # Errors
/// [`Failure::Write`], naming the file; [`Failure::Input`] where [`write_each`] would not write it, either.
pub fn remove_earlier(file: &Path) -> Result<bool, Failure> {
    let place = place_of(file)?;
    let was_there = place.exists();
    remove(place)?;
    Ok(was_there)
}

fn remove(file: PathBuf) -> Result<(), Failure> {
    match std::fs::remove_file(&file) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => Err(Failure::Write { file, source }),
        _ => Ok(()),
    }
}

/// NC programs in a folder, by name; none where it cannot be read.
pub fn programs_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.filter_map(|e| e.file_name().into_string().ok()).collect();
    let is_other = |name: &str| [APT, "json", "svg"].contains(&name.rsplit('.').next().unwrap_or_default());
    names.retain(|name| name.starts_with(PROGRAM) && name.contains('.') && !is_other(name));
    names.sort();
    names
}

/// What the names of programs start with.
const PROGRAM: &str = "program";

/// Ending of APT files, which a plan writes whatever the control is.
const APT: &str = "apt";

/// Temporary files are private to their owner; results are not.
#[cfg(unix)]
fn make_readable(file: &std::fs::File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn make_readable(_: &std::fs::File) -> std::io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod laws;
