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

/// Writes files into a folder, each to a temporary name first; only when all are written are they renamed, so that an
/// interruption leaves whole old files or whole new ones.
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
    let failed = |name: &str| {
        let file = folder.join(name);
        move |source: std::io::Error| Failure::Write { file, source }
    };
    std::fs::create_dir_all(folder).map_err(failed(""))?;
    let mut waiting = Vec::with_capacity(files.len());
    for (name, bytes) in files {
        let mut temporary = tempfile::NamedTempFile::new_in(folder).map_err(failed(name))?;
        temporary.write_all(bytes).map_err(failed(name))?;
        temporary.as_file().sync_all().map_err(failed(name))?;
        waiting.push((name, temporary));
    }
    for (name, temporary) in waiting {
        let file = temporary.persist(folder.join(name)).map_err(|e| failed(name)(e.error))?;
        make_readable(&file).map_err(failed(name))?;
    }
    Ok(())
}

/// Writes one file, as [`write_all`] does.
///
/// # Errors
/// As [`write_all`], and [`Failure::Input`] when the path names no file.
pub fn write_one(file: &Path, bytes: Vec<u8>) -> Result<(), Failure> {
    let name = file.file_name().and_then(|n| n.to_str());
    let name = name.ok_or_else(|| Failure::input(file, "is no name of a file; --out wants one"))?;
    let folder = file.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    write_all(folder, &[(name.to_owned(), bytes)])
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
    fn a_folder_that_cannot_be_made_is_named() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let e = write_all(&file.path().join("out"), &[]).unwrap_err();
        assert!(e.to_string().contains("out"), "{e}");
    }
}
