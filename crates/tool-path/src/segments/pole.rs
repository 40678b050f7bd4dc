//! Postures away from the pole of the rotary axes, and at it only where there are no others.

use facemill_cl_data::{CcPoint, ClPoint, Pass};
use facemill_cutter_location::links::link::between;
use facemill_cutter_location::{Hints, Infeasible, Outcome, PassSettings, PoseTest, Widened, search};
use rayon::prelude::*;

use crate::segments::LaidTask;

/// Tests for choosing postures.
pub struct Tests<'t> {
    /// Test that avoids the pole.
    pub choosing: &'t PoseTest<'t>,
    /// Test that does not.
    pub plain: &'t PoseTest<'t>,
}

impl<'t> Tests<'t> {
    /// Uses one test for both.
    #[cfg(test)]
    pub fn one(test: &'t PoseTest<'t>) -> Self {
        Self { choosing: test, plain: test }
    }

    /// Returns whether the middle of the way between two poses is so near to the pole that a pose
    /// between them may be in its cone.
    pub fn leads_by_pole(&self, from: &ClPoint, to: &ClPoint) -> bool {
        let cone = self.choosing.pole_cone();
        let middle = between(from, to, 0.5).transformed(&self.plain.cell.table_from_work);
        cone > 0.0 && self.plain.cell.machine.angle_to_singular(&middle).is_some_and(|angle| angle < 2.0 * cone)
    }

    /// Returns the test to plan with: postures that the job prescribes are taken as they are.
    pub fn of(&self, settings: &PassSettings) -> &'t PoseTest<'t> {
        if settings.fallback().is_some() { self.choosing } else { self.plain }
    }

    /// Returns whether a point's ranges can contain a posture that is avoided.
    fn may_avoid(&self, cc: &CcPoint, task: &LaidTask) -> bool {
        let cell = self.plain.cell;
        let upright = ClPoint { tip: cc.position, axis: cc.normal }.transformed(&cell.table_from_work);
        let tilt = task.curve.start().tilt.max(task.curve.end().tilt);
        cell.machine.angle_to_singular(&upright).is_some_and(|angle| angle - tilt < self.choosing.pole_cone())
    }

    /// Returns the CC points at which searches could not reach the requested width of proof, of
    /// both tests.
    pub fn widened(&self) -> Option<Widened> {
        let both = [self.choosing.widened(), self.plain.widened()].into_iter().flatten();
        both.reduce(Widened::plus)
    }

    /// Fills points that have a pose only nearer to the pole, with the first feasible one of the
    /// search curve.
    pub fn at_pole(&self, tasks: &[LaidTask], settings: &PassSettings, outcomes: &mut [Pass<Outcome>]) {
        let Some(search_settings) = settings.fallback() else { return };
        outcomes.par_iter_mut().zip(tasks).for_each(|(outcome, task)| {
            let mut hints = Hints::default();
            let mut near = None;
            for (cc, found) in task.pass.points.iter().zip(&mut outcome.points) {
                if let Err(why) = found
                    && self.may_avoid(cc, task)
                {
                    match search(self.plain, cc, &task.curve, search_settings, 0.0, near.as_ref(), &mut hints) {
                        Ok(again) => *found = Ok(again.pose),
                        // The point is blocked for a reason other than the pole.
                        Err(other) if matches!(why, Infeasible::Singular { .. }) => *found = Err(other),
                        Err(_) => {}
                    }
                }
                near = found.as_ref().ok().map(|pose| pose.configuration).or(near);
            }
        });
    }
}
