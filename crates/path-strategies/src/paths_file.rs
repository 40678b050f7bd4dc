//! Passes of a job by its strategies, laid or planned, for comparison.

use facemill_job::duration_text::clock;
use facemill_job::format::report::outcome::Outcome;
use schemars::JsonSchema;
use serde::Serialize;

/// Value of the key `format` in the file.
pub const PATHS_FORMAT: &str = "facemill-paths/1";

/// Passes of a job: laid by its own strategies, or planned by several ones.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PathsFile {
    /// Always `"facemill-paths/1"`.
    pub format: &'static str,
    /// Name of the job.
    pub job: String,
    /// Passes as laid, without any planned posture; empty with `--compare`.
    pub laid: Vec<LaidPasses>,
    /// The strategies compared, each with the job's setups in their order; empty without
    /// `--compare`.
    pub compared: Vec<ComparedStrategy>,
    /// The compared plan of least time; `null` without `--compare`, or if none is complete.
    pub fastest: Option<FastestStrategy>,
}

/// The compared plan that takes the least time among those without a fault that are as complete as
/// the job's own: no smaller fraction of the points planned, no larger height left unless it is
/// within the tolerance, and no worse outcome.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FastestStrategy {
    /// Its index in `compared`, from 0.
    pub index: usize,
    /// Its name.
    pub strategy: String,
    /// Turn of the mounting about z of the table, added to the job's.
    pub mounting_angle_deg: f64,
    /// Time of all its programs, s.
    pub total_time_s: f64,
    /// Time of the job as given, s; `null` if it is not compared or has no plan.
    pub job_time_s: Option<f64>,
    /// Whether the programs were run: without it their faults are unknown.
    pub verified: bool,
    /// Plans that take less time, and are not complete.
    pub passed_over: Vec<PassedOverStrategy>,
}

/// A compared plan that takes less time, but is not complete.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PassedOverStrategy {
    /// Its index in `compared`, from 0.
    pub index: usize,
    /// Time of all its programs, s.
    pub total_time_s: f64,
    /// Reason why it is not taken.
    pub reason: String,
}

/// Passes of an operation as laid, in the first place of its pattern. Postures are those expected
/// from the curvature of the surface.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LaidPasses {
    /// Setup.
    pub setup: String,
    /// Operation.
    pub operation: String,
    /// Number of passes.
    pub passes: usize,
    /// Number of CC points.
    pub points: usize,
    /// Stretches left out because they are shorter than `min_pass_length_mm`.
    pub short_stretches: usize,
    /// Area of the region that is farther from a pass of `constant_scallop` than half the strip
    /// allowed; 0 for sections, whose passes reach to the border.
    pub uncovered_mm2: f64,
    /// Length over the surface.
    pub length_mm: f64,
    /// Least length with these feed directions and the expected postures
    /// (docs/method.md#efficiency).
    pub floor_mm: Option<f64>,
    /// Least length over all feed directions.
    pub least_floor_mm: Option<f64>,
    /// `length_mm` / `floor_mm`.
    pub efficiency: Option<f64>,
}

/// A strategy with its plan.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ComparedStrategy {
    /// Its name: that of the list given by `--with`, or a description of what it changes.
    pub strategy: String,
    /// Turn of the mounting about z of the table, added to the job's.
    pub mounting_angle_deg: f64,
    /// Reason why it has no plan; `null` if it has.
    pub failed: Option<String>,
    /// Whether the plan meets the job, of several setups the worst; `null` without a plan.
    pub outcome: Option<Outcome>,
    /// Figures of each setup.
    pub setups: Vec<PlannedPasses>,
}

