//! The `facemill` command, built as the tests are.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use facemill::virtual_machine::FindingKind;
use serde_json::Value;

/// The binary of this profile. It is built here, because cargo builds no binaries of other packages
/// for a test.
///
/// # Panics
/// When it cannot be built.
pub fn facemill() -> &'static Path {
    static BINARY: OnceLock<PathBuf> = OnceLock::new();
    BINARY.get_or_init(|| {
        let exe = std::env::current_exe().expect("a test knows where it is");
        // target/<profile>/deps/<test>, or target/<profile>/<command>.
        let folder = exe.ancestors().skip(1).find(|f| !f.ends_with("deps")).expect("a profile folder");
        let profile = match folder.file_name().and_then(|n| n.to_str()) {
            Some("debug") | None => "dev",
            Some(name) => name,
        };
        let status = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
            // With the tests of all packages, as `cargo test --workspace` has just built them:
            // alone, the binary's crates would have other features, and all be compiled a second
            // time.
            .args(["build", "--quiet", "--workspace", "--tests", "--bin", "facemill", "--profile", profile])
            .arg("--target-dir")
            .arg(folder.parent().expect("a target folder"))
            .current_dir(crate::shared::workspace())
            .status()
            .expect("cargo runs");
        assert!(status.success(), "cannot build facemill");
        folder.join(format!("facemill{}", std::env::consts::EXE_SUFFIX))
    })
}

/// Runs the command to its end.
///
/// # Panics
/// When it cannot be started.
pub fn run<A: AsRef<std::ffi::OsStr>>(arguments: &[A]) -> Output {
    Command::new(facemill()).args(arguments).output().expect("facemill starts")
}

/// Exit code and what was said on standard error.
///
/// # Panics
/// When it was killed.
pub fn code_and_errors(output: &Output) -> (i32, String) {
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code().unwrap_or_else(|| panic!("killed: {errors}")), errors)
}

/// Findings of a report that are faults.
///
/// # Panics
/// When the report has no findings, or one of no known kind.
pub fn faults(report: &Value) -> Vec<&Value> {
    let findings = report["findings"].as_array().expect("findings");
    let kind = |f: &Value| serde_json::from_value::<FindingKind>(f["kind"].clone()).expect("a kind of findings");
    findings.iter().filter(|f| kind(f).is_fault()).collect()
}
