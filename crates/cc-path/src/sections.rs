//! Sections by a family of surfaces in space, which give every place a level.

use nalgebra::{Point3, Unit, Vector3};

/// Sections of a surface by a family of surfaces in space, which give every point a level.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Sections {
    /// By parallel planes.
    ParallelPlanes(ParallelPlanes),
    /// By coaxial cylinders.
    CylindricalSections(CylindricalSections),
}

/// Passes are sections of the surface by parallel planes; the level is the distance from `origin`
/// along `normal`, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParallelPlanes {
    /// Point of the plane of level 0, workpiece frame.
    pub origin: Point3<f64>,
    /// Direction of rising level, across the passes.
    pub normal: Unit<Vector3<f64>>,
    /// Lowest level to be cut; the region's lowest where there is none.
    pub from: Option<f64>,
    /// Highest level to be cut; the region's highest where there is none.
    pub to: Option<f64>,
}

/// Passes are sections of the surface by cylinders about one axis; the level is the radius, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CylindricalSections {
    /// Point of the axis, workpiece frame.
    pub axis_origin: Point3<f64>,
    /// Direction of the axis; which of its two senses does not matter.
    pub axis_direction: Unit<Vector3<f64>>,
    /// Smallest radius to be cut, mm.
    pub from_radius: f64,
    /// Largest radius to be cut, mm.
    pub to_radius: f64,
}

impl Sections {
    /// Level of a place, mm: distance along the normal, or radius.
    pub fn level(&self, p: &Point3<f64>) -> f64 {
        match self {
            Self::ParallelPlanes(s) => s.normal.dot(&(p - s.origin)),
            Self::CylindricalSections(s) => s.radial(p).norm(),
        }
    }

    /// Direction in which the level rises fastest, by 1 per mm; `None` on the axis, where it rises
    /// all round.
    pub fn gradient(&self, p: &Point3<f64>) -> Option<Unit<Vector3<f64>>> {
        match self {
            Self::ParallelPlanes(s) => Some(s.normal),
            Self::CylindricalSections(s) => Unit::try_new(s.radial(p), 0.0),
        }
    }

    /// How fast the level rises along a surface with this normal, in the steepest direction: 1
    /// across the levels, 0 where the surface lies along them.
    pub fn slope(&self, p: &Point3<f64>, normal: &Unit<Vector3<f64>>) -> f64 {
        // The sine of the angle between gradient and normal; on the axis every direction rises
        // by 1.
        self.gradient(p).map_or(1.0, |g| g.cross(normal).norm())
    }

    /// Levels to be cut: lowest and highest, infinite where the region decides.
    pub fn range(&self) -> (f64, f64) {
        match self {
            Self::ParallelPlanes(s) => (s.from.unwrap_or(f64::NEG_INFINITY), s.to.unwrap_or(f64::INFINITY)),
            Self::CylindricalSections(s) => (s.from_radius, s.to_radius),
        }
    }

    /// Whether the level is linear between two points.
    pub(crate) fn is_linear(&self) -> bool {
        matches!(self, Self::ParallelPlanes(_))
    }

    /// How far the level at the middle of an edge is from the mean of those at its ends, mm.
    pub(crate) fn bend(&self, a: &Point3<f64>, b: &Point3<f64>) -> f64 {
        if self.is_linear() {
            return 0.0;
        }
        (self.level(&nalgebra::center(a, b)) - 0.5 * (self.level(a) + self.level(b))).abs()
    }

    /// Fraction of the way from `a` to `b` at which the level is `level`, in 0..1.
    ///
    /// Exact up to rounding where one end is below and the other is not; where both are on the same
    /// side, the end whose level is nearer.
    pub(crate) fn crossing(&self, a: &Point3<f64>, b: &Point3<f64>, level: f64) -> f64 {
        let (la, lb) = (self.level(a), self.level(b));
        if (la >= level) == (lb >= level) {
            return if (la - level).abs() <= (lb - level).abs() { 0.0 } else { 1.0 };
        }
        let t = match self {
            Self::ParallelPlanes(_) => (level - la) / (lb - la),
            Self::CylindricalSections(s) if la < level => s.exit(a, b, level),
            Self::CylindricalSections(s) => 1.0 - s.exit(b, a, level),
        };
        t.clamp(0.0, 1.0)
    }
}

impl CylindricalSections {
    /// From the axis to `p`, at right angles to the axis.
    pub(crate) fn radial(&self, p: &Point3<f64>) -> Vector3<f64> {
        let d = p - self.axis_origin;
        d - self.axis_direction.into_inner() * self.axis_direction.dot(&d)
    }

    /// Where the way from `inside` to `outside` leaves the cylinder: the positive root of
    /// `|radial(inside) + t·step|² = radius²`, in the form that does not cancel.
    fn exit(&self, inside: &Point3<f64>, outside: &Point3<f64>, radius: f64) -> f64 {
        let start = self.radial(inside);
        let step = self.radial(outside) - start;
        let (a, b, c) = (step.norm_squared(), start.dot(&step), start.norm_squared() - radius * radius);
        let root = (b * b - a * c).max(0.0).sqrt();
        if b > 0.0 { -c / (b + root) } else { (root - b) / a }
    }
}

#[cfg(test)]
#[path = "../tests/unit/sections.rs"]
mod tests;
