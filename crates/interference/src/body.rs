//! Undilated convex bodies placed in the mesh frame: distance with its gradient, and support
//! points.

pub(crate) mod bound;
pub(crate) mod edge;
pub(crate) mod facet;
pub(crate) mod lanes;
use facemill_cl_data::{ConvexPolyhedron, RoundBox, RoundFrustum, Solid};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use crate::body::lanes::{Lanes, Lanes3, N};

/// A closed convex body. Its distance f is convex and 1-Lipschitz, so f(p) + g·(q − p) bounds f(q)
/// from below for every q.
pub(crate) trait Body {
    /// Distance f from `p` (0 inside) and its gradient g there: the unit vector away from the
    /// nearest point of the body, zero inside.
    fn distance(&self, p: &Point3<f64>) -> (f64, Vector3<f64>);

    /// The same at eight points: distances, and the components of the gradients along `normal`.
    /// Where the distance is dear it may be a lower bound that is convex and 1-Lipschitz, too, with
    /// that one's gradient.
    fn distances(&self, p: &Lanes3, normal: &Lanes3) -> (Lanes, Lanes);

    /// A point of the body farthest in the direction `along`, which need not be of unit length.
    fn support(&self, along: &Vector3<f64>) -> Point3<f64>;

    /// The body moved.
    fn moved(&self, by: &Vector3<f64>) -> Self;
}

/// A solid's core as the body kind that fits it.
pub(crate) enum Placed<'a> {
    Cylinder(Cylinder),
    Frustum(Frustum),
    Block(Block),
    Hull(Hull<'a>),
}

impl<'a> Placed<'a> {
    pub(crate) fn new(solid: &'a Solid, mesh_from_solid: &Isometry3<f64>) -> Self {
        match solid {
            Solid::Frustum(f) if f.radius_low == f.radius_high || f.z_high <= f.z_low => {
                Self::Cylinder(Cylinder::new(f, mesh_from_solid))
            }
            Solid::Frustum(f) => Self::Frustum(Frustum::new(f, mesh_from_solid)),
            Solid::Box(b) => Self::Block(Block::new(b, mesh_from_solid)),
            Solid::Hull(h) => Self::Hull(Hull { core: &h.core, mesh_from_solid: *mesh_from_solid }),
        }
    }
}

/// Evaluates an expression for the body in a [`Placed`]: compiled for each kind of body, as a
/// generic function is.
macro_rules! for_body {
    ($placed:expr, |$body:ident| $value:expr) => {
        match $placed {
            $crate::body::Placed::Cylinder($body) => $value,
            $crate::body::Placed::Frustum($body) => $value,
            $crate::body::Placed::Block($body) => $value,
            $crate::body::Placed::Hull($body) => $value,
        }
    };
}
pub(crate) use for_body;

/// Solid cylinder, or disc where its height is 0.
#[derive(Clone, Copy)]
pub(crate) struct Cylinder {
    /// Centre of the lower end.
    base: Point3<f64>,
    axis: Vector3<f64>,
    radius: f64,
    height: f64,
}

impl Cylinder {
    fn new(f: &RoundFrustum, mesh_from_solid: &Isometry3<f64>) -> Self {
        Self {
            base: mesh_from_solid * Point3::new(0.0, 0.0, f.z_low),
            axis: mesh_from_solid * Vector3::z(),
            radius: f.radius_low.max(f.radius_high),
            height: (f.z_high - f.z_low).max(0.0),
        }
    }
}

impl Body for Cylinder {
    #[inline(always)]
    fn distance(&self, p: &Point3<f64>) -> (f64, Vector3<f64>) {
        let from_base = p - self.base;
        let z = from_base.dot(&self.axis);
        let beside = from_base - self.axis * z;
        let radial_sq = beside.norm_squared();
        let above = if z < 0.0 { z } else { (z - self.height).max(0.0) };
        if radial_sq <= self.radius * self.radius {
            return (above.abs(), self.axis * sign(above));
        }
        let radial = radial_sq.sqrt();
        let out = radial - self.radius;
        let distance = (out * out + above * above).sqrt();
        if distance > 0.0 {
            (distance, (beside * (out / radial) + self.axis * above) / distance)
        } else {
            (distance, Vector3::zeros())
        }
    }

