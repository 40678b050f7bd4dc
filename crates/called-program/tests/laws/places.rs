//! Lines of the text that runs, and the files that they are in.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use facemill_called_program::{CallableFiles, CalledProgram};
use facemill_nc_program::Dialect;

/// A folder with a main program that calls a file twice, and a subprogram of its own.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("facemill-called-program-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    std::fs::write(folder.join("main.nc"), MAIN).expect("a file");
    std::fs::write(folder.join("o0007.NC"), CALLED).expect("a file");
    folder
}

const MAIN: &str = "%\nO1\nG0 X0.\nM98 P7\nG0 X1.\nM98 P2\nM98 P7\nM30\nO2\nG1 X9. F100.\nM99\n%\n";
const CALLED: &str = "%\nO7\nG1 Y1. F5.\n  G1 Y2.  \nM99\n%\n";

fn called(folder: &Path) -> (CalledProgram, String) {
    let path = folder.join("main.nc");
    let called = CalledProgram::expanded(&path, MAIN.as_bytes(), Dialect::Fanuc).expect("no fault");
    let (called, text) = called.expect("calls");
    (called, String::from_utf8(text).expect("text"))
}

/// Each line of the text that runs is the line of the file that `place` names.
#[test]
fn lines_are_those_of_the_named_files() {
    let folder = folder("lines");
    let (called, text) = called(&folder);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.iter().filter(|line| line.contains('Y')).count(), 4, "{text}");
    for (k, line) in lines.iter().enumerate() {
        let (file, at) = called.place(k as u32 + 1);
        let written = std::fs::read_to_string(&file).expect("a file");
        assert_eq!(written.lines().nth(at as usize - 1), Some(*line), "{}", file.display());
        assert_eq!(called.written_text(k as u32 + 1), line.trim());
    }
    let [file] = called.called_files().try_into().expect("one called file");
    assert_eq!((file.program.file.as_str(), file.first_line), ("o0007.NC", 13));
    assert_eq!(called.stamp().file, "main.nc");
    std::fs::remove_dir_all(folder).expect("removed");
}

/// Subprograms in memory, or in a folder of their own, are expanded as those beside the program;
/// without them only those of the program's text are.
#[test]
fn subprograms_may_be_in_memory_or_in_another_folder() {
    let folder = folder("elsewhere");
    let (beside, text) = called(&folder);
    let named = BTreeMap::from([("o0007.NC".to_owned(), CALLED.as_bytes().to_vec()), ("other".to_owned(), vec![b'%'])]);
    let path = Path::new("nowhere/main.nc");
    let expanded = |callable: CallableFiles<'_>| {
        let found = CalledProgram::expanded_files(path, MAIN.as_bytes(), Dialect::Fanuc, callable).expect("no fault");
        let (called, text) = found.expect("calls");
        (called, String::from_utf8(text).expect("text"))
    };
    for callable in [CallableFiles::Named(&named), CallableFiles::InFolder(&folder)] {
        let (called, of_these) = expanded(callable);
        assert_eq!((called.called_files(), &of_these), (beside.called_files(), &text), "{callable:?}");
        assert_eq!(called.place(4), (PathBuf::from("nowhere/o0007.NC"), 3));
    }
    std::fs::remove_dir_all(&folder).expect("removed");
    for callable in [CallableFiles::Beside, CallableFiles::Named(&BTreeMap::new())] {
        let (called, of_text) = expanded(callable);
        assert!(called.called_files().is_empty() && of_text.matches("M98 P7").count() == 2, "{callable:?}: {of_text}");
        assert!(of_text.contains("X9.") && !of_text.contains("M98 P2"), "{of_text}");
    }
}

/// Every run of lines is there, in order, and the checksums of the written files.
#[test]
fn the_text_that_runs_is_described_run_by_run() {
    let folder = folder("runs");
    let (called, _) = called(&folder);
    std::fs::remove_dir_all(folder).expect("removed");
    let text = called.text_that_runs();
    assert!(text.starts_with("3 calls of subprograms"), "{text}");
    let runs = "1 to 3 are main.nc 1 to 3, 4 to 5 are o0007.NC 3 to 4, 6 to 6 are main.nc 5 to 5, 7 to 7 are main.nc 10 \
                to 10, 8 to 9 are o0007.NC 3 to 4, 10 to 10 are main.nc 8 to 8, 11 to 11 are main.nc 12 to 12;";
    assert!(text.contains(runs), "{text}");
    for file in [&called.stamp(), &called.called_files()[0].program] {
        assert!(text.contains(&format!("{} ({})", file.file, file.blake3)), "{text}");
    }
}

#[test]
fn a_program_without_calls_is_none() {
    let text = b"%\nO1\nG0 X0.\nM98 P99\nM30\n%\n";
    assert!(CalledProgram::expanded(Path::new("no/main.nc"), text, Dialect::Fanuc).expect("no fault").is_none());
}
