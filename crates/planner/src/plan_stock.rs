//! The stock of a plan: cut by each setup's own program, from one setup to the next.

use std::fmt;

use facemill_job::failure::Failure;
use facemill_job::format::job_file::LinkStockFile;
use facemill_job::format::report::stock::{OWN_STOCK, PlannedStockReport};
use facemill_job::load::job::{Job, Setup};
use facemill_job::stock::map::{StockMeshes, StockRegion, rectangle};
use facemill_job::stock::setup_order::follows;
use facemill_job::stock::walls::has_walls;
use facemill_verification::stock_run::{CutDone, CutRequest};
use facemill_virtual_machine::{Finding, FindingKind, Verification};
use facemill_z_map::DexelMap;

/// The stock of a setup that is to be cut.
pub(crate) struct StockToCut<'a> {
    /// Distance of its lines where it is asked for, mm.
    pub cell: Option<f64>,
    /// Index of the setup.
    pub index: usize,
    /// What the program of the setup before has left.
    pub before: Option<&'a DexelMap>,
}

/// What is told of the cut stock, and what is left of it.
pub(crate) type CutByPlan = (PlannedStockReport, Option<DexelMap>);

/// The stock before a setup's program, and what it began as; or why there is none to be cut.
pub(crate) type StockBefore = Result<(DexelMap, BeganAs), String>;

/// What the stock before a setup's program is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum BeganAs {
    /// The setup's own, and why it is not the rest of the setup before; nothing of the first one.
    Own { why: Option<String> },
    /// The rest of the setup of this name.
    RestOf(String),
}

impl BeganAs {
    /// Whether it is the setup's own.
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
    /// The stock before the setup's program.
    ///
    /// # Errors
    /// When the stock cannot be made lines of that are as far apart as asked.
    pub(crate) fn before(&self, job: &Job, setup: &Setup<'_>) -> Result<StockBefore, Failure> {
        if !job.file.verification.cut_stock {
            return Ok(Err("the job says so (verification.cut_stock)".to_owned()));
        }
        let why = match self.rest_before(job) {
            Ok((rest, of)) => return Ok(Ok((rest.clone(), BeganAs::RestOf(of.to_owned())))),
            Err(why) => why,
        };
        let own = self.own(job, setup, job.file.verification.stock_tolerance_mm)?;
        Ok(own.map(|stock| (stock, BeganAs::Own { why })))
    }

    /// What the setup before has left and its name; or why this setup does not begin with it,
    /// nothing where it is the first.
    fn rest_before<'j>(&'j self, job: &'j Job) -> Result<(&'j DexelMap, &'j str), Option<String>> {
        let Some(of) = self.index.checked_sub(1).map(|k| &job.file.setups[k]) else { return Err(None) };
        follows(of, &job.file.setups[self.index]).map_err(Some)?;
        let rest = self.before.ok_or_else(|| Some(format!("that of setup \"{}\" was not cut", of.name)))?;
        Ok((rest, &of.name))
    }

    /// The setup's own stock as lines over what its operations cut, and those of the setups that go
    /// on with its rest; or why there is none where nobody has asked for a distance of lines.
    fn own(&self, job: &Job, setup: &Setup<'_>, tolerance: f64) -> Result<Result<DexelMap, String>, Failure> {
        let setups = &job.file.setups;
        let last = (self.index + 1..setups.len()).take_while(|&k| follows(&setups[k - 1], &setups[k]).is_ok()).last();
        let going_on = self.index + 1..=last.unwrap_or(self.index);
        let mut region = rectangle(job, setup, StockRegion::Operations);
        for k in going_on.clone() {
            let next = Setup::read(job, k)?;
            region = region.zip(rectangle(job, &next, StockRegion::Operations)).map(|(a, b)| around(a, b));
        }
        let Some([low, high]) = region else { return Ok(Err("no operation cuts it".to_owned())) };
        let clearance = going_on.clone().map(|k| &setups[k]).chain([setup.file]).map(|s| s.rapid_clearance_mm);
        let clearance = clearance.fold(f64::INFINITY, f64::min);
        let meshes = StockMeshes::of(setup);
        let of_stock = meshes.extents();
        // Links that keep off nothing but these lines have to see all of the stock; and lines
        // across show all of it.
        let sees_all =
            has_walls(&[setup]) || going_on.chain([self.index]).any(|k| setups[k].links.stock == LinkStockFile::AsCut);
        let (part, [low, high]) = if sees_all {
            (StockRegion::Whole, [[of_stock.min.x, of_stock.min.y], [of_stock.max.x, of_stock.max.y]])
        } else {
            (StockRegion::Rectangle([low, high]), [low, high])
        };
        if let Some(cell) = self.cell {
            return meshes.map(job, setup, cell, part).map(Ok);
        }
        let lengths = [0, 1].map(|k| high[k].min(of_stock.max[k]) - low[k].max(of_stock.min[k]));
        Ok(match default_cell(lengths, clearance, tolerance) {
            Ok(cell) => meshes.map(job, setup, cell, part).map_err(|e| e.to_string()),
            Err(why) => Err(why),
        })
    }
}

