//! Monitor of the command line for long computations.

pub(crate) mod forecast;
pub(crate) mod json_lines;

use std::fmt;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use facemill::cl_data::Monitor;
use facemill::{Stages, clock};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use crate::cli::progress::forecast::Forecast;
use crate::cli::progress::json_lines::JsonStage;

/// Set by Ctrl-C.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Set while files get their names, which must not be interrupted.
static WRITING: AtomicBool = AtomicBool::new(false);

/// Time that a stage may take to notice an interruption before the program ends without it. Nothing
/// is written before the last stage is done, so ending loses nothing.
const PATIENCE: Duration = Duration::from_millis(600);

/// Makes Ctrl-C (and a termination request) set the flag that every [`Monitor`] of a [`Progress`]
/// queries, and end the program soon after if none does.
///
/// # Errors
/// If the system does not permit a handler.
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

/// Display of a command's progress, on standard error.
pub(crate) struct Progress {
    show: Show,
    expected: Mutex<Vec<&'static str>>,
    /// Index of the next expected stage.
    next: AtomicUsize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Show {
    /// A bar for each stage, on a terminal.
    Bars,
    /// A line from time to time, if standard error is no terminal.
    Lines,
    /// A JSON object on each line, for programs.
    Json,
    Nothing,
}

/// Place of a stage among the expected ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct StagePlace {
    /// Number, from 1.
    number: usize,
    /// Number of expected stages.
    of: usize,
    is_again: bool,
}

impl Progress {
    /// Returns progress suited to standard error; none if `quiet`.
    pub(crate) fn new(quiet: bool) -> Self {
        let show = match (quiet, std::io::stderr().is_terminal()) {
            (true, _) => Show::Nothing,
            (false, true) => Show::Bars,
            (false, false) => Show::Lines,
        };
        Self::shown(show)
    }

    /// Returns progress as JSON lines on standard error.
    pub(crate) fn json() -> Self {
        Self::shown(Show::Json)
    }

    fn shown(show: Show) -> Self {
        Self { show, expected: Mutex::default(), next: AtomicUsize::new(0) }
    }

    /// Returns the place of a stage among the expected stages. A repeated stage keeps its number.
    fn place(&self, what: &str) -> Option<StagePlace> {
        let expected = self.expected.lock().unwrap_or_else(PoisonError::into_inner);
        let next = self.next.load(Ordering::Relaxed).min(expected.len());
        let ahead = expected[next..].iter().position(|stage| *stage == what).map(|k| next + k);
        let (index, is_again) = match ahead {
            Some(index) => (index, false),
            None => (expected[..next].iter().rposition(|stage| *stage == what)?, true),
        };
        self.next.store(index + 1, Ordering::Relaxed);
        Some(StagePlace { number: index + 1, of: expected.len(), is_again })
    }

    /// Returns the title of a stage with its number among the expected stages. A repeated stage
    /// says so.
    fn title(&self, what: &str) -> String {
        self.place(what).map_or(what.to_owned(), |StagePlace { number, of, is_again }| {
            format!("stage {number} of {of}: {what}{}", if is_again { ", again" } else { "" })
        })
    }
}

impl Stages for Progress {
    fn expect(&self, stages: Vec<&'static str>) {
        *self.expected.lock().unwrap_or_else(PoisonError::into_inner) = stages;
        self.next.store(0, Ordering::Relaxed);
    }

    fn start(&self, what: &'static str, n: usize) -> Box<dyn Monitor> {
        match self.show {
            Show::Bars => Box::new(Bar::new(self.title(what), n)),
            Show::Lines => Box::new(Lines::new(self.title(what), n)),
            Show::Json => {
                let place = self.place(what).map(|place| [place.number, place.of]);
                Box::new(JsonStage::new(what, place, n))
            }
            Show::Nothing => Box::new(Quiet),
        }
    }
}

/// Stage without display, which can be interrupted.
struct Quiet;

