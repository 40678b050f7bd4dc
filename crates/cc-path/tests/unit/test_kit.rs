//! Small analytic meshes for the tests, and seeded numbers.

use facemill_surface_model::{Surface, SurfaceSettings, TriMesh};
pub(crate) use facemill_test_kit::Random;
use nalgebra::{Point3, Vector3};

/// Grid of `n` × `m` quads, each two triangles, over the unit square mapped by `place`; wound so
/// that ∂place/∂u × ∂place/∂v points out of the material.
pub(crate) fn grid(n: u32, m: u32, place: impl Fn(f64, f64) -> Point3<f64>) -> TriMesh {
    let share = |k: u32, of: u32| f64::from(k) / f64::from(of);
    let (vertices, triangles) = facemill_test_kit::grid_by_rows([n, m], |i, j| place(share(i, n), share(j, m)));
    TriMesh::new(vertices, triangles).unwrap()
}

/// The same with inner vertices moved about by up to `share` of half a quad, and border vertices
/// along the border; none so far that a triangle folds over.
pub(crate) fn irregular_grid(n: u32, m: u32, share: f64, place: impl Fn(f64, f64) -> Point3<f64>) -> TriMesh {
    let mut rng = Random(17);
    let mut moved = |x: f64, n: u32| {
        let way = share * (rng.unit() - 0.5) / f64::from(n);
        if x == 0.0 || x == 1.0 { x } else { x + way }
    };
    let even = grid(n, m, |u, v| Point3::new(u, v, 0.0));
    let mut flat: Vec<Point3<f64>> =
        even.vertices().iter().map(|p| Point3::new(moved(p.x, n), moved(p.y, m), 0.0)).collect();
    // Triangles that fold over go halfway back until none does.
    let is_folded = |flat: &[Point3<f64>], t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| flat[v as usize]);
        (b - a).cross(&(c - a)).z < 0.02 / f64::from(n * m)
    };
    while let Some(folded) = even.triangles().iter().find(|t| is_folded(&flat, t)) {
        folded
            .iter()
            .for_each(|&v| flat[v as usize] = nalgebra::center(&flat[v as usize], &even.vertices()[v as usize]));
    }
    TriMesh::new(flat.iter().map(|p| place(p.x, p.y)).collect(), even.triangles().to_vec()).unwrap()
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
    let (vertices, triangles) = facemill_test_kit::cap_mesh(radius, half_angle, [rings, around]);
    TriMesh::new(vertices, triangles).unwrap()
}

pub(crate) fn surface(mesh: TriMesh) -> Surface {
    Surface::new(mesh, SurfaceSettings::default())
}
