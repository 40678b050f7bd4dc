//! All setups of a job, each on the stock that earlier ones leave.

use facemill_job::failure::Failure;
use facemill_job::load::job::Job;
use facemill_job::stages::Stages;

use crate::plan::planned_setup;
use crate::plan_settings::PlanSettings;
use crate::plan_stock::StockToCut;
use crate::planned::Planned;

/// Plans all setups of a job in their order, and cuts the stock of each by its own verified
/// program: on lines `cell` mm apart, or as the job's `verification` says. A setup begins with the
/// rest that the one before leaves if both have the same workpiece frame and state the same stock;
/// each report says what its stock began as, or why none was cut.
///
/// Guarantees, besides the guarantees of [`plan_setup`](crate::plan::plan_setup): on every line of
/// the stock, no body that must not meet the material left at that moment does so by more than
/// twice the tolerance.
///
/// Setups on whose regions nothing is left get no program.
///
/// # Errors
/// [`Failure::NothingToCut`] if no setup gets a program; as
/// [`plan_setup`](crate::plan::plan_setup); if the stock cannot be turned into lines at the
/// requested distance.
pub fn plan_job(
    job: &Job,
    settings: PlanSettings,
    cell: Option<f64>,
    stages: &dyn Stages,
) -> Result<Vec<Planned>, Failure> {
    if cell.is_some_and(|c| !(c > 0.0 && c.is_finite())) {
        return Err(job.wrong("the distance of the stock's lines must be a length above 0 mm"));
    }
    let mut all: Vec<Planned> = Vec::new();
    let (mut nothing, mut has_skipped) = (None, false);
    for index in 0..job.file.setups.len() {
        // The rest of an earlier setup may be in another frame.
        let before = all.last().filter(|_| !has_skipped).and_then(|planned| planned.rest.as_ref());
        let stock = StockToCut { cell: cell.or(job.file.verification.stock_cell_mm), index, before };
        match planned_setup(job, index, settings, Some(&stock), stages) {
            Err(Failure::NothingToCut(why)) => (nothing, has_skipped) = (Some(Failure::NothingToCut(why)), true),
            planned => {
                has_skipped = false;
                all.push(planned?);
            }
        }
    }
    match nothing {
        Some(why) if all.is_empty() => Err(why),
        _ => Ok(all),
    }
}
