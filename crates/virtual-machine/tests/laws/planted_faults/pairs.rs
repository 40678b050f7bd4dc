//! A table of planted faults: each program has one fault of 1.1 times what is allowed, and its twin
//! 0.9 times of it.
//!
//! Every fault is found once, at its block, and nothing else is; of the twins nothing is. What a
//! row's number stands for, its function says: a depth beside the gouge limit, a way into the
//! clearance beside its slack, an angle, a speed.

use facemill_cl_data::Silent;
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_virtual_machine::verify;
use facemill_virtual_machine::{Finding, FindingKind, VerifySettings, VirtualSetup};

use super::{bodies, cut_before, cuts, motion, rapids, stock, text};
use crate::kit::Text;

/// Depth of the cutter that is allowed, mm; [`VerifySettings::default`]'s.
pub(crate) const GOUGE: f64 = 0.02;

/// Part of a clearance that may be used up, mm; [`VerifySettings::default`]'s.
pub(crate) const SLACK: f64 = 0.1;

/// Result of a program, and the line of its planted fault.
pub(crate) struct Outcome {
    pub(crate) findings: Vec<Finding>,
    pub(crate) line: u32,
}

/// A pair of programs.
pub(crate) struct Row {
    name: &'static str,
    kind: FindingKind,
    /// Faults that come with it by their nature, in the twin, too.
    with: &'static [FindingKind],
    run: fn(f64) -> Outcome,
}

pub(crate) fn row(name: &'static str, kind: FindingKind, run: fn(f64) -> Outcome) -> Row {
    Row { name, kind, with: &[], run }
}

impl Row {
    pub(crate) fn with(self, with: &'static [FindingKind]) -> Self {
        Self { with, ..self }
    }
}

/// A program run in a setup, its fault on this line.
pub(crate) fn ran(text: &Text<'_>, setup: &VirtualSetup<'_>, line: u32) -> Outcome {
    Outcome { findings: text.verify_in(setup).findings, line }
}

/// The same with other settings.
pub(crate) fn ran_with(text: &str, setup: &VirtualSetup<'_>, settings: &VerifySettings, line: u32) -> Outcome {
    let program = read_program(text, Dialect::Fanuc).unwrap_or_else(|e| panic!("{e}\n{text}"));
    Outcome { findings: verify(&program, setup, settings, &Silent).unwrap().findings, line }
}

/// Returns the faults of a pair.
fn problems(row: &Row) -> Vec<String> {
    let (fault, twin) = ((row.run)(1.1), (row.run)(0.9));
    let mut problems = Vec::new();
    let found: Vec<&Finding> = fault.findings.iter().filter(|f| f.kind == row.kind).collect();
    match found[..] {
        [f] if f.worst_line != fault.line => {
            problems.push(format!("is reported on another line than {}: {f}", fault.line))
        }
        [_] => {}
        [] => problems.push("is not found".to_owned()),
        _ => problems.push(format!("is reported {} times", found.len())),
    }
    let is_other = |f: &&Finding| f.kind != row.kind && f.kind.is_fault() && !row.with.contains(&f.kind);
    problems.extend(fault.findings.iter().filter(is_other).map(|f| format!("leads to another: {f}")));
    let has_place = |f: &Finding| {
        let tip =
            f.pose.as_ref().is_some_and(|p| p.axis_values.len() >= 5 && p.tip_work_mm.iter().all(|v| v.is_finite()));
        tip && f.time_s.is_some_and(|t| t >= 0.0)
    };
    problems.extend(found.iter().filter(|f| !has_place(f)).map(|f| format!("has no pose or time: {f}")));
    let is_in_twin = |f: &&Finding| f.kind == row.kind || is_other(f);
    problems.extend(twin.findings.iter().filter(is_in_twin).map(|f| format!("is reported of its twin: {f}")));
    problems
}

#[test]
fn every_planted_fault_is_found_at_its_block_and_none_in_its_twin() {
    let of_stock = stock::rows().into_iter().chain(cut_before::rows());
    let of_meshes = [cuts::rows(), bodies::rows(), rapids::rows(), motion::rows(), text::rows()];
    let rows: Vec<Row> = of_meshes.into_iter().flatten().chain(of_stock).collect();
    assert!(rows.len() >= 60, "{} pairs", rows.len());
    let all =
        rows.iter().flat_map(|row| problems(row).into_iter().map(move |p| format!("{}: {:?} {p}", row.name, row.kind)));
    let all: Vec<String> = all.collect();
    assert!(all.is_empty(), "{} of {} pairs:\n{}", all.len(), rows.len(), all.join("\n"));
}
