//! Chip areas on trial: what the planner says that a pass takes, against what its program takes out
//! of the stock.

use std::fmt::Write;
use std::path::Path;

use facemill::nc_program::Dialect;
use facemill::virtual_machine::BlockCut;
use facemill::{
    CutRequest, Job, PlanSettings, SilentStages, StockRegion, Verified, VerifyRequest, plan_setup, verify_program,
};

/// The way between two CC points of a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Way of the CC point up to its middle from the first point of the piece, mm.
    pub at: f64,
    /// Mean of the chip's section at both ends, mm².
    pub area: f64,
    /// Whether full stock is counted at an end because nothing is known.
    pub in_full_stock: bool,
    /// Way of the CC point, mm.
    pub way: f64,
    /// Way of the tip, as the virtual machine tells it, mm.
    pub tip_way: f64,
    /// Material that the blocks removed from the stock, mm³.
    pub removed: f64,
}

/// A piece of a pass: the ways between its points, in order, the first aside.
#[derive(Clone, Debug, PartialEq)]
pub struct PieceTrial {
    /// Name of the operation.
    pub operation: String,
    /// Place of the pattern, from 1.
    pub place: u32,
    /// Pass, from 1.
    pub pass: u32,
    /// From point to point.
    pub steps: Vec<Step>,
}

/// Volumes of some steps, mm³.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Volumes {
    /// Chip area × way of the CC point.
    pub by_area: f64,
    /// Chip area × way of the tip.
    pub by_tip: f64,
    /// Lost by the stock.
    pub removed: f64,
    /// Way of the CC point, mm.
    pub way: f64,
}

impl Volumes {
    /// Of steps.
    pub fn of<'a>(steps: impl IntoIterator<Item = &'a Step>) -> Self {
        steps.into_iter().fold(Self::default(), |all, s| Self {
            by_area: all.by_area + s.area * s.way,
            by_tip: all.by_tip + s.area * s.tip_way,
            removed: all.removed + s.removed,
            way: all.way + s.way,
        })
    }

    /// Both.
    pub fn with(self, other: Self) -> Self {
        Self {
            by_area: self.by_area + other.by_area,
            by_tip: self.by_tip + other.by_tip,
            removed: self.removed + other.removed,
            way: self.way + other.way,
        }
    }

    /// Returns the loss of the stock over chip area × way of the CC point.
    pub fn ratio(&self) -> f64 {
        self.removed / self.by_area
    }
}

impl PieceTrial {
    /// Steps whose middle is at least so far from both ends of the piece, and whose chips are
    /// known.
    pub fn inner(&self, margin: f64) -> impl Iterator<Item = &Step> {
        let end = self.steps.last().map_or(0.0, |s| s.at + 0.5 * s.way);
        let is_inner = move |s: &&Step| s.at >= margin && s.at <= end - margin && !s.in_full_stock;
        self.steps.iter().filter(is_inner)
    }
}

/// Plans the first setup of a job with a FANUC control without verification, then cuts its stock
/// with the program.
///
/// # Panics
/// When a step of that fails.
pub fn plan_and_cut(job: &Path, cut: CutRequest) -> (String, Verified) {
    let job = Job::read(job).unwrap_or_else(|e| panic!("{e}"));
    let settings = PlanSettings { verify: false, certificates: false };
    let planned = plan_setup(&job, 0, settings, &SilentStages).unwrap_or_else(|e| panic!("{e}"));
    let table = String::from_utf8(planned.chip_table.1.clone()).expect("text");
    let nc = planned.files.iter().find(|(name, _)| name.ends_with(".nc")).expect("a program");
    let request = VerifyRequest { cut: Some(cut), ..VerifyRequest::new(Path::new(&nc.0), Dialect::Fanuc) };
    let verified = verify_program(&job, &nc.1, &request, &SilentStages).unwrap_or_else(|e| panic!("{e}"));
    (table, verified)
}

/// Stock on lines so far apart, cut within this tolerance, mm.
pub fn request(cell: f64, tolerance: f64, region: StockRegion) -> CutRequest {
    CutRequest { region, ..CutRequest::on_lines(cell, tolerance) }
}

