//! Laws of the files that are written.

use crate::files::*;

#[test]
fn files_are_written_whole_and_replace_older_ones() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("a/b");
    write_all(&inner, &[("x.txt".into(), b"one".to_vec())]).unwrap();
    write_all(&inner, &[("x.txt".into(), b"two".to_vec()), ("y.txt".into(), vec![])]).unwrap();
    assert_eq!(std::fs::read(inner.join("x.txt")).unwrap(), b"two");
    assert_eq!(std::fs::read_dir(&inner).unwrap().count(), 2);
}

/// Names in a folder, in order.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn of(names: &[&str]) -> Vec<(String, Vec<u8>)> {
    let content = |name: &str| if name.ends_with(".html") { b"facemill-page/1".to_vec() } else { vec![1] };
    names.iter().map(|name| ((*name).to_owned(), content(name))).collect()
}

#[test]
fn nothing_that_speaks_of_another_program_stays_beside_a_new_one() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("notes.csv"), "mine").unwrap();
    let channels = ["program-channel-1.mpf", "program.apt", "program.nc", "report.json"];
    std::fs::write(folder.path().join("passes-mine.json"), "mine").unwrap();
    let full = [
        "certificates.json",
        "chips.csv",
        "chips.svg",
        "passes-1.json",
        "passes-12.svg",
        "passes.json",
        "passes.svg",
        "program.apt",
        "program.nc",
        "report.html",
        "report.json",
        "setup-sheet.html",
        "timings.json",
    ];
    let rejected = ["program.rejected.apt", "program.rejected.h", "report.json"];
    for written in [&channels[..], &full, &rejected, &["program.apt", "program.ngc"], &full] {
        write_plan(folder.path(), &of(written)).unwrap();
        let mut expected = vec!["notes.csv", "passes-mine.json"];
        expected.extend(written);
        expected.sort();
        assert_eq!(names(folder.path()), expected);
    }
}

#[test]
fn files_of_setups_go_where_a_report_of_ours_speaks_of_them_and_no_others() {
    let folder = tempfile::tempdir().unwrap();
    let report = br#"{"format": "facemill-report/1", "programs": [{"file": "program-top.cnc", "blake3": ""}]}"#;
    let mut top = of(&["certificates-top.json", "program-top.cnc"]);
    top.push(("report-top.json".to_owned(), report.to_vec()));
    write_all(folder.path(), &top).unwrap();
    let strange = of(&["program-of-mine.nc", "report-of-mine.json", "certificates-mine.json"]);
    write_all(folder.path(), &strange).unwrap();
    write_plan(folder.path(), &of(&["program.nc", "report.json"])).unwrap();
    let left = ["certificates-mine.json", "program-of-mine.nc", "program.nc", "report-of-mine.json", "report.json"];
    assert_eq!(names(folder.path()), left);
}

#[test]
fn a_page_of_another_program_under_the_name_of_ours_stays() {
    let folder = tempfile::tempdir().unwrap();
    write_plan(folder.path(), &of(&["report.html", "report.json", "setup-sheet.html"])).unwrap();
    std::fs::write(folder.path().join("report.html"), "<html>of another program</html>").unwrap();
    assert_eq!(set_aside_earlier(folder.path()).unwrap(), ["report.json", "setup-sheet.html"]);
    write_plan(folder.path(), &of(&["program.nc", "report.json"])).unwrap();
    assert_eq!(names(folder.path()), ["program.nc", "report.html", "report.json"]);
}

#[test]
fn what_is_set_aside_looks_like_no_program_of_now_and_goes_with_the_next_plan() {
    let folder = tempfile::tempdir().unwrap();
    let plan = of(&["certificates.json", "program.nc", "report.json"]);
    assert!(set_aside_earlier(&folder.path().join("none")).unwrap().is_empty());
    for _ in 0..2 {
        write_plan(folder.path(), &plan).unwrap();
        assert_eq!(set_aside_earlier(folder.path()).unwrap(), ["certificates.json", "program.nc", "report.json"]);
        let aside = ["certificates.earlier.json", "program.earlier.nc", "report.earlier.json"];
        assert_eq!(names(folder.path()), aside);
        // A second failure leaves it as it is.
        assert!(set_aside_earlier(folder.path()).unwrap().is_empty());
        assert_eq!(names(folder.path()), aside);
    }
    write_plan(folder.path(), &plan).unwrap();
    assert_eq!(names(folder.path()), ["certificates.json", "program.nc", "report.json"]);
}

