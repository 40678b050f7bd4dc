//! Stock of a job's setup, cut by a program from any source.

mod tri_dexel_run;
use std::collections::BTreeSet;

use facemill_cl_data::Silent;
use facemill_job::failure::Failure;
use facemill_job::format::report::stock::StockReport;
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::programs_before::{each_program_before, not_run};
use facemill_job::setup::scene::Scene;
use facemill_job::stages::{CUT, Stages};
use facemill_job::stock::map::{StockMeshes, StockRegion};
use facemill_job::stock::walls::{has_walls, weights};
use facemill_nc_program::ReadProgram;
use facemill_virtual_machine::{BlockCut, StockRun, VerifySettings, VirtualSetup, blocks_beyond, run_stock_of_heads};
use facemill_z_map::DexelMap;

use crate::deviation::DeviationRequest;
use crate::named_results::not_verified;
use crate::stock_run::tri_dexel_run::cut_across;

/// Options of cutting stock.
#[derive(Clone, Debug)]
pub struct CutRequest {
    /// Distance of the lines that the stock is made of, mm.
    pub cell: f64,
    /// Largest error of the cut stock, mm.
    pub tolerance: f64,
    /// Region of the job's stock that has lines.
    pub region: StockRegion,
    /// Rest of another program, with which this one begins in place of the job's stock: of the same
    /// stock, as [`read_rest`](facemill_job::stock::rest::read_rest) ensures.
    pub rest: Option<DexelMap>,
    /// Also cut lines along x and y of the workpiece frame, which show walls along z: of all of the
    /// job's stock, not of a region or a rest.
    pub across: bool,
    /// Do so if the operations cut walls along z, which have no such lines: volumes are then
    /// weighted by how square the lines are to the cut surfaces. For the job's own stock alone.
    pub across_walls: bool,
    /// Compare the remaining stock with the part.
    pub deviation: Option<DeviationRequest>,
}

impl CutRequest {
    /// Returns a request for all of the job's stock on lines so far apart, within this tolerance,
    /// mm.
    #[must_use]
    pub const fn on_lines(cell: f64, tolerance: f64) -> Self {
        Self {
            cell,
            tolerance,
            region: StockRegion::Whole,
            rest: None,
            across: false,
            across_walls: false,
            deviation: None,
        }
    }
}

/// Returns a setup's stock on lines, cut by the known programs before its own
/// ([`each_program_before`]).
///
/// # Errors
/// As [`StockMeshes::map`]; if a program before is not understood.
pub fn stock_before(
    job: &Job,
    setup: &Setup<'_>,
    cell: f64,
    region: StockRegion,
    tolerance: f64,
) -> Result<DexelMap, Failure> {
    let mut stock = StockMeshes::of(setup).map(job, setup, cell, region)?;
    cut_by_programs_before(job, setup, &mut stock, tolerance)?;
    Ok(stock)
}

fn cut_by_programs_before(job: &Job, setup: &Setup<'_>, stock: &mut DexelMap, tolerance: f64) -> Result<(), Failure> {
    let settings = VerifySettings::default();
    each_program_before(job, setup, 0, |before| {
        // Nothing is known to be cut by a program with a fault.
        if before.fault.is_none() {
            run_stock_of_heads(&before.text, [(&before.at, &settings)], stock, tolerance, &Silent)
                .map_err(|e| not_run(before.path, e))?;
        }
        Ok(())
    })
}

/// Setup of a program's run, as a head sees it.
pub struct HeadView<'a> {
    /// Scene of the head.
    pub scene: &'a Scene<'a>,
    /// Its machine with everything on it.
    pub at: &'a VirtualSetup<'a>,
}

/// Removal of a cutting block by all heads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockRemoval {
    /// Line of the program, from 1.
    pub line: u32,
    /// Volume, mm³.
    pub removed_mm3: f64,
    /// Whether it is in air: no line loses material in it, nor within twice the distance of the
    /// lines along the tip's path, and lines cover all stock that it may reach. It is an estimate:
    /// material between the lines is not seen, and air beside material is not counted.
    pub is_in_air: bool,
}

