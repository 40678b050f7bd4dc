//! Convex bodies dilated by a ball: frusta, boxes, polyhedra.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};

use crate::aabb::Aabb;
use crate::polyhedron::ConvexPolyhedron;

/// Solid frustum about the z axis of its own frame, dilated by a ball: the shape of every turned
/// body of a tool assembly and of every cutter's test body.
///
/// The frustum is closed, from `z_low` (radius `radius_low`) to `z_high` ≥ `z_low` (radius
/// `radius_high`); the body is every point within `rounding` of it. With equal radii and rounding 0
/// it is a cylinder, with radii 0 a capsule. All lengths are mm and not negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundFrustum {
    /// Lower end of the undilated frustum.
    pub z_low: f64,
    /// Upper end of the undilated frustum.
    pub z_high: f64,
    /// Radius at `z_low`.
    pub radius_low: f64,
    /// Radius at `z_high`.
    pub radius_high: f64,
    /// Radius of the ball.
    pub rounding: f64,
}

/// Solid box about the origin of its own frame, dilated by a ball. All lengths are mm and not
/// negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundBox {
    /// Half of the edge lengths of the undilated box.
    pub half_extents: Vector3<f64>,
    /// Radius of the ball.
    pub rounding: f64,
}

/// Convex polyhedron dilated by a ball, in its own frame: the hull of a mesh. Copies share the
/// polyhedron.
#[derive(Clone, Debug, PartialEq)]
pub struct RoundHull {
    /// The undilated polyhedron.
    pub core: Arc<ConvexPolyhedron>,
    /// Radius of the ball, mm, not negative.
    pub rounding: f64,
}

/// A convex body in its own frame.
///
/// Exhaustive, so that a new one is handled everywhere: a body that is passed over would be a
/// collision unseen.
#[derive(Clone, Debug, PartialEq)]
pub enum Solid {
    /// Turned body.
    Frustum(RoundFrustum),
    /// Box.
    Box(RoundBox),
    /// Convex polyhedron.
    Hull(RoundHull),
}

/// A solid fixed in a frame: the tool's (origin at the tip, z toward the spindle) or a machine
/// link's.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedSolid {
    /// Name in findings.
    pub name: String,
    /// Shape.
    pub solid: Solid,
    /// Pose of the solid's frame.
    pub frame_from_solid: Isometry3<f64>,
}

impl RoundFrustum {
    /// Returns the distance from `p` (own frame) to the undilated frustum, 0 inside.
    pub fn core_distance(&self, p: &Point3<f64>) -> f64 {
        let radial = p.x.hypot(p.y);
        // In the (radial, z) half plane the frustum is a trapezoid with one slanted side.
        if p.z <= self.z_low {
            // The slanted side can be nearer than the bottom only where it widens downward, and it
            // never does below.
            let bottom = (radial - self.radius_low).max(0.0).hypot(self.z_low - p.z);
            return bottom.min(self.slant_distance(radial, p.z));
        }
        if p.z >= self.z_high {
            let top = (radial - self.radius_high).max(0.0).hypot(p.z - self.z_high);
            return top.min(self.slant_distance(radial, p.z));
        }
        let wall =
            self.radius_low + (self.radius_high - self.radius_low) * (p.z - self.z_low) / (self.z_high - self.z_low);
        if radial <= wall { 0.0 } else { self.slant_distance(radial, p.z) }
    }

