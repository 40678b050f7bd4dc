//! Folder of results: each is there whole or not at all, under its key.

use std::fs::{File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};
use std::time::Duration;

use facemill_file_format::{from_json, to_json};
use facemill_job::failure::Failure;
use facemill_job::files;

use crate::format::result_file::{FailedFile, ResultFile, TaskTimes};

/// File of the result in a task's folder.
pub const RESULT: &str = "result.json";

/// File of times and memory in a task's folder.
pub const TIMES: &str = "times.json";

/// Folder of results:
///
/// | name | holds |
/// |---|---|
/// | `batch.json` | copy of the batch that was run last |
/// | `tasks/KEY/` | files of a task, with `result.json` and `times.json` |
/// | `failed/KEY.json` | failure of a task that has no result |
/// | `locks/KEY` | lock of the process that works on a task; its end, however it comes, frees it |
/// | `tmp/KEY/` | files of a result before it is whole |
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
    /// Whether results are written through to the disk.
    is_durable: bool,
}

/// Lock on a task; dropping it frees the task.
#[derive(Debug)]
pub struct TaskLock {
    file: File,
    path: PathBuf,
}

impl Drop for TaskLock {
    fn drop(&mut self) {
        // Under the lock: a process that waits for it sees that the name has another file.
        if cfg!(unix) {
            let _ = std::fs::remove_file(&self.path);
        }
        let _ = self.file.unlock();
    }
}