#[test]
fn temporary_files_of_a_killed_run_are_cleared_and_no_others() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for name in [".facemill-999999999-0.tmp", ".tmpAbC123", ".facemill-mine.tmp", "x.tmp"] {
        std::fs::write(at(name), "left").unwrap();
    }
    let alive = Temporary::write_in(folder.path(), b"half").unwrap();
    write_one(&at("a.nc"), b"1".to_vec()).unwrap();
    let left = names(folder.path());
    let own = format!(".facemill-{}-", std::process::id());
    assert!(left.iter().any(|name| name.starts_with(&own)), "{left:?}");
    assert!(!left.iter().any(|name| name.contains("999999999")), "{left:?}");
    for name in [".tmpAbC123", ".facemill-mine.tmp", "x.tmp", "a.nc"] {
        assert!(at(name).exists(), "{name}");
    }
    alive.rename_to(&at("b.nc")).unwrap();
    assert_eq!(std::fs::read(at("b.nc")).unwrap(), b"half");
    assert_eq!(names(folder.path()), [".facemill-mine.tmp", ".tmpAbC123", "a.nc", "b.nc", "x.tmp"]);
}

#[test]
fn an_input_is_read_to_its_bound_and_no_further() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a");
    std::fs::write(&file, [7; 100]).unwrap();
    assert_eq!(input::read_at_most(&file, 100).unwrap().len(), 100);
    let why = input::read_at_most(&file, 99).unwrap_err().to_string();
    assert!(why.contains("more than") && why.contains("99"), "{why}");
}

/// Tries a device without end, and a pipe that nobody writes to, both also behind a link: reading
/// must not wait for any.
#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let made = std::process::Command::new("mkfifo").arg(at("pipe")).status().unwrap();
    assert!(made.success());
    std::os::unix::fs::symlink("/dev/zero", at("zero.stl")).unwrap();
    std::os::unix::fs::symlink("pipe", at("job.json")).unwrap();
    for file in [Path::new("/dev/zero"), &at("pipe"), &at("zero.stl"), &at("job.json"), folder.path()] {
        let why = read(file).unwrap_err().to_string();
        assert!(why.contains("not a regular file") && why.contains(file.to_str().unwrap()), "{why}");
    }
}

#[cfg(unix)]
#[test]
fn files_that_a_job_names_outside_its_folder_need_leave() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for name in ["job/inner", "shop", "shop-2"] {
        std::fs::create_dir_all(at(name)).unwrap();
    }
    for name in ["job/a.json", "job/inner/b.json", "shop/c.json", "shop-2/d.json"] {
        std::fs::write(at(name), "{}").unwrap();
    }
    std::os::unix::fs::symlink("../shop/c.json", at("job/link.json")).unwrap();
    let leave = |allowed: &[&str]| input::Places::new(&at("job"), allowed.iter().map(|name| at(name)));
    for inside in ["job/a.json", "job/inner/b.json", "job/inner/../a.json", "job/../job/a.json", "job/missing.json"] {
        leave(&[]).check(&at(inside)).unwrap();
    }
    for outside in ["shop/c.json", "job/../shop/c.json", "job/link.json"] {
        let why = leave(&[]).check(&at(outside)).unwrap_err().to_string();
        assert!(why.contains("--allow") && why.contains("shop"), "{why}");
        leave(&["shop-2", "shop"]).check(&at(outside)).unwrap();
    }
    assert!(leave(&["shop"]).check(&at("shop-2/d.json")).is_err(), "a name that begins alike is another folder");
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
fn a_link_is_replaced_and_what_it_leads_to_stays() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("far")).unwrap();
    std::fs::write(at("far/there.nc"), "old").unwrap();
    for (target, link) in [("far/there.nc", "a"), ("a", "b"), ("far/new.nc", "c"), ("y", "x"), ("x", "y")] {
        std::os::unix::fs::symlink(target, at(link)).unwrap();
    }
    for name in ["b", "a", "c", "x"] {
        write_one(&at(name), b"new".to_vec()).unwrap();
        assert!(!at(name).is_symlink(), "{name}");
        assert_eq!(std::fs::read(at(name)).unwrap(), b"new", "{name}");
    }
    assert_eq!(std::fs::read(at("far/there.nc")).unwrap(), b"old");
    assert!(!at("far/new.nc").exists());
}

/// A socket as an example of an existing path that is not a regular file.
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
        assert!(why.contains(name) && why.contains("not a regular file"), "{why}");
        let why = write_all(folder.path(), &[("first".into(), vec![1]), (name.into(), vec![2])]).unwrap_err();
        assert!(why.to_string().contains("not a regular file"), "{why}");
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
