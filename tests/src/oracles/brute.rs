//! Depth of a cutter in a mesh and distance of turned bodies from it, over all triangles, by
//! formulas of their own.

use facemill_test_kit::least_over_triangle;
use nalgebra::{Point3, Unit, Vector3};

use facemill::surface_model::TriMesh;

/// A cutter as a solid: R, r, height of its top above the tip, mm.
#[derive(Clone, Copy, Debug)]
pub struct RoundedCylinder {
    /// R.
    pub radius: f64,
    /// r, of the lower edge; the upper one is sharp.
    pub corner: f64,
    /// Height.
    pub height: f64,
}

impl RoundedCylinder {
    /// Signed distance of a point at `rho` from the axis and `z` above the tip: negative inside. A
    /// convex function.
    pub fn signed_distance(&self, rho: f64, z: f64) -> f64 {
        let (rim, r) = (self.radius - self.corner, self.corner);
        let top = z - self.height;
        if rho > rim && z < r {
            // The nearest point is on the corner's arc; inside it may be on the top of a very flat
            // cutter.
            return (length(rho - rim, r - z) - r).max(top);
        }
        let (side, along) = (rho - self.radius, (-z).max(top));
        if side <= 0.0 && along <= 0.0 { side.max(along) } else { length(side.max(0.0), along.max(0.0)) }
    }
}

/// A sharp frustum about the tool axis from `low` to `high` above the tip, mm.
#[derive(Clone, Copy, Debug)]
pub struct Frustum {
    /// Height of its lower end.
    pub low: f64,
    /// Height of its upper end.
    pub high: f64,
    /// Radius there.
    pub radius_low: f64,
    /// Radius there.
    pub radius_high: f64,
}

impl Frustum {
    /// Distance of a point from it, 0 inside.
    pub fn distance(&self, rho: f64, z: f64) -> f64 {
        let wall = self.radius_low + (self.radius_high - self.radius_low) * (z - self.low) / (self.high - self.low);
        if (self.low..=self.high).contains(&z) && rho <= wall {
            return 0.0;
        }
        let corners = [(0.0, self.low), (self.radius_low, self.low), (self.radius_high, self.high), (0.0, self.high)];
        corners.windows(2).map(|w| segment_distance(w[0], w[1], (rho, z))).fold(f64::INFINITY, f64::min)
    }
}

