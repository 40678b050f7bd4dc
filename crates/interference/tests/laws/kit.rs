//! Common parts of the crate's tests: seeded numbers, bodies, meshes, and the slow definitions of
//! correct.
#![allow(dead_code, reason = "the laws and the tests within the crate each use a part of it")]

use std::sync::Arc;

use facemill_cl_data::{ConvexPolyhedron, RoundBox, RoundFrustum, RoundHull, Solid};
use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// A small seeded generator (Knuth's MMIX constants, the upper bits of the state).
pub(crate) struct Lcg(facemill_test_kit::Lcg);

impl Lcg {
    pub(crate) fn new(seed: u64) -> Self {
        let mut lcg = Self(facemill_test_kit::Lcg(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15)));
        lcg.unit_interval();
        lcg
    }

    fn unit_interval(&mut self) -> f64 {
        self.0.unit()
    }

    pub(crate) fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit_interval()
    }

    pub(crate) fn point(&mut self, reach: f64) -> Point3<f64> {
        Point3::new(self.range(-reach, reach), self.range(-reach, reach), self.range(-reach, reach))
    }

    pub(crate) fn unit(&mut self) -> Vector3<f64> {
        loop {
            let v = self.point(1.0).coords;
            if v.norm() > 0.1 && v.norm() <= 1.0 {
                return v.normalize();
            }
        }
    }

    /// Any turn; every fourth about a coordinate axis by a right angle or none, the axis-parallel
    /// cases.
    pub(crate) fn pose(&mut self, reach: f64) -> Isometry3<f64> {
        let turn = match self.range(0.0, 8.0) as u32 {
            0 => UnitQuaternion::identity(),
            1 => UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2),
            _ => UnitQuaternion::from_axis_angle(&Unit::new_normalize(self.unit()), self.range(-3.2, 3.2)),
        };
        Isometry3::from_parts(Translation3::from(self.point(reach).coords), turn)
    }
}

pub(crate) fn frustum(z: [f64; 2], radii: [f64; 2], rounding: f64) -> Solid {
    Solid::Frustum(RoundFrustum { z_low: z[0], z_high: z[1], radius_low: radii[0], radius_high: radii[1], rounding })
}

/// Cylinder, disc, sharp cylinder, frusta both ways, cone, capsule, ball, boxes, polyhedra.
pub(crate) fn sample_solids() -> Vec<Solid> {
    let boxed = |x, y, z, rounding| Solid::Box(RoundBox { half_extents: Vector3::new(x, y, z), rounding });
    vec![
        frustum([2.0, 18.0], [23.0, 23.0], 2.0),
        frustum([3.0, 3.0], [20.0, 20.0], 3.0),
        frustum([0.0, 15.0], [12.0, 12.0], 0.0),
        frustum([1.0, 14.0], [5.0, 11.0], 0.5),
        frustum([1.0, 14.0], [11.0, 5.0], 0.0),
        frustum([-4.0, 9.0], [0.0, 8.0], 1.0),
        frustum([0.0, 10.0], [0.0, 0.0], 4.0),
        frustum([6.0, 6.0], [0.0, 0.0], 6.0),
        boxed(10.0, 6.0, 8.0, 0.0),
        boxed(10.0, 6.0, 0.0, 2.0),
        random_hull(&mut Lcg::new(71), 9, 0.0),
        random_hull(&mut Lcg::new(72), 14, 1.5),
    ]
}

/// A polyhedron around points on a ball that is not about the origin.
pub(crate) fn random_hull(lcg: &mut Lcg, n_points: usize, rounding: f64) -> Solid {
    let points: Vec<_> =
        (0..n_points).map(|_| Point3::from(lcg.unit() * 11.0 + Vector3::new(2.0, -1.0, 4.0))).collect();
    let core = ConvexPolyhedron::around(&points, []).unwrap();
    Solid::Hull(RoundHull { core: Arc::new(core), rounding })
}

/// Least core distance over a triangle by golden sections in two nested directions: slow, and
/// nothing but convexity.
pub(crate) fn brute_triangle_distance(solid: &Solid, pose: &Isometry3<f64>, corners: &[Point3<f64>; 3]) -> f64 {
    let [a, b, c] = corners.map(|p| pose.inverse_transform_point(&p));
    // The least over t of a convex function of (s, t) on a convex set is convex in s.
    golden(|s| golden(|t| solid.core_distance(&(a + (b - a) * s + (c - a) * (t * (1.0 - s))))))
}

/// Least value of a convex function on [0, 1], ends included.
pub(crate) fn golden(f: impl Fn(f64) -> f64) -> f64 {
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    let (mut low, mut high) = (0.0, 1.0);
    let (mut x, mut y) = (1.0 - ratio, ratio);
    let (mut f_x, mut f_y) = (f(x), f(y));
    let mut least = f(0.0).min(f(1.0)).min(f_x).min(f_y);
    for _ in 0..55 {
        if f_x <= f_y {
            (high, y, f_y) = (y, x, f_x);
            x = high - ratio * (high - low);
            f_x = f(x);
        } else {
            (low, x, f_x) = (x, y, f_y);
            y = low + ratio * (high - low);
            f_y = f(y);
        }
        least = least.min(f_x).min(f_y);
    }
    least
}

