//! Folder of results: each is there whole or not at all, under its key.

pub mod names;
pub mod task_lock;

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use facemill_file_format::{from_json, to_json};
use facemill_job::failure::Failure;
use facemill_job::files;

use crate::format::result_file::{FailedFile, ResultFile, ResultsFile, ResultsFormat, TaskTimes};
use crate::store::names::{Holder, is_key, names_in, read_temporary_name, temporary_name};
use crate::store::task_lock::{SignsOfLife, TaskLock};

/// File of the result in a task's folder.
pub const RESULT: &str = "result.json";

/// File of times and memory in a task's folder.
pub const TIMES: &str = "times.json";

/// File that says that a folder is one of results.
pub const MARKER: &str = "facemill-results.json";

/// Folder of results:
///
/// | name | holds |
/// |---|---|
/// | `facemill-results.json` | format of the folder, and the checksum of the batch that was run last |
/// | `batches/CHECKSUM.json` | copy of each batch that was run |
/// | `tasks/KEY/` | files of a task, with `result.json` and `times.json` |
/// | `failed/KEY.json` | failure of a task that has no result |
/// | `locks/KEY` | lock of the process that works on a task; its end, however it comes, frees it |
/// | `tmp/KEY.HOST-PROCESS-N/` | files of a result before it is whole |
///
/// Other names in these folders are not ours, and left alone.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
    /// Whether results are written through to the disk.
    is_durable: bool,
}

