//! The monitor that the command line gives to long computations.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use facemill_cl_data::Monitor;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Set by Ctrl-C.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Makes Ctrl-C (and a termination request) set the flag that every [`Bar`] asks for.
///
/// # Errors
/// When the system does not let a handler be installed.
pub(crate) fn watch_interrupts() -> Result<(), String> {
    ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed)).map_err(|e| e.to_string())
}

/// A progress bar on standard error, visible only when that is a terminal.
pub(crate) struct Bar {
    bar: ProgressBar,
}

impl Bar {
    /// A bar of `n` steps.
    pub(crate) fn new(what: &'static str, n: usize) -> Self {
        let bar = ProgressBar::with_draw_target(Some(n as u64), ProgressDrawTarget::stderr_with_hz(10));
        let style = ProgressStyle::with_template("{msg:<22} {bar:32} {pos:>7}/{len:<7} {eta}")
            .expect("the template is fixed and valid");
        bar.set_style(style);
        bar.set_message(what);
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

impl Monitor for Bar {
    fn advance(&self, steps: usize) {
        self.bar.inc(steps as u64);
    }
    fn is_cancelled(&self) -> bool {
        INTERRUPTED.load(Ordering::Relaxed)
    }
}

/// Whether Ctrl-C has been pressed.
pub(crate) fn is_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}
