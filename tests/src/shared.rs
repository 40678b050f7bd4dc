//! The folder of shared data from public sources, which is not part of the project.

use std::path::{Path, PathBuf};

/// The workspace's folder.
pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A file or folder of the shared data, `None` (and a line on standard error that says so) where it
/// is absent: tests that need it are skipped then. It is looked for in `FACEMILL_SHARED`, else
/// beside the workspace.
pub fn shared(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("FACEMILL_SHARED").map_or_else(|| workspace().join("../shared"), PathBuf::from);
    let path = root.join(name);
    if path.exists() {
        return Some(path);
    }
    eprintln!("SKIPPED: no shared data at {} (set FACEMILL_SHARED to its folder)", path.display());
    None
}