    #[inline(always)]
    fn distances(&self, p: &Lanes3, normal: &Lanes3) -> (Lanes, Lanes) {
        let (b, a) = (&self.base, &self.axis);
        let (mut distances, mut along) = ([0.0; N], [0.0; N]);
        for k in 0..N {
            let (x, y, z) = (p.x[k] - b.x, p.y[k] - b.y, p.z[k] - b.z);
            let height = x * a.x + y * a.y + z * a.z;
            let (u, v, w) = (x - a.x * height, y - a.y * height, z - a.z * height);
            let radial = (u * u + v * v + w * w).sqrt();
            let out = positive(radial - self.radius);
            let above = positive(height - self.height) - positive(-height);
            let distance = (out * out + above * above).sqrt();
            let (nx, ny, nz) = (normal.x[k], normal.y[k], normal.z[k]);
            let beside = u * nx + v * ny + w * nz;
            let up = a.x * nx + a.y * ny + a.z * nz;
            distances[k] = distance;
            along[k] = slope(beside, out, radial, up * above, distance);
        }
        (distances, along)
    }

    #[inline(always)]
    fn moved(&self, by: &Vector3<f64>) -> Self {
        Self { base: self.base + by, ..*self }
    }

    #[inline(always)]
    fn support(&self, along: &Vector3<f64>) -> Point3<f64> {
        let up = along.dot(&self.axis);
        let end = if up > 0.0 { self.height } else { 0.0 };
        self.base + self.axis * end + unit_across(along, &self.axis) * self.radius
    }
}

/// Solid frustum with different radii and a positive height.
#[derive(Clone, Copy)]
pub(crate) struct Frustum {
    base: Point3<f64>,
    axis: Vector3<f64>,
    radius_low: f64,
    radius_high: f64,
    height: f64,
    /// Length of the slanted side, and its unit direction (radial, along the axis).
    slant: f64,
    slant_radial: f64,
    slant_axial: f64,
}

impl Frustum {
    fn new(f: &RoundFrustum, mesh_from_solid: &Isometry3<f64>) -> Self {
        let (widening, height) = (f.radius_high - f.radius_low, f.z_high - f.z_low);
        let slant = widening.hypot(height);
        Self {
            base: mesh_from_solid * Point3::new(0.0, 0.0, f.z_low),
            axis: mesh_from_solid * Vector3::z(),
            radius_low: f.radius_low,
            radius_high: f.radius_high,
            height,
            slant,
            slant_radial: widening / slant,
            slant_axial: height / slant,
        }
    }

    /// Offset (radial, along the axis) of a point of the half plane from its nearest point of the
    /// trapezoid.
    #[inline(always)]
    fn offset(&self, radial: f64, z: f64) -> (f64, f64) {
        if z < 0.0 && radial <= self.radius_low {
            return (0.0, z);
        }
        if z > self.height && radial <= self.radius_high {
            return (0.0, z - self.height);
        }
        let (out, up) = (radial - self.radius_low, z);
        let beyond = out * self.slant_axial - up * self.slant_radial;
        if beyond <= 0.0 && (0.0..=self.height).contains(&z) {
            return (0.0, 0.0);
        }
        let along = (out * self.slant_radial + up * self.slant_axial).clamp(0.0, self.slant);
        (out - along * self.slant_radial, up - along * self.slant_axial)
    }

    /// The same, all cases computed and one chosen.
    #[inline(always)]
    fn offset_without_branches(&self, radial: f64, z: f64) -> (f64, f64) {
        let (out, up) = (radial - self.radius_low, z);
        let beyond = out * self.slant_axial - up * self.slant_radial;
        let along = (out * self.slant_radial + up * self.slant_axial).max(0.0).min(self.slant);
        let side = (out - along * self.slant_radial, up - along * self.slant_axial);
        let is_below = (z < 0.0) & (radial <= self.radius_low);
        let is_above = (z > self.height) & (radial <= self.radius_high);
        let is_inside = (beyond <= 0.0) & (z >= 0.0) & (z <= self.height);
        let out = if is_below | is_above | is_inside { 0.0 } else { side.0 };
        let end = if is_below { z } else { z - self.height };
        let up = if is_inside {
            0.0
        } else if is_below | is_above {
            end
        } else {
            side.1
        };
        (out, up)
    }
}

