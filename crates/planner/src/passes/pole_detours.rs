//! Other postures for passes that lose time beside the pole of the rotary axes, judged by the time
//! that the axes really need.
//!
//! The cost of a sequence of postures counts speeds; how long a pass takes is decided by
//! accelerations and jerks, too, and beside the pole they are what holds the tip back. So passes
//! that lose much there are planned again, calmer and farther from the pole, and the machine's law
//! of motion decides which way is taken.

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
use facemill_tool_path::pieces::pole::Tests;
use facemill_virtual_machine::program_time::run::{Run, Timer};
use rayon::prelude::*;

/// Angle to the pole within which lost time is put down to it, rad: farther away the first rotary
/// axis turns less than six times as fast as the tool axis. Larger: passes that have nothing to win
/// are planned again.
pub(crate) const BESIDE_POLE: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// Part of a pass's time at the programmed feed that is lost before other ways are tried, and that
/// another way has to win. Smaller: more planning for less.
const WORTH: f64 = 0.1;

/// Part of the largest turn along the pass that a calmer way keeps to. Postures are then chosen at
/// points four times as far apart, and what changes faster is smoothed away.
const CALMER: f64 = 0.25;

/// Wider cones about the pole, rad: the axis turns a third, a ninth as fast as at the border of the
/// default one.
const CONES: [f64; 2] = [3.0 * std::f64::consts::PI / 180.0, 9.0 * std::f64::consts::PI / 180.0];

/// Passes that an uncut strip counts for.
const PASSES_IN_UNCUT: f64 = 8.0;

/// Least time of a pass's entry, exit and link, s: it is 11 s on the example patch of 400 mm, 15 s
/// on the example propeller. Larger: ways stay that lose more beside the pole; smaller: passes are
/// put between for less than they cost.
const BETWEEN_PASSES: f64 = 10.0;

/// Plans passes beside the pole again, and judges the ways.
pub(crate) struct Detours<'d, 'a> {
    pub(crate) tests: &'d Tests<'a>,
    pub(crate) settings: &'d PassSettings,
    pub(crate) control: &'d ControlMotion,
    /// Programmed feed, mm/s.
    pub(crate) feed: f64,
    /// Allowed cusp, mm.
    pub(crate) cusp: f64,
    /// Whether passes are put between where a cusp is too high: then it costs their time; else no
    /// other way may raise it.
    pub(crate) adds_passes: bool,
}

/// Another way to choose the postures of a pass.
struct Alternative {
    cone: f64,
    settings: PassSettings,
}

/// Times of the steps of a pass, s; 0 where a step has no pose at an end.
struct StepTimes {
    /// At the programmed feed.
    asked: Vec<f64>,
    /// By the machine's law of motion.
    needed: Vec<f64>,
    /// Runs of poses that the axes go through without turning back or over.
    runs: usize,
}

impl Detours<'_, '_> {
    /// Plans the passes again that come beside the pole and lose more than a tenth of their time,
    /// and takes the ways that are faster.
    ///
    /// A pass is replaced only where the other way leaves no point out that the pass has, and is in
    /// no more parts. All others stay as they are. Does not depend on the number of threads.
    ///
    /// # Errors
    /// When the stages are cancelled.
    pub(crate) fn take(
        &self,
        tasks: &[PassTask],
        planned: &mut [PlannedPass],
        stages: &dyn Stages,
    ) -> Result<(), Failure> {
        // What a proof says of the search is of all its tests together.
        if self.settings.fallback().is_none() || self.settings.search.certified.is_some() {
            return Ok(());
        }
        let views = [(self.machine(), self.tests.plain.cell.tool.gauge_length())];
        let timer = Timer::new(&views, self.machine().motion_law().control_tolerance).ok();
        let timer = timer.map(|timer| timer.without_limits().on_control(self.control));
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

    fn machine(&self) -> &Machine {
        self.tests.plain.cell.machine
    }

    /// Ways to plan besides the job's own: none lets the tool turn faster or nearer to the pole
    /// than that.
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

    /// A pass planned within other limits, with the steps counted that are beyond those of the job.
    fn counted_again(&self, task: &PassTask, mut found: PlannedPass) -> PlannedPass {
        if let Some(optimum) = &mut found.optimum {
            let limits = (self.settings.max_turn_per_mm, self.feed);
            optimum.jumps = steps_beyond_limits(self.machine(), &task.pass, &found.outcomes.points, limits);
        }
        found
    }

    /// Whether a pose is beside the pole.
    fn is_beside_pole(&self, outcome: &Outcome) -> bool {
        let Ok(pose) = outcome else { return false };
        let cl = pose.cl.transformed(&self.tests.plain.cell.table_from_work);
        self.machine().angle_to_singular(&cl).is_some_and(|angle| angle < BESIDE_POLE)
    }

    /// Time of the passes that have to be put beside a pass for its postures, s, with their
    /// entries, exits and links: so many that each strip's cusp, which falls with the square of its
    /// width, is kept.
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
        let steps: Vec<f64> = points.windows(2).map(|ends| self.asked(ends)).collect();
        time_between(&passes, &steps)
    }

