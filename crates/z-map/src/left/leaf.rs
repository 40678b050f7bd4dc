//! Least height of a line's entry over one motion.

use facemill_cl_data::ClPoint;
use nalgebra::{Point3, Unit, Vector3};

use super::gauge::{Approach, Gauge};
use crate::left::place::{CutterMotion, SurfacePlace};

/// Poses of a motion that are looked at, at most.
const MAX_POSES: usize = 48;

/// Share of a motion's time that is too short to look into: rounding of the shares themselves.
const SHORTEST: f64 = 1e-15;

/// A motion with its turn.
pub(super) struct TurnedMotion<'m> {
    m: &'m CutterMotion,
    /// Angle between the axes at both ends, rad, and its sine.
    turn: f64,
    sine: f64,
    /// Turn per time of the motion.
    spin: Vector3<f64>,
}

/// Turn below which an axis may go along the chord, rad: 1e-10 mm on a meter. Smaller: the division
/// by its sine loses digits.
const SMALL_TURN: f64 = 1e-4;

impl<'m> TurnedMotion<'m> {
    pub(super) fn new(m: &'m CutterMotion) -> Self {
        let (a, b) = (m.from.axis.into_inner(), m.to.axis.into_inner());
        let cross = a.cross(&b);
        let norm = cross.norm();
        let turn = norm.atan2(a.dot(&b));
        let spin = if norm > 0.0 { cross * (turn / norm) } else { Vector3::zeros() };
        Self { m, turn, sine: turn.sin(), spin }
    }

    /// The pose at a share of the motion's time.
    pub(super) fn pose_at(&self, t: f64) -> ClPoint {
        let Self { m, turn, sine, .. } = self;
        let tip = m.from.tip + (m.to.tip - m.from.tip) * t;
        let (a, b) = (m.from.axis.into_inner(), m.to.axis.into_inner());
        if *turn < SMALL_TURN {
            // Chord and arc are the same up to turn³/15, and opposite axes are no motion that a
            // machine makes in one part.
            return ClPoint { tip, axis: Unit::new_normalize(a + (b - a) * t) };
        }
        ClPoint {
            tip,
            axis: Unit::new_normalize(a * (((1.0 - t) * turn).sin() / sine) + b * ((t * turn).sin() / sine)),
        }
    }

    /// Velocity of a point of the body at a pose, per time of the motion.
    fn velocity(&self, pose: &ClPoint, point: &Point3<f64>) -> Vector3<f64> {
        (self.m.to.tip - self.m.from.tip) + self.spin.cross(&(point - pose.tip))
    }
}

/// A pose of the motion as a line meets it.
struct Try {
    t: f64,
    entry: Option<f64>,
    /// Change of the distance between line and cutter with time; its sign is that of the change of
    /// the entry.
    rate: f64,
    /// Change of the entry with time.
    entry_rate: f64,
}

impl Gauge {
    fn attempt(&self, m: &TurnedMotion<'_>, place: &SurfacePlace, t: f64) -> Try {
        let pose = m.pose_at(t);
        let Approach { entry, nearest, outward, slope } = self.approach(&pose, place);
        let rate = -outward.dot(&m.velocity(&pose, &nearest));
        Try { t, entry, rate, entry_rate: if slope == 0.0 { rate } else { rate / slope.abs() } }
    }

    /// Returns the least way along a place's normal to the cutter over the time of a motion; `None`
    /// where the line meets it at no tested pose.
    ///
    /// If the axis keeps its direction, the distance from the line's points is convex in way and
    /// time. The sign of its change then gives the side of a pose on which the least is, and its
    /// rate bounds how much less that can be.
    pub(super) fn least_entry(&self, m: &CutterMotion, place: &SurfacePlace, accuracy: f64) -> Option<f64> {
        let m = &TurnedMotion::new(m);
        let mut low = self.attempt(m, place, 0.0);
        let mut best = low.entry;
        if best == Some(0.0) || low.rate >= 0.0 {
            return best;
        }
        let mut high = self.attempt(m, place, 1.0);
        best = lesser(best, high.entry);
        if best == Some(0.0) || high.rate <= 0.0 {
            return best;
        }
        // Illinois steps on the rate, halvings where they would stay at an end.
        let mut weights = [1.0, 1.0];
        for _ in 0..MAX_POSES {
            let (a, b) = (low.rate * weights[0], high.rate * weights[1]);
            let share = (a / (a - b)).clamp(0.02, 0.98);
            let middle = self.attempt(m, place, low.t + (high.t - low.t) * share);
            best = lesser(best, middle.entry);
            let rest = (middle.t - low.t).max(high.t - middle.t);
            if best == Some(0.0) || (middle.entry.is_some() && middle.entry_rate.abs() * rest <= accuracy) {
                break;
            }
            if high.t - low.t < SHORTEST {
                break;
            }
            if middle.rate < 0.0 {
                low = middle;
                weights = [1.0, 0.5 * weights[1]];
            } else {
                high = middle;
                weights = [0.5 * weights[0], 1.0];
            }
        }
        best
    }
}

fn lesser(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}
