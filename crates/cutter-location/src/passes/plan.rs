use facemill_cl_data::{Cancelled, CcPoint, Monitor, Pass, Posture};
use rayon::prelude::*;

use crate::passes::smooth_pass::SmoothPass;
use crate::passes::task::{Outcome, PassSettings, PassTask, PlannedPass, PostureMode};
use crate::pose::pose_test::PoseTest;
use crate::pose::workcell::{Hints, Infeasible};
use crate::search;
use crate::search::FoundPosture;
use crate::search::bezier::{SearchCurve, TurnTable};
use crate::search::lattice::Lattice;

/// Finds a pose for every CC point of every pass (CLOPT, items 3 and 4 of the method), as the mode
/// requires.
///
/// `Smallest`: each point gets the smallest feasible posture of its curve; then the postures are
/// raised where that is needed to keep the turn of the axis along the pass below `max_turn_per_mm`,
/// each raised one tested again (a raised posture that is not feasible gives way to the next
/// feasible one above it, or else to the point's own smallest).
///
/// `Smooth`: postures of a lattice over the search's ranges are tested at layers along the pass;
/// the cheapest sequence is the shortest way through them; the rotary axes are smoothed along it,
/// and each point is tested in the resulting posture. An infeasible one is raised until it is
/// feasible, and the band is bent there. A point for which that fails gets the first feasible
/// posture of its curve, or one beside the curve, so every point that `Smallest` plans is planned.
///
/// `Fixed`, `Toward` and `Given` take the prescribed posture or none.
///
/// Every returned pose has been tested. The result does not depend on the number of threads. The
/// monitor advances by one for every CC point.
///
/// # Errors
/// When the monitor cancels.
pub fn plan_passes(
    test: &PoseTest<'_>,
    tasks: &[PassTask],
    settings: &PassSettings,
    monitor: &dyn Monitor,
) -> Result<Vec<PlannedPass>, Cancelled> {
    let grounds = match &settings.mode {
        PostureMode::Smooth(_) => Grounds::of(tasks),
        _ => Vec::new(),
    };
    tasks
        .par_iter()
        .map(|task| match &settings.mode {
            PostureMode::Smallest => smallest(test, task, settings, monitor),
            PostureMode::Smooth(smooth) => {
                let own = grounds.iter().find(|g| g.serves(&task.curve));
                let Some(Grounds { lattice, fine, .. }) = own else { return Ok(PlannedPass::empty()) };
                SmoothPass { test, task, settings, smooth, lattice, fine }.plan(monitor)
            }
            PostureMode::Fixed(amount) => {
                let turn = if task.curve.end().rotate < 0.0 { -1.0 } else { 1.0 };
                let posture = Posture { rotate: turn * amount.rotate, ..*amount };
                prescribed(test, task, |_, _| Some(posture), monitor)
            }
            PostureMode::Toward(target) => {
                prescribed(test, task, |_, cc| target.axis_at(cc).map(|axis| cc.posture_of(&axis)), monitor)
            }
            PostureMode::Given => prescribed(test, task, |k, _| task.given.get(k).copied(), monitor),
        })
        .collect()
}

/// Common data of the passes of one search range.
struct Grounds {
    curve: SearchCurve,
    lattice: Lattice,
    fine: Lattice,
}

impl Grounds {
    /// One for every search range among the tasks that have points.
    fn of(tasks: &[PassTask]) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        for task in tasks.iter().filter(|t| !t.pass.points.is_empty()) {
            if !all.iter().any(|g| g.serves(&task.curve)) {
                let (lattice, fine) = (Lattice::new(&task.curve), Lattice::fine(&task.curve));
                all.push(Self { curve: task.curve, lattice, fine });
            }
        }
        all
    }

    /// Returns whether a curve has the same ranges, to either side.
    fn serves(&self, curve: &SearchCurve) -> bool {
        *curve == self.curve || *curve == self.curve.mirrored()
    }
}

