//! Standard output, and the folder of a plan's files.

pub(crate) mod findings_table;

use std::io::Write;
use std::path::{Path, PathBuf};

use facemill::Failure;

/// Writes to standard output. A reader that closed it early (`| head`) is no failure.
pub(crate) fn say(text: &str) -> Result<(), Failure> {
    say_bytes(text.as_bytes())
}

/// Writes bytes like [`say`], for a file that need not be UTF-8.
pub(crate) fn say_bytes(text: &[u8]) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text).and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::Write { file: PathBuf::from("standard output"), source: e })
        }
        _ => Ok(()),
    }
}

/// Returns `out/` with the name of the job's folder.
pub(crate) fn default_out(job: &Path) -> PathBuf {
    let folder = facemill::job_path(job)
        .canonicalize()
        .ok()
        .and_then(|p| p.parent().and_then(|f| f.file_name()).map(PathBuf::from));
    Path::new("out").join(folder.unwrap_or_else(|| PathBuf::from("job")))
}
