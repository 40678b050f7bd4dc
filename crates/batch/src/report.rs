//! Results of a batch compared.

pub mod html;
pub mod table;

use std::collections::BTreeMap;

use facemill_job::failure::Failure;

use crate::expand::Batch;
use crate::format::report_file::{BATCH_REPORT_FORMAT, BatchReport, BestRow, Counts, Measure, TaskRow, TaskState};
use crate::format::result_file::FailureKind;
use crate::key::KeyedTask;
use crate::store::Store;
use crate::store::names::Holder;

/// Returns the report on a batch from the results that are there. Groups are the tasks that differ
/// on the axis `best_of` alone; without it all tasks of one job.
///
/// # Errors
/// If the batch has no such axis.
pub fn batch_report(
    batch: &Batch,
    tasks: &[KeyedTask],
    store: &Store,
    best_of: Option<&str>,
    measure: Measure,
) -> Result<BatchReport, Failure> {
    let axes = batch.axes();
    if let Some(axis) = best_of.filter(|axis| !axes.iter().any(|name| name == axis)) {
        let known = if axes.is_empty() { "it has no axes".to_owned() } else { axes.join(", ") };
        return Err(Failure::input(&batch.path, format!("there is no axis \"{axis}\": {known}")));
    }
    let rows: Vec<TaskRow> = tasks.iter().map(|task| row(task, store)).collect();
    let best = best_rows(&rows, &axes, best_of, measure);
    let (counts, best_of) = (counts(&rows), best_of.map(str::to_owned));
    Ok(BatchReport { format: BATCH_REPORT_FORMAT, axes, best_of, measure, counts, tasks: rows, best })
}

fn row(KeyedTask { task, key, unreadable, .. }: &KeyedTask, store: &Store) -> TaskRow {
    let mut row = TaskRow {
        number: task.number,
        key: key.clone(),
        job: task.name.clone(),
        setup: task.setup + 1,
        program: task.program.clone(),
        axes: task.axes.clone(),
        state: TaskState::Waiting,
        exit_code: None,
        failure: None,
        cause: None,
        figures: Default::default(),
        wall_s: None,
        peak_mib: None,
        files: Vec::new(),
    };
    if let Some(result) = store.result(key) {
        row.state = if result.exit_code == 0 { TaskState::Done } else { TaskState::NotMet };
        row.exit_code = Some(i32::from(result.exit_code));
        row.cause = result.message;
        row.figures = result.figures;
        row.files =
            result.files.iter().filter(|name| is_shown(name)).map(|name| format!("tasks/{key}/{name}")).collect();
        let times = store.times(key).unwrap_or_default();
        row.wall_s = Some(times.wall_s);
        row.peak_mib = times.peak_mib;
    } else if store.is_locked(key) {
        row.state = TaskState::Running;
        row.cause = store.holder(key).map(|Holder { host, process }| format!("process {process} on {host}"));
    } else if let Some(failed) = store.failure(key) {
        row.state = TaskState::Failed;
        row.exit_code = failed.exit_code;
        row.failure = Some(failed.kind);
        row.cause = Some(failed.cause);
        row.peak_mib = failed.peak_mib;
    } else if unreadable.is_some() {
        (row.state, row.failure, row.exit_code) = (TaskState::Failed, Some(FailureKind::Input), Some(2));
        row.cause.clone_from(unreadable);
    }
    row
}

/// Returns whether a file is worth a link: programs, pictures and reports.
fn is_shown(name: &str) -> bool {
    let is_table = name.starts_with("passes") && name.ends_with(".json");
    !is_table && !name.ends_with(".csv") && !name.ends_with(".apt")
}

fn counts(rows: &[TaskRow]) -> Counts {
    let mut counts = Counts { tasks: rows.len(), ..Counts::default() };
    for row in rows {
        *match (row.state, row.failure) {
            (TaskState::Done, _) => &mut counts.done,
            (TaskState::NotMet, _) => &mut counts.not_met,
            (TaskState::Failed, Some(FailureKind::Input)) => &mut counts.wrong_input,
            (TaskState::Failed, _) => &mut counts.failed,
            (TaskState::Running, _) => &mut counts.running,
            (TaskState::Waiting, _) => &mut counts.waiting,
        } += 1;
    }
    counts
}

fn measured(row: &TaskRow, measure: Measure) -> Option<f64> {
    let figure = match measure {
        Measure::Time => row.figures.machine_s,
        Measure::Cusp => row.figures.cusp_mm,
        Measure::Length => row.figures.cutting_length_mm,
        Measure::Efficiency => row.figures.efficiency,
    };
    figure.filter(|_| row.state == TaskState::Done)
}

fn best_rows(rows: &[TaskRow], axes: &[String], best_of: Option<&str>, measure: Measure) -> Vec<BestRow> {
    let group = |row: &TaskRow| {
        let common = axes.iter().filter(|axis| best_of.is_some_and(|open| open != axis.as_str()));
        let labels = common.filter_map(|axis| Some(format!("{axis} {}", row.axes.get(axis)?)));
        let setup = if row.setup > 1 { format!(", setup {}", row.setup) } else { String::new() };
        std::iter::once(format!("{}{setup}", row.job)).chain(labels).collect::<Vec<_>>().join(", ")
    };
    let mut groups: Vec<(String, Vec<&TaskRow>)> = Vec::new();
    let mut places: BTreeMap<String, usize> = BTreeMap::new();
    for row in rows {
        let name = group(row);
        let place = *places.entry(name.clone()).or_insert_with(|| {
            groups.push((name, Vec::new()));
            groups.len() - 1
        });
        groups[place].1.push(row);
    }
    let best = |(group, rows): (String, Vec<&TaskRow>)| {
        let known: Vec<(&TaskRow, f64)> = rows.iter().filter_map(|row| Some((*row, measured(row, measure)?))).collect();
        // Of equal ones the first.
        let &(best, value) = known.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let worst = known.iter().map(|(_, value)| *value).fold(value, f64::max);
        let label = best_of.and_then(|axis| best.axes.get(axis).cloned());
        Some(BestRow {
            group,
            tasks: rows.len(),
            number: best.number,
            label: label.unwrap_or_else(|| best.number.to_string()),
            value,
            worst_over_best: if value > 0.0 { worst / value } else { 1.0 },
        })
    };
    groups.into_iter().filter_map(best).collect()
}

#[cfg(test)]
#[path = "../tests/unit/report.rs"]
mod tests;
