use facemill_cl_data::Aabb;
use nalgebra::{Point3, Unit, Vector3};

use crate::surface::{Surface, SurfacePoint};

/// Intersection of a ray with a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// The point; its distance is measured along the ray from its origin.
    pub point: SurfacePoint,
    /// Whether the ray comes from outside, against the facet's normal.
    pub from_outside: bool,
}

/// Crossing of a ray with a triangle.
struct Crossing {
    hit: RayHit,
    /// Whether it passes exactly through a side or corner, which the neighbours share.
    on_border: bool,
}

/// Signed number of a ray's crossings with the closed components, and whether it is reliable.
enum Count {
    Clear(i32),
    Touching(i32),
    OnSurface,
}

/// A ray prepared for triangles and boxes: sheared to run along an axis (Woop, Benthin, Wald,
/// Watertight ray/triangle intersection, JCGT 2013). Two triangles with a common side compute the
/// same number for it, so no ray slips through between them.
struct Ray {
    origin: Point3<f64>,
    direction: Unit<Vector3<f64>>,
    axes: [usize; 3],
    shear: Vector3<f64>,
}

impl Surface {
    /// Returns the first point that a ray meets within `max_distance` (mm), from whichever side;
    /// among triangles that share it, the one with the lowest index.
    ///
    /// No ray slips through between triangles with a common side. A ray in the plane of a triangle
    /// does not meet it.
    pub fn ray(&self, origin: &Point3<f64>, direction: &Unit<Vector3<f64>>, max_distance: f64) -> Option<RayHit> {
        let ray = Ray::new(*origin, *direction);
        let hit = |t: u32| ray.crossing(self, t).map(|c| c.hit);
        let (triangle, _) =
            self.tree().nearest(max_distance, |b| ray.enters(b), |t, _| hit(t).map(|h| h.point.distance))?;
        hit(triangle)
    }

    /// Returns all points that a ray meets within `max_distance` (mm), by distance, then triangle.
    ///
    /// A ray through a common side or corner of triangles meets each of them.
    pub fn ray_all(&self, origin: &Point3<f64>, direction: &Unit<Vector3<f64>>, max_distance: f64) -> Vec<RayHit> {
        let ray = Ray::new(*origin, *direction);
        let mut hits = Vec::new();
        self.tree().visit_boxes(
            // Boxes that the ray misses are at infinity.
            |b| ray.enters(b) <= max_distance.min(f64::MAX),
            |t| hits.extend(ray.crossing(self, t).map(|c| c.hit).filter(|h| h.point.distance <= max_distance)),
        );
        hits.sort_by(|a, b| {
            a.point.distance.total_cmp(&b.point.distance).then(a.point.triangle.cmp(&b.point.triangle))
        });
        hits
    }

    /// Returns how often the closed components wind around `p`: 1 inside one, 2 where two overlap,
    /// −1 inside one that is wound inside out, 0 outside and in a cavity. Open components do not
    /// count. `None` when `p` lies on the surface.
    ///
    /// Counts signed crossings of a ray. A ray that touches a side or corner is replaced by another
    /// direction, so the count is exact except for points that lie on the surface up to rounding.
    /// After 32 directions, which happens only with triangles finer than rounding, the last count
    /// is returned.
    pub fn winding(&self, p: &Point3<f64>) -> Option<i32> {
        let mut last = 0;
        for direction in directions() {
            match self.count_crossings(p, direction) {
                Count::Clear(sum) => return Some(sum),
                Count::Touching(sum) => last = sum,
                Count::OnSurface => return None,
            }
        }
        Some(last)
    }

    fn count_crossings(&self, p: &Point3<f64>, direction: Unit<Vector3<f64>>) -> Count {
        let ray = Ray::new(*p, direction);
        let (mut sum, mut touches) = (0, false);
        let on_surface = self.tree().find_in_boxes(
            |b| ray.enters(b) < f64::INFINITY,
            |t| {
                let crossing = Some(t).filter(|&t| self.component(t).closed).and_then(|t| ray.crossing(self, t))?;
                sum += if crossing.hit.from_outside { -1 } else { 1 };
                touches |= crossing.on_border;
                (crossing.hit.point.distance == 0.0).then_some(())
            },
        );
        match on_surface {
            Some(()) => Count::OnSurface,
            None if touches => Count::Touching(sum),
            None => Count::Clear(sum),
        }
    }

