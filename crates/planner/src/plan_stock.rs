//! Stock of a plan: cut by each setup's own program, from one setup to the next.

use std::fmt;

use facemill_job::failure::Failure;
use facemill_job::format::job_file::LinkStockFile;
use facemill_job::format::report::stock::{OWN_STOCK, PlannedStockReport};
use facemill_job::load::job::{Job, Setup};
use facemill_job::stock::map::{StockMeshes, StockRegion, rectangle, rectangle_with};
use facemill_job::stock::walls::has_walls;
use facemill_job::validate::setup_chain::{follows, work_from_work};
use facemill_verification::stock_run::{BlockRemoval, CutDone, CutRequest, stock_before};
use facemill_virtual_machine::{Finding, FindingKind, Verification};
use facemill_z_map::DexelMap;

/// Stock of a setup for cutting.
pub(crate) struct StockToCut<'a> {
    /// Requested distance of its lines, mm.
    pub cell: Option<f64>,
    /// Index of the setup.
    pub index: usize,
    /// Rest that the last program before has left, and the index of its setup.
    pub before: Option<(usize, &'a DexelMap)>,
}

/// Stock as the program of a plan cuts it.
pub(crate) struct CutByPlan {
    /// Report.
    pub report: PlannedStockReport,
    /// Removal of every cutting block, if the stock was cut.
    pub removals: Option<Vec<BlockRemoval>>,
    /// Rest of the stock, if it was cut.
    pub rest: Option<DexelMap>,
}

impl CutByPlan {
    /// Returns the result for stock that was not cut.
    pub(crate) const fn not_cut(report: PlannedStockReport) -> Self {
        Self { report, removals: None, rest: None }
    }
}

/// Stock before a setup's program and its origin, or the reason why there is none to cut.
pub(crate) type StockBefore = Result<(DexelMap, BeganAs), String>;

/// Origin of the stock before a setup's program.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum BeganAs {
    /// The setup's own, with the reason why it is not the rest of the setup before; `None` for the
    /// first setup.
    Own { why: Option<String> },
    /// The rest of the setup of this name.
    RestOf(String),
}

impl BeganAs {
    /// Returns whether it is the setup's own.
    pub(crate) fn is_own(&self) -> bool {
        matches!(self, Self::Own { .. })
    }
}

impl fmt::Display for BeganAs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Own { why: None } => f.write_str(OWN_STOCK),
            Self::Own { why: Some(why) } => write!(f, "{OWN_STOCK}: {why}"),
            Self::RestOf(setup) => write!(f, "the rest of setup \"{setup}\""),
        }
    }
}

impl StockToCut<'_> {
    /// Returns the stock before the setup's program.
    ///
    /// # Errors
    /// If the stock cannot be turned into lines at the requested distance.
    pub(crate) fn before(&self, job: &Job, setup: &Setup<'_>) -> Result<StockBefore, Failure> {
        if !job.file.verification.cut_stock {
            return Ok(Err("the job says so (verification.cut_stock)".to_owned()));
        }
        let why = match self.rest_before(job, setup) {
            Ok((rest, of)) => return Ok(Ok((rest, BeganAs::RestOf(of.to_owned())))),
            Err(why) => why,
        };
        let by_others = (!setup.file.programs_before.is_empty()).then(|| "cut by the programs before it".to_owned());
        let why = [why, by_others].into_iter().flatten().reduce(|a, b| format!("{a}; {b}"));
        let own = self.own(job, setup, job.file.verification.stock_tolerance_mm)?;
        Ok(own.map(|stock| (stock, BeganAs::Own { why })))
    }

    /// Returns the rest of the setup before and its name, or the reason why this setup does not
    /// begin with it; `None` as reason for the first setup.
    fn rest_before<'j>(&self, job: &'j Job, setup: &Setup<'_>) -> Result<(DexelMap, &'j str), Option<String>> {
        let Some(of) = self.index.checked_sub(1).map(|k| &job.file.setups[k]) else { return Err(None) };
        follows(of, &job.file.setups[self.index]).map_err(Some)?;
        let (k, rest) = self.before.ok_or_else(|| Some(format!("that of setup \"{}\" was not cut", of.name)))?;
        let (of, own) = (&job.file.setups[k], &job.file.setups[self.index]);
        let rest = match work_from_work(of, own) {
            Some(motion) => rest.clone().moved(&motion).with_origin(StockMeshes::of(setup).origin().to_bytes()),
            None => rest.clone(),
        };
        Ok((rest, &of.name))
    }

    /// Returns the setup's own stock as lines over the region that its operations cut, and those of
    /// the setups that continue with its rest; or the reason why there is none if no distance of
    /// lines is requested.
    fn own(&self, job: &Job, setup: &Setup<'_>, tolerance: f64) -> Result<Result<DexelMap, String>, Failure> {
        let setups = &job.file.setups;
        let last = (self.index + 1..setups.len()).take_while(|&k| follows(&setups[k - 1], &setups[k]).is_ok()).last();
        let going_on = self.index + 1..=last.unwrap_or(self.index);
        let region = match rectangle(job, setup, StockRegion::Operations) {
            Some(own) => rectangle_with(job, Some(own), going_on.clone())?,
            None => None,
        };
        let Some([low, high]) = region else { return Ok(Err("no operation cuts it".to_owned())) };
        let clearance = going_on.clone().map(|k| &setups[k]).chain([setup.file]).map(|s| s.rapid_clearance_mm);
        let clearance = clearance.fold(f64::INFINITY, f64::min);
        let meshes = StockMeshes::of(setup);
        let of_stock = meshes.extents();
        // Links that avoid nothing but these lines must see all of the stock; and lines across show
        // all of it.
        // What setups in other frames cut is not in this rectangle.
        let is_turned = going_on.clone().any(|k| work_from_work(&setups[k], setup.file).is_some());
        let is_as_cut = |k: usize| setups[k].links.stock == LinkStockFile::AsCut;
        let sees_all = is_turned || has_walls(&[setup]) || going_on.chain([self.index]).any(is_as_cut);
        let (part, [low, high]) = if sees_all {
            (StockRegion::Whole, [[of_stock.min.x, of_stock.min.y], [of_stock.max.x, of_stock.max.y]])
        } else {
            (StockRegion::Rectangle([low, high]), [low, high])
        };
        if let Some(cell) = self.cell {
            return stock_before(job, setup, cell, part, tolerance).map(Ok);
        }
        let lengths = [0, 1].map(|k| high[k].min(of_stock.max[k]) - low[k].max(of_stock.min[k]));
        Ok(match default_cell(lengths, clearance, tolerance) {
            Ok(cell) => stock_before(job, setup, cell, part, tolerance).map_err(|e| e.to_string()),
            Err(why) => Err(why),
        })
    }
}