impl Store {
    /// Returns the results in a folder, which need not exist; for looking at them.
    pub fn at(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), is_durable: true }
    }

    /// Returns the results in a folder, which is made if it is missing.
    ///
    /// # Errors
    /// [`Failure::Input`] if it is not empty and no folder of results: nothing of others is
    /// touched; [`Failure::Write`] if it cannot be written to.
    pub fn open(folder: &Path) -> Result<Self, Failure> {
        files::check_folder(folder)?;
        let failed = |path: &Path| {
            let file = path.to_owned();
            move |source| Failure::Write { file, source }
        };
        if !has_marker(folder)? {
            let names = names_in(folder);
            let other = names.iter().find(|name| !name.starts_with('.') && *name != "lost+found");
            // Another process may have made the folder since.
            if let Some(name) = other.filter(|_| !names.iter().any(|name| name == MARKER)) {
                return Err(Failure::input(folder, not_ours(name)));
            }
            std::fs::create_dir_all(folder).map_err(failed(folder))?;
            let marker = folder.join(MARKER);
            // Before any other name is there: another process that opens the folder now finds it.
            match File::create_new(&marker) {
                Ok(mut file) => file.write_all(marker_text(None).as_bytes()).map_err(failed(&marker))?,
                Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
                Err(source) => return Err(failed(&marker)(source)),
            }
        }
        for name in ["tasks", "failed", "locks", "tmp", "batches"] {
            let path = folder.join(name);
            std::fs::create_dir_all(&path).map_err(failed(&path))?;
        }
        Ok(Self::at(folder))
    }

    /// Returns the results in a folder that has some.
    ///
    /// # Errors
    /// [`Failure::Input`] if it is none of results.
    pub fn existing(folder: &Path) -> Result<Self, Failure> {
        if has_marker(folder)? {
            return Ok(Self::at(folder));
        }
        let what = format!("has no results of a batch ({MARKER}); give the folder of `batch run --out`");
        Err(Failure::input(folder, what))
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

    fn lock_file(&self, key: &str) -> PathBuf {
        self.folder.join("locks").join(key)
    }

    /// Returns the result of a task; `None` if there is none, one of a later version, or one that
    /// has lost files.
    pub fn result(&self, key: &str) -> Option<ResultFile> {
        let folder = self.task_folder(key);
        let result: ResultFile = from_json(&std::fs::read(folder.join(RESULT)).ok()?).ok()?;
        let there: BTreeSet<String> = names_in(&folder).into_iter().collect();
        (result.key == key && result.files.iter().all(|name| there.contains(name))).then_some(result)
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
        TaskLock::take(self.lock_file(key))
    }

    /// Returns whether a process works on a task.
    pub fn is_locked(&self, key: &str) -> bool {
        task_lock::is_locked(&self.lock_file(key))
    }

    /// Returns the process that works on a task, if it is known.
    pub fn holder(&self, key: &str) -> Option<Holder> {
        task_lock::holder(&self.lock_file(key))
    }

    /// Returns for how long the process that works on a task has given no sign of life.
    pub fn without_sign(&self, key: &str, signs: &mut SignsOfLife) -> Duration {
        signs.look(&self.lock_file(key))
    }

    /// Files a result: writes all files to a folder of another name, through to the disk, and gives
    /// it its name. Whoever finds the folder finds all of it. A result that is there stays, so that
    /// two processes may file the same one. Removes the record of an earlier failure.
    ///
    /// # Errors
    /// [`Failure::Write`]; leaves nothing then.
    pub fn file(&self, key: &str, all: &[(String, Vec<u8>)]) -> Result<(), Failure> {
        let temporary = self.new_temporary(key)?;
        let place = self.task_folder(key);
        let filed = self.write(&temporary, all).and_then(|()| self.put_in_place(&temporary, key));
        // After the rename there is nothing to remove.
        let _ = remove_folder(&temporary);
        filed.map_err(|source| Failure::Write { file: place, source })?;
        self.forget_failure(key)
    }

    /// Makes a folder that no other process writes to.
    fn new_temporary(&self, key: &str) -> Result<PathBuf, Failure> {
        loop {
            let name = temporary_name(key, COUNT.fetch_add(1, Ordering::Relaxed));
            let path = self.folder.join("tmp").join(name);
            match std::fs::create_dir(&path) {
                Ok(()) => return Ok(path),
                // Of a process of the same number on a machine of the same name.
                Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
                Err(source) => return Err(Failure::Write { file: path, source }),
            }
        }
    }

    /// Gives the files of a result their place, unless another process was faster.
    fn put_in_place(&self, temporary: &Path, key: &str) -> std::io::Result<()> {
        let place = self.task_folder(key);
        for _ in 0..PLACE_TRIES {
            if self.result(key).is_some() {
                return Ok(());
            }
            // A rename replaces no folder that has files.
            match std::fs::rename(temporary, &place) {
                Err(e) if place.exists() && e.kind() != ErrorKind::StorageFull => {}
                ended => return ended,
            }
            if self.result(key).is_some() {
                return Ok(());
            }
            // A folder without a result that can be read: damaged.
            let aside = self.new_temporary(key).map_err(std::io::Error::other)?;
            std::fs::remove_dir(&aside)?;
            let moved = std::fs::rename(&place, &aside);
            remove_folder(&aside)?;
            moved.or_else(|e| if e.kind() == ErrorKind::NotFound { Ok(()) } else { Err(e) })?;
        }
        Err(std::io::Error::other("other files take its place again and again"))
    }

    /// Writes the files of a result into a new folder, through to the disk: all at once, which
    /// takes the disk hardly longer than one.
    fn write(&self, folder: &Path, all: &[(String, Vec<u8>)]) -> std::io::Result<()> {
        let mut written = Vec::with_capacity(all.len() + 1);
        for (name, bytes) in all {
            let mut file = File::create_new(folder.join(name))?;
            file.write_all(bytes)?;
            written.push(file);
        }
        if !self.is_durable {
            return Ok(());
        }
        // Its names, too, where the system can. The rename into place is not written through: if a
        // crash loses it, the task is run again.
        if cfg!(unix) {
            written.push(File::open(folder)?);
        }
        std::thread::scope(|scope| {
            let sync = |file: File| move || file.sync_all();
            let mut waiting = Vec::new();
            for file in written {
                let Ok(copy) = file.try_clone() else {
                    file.sync_all()?;
                    continue;
                };
                let thread = std::thread::Builder::new().stack_size(1 << 16);
                match thread.spawn_scoped(scope, sync(copy)) {
                    Ok(thread) => waiting.push(thread),
                    // A bound of memory may leave no room for it.
                    Err(_) => file.sync_all()?,
                }
            }
            let ended = waiting.into_iter().map(|thread| thread.join());
            ended
                .into_iter()
                .try_for_each(|end| end.unwrap_or_else(|_| Err(std::io::Error::other("a thread panicked"))))
        })
    }

    /// Removes files that processes left which are gone: those of results that are not whole, and
    /// locks that nobody holds. Those of other machines are removed when they are a day old.
    /// Returns the number of unfinished results removed.
    ///
    /// # Errors
    /// [`Failure::Write`].
    pub fn clear_left_behind(&self) -> Result<usize, Failure> {
        let mut n = 0;
        let folder = self.folder.join("tmp");
        for name in names_in(&folder) {
            let Some((key, holder)) = read_temporary_name(&name) else { continue };
            let temporary = folder.join(&name);
            let is_dead = holder.is_gone() && !self.is_locked(key);
            if !is_dead && !is_older(&temporary, LEFT_BEHIND) {
                continue;
            }
            remove_folder(&temporary).map_err(|source| Failure::Write { file: temporary, source })?;
            n += 1;
        }
        for key in names_in(&self.folder.join("locks")).iter().filter(|name| is_key(name)) {
            drop(self.lock(key)?);
        }
        Ok(n)
    }

    /// Returns the keys of all results.
    pub fn keys(&self) -> Vec<String> {
        names_in(&self.folder.join("tasks")).into_iter().filter(|name| is_key(name)).collect()
    }

    /// Returns the keys of all failures.
    pub fn failed_keys(&self) -> Vec<String> {
        let names = names_in(&self.folder.join("failed"));
        names
            .iter()
            .filter_map(|name| name.strip_suffix(".json").filter(|key| is_key(key)).map(str::to_owned))
            .collect()
    }

    /// Removes the result of a task that no process works on. Returns whether it was removed.
    ///
    /// # Errors
    /// [`Failure::Write`].
    pub fn remove(&self, key: &str) -> Result<bool, Failure> {
        let Some(lock) = self.lock(key)? else { return Ok(false) };
        let (place, temporary) = (self.task_folder(key), self.new_temporary(key)?);
        // At once, so that no half of a result is left under its name.
        let removed = std::fs::remove_dir(&temporary).and_then(|()| std::fs::rename(&place, &temporary));
        let removed = removed.and_then(|()| remove_folder(&temporary));
        removed.map_err(|source| Failure::Write { file: place, source })?;
        drop(lock);
        Ok(true)
    }

    /// Keeps a copy of a batch, as the one that was run last.
    ///
    /// # Errors
    /// [`Failure::Write`].
    pub fn keep_batch(&self, text: &[u8]) -> Result<(), Failure> {
        let checksum = blake3::hash(text).to_hex().to_string();
        let copy = self.folder.join("batches").join(format!("{checksum}.json"));
        if !copy.exists() {
            files::write_one(&copy, text.to_owned())?;
        }
        files::write_one(&self.folder.join(MARKER), marker_text(Some(checksum)).into_bytes())
    }

    /// Returns whether a batch is the one that was run last.
    pub fn is_last_batch(&self, text: &[u8]) -> bool {
        let marker = std::fs::read(self.folder.join(MARKER)).ok();
        let marker: Option<ResultsFile> = marker.and_then(|text| from_json(&text).ok());
        marker.and_then(|marker| marker.batch) == Some(blake3::hash(text).to_hex().to_string())
    }
}

