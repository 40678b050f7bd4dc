//! Reading input files and writing output files: whole or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};

use facemill_nc_program::Dialect;

use crate::{Failure, REJECTED};

/// Reads a file that the user named.
///
/// # Errors
/// [`Failure::Read`].
pub fn read(file: &Path) -> Result<Vec<u8>, Failure> {
    std::fs::read(file).map_err(|source| Failure::Read { file: file.to_owned(), source })
}

/// Writes files into a folder, as [`write_each`] does; the folder is made where it is missing.
///
/// # Errors
/// [`Failure::Write`], naming the file; [`Failure::Internal`] when two files have one name, where case does not count, as
/// it does not on some systems.
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
/// leaves all others as they were.
///
/// # Errors
/// [`Failure::Write`], naming the file; [`Failure::Input`] when a path names no file, or two are one and the same, where case
/// does not count.
pub fn write_each(files: &[(&Path, Vec<u8>)]) -> Result<(), Failure> {
    for (k, (file, _)) in files.iter().enumerate() {
        if file.file_name().is_none() {
            return Err(Failure::input(file, "is no name of a file; give one to write to"));
        }
        if files[..k].iter().any(|(other, _)| is_same_place(file, other)) {
            return Err(Failure::input(file, "is named for two files; give each a name of its own"));
        }
    }
    for folder in files.iter().map(|(file, _)| folder_of(file)) {
        std::fs::create_dir_all(folder).map_err(|source| Failure::Write { file: folder.to_owned(), source })?;
    }
    let placed: Vec<(PathBuf, &[u8])> = files.iter().map(|(file, bytes)| ((*file).to_owned(), &bytes[..])).collect();
    put_in_place(&placed)
}

/// Writes one file, as [`write_each`] does.
///
/// # Errors
/// As [`write_each`].
pub fn write_one(file: &Path, bytes: Vec<u8>) -> Result<(), Failure> {
    write_each(&[(file, bytes)])
}

/// Writes files into folders that are there, all or none.
fn put_in_place(files: &[(PathBuf, &[u8])]) -> Result<(), Failure> {
    let failed = |file: &Path| {
        let file = file.to_owned();
        move |source: std::io::Error| Failure::Write { file, source }
    };
    let mut waiting = Vec::with_capacity(files.len());
    for (file, bytes) in files {
        if file.is_dir() {
            return Err(failed(file)(std::io::Error::from(std::io::ErrorKind::IsADirectory)));
        }
        let mut temporary = tempfile::NamedTempFile::new_in(folder_of(file)).map_err(failed(file))?;
        temporary.write_all(bytes).map_err(failed(file))?;
        temporary.as_file().sync_all().map_err(failed(file))?;
        waiting.push((file, temporary));
    }
    for (file, temporary) in waiting {
        let written = temporary.persist(file).map_err(|e| failed(file)(e.error))?;
        make_readable(&written).map_err(failed(file))?;
    }
    Ok(())
}

/// Whether two paths are of one file, by their folders as the system knows them and their names without case.
fn is_same_place(a: &Path, b: &Path) -> bool {
    let folder = |file: &Path| folder_of(file).canonicalize().unwrap_or_else(|_| folder_of(file).to_owned());
    let name = |file: &Path| file.file_name().map(|n| n.to_string_lossy().to_lowercase());
    name(a) == name(b) && folder(a) == folder(b)
}

/// The folder that a file is in.
fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."))
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
mod tests {
    use super::*;

    #[test]
    fn files_are_written_whole_and_replace_older_ones() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("a/b");
        write_all(&inner, &[("x.txt".into(), b"one".to_vec())]).unwrap();
        write_all(&inner, &[("x.txt".into(), b"two".to_vec()), ("y.txt".into(), vec![])]).unwrap();
        assert_eq!(std::fs::read(inner.join("x.txt")).unwrap(), b"two");
        assert_eq!(std::fs::read_dir(&inner).unwrap().count(), 2);
    }

    #[test]
    fn of_a_program_and_its_rejected_form_the_last_written_stays() {
        let folder = tempfile::tempdir().unwrap();
        let clean = vec![("program.nc".to_owned(), vec![1]), ("report.json".to_owned(), vec![1])];
        let rejected = vec![("program.rejected.nc".to_owned(), vec![2]), ("report.json".to_owned(), vec![2])];
        for (files, name) in [(&clean, "program.nc"), (&rejected, "program.rejected.nc"), (&clean, "program.nc")] {
            write_all(folder.path(), files).unwrap();
            remove_counterparts(folder.path(), files).unwrap();
            assert_eq!(programs_in(folder.path()), [name]);
            assert!(folder.path().join("report.json").exists());
        }
        assert!(programs_in(&folder.path().join("none")).is_empty());
    }

    #[test]
    fn of_programs_for_several_controls_the_last_written_stays() {
        let folder = tempfile::tempdir().unwrap();
        let of = |names: &[&str]| names.iter().map(|n| ((*n).to_owned(), vec![1])).collect::<Vec<_>>();
        let channels = ["program-channel-1.mpf", "program.apt", "program.nc"];
        for names in [&["program.apt", "program.rejected.h"][..], &["program.apt", "program.ngc"], &channels] {
            write_all(folder.path(), &of(names)).unwrap();
            remove_counterparts(folder.path(), &of(names)).unwrap();
            let programs: Vec<&str> = names.iter().copied().filter(|n| !n.ends_with(".apt")).collect();
            assert_eq!(programs_in(folder.path()), programs);
            assert!(folder.path().join("program.apt").exists());
        }
        let own = of(&["program.cnc"]);
        write_all(folder.path(), &own).unwrap();
        remove_counterparts(folder.path(), &own).unwrap();
        assert_eq!(programs_in(folder.path()), ["program-channel-1.mpf", "program.cnc"]);
    }

    #[test]
    fn two_files_of_one_name_are_refused_before_anything_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let files = [("a.nc".to_owned(), vec![1]), ("A.nc".to_owned(), vec![2])];
        assert!(write_all(folder.path(), &files).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn of_files_in_several_folders_all_are_written_or_none() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let (first, second, blocked) = (at("a/first.json"), at("b/second.stock"), at("c"));
        std::fs::create_dir(&blocked).unwrap();
        // A folder has the name of the last file.
        let files = [(&first, b"1"), (&second, b"2"), (&blocked, b"3")].map(|(f, b)| (f.as_path(), b.to_vec()));
        let why = write_each(&files).unwrap_err().to_string();
        assert!(why.contains(blocked.to_str().unwrap()), "{why}");
        assert!(!first.exists() && !second.exists());
        for folder in ["a", "b", "c"] {
            assert_eq!(std::fs::read_dir(at(folder)).unwrap().count(), 0, "{folder}");
        }
        write_each(&files[..2]).unwrap();
        assert_eq!([&first, &second].map(|f| std::fs::read(f).unwrap()), [b"1", b"2"]);
        // One place under two names.
        let again = at("b/../a/FIRST.json");
        let why = write_each(&[(&first, vec![3]), (&again, vec![4])]).unwrap_err().to_string();
        assert!(why.contains("two files"), "{why}");
        assert_eq!(std::fs::read(&first).unwrap(), b"1");
        assert!(write_each(&[(Path::new(".."), vec![])]).is_err());
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_named() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let e = write_all(&file.path().join("out"), &[]).unwrap_err();
        assert!(e.to_string().contains("out"), "{e}");
    }
}
