use super::*;
use crate::test_kit::{Random, cuboid, sphere, torus};

fn surface(mesh: TriMesh) -> Surface {
    Surface::new(mesh, SurfaceSettings::default())
}

#[test]
fn closest_point_is_that_of_dense_sampling() {
    let s = surface(torus(20.0, 6.0, 24));
    let mut rng = Random(3);
    for _ in 0..60 {
        let p = rng.point(30.0);
        let found = s.closest_point(&p, f64::INFINITY).unwrap();
        assert!(((found.position - p).norm() - found.distance).abs() < 1e-12);
        let mut sampled = f64::INFINITY;
        for t in 0..s.mesh().triangles().len() as u32 {
            for i in 0..=6 {
                for j in 0..=6 - i {
                    let (u, v) = (f64::from(i) / 6.0, f64::from(j) / 6.0);
                    sampled = sampled.min((s.point(t, [u, v, 1.0 - u - v]).position - p).norm());
                }
            }
        }
        // Samples lie at most 0.7 mm apart.
        assert!(found.distance <= sampled + 1e-12 && found.distance > sampled - 0.7);
        assert_eq!(s.closest_point(&p, found.distance * 1.000_001), Some(found));
        assert_eq!(s.closest_point(&p, found.distance * 0.999_999), None);
    }
}

#[test]
fn closest_point_keeps_to_the_requested_triangles() {
    let s = surface(cuboid(Point3::origin(), Point3::new(1.0, 1.0, 1.0)));
    let top = |t: u32| s.facet_normal(t).unwrap().z > 0.5;
    let found = s.closest_point_where(&Point3::new(0.5, 0.25, -1.0), 5.0, top).unwrap();
    assert_eq!((found.position, found.distance), (Point3::new(0.5, 0.25, 1.0), 2.0));
    assert_eq!(s.closest_point(&Point3::origin(), f64::NAN), None);
}

#[test]
fn smooth_normals_are_nearer_to_the_sphere_than_facets() {
    let s = surface(sphere(10.0, 40));
    let mut rng = Random(4);
    let (mut worst_smooth, mut worst_facet) = (0.0f64, 0.0f64);
    for _ in 0..400 {
        let d = rng.direction();
        let p = s.closest_point(&Point3::from(d.into_inner() * 12.0), 5.0).unwrap();
        let exact = p.position.coords.normalize();
        worst_smooth = worst_smooth.max(s.normal_at(&p).angle(&exact));
        worst_facet = worst_facet.max(s.facet_normal(p.triangle).unwrap().angle(&exact));
    }
    assert!(worst_facet > 4f64.to_radians());
    assert!(worst_smooth < 0.3f64.to_radians(), "{} deg", worst_smooth.to_degrees());
}

#[test]
fn triangles_without_area_are_never_returned() {
    let p = |x: f64, y: f64| Point3::new(x, y, 0.0);
    let mesh =
        TriMesh::new(vec![p(0.0, 0.0), p(1.0, 0.0), p(2.0, 0.0), p(1.0, 1.0)], vec![[0, 1, 2], [0, 2, 3], [3, 3, 0]]);
    let s = surface(mesh.unwrap());
    let found = s.closest_point(&p(1.0, -3.0), 10.0).unwrap();
    assert_eq!((found.triangle, found.distance), (1, 3.0));
    assert_eq!(s.facet_normal(0), None);
    assert!((s.normal_at(&s.point(0, [0.2, 0.5, 0.3])).z - 1.0).abs() < 1e-12);
    assert_eq!(surface(TriMesh::default()).closest_point(&p(0.0, 0.0), 1.0), None);
}
