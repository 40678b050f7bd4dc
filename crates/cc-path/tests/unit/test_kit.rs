//! Small analytic meshes and a random generator for the tests.

use facemill_surface_model::{Surface, SurfaceSettings, TriMesh};
use nalgebra::{Isometry3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

/// Linear congruential generator (Knuth's MMIX constants): the same numbers everywhere.
pub(crate) struct Lcg(facemill_test_kit::Lcg);

impl Lcg {
    pub(crate) fn new(seed: u64) -> Self {
        Self(facemill_test_kit::Lcg(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(1)))
    }

    /// Uniform in 0..1.
    pub(crate) fn unit(&mut self) -> f64 {
        self.0.unit()
    }

    /// Uniform in the cube of this half edge.
    pub(crate) fn point(&mut self, half: f64) -> Point3<f64> {
        Point3::new(self.unit() - 0.5, self.unit() - 0.5, self.unit() - 0.5) * (2.0 * half)
    }

    pub(crate) fn direction(&mut self) -> Unit<Vector3<f64>> {
        loop {
            let v = self.point(1.0).coords;
            if (0.01..1.0).contains(&v.norm_squared()) {
                return Unit::new_normalize(v);
            }
        }
    }

    pub(crate) fn motion(&mut self) -> Isometry3<f64> {
        let turn = Rotation3::from_axis_angle(&self.direction(), 6.0 * self.unit());
        Isometry3::from_parts(Translation3::from(self.point(200.0).coords), UnitQuaternion::from_rotation_matrix(&turn))
    }
}

/// Grid of `n` × `m` quads, each two triangles, over the unit square mapped by `place`; wound so
/// that ∂place/∂u × ∂place/∂v points out of the material.
pub(crate) fn grid(n: u32, m: u32, place: impl Fn(f64, f64) -> Point3<f64>) -> TriMesh {
    let share = |k: u32, of: u32| f64::from(k) / f64::from(of);
    let (vertices, triangles) = facemill_test_kit::grid_by_rows([n, m], |i, j| place(share(i, n), share(j, m)));
    TriMesh::new(vertices, triangles).unwrap()
}

/// The same with inner vertices moved about by up to `share` of half a quad, and border vertices
/// along the border.
pub(crate) fn irregular_grid(n: u32, m: u32, share: f64, place: impl Fn(f64, f64) -> Point3<f64>) -> TriMesh {
    let mut rng = Lcg::new(17);
    let mut moved = |x: f64, n: u32| {
        let way = share * (rng.unit() - 0.5) / f64::from(n);
        if x == 0.0 || x == 1.0 { x } else { x + way }
    };
    let even = grid(n, m, |u, v| Point3::new(u, v, 0.0));
    let vertices = even.vertices().iter().map(|p| place(moved(p.x, n), moved(p.y, m))).collect();
    TriMesh::new(vertices, even.triangles().to_vec()).unwrap()
}

/// Rectangle `x` × `y` from the origin in the plane z = 0, normal +z.
pub(crate) fn plane(x: f64, y: f64, n: u32, m: u32) -> TriMesh {
    grid(n, m, |u, v| Point3::new(x * u, y * v, 0.0))
}

/// Convex cylinder wall about the x axis: length `x`, angles from −`half_angle` to `half_angle`
/// about +z.
pub(crate) fn cylinder(radius: f64, x: f64, half_angle: f64, n: u32, m: u32) -> TriMesh {
    grid(n, m, |u, v| {
        let angle = half_angle * (1.0 - 2.0 * v);
        Point3::new(x * u, radius * -angle.sin(), radius * angle.cos())
    })
}

/// Patch of the sphere about the origin over x and y angles from −`half_angle` to `half_angle`,
/// about +z.
pub(crate) fn sphere_patch(radius: f64, half_angle: f64, n: u32) -> TriMesh {
    grid(n, n, |u, v| {
        let (a, b) = (half_angle * (2.0 * u - 1.0), half_angle * (2.0 * v - 1.0));
        Point3::from(Vector3::new(a.tan(), b.tan(), 1.0).normalize() * radius)
    })
}

/// Cap of the sphere about the origin around the pole +z, up to the polar angle `half_angle`.
pub(crate) fn sphere_cap(radius: f64, half_angle: f64, rings: u32, around: u32) -> TriMesh {
    let mut vertices = vec![Point3::new(0.0, 0.0, radius)];
    for ring in 1..=rings {
        for k in 0..around {
            let polar = half_angle * f64::from(ring) / f64::from(rings);
            let turn = std::f64::consts::TAU * f64::from(k) / f64::from(around);
            vertices.push(Point3::new(
                radius * polar.sin() * turn.cos(),
                radius * polar.sin() * turn.sin(),
                radius * polar.cos(),
            ));
        }
    }
    let at = |ring: u32, k: u32| 1 + (ring - 1) * around + k % around;
    let mut triangles: Vec<[u32; 3]> = (0..around).map(|k| [0, at(1, k), at(1, k + 1)]).collect();
    for ring in 1..rings {
        for k in 0..around {
            let (a, b, c, d) = (at(ring, k), at(ring, k + 1), at(ring + 1, k), at(ring + 1, k + 1));
            triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    TriMesh::new(vertices, triangles).unwrap()
}

pub(crate) fn surface(mesh: TriMesh) -> Surface {
    Surface::new(mesh, SurfaceSettings::default())
}
