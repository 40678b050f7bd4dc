//! Stock of a setup as its program cuts it, for any number of heads.

use facemill_job::failure::Failure;
use facemill_job::format::job_file::LinkStockFile;
use facemill_job::format::report::stock::StockReport;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::Stages;
use facemill_job::stock::map::StockRegion;
use facemill_nc_program::ReadProgram;
use facemill_tool_model::ToolAssembly;
use facemill_verification::program::removal_of;
use facemill_verification::stock_run::{CutRequest, HeadView, cut_stock};
use facemill_verification::sub_cell_check::{
    add_between, hold_machine_as_cut, is_cut_known, machine_as_cut, seen_between, seen_of_rest, sub_cell_check,
};
use facemill_virtual_machine::{HeldAsCut, Verification, VerifySettings, VirtualSetup};
use facemill_z_map::DexelMap;

use crate::plan_stock::{CutByPlan, StockBefore, cut_by_plan};

/// Returns the stock that faster links avoid: as cut, with its tolerance, or `None` for the initial
/// stock.
///
/// # Errors
/// The reason why there is no cut stock, if the job requests links through it.
pub(crate) fn stock_of_links(scene: &Scene<'_>, before: &StockBefore) -> Result<Option<(DexelMap, f64)>, String> {
    match (scene.setup.file.links.stock, before) {
        (LinkStockFile::AtFirst, _) => Ok(None),
        (LinkStockFile::AsCut, Ok((stock, _))) => {
            Ok(Some((stock.clone(), scene.job.file.verification.stock_tolerance_mm)))
        }
        (LinkStockFile::AsCut, Err(why)) => Err(format!("the stock is not cut: {why}")),
    }
}

/// Returns which bodies are tested only against the stock at that time: if links may go through
/// cut regions, tools and rapids, by its lines; and bodies of the machine, if all its possible
/// remains are known.
pub(crate) fn held_as_cut(scenes: &[&Scene<'_>], before: &StockBefore) -> HeldAsCut {
    let (Ok((stock, began_as)), Some(scene)) = (before, scenes.first()) else { return HeldAsCut::NOTHING };
    if scene.setup.file.links.stock != LinkStockFile::AsCut {
        return HeldAsCut::NOTHING;
    }
    let tools: Vec<&ToolAssembly> = scenes.iter().map(|scene| scene.tool()).collect();
    let (cell, tolerance) = (stock.grid().cell(), scene.job.file.verification.stock_tolerance_mm);
    HeldAsCut { tool: true, machine: began_as.is_own() && is_cut_known(&tools, cell, tolerance) }
}

/// Head of a program that cuts the stock.
pub(crate) struct CuttingHead<'a> {
    /// Setup as the head sees it.
    pub scene: &'a Scene<'a>,
    /// The same for the virtual machine.
    pub at: VirtualSetup<'a>,
    /// Settings of the head's run.
    pub settings: VerifySettings,
}

/// Cuts the stock by a program of all heads and adds collisions with it to the head's
/// verifications: if links may go through cut stock, also those between its lines. Otherwise
/// removes contacts of machine bodies with the initial stock that the cut stock disproves. Returns
/// also the description of the check on which this rests.
///
/// # Errors
/// If the stages are cancelled.
pub(crate) fn cut_by_heads<const N: usize>(
    program: &ReadProgram,
    heads: [CuttingHead<'_>; N],
    before: &StockBefore,
    mut runs: [&mut Verification; N],
    stages: &dyn Stages,
) -> Result<(CutByPlan, Option<String>), Failure> {
    let (as_cut, tolerance) = heads.first().map_or((HeldAsCut::NOTHING, 0.0), |head| {
        (head.settings.as_cut, head.scene.job.file.verification.stock_tolerance_mm)
    });
    let views = heads.each_ref().map(|head| HeadView { scene: head.scene, at: &head.at });
    let with_removal: [VerifySettings; N] = std::array::from_fn(|h| {
        let (scene, settings) = (heads[h].scene, &heads[h].settings);
        VerifySettings { removal: removal_of(scene.job, scene.setup.file, h), ..settings.clone() }
    });
    let in_stock = std::array::from_fn(|h| (&views[h], &with_removal[h]));
    let to_runs = runs.each_mut().map(|run| &mut **run);
    let cut = cut_by_plan(before, tolerance, (to_runs, as_cut.tool), |request| {
        cut_stock(program, in_stock, request, stages)
    })?;
    let Some(report) = &cut.report.cut else { return Ok((cut, None)) };
    let (cell, tolerance) = (report.cell_mm, report.tolerance_mm);
    let views = std::array::from_fn(|h| (&views[h], &heads[h].settings));
    let seen = match (as_cut.tool, cut.report.began_as_own()) {
        (true, true) => {
            let request = lines_of(report, StockRegion::Whole);
            let then = runs.each_ref().map(|run| &*run.findings);
            let not_covered = [const { Vec::new() }; N];
            let found = sub_cell_check(program, views, &request, (then, &not_covered), stages)?;
            for (run, found) in runs.iter_mut().zip(found) {
                found.keep_open(&mut run.between);
                add_between(&mut run.findings, found.findings);
            }
            Some(seen_between(&heads.each_ref().map(|head| head.scene.tool()), cell, tolerance))
        }
        (true, false) => Some(seen_of_rest(cell)),
        (false, true) => {
            let request = lines_of(report, StockRegion::Rectangle(report.region_mm));
            let is_checked = hold_machine_as_cut(program, views, &request, runs, stages)?;
            is_checked.then(|| machine_as_cut(cell, tolerance))
        }
        (false, false) => None,
    };
    Ok((cut, seen))
}

/// Returns a setup's own stock, on lines like those that it was cut on.
fn lines_of(cut: &StockReport, region: StockRegion) -> CutRequest {
    CutRequest { region, ..CutRequest::on_lines(cut.cell_mm, cut.tolerance_mm) }
}
