//! Axis-aligned boxes.

use nalgebra::{Isometry3, Point3, Vector3};

/// Axis-aligned box, closed on every side. The empty box has `min > max` and is what
/// [`Aabb::EMPTY`] and a union of nothing give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: Point3<f64>,
    /// Largest coordinates.
    pub max: Point3<f64>,
}

impl Aabb {
    /// Holds no point; the neutral element of [`Aabb::union`].
    pub const EMPTY: Self = Self {
        min: Point3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        max: Point3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// Smallest box that holds all points.
    pub fn of_points<'a>(points: impl IntoIterator<Item = &'a Point3<f64>>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::with_point)
    }

    /// Smallest box that holds this one and `p`.
    #[must_use]
    pub fn with_point(self, p: &Point3<f64>) -> Self {
        Self { min: self.min.inf(p), max: self.max.sup(p) }
    }

    /// Smallest box that holds both.
    #[must_use]
    pub fn union(self, other: &Self) -> Self {
        Self { min: self.min.inf(&other.min), max: self.max.sup(&other.max) }
    }

    /// The box moved outward by `by` on every side.
    #[must_use]
    pub fn dilated(self, by: f64) -> Self {
        let d = Vector3::repeat(by);
        Self { min: self.min - d, max: self.max + d }
    }

    /// Whether no point is inside.
    pub fn is_empty(&self) -> bool {
        self.min.x > self.max.x || self.min.y > self.max.y || self.min.z > self.max.z
    }

    /// Whether `p` is inside or on the border.
    pub fn contains(&self, p: &Point3<f64>) -> bool {
        (0..3).all(|k| self.min[k] <= p[k] && p[k] <= self.max[k])
    }

    /// Whether the boxes share a point, borders included.
    pub fn intersects(&self, other: &Self) -> bool {
        (0..3).all(|k| self.min[k] <= other.max[k] && other.min[k] <= self.max[k])
    }

    /// Midpoint; NaN for the empty box.
    pub fn center(&self) -> Point3<f64> {
        Point3::from((self.min.coords + self.max.coords) * 0.5)
    }

    /// Half of the edge lengths; negative infinite for the empty box.
    pub fn half_extents(&self) -> Vector3<f64> {
        (self.max - self.min) * 0.5
    }

    /// Squared distance from `p` to the box, 0 inside.
    pub fn distance_sq(&self, p: &Point3<f64>) -> f64 {
        let below = (self.min - p).sup(&Vector3::zeros());
        let above = (p - self.max).sup(&Vector3::zeros());
        (below + above).norm_squared()
    }

    /// Smallest box around this one after the motion `to_from`. The empty box stays empty.
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
