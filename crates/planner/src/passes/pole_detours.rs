//! Other postures for passes that lose time to the rotary axes, most of all beside their pole,
//! judged by the time that the axes really need.
//!
//! The cost of a sequence of postures counts speeds; the time of a pass also depends on
//! accelerations and jerks, and these slow the tip. Passes that lose much to them are therefore
//! planned again, calmer and farther from the pole, or with one direction of the tool throughout,
//! and the machine's motion law decides which plan is used.

#[cfg(test)]
#[path = "../../tests/unit/passes/pole_detours/laws.rs"]
mod laws;

use facemill_cl_data::{Cancelled, CcPoint, Pass, Posture};
use facemill_cutter_location::{
    AxisTarget, Outcome, PassSettings, PassTask, PlannedPass, PoseTest, PostureMode, plan_passes, steps_beyond_limits,
};
use facemill_feedrate::ProgramBlock;
use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine};
use facemill_job::failure::Failure;
use facemill_job::stages::{DETOURS, Stages};
use facemill_nc_program::dialect::ControlMotion;
use facemill_tool_model::{Cusp, Outline, cusp_height_between};
use facemill_tool_path::segments::LaidTask;
use facemill_tool_path::segments::pole::Tests;
use facemill_virtual_machine::program_time::run::{MotionRun, Timer};
use nalgebra::{Unit, Vector3};
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

/// Directions of the tool at rest that are tried for a pass, in tilt and in rotate.
const DIRECTIONS: usize = 9;

/// Reason to plan a pass again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Loss {
    /// It comes beside the pole.
    BesidePole,
    /// Rotary axes slow it elsewhere.
    RotaryAxes,
}

/// Rotary axes as a pass is timed.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Rotaries {
    AsPlanned,
    /// At rest where each run begins, with the tip on its path.
    AtRest,
}

/// Replanner of passes that lose time to the rotary axes, and judge of the plans.
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
    /// Whether passes away from the pole are planned again, too: not where turns join neighbours,
    /// for which their postures have to agree, nor for pairs, whose postures are chosen together.
    pub(crate) everywhere: bool,
}

