//! Locks of tasks: which process works on what, and whether it still lives.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant, SystemTime};

use facemill_job::failure::Failure;

use crate::store::names::Holder;

/// Time between signs of life of a process that holds a lock.
const BEAT: Duration = Duration::from_secs(5);

/// Tries for a lock after the first: [`is_locked`] has it for a moment, too.
const LOCK_TRIES: usize = 4;

/// Time between tries.
const BETWEEN_TRIES: Duration = Duration::from_millis(2);

/// Lock on a task; dropping it frees the task.
#[derive(Debug)]
pub struct TaskLock {
    file: File,
    path: PathBuf,
    /// Ends the thread of the signs of life.
    beat: Option<Sender<()>>,
}

impl TaskLock {
    /// Locks a task by its file; `None` if another process has the lock.
    ///
    /// # Errors
    /// [`Failure::Write`] if the file cannot be made, or the file system has no locks.
    pub(crate) fn take(path: PathBuf) -> Result<Option<Self>, Failure> {
        let failed = |source| Failure::Write { file: path.clone(), source };
        let mut tries = 0;
        loop {
            let file = OpenOptions::new().create(true).truncate(false).write(true).open(&path).map_err(failed)?;
            match file.try_lock() {
                Err(TryLockError::WouldBlock) if tries < LOCK_TRIES => {
                    tries += 1;
                    std::thread::sleep(BETWEEN_TRIES);
                }
                Err(TryLockError::WouldBlock) => return Ok(None),
                Err(TryLockError::Error(source)) => return Err(failed(source)),
                // The process that had the lock before may have removed this file since.
                Ok(()) if is_at(&file, &path) => return Ok(Some(Self { file, path, beat: None })),
                Ok(()) => {}
            }
        }
    }

    /// Writes which process has the lock into its file, and from now on gives a sign of life from
    /// time to time: others see that it works, however long it takes.
    pub fn show(&mut self) {
        let Holder { host, process } = Holder::own();
        // Without it the lock is the same. What a killed process left may be longer.
        let _ = self.file.set_len(0);
        let _ = self.file.write_all(format!("{host} {process}\n").as_bytes());
        let Ok(file) = self.file.try_clone() else { return };
        let (sender, receiver) = channel::<()>();
        let beat = move || {
            while matches!(receiver.recv_timeout(BEAT), Err(RecvTimeoutError::Timeout)) {
                let _ = file.set_modified(SystemTime::now());
            }
        };
        // A bound of memory may leave no room for a thread.
        self.beat = std::thread::Builder::new().stack_size(1 << 16).spawn(beat).ok().map(|_| sender);
    }
}

impl Drop for TaskLock {
    fn drop(&mut self) {
        drop(self.beat.take());
        // Under the lock: a process that waits for it sees that the name has another file.
        if cfg!(unix) {
            let _ = std::fs::remove_file(&self.path);
        }
        let _ = self.file.unlock();
    }
}

/// Returns whether a process has a lock.
pub(crate) fn is_locked(path: &Path) -> bool {
    let file = OpenOptions::new().write(true).open(path);
    file.is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
}

/// Returns the process that the file of a lock names.
pub(crate) fn holder(path: &Path) -> Option<Holder> {
    let text = std::fs::read_to_string(path).ok()?;
    let (host, process) = text.trim().split_once(' ')?;
    Some(Holder { host: host.to_owned(), process: process.parse().ok()? })
}

/// Signs of life of the process that has a lock, as another one sees them: only its own clock
/// counts.
#[derive(Clone, Copy, Debug)]
pub struct SignsOfLife {
    last: Option<SystemTime>,
    since: Instant,
}

impl SignsOfLife {
    /// Begins to watch.
    pub fn watch() -> Self {
        Self { last: None, since: Instant::now() }
    }

    /// Looks at the file of a lock; returns for how long there has been no sign of life.
    pub(crate) fn look(&mut self, path: &Path) -> Duration {
        let modified = std::fs::metadata(path).and_then(|m| m.modified()).ok();
        if modified != self.last {
            *self = Self { last: modified, since: Instant::now() };
        }
        self.since.elapsed()
    }
}

/// Returns whether a path names this open file.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let place = |m: std::fs::Metadata| (m.dev(), m.ino());
    matches!((file.metadata().map(place), std::fs::metadata(path).map(place)), (Ok(a), Ok(b)) if a == b)
}

/// Returns whether a path names this open file; no lock's file is removed here.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}
