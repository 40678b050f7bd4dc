//! Curvature of the outline that a cutter shows in the direction of feed.

use facemill_cl_data::Posture;

use crate::contact::canonical;
use crate::cutter::Cutter;

/// Curvature at the contact point of the cutter's outline seen along the feed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SilhouetteCurvature {
    /// The bottom lies flat in the tangent plane: the outline is straight there, curvature 0.
    Flat,
    /// Curvature, 1/mm, positive.
    Round(f64),
    /// A sharp edge seen end on: the outline has a corner, its curvature is without bound.
    Sharp,
}

impl SilhouetteCurvature {
    /// Radius of curvature, mm: infinite where flat, 0 where sharp.
    pub fn radius(&self) -> f64 {
        match self {
            Self::Flat => f64::INFINITY,
            Self::Round(k) => 1.0 / k,
            Self::Sharp => 0.0,
        }
    }
}

/// Curvature, at the contact point, of the outline that the cutter shows in the direction of feed.
///
/// At the contact the torus has the principal curvatures 1/r along Et′ and sin α/(R − r + r·sin α)
/// across it, and the outline of a surface seen along a direction f in it has the curvature
/// det(II)/II(f, f) (Koenderink 1984). With the feed at the angle β from Et′ that is `sin α / ((R −
/// r)·cos²β + r·sin α)`, which for r = 0 is the curvature of the ellipse the rim is seen as, and
/// for a ball 1/r. A face mill at β = 0 thus cuts like a ball of radius about R/sin α.
///
/// Exact. Degenerate: the untilted cutter is [`Flat`](SilhouetteCurvature::Flat) unless it is a
/// ball; a sharp edge seen from its side (r = 0, β = ±90°) is
/// [`Sharp`](SilhouetteCurvature::Sharp). Where the curvature would overflow it is `Sharp`, where
/// it would underflow `Flat`.
pub fn silhouette_curvature(cutter: &Cutter, posture: Posture) -> SilhouetteCurvature {
    let posture = canonical(posture);
    let (sin, cos) = (posture.tilt.sin(), posture.rotate.cos());
    if cutter.rim_radius() == 0.0 {
        return SilhouetteCurvature::Round(1.0 / cutter.corner_radius());
    }
    if sin <= 0.0 {
        return SilhouetteCurvature::Flat;
    }
    let curvature = sin / (cutter.rim_radius() * cos * cos + cutter.corner_radius() * sin);
    if curvature.is_finite() && curvature > 0.0 {
        // cos β at β = 90° is a rounding error and no ellipse: narrower than 1e-9 mm it is a
        // corner.
        if curvature < 1e9 { SilhouetteCurvature::Round(curvature) } else { SilhouetteCurvature::Sharp }
    } else if curvature == 0.0 {
        SilhouetteCurvature::Flat
    } else {
        SilhouetteCurvature::Sharp
    }
}
