//! Files under temporary names, until they are whole.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufWriter, Error, ErrorKind, Result, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Beginning and end of temporary names; between them are the process and a count.
const NAME: [&str; 2] = [".facemill-", ".tmp"];

/// Bytes per write.
const AT_ONCE: usize = 1 << 18;

/// Counts the temporary files of this process.
static COUNT: AtomicU64 = AtomicU64::new(0);

/// File under a temporary name, before it gets its own. Its process holds a lock on it while it
/// writes: whoever can lock it knows that the process is gone.
pub(super) struct Temporary {
    waiting: BufWriter<File>,
    path: PathBuf,
}

impl Temporary {
    /// Writes bytes to a new temporary file in a folder, through to the disk.
    ///
    /// # Errors
    /// As the system reports; leaves nothing then.
    pub(super) fn write_in(folder: &Path, bytes: &[u8]) -> Result<Self> {
        let mut temporary = Self::empty_in(folder)?;
        temporary.write_all(bytes)?;
        temporary.finish()?;
        Ok(temporary)
    }

    /// Returns a new temporary file in a folder, to be written and then [`Temporary::finish`]ed.
    ///
    /// # Errors
    /// As the system reports; leaves nothing then.
    pub(super) fn empty_in(folder: &Path) -> Result<Self> {
        let [first, last] = NAME;
        for _ in 0..100 {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!("{first}{}-{count}{last}", std::process::id()));
            let file = match OpenOptions::new().write(true).create_new(true).open(&path) {
                Err(e) if e.kind() == ErrorKind::AlreadyExists => continue,
                other => other?,
            };
            // Where files cannot be locked, no process clears them, either.
            let _ = file.lock();
            // A process that clears the folder may have removed it before it was locked.
            if path.exists() {
                return Ok(Self { waiting: BufWriter::with_capacity(AT_ONCE, file), path });
            }
        }
        Err(Error::other("no temporary file can be made"))
    }

    /// Flushes the written bytes to the disk.
    ///
    /// # Errors
    /// As the system reports.
    pub(super) fn finish(&mut self) -> Result<()> {
        self.waiting.flush()?;
        self.waiting.get_ref().sync_all()
    }

    /// Gives the file its name and replaces an existing file; of a symbolic link the link, not its
    /// target.
    ///
    /// # Errors
    /// As the system reports; leaves nothing under the temporary name then.
    pub(super) fn rename_to(self, place: &Path) -> Result<()> {
        std::fs::rename(&self.path, place)
    }
}

impl Write for Temporary {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.waiting.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        self.waiting.flush()
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // After a rename there is nothing to remove.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Removes the temporary files in a folder whose processes are gone: killed, or out of their
/// limits. Leaves files that cannot be locked.
pub(super) fn clear_left_behind(folder: &Path) {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries.filter(|e| e.file_name().to_str().is_some_and(is_temporary)) {
        if !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        let path = entry.path();
        let Ok(file) = OpenOptions::new().write(true).open(&path) else { continue };
        match file.try_lock() {
            Ok(()) => {
                let _ = std::fs::remove_file(&path);
            }
            Err(TryLockError::WouldBlock | TryLockError::Error(_)) => {}
        }
    }
}

/// Returns whether a name is one that this program gives to its temporary files.
fn is_temporary(name: &str) -> bool {
    let [first, last] = NAME;
    let between = name.strip_prefix(first).and_then(|name| name.strip_suffix(last));
    let numbers = between.and_then(|name| name.split_once('-'));
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    numbers.is_some_and(|(process, count)| is_number(process) && is_number(count))
}
