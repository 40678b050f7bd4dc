//! Proofs that boxes are farther than a distance from a body.

use facemill_cl_data::{Aabb, RoundFrustum, Solid};
use nalgebra::{Isometry3, Point3, Vector3};

/// How a box lies to the undilated body of a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Gap {
    /// A plane between them proves at least this distance.
    AtLeast(f64),
    /// Two points of them are no farther apart than the requested distance.
    Within,
    /// Neither was found.
    Unknown,
}

/// Looks for a proof that a box is farther than `distance` from the undilated body of a solid.
///
/// Projecting a point from one convex body onto the other and back closes in on the nearest points
/// of the two. Each pair proposes the direction between its points, and whatever direction that is,
/// the extents of both bodies along it are a proof, so that rounding and slow convergence cost only
/// yield, never truth.
pub(crate) fn gap(
    body: &Aabb,
    solid: &Solid,
    frame_from_solid: &Isometry3<f64>,
    distance: f64,
    max_steps: usize,
) -> Gap {
    let (center, half) = (body.center(), body.half_extents());
    let mut on_box = center;
    for _ in 0..max_steps {
        let on_core = frame_from_solid * nearest_of_core(solid, &frame_from_solid.inverse_transform_point(&on_box));
        on_box = on_core.coords.sup(&body.min.coords).inf(&body.max.coords).into();
        let between = on_box - on_core;
        let length = between.norm();
        if length <= distance {
            return Gap::Within;
        }
        let away = between / length;
        let reach = core_support(solid, &frame_from_solid.inverse_transform_vector(&away));
        let proven = away.dot(&(center - frame_from_solid.translation.vector).coords) - away.abs().dot(&half) - reach;
        if proven > distance {
            return Gap::AtLeast(proven);
        }
    }
    Gap::Unknown
}

/// Nearest point of the undilated body, own frame.
fn nearest_of_core(solid: &Solid, p: &Point3<f64>) -> Point3<f64> {
    match solid {
        Solid::Frustum(f) => nearest_of_frustum(f, p),
        Solid::Box(b) => p.coords.sup(&-b.half_extents).inf(&b.half_extents).into(),
        Solid::Hull(h) => h.core.nearest(p).point,
    }
}

fn nearest_of_frustum(f: &RoundFrustum, p: &Point3<f64>) -> Point3<f64> {
    let radial = p.x.hypot(p.y);
    let (r, z) = nearest_of_profile(f, radial, p.z);
    if radial > 0.0 { Point3::new(p.x * (r / radial), p.y * (r / radial), z) } else { Point3::new(r, 0.0, z) }
}

/// Nearest point of the frustum's half section, in (radial, z).
fn nearest_of_profile(f: &RoundFrustum, radial: f64, z: f64) -> (f64, f64) {
    let (dr, dz) = (f.radius_high - f.radius_low, f.z_high - f.z_low);
    let length_sq = dr * dr + dz * dz;
    // The slanted side, the ends, and the point itself where it is inside.
    let t = if length_sq > 0.0 {
        (((radial - f.radius_low) * dr + (z - f.z_low) * dz) / length_sq).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let mut best = (f.radius_low + t * dr, f.z_low + t * dz);
    let mut consider = |r: f64, h: f64| {
        if (radial - r).hypot(z - h) < (radial - best.0).hypot(z - best.1) {
            best = (r, h);
        }
    };
    consider(radial.min(f.radius_low), f.z_low);
    consider(radial.min(f.radius_high), f.z_high);
    if f.z_low < z && z < f.z_high {
        let wall = f.radius_low + dr * ((z - f.z_low) / dz);
        consider(radial.min(wall), z);
    }
    best
}

/// Largest coordinate of the undilated body along a direction, own frame.
fn core_support(solid: &Solid, direction: &Vector3<f64>) -> f64 {
    match solid {
        Solid::Frustum(f) => {
            let across = direction.x.hypot(direction.y);
            let low = f.z_low * direction.z + f.radius_low * across;
            low.max(f.z_high * direction.z + f.radius_high * across)
        }
        Solid::Box(b) => direction.abs().dot(&b.half_extents),
        Solid::Hull(h) => direction.dot(&h.core.support(direction).coords),
    }
}

#[cfg(test)]
#[path = "../tests/unit/separation.rs"]
mod tests;
