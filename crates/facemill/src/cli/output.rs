//! Standard output, and the folder of a plan's files.

use std::io::Write;
use std::path::{Path, PathBuf};

use facemill::{Failure, files};

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

/// Refuses an existing file that is not `what` it should be; an empty one counts as missing.
pub(crate) fn refuse_other(out: Option<&Path>, what: &str, is_ours: impl Fn(&[u8]) -> bool) -> Result<(), Failure> {
    // The write reports an unreadable file. The file is inspected for replacement: it is no input.
    let read = |out: &Path| out.metadata().is_ok_and(|m| m.is_file()).then(|| std::fs::read(out).ok()).flatten();
    let Some((out, bytes)) = out.and_then(|out| Some((out, read(out)?))) else { return Ok(()) };
    if bytes.is_empty() || is_ours(&bytes) {
        return Ok(());
    }
    let message =
        format!("exists and is not a {what}, so it is not from an earlier run: name another file, or remove it");
    Err(Failure::input(out, message))
}

/// Returns whether bytes are a file of this program of a format, regardless of its content.
pub(crate) fn has_format(bytes: &[u8], format: &str) -> bool {
    let file: Option<serde_json::Value> = serde_json::from_slice(bytes).ok();
    let named = file.as_ref().and_then(|file| file.get("format")?.as_str());
    named.is_some_and(|named| named.starts_with(format))
}

/// Removes the output of an earlier run under the name of a file that is not written, and says so.
pub(crate) fn leave_out(out: &Path, why: &str) -> Result<String, Failure> {
    let removed = if files::remove_earlier(out)? { "; the file of an earlier run was removed" } else { "" };
    Ok(format!("{why}: {} is not written{removed}", out.display()))
}
