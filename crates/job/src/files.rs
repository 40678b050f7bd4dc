//! Reading input files and writing output files: whole or not at all.

mod earlier;
mod input;
#[cfg(test)]
#[path = "../tests/unit/files/laws.rs"]
mod laws;
pub(crate) mod output_place;
mod temporary;

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::files::output_place::{check_place, folder_of, is_same_place};
use crate::files::temporary::{Temporary, clear_left_behind};

pub use crate::files::earlier::set_aside_earlier;
pub use crate::files::input::confine_jobs;
pub use crate::files::input::enter_job;
pub use crate::files::output_place::guard_inputs;
pub use crate::files::output_place::note_input;

/// Reads a file that the user named: a regular file of at most 2 GiB.
///
/// # Errors
/// [`Failure::Read`], also of a device, a pipe or a folder.
pub fn read(file: &Path) -> Result<Vec<u8>, Failure> {
    read_bounded(file, input::MOST).map_err(|source| Failure::Read { file: file.to_owned(), source })
}

/// Opens a file that the user named, to be read in parts: a regular file of at most 2 GiB.
///
/// # Errors
/// As [`read`].
pub fn open(file: &Path) -> Result<File, Failure> {
    let opened = input::open_at_most(file, input::MOST);
    let opened = opened.map_err(|source| Failure::Read { file: file.to_owned(), source })?;
    note_input(file);
    Ok(opened)
}

/// Reads a file of text that people write: a job, a tool, a machine; at most 64 MiB.
///
/// # Errors
/// As [`read`].
pub fn read_text(file: &Path) -> Result<Vec<u8>, Failure> {
    read_bounded(file, input::MOST_TEXT).map_err(|source| Failure::Read { file: file.to_owned(), source })
}

/// Reads a file of text that a job names.
///
/// # Errors
/// As [`read`], and [`Failure::Input`] if the job may not name it ([`confine_jobs`]).
pub fn read_named_text(file: &Path) -> Result<Vec<u8>, Failure> {
    input::check_named(file)?;
    read_text(file)
}

/// Reads a mesh or path file that a job names.
///
/// # Errors
/// As [`read`], and [`Failure::Input`] if the job may not name it ([`confine_jobs`]).
pub fn read_named(file: &Path) -> Result<Vec<u8>, Failure> {
    input::check_named(file)?;
    read(file)
}

/// Reads a file that a mesh names; it is an input like the mesh.
pub fn read_beside(file: &Path) -> std::io::Result<Vec<u8>> {
    input::check_named(file).map_err(std::io::Error::other)?;
    read_bounded(file, input::MOST)
}

fn read_bounded(file: &Path, most: u64) -> std::io::Result<Vec<u8>> {
    let bytes = input::read_at_most(file, most)?;
    note_input(file);
    Ok(bytes)
}

