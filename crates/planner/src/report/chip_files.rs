//! Files of the chips along the plan: a picture, and a table of all CC points.

use std::fmt::Write;

use facemill_drawing::chips_svg::{ChartPoint, Row, chips_svg};
use facemill_job::format::program_stamp::{ProgramStamp, stamped_svg};
use facemill_job::load::job::Job;
use facemill_job::validate::tip_feed::teeth_per_minute;

use crate::passes::operation::PlannedOperation;
use crate::program::timed::Timed;
use crate::report::chip_points::{ChipPoint, chip_points};

/// Files of the chips of a setup.
pub(crate) struct ChipFiles {
    /// `chips.svg`.
    pub svg: String,
    /// `chips.csv`.
    pub csv: String,
}

impl ChipFiles {
    /// Returns the files for planned operations and their written program, with the lines of its
    /// cutting moves, none if unknown; `jobs` are the job as each operation's head sees it.
    pub(crate) fn new(
        jobs: &[&Job],
        setup: &str,
        operations: &[PlannedOperation<'_>],
        (timed, lines): (&Timed, &[u32]),
    ) -> Self {
        let points = chip_points(operations, timed, lines);
        let charts: Vec<Vec<ChartPoint>> =
            points.iter().map(|points| points.iter().map(ChipPoint::charted).collect()).collect();
        let rows: Vec<Row<'_>> = operations
            .iter()
            .zip(&charts)
            .map(|(o, points)| Row {
                name: &o.operation.name,
                points,
                target: o.operation.feeds.removal_rate.as_ref().map(|r| r.target_cm3_min),
            })
            .collect();
        let title = format!("{}, {setup}", jobs.first().map_or("", |job| &job.file.name));
        let mut csv = String::from(HEAD);
        for ((o, job), points) in operations.iter().zip(jobs).zip(&points) {
            let per_minute = teeth_per_minute(&o.operation.feeds, job.tool.n_inserts());
            points.iter().for_each(|point| line(&mut csv, &o.operation.name, point, per_minute));
        }
        Self { svg: chips_svg(&title, &rows), csv }
    }

    /// Adds the names of the programs that the files describe: in comments, since neither format
    /// has a field for them.
    pub(crate) fn of(self, programs: &[ProgramStamp]) -> Self {
        let mut csv: String = programs.iter().map(|program| format!("# {}\n", program.text())).collect();
        csv += &self.csv;
        Self { svg: stamped_svg(self.svg, programs), csv }
    }
}

/// Columns of the table.
const HEAD: &str = "operation,place,pass,point,s_mm,area_mm2,full_stock,tip_feed_before_mm_min,tip_feed_after_mm_min,\
                    removal_rate_before_cm3_min,removal_rate_after_cm3_min,chip_thickness_before_mm,\
                    chip_thickness_after_mm,line\n";

fn line(csv: &mut String, operation: &str, p: &ChipPoint, teeth_per_minute: f64) {
    let cells = |values: Option<[f64; 2]>, decimals: usize| match values {
        Some([before, after]) => format!("{before:.decimals$},{after:.decimals$}"),
        None => ",".to_owned(),
    };
    // Writing to a string does not fail.
    let _ = writeln!(
        csv,
        "{},{},{},{},{:.3},{:.4},{},{},{},{},{}",
        quoted(operation),
        p.copy + 1,
        p.pass + 1,
        p.point + 1,
        p.way,
        p.area,
        u8::from(!p.is_known),
        cells(p.arrival.map(|a| [a.before, a.after]), 1),
        cells(p.removal_rates(), 3),
        cells(p.thicknesses(teeth_per_minute), 5),
        p.line.map(|line| line.to_string()).unwrap_or_default()
    );
}

/// Returns a cell of text, in quotes if it needs them.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
#[path = "../../tests/unit/report/chip_files.rs"]
mod tests;
