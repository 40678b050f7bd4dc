//! The interpreter of LinuxCNC, where it is installed.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Returns the interpreter of LinuxCNC: the program that the environment variable `FACEMILL_RS274`
/// names, or `rs274` of the search path; `None` without, with a message that says so.
pub fn linuxcnc_interpreter() -> Option<PathBuf> {
    let own = std::env::var_os("FACEMILL_RS274").map(PathBuf::from);
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let found = own.or_else(|| std::env::split_paths(&paths).map(|p| p.join("rs274")).find(|p| p.is_file()));
    if found.is_none() {
        eprintln!(
            "SKIPPED: no rs274; install the Debian package linuxcnc-uspace, or set FACEMILL_RS274 to its program"
        );
    }
    found
}

/// Returns whether the interpreter takes a program with a tool table, and all that it prints;
/// `name` tells runs at once apart.
///
/// # Panics
/// If files cannot be written or the interpreter cannot be started.
pub fn run_linuxcnc(rs274: &Path, text: &str, tool_table: &str, name: &str) -> (bool, String) {
    run_linuxcnc_beside(rs274, text, &[], tool_table, name)
}

/// Runs a program as [`run_linuxcnc`] does, with files of subprograms beside it: names and texts.
///
/// # Panics
/// As [`run_linuxcnc`].
pub fn run_linuxcnc_beside(
    rs274: &Path,
    text: &str,
    files: &[(String, String)],
    tool_table: &str,
    name: &str,
) -> (bool, String) {
    let folder = std::env::temp_dir().join(format!("facemill-rs274-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("tool.tbl"), tool_table).unwrap();
    std::fs::write(folder.join("program.ngc"), text).unwrap();
    files.iter().for_each(|(file, text)| std::fs::write(folder.join(file), text).unwrap());
    let output = Command::new(rs274)
        .args(["-t", "tool.tbl", "-g", "program.ngc"])
        .current_dir(&folder)
        // It keeps the tool table in a file there, which two runs at once would share.
        .env("HOME", &folder)
        .output()
        .unwrap_or_else(|e| panic!("{}: {e}", rs274.display()));
    std::fs::remove_dir_all(&folder).unwrap();
    let both = [output.stdout, output.stderr].concat();
    (output.status.success(), String::from_utf8_lossy(&both).into_owned())
}
