//! Long calls without Python's lock, which Ctrl-C ends.

use std::panic::resume_unwind;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::{Builder, scope};
use std::time::Duration;

use facemill::cl_data::Monitor;
use facemill::{Failure, Stages};
use pyo3::prelude::*;

use crate::failure::raised;

/// Time between looks at Python's signals.
const LOOK: Duration = Duration::from_millis(50);

/// Stack of the thread that computes, bytes: that of a main thread.
const STACK: usize = 8 << 20;

/// Stages that a signal cancels.
#[derive(Debug, Default)]
pub struct CancelledStages {
    cancelled: std::sync::Arc<AtomicBool>,
}

struct CancelledMonitor(std::sync::Arc<AtomicBool>);

impl Monitor for CancelledMonitor {
    fn advance(&self, _steps: usize) {}

    fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl Stages for CancelledStages {
    fn start(&self, _what: &'static str, _n: usize) -> Box<dyn Monitor> {
        Box::new(CancelledMonitor(self.cancelled.clone()))
    }
}

/// Waits for what another thread sends, without Python's lock, and looks for signals meanwhile.
/// Returns `None` if it ended without.
///
/// # Errors
/// The exception that a handler of Python raises.
pub fn awaited<T: Send>(py: Python<'_>, receiver: Receiver<T>) -> PyResult<Option<T>> {
    let receiver = Mutex::new(receiver);
    py.detach(|| {
        let Ok(receiver) = receiver.lock() else { return Ok(None) };
        loop {
            match receiver.recv_timeout(LOOK) {
                Ok(sent) => return Ok(Some(sent)),
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
                Err(RecvTimeoutError::Timeout) => Python::attach(|py| py.check_signals())?,
            }
        }
    })
}

/// Rows computed between looks at Python's signals.
const ROWS: usize = 10_000;

/// Computes rows without Python's lock, and looks for signals from time to time.
///
/// # Errors
/// The exception that a handler of Python raises.
pub fn in_blocks<T: Send>(py: Python<'_>, n: usize, row: impl Fn(usize) -> T + Sync) -> PyResult<Vec<T>> {
    let mut rows = Vec::with_capacity(n);
    while rows.len() < n {
        let next = rows.len()..(rows.len() + ROWS).min(n);
        py.detach(|| rows.extend(next.map(&row)));
        py.check_signals()?;
    }
    Ok(rows)
}

/// Computes in a thread of its own, without Python's lock, while this thread looks for signals: an
/// exception that a handler of Python raises cancels the stages, and is raised when they have
/// ended.
///
/// # Errors
/// The failure, or the exception of a handler.
pub fn interruptible<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&CancelledStages) -> Result<T, Failure> + Send,
) -> PyResult<T> {
    let stages = CancelledStages::default();
    let cancelled = stages.cancelled.clone();
    let mut interrupted = None;
    let done = py.detach(|| {
        scope(|s| {
            let (sender, receiver) = channel::<()>();
            let worker = Builder::new().stack_size(STACK).spawn_scoped(s, move || {
                // Dropped at the end, also by a panic: this wakes the thread that waits.
                let _sender = sender;
                work(&stages)
            });
            let worker = worker.map_err(|e| Failure::Internal(format!("no thread: {e}")))?;
            while matches!(receiver.recv_timeout(LOOK), Err(RecvTimeoutError::Timeout)) {
                if interrupted.is_none()
                    && let Err(signal) = Python::attach(|py| py.check_signals())
                {
                    cancelled.store(true, Ordering::Relaxed);
                    interrupted = Some(signal);
                }
            }
            worker.join().unwrap_or_else(|panic| resume_unwind(panic))
        })
    });
    match (done, interrupted) {
        (_, Some(signal)) => Err(signal),
        (done, None) => done.map_err(|failure| raised(py, &failure)),
    }
}
