//! Cusps between neighbouring passes, and step-overs.

pub mod cut_point;
pub mod neighbours;
pub mod strips;

use facemill_cl_data::{CcPoint, Posture};
use facemill_surface_model::CurvatureTensor;
use facemill_tool_model::{
    Cusp, Cutter, Outline, SilhouetteCurvature, cusp_height_between, silhouette_curvature, step_over_for_cusp,
};

use crate::cusp::cut_point::{CutPoint, Strip};
use crate::cusp::neighbours::{CutPass, Neighbour, NeighbourReach, Neighbours};
use crate::search::bezier::SearchCurve;

/// Ridge between a point of a pass and the neighbouring pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ridge {
    /// Arc length to the neighbouring pass across the feed, mm.
    pub step_over: f64,
    /// Cusp that is left.
    pub cusp: Cusp,
    /// Curvature of the surface across the feed between the two, 1/mm, positive where the part is
    /// convex.
    pub curvature: f64,
    /// Outline of the neighbouring pass in this point's frame (y to the left of the feed, z along
    /// the normal).
    pub neighbour: Outline,
}

/// Returns the ridge between every point of `pass` and `neighbour`, from the exact outlines of the
/// tilted cutter; `None` where the plane across the feed does not meet the neighbour within `reach`
/// mm.
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
        let cusp = cusp_height_between(right, left, step_over, curvature);
        // This point lies to the right of a left neighbour.
        let from_neighbour = if beside.is_left { -beside.arc } else { beside.arc };
        let neighbour = seen_along_circle(&others, from_neighbour, curvature);
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
    let across = curvature.and_then(|t| t.normal_curvature(&cc.left())).unwrap_or(0.0);
    // The outline's osculating circle nearly always gives the width at once; its exact form
    // decides.
    let bend = match silhouette_curvature(cutter, posture) {
        SilhouetteCurvature::Flat => across,
        SilhouetteCurvature::Round(k) => k + across,
        SilhouetteCurvature::Sharp => f64::INFINITY,
    };
    let circle = if bend > 0.0 { (8.0 * cusp / bend).sqrt().min(max_step_over) } else { max_step_over };
    if cusp_height_between(&outline, &outline, circle, across).is_within(cusp) {
        return circle;
    }
    step_over_for_cusp(&outline, &outline, cusp, across, circle)
}

#[cfg(test)]
#[path = "../tests/unit/cusp.rs"]
mod tests;
