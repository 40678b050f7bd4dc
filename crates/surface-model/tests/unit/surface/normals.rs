use crate::surface::normals::*;
use crate::test_kit::{cuboid, sphere};
use nalgebra::Point3;

fn smooth(mesh: &TriMesh, crease_angle: f64) -> SmoothVertices {
    SmoothVertices::of(mesh, &Edges::of(mesh), &facet_normals(mesh), crease_angle)
}

#[test]
fn a_box_has_a_normal_per_face_and_corner_below_the_crease_and_one_per_vertex_above() {
    let cube = cuboid(Point3::origin(), Point3::new(1.0, 1.0, 1.0));
    let sharp = smooth(&cube, 0.5);
    assert_eq!(sharp.normals.len(), 24);
    for (corner, &s) in sharp.of_corner.iter().enumerate() {
        let facet = cube.scaled_normal(corner / 3).normalize();
        assert!((sharp.normals[s as usize].unwrap().into_inner() - facet).norm() < 1e-12);
    }
    let round = smooth(&cube, 2.0);
    assert_eq!(round.normals.len(), 8);
    for (corner, &s) in round.of_corner.iter().enumerate() {
        // Three right angles around each vertex, however the faces are cut: the normal is the
        // diagonal.
        let p = cube.corners(corner / 3)[corner % 3];
        let diagonal = (p - Point3::new(0.5, 0.5, 0.5)).normalize();
        assert!((round.normals[s as usize].unwrap().into_inner() - diagonal).norm() < 1e-12);
    }
}

#[test]
fn normals_of_a_sphere_point_outward() {
    let ball = sphere(10.0, 48);
    let s = smooth(&ball, 0.7);
    assert_eq!(s.normals.len(), ball.vertices().len());
    for (corner, &v) in s.of_corner.iter().enumerate() {
        let p = ball.corners(corner / 3)[corner % 3];
        assert!(s.normals[v as usize].unwrap().dot(&p.coords.normalize()) > 1f64.to_radians().cos());
    }
}
