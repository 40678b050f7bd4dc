//! Meshes and brute-force answers for the tests of the Z-map.

use facemill_surface_model::TriMesh;
pub(crate) use facemill_test_kit::Random;
use facemill_test_kit::{crossing_of_line, soup_mesh};
use nalgebra::{Point3, Vector3};

/// Height field over n × n squares of the given size.
pub(crate) fn field(n: u32, square: f64, height: impl Fn(f64, f64) -> f64) -> TriMesh {
    let at = |k: u32| square * f64::from(k);
    let point = |i: u32, j: u32| Point3::new(at(i), at(j), height(at(i), at(j)));
    let (vertices, triangles) = facemill_test_kit::grid_by_rows([n, n], point);
    TriMesh::new(vertices, triangles).expect("indices are in range")
}

/// A wavy field of 60 × 60 mm, 15 mm high.
pub(crate) fn waves() -> TriMesh {
    field(20, 3.0, |x, y| 7.5 * (0.3 * x).sin() * (0.23 * y + 0.1 * x).cos())
}

/// Triangles of all sizes, shapes and directions, slivers, vertical ones and points among them.
pub(crate) fn soup(seed: u64, n: u32) -> TriMesh {
    let (mut vertices, triangles) = soup_mesh(&mut Random(seed), n, [30.0, 25.0]);
    // Every eighth, of those of any shape, is turned upright about its first edge.
    for corners in vertices.chunks_exact_mut(3).skip(6).step_by(8) {
        (corners[2].x, corners[2].y) = (corners[0].x, corners[0].y);
    }
    TriMesh::new(vertices, triangles).expect("indices are in range")
}

/// Closed ball of `n` × `n` patches over latitude and longitude.
pub(crate) fn ball(center: Point3<f64>, radius: f64, n: u32) -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::ball_mesh(radius, [n, n]);
    let vertices = vertices.into_iter().map(|p| center + p.coords).collect();
    TriMesh::new(vertices, triangles).expect("indices are in range")
}

/// Points all over a triangle, corners and edges included, `n` to an edge.
pub(crate) fn points_of(corners: [Point3<f64>; 3], n: u32) -> impl Iterator<Item = Point3<f64>> {
    let [a, b, c] = corners;
    (0..=n).flat_map(move |i| {
        (0..=n - i).map(move |j| a + (b - a) * (f64::from(i) / f64::from(n)) + (c - a) * (f64::from(j) / f64::from(n)))
    })
}

/// Largest t of origin + t·direction on the mesh, by its crossings with every triangle.
pub(crate) fn highest_along(mesh: &TriMesh, origin: Point3<f64>, direction: Vector3<f64>) -> Option<f64> {
    let crossings = (0..mesh.triangles().len()).map(|t| crossing_of_line(&mesh.corners(t), &origin, &direction));
    crossings.flatten().reduce(f64::max)
}
