//! Laws of polyhedra against triangles.

use std::sync::Arc;

use facemill_cl_data::{ConvexPolyhedron, RoundBox, RoundHull, Solid};
use facemill_interference::{Interference, MeshTree, ParryMesh};
use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::kit::{Random, brute_triangle_distance, cube, odd_triangle, patch, random_hull, soup};

/// A box as a polyhedron around its corners, which stand at `solid_from_box`.
fn box_as_hull(half: &Vector3<f64>, rounding: f64, solid_from_box: &Isometry3<f64>) -> Solid {
    let end = |k: usize, axis: usize| if k >> axis & 1 == 0 { -half[axis] } else { half[axis] };
    let points: Vec<_> = (0..8).map(|k| solid_from_box * Point3::from(Vector3::from_fn(|i, _| end(k, i)))).collect();
    let core = ConvexPolyhedron::around(&points, []).unwrap();
    Solid::Hull(RoundHull { core: Arc::new(core), rounding })
}

fn one_triangle(corners: &[Point3<f64>; 3]) -> TriMesh {
    TriMesh::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap()
}

#[test]
fn box_as_a_polyhedron_is_as_far_and_meets_the_same() {
    let mut lcg = Random(81);
    let mut n_free = 0;
    for mesh in [patch(9), cube(15.0, 3), soup(&mut Random(3), 60)] {
        let tree = MeshTree::new(&mesh);
        for k in 0..200 {
            let half = Vector3::new(lcg.between(1.0, 14.0), lcg.between(1.0, 14.0), lcg.between(1.0, 14.0));
            let (rounding, pose) = (lcg.between(0.0, 5.0), lcg.pose(30.0));
            let boxed = Solid::Box(RoundBox { half_extents: half, rounding });
            let turned = if k % 2 == 0 { Isometry3::identity() } else { lcg.pose(20.0) };
            let hull = box_as_hull(&half, rounding, &turned);
            let at = pose * turned.inverse();
            let distance = |solid, pose| tree.core_distance(solid, pose, 20.0, None).map_or(20.0, |s| s.distance);
            let (a, b) = (distance(&boxed, &pose), distance(&hull, &at));
            assert!((a - b).abs() < 1e-9, "{half} {pose}: {a} and {b}");
            if (a - rounding).abs() > 1e-8 {
                let is_free = tree.verdict(&boxed, &pose, None).is_free();
                assert_eq!(tree.verdict(&hull, &at, None).is_free(), is_free, "{half} {pose}");
                n_free += usize::from(is_free);
            }
        }
    }
    assert!((100..500).contains(&n_free), "{n_free}");
}

#[test]
fn distance_of_any_polyhedron_is_that_of_golden_sections_and_of_parry() {
    let mut lcg = Random(82);
    for k in 0..240 {
        let hull = random_hull(&mut lcg, [4, 7, 20, 300][k % 4], 0.0);
        let corners = odd_triangle(&mut lcg, k as u32);
        let mesh = one_triangle(&corners);
        let pose = lcg.pose(25.0);
        let distance = |mesh: &dyn Interference| mesh.core_distance(&hull, &pose, 1e3, None).unwrap().distance;
        let (ours, theirs) = (distance(&MeshTree::new(&mesh)), distance(&ParryMesh::new(&mesh)));
        assert!((ours - theirs).abs() < 1e-6 * (1.0 + ours), "{pose}: {ours} and {theirs}");
        if k % 4 < 3 {
            let brute = brute_triangle_distance(&hull, &pose, &corners);
            assert!((ours - brute).abs() < 1e-9, "{pose}: {ours} for {brute}");
        }
    }
}

#[test]
fn triangle_with_a_point_in_the_polyhedron_is_never_free() {
    let mut lcg = Random(83);
    let hulls = [4, 4, 8, 8, 20, 60].map(|n| random_hull(&mut lcg, n, 0.0));
    for k in 0..3000 {
        let hull = &hulls[k / 24 % 6];
        let Solid::Hull(RoundHull { core, .. }) = hull else { panic!("it is one") };
        // Inside by little at a corner, an edge or a face, or somewhere.
        let face = &core.faces()[k % core.faces().len()];
        let corner = |k: usize| core.vertices()[face.corners[k] as usize];
        let on_surface = [corner(0), nalgebra::center(&corner(0), &corner(1))][k / 3 % 2];
        let inward = [1e-8, 1e-5, 1e-2, 0.7][k / 6 % 4];
        let within = on_surface + (core.center() - on_surface) * inward;
        let (u, v) = (
            lcg.direction().into_inner() * lcg.between(0.01, 40.0),
            lcg.direction().into_inner() * lcg.between(0.01, 40.0),
        );
        let (s, t) = (lcg.between(0.05, 0.45), lcg.between(0.05, 0.45));
        let pose = lcg.pose(300.0);
        let first = within - u * s - v * t;
        let corners = [first, first + u, first + v].map(|p| pose * p);
        let tree = MeshTree::new(&one_triangle(&corners));
        assert!(!tree.verdict(hull, &pose, None).is_free(), "{pose} {corners:?}");
        assert_eq!(tree.core_distance(hull, &pose, 1.0, None).map(|s| s.distance), Some(0.0));
    }
}

#[test]
fn triangle_behind_a_supporting_plane_is_as_far_as_it() {
    let mut lcg = Random(84);
    let hulls = [4, 4, 8, 8, 20, 60].map(|n| random_hull(&mut lcg, n, 0.0));
    for k in 0..1200 {
        let hull = &hulls[k / 6 % 6];
        let Solid::Hull(RoundHull { core, .. }) = hull else { panic!("it is one") };
        let normal =
            if k % 2 == 0 { lcg.direction().into_inner() } else { core.faces()[k % core.faces().len()].normal };
        let across = normal.cross(&lcg.direction().into_inner()).normalize();
        let (u, v) = (across * 30.0, normal.cross(&across) * 30.0);
        let gap = [0.0, 1e-6, 1.0][k / 2 % 3];
        let middle = core.support(&normal) + normal * gap;
        let pose = lcg.pose(300.0);
        let corners = [middle - u - v, middle + u * 2.0 - v, middle - u + v * 2.0].map(|p| pose * p);
        let tree = MeshTree::new(&one_triangle(&corners));
        let found = tree.core_distance(hull, &pose, 5.0, None).unwrap().distance;
        assert!((found - gap).abs() < 1e-9, "{found} for {gap}");
        let shrunk = |by: f64| tree.verdict(&hull.dilated(by), &pose, None).is_free();
        assert!(gap == 0.0 || shrunk(gap - 1e-8) && !shrunk(gap + 1e-8));
    }
}