fn segment_distance(a: (f64, f64), b: (f64, f64), p: (f64, f64)) -> f64 {
    let (ux, uy) = (b.0 - a.0, b.1 - a.1);
    let length_sq = ux * ux + uy * uy;
    let t = if length_sq > 0.0 { (((p.0 - a.0) * ux + (p.1 - a.1) * uy) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    length(p.0 - a.0 - t * ux, p.1 - a.1 - t * uy)
}

/// Distance from the axis and height above the tip of a point.
pub fn in_tool(tip: &Point3<f64>, axis: &Unit<Vector3<f64>>, p: &Point3<f64>) -> (f64, f64) {
    let d = p - tip;
    let z = d.dot(axis);
    ((d - axis.into_inner() * z).norm(), z)
}

/// Triangles in square bins of the xy plane, to leave out those far away.
pub struct Bins {
    triangles: Vec<[Point3<f64>; 3]>,
    centers: Vec<(Point3<f64>, f64)>,
    origin: (f64, f64),
    size: f64,
    columns: usize,
    rows: usize,
    bins: Vec<Vec<u32>>,
    largest: f64,
}

impl Bins {
    /// Bins of `size` mm for the triangles of a mesh, each by its middle.
    ///
    /// # Panics
    /// On an empty mesh.
    pub fn new(mesh: &TriMesh, size: f64) -> Self {
        let triangles: Vec<[Point3<f64>; 3]> = (0..mesh.triangles().len()).map(|k| mesh.corners(k)).collect();
        assert!(!triangles.is_empty(), "an empty mesh");
        let centers: Vec<(Point3<f64>, f64)> = triangles.iter().map(middle).collect();
        let bound = |f: &dyn Fn(&Point3<f64>) -> f64, pick: fn(f64, f64) -> f64| {
            centers.iter().map(|c| f(&c.0)).reduce(pick).unwrap_or(0.0)
        };
        let origin = (bound(&|p| p.x, f64::min), bound(&|p| p.y, f64::min));
        let columns = ((bound(&|p| p.x, f64::max) - origin.0) / size) as usize + 1;
        let rows = ((bound(&|p| p.y, f64::max) - origin.1) / size) as usize + 1;
        let mut bins = vec![Vec::new(); columns * rows];
        for (k, (c, _)) in centers.iter().enumerate() {
            let (i, j) = (((c.x - origin.0) / size) as usize, ((c.y - origin.1) / size) as usize);
            bins[j * columns + i].push(k as u32);
        }
        let largest = centers.iter().map(|c| c.1).fold(0.0, f64::max);
        Self { triangles, centers, origin, size, columns, rows, bins, largest }
    }

    /// The triangles as a mesh, no vertex shared.
    ///
    /// # Panics
    /// When a triangle is not finite, which it is not.
    pub fn mesh(&self) -> TriMesh {
        let vertices = self.triangles.iter().flatten().copied().collect();
        let triangles = (0..self.triangles.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        TriMesh::new(vertices, triangles).expect("finite triangles")
    }

    /// Triangles that may have a point within `reach` of `center`.
    fn near<'a>(&'a self, center: &Point3<f64>, reach: f64) -> impl Iterator<Item = usize> + 'a {
        let reach = reach + self.largest;
        let span = |from: f64, at: f64, n: usize| {
            let low = ((at - reach - from) / self.size).floor().max(0.0) as usize;
            let high = ((at + reach - from) / self.size).floor().max(-1.0) + 1.0;
            low..(high as usize).min(n)
        };
        let columns = span(self.origin.0, center.x, self.columns);
        let rows = span(self.origin.1, center.y, self.rows);
        let center = *center;
        rows.flat_map(move |j| columns.clone().map(move |i| j * self.columns + i))
            .flat_map(|bin| self.bins[bin].iter().map(|&k| k as usize))
            .filter(move |&k| (self.centers[k].0 - center).norm() <= reach)
    }

    /// Depth of the cutter in the mesh's surface: the largest distance of a point of the mesh from
    /// the cutter's outside, 0 where it touches nothing. Exact to about 1e-7 mm: the signed
    /// distance is convex over each triangle.
    pub fn depth(&self, cutter: &RoundedCylinder, tip: &Point3<f64>, axis: &Unit<Vector3<f64>>) -> f64 {
        (-self.gap(cutter, tip, axis, 0.0)).max(0.0)
    }

    /// Distance of the cutter from the mesh, searched up to `at_most` (0 or more); negative: its
    /// depth. As exact as depth.
    pub fn gap(&self, cutter: &RoundedCylinder, tip: &Point3<f64>, axis: &Unit<Vector3<f64>>, at_most: f64) -> f64 {
        let center = tip + axis.into_inner() * (0.5 * cutter.height);
        let reach = cutter.radius.hypot(0.5 * cutter.height) + at_most;
        let signed = |p: &Point3<f64>| {
            let (rho, z) = in_tool(tip, axis, p);
            cutter.signed_distance(rho, z)
        };
        self.smallest(self.near(&center, reach), &signed, at_most)
    }

    /// Distance of a frustum from the mesh, searched up to `at_most`.
    pub fn distance(&self, body: &Frustum, tip: &Point3<f64>, axis: &Unit<Vector3<f64>>, at_most: f64) -> f64 {
        let middle = 0.5 * (body.low + body.high);
        let center = tip + axis.into_inner() * middle;
        let reach = body.radius_low.max(body.radius_high).hypot(body.high - middle) + at_most;
        let outside = |p: &Point3<f64>| {
            let (rho, z) = in_tool(tip, axis, p);
            body.distance(rho, z)
        };
        self.smallest(self.near(&center, reach), &outside, at_most)
    }

    /// Smallest value of a distance over these triangles, searched up to `at_most`: lowest bounds
    /// first.
    fn smallest(&self, near: impl Iterator<Item = usize>, f: &dyn Fn(&Point3<f64>) -> f64, at_most: f64) -> f64 {
        // No point of a triangle is farther from its middle than its extent.
        let bound = |k: usize| f(&self.centers[k].0) - self.centers[k].1;
        let mut bounds: Vec<(f64, usize)> = near.map(|k| (bound(k), k)).filter(|b| b.0 < at_most).collect();
        bounds.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut nearest = at_most;
        for (bound, k) in bounds {
            if bound >= nearest {
                break;
            }
            if may_be_below(&self.triangles[k], f, nearest, 3) {
                nearest = nearest.min(least_over_triangle(SECTIONS, &self.triangles[k], f));
            }
        }
        nearest
    }
}

/// Whether a distance may be less than `limit` on a triangle: not where it is more on the middles
/// of its quarters, of their quarters and so on, than these are large.
fn may_be_below(t: &[Point3<f64>; 3], f: &dyn Fn(&Point3<f64>) -> f64, limit: f64, splits: u32) -> bool {
    let (c, extent) = middle(t);
    if f(&c) - extent >= limit {
        return false;
    }
    let [a, b, c] = *t;
    let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| nalgebra::center(&p, &q));
    let quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
    splits == 0 || quarters.iter().any(|t| may_be_below(t, f, limit, splits - 1))
}

