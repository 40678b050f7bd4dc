use crate::surface::curvature::*;
use crate::surface::{Surface, SurfaceSettings};
use crate::test_kit::{Random, cuboid, grid, sphere, torus};
use nalgebra::Point3;
use std::f64::consts::TAU;

fn surface(mesh: TriMesh) -> Surface {
    Surface::new(mesh, SurfaceSettings::default())
}

#[test]
fn a_torus_has_its_principal_curvatures_and_directions() {
    let (major, minor) = (50.0, 15.0);
    let s = surface(torus(major, minor, 120));
    let mut rng = Random(10);
    for _ in 0..300 {
        let (u, v) = (rng.unit() * TAU, rng.unit() * TAU);
        let rho = major + minor * v.cos();
        let exact = Point3::new(rho * u.cos(), rho * u.sin(), minor * v.sin());
        let p = s.closest_point(&exact, 1.0).unwrap();
        let found = s.curvature_at(&p).unwrap().principal();
        // Across the tube 1/minor; along it cos v / rho, negative on the inner side.
        assert!((found.max - 1.0 / minor).abs() < 0.02 / minor, "{} {}", found.max * minor, v);
        assert!((found.min - v.cos() / rho).abs() < 0.02 / minor, "{} {}", found.min, v.cos() / rho);
        let along = Vector3::new(-u.sin(), u.cos(), 0.0);
        assert!(found.min_direction.dot(&along).abs() > 0.999);
        let right_handed = found.max_direction.cross(&found.min_direction).dot(&s.normal_at(&p));
        assert!((right_handed - 1.0).abs() < 1e-9);
        let tensor = s.curvature_at(&p).unwrap();
        for (direction, value) in [(found.max_direction, found.max), (found.min_direction, found.min)] {
            assert!((tensor.normal_curvature(&direction).unwrap() - value).abs() < 1e-12);
        }
        assert_eq!(tensor.normal_curvature(&tensor.normal), None);
    }
}

#[test]
fn a_concave_cylinder_is_negative_across_and_flat_along() {
    // A groove of radius 20 along y, seen from above.
    let mesh = grid((60, 20), (false, false), |u, v| {
        let angle = (u - 0.5) * 2.0;
        Point3::new(20.0 * angle.sin(), 40.0 * v, -20.0 * angle.cos())
    });
    let s = surface(mesh);
    let p = s.closest_point(&Point3::new(3.0, 20.0, -19.0), 5.0).unwrap();
    assert!(s.normal_at(&p).z > 0.9);
    let c = s.curvature_at(&p).unwrap();
    assert!((c.normal_curvature(&Vector3::x()).unwrap() + 1.0 / 20.0).abs() < 5e-4);
    assert!(c.normal_curvature(&Vector3::y()).unwrap().abs() < 1e-9);
}

#[test]
fn the_error_falls_with_the_edge_length() {
    let worst = |n: usize| {
        let s = surface(sphere(10.0, n));
        let mut rng = Random(11);
        let mut worst = 0.0f64;
        for _ in 0..300 {
            let d = rng.direction();
            // The poles, where many thin triangles meet, are the irregular case.
            let p = s.closest_point(&Point3::from(d.into_inner() * 10.0), 5.0).unwrap();
            let k = s.curvature_at(&p).unwrap().principal();
            worst = worst.max((k.max - 0.1).abs().max((k.min - 0.1).abs()));
        }
        worst
    };
    let (coarse, fine) = (worst(24), worst(96));
    assert!(fine < 0.1 * 0.03 && fine < 0.5 * coarse, "{coarse} {fine}");
}

#[test]
fn faces_between_creases_are_flat() {
    let s = surface(cuboid(Point3::origin(), Point3::new(1.0, 2.0, 3.0)));
    for t in 0..12 {
        let c = s.curvature_at(&s.point(t, [0.5, 0.3, 0.2])).unwrap();
        assert!(c.tensor.amax() < 1e-12);
    }
}
