//! Poses of an operation's passes in the first place of the pattern.

use facemill_cl_data::Pass;
use facemill_cutter_location::cusp::neighbours::{Neighbours, OwnPlace};
use facemill_cutter_location::{Optimum, Outcome, PassSettings, plan_passes};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::{LinkingFile, OperationFile, PathFile, PathFromStrategy};
use facemill_job::setup::cell::{LEAST_STEP, pass_settings};
use facemill_job::setup::path::LaidPath;
use facemill_job::stages::{POSTURES, Stages};
use facemill_surface_model::Surface;
use facemill_tool_path::moves::lead::CutRegion;
use facemill_tool_path::segments::LaidTask;
use facemill_tool_path::segments::pole::Tests;

use crate::passes::engagement::neighbour_reach;
use crate::passes::extra_passes::{AddedPasses, CutOrder, ExtraPasses, Interposer, PlannedPath, as_laid, pass_tasks};
use crate::passes::high_places::HighPlaces;
use crate::passes::island_passes::IslandSettings;
use crate::passes::left_gaps::LeftGaps;
use crate::passes::operation::{LaidFigures, may_be_corrected};
use crate::passes::pole_detours::Detours;
use crate::passes::setup_context::SetupContext;

/// Planner of the poses of an operation's passes in the first place of the pattern.
pub(crate) struct PathPlanner<'p, 'a> {
    pub(crate) tests: &'p Tests<'a>,
    pub(crate) context: &'p SetupContext<'p>,
    pub(crate) operation: &'p OperationFile,
    pub(crate) stages: &'p dyn Stages,
    /// Surface that the passes lie on.
    pub(crate) surface: &'p Surface,
    /// Places where a text with these passes has left too much.
    pub(crate) high: Option<&'p HighPlaces>,
}

impl PathPlanner<'_, '_> {
    /// Returns the poses of passes, replanned beside the pole, without added passes.
    ///
    /// # Errors
    /// If the stages are cancelled.
    pub(crate) fn posed(&self, tasks: &[LaidTask]) -> Result<PlannedPath, Failure> {
        let settings = pass_settings(self.operation);
        let test = self.tests.of(&settings);
        let reach = neighbour_reach(test.cell.tool.cutter(), self.operation);
        let laid = Neighbours::new(tasks.iter().map(as_laid).collect(), reach);
        let to_plan = pass_tasks(tasks, |pass, point| laid.of(OwnPlace { pass, point }).strip());
        let monitor = self.stages.start(POSTURES, tasks.iter().map(|t| t.pass.points.len()).sum());
        let mut planned = plan_passes(test, &to_plan, &settings, &*monitor)?;
        drop(monitor);
        self.detours(&settings).take(&to_plan, &mut planned, self.stages)?;
        let optimum = planned.iter().filter_map(|p| p.optimum).reduce(Optimum::plus);
        let mut outcomes: Vec<Pass<Outcome>> = planned.into_iter().map(|p| p.outcomes).collect();
        self.tests.at_pole(tasks, &settings, &mut outcomes);
        Ok(PlannedPath { tasks: tasks.to_vec(), outcomes, optimum })
    }

    /// Adds passes to those of a strategy where they are trimmed or leave too much.
    ///
    /// # Errors
    /// If the stages are cancelled.
    pub(crate) fn add_passes(&self, path: &mut PlannedPath) -> Result<ExtraPasses, Failure> {
        let Some(strategy) = strategy_of(self.operation) else { return Ok(ExtraPasses::default()) };
        let settings = pass_settings(self.operation);
        let detours = self.detours(&settings);
        let interposer = self.interposer(&detours, strategy);
        interposer.improve(path, self.context.added, self.stages)
    }

    /// Adds passes to planned ones where they leave too much, without moving any.
    ///
    /// # Errors
    /// If the stages are cancelled.
    pub(crate) fn keep_cusp(&self, path: &mut PlannedPath, extra: &mut ExtraPasses) -> Result<(), Failure> {
        let Some(strategy) = strategy_of(self.operation) else { return Ok(()) };
        let settings = pass_settings(self.operation);
        let detours = self.detours(&settings);
        let interposer = self.interposer(&detours, strategy);
        interposer.keep_cusp(path, CutOrder::InStrip, extra, self.stages)
    }

