//! Cost of a sequence of postures along a pass: remaining cusps, and axes in motion.

use facemill_cl_data::Posture;
use facemill_inverse_kinematics::{AxisKind, AxisValues, MAX_AXES, Machine};
use facemill_tool_model::{Cusp, Cutter, FeedCurvature, Outline, cusp_height_between, envelope_curvature};
use rayon::prelude::*;

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
    /// [`HIGHEST`].
    pub(crate) fn height(&self, posture: Posture, strip: &Strip) -> f64 {
        self.relative_height(&Outline::new(&self.cutter, posture), strip).min(HIGHEST)
    }

    /// Returns the same without that bound; uncut strips count as several times it.
    fn relative_height(&self, outline: &Outline, strip: &Strip) -> f64 {
        const UNCUT: f64 = 4.0 * HIGHEST;
        match cusp_height_between(outline, outline, strip.step_over, &strip.curvature) {
            Cusp::Height(h) => (h / self.allowed).min(UNCUT),
            Cusp::Uncut => UNCUT,
        }
    }
}

/// Nodes of a [`CuspTable`] in each direction. Cusps are nearly linear in the curvature and in the
/// square of the step-over.
const NODES: usize = 17;

/// Relative cusp heights of some postures over the range of most strips: exact at the nodes of a
/// grid, linear between them. Strips outside the grid are computed exactly, one by one. Where the
/// surface bends or twists along the feed, the strip counts as one on a straight feed with as much
/// more curvature across as the envelope has there: its cusp to the second order.
#[derive(Clone, Debug)]
pub(crate) struct CuspTable {
    scale: CuspScale,
    postures: Vec<Posture>,
    curvature: Range,
    step_sq: Range,
    /// By posture, then curvature, then step.
    heights: Vec<[[f64; NODES]; NODES]>,
}

#[derive(Clone, Copy, Debug)]
struct Range {
    low: f64,
    high: f64,
}

impl Range {
    /// Spans the range from the 2 % quantile to the 98 % quantile: a few outliers would make the
    /// grid coarse.
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.collect();
        values.sort_by(f64::total_cmp);
        let beyond = values.len() / 50;
        let at = |k: usize| values.get(k).copied().unwrap_or(0.0);
        Self { low: at(beyond), high: at(values.len().saturating_sub(1 + beyond)) }
    }

    fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    fn at(&self, node: usize) -> f64 {
        self.low + (self.high - self.low) * node as f64 / (NODES - 1) as f64
    }

    /// Returns the node below a value within the range and the fraction of the way to the next.
    fn place(&self, value: f64) -> (usize, f64) {
        if self.high <= self.low {
            return (0, 0.0);
        }
        let x = (value - self.low) / (self.high - self.low) * (NODES - 1) as f64;
        let node = (x as usize).min(NODES - 2);
        (node, x - node as f64)
    }
}

impl CuspTable {
    /// Tabulates these postures for strips like these, at least one.
    pub(crate) fn new(scale: &CuspScale, postures: &[Posture], strips: &[Strip]) -> Self {
        let counted = |posture: &Posture| {
            let sample = strips.iter().step_by(1 + strips.len() / SAMPLED);
            sample.filter_map(|s| straightened(&scale.cutter, *posture, &s.curvature)).collect::<Vec<_>>()
        };
        let curvature = Range::of(postures.iter().flat_map(counted));
        let step_sq = Range::of(strips.iter().map(|s| s.step_over * s.step_over));
        let heights = postures
            .par_iter()
            .map(|&posture| {
                let outline = Outline::new(&scale.cutter, posture);
                std::array::from_fn(|i| {
                    std::array::from_fn(|j| {
                        let curvature = FeedCurvature::straight(curvature.at(i));
                        let strip = Strip { curvature, step_over: step_sq.at(j).max(0.0).sqrt() };
                        scale.relative_height(&outline, &strip)
                    })
                })
            })
            .collect();
        Self { scale: *scale, postures: postures.to_vec(), curvature, step_sq, heights }
    }

    /// As [`CuspScale::rate`], for the posture of this index.
    pub(crate) fn rate(&self, posture: usize, strip: &Strip) -> f64 {
        rate(self.height(posture, strip))
    }

    /// As [`CuspScale::height`], for the posture of this index.
    fn height(&self, posture: usize, strip: &Strip) -> f64 {
        let step_sq = strip.step_over * strip.step_over;
        let curvature = straightened(&self.scale.cutter, self.postures[posture], &strip.curvature);
        let held = curvature.filter(|&c| self.curvature.holds(c) && self.step_sq.holds(step_sq));
        let Some(curvature) = held else { return self.scale.height(self.postures[posture], strip) };
        let grid = &self.heights[posture];
        let ((i, s), (j, t)) = (self.curvature.place(curvature), self.step_sq.place(step_sq));
        let (i1, j1) = ((i + 1).min(NODES - 1), (j + 1).min(NODES - 1));
        let low = grid[i][j] * (1.0 - t) + grid[i][j1] * t;
        let high = grid[i1][j] * (1.0 - t) + grid[i1][j1] * t;
        (low * (1.0 - s) + high * s).min(HIGHEST)
    }
}

/// Strips of which the range of curvatures is taken.
const SAMPLED: usize = 500;

/// Returns the curvature across a straight feed with which a posture leaves the same cusp, to the
/// second order; `None` for an edge seen end on.
fn straightened(cutter: &Cutter, posture: Posture, surface: &FeedCurvature) -> Option<f64> {
    if surface.along == 0.0 && surface.twist == 0.0 {
        return Some(surface.across);
    }
    let curved = envelope_curvature(cutter, posture, surface);
    let more = curved - envelope_curvature(cutter, posture, &FeedCurvature::straight(surface.across));
    more.is_finite().then_some(surface.across + more)
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
