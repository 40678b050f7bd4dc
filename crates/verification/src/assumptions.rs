//! Assumptions of a program's run besides its text.

use std::collections::BTreeSet;

use facemill_job::format::report::stock::StockReport;
use facemill_virtual_machine::{Assumption, BlockCut, EstimatedPositions};

/// Returns assumptions in the order of their lines, each once, with the first line that depends on
/// it.
pub(crate) fn all_assumptions(of_text: Vec<Assumption>, of_feeds: Vec<Assumption>) -> Vec<Assumption> {
    let mut all = [of_text, of_feeds].concat();
    all.sort();
    let mut seen = BTreeSet::new();
    all.retain(|assumption| seen.insert(assumption.text.clone()));
    all
}

/// Returns the note that nothing is proven.
pub(crate) fn is_estimate(positions: &EstimatedPositions) -> Assumption {
    let EstimatedPositions { cut_step_mm, rapid_step_mm } = positions;
    let text = format!(
        "the fast mode is an estimate: nothing is proven between positions, {cut_step_mm} mm apart in cuts and {rapid_step_mm} mm in rapids, \
         nor between the edges of tool and holder; verify without --fast before running the program"
    );
    Assumption { line: None, text }
}

/// Returns the note that no cut removes stock, if all stock is seen: the findings assume that this
/// is intended.
pub(crate) fn cuts_nothing(report: &StockReport, blocks: &[BlockCut]) -> Option<Assumption> {
    let in_air = !blocks.is_empty() && report.removed_mm3 == 0.0 && report.blocks_not_covered == 0;
    let text = "no cutting block removes stock: check mounting, work offset, tool length and the unit of the meshes";
    in_air.then(|| Assumption { line: None, text: text.to_owned() })
}