    /// Adds passes, to be cut last, over the high places that lie in no strip between two others.
    ///
    /// # Errors
    /// If the stages are cancelled.
    pub(crate) fn add_over_islands(
        &self,
        region: &dyn CutRegion,
        path: &mut PlannedPath,
        extra: &mut ExtraPasses,
    ) -> Result<(), Failure> {
        let Some(strategy) = strategy_of(self.operation) else { return Ok(()) };
        let settings = pass_settings(self.operation);
        let detours = self.detours(&settings);
        let interposer = self.interposer(&detours, strategy);
        let tolerances = &self.operation.tolerances;
        let (step, most_step_over) = (tolerances.max_step_mm, tolerances.max_step_over_mm);
        let islands = IslandSettings { region, step, most_step_over };
        let over = interposer.over_islands(path, islands, extra, self.stages)?;
        if extra.over > 0 {
            *path = path.with(&over).0;
        }
        Ok(())
    }

    /// Returns the figures of passes as laid and as planned; times are estimated only where rounds
    /// of laying are compared.
    pub(crate) fn figures(&self, laid: &LaidPath, planned: &PlannedPath) -> LaidFigures {
        let length =
            |t: &LaidTask| -> f64 { t.pass.points.windows(2).map(|w| (w[1].position - w[0].position).norm()).sum() };
        let points = planned.tasks.iter().zip(&planned.outcomes).flat_map(|(t, o)| t.pass.points.iter().zip(&o.points));
        let without_posture = points.filter(|(_, outcome)| outcome.is_err());
        let time = |settings| self.detours(settings).time_of(&planned.tasks, &planned.outcomes);
        LaidFigures {
            passes: laid.tasks.len(),
            length: planned.tasks.iter().map(length).sum(),
            time: if may_be_corrected(self.operation) { time(&pass_settings(self.operation)) } else { 0.0 },
            without_posture: without_posture.map(|(cc, _)| cc.position).collect(),
        }
    }

    fn interposer<'d>(&'d self, detours: &'d Detours<'d, 'd>, strategy: &PathFromStrategy) -> Interposer<'d, 'd> {
        let interposer = interposer(detours, self.context, self.operation, strategy, self.surface);
        Interposer { high: self.high, ..interposer }
    }

    fn detours<'d>(&'d self, settings: &'d PassSettings) -> Detours<'d, 'd> {
        let adds_passes = strategy_of(self.operation).is_some() && self.context.added == AddedPasses::All;
        detours(self.tests, self.context, self.operation, settings, adds_passes)
    }
}

/// Returns the strategy that generates an operation's passes; `None` if they are cut unchanged:
/// those of a file, and of a level, whose pieces end where the part is in the way.
pub(crate) fn strategy_of(operation: &OperationFile) -> Option<&PathFromStrategy> {
    match &operation.path {
        PathFile::Strategy(strategy) if operation.levels.is_none() => Some(strategy),
        _ => None,
    }
}

/// Returns the replanning of an operation's passes beside the pole.
pub(crate) fn detours<'d, 'a>(
    tests: &'d Tests<'a>,
    context: &'d SetupContext<'_>,
    operation: &OperationFile,
    settings: &'d PassSettings,
    adds_passes: bool,
) -> Detours<'d, 'a> {
    let is_alone = context.added == AddedPasses::All;
    let is_joined = strategy_of(operation).is_some_and(|s| s.linking == LinkingFile::Zigzag);
    Detours {
        tests,
        settings,
        control: &context.scene.job.post.rules().control_motion,
        feed: operation.feeds.cutting_mm_min / 60.0,
        cusp: operation.tolerances.cusp_mm,
        adds_passes,
        everywhere: is_alone && !is_joined,
    }
}

/// Returns the insertion of passes between those of an operation.
pub(crate) fn interposer<'d, 'a>(
    detours: &'d Detours<'d, 'a>,
    context: &'d SetupContext<'_>,
    operation: &OperationFile,
    strategy: &PathFromStrategy,
    surface: &'d Surface,
) -> Interposer<'d, 'a> {
    Interposer {
        tests: detours.tests,
        settings: detours.settings,
        detours,
        reach: neighbour_reach(detours.tests.plain.cell.tool.cutter(), operation),
        surface,
        allowance: context.scene.setup.drive_allowance,
        cusp: operation.tolerances.cusp_mm,
        gaps: LeftGaps::of(context.scene.setup, operation),
        high: None,
        by_text: may_be_corrected(operation),
        least_step: LEAST_STEP * operation.tolerances.max_step_over_mm,
        longest_gap: 2.0 * operation.tolerances.max_step_mm,
        least_length: strategy.min_pass_length_mm,
    }
}