fn middle(t: &[Point3<f64>; 3]) -> (Point3<f64>, f64) {
    let c = Point3::from((t[0].coords + t[1].coords + t[2].coords) / 3.0);
    (c, t.iter().map(|p| (p - c).norm()).fold(0.0, f64::max))
}

/// Golden sections to 1.4e-6 of an edge, where a convex function is flat.
pub const SECTIONS: u32 = 28;

/// Lengths here are far from what overflows, which `hypot` would guard at several times the cost.
fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use facemill_test_kit::Random;

    #[test]
    fn signed_distance_is_that_to_points_of_the_outline() {
        for c in [(10.0, 2.0, 6.0), (5.0, 5.0, 9.0), (8.0, 0.0, 3.0)] {
            let c = RoundedCylinder { radius: c.0, corner: c.1, height: c.2 };
            let n = 3000;
            let unit = |k: usize| k as f64 / n as f64;
            let mut outline: Vec<(f64, f64)> = Vec::new();
            for k in 0..=n {
                let (sin, cos) = (unit(k) * std::f64::consts::FRAC_PI_2).sin_cos();
                let rim = c.radius - c.corner;
                outline.push((unit(k) * rim, 0.0));
                outline.push((rim + c.corner * sin, c.corner * (1.0 - cos)));
                outline.push((c.radius, c.corner + unit(k) * (c.height - c.corner)));
                outline.push((unit(k) * c.radius, c.height));
            }
            let mut random = Random(5);
            for _ in 0..300 {
                let (rho, z) = (random.between(0.0, 14.0), random.between(-4.0, 12.0));
                let to_outline = outline.iter().map(|o| (o.0 - rho).hypot(o.1 - z)).fold(f64::INFINITY, f64::min);
                let d = c.signed_distance(rho, z);
                assert!((d.abs() - to_outline).abs() < 1e-2, "{c:?} ({rho}, {z}): {d} and {to_outline}");
                // Far inside a ball the axis is inside, too.
                assert!(d >= 0.0 || (rho < c.radius && z > 0.0 && z < c.height));
            }
        }
    }

    #[test]
    fn what_is_left_out_is_never_the_nearest() {
        let mut random = Random(17);
        let vertices: Vec<Point3<f64>> =
            (0..90).map(|_| Point3::from([0; 3].map(|_| random.between(-12.0, 12.0)))).collect();
        let mesh = TriMesh::new(vertices, (0..30).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect()).unwrap();
        let bins = Bins::new(&mesh, 3.0);
        let cutter = RoundedCylinder { radius: 4.0, corner: 1.0, height: 5.0 };
        let body = Frustum { low: 5.0, high: 11.0, radius_low: 1.0, radius_high: 3.0 };
        let least = |f: &dyn Fn(&Point3<f64>) -> f64, at_most: f64| {
            (0..30).map(|k| least_over_triangle(SECTIONS, &mesh.corners(k), f)).fold(at_most, f64::min)
        };
        for _ in 0..40 {
            let (tip, axis) = (Point3::from([0; 3].map(|_| random.between(-15.0, 15.0))), random.direction());
            for at_most in [0.0, 2.0, 40.0] {
                let signed = |p: &Point3<f64>| {
                    let (rho, z) = in_tool(&tip, &axis, p);
                    cutter.signed_distance(rho, z)
                };
                let outside = |p: &Point3<f64>| {
                    let (rho, z) = in_tool(&tip, &axis, p);
                    body.distance(rho, z)
                };
                let [gap, all] = [bins.gap(&cutter, &tip, &axis, at_most), least(&signed, at_most)];
                assert!((gap - all).abs() < 1e-12, "{gap} of {all} up to {at_most}");
                let [gap, all] = [bins.distance(&body, &tip, &axis, at_most), least(&outside, at_most)];
                assert!((gap - all).abs() < 1e-12, "{gap} of {all} up to {at_most}");
            }
        }
    }
}
