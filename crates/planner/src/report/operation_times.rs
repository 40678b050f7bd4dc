//! Time and removal of each operation, by the text.

use std::collections::BTreeMap;

use facemill_job::format::report::operations::OperationReport;
use facemill_tool_path::moves::MoveKind;
use facemill_verification::stock_run::BlockRemoval;
use facemill_virtual_machine::GougeSection;

use crate::program::timed::Timed;

/// Returns the reports of a program's operations, which begin at the lines of `sections`;
/// `removals` are those of its cutting blocks; `None` if the stock was not cut.
pub(crate) fn operation_times(
    sections: &[GougeSection],
    timed: &Timed,
    removals: Option<&[BlockRemoval]>,
) -> Vec<OperationReport> {
    let is_cut = removals.is_some();
    let removals = removals.unwrap_or_default();
    let of = |s: &GougeSection| OperationReport {
        operation: s.name.clone(),
        first_line: s.first_line,
        passes_time_s: 0.0,
        approach_time_s: 0.0,
        rapid_time_s: 0.0,
        air_share: None,
        removed_mm3: is_cut.then_some(0.0),
    };
    let mut reports: Vec<OperationReport> = sections.iter().map(of).collect();
    let mut in_air = vec![0.0; reports.len()];
    // What is before the first operation leads to it.
    let index = |line: u32| sections.partition_point(|s| s.first_line <= line).saturating_sub(1);
    let removed: BTreeMap<u32, &BlockRemoval> = removals.iter().map(|block| (block.line, block)).collect();
    for block in &timed.line_times {
        let k = index(block.line);
        let Some(report) = reports.get_mut(k) else { continue };
        match block.kind {
            MoveKind::Cut => {
                report.passes_time_s += block.time;
                let is_in_air = removed.get(&block.line).is_some_and(|removal| removal.is_in_air);
                in_air[k] += if is_in_air { block.time } else { 0.0 };
            }
            MoveKind::Approach | MoveKind::Engage | MoveKind::Turn => report.approach_time_s += block.time,
            MoveKind::Rapid => report.rapid_time_s += block.time,
        }
    }
    for removal in removals {
        if let Some(sum) = reports.get_mut(index(removal.line)).and_then(|report| report.removed_mm3.as_mut()) {
            *sum += removal.removed_mm3;
        }
    }
    for (report, in_air) in reports.iter_mut().zip(in_air).filter(|(report, _)| is_cut && report.passes_time_s > 0.0) {
        report.air_share = Some(in_air / report.passes_time_s);
    }
    reports
}

#[cfg(test)]
#[path = "../../tests/unit/report/operation_times.rs"]
mod tests;
