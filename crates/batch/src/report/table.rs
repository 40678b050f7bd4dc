//! Rows of a report as cells of text, and as CSV.

use crate::format::report_file::{BatchReport, FIGURE_HEADINGS, Measure, TASK_HEADINGS, TaskRow, TaskState};

/// Returns the headings of the columns: number, job, axes, figures.
pub fn headings(report: &BatchReport) -> Vec<String> {
    let [task, job, setup, program] = TASK_HEADINGS;
    let first = [task, job, setup].map(str::to_owned).into_iter();
    let programs = has_programs(report).then(|| program.to_owned());
    first.chain(programs).chain(report.axes.iter().cloned()).chain(FIGURE_HEADINGS.map(str::to_owned)).collect()
}

fn has_programs(report: &BatchReport) -> bool {
    report.tasks.iter().any(|row| row.program.is_some())
}

/// Returns the cells of a row, in the order of [`headings`]; unknown figures are empty.
pub fn cells(report: &BatchReport, row: &TaskRow) -> Vec<String> {
    let figures = &row.figures;
    let mut cells = vec![row.number.to_string(), row.job.clone(), row.setup.to_string()];
    cells.extend(has_programs(report).then(|| row.program.clone().unwrap_or_default()));
    cells.extend(report.axes.iter().map(|axis| row.axes.get(axis).cloned().unwrap_or_default()));
    cells.extend([
        state_text(row.state).to_owned(),
        row.exit_code.map(|code| code.to_string()).unwrap_or_default(),
        decimals(figures.machine_s.map(|s| s / 60.0), 2),
        decimals(figures.planned_fraction.map(|f| 100.0 * f), 1),
        decimals(figures.cusp_mm, 4),
        decimals(figures.left_mm, 4),
        decimals(figures.gouge_mm, 4),
        figures.findings.map(|n| n.to_string()).unwrap_or_default(),
        decimals(figures.cutting_length_mm.map(|mm| mm / 1000.0), 2),
        decimals(figures.efficiency, 3),
        decimals(figures.gauge_length_mm, 1),
        decimals(row.wall_s, 2),
        row.peak_mib.map(|n| n.to_string()).unwrap_or_default(),
        row.cause.clone().unwrap_or_default(),
    ]);
    cells
}

/// Returns a state in words.
pub fn state_text(state: TaskState) -> &'static str {
    match state {
        TaskState::Done => "done",
        TaskState::NotMet => "not met",
        TaskState::Failed => "failed",
        TaskState::Running => "running",
        TaskState::Waiting => "waiting",
    }
}

/// Returns a figure in words, with its unit.
pub fn measure_text(measure: Measure) -> &'static str {
    match measure {
        Measure::Time => "machine time, s",
        Measure::Cusp => "largest cusp, mm",
        Measure::Length => "length, mm",
        Measure::Efficiency => "efficiency",
    }
}

fn decimals(value: Option<f64>, n: usize) -> String {
    value.map(|value| format!("{value:.n$}")).unwrap_or_default()
}

/// Returns the report's tasks as CSV (RFC 4180) with a line of headings.
pub fn csv(report: &BatchReport) -> String {
    let line = |cells: Vec<String>| cells.iter().map(|cell| quoted(cell)).collect::<Vec<_>>().join(",") + "\r\n";
    let rows = report.tasks.iter().map(|row| line(cells(report, row)));
    std::iter::once(line(headings(report))).chain(rows).collect()
}

/// Returns a cell in quotes where it needs them. A cell that a spreadsheet would take for a formula
/// gets an apostrophe in front; numbers have none.
fn quoted(cell: &str) -> String {
    let is_formula = cell.starts_with(['=', '+', '-', '@', '\t', '\r', '\n']) && cell.parse::<f64>().is_err();
    let cell = if is_formula { format!("'{cell}") } else { cell.to_owned() };
    if cell.contains(['"', ',', '\n', '\r']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell }
}
