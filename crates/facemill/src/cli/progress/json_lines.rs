//! Progress as JSON, one object on each line of standard error, for programs.

use std::io::Write;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use facemill::cl_data::Monitor;
use serde_json::{Value, json};

use crate::cli::progress::forecast::Forecast;
use crate::cli::progress::is_interrupted;

/// Least time between two lines on the steps of one stage.
const BETWEEN: Duration = Duration::from_millis(250);

/// Writes an object on a line. A reader that is gone is no failure: the work goes on.
pub(crate) fn write_line(object: &Value) {
    let _ = std::io::stderr().lock().write_all(format!("{object}\n").as_bytes());
}

/// Stage that reports its begin, its steps from time to time, and its end.
pub(crate) struct JsonStage {
    stage: &'static str,
    /// Number among the expected stages, from 1, and their number.
    place: Option<[usize; 2]>,
    steps: usize,
    done: AtomicUsize,
    began: Instant,
    shown: Mutex<(Instant, Forecast)>,
}

impl JsonStage {
    pub(crate) fn new(stage: &'static str, place: Option<[usize; 2]>, steps: usize) -> Self {
        let began = Instant::now();
        let shown = Mutex::new((began, Forecast::default()));
        let new = Self { stage, place, steps, done: AtomicUsize::new(0), began, shown };
        new.write("stage_began", None);
        new
    }

    fn write(&self, event: &str, left: Option<f64>) {
        let [number, of] = self.place.map_or([None; 2], |place| place.map(Some));
        write_line(&json!({
            "event": event,
            "stage": self.stage,
            "number": number,
            "of": of,
            "steps": self.steps,
            "done": self.done.load(Ordering::Relaxed),
            "elapsed_s": self.began.elapsed().as_secs_f64(),
            "left_s": left,
        }));
    }
}

impl Monitor for JsonStage {
    fn advance(&self, steps: usize) {
        let done = self.done.fetch_add(steps, Ordering::Relaxed) + steps;
        // Another thread is reporting already.
        let Ok(mut shown) = self.shown.try_lock() else { return };
        if shown.0.elapsed() < BETWEEN {
            return;
        }
        shown.0 = Instant::now();
        let share = done as f64 / self.steps.max(1) as f64;
        let left = shown.1.left(self.began.elapsed().as_secs_f64(), share);
        self.write("stage", left);
    }

    fn is_cancelled(&self) -> bool {
        is_interrupted()
    }
}

impl Drop for JsonStage {
    fn drop(&mut self) {
        self.write("stage_ended", None);
    }
}