/// The pieces of a table of chips at CC points with what the blocks of their program took.
///
/// # Panics
/// When the table is none, or has no lines of the program.
pub fn trial(table: &str, cuts: &[BlockCut]) -> Vec<PieceTrial> {
    let mut rows = table.lines().filter(|line| !line.starts_with('#')).map(|line| line.split(',').collect::<Vec<_>>());
    let head = rows.next().expect("a head");
    let column = |name: &str| head.iter().position(|n| *n == name).unwrap_or_else(|| panic!("no column {name}"));
    let number = |row: &[&str], name: &str| {
        let cell = row[column(name)];
        cell.parse::<f64>().unwrap_or_else(|e| panic!("{name}: {cell}: {e}"))
    };
    let mut pieces: Vec<PieceTrial> = Vec::new();
    let mut before: Option<(Vec<&str>, u32)> = None;
    let mut start = 0.0;
    for row in rows {
        let line: Option<u32> = row[column("line")].parse().ok();
        match (line, pieces.last_mut()) {
            (Some(line), Some(piece)) => {
                // The first step's first block is not known: the entry ends anywhere before.
                if let Some((from, first)) = &before {
                    piece.steps.push(step(|n, r| number(r, n), [from, &row], start, blocks(cuts, [*first, line])));
                }
                before = Some((row, line));
            }
            _ => {
                before = None;
                start = number(&row, "s_mm");
                let [place, pass] = ["place", "pass"].map(|n| number(&row, n) as u32);
                let operation = row[column("operation")].to_owned();
                pieces.push(PieceTrial { operation, place, pass, steps: Vec::new() });
            }
        }
    }
    pieces
}

/// Blocks after a line up to another one.
fn blocks(cuts: &[BlockCut], [after, to]: [u32; 2]) -> &[BlockCut] {
    let from = cuts.partition_point(|c| c.line <= after);
    &cuts[from..cuts.partition_point(|c| c.line <= to)]
}

/// The way between the points of two rows, by these blocks.
fn step(number: impl Fn(&str, &[&str]) -> f64, rows: [&[&str]; 2], start: f64, blocks: &[BlockCut]) -> Step {
    let both = |name: &str| rows.map(|row| number(name, row));
    let ([a, b], [from, to]) = (both("area_mm2"), both("s_mm"));
    Step {
        at: 0.5 * (from + to) - start,
        area: 0.5 * (a + b),
        in_full_stock: both("full_stock") != [0.0; 2],
        way: to - from,
        tip_way: blocks.iter().map(|c| c.way_mm).sum(),
        removed: blocks.iter().map(|c| c.removed_mm3).sum(),
    }
}

/// A table for a person: pieces that have steps so far from their ends, and all of them together.
pub fn summary(pieces: &[PieceTrial], margin: f64) -> String {
    let mut text =
        String::from("place pass   way mm  area mm²  area × way  × tip's way   removed  removed / (area × way)\n");
    let mut all = Volumes::default();
    for piece in pieces {
        let v = Volumes::of(piece.inner(margin));
        if v.way == 0.0 {
            continue;
        }
        all = all.with(v);
        line(&mut text, &format!("{:>5} {:>4}", piece.place, piece.pass), &v);
    }
    line(&mut text, "all       ", &all);
    text
}

fn line(text: &mut String, name: &str, v: &Volumes) {
    let Volumes { by_area, by_tip, removed, way } = *v;
    let (area, ratio) = (by_area / way, v.ratio());
    // Writing to a string does not fail.
    let _ = writeln!(text, "{name} {way:>8.1} {area:>9.3} {by_area:>11.1} {by_tip:>12.1} {removed:>9.1} {ratio:>8.4}");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(line: u32, removed_mm3: f64, way_mm: f64) -> BlockCut {
        BlockCut { line, removed_mm3, way_mm, is_certain: false, may_be_near: false }
    }

    #[test]
    fn blocks_belong_to_the_way_that_they_end_on() {
        let table = "operation,place,pass,point,s_mm,area_mm2,full_stock,line\n\
                     a,1,1,1,0,9,0,\na,1,1,2,5,2,0,10\na,1,1,3,10,4,0,12\na,1,1,4,16,6,1,13\n\
                     a,1,2,1,16,9,0,\na,1,2,2,20,3,0,30\na,1,2,3,21,5,0,31\n";
        let cuts = [cut(10, 90.0, 5.0), cut(11, 7.0, 2.0), cut(12, 8.0, 3.5), cut(13, 30.0, 6.0), cut(31, 4.0, 1.0)];
        let pieces = trial(table, &cuts);
        assert_eq!(pieces.iter().map(|p| (p.pass, p.steps.len())).collect::<Vec<_>>(), [(1, 2), (2, 1)]);
        let known = Step { at: 7.5, area: 3.0, in_full_stock: false, way: 5.0, tip_way: 5.5, removed: 15.0 };
        assert_eq!(pieces[0].steps[0], known);
        assert!(pieces[0].steps[1].in_full_stock);
        assert_eq!(pieces[0].inner(0.0).collect::<Vec<_>>(), [&known]);
        assert_eq!(pieces[0].inner(9.0).count(), 0);
        let v = Volumes::of(pieces[0].inner(0.0)).with(Volumes::of(&pieces[1].steps));
        assert_eq!(v, Volumes { by_area: 19.0, by_tip: 20.5, removed: 19.0, way: 6.0 });
        assert_eq!(v.ratio(), 1.0);
    }
}
