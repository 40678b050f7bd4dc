//! Points of a surface with normal and curvature.

use nalgebra::{Matrix2, Point3, Unit, Vector2, Vector3};

/// A point of a smooth surface with its normal and curvatures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point, mm.
    pub point: Point3<f64>,
    /// Unit normal out of the material.
    pub normal: Unit<Vector3<f64>>,
    /// Principal curvatures k1 ≥ k2 in 1/mm; positive where the surface is convex (bends away from
    /// the normal's side).
    pub curvatures: [f64; 2],
    /// Principal directions of k1 and k2, right-handed with the normal; any pair where the
    /// curvatures are equal.
    pub directions: [Unit<Vector3<f64>>; 2],
}

impl SurfacePoint {
    /// The point of a height field z(x, y) over its material below, from its derivatives there.
    pub(crate) fn of_height(point: Point3<f64>, gradient: Vector2<f64>, hessian: Matrix2<f64>) -> Self {
        let normal = Unit::new_normalize(Vector3::new(-gradient.x, -gradient.y, 1.0));
        let first = Unit::new_normalize(Vector3::new(1.0, 0.0, gradient.x));
        let second = Unit::new_unchecked(normal.cross(&first));
        // The second fundamental form needs only the tangents' shadows in the plane.
        let bend = |u: &Vector3<f64>, v: &Vector3<f64>| -(hessian * u.xy()).dot(&v.xy()) * normal.z;
        let [a, b, c] = [bend(&first, &first), bend(&first, &second), bend(&second, &second)];
        let (mean, deviation) = (0.5 * (a + c), (0.5 * (a - c)).hypot(b));
        let angle = 0.5 * (2.0 * b).atan2(a - c);
        let direction = first.into_inner() * angle.cos() + second.into_inner() * angle.sin();
        let direction = Unit::new_normalize(direction);
        Self {
            point,
            normal,
            curvatures: [mean + deviation, mean - deviation],
            directions: [direction, Unit::new_unchecked(normal.cross(&direction))],
        }
    }

    /// The same surface with the material on its other side.
    #[must_use]
    pub(crate) fn flipped(self) -> Self {
        let [k1, k2] = self.curvatures;
        let [d1, d2] = self.directions;
        Self { normal: -self.normal, curvatures: [-k2, -k1], directions: [d2, d1], ..self }
    }
}