impl Body for Frustum {
    #[inline(always)]
    fn distance(&self, p: &Point3<f64>) -> (f64, Vector3<f64>) {
        let from_base = p - self.base;
        let z = from_base.dot(&self.axis);
        let beside = from_base - self.axis * z;
        let radial = beside.norm();
        let (out, up) = self.offset(radial, z);
        let distance = (out * out + up * up).sqrt();
        if distance == 0.0 {
            return (distance, Vector3::zeros());
        }
        let outward = if radial > 0.0 { beside * (out / radial) } else { Vector3::zeros() };
        (distance, (outward + self.axis * up) / distance)
    }

    #[inline(always)]
    fn distances(&self, p: &Lanes3, normal: &Lanes3) -> (Lanes, Lanes) {
        let (b, a) = (&self.base, &self.axis);
        let (mut distances, mut along) = ([0.0; N], [0.0; N]);
        for k in 0..N {
            let (x, y, z) = (p.x[k] - b.x, p.y[k] - b.y, p.z[k] - b.z);
            let height = x * a.x + y * a.y + z * a.z;
            let (u, v, w) = (x - a.x * height, y - a.y * height, z - a.z * height);
            let radial = (u * u + v * v + w * w).sqrt();
            let (out, above) = self.offset_without_branches(radial, height);
            let distance = (out * out + above * above).sqrt();
            let (nx, ny, nz) = (normal.x[k], normal.y[k], normal.z[k]);
            let beside = u * nx + v * ny + w * nz;
            let up = a.x * nx + a.y * ny + a.z * nz;
            distances[k] = distance;
            along[k] = slope(beside, out, radial, up * above, distance);
        }
        (distances, along)
    }

    #[inline(always)]
    fn moved(&self, by: &Vector3<f64>) -> Self {
        Self { base: self.base + by, ..*self }
    }

    #[inline(always)]
    fn support(&self, along: &Vector3<f64>) -> Point3<f64> {
        let up = along.dot(&self.axis);
        let outward = unit_across(along, &self.axis);
        let reach = outward.dot(along);
        if self.radius_low * reach >= self.radius_high * reach + self.height * up {
            self.base + outward * self.radius_low
        } else {
            self.base + self.axis * self.height + outward * self.radius_high
        }
    }
}

/// Solid box.
#[derive(Clone, Copy)]
pub(crate) struct Block {
    center: Point3<f64>,
    /// Columns are the box's axes.
    axes: Matrix3<f64>,
    half: Vector3<f64>,
}

impl Block {
    fn new(b: &RoundBox, mesh_from_solid: &Isometry3<f64>) -> Self {
        Self {
            center: mesh_from_solid * Point3::origin(),
            axes: mesh_from_solid.rotation.to_rotation_matrix().into_inner(),
            half: b.half_extents,
        }
    }
}

impl Body for Block {
    #[inline(always)]
    fn distance(&self, p: &Point3<f64>) -> (f64, Vector3<f64>) {
        let local = self.axes.tr_mul(&(p - self.center));
        let out = local.zip_map(&self.half, |x, h| x - x.clamp(-h.abs(), h.abs()));
        let distance = out.norm();
        if distance > 0.0 { (distance, self.axes * out / distance) } else { (distance, Vector3::zeros()) }
    }

    #[inline(always)]
    fn distances(&self, p: &Lanes3, normal: &Lanes3) -> (Lanes, Lanes) {
        let (c, m) = (&self.center, &self.axes);
        let half = self.half.abs();
        let (mut distances, mut along) = ([0.0; N], [0.0; N]);
        for k in 0..N {
            let (x, y, z) = (p.x[k] - c.x, p.y[k] - c.y, p.z[k] - c.z);
            let (nx, ny, nz) = (normal.x[k], normal.y[k], normal.z[k]);
            let (mut sum, mut dot) = (0.0, 0.0);
            for i in 0..3 {
                let local = x * m[(0, i)] + y * m[(1, i)] + z * m[(2, i)];
                let out = positive(local - half[i]) - positive(-local - half[i]);
                sum += out * out;
                dot += out * (nx * m[(0, i)] + ny * m[(1, i)] + nz * m[(2, i)]);
            }
            let distance = sum.sqrt();
            distances[k] = distance;
            along[k] = if distance > 0.0 { dot / distance } else { 0.0 };
        }
        (distances, along)
    }