/// Stock after a program, with the runs of its heads.
pub struct CutDone<const N: usize> {
    /// Report.
    pub report: StockReport,
    /// Run of each head.
    pub runs: [StockRun; N],
    /// Removal of every cutting block.
    pub removals: Vec<BlockRemoval>,
    /// Lines of the blocks on which each head may reach stock that has no lines in the map.
    pub not_covered: [Vec<u32>; N],
    /// The stock before the program, on lines of each direction, those along z first, or the
    /// setup's own if the comparison is with that; none if no deviation is requested.
    pub before: Vec<DexelMap>,
    /// The stock after it, on lines along z.
    pub rest: DexelMap,
    /// The stock after it on lines along x and y, if requested.
    pub across: Vec<DexelMap>,
}

/// Cuts the stock as a program goes, by all heads of the machine at the same time; the stock is
/// that of the first head's setup.
///
/// # Errors
/// If the stock cannot be turned into lines, a setting makes no sense, or the stages are cancelled.
pub fn cut_stock<const N: usize>(
    program: &ReadProgram,
    heads: [(&HeadView<'_>, &VerifySettings); N],
    cut: &CutRequest,
    stages: &dyn Stages,
) -> Result<CutDone<N>, Failure> {
    let Some((on, _)) = heads.first() else { return Err(Failure::Internal("no head cuts the stock".to_owned())) };
    let meshes = StockMeshes::of(on.scene.setup);
    let mut rest = match &cut.rest {
        Some(rest) => rest.clone(),
        None => stock_before(on.scene.job, on.scene.setup, cut.cell, cut.region, cut.tolerance)?,
    };
    let setups = heads.map(|(stand, _)| stand.scene.setup);
    let has_walls = has_walls(&setups);
    let for_walls = !cut.across && cut.across_walls && has_walls;
    let across_before = || {
        let mut maps = meshes.across(on.scene.job, on.scene.setup, cut.cell)?;
        for map in &mut maps {
            cut_by_programs_before(on.scene.job, on.scene.setup, map, cut.tolerance)?;
        }
        Ok(maps)
    };
    let maps_across: Option<Result<[DexelMap; 2], Failure>> = (cut.across || for_walls).then(across_before);
    let mut across = match maps_across {
        Some(Ok(maps)) => maps.to_vec(),
        Some(Err(why)) if cut.across => return Err(why),
        // They were not requested: without them, the report says that walls are not seen.
        Some(Err(_)) | None => Vec::new(),
    };
    let weights = if for_walls { weights(&setups) } else { [1.0 / 3.0; 3] };
    let maps = || std::iter::once(&rest).chain(&across);
    let volume = match &across[..] {
        [x, y] => [x, y, &rest].into_iter().zip(weights).map(|(map, weight)| weight * map.volume()).sum(),
        _ => rest.volume(),
    };
    let before = match &cut.deviation {
        Some(deviation) if deviation.since_stock => {
            maps().map(|lines| meshes.map_on(on.scene.job, on.scene.setup, lines)).collect::<Result<_, _>>()?
        }
        Some(_) => maps().cloned().collect(),
        None => Vec::new(),
    };
    let monitor = stages.start(CUT, program.blocks.len());
    let views = heads.map(|(on, settings)| (on.at, settings));
    let upright = run_stock_of_heads(program, views, &mut rest, cut.tolerance, &*monitor).map_err(not_verified)?;
    let runs = cut_across(program, heads, (upright, &mut across, weights), cut.tolerance, stages)?;
    let mut not_covered = [const { Vec::new() }; N];
    for (lines, (at, settings)) in not_covered.iter_mut().zip(views) {
        *lines = blocks_beyond(program, at, settings, &rest, &meshes.extents(), &*monitor).map_err(not_verified)?;
    }
    drop(monitor);
    let lines_along = if across.is_empty() { vec!["z"] } else { vec!["x", "y", "z"] };
    let walls_not_seen = across.is_empty() && has_walls;
    let beyond: BTreeSet<u32> = not_covered.iter().flatten().copied().collect();
    let removals = removals(&blocks_of_heads(&runs), &beyond, AIR_CELLS * cut.cell);
    let report = StockReport {
        lines_along,
        walls_not_seen,
        ..stock_report(&rest, volume, cut.tolerance, (&runs, &removals), &beyond)
    };
    Ok(CutDone { report, runs, removals, not_covered, before, rest, across })
}

/// Returns the joint removal of all heads on each block with a cutting move. The runs are of one
/// program, block by block.
pub fn blocks_of_heads(runs: &[StockRun]) -> Vec<BlockCut> {
    let mut all = runs.first().map_or(Vec::new(), |run| run.blocks.clone());
    for run in runs.iter().skip(1) {
        for (sum, block) in all.iter_mut().zip(&run.blocks) {
            sum.removed_mm3 += block.removed_mm3;
            sum.way_mm = sum.way_mm.max(block.way_mm);
            sum.is_certain |= block.is_certain;
            sum.may_be_near |= block.may_be_near;
        }
    }
    all
}

/// Way without removal before and behind a block in air, in distances of the lines: a cutter in
/// material passes a line more often.
const AIR_CELLS: f64 = 2.0;

/// Returns the removal of every block; `around` is the way along the tip's path that stays without
/// removal before and behind a block in air, mm.
fn removals(blocks: &[BlockCut], beyond: &BTreeSet<u32>, around: f64) -> Vec<BlockRemoval> {
    let is_cut = |b: &BlockCut| b.removed_mm3 > 0.0 || beyond.contains(&b.line);
    // Way from each block to the next one that cuts, on one side.
    let ways = |blocks: &mut dyn Iterator<Item = &BlockCut>| -> Vec<f64> {
        let step = |way: &mut f64, b: &BlockCut| {
            let here = if is_cut(b) { 0.0 } else { *way };
            *way = here + if is_cut(b) { 0.0 } else { b.way_mm };
            Some(here)
        };
        blocks.scan(f64::INFINITY, step).collect()
    };
    let before = ways(&mut blocks.iter());
    let mut behind = ways(&mut blocks.iter().rev());
    behind.reverse();
    let of = |(b, ways): (&BlockCut, (f64, f64))| BlockRemoval {
        line: b.line,
        removed_mm3: b.removed_mm3,
        is_in_air: ways.0 > around && ways.1 > around,
    };
    blocks.iter().zip(before.into_iter().zip(behind)).map(of).collect()
}

/// Returns the report on the heads' runs, with the stock's volume before them, mm³.
fn stock_report(
    rest: &DexelMap,
    before: f64,
    tolerance: f64,
    (runs, removals): (&[StockRun], &[BlockRemoval]),
    not_covered: &BTreeSet<u32>,
) -> StockReport {
    let by_heads: Vec<f64> = runs.iter().map(|run| run.removed_mm3).collect();
    let grid = rest.grid();
    let far = [0, 1].map(|k| grid.origin()[k] + grid.n_lines()[k] as f64 * grid.cell());
    StockReport {
        cell_mm: grid.cell(),
        tolerance_mm: tolerance,
        lines_along: Vec::new(),
        walls_not_seen: false,
        before_mm3: before,
        removed_mm3: by_heads.iter().sum(),
        removed_by_heads_mm3: if by_heads.len() > 1 { by_heads } else { Vec::new() },
        blocks_in_air: removals.iter().filter(|b| b.is_in_air).count(),
        region_mm: [grid.origin(), far],
        blocks_not_covered: not_covered.len(),
        first_line_not_covered: not_covered.first().copied(),
    }
}

#[cfg(test)]
#[path = "../tests/unit/stock_run.rs"]
mod tests;
