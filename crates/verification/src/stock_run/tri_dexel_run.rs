//! Stock on lines along x and y of the workpiece, beside those along z.

use facemill_job::failure::Failure;
use facemill_job::stages::Stages;
use facemill_nc_program::ReadProgram;
use facemill_virtual_machine::{BlockCut, Finding, StockRun, VerifySettings, run_stock_of_heads};
use facemill_z_map::DexelMap;

use crate::named_results::not_verified;
use crate::stock_run::HeadView;

/// Cuts further maps of the same stock by a program, and returns the joint result with that of the
/// upright lines: collisions with the material of any line, each block's volume, and the evidence
/// of the probes of any of them. Volumes are means with the weights of lines along x, y and z,
/// which apply if there are further maps.
///
/// Checks the largest removal rate on the upright lines alone: a mean of three would be available
/// only after all are cut.
///
/// # Errors
/// As [`run_stock_of_heads`].
pub(crate) fn cut_across<const N: usize>(
    program: &ReadProgram,
    heads: [(&HeadView<'_>, &VerifySettings); N],
    (upright, across, weights): ([StockRun; N], &mut [DexelMap], [f64; 3]),
    tolerance: f64,
    stages: &dyn Stages,
) -> Result<[StockRun; N], Failure> {
    let mut runs = upright;
    if across.is_empty() {
        return Ok(runs);
    }
    runs.iter_mut().for_each(|run| weigh(run, weights[2]));
    let settings = heads.map(|(_, settings)| VerifySettings { removal: None, ..settings.clone() });
    let stages_of = ["cut the stock along x", "cut the stock along y"];
    for ((map, stage), weight) in across.iter_mut().zip(stages_of).zip(weights) {
        let monitor = stages.start(stage, program.blocks.len());
        let views: [_; N] = std::array::from_fn(|h| (heads[h].0.at, &settings[h]));
        let of_map = run_stock_of_heads(program, views, map, tolerance, &*monitor).map_err(not_verified)?;
        for (run, mut other) in runs.iter_mut().zip(of_map) {
            weigh(&mut other, weight);
            add(run, other);
        }
    }
    Ok(runs)
}

/// Multiplies the volumes of a run by this weight.
fn weigh(run: &mut StockRun, weight: f64) {
    run.removed_mm3 *= weight;
    run.blocks.iter_mut().for_each(|block| block.removed_mm3 *= weight);
}

/// Adds the result of the same program on other lines of the same stock; volumes are sums.
fn add(run: &mut StockRun, other: StockRun) {
    run.removed_mm3 += other.removed_mm3;
    for (BlockCut { removed_mm3, is_certain, may_be_near, .. }, more) in run.blocks.iter_mut().zip(other.blocks) {
        *removed_mm3 += more.removed_mm3;
        *is_certain |= more.is_certain;
        *may_be_near |= more.may_be_near;
    }
    add_findings(&mut run.findings, other.findings);
}

/// Merges findings on the same pair of bodies: the one whose line range includes the other's
/// absorbs it and keeps the worse measure.
fn add_findings(findings: &mut Vec<Finding>, new: Vec<Finding>) {
    let is_wider = |a: &Finding, b: &Finding| {
        (a.kind, &a.body, &a.obstacle, &a.axis) == (b.kind, &b.body, &b.obstacle, &b.axis)
            && a.first_line <= b.first_line
            && b.last_line <= a.last_line
    };
    for mut f in new {
        if let Some(known) = findings.iter_mut().find(|known| is_wider(known, &f)) {
            known.take_worse(f);
            continue;
        }
        findings
            .extract_if(.., |known| is_wider(&f, known))
            .collect::<Vec<_>>()
            .into_iter()
            .for_each(|k| f.take_worse(k));
        findings.push(f);
    }
    findings.sort_by_key(|f| (f.first_line, f.kind));
}

#[cfg(test)]
#[path = "../../tests/unit/stock_run/tri_dexel_run.rs"]
mod tests;
