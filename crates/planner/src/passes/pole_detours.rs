//! Other postures for passes that lose time beside the pole of the rotary axes, judged by the time
//! that the axes really need.
//!
//! The cost of a sequence of postures counts speeds; the time of a pass also depends on
//! accelerations and jerks, and beside the pole these slow the tip. Passes that lose much there are
//! therefore planned again, calmer and farther from the pole, and the machine's motion law decides
//! which plan is used.

#[cfg(test)]
#[path = "../../tests/unit/passes/pole_detours/laws.rs"]
mod laws;

use facemill_cl_data::{CcPoint, Pass};
use facemill_cutter_location::{
    Outcome, PassSettings, PassTask, PlannedPass, PoseTest, PostureMode, plan_passes, steps_beyond_limits,
};
use facemill_feedrate::ProgramBlock;
use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine};
use facemill_job::failure::Failure;
use facemill_job::stages::{DETOURS, Stages};
use facemill_nc_program::ControlMotion;
use facemill_tool_model::{Cusp, Outline, cusp_height_between};
use facemill_tool_path::segments::LaidTask;
use facemill_tool_path::segments::pole::Tests;
use facemill_virtual_machine::program_time::run::{MotionRun, Timer};
use rayon::prelude::*;

/// Angle to the pole within which lost time is attributed to it, rad: farther away the first rotary
/// axis turns less than six times as fast as the tool axis. Larger: passes without possible gain
/// are planned again.
pub(crate) const BESIDE_POLE: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// Fraction of a pass's time at the programmed feed that must be lost before other plans are tried,
/// and that another plan must win. Smaller: more planning for less.
const WORTH: f64 = 0.1;

/// Fraction of the largest turn along the pass that a calmer plan keeps. Postures are then chosen
/// at points four times as far apart, and faster changes are smoothed away.
const CALMER: f64 = 0.25;

/// Wider cones about the pole, rad: the axis turns a third, a ninth as fast as at the border of the
/// default one.
const CONES: [f64; 2] = [3.0 * std::f64::consts::PI / 180.0, 9.0 * std::f64::consts::PI / 180.0];

/// Number of passes that an uncut strip counts for.
const PASSES_IN_UNCUT: f64 = 8.0;

/// Least time of a pass's entry, exit and link, s: it is 11 s on the example patch of 400 mm, 15 s
/// on the example propeller. Larger: plans stay that lose more beside the pole; smaller: passes are
/// inserted for less than they cost.
const BETWEEN_PASSES: f64 = 10.0;

/// Replanner of passes beside the pole, and judge of the plans.
pub(crate) struct Detours<'d, 'a> {
    pub(crate) tests: &'d Tests<'a>,
    pub(crate) settings: &'d PassSettings,
    pub(crate) control: &'d ControlMotion,
    /// Programmed feed, mm/s.
    pub(crate) feed: f64,
    /// Permitted cusp, mm.
    pub(crate) cusp: f64,
    /// Whether passes are inserted where a cusp is too high: then it costs their time; else no
    /// other plan may raise it.
    pub(crate) adds_passes: bool,
}

/// Alternative choice of the postures of a pass.
struct Alternative {
    cone: f64,
    settings: PassSettings,
}

/// Times of the steps of a pass, s; 0 for a step without a pose at an end.
struct StepTimes {
    /// At the programmed feed.
    programmed: Vec<f64>,
    /// By the machine's motion law.
    needed: Vec<f64>,
    /// Runs of poses without reversals or changes of branch.
    runs: usize,
}