/// Figures of a strategy in a setup, all from the report of its plan.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PlannedPasses {
    /// Setup.
    pub setup: String,
    /// Passes as cut.
    pub passes: usize,
    /// Fraction of the CC points that is planned.
    pub planned_fraction: f64,
    /// Length of the passes over the surface.
    pub passes_length_mm: f64,
    /// Least length with directions and postures as cut; `null` if unknown.
    pub floor_mm: Option<f64>,
    /// `passes_length_mm` / `floor_mm`.
    pub efficiency: Option<f64>,
    /// `passes_length_mm` over the least length of the best directions.
    pub over_least_floor: Option<f64>,
    /// Whether times are within acceleration and jerk of every axis; else at constant speed.
    pub by_time_law: bool,
    /// Time in passes, s.
    pub passes_time_s: f64,
    /// That time over the time at the programmed feeds alone: above 1 by what the axes cost; `null`
    /// without passes.
    pub time_over_feed: Option<f64>,
    /// Time in entries and exits, s.
    pub approach_time_s: f64,
    /// Time in links, with the moves to the part and home, s.
    pub link_time_s: f64,
    /// Time of the program, s.
    pub total_time_s: f64,
    /// Height that 99 % of the region has at most; of several operations the largest.
    pub cusp_p99_mm: Option<f64>,
    /// Largest height left.
    pub cusp_largest_mm: Option<f64>,
    /// Fraction of the region that no cut reaches, of the operation with the largest.
    pub never_cut_fraction: Option<f64>,
    /// Area of the regions of all operations, mm².
    pub region_area_mm2: Option<f64>,
    /// Length of the lines of operations that cut along a line alone, mm.
    pub region_length_mm: Option<f64>,
    /// Turning points of all rotary axes within passes.
    pub rotary_reversals: usize,
    /// Steps of postures that turn quickly.
    pub posture_jumps: usize,
    /// Faults found in the program.
    pub faults: usize,
}

/// Largest number of faster plans in the table that are not complete; the JSON has them all.
const SHOWN_PASSED_OVER: usize = 3;

impl PathsFile {
    /// Returns a file without passes.
    pub fn new(job: &str) -> Self {
        Self { format: PATHS_FORMAT, job: job.to_owned(), laid: Vec::new(), compared: Vec::new(), fastest: None }
    }

    /// Returns the tables for a person.
    pub fn table(&self) -> String {
        let mut lines = vec![self.job.clone()];
        lines.extend(self.laid.iter().map(LaidPasses::line));
        if !self.compared.is_empty() {
            lines.extend(aligned(&self.rows()));
            lines.extend(self.fastest_lines());
        }
        lines.join("\n") + "\n"
    }

    /// Returns lines on the plan of least time.
    fn fastest_lines(&self) -> Vec<String> {
        let Some(fastest) = &self.fastest else {
            return vec!["  least time: none, no plan without a fault is as complete as the best".to_owned()];
        };
        let time = clock(fastest.total_time_s);
        let against = match fastest.job_time_s {
            Some(job) if job > fastest.total_time_s => {
                format!(" in place of {}, {:.0} % less", clock(job), 100.0 * (1.0 - fastest.total_time_s / job))
            }
            Some(_) => ": no other complete plan takes less than the job as given".to_owned(),
            None => String::new(),
        };
        let mut lines = vec![format!("  least time: {}, {time}{against}", self.name_of(fastest.index))];
        let passed_over = fastest.passed_over.iter().take(SHOWN_PASSED_OVER);
        lines.extend(passed_over.map(|p| {
            format!("    faster but not taken: {}, {}: {}", self.name_of(p.index), clock(p.total_time_s), p.reason)
        }));
        if let more @ 1.. = fastest.passed_over.len().saturating_sub(SHOWN_PASSED_OVER) {
            lines.push(format!("    and {more} more, see the JSON"));
        }
        lines
    }

    /// Returns the name of a compared strategy, with its mounting if that is turned.
    fn name_of(&self, index: usize) -> String {
        let Some(compared) = self.compared.get(index) else { return String::new() };
        match compared.mounting_angle_deg {
            0.0 => compared.strategy.clone(),
            angle => format!("{}, mounting turned by {angle} deg", compared.strategy),
        }
    }

