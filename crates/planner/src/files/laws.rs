//! Laws of the files that are written.

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
        assert_eq!(std::fs::read_dir(at(folder)).map_or(0, Iterator::count), 0, "{folder}");
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

#[cfg(unix)]
#[test]
fn a_link_stays_one_and_its_target_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("far")).unwrap();
    std::fs::write(at("far/there.nc"), "old").unwrap();
    for (target, link) in [("far/there.nc", "a"), ("a", "b"), ("far/new.nc", "c")] {
        std::os::unix::fs::symlink(target, at(link)).unwrap();
    }
    write_each(&[(&at("b"), b"1".to_vec()), (&at("c"), b"2".to_vec())]).unwrap();
    for (link, target, bytes) in [("a", "far/there.nc", b"1"), ("b", "far/there.nc", b"1"), ("c", "far/new.nc", b"2")] {
        assert!(at(link).is_symlink() && !at(target).is_symlink(), "{link}");
        assert_eq!(std::fs::read(at(target)).unwrap(), bytes, "{target}");
    }
    let why = write_each(&[(&at("a"), vec![]), (&at("far/there.nc"), vec![])]).unwrap_err().to_string();
    assert!(why.contains("two files"), "{why}");
    for (target, link) in [("y", "x"), ("x", "y")] {
        std::os::unix::fs::symlink(target, at(link)).unwrap();
    }
    assert!(matches!(write_one(&at("x"), vec![]), Err(Failure::Write { .. })));
}

/// A socket stands for all that is there and no regular file.
#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_left_as_it_is_and_nothing_else_is_written() {
    use std::os::unix::fs::FileTypeExt;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let _socket = std::os::unix::net::UnixListener::bind(at("socket")).unwrap();
    std::os::unix::fs::symlink("socket", at("link")).unwrap();
    for name in ["socket", "link"] {
        let why = write_each(&[(&at("first"), vec![1]), (&at(name), vec![2])]).unwrap_err().to_string();
        assert!(why.contains(name) && why.contains("no regular file"), "{why}");
        let why = write_all(folder.path(), &[("first".into(), vec![1]), (name.into(), vec![2])]).unwrap_err();
        assert!(why.to_string().contains("no regular file"), "{why}");
        assert!(!at("first").exists() && std::fs::metadata(at("socket")).unwrap().file_type().is_socket());
    }
}

#[test]
fn what_was_read_is_refused_under_every_name_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("inner")).unwrap();
    std::fs::write(at("job.json"), "{}").unwrap();
    std::fs::write(at("other.json"), "{}").unwrap();
    let mut inputs = output_place::Inputs::default();
    inputs.note(&at("job.json"));
    inputs.note(&at("missing.json"));
    for output in ["job.json", "inner/../job.json"] {
        let why = inputs.refuse(Path::new("named.json"), &at(output)).unwrap_err().to_string();
        assert!(why.contains("named.json") && why.contains(at("job.json").to_str().unwrap()), "{why}");
    }
    for output in ["other.json", "missing.json", "new.json"] {
        inputs.refuse(Path::new("named.json"), &at(output)).unwrap();
    }
}

#[test]
fn a_fault_of_a_temporary_file_is_told_without_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing");
    let said = tempfile::NamedTempFile::new_in(&missing).unwrap_err();
    assert!(said.to_string().contains("missing"), "the temporary name is told: {said}");
    let told = without_temporary(said);
    assert_eq!(told.kind(), std::io::ErrorKind::NotFound);
    assert!(!told.to_string().contains("missing"), "{told}");
}