impl Detours<'_, '_> {
    /// Plans the passes again that come beside the pole and lose more than a tenth of their time,
    /// and uses the faster plans.
    ///
    /// Replaces a pass only if the other plan omits no point of the pass, and has no more parts.
    /// All others stay unchanged. Does not depend on the number of threads.
    ///
    /// # Errors
    /// If the stages are cancelled.
    pub(crate) fn take(
        &self,
        tasks: &[PassTask],
        planned: &mut [PlannedPass],
        stages: &dyn Stages,
    ) -> Result<(), Failure> {
        // A proof on the search concerns all its tests together.
        if self.settings.fallback().is_none() || self.settings.search.certified.is_some() {
            return Ok(());
        }
        let views = self.views();
        let timer = self.timer(&views);
        let judge = Judge { detours: self, timer: timer.as_ref() };
        let loses: Vec<bool> =
            tasks.par_iter().zip(&*planned).map(|(task, own)| judge.loses_beside_pole(task, &own.outcomes)).collect();
        let losing: Vec<usize> = (0..tasks.len()).filter(|&k| loses[k]).collect();
        if losing.is_empty() {
            return Ok(());
        }
        let again: Vec<PassTask> = losing.iter().map(|&k| tasks[k].clone()).collect();
        for Alternative { cone, settings } in self.alternatives() {
            let test = PoseTest::new(self.tests.plain.cell).avoiding_pole(cone);
            let monitor = stages.start(DETOURS, again.iter().map(|t| t.pass.points.len()).sum());
            let found = plan_passes(&test, &again, &settings, &*monitor)?;
            drop(monitor);
            let better: Vec<bool> = losing
                .par_iter()
                .zip(&found)
                .map(|(&k, found)| judge.is_better(&tasks[k], &planned[k].outcomes, &found.outcomes))
                .collect();
            for ((&k, found), _) in losing.iter().zip(found).zip(better).filter(|(_, better)| *better) {
                planned[k] = self.counted_again(&tasks[k], found);
            }
        }
        Ok(())
    }

    /// Returns the time of passes with their entries, exits and links, s: of the steps by the
    /// machine's motion law, at least that of the programmed feed. An estimate for comparing paths.
    pub(crate) fn time_of(&self, tasks: &[LaidTask], outcomes: &[Pass<Outcome>]) -> f64 {
        let views = self.views();
        let timer = self.timer(&views);
        let judge = Judge { detours: self, timer: timer.as_ref() };
        let of_pass = |(task, outcomes): (&LaidTask, &Pass<Outcome>)| {
            let times = judge.times(&task.pass.points, outcomes);
            let steps = times.needed.iter().zip(&times.programmed).map(|(needed, programmed)| needed.max(*programmed));
            steps.sum::<f64>() + BETWEEN_PASSES * times.runs as f64
        };
        let times: Vec<f64> = tasks.par_iter().zip(outcomes).map(of_pass).collect();
        times.iter().sum()
    }

    fn views(&self) -> [(&Machine, f64); 1] {
        [(self.machine(), self.tests.plain.cell.tool.gauge_length())]
    }

