//! The monitor that the command line gives to long computations.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use facemill_cl_data::Monitor;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Set by Ctrl-C.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Set while files are being put in place, which is not to be cut short.
static WRITING: AtomicBool = AtomicBool::new(false);

/// How long a stage may take to notice an interruption before the program ends without it. Nothing is written before the
/// last stage is done, so ending loses nothing.
const PATIENCE: Duration = Duration::from_millis(600);

/// Makes Ctrl-C (and a termination request) set the flag that every [`Bar`] asks for, and end the program soon after where
/// nobody asks.
///
/// # Errors
/// When the system does not let a handler be installed.
pub(crate) fn watch_interrupts() -> Result<(), String> {
    ctrlc::set_handler(|| {
        INTERRUPTED.store(true, Ordering::Relaxed);
        std::thread::sleep(PATIENCE);
        if !WRITING.load(Ordering::Relaxed) {
            eprintln!("facemill: interrupted; nothing was written");
            std::process::exit(130);
        }
    })
    .map_err(|e| e.to_string())
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

/// Says that from now on files are put in place, unless Ctrl-C has been pressed; then it says so.
pub(crate) fn start_writing() -> bool {
    WRITING.store(true, Ordering::Relaxed);
    !is_interrupted()
}

/// Whether Ctrl-C has been pressed.
fn is_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}
