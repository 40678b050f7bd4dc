use facemill_inverse_kinematics::{AxisValues, MAX_AXES};

use super::s_curve::SCurve;
use crate::time_law::AxisBounds;

/// Motion of a block from rest to rest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LineMotion {
    pub(crate) block: usize,
    pub(crate) curve: SCurve,
    /// Largest ṙ allowed by the tip feed.
    pub(crate) cap: f64,
}

/// A line of the program over its length r, in which each axis counts by the time it takes at its
/// largest speed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProgramLine {
    /// Length, s at the axes' largest speeds.
    pub(crate) length: f64,
    /// Derivatives of the axes by r.
    pub(crate) slopes: [f64; MAX_AXES],
    /// Limits of ṙ and its first two derivatives.
    pub(crate) limits: [f64; 3],
}

impl ProgramLine {
    /// Creates the line between two points, with ṙ no larger than `cap`.
    pub(crate) fn new(from: &AxisValues, to: &AxisValues, length: f64, cap: f64, axes: &[AxisBounds]) -> Self {
        let mut slopes = [0.0; MAX_AXES];
        let mut limits = [cap, f64::INFINITY, f64::INFINITY];
        for (k, b) in axes.iter().enumerate() {
            slopes[k] = (to[k] - from[k]) / length;
            for (limit, most) in limits.iter_mut().zip(b.as_array()) {
                *limit = limit.min(most / slopes[k].abs());
            }
        }
        Self { length, slopes, limits }
    }

    /// Returns the least-time motion over the line from rest to rest.
    pub(crate) fn alone(&self) -> SCurve {
        SCurve::new(self.length, self.limits)
    }

    /// Returns the time that a blend over ±`w` at the speed `c` saves on this side of a corner
    /// compared with a stop, s.
    ///
    /// For the speed u of the line with the acceleration a and jerk j, changes of speed by
    /// jerk-limited ramps, with the way left out covered at u: (2c − c²/u)/(2a) + c·a/(2u·j) for
    /// the ramps minus w/c − w/u for the blend.
    pub(crate) fn saved_by_blend(&self, w: f64, c: f64) -> f64 {
        let [_, a, j] = self.limits;
        let u = self.alone().speed();
        if c >= u {
            return f64::INFINITY;
        }
        let a = a.min((u * j).sqrt());
        (c - 0.5 * c * c / u) / a + 0.5 * c * a / (u * j) - w * (1.0 / c - 1.0 / u)
    }
}

/// Fraction of an axis's speed within which two directions count as one: rounding passes, and a
/// jump of the velocity by this fraction is blended within nanometres.
const SAME_DIRECTION: f64 = 1e-9;

/// Returns whether the axes stop between two lines: without a tolerance at every corner; with one,
/// where a blend within it takes longer than a stop.
///
/// A blend over ±w turns at the speed that the acceleration and jerk of its bend allow. The time it
/// saves is an estimate, used only to choose between two motions that hold all limits.
pub(crate) fn stops_between(
    before: &ProgramLine,
    after: &ProgramLine,
    axes: &[AxisBounds],
    tolerance: Option<&AxisValues>,
) -> bool {
    let bend = |k: usize| (after.slopes[k] - before.slopes[k]).abs();
    let turns = |k: usize| bend(k) > SAME_DIRECTION * axes[k].velocity;
    if !(0..axes.len()).any(turns) {
        return false;
    }
    let Some(tolerance) = tolerance else { return true };
    // A cubic spline over three knots leaves a corner by a sixth of the bend times their distance.
    let widest =
        (0..axes.len()).filter(|&k| turns(k)).map(|k| 6.0 * tolerance[k] / bend(k)).fold(f64::INFINITY, f64::min);
    let w = widest.min(0.5 * before.length).min(0.5 * after.length);
    let by_axis = (0..axes.len()).filter(|&k| turns(k)).map(|k| {
        let (a, j) = (axes[k].acceleration / bend(k), axes[k].jerk / bend(k));
        (a * w).sqrt().min((j * w * w).cbrt())
    });
    let speed = by_axis.fold(before.limits[0].min(after.limits[0]), f64::min);
    before.saved_by_blend(w, speed) + after.saved_by_blend(w, speed) < 0.0
}
