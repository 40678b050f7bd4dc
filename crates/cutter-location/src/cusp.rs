//! Cusps between neighbouring passes, and step-overs.

pub mod cut_point;
pub mod neighbours;
pub mod strips;

use facemill_cl_data::{CcPoint, Posture};
use facemill_surface_model::CurvatureTensor;
use facemill_tool_model::{Cusp, Cutter, FeedCurvature, Outline, cusp_height_between};

use crate::cusp::cut_point::{CutPoint, Strip, feed_curvature};
use crate::cusp::neighbours::{CutPass, Neighbour, NeighbourReach, Neighbours};
use crate::cusp::strips::{osculating_width, strip_width};
use crate::search::bezier::SearchCurve;

/// Ridge between a point of a pass and the neighbouring pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ridge {
    /// Arc length to the neighbouring pass across the feed, mm.
    pub step_over: f64,
    /// Cusp that is left.
    pub cusp: Cusp,
    /// Curvature of the surface between the two.
    pub curvature: FeedCurvature,
    /// Outline of the neighbouring pass in this point's frame (y to the left of the feed, z along
    /// the normal).
    pub neighbour: Outline,
}

/// Returns the ridge between every point of `pass` and `neighbour`, from the exact outlines of the
/// tilted cutter, and bend and twist of the surface along the neighbour; `None` where the plane
/// across the feed does not meet the neighbour within `reach` mm.
///
/// The surface between the two is taken as a circle through both CC points with their normals,
/// which is exact to the third order of the step. Between two points of the neighbour, the posture
/// is that of the nearer one.
pub fn ridges(cutter: &Cutter, pass: &[CutPoint], neighbour: &[CutPoint], reach: f64) -> Vec<Option<Ridge>> {
    let beside = CutPass { points: neighbour.to_vec(), uncut_left: false };
    let neighbours = Neighbours::new(vec![beside], NeighbourReach { far: reach, opposed: reach });
    let nearer = |a: Ridge, b: Ridge| if b.step_over < a.step_over { b } else { a };
    let ridge = |own: &CutPoint| {
        let beside = neighbours.beside(own);
        let found = beside.before().map(|n| Ridge::toward(cutter, own, n));
        found.reduce(nearer)
    };
    pass.iter().map(ridge).collect()
}

impl Ridge {
    /// The ridge between a point and a pass beside it.
    pub fn toward(cutter: &Cutter, own: &CutPoint, beside: &Neighbour) -> Self {
        let Strip { step_over, curvature } = beside.strip;
        let [outline, others] = outlines(cutter, own, beside);
        let (right, left) = if beside.is_left { (&outline, &others) } else { (&others, &outline) };
        let cusp = cusp_height_between(right, left, step_over, &curvature);
        // This point lies to the right of a left neighbour.
        let from_neighbour = if beside.is_left { -beside.arc } else { beside.arc };
        let neighbour = seen_along_circle(&others, from_neighbour, curvature.across);
        Self { step_over, cusp, curvature, neighbour }
    }
}

/// Returns the outlines of a point and of the pass beside it, both seen along the point's feed.
fn outlines(cutter: &Cutter, own: &CutPoint, beside: &Neighbour) -> [Outline; 2] {
    let others = Outline::new(cutter, beside.point.posture);
    let others = if own.cc.feed.dot(&beside.point.cc.feed) < 0.0 { others.mirrored() } else { others };
    [Outline::new(cutter, own.posture), others]
}

/// An outline in the frame of the point at arc length `s` (to the left) on the surface's circle of
/// this curvature.
fn seen_along_circle(outline: &Outline, s: f64, curvature: f64) -> Outline {
    let half_turn = 0.5 * s * curvature;
    let chord = if half_turn.abs() < 1e-9 { s } else { s * half_turn.sin() / half_turn };
    let foot = nalgebra::Point2::new(chord * half_turn.cos(), -chord * half_turn.sin());
    outline.seen_from(foot, -2.0 * half_turn)
}

/// Returns the posture that a flat-bottomed cutter would need at a CC point if only the surface's
/// curvature limited it: the smallest u of the search curve at which the rim of the tilted disc
/// stays above the osculating paraboloid.
///
/// An estimate for laying passes: it ignores neighbours and the surface's third order. Without a
/// curvature it is the start of the curve.
pub fn expected_posture(
    cutter: &Cutter,
    cc: &CcPoint,
    curvature: Option<&CurvatureTensor>,
    curve: &SearchCurve,
) -> Posture {
    let Some(tensor) = curvature else { return curve.start() };
    const STEPS: usize = 40;
    (0..=STEPS)
        .map(|k| curve.at(k as f64 / STEPS as f64))
        .find(|&posture| rim_clears(cutter, cc, tensor, posture))
        .unwrap_or_else(|| curve.end())
}

/// Whether the rim of the disc of radius R − r, lowered by r, stays above the paraboloid
/// `−½·κ(x)·|x|²`.
fn rim_clears(cutter: &Cutter, cc: &CcPoint, tensor: &CurvatureTensor, posture: Posture) -> bool {
    const RIM_POINTS: usize = 24;
    let rim = cutter.rim_radius();
    let toward = cc.tilt_direction(posture.rotate).into_inner();
    let across = cc.normal.cross(&toward);
    let (sin, cos) = posture.tilt.sin_cos();
    (1..RIM_POINTS).all(|k| {
        let (s, c) = (std::f64::consts::TAU * k as f64 / RIM_POINTS as f64).sin_cos();
        // From the contact: back by the disc, up by the tilt.
        let back = rim * (1.0 - c);
        let offset = toward * (-back * cos) + across * (rim * s);
        let height = back * sin;
        let surface = -0.5 * offset.dot(&(tensor.tensor * offset));
        height >= surface
    })
}

/// Share of the cusp from which a width is wide enough: 1 % of the width.
const NEARLY: f64 = 0.98;

/// Returns the distance that passes may have at a CC point: the largest step-over, up to
/// `max_step_over`, whose cusp is at most `cusp` in the [expected posture](expected_posture). An
/// estimate, because the posture is one.
pub fn expected_strip_width(
    cutter: &Cutter,
    cc: &CcPoint,
    curvature: Option<&CurvatureTensor>,
    curve: &SearchCurve,
    cusp: f64,
    max_step_over: f64,
) -> f64 {
    let posture = expected_posture(cutter, cc, curvature, curve);
    let outline = Outline::new(cutter, posture);
    let surface = feed_curvature(curvature, cc);
    // The curvature at the contact nearly always gives the width at once; the exact outline
    // decides.
    let osculating = osculating_width(cutter, posture, &surface, cusp).min(max_step_over);
    match cusp_height_between(&outline, &outline, osculating, &surface) {
        Cusp::Height(h) if h <= cusp && (h >= NEARLY * cusp || osculating == max_step_over) => osculating,
        _ => strip_width(cutter, posture, &surface, cusp, max_step_over),
    }
}

#[cfg(test)]
#[path = "../tests/unit/cusp.rs"]
mod tests;