/// Least core distance over all triangles of a mesh, by [`brute_triangle_distance`] where the
/// corners do not already say that it is larger than `at_most`.
pub(crate) fn brute_distance(solid: &Solid, pose: &Isometry3<f64>, mesh: &TriMesh, at_most: f64) -> f64 {
    let mut least = f64::INFINITY;
    for t in 0..mesh.triangles().len() {
        let corners = mesh.corners(t);
        let size = (corners[1] - corners[0]).norm().max((corners[2] - corners[0]).norm());
        if solid.core_distance(&pose.inverse_transform_point(&corners[0])) - size <= at_most.min(least) {
            least = least.min(brute_triangle_distance(solid, pose, &corners));
        }
    }
    least
}

/// An open wavy patch of about 40 × 40 mm.
pub(crate) fn patch(n: u32) -> TriMesh {
    height_field(n, 20.0, |x, y| 2.0 * (0.25 * x).sin() + 1.5 * (0.2 * y + 0.1 * x).cos())
}

/// A wavy sheet of 80 × 80 mm.
pub(crate) fn sheet() -> TriMesh {
    height_field(24, 40.0, |x, y| 3.0 * (0.11 * x).sin() * (0.08 * y).cos())
}

/// An open surface over a square about the origin, from −`half` to `half`: n × n vertices at their
/// heights.
fn height_field(n: u32, half: f64, height: impl Fn(f64, f64) -> f64) -> TriMesh {
    let at = |i: u32| 2.0 * half * f64::from(i) / f64::from(n - 1) - half;
    let point = |i: u32, j: u32| Point3::new(at(i), at(j), height(at(i), at(j)));
    let (vertices, triangles) = facemill_test_kit::grid_by_columns([n - 1; 2], point);
    TriMesh::new(vertices, triangles).unwrap()
}

/// A square in the plane z = 0 about the origin, from −`half` to `half`.
pub(crate) fn square(half: f64) -> TriMesh {
    let corner = |x, y| Point3::new(x, y, 0.0);
    let corners = vec![corner(-half, -half), corner(half, -half), corner(half, half), corner(-half, half)];
    TriMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}

/// A closed box about the origin, its faces cut into n × n squares along the axes, wound outward.
pub(crate) fn cube(half: f64, n: u32) -> TriMesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let first = vertices.len() as u32;
            for i in 0..=n {
                for j in 0..=n {
                    let at = |k: u32| half * (2.0 * f64::from(k) / f64::from(n) - 1.0);
                    let mut p = Point3::origin();
                    (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side * half, at(i), at(j));
                    vertices.push(p);
                }
            }
            for i in 0..n {
                for j in 0..n {
                    let a = first + i * (n + 1) + j;
                    let (b, c, d) = (a + n + 1, a + n + 2, a + 1);
                    let pair = if side > 0.0 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                    triangles.extend(pair);
                }
            }
        }
    }
    TriMesh::new(vertices, triangles).unwrap()
}

/// Unconnected triangles of all shapes: slivers, points, edges, doubles, flat in the axes' planes.
pub(crate) fn soup(lcg: &mut Lcg, n: u32) -> TriMesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for k in 0..n {
        let first = vertices.len() as u32;
        let [a, b, c] = odd_triangle(lcg, k);
        vertices.extend([a, b, c]);
        triangles.push([first, first + 1, first + 2]);
        if k % 7 == 0 {
            triangles.push([first, first + 1, first + 2]);
        }
    }
    TriMesh::new(vertices, triangles).unwrap()
}

/// A triangle of one of several awkward kinds.
pub(crate) fn odd_triangle(lcg: &mut Lcg, kind: u32) -> [Point3<f64>; 3] {
    let a = lcg.point(30.0);
    let (u, v) = (lcg.unit() * lcg.range(0.1, 25.0), lcg.unit() * lcg.range(0.1, 25.0));
    match kind % 8 {
        0 => [a, a + u, a + u * 0.6 + v * 1e-9],
        1 => [a, a + u, a + u * 0.6 + v * 1e-4],
        2 => [a, a + u, a + u * 0.3],
        3 => [a, a, a + u],
        4 => [a, a + Vector3::new(u.x, u.y, 0.0), a + Vector3::new(v.x, v.y, 0.0)],
        5 => [a, a + u * 20.0, a + v * 20.0],
        _ => [a, a + u, a + v],
    }
}

/// A closed ball of quads over latitude and longitude, triangles at the poles.
pub(crate) fn sphere(radius: f64, n: u32) -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::grid_around([n, 2 * n], |i, j| {
        let [(s, c), (sin, cos)] = [i, j].map(|k| (std::f64::consts::PI * f64::from(k) / f64::from(n)).sin_cos());
        Point3::new(radius * s * cos, radius * s * sin, radius * c)
    });
    TriMesh::new(vertices, triangles).unwrap()
}
