//! How deep a mesh's surface is in a body.

use facemill_cl_data::{RoundBox, RoundFrustum, Solid};
use nalgebra::{Isometry3, Point3};

use crate::query::Interference;
use crate::query::verdict::{Separation, Verdict};

/// How deep a surface is in a body, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Penetration {
    /// Depth, mm.
    pub depth: f64,
    /// Index of a deepest triangle in the mesh.
    pub triangle: u32,
    /// A deepest point of it, mesh frame.
    pub point: Point3<f64>,
}

/// Accuracy of a depth that is found by steps, mm: a tenth of what is promised.
pub(crate) const ACCURACY: f64 = 1e-7;

/// Bound on the steps: every third one halves the bracket.
const MAX_STEPS: usize = 200;

/// The largest penetration of a body normal to the surface, to 1e-6 mm; `None` where the body is
/// free.
///
/// It is the largest distance from a point of the mesh within the dilated body to the body's
/// outside: the radius of the largest ball about a point of the surface that fits into the body. At
/// the deepest point, where it is within a facet, the shortest way out of the body is along the
/// facet's normal; at an edge or corner it is along one of the normals there. So a cutter removes
/// at most so much below the surface, measured across it. Of a cutter's test body it is what the
/// virtual machine calls depth, as long as that is less than the corner radius.
///
/// A body that touches nothing and is wholly inside a closed component counts as deep as it can be:
/// the radius of the largest ball within it.
pub fn penetration(
    mesh: &(impl Interference + ?Sized),
    solid: &Solid,
    mesh_from_solid: &Isometry3<f64>,
) -> Option<Penetration> {
    let Verdict::Hit(witness) = mesh.verdict(solid, mesh_from_solid, None) else { return None };
    let rounding = solid.rounding();
    let at = |depth: f64, s: &Separation| Some(Penetration { depth, triangle: s.triangle, point: s.point });
    let touched = rounding + 1e-9;
    match mesh.core_distance(solid, mesh_from_solid, touched, Some(witness.triangle)) {
        // The body is dilated by the rounding: what of the mesh is outside its core is that much
        // less deep.
        Some(s) if s.distance > 0.0 => at((rounding - s.distance).max(0.0), &s),
        Some(s) => {
            let (depth, s) = mesh.core_depth(solid, mesh_from_solid, s);
            at(rounding + depth, &s)
        }
        None => {
            let depth = rounding + inner_radius(solid);
            Some(Penetration { depth, triangle: witness.triangle, point: witness.point })
        }
    }
}

/// [`Interference::core_depth`] by distances alone, for any mesh; of a polyhedron no more than what
/// it is not above.
pub(crate) fn stepped_depth(
    mesh: &(impl Interference + ?Sized),
    solid: &Solid,
    pose: &Isometry3<f64>,
    met: Separation,
) -> (f64, Separation) {
    if matches!(solid, Solid::Hull(_)) {
        return (inner_radius(solid), met);
    }
    let mut nearest = met;
    innermost(0.0, inner_radius(solid), |t| {
        let hint = Some(nearest.triangle);
        nearest = mesh.core_distance(&eroded(solid, t), pose, f64::INFINITY, hint).unwrap_or(met);
        (nearest.distance, nearest)
    })
}

/// Returns the depth of a surface in a body between two bounds, at most [`ACCURACY`] too large, and
/// the result of `away` there: the distance of the surface from the body made smaller by this
/// depth, 0 where they meet, and its place.
///
/// The smaller body is away from the surface just where it is smaller by more than the depth, and
/// then by at least the excess: so each distance brackets the depth from both sides.
#[inline(always)]
pub(crate) fn innermost<P>(mut low: f64, mut high: f64, mut away: impl FnMut(f64) -> (f64, P)) -> (f64, P) {
    // Nearest to the body that is away, and so the deepest.
    let (mut distance, mut nearest) = away(high);
    if distance <= 0.0 {
        return (high, nearest);
    }
    // Slope of the excess: 1 where one face is nearest, more where the body shrinks at an edge.
    let mut slope = 1.0;
    for step in 0..MAX_STEPS {
        low = f64::max(low, high - distance);
        if high - low <= ACCURACY {
            break;
        }
        let guess = (high - distance / slope + 0.5 * ACCURACY).max(low + 0.5 * ACCURACY);
        let next = if step % 3 == 2 || guess >= high { 0.5 * (low + high) } else { guess };
        let (here, place) = away(next);
        if here <= 0.0 {
            low = next;
        } else {
            slope = ((distance - here) / (high - next)).max(1.0);
            (high, distance, nearest) = (next, here, place);
        }
    }
    (high, nearest)
}

/// Radius of the largest ball within the undilated body, mm; of a polyhedron a bound that is not
/// below it.
pub(crate) fn inner_radius(solid: &Solid) -> f64 {
    match solid {
        Solid::Box(b) => b.half_extents.min(),
        Solid::Hull(h) => h.core.inner_radius_bound(),
        Solid::Frustum(f) => {
            let half_height = 0.5 * (f.z_high - f.z_low);
            if half_height <= 0.0 {
                return 0.0;
            }
            let widening = ((f.radius_high - f.radius_low) / (2.0 * half_height)).abs();
            half_height.min(f.radius_low.max(f.radius_high) / (widening + widening.hypot(1.0)))
        }
    }
}

/// The undilated body without what is nearer than `by` to its outside; `by` is at most the inner
/// radius. A polyhedron stays as it is: what is deepest in it is found by its faces.
pub(crate) fn eroded(solid: &Solid, by: f64) -> Solid {
    match solid {
        Solid::Box(b) => {
            Solid::Box(RoundBox { half_extents: b.half_extents.map(|h| (h - by).max(0.0)), rounding: 0.0 })
        }
        Solid::Frustum(f) => Solid::Frustum(eroded_frustum(f, by)),
        Solid::Hull(_) => solid.dilated(-solid.rounding()),
    }
}

fn eroded_frustum(f: &RoundFrustum, by: f64) -> RoundFrustum {
    let height = f.z_high - f.z_low;
    let widening = if height > 0.0 { (f.radius_high - f.radius_low) / height } else { 0.0 };
    let wall = |z: f64| f.radius_low + widening * (z - f.z_low) - by * widening.hypot(1.0);
    let (mut z_low, mut z_high) = (f.z_low + by, f.z_high - by);
    // Where the wall is beyond the axis, the frustum ends in a point.
    let apex = f.z_low + (by * widening.hypot(1.0) - f.radius_low) / widening;
    if widening > 0.0 {
        z_low = z_low.max(apex);
    } else if widening < 0.0 {
        z_high = z_high.min(apex);
    }
    if z_low > z_high {
        // At the inner radius the ends differ by rounding alone.
        z_low = z_low.min(f.z_high - by).max(f.z_low + by);
        z_high = z_low;
    }
    let radius = |z: f64| wall(z).max(0.0);
    RoundFrustum { z_low, z_high, radius_low: radius(z_low), radius_high: radius(z_high), rounding: 0.0 }
}