    /// Time of a step at the programmed feed, s.
    fn asked(&self, ends: &[CcPoint]) -> f64 {
        (ends[1].position - ends[0].position).norm() / self.feed
    }
}

/// Time of passes between, s: so many at each point, with the times of the steps from point to
/// point.
fn time_between(passes: &[f64], steps: &[f64]) -> f64 {
    let along: f64 = passes.windows(2).zip(steps).map(|(ends, step)| step * ends[0].max(ends[1])).sum();
    // Where more are wanted than at the point before, some begin.
    let before = std::iter::once(&0.0).chain(passes);
    let begin: f64 = passes.iter().zip(before).map(|(here, before)| (here - before).max(0.0)).sum();
    along + BETWEEN_PASSES * begin
}

/// Judges ways by their times.
struct Judge<'j, 'd, 'a> {
    detours: &'j Detours<'d, 'a>,
    /// The machine's law; `None` where its file lacks a limit: then largest velocities alone count.
    timer: Option<&'j Timer<'j>>,
}

impl Judge<'_, '_, '_> {
    /// Whether a pass comes beside the pole and loses more than is worth a second plan: what is won
    /// there may be lost farther on.
    fn loses_beside_pole(&self, task: &PassTask, outcomes: &Pass<Outcome>) -> bool {
        if !outcomes.points.iter().any(|o| self.detours.is_beside_pole(o)) {
            return false;
        }
        let times = self.times(&task.pass.points, outcomes);
        let [needed, asked] = [&times.needed, &times.asked].map(|t| t.iter().sum::<f64>());
        needed > (1.0 + WORTH) * asked
    }

    /// Whether another way leaves no point out that one has, is in no more parts, and takes less
    /// time, that of passes between included.
    fn is_better(&self, task: &PassTask, own: &Pass<Outcome>, other: &Pass<Outcome>) -> bool {
        if own.points.iter().zip(&other.points).any(|(own, other)| own.is_ok() && other.is_err()) {
            return false;
        }
        let [own_between, other_between] = [own, other].map(|outcomes| self.detours.between(task, outcomes));
        if other_between > own_between && !self.detours.adds_passes {
            return false;
        }
        let [own, other] = [own, other].map(|outcomes| self.times(&task.pass.points, outcomes));
        let [needed, other_needed, asked] = [&own.needed, &other.needed, &own.asked].map(|t| t.iter().sum::<f64>());
        other.runs <= own.runs && other_needed + other_between + WORTH * asked < needed + own_between
    }

    /// The times of a pass's steps, each run of poses from rest to rest. An estimate: the poses put
    /// between points are to come.
    fn times(&self, points: &[CcPoint], outcomes: &Pass<Outcome>) -> StepTimes {
        let n_steps = points.len().saturating_sub(1);
        let mut times = StepTimes { asked: vec![0.0; n_steps], needed: vec![0.0; n_steps], runs: 0 };
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
                Some(_) => times.asked[k - 1] = self.detours.asked(&points[k - 1..=k]),
                None => self.end_run(k, &mut run, &mut times),
            }
            run.push(goes_on.unwrap_or(here));
        }
        self.end_run(points.len(), &mut run, &mut times);
        times
    }

    /// A position with endless axes turned to where they are nearest to the one before; `None`
    /// where an axis with stops has to turn back.
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
        let asked = &times.asked[steps.clone()];
        let block = |(end, asked): (&AxisValues, &f64)| ProgramBlock { end: *end, tip_time: *asked, exact_stop: false };
        let blocks: Vec<ProgramBlock> = rest.iter().zip(asked).map(block).collect();
        let run = Run { start: *start, blocks, is_rapid: false, vectors: Vec::new() };
        let by_law = self.timer.and_then(|timer| timer.time(&run).ok()).map(|law| law.times);
        let at_velocities = || positions.windows(2).zip(asked).map(|(ends, asked)| self.least_time(ends).max(*asked));
        let needed = by_law.unwrap_or_else(|| at_velocities().collect());
        times.needed[steps].copy_from_slice(&needed);
    }

    /// Time that the slowest axis takes at its largest velocity, s.
    fn least_time(&self, ends: &[AxisValues]) -> f64 {
        let axes = self.detours.machine().axes().iter().enumerate();
        axes.map(|(k, axis)| (ends[1][k] - ends[0][k]).abs() / axis.max_velocity).fold(0.0, f64::max)
    }
}
