//! Curvature of the outline that a cutter shows in the direction of feed.

use facemill_cl_data::Posture;

use crate::contact::canonical;
use crate::cutter::Cutter;
use crate::feed_curvature::FeedCurvature;

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

/// Curvature, at the contact, of what a cutter leaves over a surface across the feed, along which
/// it keeps contact in one posture or another: det D/D_xx with D the sum of the curvatures of
/// cutter and surface, x along the feed; 1/mm. The ridge of two such passes a step s apart is
/// `s²/8` times this, to the second order.
///
/// Infinite for an edge seen end on. An untilted cutter other than a ball, and one that the surface
/// bends to at least as much as the cutter bends itself along the feed (D_xx ≤ 0), count as on a
/// straight feed: the curvature of the [silhouette](silhouette_curvature) and that across the feed.
///
/// Source: docs/method.md, outline along the feed, and cusp.
pub fn envelope_curvature(cutter: &Cutter, posture: Posture, surface: &FeedCurvature) -> f64 {
    let straight = match silhouette_curvature(cutter, posture) {
        SilhouetteCurvature::Flat => return surface.across,
        SilhouetteCurvature::Round(k) => k + surface.across,
        SilhouetteCurvature::Sharp => return f64::INFINITY,
    };
    let posture = canonical(posture);
    let (sin, (turn_sin, turn_cos)) = (posture.tilt.sin(), posture.rotate.sin_cos());
    let (rim, r) = (cutter.rim_radius(), cutter.corner_radius());
    // The cutter's curvatures times r, which may be 0: 1 over the corner, this around the rim.
    let around = if rim == 0.0 { 1.0 } else { r * sin / (rim + r * sin) };
    let along = turn_cos * turn_cos + around * turn_sin * turn_sin;
    // Where the silhouette runs along the feed per distance aside.
    let slant = (around - 1.0) * turn_cos * turn_sin / along;
    let over = along + r * surface.along;
    if over.is_nan() || over <= 0.0 {
        return straight;
    }
    let slope = surface.along * slant + surface.twist;
    straight + surface.along * slant * slant + 2.0 * surface.twist * slant - slope * slope * r / over
}
