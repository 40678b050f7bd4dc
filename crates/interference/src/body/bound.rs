//! The volume around a piece of the surface: a flat round slab.
//!
//! A piece of a machined surface is nearly flat, and a face mill nearly parallel to it, so that
//! boxes along the axes overlap the mill's disc long before triangles do. A disc-shaped slab that
//! lies in the piece's own plane is about as thin as the piece is curved, and with the convexity of
//! the body's distance one evaluation at its centre bounds the distance of all.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::body::Body;
use crate::body::lanes::{Lanes, Lanes3, N};

/// Every point within `radius` of the axis through `center` along `normal` and within
/// `half_thickness` of `center` along it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slab {
    pub(crate) center: Point3<f64>,
    pub(crate) normal: Vector3<f64>,
    pub(crate) radius: f64,
    pub(crate) half_thickness: f64,
}

/// Eight slabs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slabs {
    pub(crate) center: Lanes3,
    pub(crate) normal: Lanes3,
    pub(crate) radius: Lanes,
    pub(crate) half_thickness: Lanes,
}

impl Slabs {
    /// Slabs that are points at the origin.
    pub(crate) const NONE: Self =
        Self { center: Lanes3::ZERO, normal: Lanes3::ZERO, radius: [0.0; N], half_thickness: [0.0; N] };

    pub(crate) fn set(&mut self, lane: usize, slab: &Slab) {
        self.center.set(lane, &slab.center.coords);
        self.normal.set(lane, &slab.normal);
        (self.radius[lane], self.half_thickness[lane]) = (slab.radius, slab.half_thickness);
    }

    /// Lower bounds of the body's distance over each slab; below 0 where the body reaches into it.
    ///
    /// With the distance f and its slope g at the centre, f + g·(q − c) bounds the distance at q
    /// from below, and over the slab g·(q − c) is at least −(radius·sin + half thickness·|cos|) of
    /// the angle between slope and normal.
    #[inline(always)]
    pub(crate) fn least_distances(&self, body: &impl Body) -> Lanes {
        let (distances, cosines) = body.distances(&self.center, &self.normal);
        let mut bounds = [0.0; N];
        for k in 0..N {
            bounds[k] = distances[k] - self.reach(k, cosines[k]);
        }
        bounds
    }

    /// How far a slab reaches from its centre along a direction of at most unit length whose
    /// component along its normal is `cos`.
    #[inline(always)]
    pub(crate) fn reach(&self, lane: usize, cos: f64) -> f64 {
        let rest = 1.0 - cos * cos;
        let sin = (if rest < 0.0 { 0.0 } else { rest } + SINE_SQ_SLACK).sqrt();
        self.radius[lane] * sin + self.half_thickness[lane] * cos.abs()
    }

    #[inline(always)]
    pub(crate) fn get(&self, lane: usize) -> Slab {
        Slab {
            center: self.center.get(lane).into(),
            normal: self.normal.get(lane),
            radius: self.radius[lane],
            half_thickness: self.half_thickness[lane],
        }
    }
}

/// Relative inflation of a slab: covers the rounding of its own computation (some 1e-16 of the
/// coordinates), and costs nothing measurable in tightness.
const INFLATION: f64 = 1e-13;

/// Part of the area that the sum of the normals must have for the triangles to face one way.
/// Smaller: thin blades get slabs across directions that mean nothing; larger: more nodes pay for
/// their least spread.
const FACING: f64 = 0.5;

/// Added to the squared sine of the angle between slope and slab: covers the rounding of 1 − cos²,
/// which near 0 would otherwise make the sine too small by up to 1.5e-8.
const SINE_SQ_SLACK: f64 = 4e-16;

