//! A process that works on one task, and its watcher.

use std::io::{Read, Write};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::Sender;

use facemill_file_format::to_json;

use crate::given::GivenTask;

/// Bytes that are kept of the end of a process's standard error.
const KEPT: usize = 1 << 14;

/// Process at work. Its standard input holds the task, and stays open as long as this is there: the
/// process ends when it is closed, so none outlives its scheduler.
#[derive(Debug)]
pub(crate) struct Worker {
    pub id: u32,
    /// Largest memory seen, MiB.
    pub peak_mib: Option<u64>,
    _alive: Option<ChildStdin>,
}

/// End of a process.
#[derive(Debug)]
pub(crate) struct WorkerEnd {
    /// Index of the task's key.
    pub index: usize,
    pub status: std::io::Result<ExitStatus>,
    /// End of its standard error.
    pub errors: String,
}

impl Worker {
    /// Starts a process on a task, and a thread that sends its end.
    ///
    /// # Errors
    /// If the process cannot be started.
    pub(crate) fn start(
        mut command: Command,
        index: usize,
        task: &GivenTask,
        ends: Sender<WorkerEnd>,
    ) -> std::io::Result<Self> {
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn()?;
        let mut alive = child.stdin.take();
        let given = to_json(task).replace('\n', " ");
        if let Some(input) = &mut alive {
            // A process that died at once is reported by its end.
            let _ = input.write_all(format!("{given}\n").as_bytes());
        }
        let id = child.id();
        let watch = move || {
            let errors = errors_of(&mut child);
            // The scheduler may be gone.
            let _ = ends.send(WorkerEnd { index, status: child.wait(), errors });
        };
        // Without a thread the process ends by itself: its input ends.
        std::thread::Builder::new().spawn(watch)?;
        Ok(Self { id, peak_mib: None, _alive: alive })
    }
}

/// Returns the end of what a process writes to standard error.
fn errors_of(child: &mut Child) -> String {
    let mut kept: Vec<u8> = Vec::new();
    let mut buffer = [0; 4096];
    let Some(mut errors) = child.stderr.take() else { return String::new() };
    while let Ok(n @ 1..) = errors.read(&mut buffer) {
        kept.extend(&buffer[..n]);
        let over = kept.len().saturating_sub(KEPT);
        kept.drain(..over);
    }
    String::from_utf8_lossy(&kept).into_owned()
}