/// Tries postures that are prescribed instead of searched, feasible or not.
fn prescribed(
    test: &PoseTest<'_>,
    task: &PassTask,
    posture: impl Fn(usize, &CcPoint) -> Option<Posture>,
    monitor: &dyn Monitor,
) -> Result<PlannedPass, Cancelled> {
    let mut hints = Hints::default();
    let mut near = None;
    let mut outcomes: Vec<Outcome> = Vec::with_capacity(task.pass.points.len());
    for (k, cc) in task.pass.points.iter().enumerate() {
        monitor.checkpoint()?;
        let outcome = match posture(k, cc).filter(|p| p.tilt < std::f64::consts::FRAC_PI_2) {
            Some(posture) => test.try_posture(cc, posture, near.as_ref(), &mut hints),
            None => Err(Infeasible::FromBelow),
        };
        near = outcome.as_ref().ok().map(|pose| pose.configuration).or(near);
        outcomes.push(outcome);
        monitor.advance(1);
    }
    Ok(PlannedPass { outcomes: Pass::new(outcomes), optimum: None })
}

fn smallest(
    test: &PoseTest<'_>,
    task: &PassTask,
    settings: &PassSettings,
    monitor: &dyn Monitor,
) -> Result<PlannedPass, Cancelled> {
    let mut hints = Hints::default();
    let mut smallest: Vec<Result<FoundPosture, Infeasible>> = Vec::with_capacity(task.pass.points.len());
    for cc in &task.pass.points {
        monitor.checkpoint()?;
        let near = smallest.last().and_then(|r| r.as_ref().ok()).map(|f| f.pose.configuration);
        smallest.push(search(test, cc, &task.curve, &settings.search, 0.0, near.as_ref(), &mut hints));
        monitor.advance(1);
    }
    let mut found = smallest;
    for _ in 0..SMOOTHING_ROUNDS {
        let wanted = rate_limited(&task.pass, &found, &task.curve, settings.max_turn_per_mm);
        if !raise_to(test, task, settings, &wanted, &mut found, &mut hints) {
            break;
        }
        monitor.checkpoint()?;
    }
    let outcomes = Pass::new(found.into_iter().map(|r| r.map(|f| f.pose)).collect());
    Ok(PlannedPass { outcomes, optimum: None })
}

/// Rounds of raising postures: a raise can require more at the neighbours when the raised posture
/// was not feasible. Each round spreads that by one rate-limited ramp; more than a few rounds mean
/// that the feasible set itself jumps.
const SMOOTHING_ROUNDS: usize = 4;

/// Returns the smallest u at each point that is not below its own and changes by no more than the
/// allowed turn from its neighbours.
fn rate_limited(
    pass: &Pass<CcPoint>,
    found: &[Result<FoundPosture, Infeasible>],
    curve: &SearchCurve,
    max_turn_per_mm: f64,
) -> Vec<Option<f64>> {
    let table = TurnTable::new(curve);
    let mut turn: Vec<Option<f64>> = found.iter().map(|r| r.as_ref().ok().map(|f| table.turn_at(f.u))).collect();
    let n = turn.len();
    let sweep = |turn: &mut Vec<Option<f64>>, from: usize, to: usize| {
        let step = (pass.points[to].position - pass.points[from].position).norm();
        if let (Some(a), Some(b)) = (turn[from], turn[to]) {
            turn[to] = Some(b.max(a - max_turn_per_mm * step));
        }
    };
    for k in 1..n {
        sweep(&mut turn, k - 1, k);
    }
    for k in (1..n).rev() {
        sweep(&mut turn, k, k - 1);
    }
    turn.into_iter().map(|t| t.map(|t| table.u_at(t))).collect()
}

/// Tests the wanted postures; returns whether any had to become larger than wanted.
fn raise_to(
    test: &PoseTest<'_>,
    task: &PassTask,
    settings: &PassSettings,
    wanted: &[Option<f64>],
    found: &mut [Result<FoundPosture, Infeasible>],
    hints: &mut Hints,
) -> bool {
    let mut larger = false;
    for k in 0..found.len() {
        let (Some(wanted), Ok(own)) = (wanted[k], found[k]) else { continue };
        if wanted <= own.u + 1e-9 {
            continue;
        }
        let cc = &task.pass.points[k];
        let near = k.checked_sub(1).and_then(|j| found[j].as_ref().ok()).map(|f| f.pose.configuration);
        if let Ok(raised) = search(test, cc, &task.curve, &settings.search, wanted, near.as_ref(), hints) {
            larger |= raised.u > wanted + settings.search.u_tolerance;
            found[k] = Ok(raised);
        }
    }
    larger
}
