//! The stock of a job's setup as a program from anywhere cuts it.

use facemill_nc_program::ReadProgram;
use facemill_virtual_machine::{StockRun, VerifySettings, VirtualSetup, blocks_beyond, run_stock};
use facemill_z_map::DexelMap;
use schemars::JsonSchema;
use serde::Serialize;

use crate::deviation::DeviationRequest;
use crate::load::{Job, Setup};
use crate::output::not_verified;
use crate::stock_map::{StockMeshes, StockRegion};
use crate::{Failure, Stages};

/// Largest tolerance of cut stock, mm: what goes less deep into it than twice this is no finding.
pub(crate) const LARGEST_STOCK_TOLERANCE: f64 = 0.5;

/// Whether stock can be cut within a tolerance, mm.
pub(crate) fn is_stock_tolerance(tolerance: f64) -> bool {
    tolerance > 0.0 && tolerance <= LARGEST_STOCK_TOLERANCE
}

/// How stock is cut.
#[derive(Clone, Debug)]
pub struct CutRequest {
    /// Distance of the lines that the stock is made of, mm.
    pub cell: f64,
    /// How far from the truth what is cut may be, mm.
    pub tolerance: f64,
    /// Which part of the job's stock has lines.
    pub region: StockRegion,
    /// The rest of another program, which this one begins with in place of the job's stock.
    pub rest: Option<DexelMap>,
    /// Hold what is left against the part.
    pub deviation: Option<DeviationRequest>,
}

/// What was cut.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct StockReport {
    /// Distance of the lines that the stock is made of, mm.
    pub cell_mm: f64,
    /// How far from the truth what is cut may be, on every line, mm.
    pub tolerance_mm: f64,
    /// Volume of the stock before the program, mm³.
    pub before_mm3: f64,
    /// What the program took, mm³.
    pub removed_mm3: f64,
    /// Cutting blocks that took nothing.
    pub blocks_in_air: usize,
    /// Low and high corner of the rectangle that has lines, x and y of the lines' frame, mm.
    pub region_mm: [[f64; 2]; 2],
    /// Blocks on which the tool may reach stock beyond that rectangle: what it meets there is not seen.
    pub blocks_not_covered: usize,
    /// Line of the first of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_line_not_covered: Option<u32>,
}

impl StockReport {
    /// Lines for a person.
    pub fn told(&self) -> Vec<String> {
        let mut lines = vec![format!(
            "  stock             {:.1} of {:.1} cm3 cut, on lines {} mm apart; {} blocks in air",
            self.removed_mm3 / 1000.0,
            self.before_mm3 / 1000.0,
            self.cell_mm,
            self.blocks_in_air
        )];
        lines.extend(self.first_line_not_covered.map(|line| {
            let [[x0, y0], [x1, y1]] = self.region_mm;
            format!(
                "  not covered       {} blocks, first in line {line}, may reach stock beyond x {x0:.1} to {x1:.1}, \
                 y {y0:.1} to {y1:.1}: it is not seen",
                self.blocks_not_covered
            )
        }));
        lines
    }
}

/// Where a program is run.
pub(crate) struct Stand<'a> {
    pub job: &'a Job,
    pub setup: &'a Setup<'a>,
    pub at: &'a VirtualSetup<'a>,
}

/// What a program did to the stock.
pub(crate) struct CutDone {
    pub report: StockReport,
    pub run: StockRun,
    /// Lines of the blocks that may reach stock which has no lines in the map.
    pub not_covered: Vec<u32>,
    /// The stock before the program; `None` where its deviation is not asked for.
    pub before: Option<DexelMap>,
    /// The stock behind it.
    pub rest: DexelMap,
}

/// Cuts the stock as a program goes.
///
/// # Errors
/// When the stock cannot be made lines of, a setting makes no sense, or the stages are cancelled.
pub(crate) fn cut_stock(
    program: &ReadProgram,
    on: &Stand<'_>,
    settings: &VerifySettings,
    cut: &CutRequest,
    stages: &dyn Stages,
) -> Result<CutDone, Failure> {
    let meshes = StockMeshes::of(on.setup);
    let mut rest = match &cut.rest {
        Some(rest) => rest.clone(),
        None => meshes.map(on.job, on.setup, cut.cell, cut.region)?,
    };
    let volume = rest.volume();
    let before = cut.deviation.map(|_| rest.clone());
    let monitor = stages.start("cut the stock", program.blocks.len());
    let run = run_stock(program, on.at, settings, &mut rest, cut.tolerance, &*monitor).map_err(not_verified)?;
    let not_covered = blocks_beyond(program, on.at, settings, &rest, &meshes.extents(), &*monitor);
    let not_covered = not_covered.map_err(not_verified)?;
    drop(monitor);
    let report = stock_report(&rest, volume, cut.tolerance, &run, &not_covered);
    Ok(CutDone { report, run, not_covered, before, rest })
}

/// What is told of a run, with the stock's volume before it, mm³.
fn stock_report(rest: &DexelMap, before: f64, tolerance: f64, run: &StockRun, not_covered: &[u32]) -> StockReport {
    let grid = rest.grid();
    let far = [0, 1].map(|k| grid.origin()[k] + grid.n_lines()[k] as f64 * grid.cell());
    StockReport {
        cell_mm: grid.cell(),
        tolerance_mm: tolerance,
        before_mm3: before,
        removed_mm3: run.removed_mm3,
        blocks_in_air: run.blocks.iter().filter(|b| b.removed_mm3 == 0.0).count(),
        region_mm: [grid.origin(), far],
        blocks_not_covered: not_covered.len(),
        first_line_not_covered: not_covered.first().copied(),
    }
}
