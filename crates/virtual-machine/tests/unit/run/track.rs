use crate::run::track::*;
use facemill_cl_data::{ConvexPolyhedron, RoundBox, RoundFrustum, RoundHull};
use facemill_interference::MeshTree;
use facemill_surface_model::TriMesh;
use facemill_test_kit::Random;
use nalgebra::{Translation3, UnitQuaternion};
use std::sync::Arc;

fn octahedron(size: f64) -> MeshTree {
    let tips = [Vector3::x(), Vector3::y(), Vector3::z()].map(|v: Vector3<f64>| v * size);
    let vertices = tips.iter().flat_map(|&v| [Point3::from(v), Point3::from(-v)]).collect();
    let mut triangles = Vec::new();
    for k in 0..8_u32 {
        let [x, y, z] = [k & 1, 2 + (k >> 1 & 1), 4 + (k >> 2 & 1)];
        triangles.push(if k.count_ones() % 2 == 0 { [x, y, z] } else { [x, z, y] });
    }
    MeshTree::new(&TriMesh::new(vertices, triangles).unwrap())
}

const FRUSTUM: Solid =
    Solid::Frustum(RoundFrustum { z_low: -4.0, z_high: 9.0, radius_low: 6.0, radius_high: 2.0, rounding: 1.0 });

fn shapes() -> [Shape; 3] {
    let block = Solid::Box(RoundBox { half_extents: Vector3::new(3.0, 8.0, 1.0), rounding: 0.5 });
    let tips = [[7.0, 0.0, 1.0], [-4.0, 2.0, 0.0], [0.0, 6.0, -3.0], [1.0, -5.0, 4.0], [0.5, 0.5, 8.0]];
    let core = Arc::new(ConvexPolyhedron::around(&tips.map(Point3::from), []).unwrap());
    let hull = Solid::Hull(RoundHull { core, rounding: 0.5 });
    [FRUSTUM, block, hull].map(|solid| Shape::core_of(&solid))
}

#[test]
fn displacement_is_never_below_the_way_of_a_point_of_the_body() {
    let mut rng = Random(9);
    for shape in shapes() {
        for _ in 0..300 {
            let mut pose = || {
                let turn = UnitQuaternion::from_scaled_axis(rng.vector(1.0));
                Isometry3::from_parts(Translation3::from(rng.vector(5.0)), turn)
            };
            let (a, b) = (pose(), pose());
            let bound = shape.displacement(&shape.placed(a), &shape.placed(b));
            // Every point of the body at `a` is that near to the body at `b`.
            let p = Point3::from(rng.vector(9.0));
            if shape.core.core_distance(&p) == 0.0 {
                let back = b.inverse_transform_point(&(a * p));
                assert!(shape.core.core_distance(&back) <= bound + 1e-12);
            }
        }
    }
}

#[test]
fn spin_of_a_turned_body_moves_nothing() {
    let shape = Shape::core_of(&FRUSTUM);
    let spun = Isometry3::rotation(Vector3::new(0.0, 0.0, 2.0));
    assert!(shape.displacement(&shape.placed(Isometry3::identity()), &shape.placed(spun)) < 1e-15);
}

#[test]
fn answers_on_a_random_walk_are_those_of_fresh_queries() {
    let (mesh, mut rng) = (octahedron(25.0), Random(1));
    let (mut n_near, mut n_inside) = (0, 0);
    for shape in shapes() {
        let mut track = Track::default();
        let (mut place, mut turn) = (Vector3::new(60.0, 0.0, 0.0), UnitQuaternion::identity());
        for step in 0..6000 {
            // Pulled to the middle, so that it goes in and out.
            place += rng.vector(1.5) - place * if step % 2000 < 1000 { 0.004 } else { -0.002 };
            turn = UnitQuaternion::from_scaled_axis(rng.vector(0.05)) * turn;
            let pose = Isometry3::from_parts(place.into(), turn);
            let need = if step % 3 == 0 { 12.0 } else { 1.0 };
            let found = track.nearest_within(need, &shape, &shape.placed(pose), &mesh).map(|s| s.distance);
            let fresh = mesh.core_distance(&shape.core, &pose, f64::INFINITY, None).unwrap().distance;
            let is_in = !mesh.verdict(&shape.core, &pose, None).is_free();
            let expected = if is_in { 0.0 } else { fresh };
            match found {
                Some(d) => assert!((d - expected).abs() < 1e-8, "{d} {expected}"),
                None => assert!(expected > need - 1e-8, "{expected} is within {need}"),
            }
            n_near += i32::from(found.is_some());
            n_inside += i32::from(is_in && fresh > 0.0);
        }
    }
    assert!(n_near > 500 && n_near < 17_500 && n_inside > 50, "{n_near} near, {n_inside} inside");
}
