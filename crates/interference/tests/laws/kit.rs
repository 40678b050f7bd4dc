//! Common parts of the crate's tests: bodies, meshes, and the slow definitions of correct.
#![allow(dead_code, reason = "the laws and the tests within the crate each use a part of it")]

use std::sync::Arc;

use facemill_cl_data::{ConvexPolyhedron, RoundBox, RoundFrustum, RoundHull, Solid};
use facemill_surface_model::TriMesh;
pub(crate) use facemill_test_kit::Random;
use facemill_test_kit::least_over_triangle;
use nalgebra::{Isometry3, Point3, Vector3};

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
        random_hull(&mut Random(71), 9, 0.0),
        random_hull(&mut Random(72), 14, 1.5),
    ]
}

/// A polyhedron around points on a ball that is not about the origin.
pub(crate) fn random_hull(lcg: &mut Random, n_points: usize, rounding: f64) -> Solid {
    let points: Vec<_> = (0..n_points)
        .map(|_| Point3::from(lcg.direction().into_inner() * 11.0 + Vector3::new(2.0, -1.0, 4.0)))
        .collect();
    let core = ConvexPolyhedron::around(&points, []).unwrap();
    Solid::Hull(RoundHull { core: Arc::new(core), rounding })
}

/// Least core distance over a triangle by golden sections: slow, and nothing but convexity.
pub(crate) fn brute_triangle_distance(solid: &Solid, pose: &Isometry3<f64>, corners: &[Point3<f64>; 3]) -> f64 {
    let corners = corners.map(|p| pose.inverse_transform_point(&p));
    least_over_triangle(SECTIONS, &corners, |p| solid.core_distance(p))
}

/// Golden sections to the last digits.
pub(crate) const SECTIONS: u32 = 55;

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

/// Unconnected triangles of all shapes: slivers, points, edges, doubles, level ones, large ones.
pub(crate) fn soup(lcg: &mut Random, n: u32) -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::soup_mesh(lcg, n, [30.0, 25.0]);
    TriMesh::new(vertices, triangles).unwrap()
}

/// A triangle of one of several awkward kinds.
pub(crate) fn odd_triangle(lcg: &mut Random, kind: u32) -> [Point3<f64>; 3] {
    facemill_test_kit::odd_triangle(lcg, kind, [30.0, 25.0])
}

/// A closed ball over latitude and longitude.
pub(crate) fn sphere(radius: f64, n: u32) -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::ball_mesh(radius, [n, 2 * n]);
    TriMesh::new(vertices, triangles).unwrap()
}
