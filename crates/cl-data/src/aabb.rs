//! Axis-aligned boxes.

use nalgebra::{Isometry3, Point3, Vector3};

/// Axis-aligned box, closed on every side. The empty box has `min > max`; it is [`Aabb::EMPTY`] and
/// the union of nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: Point3<f64>,
    /// Largest coordinates.
    pub max: Point3<f64>,
}

impl Aabb {
    /// Contains no point; the neutral element of [`Aabb::union`].
    pub const EMPTY: Self = Self {
        min: Point3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        max: Point3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// Returns the smallest box that contains all points.
    #[inline]
    pub fn of_points<'a>(points: impl IntoIterator<Item = &'a Point3<f64>>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::with_point)
    }

    /// Returns the smallest box that contains this one and `p`.
    #[inline]
    #[must_use]
    pub fn with_point(self, p: &Point3<f64>) -> Self {
        Self { min: self.min.inf(p), max: self.max.sup(p) }
    }

    /// Returns the smallest box that contains both.
    #[inline]
    #[must_use]
    pub fn union(self, other: &Self) -> Self {
        Self { min: self.min.inf(&other.min), max: self.max.sup(&other.max) }
    }

    /// Returns the box moved outward by `by` on every side.
    #[inline]
    #[must_use]
    pub fn dilated(self, by: f64) -> Self {
        let d = Vector3::repeat(by);
        Self { min: self.min - d, max: self.max + d }
    }

    /// Returns whether no point is inside.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.min.x > self.max.x || self.min.y > self.max.y || self.min.z > self.max.z
    }

    /// Returns whether `p` is inside or on the border.
    #[inline]
    pub fn contains(&self, p: &Point3<f64>) -> bool {
        (0..3).all(|k| self.min[k] <= p[k] && p[k] <= self.max[k])
    }

    /// Returns whether the boxes share a point, borders included.
    #[inline]
    pub fn intersects(&self, other: &Self) -> bool {
        (0..3).all(|k| self.min[k] <= other.max[k] && other.min[k] <= self.max[k])
    }

    /// Returns the midpoint; NaN for the empty box.
    #[inline]
    pub fn center(&self) -> Point3<f64> {
        Point3::from((self.min.coords + self.max.coords) * 0.5)
    }

    /// Returns half of the edge lengths; negative infinite for the empty box.
    #[inline]
    pub fn half_extents(&self) -> Vector3<f64> {
        (self.max - self.min) * 0.5
    }

    /// Returns the squared distance from `p` to the box, 0 inside.
    #[inline]
    pub fn distance_sq(&self, p: &Point3<f64>) -> f64 {
        let below = (self.min - p).sup(&Vector3::zeros());
        let above = (p - self.max).sup(&Vector3::zeros());
        (below + above).norm_squared()
    }

    /// Returns the smallest box around this one after the motion `to_from`. The empty box stays
    /// empty.
    #[must_use]
    pub fn transformed(&self, to_from: &Isometry3<f64>) -> Self {
        if self.is_empty() {
            return Self::EMPTY;
        }
        let c = to_from * self.center();
        let m = to_from.rotation.to_rotation_matrix().into_inner().abs();
        let h = m * self.half_extents();
        Self { min: c - h, max: c + h }
    }
}
