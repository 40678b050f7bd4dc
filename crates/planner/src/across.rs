//! Stock on lines along x and y of the workpiece, beside those along z.

use facemill_nc_program::ReadProgram;
use facemill_virtual_machine::{BlockCut, Finding, StockRun, VerifySettings, run_stock_of_heads};
use facemill_z_map::DexelMap;

use crate::output::not_verified;
use crate::verify_stock::Stand;
use crate::{Failure, Stages};

/// Cuts further maps of the same stock by a program, and tells what it did on all of them together with what is known of the upright
/// lines: what meets the material of any line, each block's mean volume, and what the probes of any of them show.
///
/// The largest removal rate is held against the upright lines alone: a mean of three would only come when all are cut.
///
/// # Errors
/// As [`run_stock_of_heads`].
pub(crate) fn cut_across<const N: usize>(
    program: &ReadProgram,
    heads: [(&Stand<'_>, &VerifySettings); N],
    (upright, across): ([StockRun; N], &mut [DexelMap]),
    tolerance: f64,
    stages: &dyn Stages,
) -> Result<[StockRun; N], Failure> {
    let n_maps = 1.0 + across.len() as f64;
    let mut runs = upright;
    let settings = heads.map(|(_, settings)| VerifySettings { removal: None, ..settings.clone() });
    for (map, stage) in across.iter_mut().zip(["cut the stock along x", "cut the stock along y"]) {
        let monitor = stages.start(stage, program.blocks.len());
        let views: [_; N] = std::array::from_fn(|h| (heads[h].0.at, &settings[h]));
        let of_map = run_stock_of_heads(program, views, map, tolerance, &*monitor).map_err(not_verified)?;
        runs.iter_mut().zip(of_map).for_each(|(run, other)| add(run, other));
    }
    for run in &mut runs {
        run.removed_mm3 /= n_maps;
        run.blocks.iter_mut().for_each(|block| block.removed_mm3 /= n_maps);
    }
    Ok(runs)
}

/// Adds what the same program did on other lines of the same stock; volumes are sums.
fn add(run: &mut StockRun, other: StockRun) {
    run.removed_mm3 += other.removed_mm3;
    for (BlockCut { removed_mm3, is_certain, may_be_near, .. }, more) in run.blocks.iter_mut().zip(other.blocks) {
        *removed_mm3 += more.removed_mm3;
        *is_certain |= more.is_certain;
        *may_be_near |= more.may_be_near;
    }
    add_findings(&mut run.findings, other.findings);
}

/// Adds findings, but for what is told of all of these blocks already, of the same bodies; the worse of both is told then.
fn add_findings(findings: &mut Vec<Finding>, new: Vec<Finding>) {
    for f in new {
        let is_told = |k: &&mut Finding| {
            (k.kind, &k.body, &k.obstacle, &k.axis) == (f.kind, &f.body, &f.obstacle, &f.axis)
                && k.first_line <= f.first_line
                && f.last_line <= k.last_line
        };
        match findings.iter_mut().find(is_told) {
            Some(known) => known.take_worse(f),
            None => findings.push(f),
        }
    }
    findings.sort_by_key(|f| (f.first_line, f.kind));
}
