//! Meshes and brute-force answers for the tests of the Z-map.

use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3, Vector3};

/// SplitMix64.
pub(crate) struct Random(facemill_test_kit::Random);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(facemill_test_kit::Random(seed))
    }

    pub(crate) fn unit(&mut self) -> f64 {
        self.0.unit()
    }

    pub(crate) fn within(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.unit()
    }

    pub(crate) fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.within(-size, size))
    }

    pub(crate) fn pose(&mut self, size: f64) -> Isometry3<f64> {
        Isometry3::new(self.vector(size), self.vector(3.0))
    }
}

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
    let mut random = Random::new(seed);
    let mut vertices = Vec::new();
    for k in 0..n {
        let size = [0.2, 1.0, 5.0, 40.0][(4.0 * random.unit()) as usize];
        let a = Point3::from(random.vector(30.0));
        let (u, v) = (random.vector(size), random.vector(size));
        let (u, v) = match k % 8 {
            0 => (u, u + 1e-7 * v),
            1 => (u, Vector3::new(0.0, 0.0, v.z)),
            2 => (Vector3::new(u.x, 0.0, 0.0), v),
            3 if k % 16 == 3 => (Vector3::zeros(), Vector3::zeros()),
            _ => (u, v),
        };
        vertices.extend([a, a + u, a + v]);
    }
    TriMesh::new(vertices, (0..n).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect()).expect("indices are in range")
}

/// Closed ball of `n` × `n` patches over latitude and longitude.
pub(crate) fn ball(center: Point3<f64>, radius: f64, n: u32) -> TriMesh {
    let point = |i: u32, j: u32| {
        let (u, v) =
            (std::f64::consts::PI * f64::from(i) / f64::from(n), std::f64::consts::TAU * f64::from(j) / f64::from(n));
        center + radius * Vector3::new(u.sin() * v.cos(), u.sin() * v.sin(), u.cos())
    };
    let (vertices, triangles) = facemill_test_kit::grid_around([n, n], point);
    TriMesh::new(vertices, triangles).expect("indices are in range")
}

/// Points all over a triangle, corners and edges included, `n` to an edge.
pub(crate) fn points_of(corners: [Point3<f64>; 3], n: u32) -> impl Iterator<Item = Point3<f64>> {
    let [a, b, c] = corners;
    (0..=n).flat_map(move |i| {
        (0..=n - i).map(move |j| a + (b - a) * (f64::from(i) / f64::from(n)) + (c - a) * (f64::from(j) / f64::from(n)))
    })
}

/// Largest t of origin + t·direction on the mesh, by Möller and Trumbore's intersection with every
/// triangle.
pub(crate) fn highest_along(mesh: &TriMesh, origin: Point3<f64>, direction: Vector3<f64>) -> Option<f64> {
    let hit = |[a, b, c]: [Point3<f64>; 3]| {
        let (e1, e2) = (b - a, c - a);
        let h = direction.cross(&e2);
        let det = e1.dot(&h);
        let s = origin - a;
        let u = s.dot(&h) / det;
        let q = s.cross(&e1);
        let v = direction.dot(&q) / det;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| e2.dot(&q) / det)
    };
    (0..mesh.triangles().len()).filter_map(|t| hit(mesh.corners(t))).reduce(f64::max)
}