impl Slab {
    /// A slab around triangles: in the plane across their mean normal, or, where they face both
    /// ways, of their least spread.
    pub(crate) fn around(triangles: &[[Point3<f64>; 3]]) -> Self {
        let points = || triangles.iter().flatten();
        let (mut sum, mut area) = (Vector3::zeros(), 0.0);
        for [a, b, c] in triangles {
            let scaled = (b - a).cross(&(c - a));
            sum += scaled;
            area += scaled.norm();
        }
        let mean = sum.norm();
        if mean > FACING * area {
            Self::across(sum / mean, points())
        } else {
            Self::across(least_spread(points()), points())
        }
    }

    /// A slab across a unit vector around points.
    fn across<'a>(normal: Vector3<f64>, points: impl Iterator<Item = &'a Point3<f64>> + Clone) -> Self {
        let u = normal.cross(&least_axis(&normal)).normalize();
        let v = normal.cross(&u);
        let (mut min, mut max) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for p in points.clone() {
            let q = Vector3::new(u.dot(&p.coords), v.dot(&p.coords), normal.dot(&p.coords));
            (min, max) = (min.inf(&q), max.sup(&q));
        }
        let middle = (min + max) * 0.5;
        let center = Point3::from(u * middle.x + v * middle.y + normal * middle.z);
        let (mut radius_sq, mut half_thickness, mut size) = (0.0f64, 0.0f64, center.coords.amax());
        for p in points {
            let from_center = p - center;
            let height = from_center.dot(&normal);
            radius_sq = radius_sq.max((from_center - normal * height).norm_squared());
            half_thickness = half_thickness.max(height.abs());
            size = size.max(p.coords.amax());
        }
        let slack = INFLATION * size;
        Self { center, normal, radius: radius_sq.sqrt() + slack, half_thickness: half_thickness + slack }
    }

    /// Lower bound of the body's distance over the slab from its distance and slope at the centre.
    #[inline(always)]
    pub(crate) fn least_along(&self, distance: f64, slope: &Vector3<f64>) -> f64 {
        let cos = slope.dot(&self.normal);
        let sin = ((1.0 - cos * cos).max(0.0) + SINE_SQ_SLACK).sqrt();
        distance - (self.radius * sin + self.half_thickness * cos.abs())
    }

    /// Half of the slab's width along a vector, times the vector's length.
    #[inline(always)]
    pub(crate) fn extent(&self, along: &Vector3<f64>) -> f64 {
        let height = along.dot(&self.normal);
        let length_sq = along.norm_squared();
        let across = ((length_sq - height * height).max(0.0) + SINE_SQ_SLACK * length_sq).sqrt();
        self.radius * across + self.half_thickness * height.abs()
    }

    /// Whether the half line from `origin` in the unit direction `along` may meet the slab.
    pub(crate) fn may_meet_ray(&self, origin: &Point3<f64>, along: &Vector3<f64>) -> bool {
        // A half line through the slab's outermost corner must not pass it by for a rounding error.
        let reach = (self.radius + self.half_thickness) * (1.0 + 1e-9);
        let to_center = self.center - origin;
        let ahead = to_center.dot(along);
        ahead >= -reach && (to_center - along * ahead).norm_squared() <= reach * reach
    }
}

/// Unit direction in which the points spread least.
fn least_spread<'a>(points: impl Iterator<Item = &'a Point3<f64>> + Clone) -> Vector3<f64> {
    let n = points.clone().count().max(1) as f64;
    let mean = points.clone().fold(Vector3::zeros(), |sum, p| sum + p.coords) / n;
    let spread = points.fold(Matrix3::zeros(), |sum, p| {
        let q = p.coords - mean;
        sum + q * q.transpose()
    });
    let eigen = spread.symmetric_eigen();
    let axis = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let norm = axis.norm();
    if norm > 0.0 && norm.is_finite() { axis / norm } else { Vector3::z() }
}

/// The coordinate axis that is most across `v`.
fn least_axis(v: &Vector3<f64>) -> Vector3<f64> {
    let mut axis = Vector3::zeros();
    axis[v.iamin()] = 1.0;
    axis
}

#[cfg(test)]
#[path = "../../tests/unit/body/bound.rs"]
mod tests;
