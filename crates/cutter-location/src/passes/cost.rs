//! Cost of a sequence of postures along a pass: remaining cusps, and axes in motion.

use facemill_cl_data::Posture;
use facemill_inverse_kinematics::{AxisKind, AxisValues, MAX_AXES, Machine};
use facemill_tool_model::{Cusp, Cutter, Outline, cusp_height_between};

use crate::cusp::cut_point::Strip;

/// Cusps above this many times the allowed one count alike, as does a strip that stays uncut: both
/// are to be avoided, and neither may outweigh everything else.
const HIGHEST: f64 = 4.0;

/// Fraction of the allowed cusp beyond which the cost grows steeply: smoothing and the neighbour's
/// own posture are still to come.
pub(crate) const NEARLY: f64 = 0.9;

/// Slope of that cost.
const STEEP: f64 = 20.0;

/// Returns the cost of a cusp per second of cutting, by its height over the allowed one: its
/// square, so a cusp as high as allowed costs about 1, and much more beyond.
fn rate(height: f64) -> f64 {
    height.powi(2) + (STEEP * (height - NEARLY).max(0.0)).powi(2)
}

/// Scale for the cost of cusps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CuspScale {
    pub(crate) cutter: Cutter,
    /// Allowed cusp, mm, above 0.
    pub(crate) allowed: f64,
}

impl CuspScale {
    /// Returns the cost per second of cutting a strip in a posture, its neighbour in the same one,
    /// from exact outlines.
    pub(crate) fn rate(&self, posture: Posture, strip: &Strip) -> f64 {
        rate(self.height(posture, strip))
    }

    /// Returns the cost per second of a cusp by its height over the allowed one.
    pub(crate) fn rate_of(height: f64) -> f64 {
        rate(height)
    }

    /// Returns the height of the cusp in a posture as a multiple of the allowed one, at most
    /// [`HIGHEST`], as which uncut strips count.
    pub(crate) fn height(&self, posture: Posture, strip: &Strip) -> f64 {
        let outline = Outline::new(&self.cutter, posture);
        match cusp_height_between(&outline, &outline, strip.step_over, &strip.curvature) {
            Cusp::Height(h) => (h / self.allowed).min(HIGHEST),
            Cusp::Uncut => HIGHEST,
        }
    }
}

/// Scale for the cost of axis motion: the square of each axis' speed against a speed that is much
/// for it, over time.
///
/// That speed is the one the axis reaches from rest in the time from one layer to the next, at most
/// its largest; for a rotary axis, also at most the job's own limit on the turn of the tool axis
/// per path length, at the programmed feed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MotionScale {
    n: usize,
    per_speed: [f64; MAX_AXES],
    /// Largest velocity, scaled.
    limit: [f64; MAX_AXES],
    /// A full turn of an endless axis, scaled; infinite for others.
    turn: [f64; MAX_AXES],
}

/// Axis values over their speeds, s.
pub(crate) type Scaled = [f64; MAX_AXES];

impl MotionScale {
    /// Prepares the scale for layers that are this far apart in time, s, and the turn of the tool
    /// axis at its limit, rad/s.
    pub(crate) fn new(machine: &Machine, layer_time: f64, turn_rate: f64) -> Self {
        let mut scale = Self {
            n: machine.axes().len(),
            per_speed: [0.0; MAX_AXES],
            limit: [f64::INFINITY; MAX_AXES],
            turn: [f64::INFINITY; MAX_AXES],
        };
        for (k, axis) in machine.axes().iter().enumerate() {
            let reached = axis.max_acceleration.map_or(f64::INFINITY, |a| a * layer_time);
            let own = if axis.kind == AxisKind::Rotary { turn_rate } else { f64::INFINITY };
            let speed = axis.max_velocity.min(reached).min(own);
            scale.per_speed[k] = 1.0 / speed;
            scale.limit[k] = axis.max_velocity / speed;
            if axis.has_no_stops() {
                scale.turn[k] = std::f64::consts::TAU / speed;
            }
        }
        scale
    }

    /// Returns axis values as the cost counts them.
    pub(crate) fn scaled(&self, axes: &AxisValues) -> Scaled {
        std::array::from_fn(|k| axes.get_or_zero(k) * self.per_speed[k])
    }

    /// Returns the cost of moving from one position to another in this time.
    pub(crate) fn cost(&self, from: &Scaled, to: &Scaled, time: f64) -> f64 {
        (0..self.n).map(|k| self.way(k, from, to).powi(2)).sum::<f64>() / time
    }

    /// Returns the largest ratio of needed to possible axis speed at the programmed feed, 0 where
    /// all axes keep it. Per path length, that is a limit on the step of each axis: its largest
    /// velocity over the feed.
    pub(crate) fn excess(&self, from: &Scaled, to: &Scaled, time: f64) -> f64 {
        let ratio = |k: usize| self.way(k, from, to).abs() / time / self.limit[k];
        let largest = (0..self.n).map(ratio).fold(0.0, f64::max);
        if largest > 1.0 + 1e-9 { largest } else { 0.0 }
    }

    fn way(&self, k: usize, from: &Scaled, to: &Scaled) -> f64 {
        let way = to[k] - from[k];
        if self.turn[k].is_finite() { way - self.turn[k] * (way / self.turn[k]).round() } else { way }
    }
}

#[cfg(test)]
#[path = "../../tests/unit/passes/cost.rs"]
mod tests;
