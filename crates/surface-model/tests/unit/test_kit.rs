//! Seeded numbers and plain shapes for the tests of this crate.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Unit, Vector3};

use crate::mesh::tri_mesh::TriMesh;

/// Linear congruential generator (Knuth's MMIX constants).
pub(crate) struct Lcg(facemill_test_kit::Lcg);

impl Lcg {
    pub(crate) fn new(seed: u64) -> Self {
        Self(facemill_test_kit::Lcg(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678))
    }

    /// Uniform in 0..1.
    pub(crate) fn unit(&mut self) -> f64 {
        self.0.unit()
    }

    pub(crate) fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| (2.0 * self.unit() - 1.0) * size)
    }

    pub(crate) fn point(&mut self, size: f64) -> Point3<f64> {
        Point3::from(self.vector(size))
    }

    pub(crate) fn direction(&mut self) -> Unit<Vector3<f64>> {
        loop {
            if let Some(d) = Unit::try_new(self.vector(1.0), 0.1) {
                return d;
            }
        }
    }
}

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
    grid((n, n), (true, true), |u, v| {
        let (u, v) = (u * TAU, v * TAU);
        let rho = major + minor * v.cos();
        Point3::new(rho * u.cos(), rho * u.sin(), minor * v.sin())
    })
}

/// Sphere about the origin, outward: `n` meridians, n/2 rows, one vertex at each pole.
pub(crate) fn sphere(radius: f64, n: usize) -> TriMesh {
    let rows = n / 2;
    let mut vertices = vec![Point3::new(0.0, 0.0, radius), Point3::new(0.0, 0.0, -radius)];
    for i in 1..rows {
        let (s, c) = (i as f64 / rows as f64 * PI).sin_cos();
        vertices.extend((0..n).map(|j| {
            let (sj, cj) = ((j as f64 + 0.5 * (i % 2) as f64) / n as f64 * TAU).sin_cos();
            Point3::new(radius * s * cj, radius * s * sj, radius * c)
        }));
    }
    let at = |i: usize, j: usize| (2 + (i - 1) * n + j % n) as u32;
    let mut triangles = Vec::new();
    for j in 0..n {
        triangles.extend([[0, at(1, j), at(1, j + 1)], [1, at(rows - 1, j + 1), at(rows - 1, j)]]);
        for i in 1..rows - 1 {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if i % 2 == 0 {
                triangles.extend([[a, b, d], [b, c, d]]);
            } else {
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    TriMesh::new(vertices, triangles).unwrap()
}

/// Box from `min` to `max`, outward, 12 triangles.
pub(crate) fn cuboid(min: Point3<f64>, max: Point3<f64>) -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::box_mesh(min.into(), max.into());
    TriMesh::new(vertices, triangles).unwrap()
}