    #[inline(always)]
    fn moved(&self, by: &Vector3<f64>) -> Self {
        Self { center: self.center + by, ..*self }
    }

    #[inline(always)]
    fn support(&self, along: &Vector3<f64>) -> Point3<f64> {
        let local = self.axes.tr_mul(along);
        self.center + self.axes * local.zip_map(&self.half, |x, h| if x < 0.0 { -h } else { h })
    }
}

/// Solid convex polyhedron.
#[derive(Clone, Copy)]
pub(crate) struct Hull<'a> {
    core: &'a ConvexPolyhedron,
    mesh_from_solid: Isometry3<f64>,
}

impl Body for Hull<'_> {
    fn distance(&self, p: &Point3<f64>) -> (f64, Vector3<f64>) {
        let nearest = self.core.nearest(&self.mesh_from_solid.inverse_transform_point(p));
        (nearest.distance, self.mesh_from_solid.rotation * nearest.away)
    }

    /// The largest of the heights above the faces: six operations for each, where the distance
    /// takes sixty.
    #[inline(always)]
    fn distances(&self, p: &Lanes3, normal: &Lanes3) -> (Lanes, Lanes) {
        let (mut heights, mut along) = ([0.0; N], [0.0; N]);
        let (rotation, origin) = (self.mesh_from_solid.rotation, self.mesh_from_solid.translation.vector);
        for face in self.core.faces() {
            let n = rotation * face.normal;
            let offset = face.offset + n.dot(&origin);
            for k in 0..N {
                let height = p.x[k] * n.x + p.y[k] * n.y + p.z[k] * n.z - offset;
                let up = normal.x[k] * n.x + normal.y[k] * n.y + normal.z[k] * n.z;
                let is_higher = height > heights[k];
                heights[k] = if is_higher { height } else { heights[k] };
                along[k] = if is_higher { up } else { along[k] };
            }
        }
        (heights, along)
    }

    fn support(&self, along: &Vector3<f64>) -> Point3<f64> {
        self.mesh_from_solid * self.core.support(&self.mesh_from_solid.inverse_transform_vector(along))
    }

    fn moved(&self, by: &Vector3<f64>) -> Self {
        let mut moved = *self;
        moved.mesh_from_solid.translation.vector += by;
        moved
    }
}

/// The number where it is positive, else 0; NaN stays NaN.
#[inline(always)]
fn positive(x: f64) -> f64 {
    if x < 0.0 { 0.0 } else { x }
}

/// Component along a direction of the gradient that points `out` beside the axis and along it:
/// `beside` is the component of the vector from the axis, `radial` long, and `up` what the axial
/// part adds. 0 where the distance is.
#[inline(always)]
fn slope(beside: f64, out: f64, radial: f64, up: f64, distance: f64) -> f64 {
    let share = if radial > 0.0 { out / radial } else { 0.0 };
    if distance > 0.0 { (beside * share + up) / distance } else { 0.0 }
}

#[inline(always)]
fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// Unit vector of the part of `v` across the unit vector `axis`; zero where there is none.
#[inline(always)]
fn unit_across(v: &Vector3<f64>, axis: &Vector3<f64>) -> Vector3<f64> {
    let across = v - axis * v.dot(axis);
    let norm = across.norm();
    if norm == 0.0 {
        return Vector3::zeros();
    }
    // Nearly along the axis the difference above is mostly rounding, of which a part lies along the
    // axis: taken out again, or a large radius would put the point off the body's end.
    let unit = across / norm;
    let again = unit - axis * unit.dot(axis);
    let norm = again.norm();
    if norm > 0.5 { again / norm } else { Vector3::zeros() }
}

#[cfg(test)]
#[path = "../tests/unit/body.rs"]
pub(crate) mod tests;
