//! Stock of a setup as both heads cut it.

use facemill_job::failure::Failure;
use facemill_job::stages::Stages;
use facemill_job::stock::map::StockRegion;
use facemill_verification::program::removal_of;
use facemill_verification::stock_run::{HeadView, cut_stock};
use facemill_verification::sub_cell_check::{hold_machine_as_cut, machine_as_cut};
use facemill_virtual_machine::{Verification, VerifySettings};

use super::output::DualProgram;
use crate::plan_stock::{CutByPlan, StockBefore, cut_by_plan};
use crate::program::output::lines_of;

impl DualProgram<'_, '_> {
    /// Cuts the stock with both heads and adds contacts with it to each head's verification.
    /// Removes contacts of machine bodies with the initial stock that the cut stock disproves, and
    /// returns the assumption that this rests on.
    ///
    /// # Errors
    /// Returns an error if the stages are cancelled.
    pub(crate) fn cut_by_plan(
        &self,
        before: &StockBefore,
        [first, second]: &mut [Verification; 2],
        stages: &dyn Stages,
    ) -> Result<(CutByPlan, Option<String>), Failure> {
        let job = self.ground.scenes[0].job;
        let at = [0, 1].map(|h| self.setup(h));
        let views = [0, 1].map(|h| HeadView { scene: &self.ground.scenes[h], at: &at[h] });
        let settings = [0, 1].map(|h| {
            let removal = removal_of(self.ground.scenes[h].job, self.ground.scenes[h].setup.file, h);
            VerifySettings { removal, ..self.settings(h) }
        });
        let heads = [(&views[0], &settings[0]), (&views[1], &settings[1])];
        let program = self.read()?;
        let tolerance = job.file.verification.stock_tolerance_mm;
        let cut = cut_by_plan(before, tolerance, ([&mut *first, &mut *second], false), |request| {
            cut_stock(&program, heads, request, stages)
        })?;
        if let Some(report) = cut.0.cut.as_ref().filter(|_| cut.0.began_as_own()) {
            let lines = lines_of(report, StockRegion::Rectangle(report.region_mm));
            if hold_machine_as_cut(&program, heads, &lines, [first, second], stages)? {
                let seen = machine_as_cut(report.cell_mm, report.tolerance_mm);
                return Ok((cut, Some(seen)));
            }
        }
        Ok((cut, None))
    }
}