/// Writes files into a folder, as [`write_each`] does; makes the folder if it is missing.
///
/// # Errors
/// As [`write_each`], and [`Failure::Internal`] if two files have one name, regardless of case, as
/// on some systems.
pub fn write_all(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<(), Failure> {
    write_in(folder, files, Vec::new)
}

/// Writes the files of a plan into a folder, as [`write_all`] does, and removes the files of an
/// earlier plan that this one does not write: nothing about another program stays beside a new one.
/// Removes them before the first new file has its name, so that an interruption leaves too little
/// but nothing stale.
///
/// # Errors
/// As [`write_all`].
pub fn write_plan(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<(), Failure> {
    write_in(folder, files, || earlier::replaced_by(folder, files))
}

/// Refuses an output path that is something other than a folder, for commands that compute long.
///
/// # Errors
/// [`Failure::Write`], naming it.
pub fn check_folder(folder: &Path) -> Result<(), Failure> {
    match std::fs::metadata(folder) {
        Ok(there) if !there.is_dir() => {
            let source =
                std::io::Error::other("it exists and is not a folder; give the name of a folder, existing or new");
            Err(Failure::Write { file: folder.to_owned(), source })
        }
        _ => Ok(()),
    }
}

fn write_in(folder: &Path, files: &[(String, Vec<u8>)], stale: impl Fn() -> Vec<PathBuf>) -> Result<(), Failure> {
    for (k, (name, _)) in files.iter().enumerate() {
        if files[..k].iter().any(|(other, _)| other.eq_ignore_ascii_case(name)) {
            return Err(Failure::Internal(format!("two files to be written are both called {name}")));
        }
    }
    std::fs::create_dir_all(folder).map_err(|source| Failure::Write { file: folder.to_owned(), source })?;
    let placed: Vec<(PathBuf, &[u8])> = files.iter().map(|(name, bytes)| (folder.join(name), &bytes[..])).collect();
    put_in_place(&placed, &stale())
}

/// Writes files that the user named, in any folder, each to a temporary name beside it first;
/// renames them only when all are written. An interruption leaves whole old files or whole new
/// ones, and a file that cannot be written leaves all others as they were. Replaces a symbolic
/// link, and not its target. Removes the temporary files that a killed run left in these folders.
///
/// # Errors
/// [`Failure::Write`], naming the file; [`Failure::Input`] if a path names no file, or something
/// other than a regular file (a device, a pipe), or an input ([`guard_inputs`]), or if two paths
/// are one, regardless of case.
pub fn write_each(files: &[(&Path, Vec<u8>)]) -> Result<(), Failure> {
    check_outputs(files.iter().map(|(file, _)| *file))?;
    for folder in files.iter().map(|(file, _)| folder_of(file)) {
        std::fs::create_dir_all(folder).map_err(|source| Failure::Write { file: folder.to_owned(), source })?;
    }
    let placed: Vec<(PathBuf, &[u8])> = files.iter().map(|(file, bytes)| ((*file).to_owned(), &bytes[..])).collect();
    put_in_place(&placed, &[])
}

/// Refuses names of files that [`write_each`] would refuse if it were called now: for a command
/// that has read its inputs and computes long.
///
/// # Errors
/// As [`write_each`], except those found only in writing.
pub fn check_outputs<'a>(files: impl IntoIterator<Item = &'a Path>) -> Result<(), Failure> {
    let files: Vec<&Path> = files.into_iter().collect();
    if let Some(file) = files.iter().find(|file| file.file_name().is_none()) {
        return Err(Failure::input(file, "does not name a file; give the file to write to"));
    }
    for (k, place) in files.iter().enumerate() {
        check_place(place)?;
        if files[..k].iter().any(|other| is_same_place(place, other)) {
            return Err(Failure::input(files[k], "is named for two files; give each a name of its own"));
        }
    }
    Ok(())
}

/// Refuses names of pages of a plan (`report.html`) where a file is that is no page of this
/// program: other programs write files of these names, too.
///
/// # Errors
/// [`Failure::Input`], naming the file.
pub fn check_pages(folder: &Path, names: &[String]) -> Result<(), Failure> {
    let mut there = names.iter().map(|name| folder.join(name)).filter(|path| path.symlink_metadata().is_ok());
    match there.find(|path| !earlier::is_page(path)) {
        Some(foreign) => Err(Failure::input(
            &foreign,
            "was not written by facemill and would be replaced: move it, give another folder, or plan with --no-html",
        )),
        None => Ok(()),
    }
}

/// Writes one file, as [`write_each`] does.
///
/// # Errors
/// As [`write_each`].
pub fn write_one(file: &Path, bytes: Vec<u8>) -> Result<(), Failure> {
    write_each(&[(file, bytes)])
}

/// Writes one file, as [`write_each`] does, in parts: the file gets its name when all of it is
/// written, and a failure leaves nothing.
///
/// # Errors
/// As [`write_each`], and those of `write`.
pub fn write_through<T, E>(
    file: &Path,
    write: impl FnOnce(&mut dyn Write) -> Result<T, E>,
) -> Result<Result<T, E>, Failure> {
    check_outputs([file])?;
    let failed = |source: std::io::Error| Failure::Write { file: file.to_owned(), source };
    let folder = folder_of(file);
    std::fs::create_dir_all(folder).map_err(|source| Failure::Write { file: folder.to_owned(), source })?;
    clear_left_behind(folder);
    let mut temporary = Temporary::empty_in(folder).map_err(failed)?;
    let written = match write(&mut temporary) {
        Ok(written) => written,
        Err(why) => return Ok(Err(why)),
    };
    temporary.finish().map_err(failed)?;
    temporary.rename_to(file).map_err(failed)?;
    Ok(Ok(written))
}

/// Writes files into existing folders, all or none, and removes stale files when all are written.
/// An error names a file as the user did, not the temporary one.
fn put_in_place(files: &[(PathBuf, &[u8])], stale: &[PathBuf]) -> Result<(), Failure> {
    let failed = |file: &Path| {
        let file = file.to_owned();
        move |source: std::io::Error| Failure::Write { file, source }
    };
    let mut waiting = Vec::with_capacity(files.len());
    files.iter().for_each(|(file, _)| clear_left_behind(folder_of(file)));
    for (file, bytes) in files {
        check_place(file)?;
        waiting.push((file, Temporary::write_in(folder_of(file), bytes).map_err(failed(file))?));
    }
    for file in stale {
        remove(file.clone())?;
    }
    for (file, temporary) in waiting {
        temporary.rename_to(file).map_err(failed(file))?;
    }
    Ok(())
}

/// Removes the file that an earlier run wrote under a name that the user gave again, if this run
/// has nothing to write to it: the old file would be taken for its result. Removes a symbolic link,
/// and not its target. Returns whether there was a file.
///
/// # Errors
/// [`Failure::Write`], naming the file; [`Failure::Input`] if [`write_each`] would not write it
/// either.
pub fn remove_earlier(file: &Path) -> Result<bool, Failure> {
    check_place(file)?;
    let was_there = file.symlink_metadata().is_ok();
    remove(file.to_owned())?;
    Ok(was_there)
}

fn remove(file: PathBuf) -> Result<(), Failure> {
    match std::fs::remove_file(&file) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => Err(Failure::Write { file, source }),
        _ => Ok(()),
    }
}

/// Part of the names of programs with faults.
pub const REJECTED: &str = ".rejected";