    /// Returns the rows of the comparison, the heading first.
    fn rows(&self) -> Vec<Vec<String>> {
        let turns = self.compared.iter().any(|c| c.mounting_angle_deg != 0.0);
        let several = self.compared.iter().any(|c| c.setups.len() > 1);
        let mut heading: Vec<&str> = vec!["strategy"];
        heading.extend(turns.then_some("mounting"));
        heading.extend(several.then_some("setup"));
        heading.extend(PlannedPasses::COLUMNS);
        let mut rows = vec![heading.into_iter().map(str::to_owned).collect::<Vec<_>>()];
        for compared in &self.compared {
            let mut first = vec![compared.strategy.clone()];
            first.extend(turns.then(|| format!("{:.0} deg", compared.mounting_angle_deg)));
            match &compared.failed {
                Some(why) => rows.push([first, vec![format!("no plan: {}", why.replace('\n', " "))]].concat()),
                None => rows.extend(compared.setups.iter().map(|setup| {
                    let name = several.then(|| setup.setup.clone());
                    [first.clone(), name.into_iter().collect(), setup.cells()].concat()
                })),
            }
        }
        rows
    }
}

impl LaidPasses {
    fn line(&self) -> String {
        let efficiency = match (self.efficiency, self.floor_mm) {
            (Some(e), Some(floor)) => format!(", {e:.3} times their floor of {:.2} m", floor / 1000.0),
            _ => String::new(),
        };
        let short = match self.short_stretches {
            0 => String::new(),
            n => format!(", {n} short stretches left out"),
        };
        let uncovered = match self.uncovered_mm2 {
            0.0 => String::new(),
            area => format!(", {area:.0} mm² farther from a pass than half its strip"),
        };
        format!(
            "  {}, {}: {} passes, {} points, {:.2} m{efficiency}{short}{uncovered}",
            self.setup,
            self.operation,
            self.passes,
            self.points,
            self.length_mm / 1000.0
        )
    }
}

impl PlannedPasses {
    /// Headings of [`Self::cells`].
    const COLUMNS: [&'static str; 14] = [
        "passes",
        "length",
        "efficiency",
        "in passes",
        "over feed",
        "entries",
        "links",
        "total",
        "cusp p99",
        "largest",
        "never cut",
        "reversals",
        "jumps",
        "planned",
    ];

    fn cells(&self) -> Vec<String> {
        let number = |value: Option<f64>, decimals: usize| match value {
            Some(value) => format!("{value:.decimals$}"),
            None => "-".to_owned(),
        };
        let percent = |share: f64| format!("{:.2} %", 100.0 * share);
        vec![
            self.passes.to_string(),
            format!("{:.2} m", self.passes_length_mm / 1000.0),
            number(self.efficiency, 3),
            clock(self.passes_time_s),
            number(self.time_over_feed, 2),
            clock(self.approach_time_s),
            clock(self.link_time_s),
            clock(self.total_time_s),
            number(self.cusp_p99_mm, 3),
            number(self.cusp_largest_mm, 3),
            self.never_cut_fraction.map_or("-".to_owned(), percent),
            self.rotary_reversals.to_string(),
            self.posture_jumps.to_string(),
            format!("{}{}", percent(self.planned_fraction), if self.faults > 0 { ", FAULTS" } else { "" }),
        ]
    }
}

/// Returns the lines of a table: the first column to the left, the others to the right. A row with
/// fewer cells than the heading is text.
fn aligned(rows: &[Vec<String>]) -> Vec<String> {
    let columns = rows.first().map_or(0, Vec::len);
    let full = || rows.iter().filter(|row| row.len() == columns);
    let width = |k: usize| full().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let first = rows.iter().filter_map(|row| row.first()).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let line = |row: &Vec<String>| {
        let cells = row.iter().enumerate().map(|(k, cell)| match (k, row.len() == columns) {
            (0, _) => format!("{cell:first$}"),
            (_, true) => format!("{cell:>0$}", widths[k]),
            (_, false) => cell.clone(),
        });
        format!("  {}", cells.collect::<Vec<_>>().join("  ").trim_end())
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
#[path = "../tests/unit/paths_file.rs"]
mod tests;
