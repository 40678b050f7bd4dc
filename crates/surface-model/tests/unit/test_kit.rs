//! Plain shapes for the tests of this crate, and seeded numbers.

pub(crate) use facemill_test_kit::Random;
use nalgebra::Point3;

use crate::mesh::tri_mesh::TriMesh;

/// Closed grid of `nu` × `nv` quads, periodic in both directions where requested.
pub(crate) fn grid(
    (nu, nv): (usize, usize),
    (closed_u, closed_v): (bool, bool),
    f: impl Fn(f64, f64) -> Point3<f64>,
) -> TriMesh {
    let (mu, mv) = (nu + usize::from(!closed_u), nv + usize::from(!closed_v));
    let vertices = (0..mu * mv).map(|k| f((k / mv) as f64 / nu as f64, (k % mv) as f64 / nv as f64)).collect();
    let at = |i: usize, j: usize| ((i % mu) * mv + j % mv) as u32;
    let mut triangles = Vec::new();
    for (i, j) in (0..nu).flat_map(|i| (0..nv).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        // Both diagonals occur, as in a real mesh.
        if (i + j) % 2 == 0 {
            triangles.extend([[a, b, c], [a, c, d]]);
        } else {
            triangles.extend([[a, b, d], [b, c, d]]);
        }
    }
    TriMesh::new(vertices, triangles).unwrap()
}

/// Torus about z, outward.
pub(crate) fn torus(major: f64, minor: f64, n: usize) -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::ring_mesh([major, minor], [n as u32; 2]);
    TriMesh::new(vertices, triangles).unwrap()
}

/// Sphere about the origin, outward: `n` meridians, n/2 rows, one vertex at each pole.
pub(crate) fn sphere(radius: f64, n: usize) -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::ball_mesh(radius, [n as u32 / 2, n as u32]);
    TriMesh::new(vertices, triangles).unwrap()
}

/// Box from `min` to `max`, outward, 12 triangles.
pub(crate) fn cuboid(min: Point3<f64>, max: Point3<f64>) -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::box_mesh(min.into(), max.into());
    TriMesh::new(vertices, triangles).unwrap()
}
