use facemill_cl_data::ClPoint;
use nalgebra::{Unit, Vector3};

/// Largest tilt of a motion by rounded words over a whole block, mm: two last decimals at each end.
/// Larger hides short steep ramps, smaller reports rounding.
pub(crate) const RAMP_ROUNDING: f64 = 2e-3;

/// Descent of the whole cutter bottom over one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Descent {
    /// Way down along the tool axis of the point of the bottom that goes down least, mm; negative
    /// where one rises.
    pub(crate) down: f64,
    /// Way of the tip square to the tool axis, mm.
    pub(crate) across: f64,
}

impl Descent {
    /// Descent of a cutter of radius `radius` from one pose to the next, small turns assumed.
    ///
    /// A cutter that follows a concave surface swings its trailing half down and its leading half
    /// up: only where all of the bottom goes down does it go into the material below it. The way
    /// down is linear over the bottom, so that it is least at the rim: that of the tip less the
    /// radius times the turn.
    pub(crate) fn between(from: &ClPoint, to: &ClPoint, radius: f64) -> Self {
        let way: Vector3<f64> = to.tip - from.tip;
        let axis = Unit::new_normalize(from.axis.into_inner() + to.axis.into_inner());
        let along = way.dot(&axis);
        let turn = (to.axis.into_inner() - from.axis.into_inner()).norm();
        Self { down: -along - radius * turn, across: (way - axis.into_inner() * along).norm() }
    }

    /// Whether it is steeper than `limit` (rad), by more than `rounding` mm.
    pub(crate) fn is_steeper_than(&self, limit: f64, rounding: f64) -> bool {
        limit < std::f64::consts::FRAC_PI_2 && self.down > limit.tan() * self.across + rounding
    }

    /// Angle of descent, rad.
    pub(crate) fn angle(&self) -> f64 {
        self.down.atan2(self.across)
    }
}

#[cfg(test)]
#[path = "../../tests/unit/run/ramp.rs"]
mod tests;
