use facemill_cl_data::{Cancelled, CcPoint, Monitor, Pass};
use rayon::prelude::*;

use crate::{FeasiblePose, Found, Hints, Infeasible, PoseTest, SearchCurve, SearchSettings, TurnTable, search};

/// How postures follow each other along a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassSettings {
    /// How each point is searched.
    pub search: SearchSettings,
    /// Largest turn of the tool axis against surface and feed per path length, rad/mm. Where neighbouring points need
    /// different postures, the larger one is approached at this rate from both sides. Larger: less tilt spent on smoothness,
    /// but rotary axes that jump.
    pub max_turn_per_mm: f64,
}

/// A pass and the curve its points are searched along.
#[derive(Clone, Debug)]
pub struct PassTask {
    /// CC points in cutting order.
    pub pass: Pass<CcPoint>,
    /// Search curve, with the sign of rotate that the cutting direction asks for.
    pub curve: SearchCurve,
}

/// What became of one CC point.
pub type Outcome = Result<FeasiblePose, Infeasible>;

/// Finds a pose for every CC point of every pass (CLOPT, items 3 and 4 of the method).
///
/// Each point gets the smallest feasible posture of its curve; then the postures are raised where that is needed to keep
/// the turn of the axis along the pass below `max_turn_per_mm`, each raised one tested again (a raised posture that is
/// not feasible gives way to the next feasible one above it, or else to the point's own smallest). The result does not
/// depend on the number of threads. The monitor advances by one for every CC point.
///
/// # Errors
/// When the monitor cancels.
pub fn plan_passes(
    test: &PoseTest<'_>,
    tasks: &[PassTask],
    settings: &PassSettings,
    monitor: &dyn Monitor,
) -> Result<Vec<Pass<Outcome>>, Cancelled> {
    tasks.par_iter().map(|task| plan_pass(test, task, settings, monitor)).collect()
}

fn plan_pass(
    test: &PoseTest<'_>,
    task: &PassTask,
    settings: &PassSettings,
    monitor: &dyn Monitor,
) -> Result<Pass<Outcome>, Cancelled> {
    let mut hints = Hints::default();
    let mut smallest: Vec<Result<Found, Infeasible>> = Vec::with_capacity(task.pass.points.len());
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
    Ok(Pass::new(found.into_iter().map(|r| r.map(|f| f.pose)).collect()))
}

/// Raising one posture can ask for more at its neighbours when the raised one was not feasible; each round spreads that
/// by one rate-limited ramp, and more than a few rounds mean that the feasible set itself jumps.
const SMOOTHING_ROUNDS: usize = 4;

/// The smallest u at each point that is not below its own and changes by no more than the allowed turn from its neighbours.
fn rate_limited(
    pass: &Pass<CcPoint>,
    found: &[Result<Found, Infeasible>],
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
    found: &mut [Result<Found, Infeasible>],
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