/// Cuts the stock by a program, and adds its collisions to the findings of each head. Does not
/// repeat findings of the same kind and body that the head's run against the initial stock has at
/// the same place of the text. For tool bodies and the cutter in rapid that run is complete, at
/// every time and without lines, unless the program `rests_on_lines`: only then are such findings
/// added.
///
/// # Errors
/// If the stages are cancelled.
pub(crate) fn cut_by_plan<const N: usize>(
    before: &StockBefore,
    tolerance: f64,
    (verifications, rests_on_lines): ([&mut Verification; N], bool),
    cut: impl FnOnce(&CutRequest) -> Result<CutDone<N>, Failure>,
) -> Result<CutByPlan, Failure> {
    let (stock, began_as) = match before {
        Ok((stock, began_as)) => (stock.clone(), began_as.clone()),
        Err(why) => return Ok(CutByPlan::not_cut(PlannedStockReport::not_cut(why.clone()))),
    };
    let cell = stock.grid().cell();
    let across_walls = began_as.is_own();
    let request = CutRequest { rest: Some(stock), across_walls, ..CutRequest::on_lines(cell, tolerance) };
    let done = cut(&request)?;
    for (verification, run) in verifications.into_iter().zip(done.runs) {
        let is_news = |f: &Finding| {
            use FindingKind::{HolderCollision, NearMiss, RapidCollision};
            rests_on_lines || !matches!(f.kind, HolderCollision | NearMiss | RapidCollision)
        };
        add_new(&mut verification.findings, run.findings.into_iter().filter(is_news).collect());
    }
    let report = PlannedStockReport {
        planned_on: String::new(),
        not_cut_because: None,
        began_as: Some(began_as.to_string()),
        cut: Some(done.report),
        began_as_own: began_as.is_own(),
    };
    Ok(CutByPlan { report, removals: Some(done.removals), rest: Some(done.rest) })
}

/// Default number of lines along the longer side of the cut region; and the largest number, for the
/// time of a plan.
const LINES: [f64; 2] = [200.0, 1000.0];

/// Smallest default distance of lines, mm: the stock before the cut is not known better.
const FINEST: f64 = 1.0;

/// Fraction of the rapid clearance that rapids certainly keep: the control's path between two
/// positions bends by at most a tenth of it. Larger: a clean rapid may be a finding; smaller: lines
/// are closer than necessary.
const KEPT_BY_RAPIDS: f64 = 0.85;

/// Unit of line distances, mm.
const STEP: f64 = 0.01;

/// Returns the default distance of lines for a rectangle, mm: 200 of them along its longer side, no
/// less than 1 mm apart. The test of rapids adds half the diagonal of a cell around the cutter: it
/// must be within the rapid clearance, or every link would be a near miss.
///
/// # Errors
/// With the remedy, if that clearance needs so many lines that the user must accept the time.
fn default_cell(lengths: [f64; 2], clearance: f64, tolerance: f64) -> Result<f64, String> {
    let length = lengths[0].max(lengths[1]);
    let within_clearance = std::f64::consts::SQRT_2 * (KEPT_BY_RAPIDS * clearance - 2.0 * tolerance);
    let cell = (length / LINES[0]).max(FINEST).min(within_clearance);
    if cell >= (length / LINES[1]).max(STEP) {
        return Ok((cell / STEP).floor() * STEP);
    }
    Err(format!(
        "lines less than {:.2} mm apart would be needed for rapid_clearance_mm {clearance}, more than {} along the stock; request them \
         with verification.stock_cell_mm or --stock-cell-mm",
        within_clearance.max(0.0),
        LINES[1]
    ))
}

/// Adds new findings, in the order of lines.
fn add_new(findings: &mut Vec<Finding>, new: Vec<Finding>) {
    let is_known = |f: &Finding| {
        let same = |k: &&Finding| k.kind == f.kind && k.body == f.body;
        findings.iter().filter(same).any(|k| (k.first_line..=k.last_line).contains(&f.worst_line))
    };
    let new: Vec<Finding> = new.into_iter().filter(|f| !is_known(f)).collect();
    findings.extend(new);
    findings.sort_by_key(|f| (f.first_line, f.kind));
}

#[cfg(test)]
#[path = "../tests/unit/plan_stock.rs"]
mod tests;