/// Cuts the stock by a program, and adds what meets it to what is found already for each head.
/// Findings of the same kind and body that the head's run against the stock as it was at first has
/// at the same place of the text are not told twice. Of bodies of the tool and of the cutter in
/// rapid that run knows all, at every time and without lines, unless the program `rests_on_lines`:
/// then theirs are told.
///
/// # Errors
/// When the stages are cancelled.
pub(crate) fn cut_by_plan<const N: usize>(
    before: &StockBefore,
    tolerance: f64,
    (verifications, rests_on_lines): ([&mut Verification; N], bool),
    cut: impl FnOnce(&CutRequest) -> Result<CutDone<N>, Failure>,
) -> Result<CutByPlan, Failure> {
    let (stock, began_as) = match before {
        Ok((stock, began_as)) => (stock.clone(), began_as.clone()),
        Err(why) => return Ok((PlannedStockReport::not_cut(why.clone()), None)),
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
        not_cut_because: None,
        began_as: Some(began_as.to_string()),
        cut: Some(done.report),
        began_as_own: began_as.is_own(),
    };
    Ok((report, Some(done.rest)))
}

/// Lines along the longer side of what is cut, where nothing else is said; and at most, in time
/// that a plan may take.
const LINES: [f64; 2] = [200.0, 1000.0];

/// Finest lines that are taken without being asked for, mm: stock is not known better than this
/// before it is cut.
const FINEST: f64 = 1.0;

/// Share of the rapid clearance that rapids certainly keep: the control's way between two positions
/// bends by a tenth of it at most. If larger, a rapid that is clean may be a finding; if smaller,
/// lines are closer than they need be.
const KEPT: f64 = 0.85;

/// What distances of lines are whole multiples of, mm.
const STEP: f64 = 0.01;

/// Distance of lines that suits a rectangle, mm: 200 of them along its longer side, no less than 1
/// mm apart. Rapids are asked with half the diagonal of a cell around the cutter: that has to be
/// within the rapid clearance, or every link would be a near miss.
///
/// # Errors
/// With what to do, where so many lines would be needed for that clearance that a plan has to be
/// told to take the time.
fn default_cell(lengths: [f64; 2], clearance: f64, tolerance: f64) -> Result<f64, String> {
    let length = lengths[0].max(lengths[1]);
    let within_clearance = std::f64::consts::SQRT_2 * (KEPT * clearance - 2.0 * tolerance);
    let cell = (length / LINES[0]).max(FINEST).min(within_clearance);
    if cell >= (length / LINES[1]).max(STEP) {
        return Ok((cell / STEP).floor() * STEP);
    }
    Err(format!(
        "lines less than {:.2} mm apart would be needed for rapid_clearance_mm {clearance}, more than {} along the stock; ask for them \
         with verification.stock_cell_mm or --stock-cell-mm",
        within_clearance.max(0.0),
        LINES[1]
    ))
}

/// The rectangle around two.
fn around(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    [[0, 1].map(|k| a[0][k].min(b[0][k])), [0, 1].map(|k| a[1][k].max(b[1][k]))]
}

/// Adds findings that are not there yet, in the order of lines.
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