    /// Returns whether `p` is inside the material of the closed components, which may overlap;
    /// false on the surface.
    ///
    /// A component wound inside out that lies apart from others counts as material too; inside
    /// another it is a cavity.
    pub fn is_inside(&self, p: &Point3<f64>) -> bool {
        self.winding(p).is_some_and(|w| w != 0)
    }
}

impl Ray {
    fn new(origin: Point3<f64>, direction: Unit<Vector3<f64>>) -> Self {
        let z = direction.iamax();
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if direction[z] < 0.0 {
            std::mem::swap(&mut x, &mut y);
        }
        let d = Vector3::new(direction[x], direction[y], direction[z]);
        Self { origin, direction, axes: [x, y, z], shear: Vector3::new(d.x / d.z, d.y / d.z, 1.0 / d.z) }
    }

    /// Returns the distance at which the ray enters a box, 0 when it starts inside, infinite when
    /// it misses; never more than the distance that [`Ray::crossing`] finds for a triangle in it.
    fn enters(&self, b: &Aabb) -> f64 {
        let (low, high) = (b.min - self.origin, b.max - self.origin);
        // The triangle test rounds in proportion to the coordinates seen from the origin; the box
        // must not be stricter.
        let pad = 16.0 * f64::EPSILON * low.amax().max(high.amax());
        let (mut near, mut far) = (0.0f64, f64::INFINITY);
        for k in 0..3 {
            let (low, high) = (low[k] - pad, high[k] + pad);
            if self.direction[k] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return f64::INFINITY;
                }
                continue;
            }
            let (t0, t1) = (low / self.direction[k], high / self.direction[k]);
            near = near.max(t0.min(t1));
            far = far.min(t0.max(t1));
        }
        if near <= far { near * (1.0 - 16.0 * f64::EPSILON) } else { f64::INFINITY }
    }

    fn crossing(&self, surface: &Surface, triangle: u32) -> Option<Crossing> {
        let [x, y, z] = self.axes;
        let sheared = surface.mesh.corners(triangle as usize).map(|p| {
            let p = p - self.origin;
            Vector3::new(p[x] - self.shear.x * p[z], p[y] - self.shear.y * p[z], self.shear.z * p[z])
        });
        let [a, b, c] = sheared;
        let side = |p: &Vector3<f64>, q: &Vector3<f64>| p.x * q.y - p.y * q.x;
        let weights = [side(&b, &c), side(&c, &a), side(&a, &b)];
        if weights.iter().any(|&w| w < 0.0) && weights.iter().any(|&w| w > 0.0) {
            return None;
        }
        let sum: f64 = weights.iter().sum();
        let barycentric = weights.map(|w| w / sum);
        if !barycentric.iter().all(|w| w.is_finite()) {
            return None;
        }
        let distance = barycentric[0] * a.z + barycentric[1] * b.z + barycentric[2] * c.z;
        if distance < 0.0 {
            return None;
        }
        let position = self.origin + self.direction.into_inner() * distance;
        let point = SurfacePoint { position, triangle, barycentric, distance };
        // The frame (x, y, direction) is right-handed, so counter-clockwise as seen along the ray
        // means that the normal points along the ray.
        Some(Crossing { hit: RayHit { point, from_outside: sum < 0.0 }, on_border: weights.contains(&0.0) })
    }
}

/// Returns directions that no design aligns with: along a spiral on the sphere, the first away from
/// all axes and diagonals.
fn directions() -> impl Iterator<Item = Unit<Vector3<f64>>> {
    (0..32).map(|k| {
        let z = 0.137_131_7 + 0.023_719_3 * f64::from(k);
        let angle = 0.577_215_66 + 2.399_963_23 * f64::from(k);
        Unit::new_normalize(Vector3::new(angle.cos(), angle.sin(), z))
    })
}

#[cfg(test)]
#[path = "../../tests/unit/surface/ray.rs"]
mod tests;
