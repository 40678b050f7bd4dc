//! Figures of the material that a program leaves, as reports have them.

use facemill_virtual_machine::{Finding, FindingKind, Measure};
use schemars::JsonSchema;
use serde::Serialize;

use crate::format::job_file::FinishFile;

/// Material that a program leaves on the surface that its operations are asked to cut, measured on
/// its written text.
///
/// Heights are along the surface's normal, from the surface that is to be left (the mesh with the
/// allowance of the drive surface) to the least height that the cutter reaches in any cut of the
/// program. They contain everything that the program leaves: cusps, lifts, chords of the mesh, and
/// strips that no pass cuts.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RemainingReport {
    /// How far a height may be off, mm.
    pub accuracy_mm: f64,
    /// Part of the drive surface that lies in no operation's region: nobody asks for it to be cut.
    pub outside_fraction: f64,
    /// Of each operation of the setup.
    pub operations: Vec<RemainingOnRegion>,
}

/// Material left on the region of one operation, in all places of its pattern. Shares and quantiles
/// are by area, from samples that are spread evenly over the region.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RemainingOnRegion {
    /// Operation.
    pub operation: String,
    /// Area of the region.
    pub area_mm2: f64,
    /// Places that were measured all over it. Places on its border and around the highest ones
    /// count for the largest alone.
    pub samples: usize,
    /// Distance between them, about: what is narrower may be missed. The largest is looked for a
    /// quarter of it apart.
    pub spacing_mm: f64,
    /// Half of the area has at most this height left.
    pub p50_mm: f64,
    /// Nine tenths of it.
    pub p90_mm: f64,
    /// Ninety-nine hundredths of it.
    pub p99_mm: f64,
    /// The largest height that is left; absent where the region is too small for a sample.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest: Option<RemainingPlace>,
    /// Height up to which the region counts as finished, mm: `cusp_mm` with path chord,
    /// linearisation and gouge tolerance.
    pub limit_mm: f64,
    /// Part of the area with more than that.
    pub above_fraction: f64,
    /// Part of the area that no cut reaches: the stock is there as it was.
    pub never_cut_fraction: f64,
    /// What the operation allows.
    pub allowed: FinishFile,
    /// Whether more is left than it allows.
    pub exceeded: bool,
}

/// A place with material left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RemainingPlace {
    /// Height, mm; of a place that is never cut that of the stock.
    pub height_mm: f64,
    /// The place on the surface, workpiece frame, mm.
    pub at_mm: [f64; 3],
    /// Line of the block that cuts there lowest; absent where none does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<u32>,
}

impl RemainingOnRegion {
    /// Whether nothing is known of the region, because no sample lies in it.
    fn is_unmeasured(&self) -> bool {
        self.samples == 0
    }

    /// In what it is more than the operation allows, in words.
    pub fn why_exceeded(&self) -> String {
        let Self { operation, limit_mm, allowed, .. } = self;
        if self.is_unmeasured() {
            return format!(
                "operation \"{operation}\": no sample lies in its region, so that nothing is known of what is left"
            );
        }
        format!(
            "operation \"{operation}\": {:.2} % of its region is left more than {limit_mm:.3} mm high, {:.2} % is never cut; the job allows \
             {:.2} % and {:.2} %",
            100.0 * self.above_fraction,
            100.0 * self.never_cut_fraction,
            100.0 * allowed.max_above_fraction,
            100.0 * allowed.max_never_cut_fraction
        )
    }

    /// The figures in words, and what is wrong with them.
    fn summary(&self, several: bool) -> Vec<String> {
        let of = if several { format!(", operation \"{}\"", self.operation) } else { String::new() };
        if self.is_unmeasured() {
            return vec![format!("  NOT MEASURED      what is left: no sample lies in the region{of}")];
        }
        let mut lines = vec![format!(
            "  left on surface   half of it {:.3} mm, 90 % {:.3}, 99 % {:.3}, largest {}{of}",
            self.p50_mm,
            self.p90_mm,
            self.p99_mm,
            self.largest.map_or("none".to_owned(), |p| format!("{:.3}{}", p.height_mm, place(&p)))
        )];
        let percent = |share: f64| 100.0 * share;
        if self.above_fraction > 0.0 || self.never_cut_fraction > 0.0 {
            lines.push(format!(
                "    of {:.1} cm2        {:.2} % above {:.3} mm, {:.2} % never cut",
                self.area_mm2 / 100.0,
                percent(self.above_fraction),
                self.limit_mm,
                percent(self.never_cut_fraction)
            ));
        }
        if self.exceeded {
            lines.push(format!(
                "    NOT FINISHED     the job allows {:.2} % above and {:.2} % never cut",
                percent(self.allowed.max_above_fraction),
                percent(self.allowed.max_never_cut_fraction)
            ));
        }
        lines
    }
}

fn place(p: &RemainingPlace) -> String {
    let [x, y, z] = p.at_mm;
    let line = p.line.map_or("never cut".to_owned(), |line| format!("line {line}"));
    format!(" at ({x:.2}, {y:.2}, {z:.2}), {line}")
}

/// Part of the drive surface outside of all regions from which on it is reported.
const REPORTED_OUTSIDE: f64 = 0.001;

impl RemainingReport {
    /// Whether an operation leaves more than it allows.
    pub fn is_exceeded(&self) -> bool {
        self.operations.iter().any(|o| o.exceeded)
    }

    /// The largest height that is left on any region.
    pub fn largest(&self) -> Option<&RemainingPlace> {
        let all = self.operations.iter().filter_map(|o| o.largest.as_ref());
        all.reduce(|a, b| if b.height_mm > a.height_mm { b } else { a })
    }

    /// A finding for each operation that leaves more than it allows, at its highest place; where no
    /// cut is near that, on the last line of the program.
    pub fn findings(&self, last_line: u32) -> Vec<Finding> {
        let finding = |o: &RemainingOnRegion| {
            let line = o.largest.and_then(|p| p.line).unwrap_or(last_line);
            Finding {
                measure: o.largest.map(|p| Measure::HeightMm(p.height_mm)),
                place_work_mm: o.largest.map(|p| p.at_mm),
                ..Finding::of_line(FindingKind::Excess, line, None, "", o.why_exceeded())
            }
        };
        self.operations.iter().filter(|o| o.exceeded).map(finding).collect()
    }

    /// Lines of a summary; the same for a plan and for a verification.
    pub fn summary_lines(&self) -> Vec<String> {
        let several = self.operations.len() > 1;
        let mut lines: Vec<String> = self.operations.iter().flat_map(|o| o.summary(several)).collect();
        if self.outside_fraction >= REPORTED_OUTSIDE {
            lines.push(format!(
                "  not asked for     {:.1} % of the drive surface lies outside of every operation's region",
                100.0 * self.outside_fraction
            ));
        }
        lines
    }
}
