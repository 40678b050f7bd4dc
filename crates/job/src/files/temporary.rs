//! Files under temporary names, until they are whole.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufWriter, Error, ErrorKind, Result, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// What temporary names begin and end with; between them are the process and a count.
const NAME: [&str; 2] = [".facemill-", ".tmp"];

/// Bytes that are written at once.
const AT_ONCE: usize = 1 << 18;

/// Counts the temporary files of this process.
static COUNT: AtomicU64 = AtomicU64::new(0);

/// A file that is written and has not got its name yet. Its process holds a lock on it as long as
/// it writes, so that whoever can lock it knows that its process is gone.
pub(super) struct Temporary {
    waiting: BufWriter<File>,
    path: PathBuf,
}

impl Temporary {
    /// Writes bytes to a new temporary file in a folder, through to the disk.
    ///
    /// # Errors
    /// As the system says; nothing is left then.
    pub(super) fn write_in(folder: &Path, bytes: &[u8]) -> Result<Self> {
        let mut temporary = Self::empty_in(folder)?;
        temporary.write_all(bytes)?;
        temporary.finish()?;
        Ok(temporary)
    }

    /// A new temporary file in a folder to be written to, and then [`Temporary::finish`]ed.
    ///
    /// # Errors
    /// As the system says; nothing is left then.
    pub(super) fn empty_in(folder: &Path) -> Result<Self> {
        let [first, last] = NAME;
        for _ in 0..100 {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!("{first}{}-{count}{last}", std::process::id()));
            let file = match OpenOptions::new().write(true).create_new(true).open(&path) {
                Err(e) if e.kind() == ErrorKind::AlreadyExists => continue,
                other => other?,
            };
            // Where files cannot be locked nobody clears them, either.
            let _ = file.lock();
            // Whoever clears the folder may have taken it before it was locked.
            if path.exists() {
                return Ok(Self { waiting: BufWriter::with_capacity(AT_ONCE, file), path });
            }
        }
        Err(Error::other("no temporary file can be made"))
    }

    /// Brings what was written through to the disk.
    ///
    /// # Errors
    /// As the system says.
    pub(super) fn finish(&mut self) -> Result<()> {
        self.waiting.flush()?;
        self.waiting.get_ref().sync_all()
    }

    /// Gives the file its name; what was there is replaced, a symbolic link itself and not what it
    /// leads to.
    ///
    /// # Errors
    /// As the system says; nothing is left under the temporary name then.
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
        // Nothing is there any more where it was renamed.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Removes the temporary files in a folder whose processes are gone: killed, or out of their
/// limits. What cannot be locked stays.
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

/// Whether a name is one that this program gives to its temporary files.
fn is_temporary(name: &str) -> bool {
    let [first, last] = NAME;
    let between = name.strip_prefix(first).and_then(|name| name.strip_suffix(last));
    let numbers = between.and_then(|name| name.split_once('-'));
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    numbers.is_some_and(|(process, count)| is_number(process) && is_number(count))
}