    /// Returns the distance in the (radial, z) half plane to the segment from (`radius_low`,
    /// `z_low`) to (`radius_high`, `z_high`).
    fn slant_distance(&self, radial: f64, z: f64) -> f64 {
        let (along_r, along_z) = (self.radius_high - self.radius_low, self.z_high - self.z_low);
        let length_sq = along_r * along_r + along_z * along_z;
        let (dr, dz) = (radial - self.radius_low, z - self.z_low);
        let t = if length_sq > 0.0 { ((dr * along_r + dz * along_z) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
        (dr - t * along_r).hypot(dz - t * along_z)
    }

    /// Returns the distance from a point of the undilated frustum (own frame) to its outside, 0 for
    /// points that are not in it.
    pub fn core_depth(&self, p: &Point3<f64>) -> f64 {
        let height = self.z_high - self.z_low;
        if height <= 0.0 {
            return 0.0;
        }
        let widening = (self.radius_high - self.radius_low) / height;
        let wall = self.radius_low + widening * (p.z - self.z_low);
        let to_wall = (wall - p.x.hypot(p.y)) / widening.hypot(1.0);
        to_wall.min(p.z - self.z_low).min(self.z_high - p.z).max(0.0)
    }

    /// Returns the smallest box around the dilated body, own frame.
    pub fn aabb(&self) -> Aabb {
        let r = self.radius_low.max(self.radius_high);
        Aabb { min: Point3::new(-r, -r, self.z_low), max: Point3::new(r, r, self.z_high) }.dilated(self.rounding)
    }
}

impl RoundBox {
    /// Returns the distance from `p` (own frame) to the undilated box, 0 inside.
    pub fn core_distance(&self, p: &Point3<f64>) -> f64 {
        (p.coords.abs() - self.half_extents).sup(&Vector3::zeros()).norm()
    }
}

impl Solid {
    /// Returns the distance from `p` (own frame) to the body, negative down to −rounding inside the
    /// dilated skin, −rounding deeper.
    pub fn distance(&self, p: &Point3<f64>) -> f64 {
        self.core_distance(p) - self.rounding()
    }

    /// Returns the distance from `p` (own frame) to the undilated body, 0 inside. It is convex and
    /// changes by at most the distance that `p` moves.
    pub fn core_distance(&self, p: &Point3<f64>) -> f64 {
        match self {
            Self::Frustum(f) => f.core_distance(p),
            Self::Box(b) => b.core_distance(p),
            Self::Hull(h) => h.core.nearest(p).distance,
        }
    }

    /// Returns the radius of the largest ball about `p` (own frame) within the dilated body; for a
    /// point outside, its distance from the body, negative. It is concave, and changes by at most
    /// the distance that `p` moves.
    pub fn depth(&self, p: &Point3<f64>) -> f64 {
        let outside = self.core_distance(p);
        if outside > 0.0 {
            return self.rounding() - outside;
        }
        let within = match self {
            Self::Frustum(f) => f.core_depth(p),
            Self::Box(b) => (b.half_extents - p.coords.abs()).min().max(0.0),
            Self::Hull(h) => (-h.core.height(p).0).max(0.0),
        };
        self.rounding() + within
    }

    /// Returns the radius of the dilating ball, mm.
    pub fn rounding(&self) -> f64 {
        match self {
            Self::Frustum(f) => f.rounding,
            Self::Box(b) => b.rounding,
            Self::Hull(h) => h.rounding,
        }
    }

    /// Returns the body dilated by `by` more (mm, may be negative down to −rounding).
    #[must_use]
    pub fn dilated(&self, by: f64) -> Self {
        let mut solid = self.clone();
        let rounding = match &mut solid {
            Self::Frustum(f) => &mut f.rounding,
            Self::Box(b) => &mut b.rounding,
            Self::Hull(h) => &mut h.rounding,
        };
        *rounding = (*rounding + by).max(0.0);
        solid
    }

    /// Returns the smallest box around the dilated body, own frame.
    pub fn aabb(&self) -> Aabb {
        match self {
            Self::Frustum(f) => f.aabb(),
            Self::Box(b) => {
                Aabb { min: Point3::from(-b.half_extents), max: Point3::from(b.half_extents) }.dilated(b.rounding)
            }
            Self::Hull(h) => h.core.aabb().dilated(h.rounding),
        }
    }

    /// Returns a point of the undilated body, for testing whether a body that touches nothing is
    /// wholly inside another.
    pub fn interior_point(&self) -> Point3<f64> {
        match self {
            Self::Frustum(f) => Point3::new(0.0, 0.0, 0.5 * (f.z_low + f.z_high)),
            Self::Box(_) => Point3::origin(),
            Self::Hull(h) => h.core.center(),
        }
    }
}

#[cfg(test)]
#[path = "../tests/unit/solid.rs"]
mod tests;
