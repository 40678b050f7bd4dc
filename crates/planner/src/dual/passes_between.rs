//! Passes added between those that both heads cut, where the postures of both at once leave more
//! than the allowed cusp.

use facemill_cl_data::Pass;
use facemill_cutter_location::{Outcome, PoseTest, Widened};
use facemill_inverse_kinematics::{Branch, BranchPreference};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::OperationFile;
use facemill_job::frames::places;
use facemill_job::setup::cell::pass_settings;
use facemill_job::setup::pass_surface::{extended_region, surface_of};
use facemill_job::stages::{BETWEEN, PLACES, Stages};
use facemill_tool_path::segments::pole::Tests;
use facemill_tool_path::segments::{LaidTask, LeftOut, PassSegment, copy_outcomes, filled, split};
use facemill_tool_path::winding::wound;
use nalgebra::Isometry3;

use crate::passes::engagement::stations;
use crate::passes::extra_passes::{CutOrder, ExtraPasses, Interposer, PlannedPath};
use crate::passes::high_places::HighPlaces;
use crate::passes::move_settings::cut_linearity;
use crate::passes::operation::PlannedOperation;
use crate::passes::path_planner::{detours, interposer, strategy_of};
use crate::passes::setup_context::SetupContext;

/// Passes of one head, added between those that it cuts.
#[derive(Default)]
pub(crate) struct PassesBetween {
    /// Their pieces in all places of the pattern, to be cut after all others.
    pub pieces: Vec<PassSegment>,
    /// Largest number in one place of the pattern, and places without any possible.
    pub extra: ExtraPasses,
    /// Their CC points.
    pub cc_points: usize,
    /// Those without a pose.
    pub left_out: Vec<LeftOut>,
    /// CC points at which the search proves only a larger width than requested.
    pub widened: Option<Widened>,
}

impl PassesBetween {
    /// Adds passes between those of an operation; `cut` has all cuts of its head, in cutting order,
    /// with their postures, and `high` the places where the text of such cuts has left too much.
    /// Each place of the pattern is treated by itself, because both heads may part there at other
    /// points.
    ///
    /// The passes are planned as the operation's own, with the other head at home. Passes of a path
    /// file get none between.
    ///
    /// # Errors
    /// Returns an error if the stages are cancelled.
    pub(crate) fn find(
        context: &SetupContext<'_>,
        operation: &OperationFile,
        (cut, high): (&[PassSegment], Option<&HighPlaces>),
        stages: &dyn Stages,
    ) -> Result<Self, Failure> {
        let (Some(strategy), Some(first)) = (strategy_of(operation), cut.first()) else { return Ok(Self::default()) };
        let mut cell = context.scene.workcell(operation, context.map);
        if cell.preferred_branch == BranchPreference::Nearest {
            cell.preferred_branch = match first.cuts[0].pose.configuration.branch {
                Branch::Positive => BranchPreference::Positive,
                Branch::Negative => BranchPreference::Negative,
            };
        }
        let (plain, cone) = (PoseTest::new(&cell), operation.search.singular_cone_deg.to_radians());
        let choosing = PoseTest::new(&cell).avoiding_pole(cone);
        let tests = Tests { choosing: &choosing, plain: &plain };
        let settings = pass_settings(operation);
        let detours = detours(&tests, context, operation, &settings, false);
        let extended = extended_region(context.scene.job, context.scene.setup, operation)?;
        let surface = surface_of(context.scene.setup, extended.as_deref());
        let interposer = Interposer { high, ..interposer(&detours, context, operation, strategy, surface) };
        let n_passes = cut.iter().map(|p| p.pass + 1).max().unwrap_or(0);
        let mut found = Self::default();
        for (copy, place) in places(operation.pattern.as_ref()).iter().enumerate() {
            let mut path = path_of(cut.iter().filter(|p| p.copy as usize == copy), place);
            let (n_before, mut extra) = (path.tasks.len(), ExtraPasses::default());
            interposer.keep_cusp(&mut path, CutOrder::Last, &mut extra, stages)?;
            found.extra.between = found.extra.between.max(extra.between);
            found.extra.refused.extend(extra.refused);
            let (tasks, outcomes) = (path.tasks.split_off(n_before), path.outcomes.split_off(n_before));
            if tasks.is_empty() {
                continue;
            }
            let n_points = tasks.iter().map(|t| t.pass.points.len()).sum();
            let monitor = stages.start(PLACES, n_points);
            let (tasks, mut outcomes) =
                copy_outcomes(tests.of(&settings), &tasks, &outcomes, place, &settings, &*monitor)?;
            tests.at_pole(&tasks, &settings, &mut outcomes);
            found.cc_points += n_points;
            let pieces = split(tests.plain, &tasks, &outcomes, copy as u32, &mut found.left_out);
            found.pieces.extend(pieces.into_iter().map(|p| PassSegment { pass: n_passes + p.pass, ..p }));
        }
        let monitor = stages.start(BETWEEN, found.cc_points);
        let (fallback, linearity) = (settings.fallback(), cut_linearity(context.scene.job, operation));
        let pieces = std::mem::take(&mut found.pieces);
        let pieces = filled(&tests, &linearity, fallback, pieces, &mut found.left_out, &*monitor)?;
        found.pieces = wound(&plain, fallback, pieces, None);
        found.widened = tests.widened();
        Ok(found)
    }

    /// Adds the passes to the counts of their operation.
    pub(crate) fn count(self, operation: &mut PlannedOperation<'_>) {
        operation.extra.between += self.extra.between;
        operation.extra.refused.extend(self.extra.refused);
        let length = |piece: &PassSegment| -> f64 {
            piece.cuts.windows(2).map(|w| (w[1].cc.position - w[0].cc.position).norm()).sum()
        };
        operation.laid.length += self.pieces.iter().filter(|p| p.copy == 0).map(length).sum::<f64>();
        operation.cc_points += self.cc_points;
        operation.left_out.extend(self.left_out);
        let widened = [operation.widened, self.widened].into_iter().flatten();
        operation.widened = widened.reduce(Widened::plus);
    }
}

/// Returns pieces in one place of the pattern as passes in the first place, with their postures.
fn path_of<'p>(pieces: impl Iterator<Item = &'p PassSegment>, place: &Isometry3<f64>) -> PlannedPath {
    let to_first = place.inverse();
    let mut path = PlannedPath { tasks: Vec::new(), outcomes: Vec::new(), optimum: None };
    for piece in pieces {
        let cuts: Vec<_> = stations(piece).into_iter().map(|k| piece.cuts[k]).collect();
        let pass = Pass::new(cuts.iter().map(|c| c.cc.transformed(&to_first)).collect());
        path.tasks.push(LaidTask { pass, uncut_left: piece.uncut_left, curve: piece.curve, given: Vec::new() });
        let outcomes: Vec<Outcome> = cuts.iter().map(|c| Ok(c.pose)).collect();
        path.outcomes.push(Pass::new(outcomes));
    }
    path
}

#[cfg(test)]
#[path = "../../tests/unit/dual/passes_between.rs"]
mod tests;