impl Monitor for Quiet {
    fn advance(&self, _: usize) {}
    fn is_cancelled(&self) -> bool {
        is_interrupted()
    }
}

/// Progress bar.
struct Bar {
    bar: ProgressBar,
}

impl Bar {
    fn new(title: String, n: usize) -> Self {
        let bar = ProgressBar::with_draw_target(Some(n as u64), ProgressDrawTarget::stderr_with_hz(10));
        let forecast = Arc::new(Mutex::new(Forecast::default()));
        let left = move |state: &ProgressState, out: &mut dyn fmt::Write| {
            let mut forecast = forecast.lock().unwrap_or_else(PoisonError::into_inner);
            let share = state.pos() as f64 / state.len().unwrap_or(0).max(1) as f64;
            if let Some(left) = forecast.left(state.elapsed().as_secs_f64(), share) {
                let _ = write!(out, "{} left", clock(left));
            }
        };
        // Over all steps so far: the rate of the last ones jumps.
        let rate = |state: &ProgressState, out: &mut dyn fmt::Write| {
            let _ = write!(out, "{:.0}/s", state.pos() as f64 / state.elapsed().as_secs_f64().max(0.1));
        };
        let template = if n > 0 {
            "{msg:<38} {bar:24} {pos:>7}/{len:<7} {rate:>8} {left}"
        } else {
            "{msg:<38} {spinner} {elapsed}"
        };
        let style = ProgressStyle::with_template(template).expect("the template is fixed and valid");
        bar.set_style(style.with_key("left", left).with_key("rate", rate));
        bar.set_message(title);
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
        is_interrupted()
    }
}

/// Time before the first line on a stage, and between later ones; a stage that ends before the
/// first has none.
const BETWEEN_LINES: [Duration; 2] = [Duration::from_secs(2), Duration::from_secs(15)];

/// Lines on a stage: from time to time, and at its end if it had any.
struct Lines {
    title: String,
    n: usize,
    began: Instant,
    done: AtomicUsize,
    lines: Mutex<StageLines>,
}

/// State of the lines of a stage.
struct StageLines {
    next: Duration,
    lines: usize,
    forecast: Forecast,
}

impl Lines {
    fn new(title: String, n: usize) -> Self {
        let lines = Mutex::new(StageLines { next: BETWEEN_LINES[0], lines: 0, forecast: Forecast::default() });
        Self { title, n, began: Instant::now(), done: AtomicUsize::new(0), lines }
    }
}

impl Monitor for Lines {
    fn advance(&self, steps: usize) {
        let done = self.done.fetch_add(steps, Ordering::Relaxed) + steps;
        // Another thread is reporting already.
        let Ok(mut lines) = self.lines.try_lock() else { return };
        let elapsed = self.began.elapsed();
        if elapsed < lines.next {
            return;
        }
        let share = done as f64 / self.n.max(1) as f64;
        let left = lines.forecast.left(elapsed.as_secs_f64(), share);
        let left = left.map_or_else(String::new, |left| format!(", {} left", clock(left)));
        eprintln!("{}, {:.0} %{left}", self.title, 100.0 * share.min(1.0));
        lines.lines += 1;
        lines.next = elapsed + BETWEEN_LINES[1];
    }
    fn is_cancelled(&self) -> bool {
        is_interrupted()
    }
}

impl Drop for Lines {
    fn drop(&mut self) {
        if self.lines.get_mut().is_ok_and(|lines| lines.lines > 0) && !is_interrupted() {
            eprintln!("{}, ended after {}", self.title, clock(self.began.elapsed().as_secs_f64()));
        }
    }
}

/// Announces that files get their names from now on, and returns true, unless Ctrl-C has been
/// pressed.
pub(crate) fn start_writing() -> bool {
    WRITING.store(true, Ordering::Relaxed);
    !is_interrupted()
}

/// Returns whether Ctrl-C has been pressed.
pub(crate) fn is_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

#[cfg(test)]
#[path = "../../tests/unit/cli/progress.rs"]
mod tests;
