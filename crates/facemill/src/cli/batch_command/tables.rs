//! Results of a batch as lines for a person.

use facemill::batch::format::report_file::{BatchReport, Counts, TaskState};
use facemill::batch::report::table::{measure_text, state_text};

/// Largest number of failures that are listed.
const SHOWN: usize = 20;

/// Returns the numbers of tasks by state on a line.
pub(super) fn counts_line(counts: &Counts) -> String {
    let Counts { tasks, done, not_met, wrong_input, failed, running, waiting } = counts;
    format!(
        "{tasks} tasks: {done} done, {not_met} not met, {wrong_input} with wrong input, {failed} failed otherwise, {running} running, \
         {waiting} waiting\n"
    )
}

/// Returns a line for each task.
pub(super) fn task_lines(report: &BatchReport) -> String {
    let line = |row: &facemill::batch::format::report_file::TaskRow| {
        let axes: Vec<String> = row.axes.iter().map(|(axis, label)| format!("{axis} {label}")).collect();
        let cause = row.cause.as_ref().map_or(String::new(), |cause| format!("  {cause}"));
        let state = state_text(row.state);
        format!(
            "{:>6}  {:.12}  {state:<8} {}, setup {}  {}{cause}\n",
            row.number,
            row.key,
            row.job,
            row.setup,
            axes.join(", ")
        )
    };
    report.tasks.iter().map(line).collect()
}

/// Returns lines on the tasks that failed, at most [`SHOWN`] of them.
pub(super) fn failure_lines(report: &BatchReport) -> String {
    let failed: Vec<_> = report.tasks.iter().filter(|row| row.state == TaskState::Failed).collect();
    let line = |row: &&facemill::batch::format::report_file::TaskRow| {
        format!("  task {} failed: {}\n", row.number, row.cause.as_deref().unwrap_or_default())
    };
    let mut lines: String = failed.iter().take(SHOWN).map(line).collect();
    if failed.len() > SHOWN {
        lines.push_str(&format!("  and {} more; `batch status` lists them all\n", failed.len() - SHOWN));
    }
    lines
}

/// Returns the table of the best task of each group.
pub(super) fn best_lines(report: &BatchReport) -> String {
    let open = report.best_of.as_deref().unwrap_or("task");
    let mut lines = format!("best {open} of each group, by {}:\n", measure_text(report.measure));
    for best in &report.best {
        lines.push_str(&format!(
            "  {}: {} (task {}, {:.3}; the worst of {} is {:.3} times that)\n",
            best.group, best.label, best.number, best.value, best.tasks, best.worst_over_best
        ));
    }
    lines
}