/// Number of folders in `tmp` that this process has made.
static COUNT: AtomicUsize = AtomicUsize::new(0);

/// Tries to put a result in the place of damaged ones.
const PLACE_TRIES: usize = 10;

/// Age at which the unfinished result of another machine is no longer written to.
const LEFT_BEHIND: Duration = Duration::from_secs(24 * 3600);

fn marker_text(batch: Option<String>) -> String {
    to_json(&ResultsFile { format: ResultsFormat::V1, batch })
}

/// Returns whether a folder is one of results.
///
/// # Errors
/// [`Failure::Input`] if it is one of another version.
fn has_marker(folder: &Path) -> Result<bool, Failure> {
    let path = folder.join(MARKER);
    match std::fs::read(&path) {
        // A process makes it now, or was killed then.
        Ok(text) if text.is_empty() => Ok(true),
        Ok(text) => from_json::<ResultsFile>(&text).map(|_| true).map_err(|e| Failure::input(&path, e)),
        Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(false),
        Err(source) => Err(Failure::Read { file: path, source }),
    }
}

fn not_ours(name: &str) -> String {
    format!(
        "has other files (\"{name}\"), and no {MARKER}; give a new or empty folder with --out. If it has the results of a \
         version without this file, make it: {{\"format\": \"facemill-results/1\"}}"
    )
}

/// Returns whether a folder was last written to so long ago.
fn is_older(folder: &Path, age: Duration) -> bool {
    let modified = std::fs::metadata(folder).and_then(|m| m.modified());
    modified.is_ok_and(|time| time.elapsed().is_ok_and(|passed| passed > age))
}

fn remove_folder(folder: &Path) -> std::io::Result<()> {
    match std::fs::remove_dir_all(folder) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(e),
        _ => Ok(()),
    }
}

#[cfg(test)]
#[path = "../tests/unit/store.rs"]
mod tests;