    /// Returns the timer of the machine's motion law; `None` if its file lacks a limit.
    fn timer<'t>(&'t self, views: &'t [(&'t Machine, f64); 1]) -> Option<Timer<'t>> {
        let timer = Timer::new(views, self.machine().motion_law().control_tolerance).ok();
        timer.map(|timer| timer.without_limits().on_control(self.control))
    }

    fn machine(&self) -> &Machine {
        self.tests.plain.cell.machine
    }

    /// Returns the plans to try besides the job's own: none lets the tool turn faster or come
    /// nearer to the pole than that.
    fn alternatives(&self) -> Vec<Alternative> {
        let own_cone = self.tests.choosing.pole_cone();
        let calmer = PassSettings { max_turn_per_mm: CALMER * self.settings.max_turn_per_mm, ..*self.settings };
        let wider = |settings: PassSettings| {
            let cones = CONES.into_iter().filter(move |cone| *cone > own_cone);
            cones.map(move |cone| Alternative { cone, settings })
        };
        match self.settings.mode {
            // A sequence for the whole pass leaves the pole by itself, as far as its layers see it.
            PostureMode::Smooth(_) => {
                let own = Alternative { cone: own_cone, settings: calmer };
                std::iter::once(own).chain(wider(calmer).take(1)).collect()
            }
            _ => wider(*self.settings).collect(),
        }
    }

    /// Returns a pass planned within other limits, with the count of steps beyond those of the job.
    fn counted_again(&self, task: &PassTask, mut found: PlannedPass) -> PlannedPass {
        if let Some(optimum) = &mut found.optimum {
            let limits = (self.settings.max_turn_per_mm, self.feed);
            optimum.jumps = steps_beyond_limits(self.machine(), &task.pass, &found.outcomes.points, limits);
        }
        found
    }

    /// Returns whether a pose is beside the pole.
    fn is_beside_pole(&self, outcome: &Outcome) -> bool {
        let Ok(pose) = outcome else { return false };
        let cl = pose.cl.transformed(&self.tests.plain.cell.table_from_work);
        self.machine().angle_to_singular(&cl).is_some_and(|angle| angle < BESIDE_POLE)
    }

    /// Returns the time of the passes to insert beside a pass for its postures, s, with their
    /// entries, exits and links: as many as keep each strip's cusp, which falls with the square of
    /// its width.
    fn between(&self, task: &PassTask, outcomes: &Pass<Outcome>) -> f64 {
        let cutter = self.tests.plain.cell.tool.cutter();
        let passes = |k: usize| {
            let (Some(Some(strip)), Some(Ok(pose))) = (task.strips.get(k), outcomes.points.get(k)) else { return 0.0 };
            let outline = Outline::new(cutter, pose.posture);
            match cusp_height_between(&outline, &outline, strip.step_over, strip.curvature) {
                Cusp::Height(height) => ((height / self.cusp).sqrt().ceil() - 1.0).clamp(0.0, PASSES_IN_UNCUT),
                Cusp::Uncut => PASSES_IN_UNCUT,
            }
        };
        let points = &task.pass.points;
        let passes: Vec<f64> = (0..points.len()).map(passes).collect();
        let steps: Vec<f64> = points.windows(2).map(|ends| self.programmed(ends)).collect();
        time_between(&passes, &steps)
    }

    /// Returns the time of a step at the programmed feed, s.
    fn programmed(&self, ends: &[CcPoint]) -> f64 {
        (ends[1].position - ends[0].position).norm() / self.feed
    }
}

/// Returns the time of inserted passes, s: so many at each point, with the times of the steps from
/// point to point.
fn time_between(passes: &[f64], steps: &[f64]) -> f64 {
    let along: f64 = passes.windows(2).zip(steps).map(|(ends, step)| step * ends[0].max(ends[1])).sum();
    // Where more are needed than at the point before, some begin.
    let before = std::iter::once(&0.0).chain(passes);
    let begin: f64 = passes.iter().zip(before).map(|(here, before)| (here - before).max(0.0)).sum();
    along + BETWEEN_PASSES * begin
}

/// Judge of plans by their times.
struct Judge<'j, 'd, 'a> {
    detours: &'j Detours<'d, 'a>,
    /// The machine's law; `None` if its file lacks a limit: then only largest velocities count.
    timer: Option<&'j Timer<'j>>,
}

