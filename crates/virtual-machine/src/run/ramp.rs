use facemill_cl_data::ClPoint;
use nalgebra::{Unit, Vector3};

/// What rounded words may tilt a motion by over a whole block, mm: two last decimals at each end. Larger hides short steep
/// ramps, smaller reports rounding.
pub(crate) const RAMP_ROUNDING: f64 = 2e-3;

/// Descent of the whole cutter bottom over one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Descent {
    /// Way down along the tool axis of the point of the bottom that goes down least, mm; negative where one rises.
    pub(crate) down: f64,
    /// Way of the tip square to the tool axis, mm.
    pub(crate) across: f64,
}

impl Descent {
    /// Descent of a cutter of radius `radius` from one pose to the next, small turns assumed.
    ///
    /// A cutter that follows a concave surface swings its trailing half down and its leading half up: only where all of
    /// the bottom goes down does it go into the material below it. The way down is linear over the bottom, so that it is
    /// least at the rim: that of the tip less the radius times the turn.
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
mod tests {
    use crate::run::ramp::*;
    use nalgebra::Point3;

    fn pose(x: f64, z: f64, lean: f64) -> ClPoint {
        ClPoint { tip: Point3::new(x, 0.0, z), axis: Unit::new_normalize(Vector3::new(lean.sin(), 0.0, lean.cos())) }
    }

    #[test]
    fn straight_ramp_has_its_own_angle() {
        let d = Descent::between(&pose(0.0, 0.0, 0.0), &pose(0.5, -0.5 * 3f64.to_radians().tan(), 0.0), 40.0);
        assert!((d.angle() - 3f64.to_radians()).abs() < 1e-12);
        assert!(d.is_steeper_than(2.9_f64.to_radians(), 0.0) && !d.is_steeper_than(3.1_f64.to_radians(), 0.0));
        assert!(!d.is_steeper_than(std::f64::consts::FRAC_PI_2, 0.0));
    }

    #[test]
    fn following_a_concave_cylinder_is_no_descent() {
        // Cylinder of radius 300 about (0, 0, 300), cutter of radius 40 tilted 2 degrees, contact at angle u.
        let (cylinder, radius, tilt) = (300.0, 40.0, 2f64.to_radians());
        let at = |u: f64| {
            let contact = Vector3::new(cylinder * u.sin(), 0.0, cylinder * (1.0 - u.cos()));
            // The normal leans back by u, the axis into the feed by the tilt.
            let lean = tilt - u;
            let back = Vector3::new(-lean.cos(), 0.0, lean.sin()) * radius;
            let p = contact + back;
            pose(p.x, p.z, lean)
        };
        let d = Descent::between(&at(0.0), &at(0.5 / cylinder), radius);
        let tip_angle = (-(at(0.5 / cylinder).tip - at(0.0).tip).z).atan2(0.5);
        assert!(tip_angle > 4f64.to_radians(), "the tip itself goes down: {tip_angle}");
        assert!(d.down < 0.0, "{d:?}");
    }
}