/// Alternative choice of the postures of a pass.
struct Alternative {
    cone: f64,
    settings: PassSettings,
    /// Losses against which it may help.
    against: &'static [Loss],
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
    /// Plans the passes again that lose more than a tenth of their time to the rotary axes, and
    /// uses the faster plans.
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
        let losses: Vec<Option<Loss>> =
            tasks.par_iter().zip(&*planned).map(|(task, own)| judge.loss(task, &own.outcomes)).collect();
        if losses.iter().all(Option::is_none) {
            return Ok(());
        }
        let mut better = |again: &[usize], found: Vec<PlannedPass>| {
            let is_better: Vec<bool> = again
                .par_iter()
                .zip(&found)
                .map(|(&k, found)| judge.is_better(&tasks[k], &planned[k].outcomes, &found.outcomes))
                .collect();
            for ((&k, found), _) in again.iter().zip(found).zip(is_better).filter(|(_, better)| *better) {
                planned[k] = self.counted_again(&tasks[k], found);
            }
        };
        for Alternative { cone, settings, against } in self.alternatives() {
            let helps = |k: &usize| losses[*k].is_some_and(|loss| against.contains(&loss));
            let again: Vec<usize> = (0..tasks.len()).filter(helps).collect();
            let test = PoseTest::new(self.tests.plain.cell).avoiding_pole(cone);
            let to_plan: Vec<PassTask> = again.iter().map(|&k| tasks[k].clone()).collect();
            let monitor = stages.start(DETOURS, to_plan.iter().map(|t| t.pass.points.len()).sum());
            better(&again, plan_passes(&test, &to_plan, &settings, &*monitor)?);
        }
        if !self.everywhere {
            return Ok(());
        }
        let losing: Vec<usize> = (0..tasks.len()).filter(|&k| losses[k].is_some()).collect();
        let monitor = stages.start(DETOURS, losing.iter().map(|&k| tasks[k].pass.points.len()).sum());
        let at_rest = |&k: &usize| match direction_within_ranges(&tasks[k]) {
            Some(direction) => {
                let mode = PostureMode::Toward(AxisTarget::Direction(direction));
                let settings = PassSettings { mode, ..*self.settings };
                let found = plan_passes(self.tests.choosing, &tasks[k..=k], &settings, &*monitor)?;
                Ok(found.into_iter().next().map(|found| (k, found)))
            }
            None => Ok(None),
        };
        let at_rest: Result<Vec<_>, Cancelled> = losing.par_iter().map(at_rest).collect();
        let (again, found): (Vec<usize>, Vec<PlannedPass>) = at_rest?.into_iter().flatten().unzip();
        better(&again, found);
        Ok(())
    }

    /// Returns the time of passes with their entries, exits and links, s: of the steps by the
    /// machine's motion law, at least that of the programmed feed. An estimate for comparing paths.
    pub(crate) fn time_of(&self, tasks: &[LaidTask], outcomes: &[Pass<Outcome>]) -> f64 {
        let views = self.views();
        let timer = self.timer(&views);
        let judge = Judge { detours: self, timer: timer.as_ref() };
        let of_pass = |(task, outcomes): (&LaidTask, &Pass<Outcome>)| {
            let times = judge.times(&task.pass.points, outcomes, Rotaries::AsPlanned);
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
        let calm = |against| Alternative { cone: own_cone, settings: calmer, against };
        let wider = |settings: PassSettings| {
            let cones = CONES.into_iter().filter(move |cone| *cone > own_cone);
            cones.map(move |cone| Alternative { cone, settings, against: &[Loss::BesidePole] })
        };
        match self.settings.mode {
            // A sequence for the whole pass leaves the pole by itself, as far as its layers see it.
            PostureMode::Smooth(_) => {
                std::iter::once(calm(&[Loss::BesidePole, Loss::RotaryAxes])).chain(wider(calmer).take(1)).collect()
            }
            _ => wider(*self.settings).chain([calm(&[Loss::RotaryAxes])]).collect(),
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
            match cusp_height_between(&outline, &outline, strip.step_over, &strip.curvature) {
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

/// Returns a direction of the tool that is a posture within the search's ranges at every point of a
/// pass: of those seen from its middle the one with the smallest tilt there; `None` if there is
/// none.
fn direction_within_ranges(task: &PassTask) -> Option<Unit<Vector3<f64>>> {
    let points = &task.pass.points;
    let middle = points.get(points.len() / 2)?;
    let (start, end) = (task.curve.start(), task.curve.end());
    let part = |from: f64, to: f64, k: usize| from + (to - from) * k as f64 / (DIRECTIONS - 1) as f64;
    let is_within = |axis: &Unit<Vector3<f64>>| {
        points.iter().all(|cc| {
            let posture = cc.posture_of(axis);
            let [low, high] = [start.rotate.min(end.rotate), start.rotate.max(end.rotate)];
            let tilts = start.tilt - ROUNDING..=end.tilt + ROUNDING;
            let rotates = low - ROUNDING..=high + ROUNDING;
            tilts.contains(&posture.tilt) && (posture.tilt < ROUNDING || rotates.contains(&posture.rotate))
        })
    };
    let all = (0..DIRECTIONS * DIRECTIONS).map(|k| Posture {
        tilt: part(start.tilt, end.tilt, k / DIRECTIONS),
        rotate: part(start.rotate, end.rotate, k % DIRECTIONS),
    });
    all.map(|posture| middle.tool_axis(posture)).find(is_within)
}

/// Excess over a range that is rounding, rad.
const ROUNDING: f64 = 1e-9;

/// Judge of plans by their times.
struct Judge<'j, 'd, 'a> {
    detours: &'j Detours<'d, 'a>,
    /// The machine's law; `None` if its file lacks a limit: then only largest velocities count.
    timer: Option<&'j Timer<'j>>,
}

impl Judge<'_, '_, '_> {
    /// Returns the reason to plan a pass again: it comes beside the pole and loses enough, because
    /// a gain there may be lost farther on, or it loses that much to the rotary axes elsewhere.
    fn loss(&self, task: &PassTask, outcomes: &Pass<Outcome>) -> Option<Loss> {
        let times = |rotaries| self.times(&task.pass.points, outcomes, rotaries);
        let sum = |times: &[f64]| times.iter().sum::<f64>();
        let planned = times(Rotaries::AsPlanned);
        let (needed, programmed) = (sum(&planned.needed), sum(&planned.programmed));
        if needed <= (1.0 + WORTH) * programmed {
            return None;
        }
        if outcomes.points.iter().any(|o| self.detours.is_beside_pole(o)) {
            return Some(Loss::BesidePole);
        }
        // By velocities alone, rotary axes hardly hold up a pass away from the pole.
        if !self.detours.everywhere || self.timer.is_none() {
            return None;
        }
        (needed > sum(&times(Rotaries::AtRest).needed) + WORTH * programmed).then_some(Loss::RotaryAxes)
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
        let [own, other] = [own, other].map(|outcomes| self.times(&task.pass.points, outcomes, Rotaries::AsPlanned));
        let [needed, other_needed, programmed] =
            [&own.needed, &other.needed, &own.programmed].map(|t| t.iter().sum::<f64>());
        other.runs <= own.runs && other_needed + other_between + WORTH * programmed < needed + own_between
    }

    /// Returns the times of a pass's steps, each run of poses from rest to rest. An estimate: poses
    /// between points are still to be inserted.
    fn times(&self, points: &[CcPoint], outcomes: &Pass<Outcome>, rotaries: Rotaries) -> StepTimes {
        let n_steps = points.len().saturating_sub(1);
        let mut times = StepTimes { programmed: vec![0.0; n_steps], needed: vec![0.0; n_steps], runs: 0 };
        let mut run: Vec<AxisValues> = Vec::new();
        for k in 0..points.len() {
            let Ok(pose) = &outcomes.points[k] else {
                self.end_run(k, &mut run, rotaries, &mut times);
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
                None => self.end_run(k, &mut run, rotaries, &mut times),
            }
            run.push(goes_on.unwrap_or(here));
        }
        self.end_run(points.len(), &mut run, rotaries, &mut times);
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
    fn end_run(&self, end: usize, run: &mut Vec<AxisValues>, rotaries: Rotaries, times: &mut StepTimes) {
        let mut positions = std::mem::take(run);
        if rotaries == Rotaries::AtRest {
            self.hold_rotaries(&mut positions);
        }
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

    /// Turns the rotary axes of positions back to where they are at the first, with the tip where
    /// it was.
    fn hold_rotaries(&self, positions: &mut [AxisValues]) {
        let (machine, length) = (self.detours.machine(), self.detours.tests.plain.cell.tool.gauge_length());
        let Some(first) = positions.first().copied() else { return };
        for at in positions {
            let tip = machine.cl_point(at, length).tip;
            *at = machine.with_tip_at(&first, &tip, length).unwrap_or(*at);
        }
    }

    /// Returns the time of the slowest axis at its largest velocity, s.
    fn least_time(&self, ends: &[AxisValues]) -> f64 {
        let axes = self.detours.machine().axes().iter().enumerate();
        axes.map(|(k, axis)| (ends[1][k] - ends[0][k]).abs() / axis.max_velocity).fold(0.0, f64::max)
    }
}