impl Judge<'_, '_, '_> {
    /// Returns whether a pass comes beside the pole and loses enough for a second plan: a gain
    /// there may be lost farther on.
    fn loses_beside_pole(&self, task: &PassTask, outcomes: &Pass<Outcome>) -> bool {
        if !outcomes.points.iter().any(|o| self.detours.is_beside_pole(o)) {
            return false;
        }
        let times = self.times(&task.pass.points, outcomes);
        let [needed, programmed] = [&times.needed, &times.programmed].map(|t| t.iter().sum::<f64>());
        needed > (1.0 + WORTH) * programmed
    }

    /// Returns whether another plan omits no point of the pass, has no more parts, and takes less
    /// time, including that of inserted passes.
    fn is_better(&self, task: &PassTask, own: &Pass<Outcome>, other: &Pass<Outcome>) -> bool {
        if own.points.iter().zip(&other.points).any(|(own, other)| own.is_ok() && other.is_err()) {
            return false;
        }
        let [own_between, other_between] = [own, other].map(|outcomes| self.detours.between(task, outcomes));
        if other_between > own_between && !self.detours.adds_passes {
            return false;
        }
        let [own, other] = [own, other].map(|outcomes| self.times(&task.pass.points, outcomes));
        let [needed, other_needed, programmed] =
            [&own.needed, &other.needed, &own.programmed].map(|t| t.iter().sum::<f64>());
        other.runs <= own.runs && other_needed + other_between + WORTH * programmed < needed + own_between
    }

    /// Returns the times of a pass's steps, each run of poses from rest to rest. An estimate: poses
    /// between points are still to be inserted.
    fn times(&self, points: &[CcPoint], outcomes: &Pass<Outcome>) -> StepTimes {
        let n_steps = points.len().saturating_sub(1);
        let mut times = StepTimes { programmed: vec![0.0; n_steps], needed: vec![0.0; n_steps], runs: 0 };
        let mut run: Vec<AxisValues> = Vec::new();
        for k in 0..points.len() {
            let Ok(pose) = &outcomes.points[k] else {
                self.end_run(k, &mut run, &mut times);
                continue;
            };
            let here = pose.configuration.axes;
            let is_same_branch = |before: usize| {
                let branch = outcomes.points[before].as_ref().map(|p| p.configuration.branch);
                branch.is_ok_and(|branch| branch == pose.configuration.branch)
            };
            let goes_on = run.last().and_then(|last| self.wound(last, &here)).filter(|_| is_same_branch(k - 1));
            match goes_on {
                Some(_) => times.programmed[k - 1] = self.detours.programmed(&points[k - 1..=k]),
                None => self.end_run(k, &mut run, &mut times),
            }
            run.push(goes_on.unwrap_or(here));
        }
        self.end_run(points.len(), &mut run, &mut times);
        times
    }

    /// Returns a position with endless axes turned to values nearest to those of the one before;
    /// `None` if an axis with stops must turn back.
    fn wound(&self, before: &AxisValues, at: &AxisValues) -> Option<AxisValues> {
        let axes = self.detours.machine().axes();
        let mut near = *at;
        for (k, axis) in axes.iter().enumerate() {
            let turns = ((at[k] - before[k]) / std::f64::consts::TAU).round();
            if axis.has_no_stops() {
                near[k] = at[k] - turns * std::f64::consts::TAU;
            } else if axis.kind == AxisKind::Rotary && turns != 0.0 {
                return None;
            }
        }
        Some(near)
    }

    /// Times the run of positions that ends before point `end`.
    fn end_run(&self, end: usize, run: &mut Vec<AxisValues>, times: &mut StepTimes) {
        let positions = std::mem::take(run);
        let Some((start, rest)) = positions.split_first() else { return };
        times.runs += 1;
        let first = end - positions.len();
        let steps = first..first + rest.len();
        let programmed = &times.programmed[steps.clone()];
        let block = |(end, programmed): (&AxisValues, &f64)| ProgramBlock {
            end: *end,
            tip_time: *programmed,
            exact_stop: false,
        };
        let blocks: Vec<ProgramBlock> = rest.iter().zip(programmed).map(block).collect();
        let run = MotionRun { start: *start, blocks, is_rapid: false, vectors: Vec::new() };
        let by_law = self.timer.and_then(|timer| timer.time(&run).ok()).map(|law| law.times);
        let at_velocities =
            || positions.windows(2).zip(programmed).map(|(ends, programmed)| self.least_time(ends).max(*programmed));
        let needed = by_law.unwrap_or_else(|| at_velocities().collect());
        times.needed[steps].copy_from_slice(&needed);
    }

    /// Returns the time of the slowest axis at its largest velocity, s.
    fn least_time(&self, ends: &[AxisValues]) -> f64 {
        let axes = self.detours.machine().axes().iter().enumerate();
        axes.map(|(k, axis)| (ends[1][k] - ends[0][k]).abs() / axis.max_velocity).fold(0.0, f64::max)
    }
}
