//! Progress of a batch: a bar, lines from time to time, or JSON lines.

use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use facemill::batch::run::scheduler::{EndOfTask, RunEvent, Watch};
use facemill::clock;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;

use crate::cli::progress::forecast::Forecast;
use crate::cli::progress::is_interrupted;
use crate::cli::progress::json_lines::write_line;

/// Time between two lines on standard error that is no terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(10);

/// Time between two JSON lines on the whole batch.
const BETWEEN_OBJECTS: Duration = Duration::from_millis(500);

/// Progress of a run.
pub(super) struct RunProgress {
    show: Show,
    state: Mutex<State>,
}

enum Show {
    Bar(ProgressBar),
    Lines,
    Json,
    Nothing,
}

struct State {
    began: Instant,
    shown: Instant,
    tasks: usize,
    /// Tasks at their end, those of earlier runs among them.
    ended: usize,
    already: usize,
    failed: usize,
    running: usize,
    forecast: Forecast,
}

impl State {
    /// Returns tasks per minute of this run.
    fn rate(&self) -> f64 {
        (self.ended - self.already) as f64 / self.began.elapsed().as_secs_f64().max(0.1) * 60.0
    }

    /// Returns the remaining time, s.
    fn left(&mut self) -> Option<f64> {
        let share = (self.ended - self.already) as f64 / (self.tasks - self.already).max(1) as f64;
        self.forecast.left(self.began.elapsed().as_secs_f64(), share)
    }

    fn text(&mut self) -> String {
        let left = self.left().map_or_else(String::new, |left| format!(", {} left", clock(left)));
        let (State { tasks, ended, failed, running, .. }, rate) = (&*self, self.rate());
        format!("{ended} of {tasks} tasks, {failed} failed, {running} running, {rate:.1}/min{left}")
    }
}

impl RunProgress {
    pub(super) fn new(quiet: bool, json: bool) -> Self {
        let show = match (json, quiet, std::io::stderr().is_terminal()) {
            (true, ..) => Show::Json,
            (_, true, _) => Show::Nothing,
            (.., true) => {
                let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr_with_hz(10));
                let style = ProgressStyle::with_template("{bar:24} {msg}").expect("the template is fixed and valid");
                bar.set_style(style);
                Show::Bar(bar)
            }
            (.., false) => Show::Lines,
        };
        let now = Instant::now();
        let state = State {
            began: now,
            shown: now,
            tasks: 0,
            ended: 0,
            already: 0,
            failed: 0,
            running: 0,
            forecast: Forecast::default(),
        };
        Self { show, state: Mutex::new(state) }
    }

    /// Removes the bar.
    pub(super) fn finish(&self) {
        if let Show::Bar(bar) = &self.show {
            bar.finish_and_clear();
        }
    }

    /// Writes the last JSON line: how the run ended.
    pub(super) fn ended(&self, exit_code: u8) {
        if let Show::Json = self.show {
            let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            write_line(&json!({
                "event": "batch_ended",
                "tasks": state.tasks,
                "ended": state.ended,
                "failed": state.failed,
                "exit_code": exit_code,
            }));
        }
    }

    /// Shows the whole batch, if its turn has come.
    fn show_all(&self, state: &mut State) {
        match &self.show {
            Show::Bar(bar) => {
                bar.set_length(state.tasks as u64);
                bar.set_position(state.ended as u64);
                bar.set_message(state.text());
            }
            Show::Lines if state.shown.elapsed() >= BETWEEN_LINES => {
                state.shown = Instant::now();
                eprintln!("{}", state.text());
            }
            Show::Json if state.shown.elapsed() >= BETWEEN_OBJECTS => {
                state.shown = Instant::now();
                write_line(&json!({
                    "event": "progress",
                    "tasks": state.tasks,
                    "ended": state.ended,
                    "failed": state.failed,
                    "running": state.running,
                    "per_minute": state.rate(),
                    "left_s": state.left(),
                }));
            }
            _ => {}
        }
    }

    fn failed(&self, line: &str) {
        match &self.show {
            Show::Bar(bar) => bar.println(line),
            Show::Lines => eprintln!("{line}"),
            Show::Json | Show::Nothing => {}
        }
    }
}

impl Watch for RunProgress {
    fn see(&self, event: RunEvent<'_>) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let is_json = matches!(self.show, Show::Json);
        match event {
            RunEvent::Began { tasks, already } => {
                (state.tasks, state.already, state.ended) = (tasks, already, already);
                if is_json {
                    write_line(&json!({ "event": "batch_began", "tasks": tasks, "already": already }));
                }
            }
            RunEvent::Started { task, threads, attempt } => {
                state.running += 1;
                if is_json {
                    let (number, key) = (task.task.number, &task.key);
                    write_line(&json!({
                        "event": "task_began", "task": number, "key": key, "threads": threads, "try": attempt,
                    }));
                }
            }
            RunEvent::Ended { task, end, wall_s, again } => {
                let number = task.task.number;
                state.running = state.running.saturating_sub(usize::from(wall_s > 0.0));
                state.ended += usize::from(!again);
                let (exit_code, cause) = match end {
                    EndOfTask::Filed(code) => (Some(i32::from(*code)), None),
                    EndOfTask::Failed(failed) => {
                        state.failed += usize::from(!again);
                        let next = if again { "; it is tried again" } else { "" };
                        self.failed(&format!("task {number} failed: {}{next}", failed.cause));
                        (failed.exit_code, Some(&failed.cause))
                    }
                };
                if is_json {
                    write_line(&json!({
                        "event": "task_ended", "task": number, "key": task.key, "exit_code": exit_code,
                        "cause": cause, "wall_s": wall_s, "again": again,
                    }));
                }
            }
            RunEvent::PutAside { task } => {
                state.running = state.running.saturating_sub(1);
                if is_json {
                    let (number, key) = (task.task.number, &task.key);
                    write_line(&json!({ "event": "task_put_aside", "task": number, "key": key }));
                }
            }
            _ => {}
        }
        self.show_all(&mut state);
    }

    fn is_cancelled(&self) -> bool {
        is_interrupted()
    }
}