impl Store {
    /// Returns the results in a folder, which need not exist; for looking at them.
    pub fn at(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), is_durable: true }
    }

    /// Returns the results in a folder, which is made if it is missing.
    ///
    /// # Errors
    /// [`Failure::Write`] if it cannot be written to.
    pub fn open(folder: &Path) -> Result<Self, Failure> {
        files::check_folder(folder)?;
        for name in ["tasks", "failed", "locks", "tmp"] {
            let path = folder.join(name);
            std::fs::create_dir_all(&path).map_err(|source| Failure::Write { file: path, source })?;
        }
        Ok(Self::at(folder))
    }

    /// Opens results as [`Store::open`] does, for a worker that passes them on at once: they are
    /// filed whole, but not written through to the disk.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn open_passing(folder: &Path) -> Result<Self, Failure> {
        Ok(Self { is_durable: false, ..Self::open(folder)? })
    }

    /// Returns the folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns the folder of a task's result.
    pub fn task_folder(&self, key: &str) -> PathBuf {
        self.folder.join("tasks").join(key)
    }

    fn failed_file(&self, key: &str) -> PathBuf {
        self.folder.join("failed").join(format!("{key}.json"))
    }

    fn temporary(&self, key: &str) -> PathBuf {
        self.folder.join("tmp").join(key)
    }

    /// Returns the result of a task; `None` if there is none, or one of a later version.
    pub fn result(&self, key: &str) -> Option<ResultFile> {
        from_json(&std::fs::read(self.task_folder(key).join(RESULT)).ok()?).ok()
    }

    /// Returns times and memory of a task's result.
    pub fn times(&self, key: &str) -> Option<TaskTimes> {
        from_json(&std::fs::read(self.task_folder(key).join(TIMES)).ok()?).ok()
    }

    /// Returns the failure of a task; `None` if it has not failed.
    pub fn failure(&self, key: &str) -> Option<FailedFile> {
        from_json(&std::fs::read(self.failed_file(key)).ok()?).ok()
    }

    /// Records the failure of a task.
    ///
    /// # Errors
    /// [`Failure::Write`].
    pub fn record_failure(&self, failed: &FailedFile) -> Result<(), Failure> {
        files::write_one(&self.failed_file(&failed.key), to_json(failed).into_bytes())
    }

    /// Removes the record of a task's failure, if there is one.
    ///
    /// # Errors
    /// [`Failure::Write`].
    pub fn forget_failure(&self, key: &str) -> Result<(), Failure> {
        files::remove_earlier(&self.failed_file(key)).map(drop)
    }

    /// Locks a task; `None` if another process works on it. The lock ends with the process, also
    /// when it is killed.
    ///
    /// # Errors
    /// [`Failure::Write`] if the lock's file cannot be made, or the file system has no locks.
    pub fn lock(&self, key: &str) -> Result<Option<TaskLock>, Failure> {
        let path = self.folder.join("locks").join(key);
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
                Ok(()) if is_at(&file, &path) => return Ok(Some(TaskLock { file, path })),
                Ok(()) => {}
            }
        }
    }

    /// Returns whether a process works on a task.
    pub fn is_locked(&self, key: &str) -> bool {
        let file = OpenOptions::new().write(true).open(self.folder.join("locks").join(key));
        file.is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
    }

    /// Files a result: writes all files to a folder of another name, through to the disk, and gives
    /// it its name. Whoever finds the folder finds all of it. Removes the record of an earlier
    /// failure.
    ///
    /// # Errors
    /// [`Failure::Write`]; leaves nothing then.
    pub fn file(&self, lock: &TaskLock, key: &str, all: &[(String, Vec<u8>)]) -> Result<(), Failure> {
        debug_assert!(lock.path.ends_with(key), "the lock of another task");
        let (temporary, place) = (self.temporary(key), self.task_folder(key));
        let failed = |file: &Path, source| Failure::Write { file: file.to_owned(), source };
        let filed = remove_folder(&temporary)
            .map_err(|source| failed(&temporary, source))
            .and_then(|()| self.write(&temporary, all))
            // A folder without a result that can be read: damaged, or not ours.
            .and_then(|()| remove_folder(&place).map_err(|source| failed(&place, source)))
            .and_then(|()| std::fs::rename(&temporary, &place).map_err(|source| failed(&place, source)))
            .and_then(|()| self.sync(&self.folder.join("tasks")).map_err(|source| failed(&place, source)));
        if filed.is_err() {
            let _ = remove_folder(&temporary);
        }
        filed?;
        self.forget_failure(key)
    }

    /// Writes the files of a result into a new folder.
    fn write(&self, folder: &Path, all: &[(String, Vec<u8>)]) -> Result<(), Failure> {
        let failed = |source| Failure::Write { file: folder.to_owned(), source };
        if self.is_durable {
            files::write_all(folder, all)?;
            return self.sync(folder).map_err(failed);
        }
        std::fs::create_dir_all(folder).map_err(failed)?;
        all.iter().try_for_each(|(name, bytes)| std::fs::write(folder.join(name), bytes)).map_err(failed)
    }

    /// Writes the names in a folder through to the disk, where the system can.
    fn sync(&self, folder: &Path) -> std::io::Result<()> {
        if cfg!(unix) && self.is_durable { File::open(folder)?.sync_all() } else { Ok(()) }
    }

    /// Removes files that processes left which are gone: those of results that are not whole, and
    /// locks that nobody holds. Returns the number of unfinished results removed.
    ///
    /// # Errors
    /// [`Failure::Write`].
    pub fn clear_left_behind(&self) -> Result<usize, Failure> {
        let mut n = 0;
        for key in names_in(&self.folder.join("tmp")) {
            let Some(lock) = self.lock(&key)? else { continue };
            let temporary = self.temporary(&key);
            remove_folder(&temporary).map_err(|source| Failure::Write { file: temporary, source })?;
            n += 1;
            drop(lock);
        }
        for key in names_in(&self.folder.join("locks")) {
            drop(self.lock(&key)?);
        }
        Ok(n)
    }

    /// Returns the keys of all results.
    pub fn keys(&self) -> Vec<String> {
        names_in(&self.folder.join("tasks"))
    }

    /// Returns the keys of all failures.
    pub fn failed_keys(&self) -> Vec<String> {
        let names = names_in(&self.folder.join("failed"));
        names.iter().filter_map(|name| name.strip_suffix(".json").map(str::to_owned)).collect()
    }

    /// Removes the result of a task that no process works on. Returns whether it was removed.
    ///
    /// # Errors
    /// [`Failure::Write`].
    pub fn remove(&self, key: &str) -> Result<bool, Failure> {
        let Some(lock) = self.lock(key)? else { return Ok(false) };
        let (place, temporary) = (self.task_folder(key), self.temporary(key));
        let failed = |source| Failure::Write { file: place.clone(), source };
        remove_folder(&temporary).map_err(failed)?;
        // At once, so that no half of a result is left under its name.
        std::fs::rename(&place, &temporary).and_then(|()| remove_folder(&temporary)).map_err(failed)?;
        drop(lock);
        Ok(true)
    }

    /// Keeps a copy of the batch beside the results.
    ///
    /// # Errors
    /// [`Failure::Write`].
    pub fn keep_batch(&self, text: &[u8]) -> Result<(), Failure> {
        files::write_one(&self.folder.join("batch.json"), text.to_owned())
    }
}

/// Tries for a lock after the first: [`Store::is_locked`] has it for a moment, too.
const LOCK_TRIES: usize = 4;

/// Time between tries.
const BETWEEN_TRIES: Duration = Duration::from_millis(2);

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

fn remove_folder(folder: &Path) -> std::io::Result<()> {
    match std::fs::remove_dir_all(folder) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(e),
        _ => Ok(()),
    }
}

/// Returns the names in a folder, in their order; none if it cannot be read.
fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort_unstable();
    names
}

#[cfg(test)]
#[path = "../tests/unit/store.rs"]
mod tests;
