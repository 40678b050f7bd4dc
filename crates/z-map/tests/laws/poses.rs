//! The proven test of a tool pose on the Z-map.

use facemill_cl_data::{RoundBox, RoundFrustum, Solid};
use facemill_surface_model::TriMesh;
use facemill_z_map::{ZMap, ZMapSettings, certainly_free};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::kit::{Random, ball, field, points_of, soup, waves};

fn build(mesh: &TriMesh, map_from_mesh: &Isometry3<f64>, cell: f64) -> ZMap {
    ZMap::build(mesh, map_from_mesh, &ZMapSettings { cell, margin: 2.0 }).unwrap()
}

fn solids() -> Vec<Solid> {
    let frustum = |z_high, radius_low, radius_high, rounding| {
        Solid::Frustum(RoundFrustum { z_low: 0.0, z_high, radius_low, radius_high, rounding })
    };
    vec![
        frustum(20.0, 6.0, 6.0, 0.0),
        frustum(5.0, 8.0, 8.0, 2.0),
        frustum(30.0, 3.0, 9.0, 0.5),
        frustum(15.0, 0.0, 0.0, 3.0),
        Solid::Box(RoundBox { half_extents: Vector3::new(4.0, 7.0, 2.0), rounding: 0.0 }),
        Solid::Box(RoundBox { half_extents: Vector3::new(1.0, 1.0, 9.0), rounding: 1.0 }),
    ]
}

/// Smallest distance of the solid from points all over the mesh: not less than the true one.
fn sampled_distance(mesh: &TriMesh, solid: &Solid, mesh_from_solid: &Isometry3<f64>) -> f64 {
    let distance = |p: Point3<f64>| solid.distance(&mesh_from_solid.inverse_transform_point(&p));
    let of_triangle = |t: usize| points_of(mesh.corners(t), 12).map(distance).fold(f64::INFINITY, f64::min);
    (0..mesh.triangles().len()).map(of_triangle).fold(f64::INFINITY, f64::min)
}

#[test]
fn what_intersects_the_mesh_is_never_certainly_free() {
    let mut random = Random(21);
    let (mut free, mut touching, mut unknown) = (0, 0, 0);
    for mesh in [waves(), ball(Point3::new(30.0, 30.0, 0.0), 20.0, 20), soup(22, 80)] {
        for _ in 0..2 {
            let map_from_mesh = random.pose(10.0);
            let map = build(&mesh, &map_from_mesh, 1.1);
            for solid in solids() {
                for _ in 0..60 {
                    let place = mesh.aabb().center() + random.vector(45.0);
                    let turn = UnitQuaternion::from_scaled_axis(random.vector(3.0));
                    let mesh_from_solid = Isometry3::from_parts(Translation3::from(place.coords), turn);
                    let proven = certainly_free(&map, &solid, &(map_from_mesh * mesh_from_solid));
                    let distance = sampled_distance(&mesh, &solid, &mesh_from_solid);
                    assert!(!(proven && distance <= 0.0), "{solid:?} at {mesh_from_solid}: {distance}");
                    match (proven, distance <= 0.0) {
                        (true, _) => free += 1,
                        (false, true) => touching += 1,
                        (false, false) => unknown += 1,
                    }
                }
            }
        }
    }
    assert!(free > 300 && touching > 300, "{free} free, {touching} touching, {unknown} unknown");
}

#[test]
fn what_is_above_a_plane_by_more_than_rounding_is_certainly_free() {
    // On a level plane the columns end at the plane: the answer is as sharp as the bodies are.
    let map = build(&field(6, 20.0, |_, _| 5.0), &Isometry3::identity(), 1.0);
    let mut random = Random(23);
    for solid in solids() {
        for _ in 0..50 {
            let turn = UnitQuaternion::from_scaled_axis(random.vector(3.0));
            let at = |z: f64| Isometry3::from_parts(Translation3::new(60.0, 55.0, z), turn);
            let lowest = lowest_z(&solid, &at(0.0));
            assert!(certainly_free(&map, &solid, &at(5.0 - lowest + 1e-6)), "{solid:?} {turn}");
            assert!(!certainly_free(&map, &solid, &at(5.0 - lowest - 1e-6)), "{solid:?} {turn}");
        }
    }
}

/// Lowest z of a dilated solid by its rim and corners.
fn lowest_z(solid: &Solid, pose: &Isometry3<f64>) -> f64 {
    let lowest = match solid {
        Solid::Box(b) => {
            let h = b.half_extents;
            let corners = (0..8).map(|k| {
                let sign = |bit: u32| if k & bit == 0 { -1.0 } else { 1.0 };
                pose * Point3::new(sign(1) * h.x, sign(2) * h.y, sign(4) * h.z)
            });
            corners.map(|p| p.z).fold(f64::INFINITY, f64::min)
        }
        Solid::Hull(h) => h.core.vertices().iter().map(|v| (pose * v).z).fold(f64::INFINITY, f64::min),
        Solid::Frustum(f) => {
            let axis = pose * Vector3::z();
            let across = (1.0 - axis.z * axis.z).max(0.0).sqrt();
            let end = |z: f64, r: f64| (pose * Point3::new(0.0, 0.0, z)).z - r * across;
            end(f.z_low, f.radius_low).min(end(f.z_high, f.radius_high))
        }
    };
    lowest - solid.rounding()
}

#[test]
fn the_proof_reaches_to_within_a_few_cells_of_a_surface() {
    // A pin beside a ball: free as soon as it is farther off than what a cell's maximum adds at the
    // slope there.
    let mesh = ball(Point3::origin(), 30.0, 90);
    let pin =
        Solid::Frustum(RoundFrustum { z_low: 0.0, z_high: 50.0, radius_low: 4.0, radius_high: 4.0, rounding: 1.0 });
    for cell in [0.5, 1.0, 2.0] {
        let map = build(&mesh, &Isometry3::identity(), cell);
        for x in [0.0, 8.0, 16.0] {
            // The pin's lower inner rim, dilated, against the ball.
            let inner: f64 = (x - 4.0f64).max(0.0);
            let touching = (31.0f64 * 31.0 - inner * inner).sqrt();
            let free_at = |gap: f64| certainly_free(&map, &pin, &Translation3::new(x, 0.0, touching + gap).into());
            assert!(free_at(2.0 * cell), "cell {cell}, x {x}");
            assert!(!free_at(-0.2));
        }
    }
}

#[test]
fn under_an_overhang_nothing_is_certainly_free() {
    let roof = field(4, 10.0, |_, _| 50.0);
    let map = build(&roof, &Isometry3::identity(), 1.0);
    let pin = &solids()[0];
    assert!(!certainly_free(&map, pin, &Translation3::new(20.0, 20.0, 0.0).into()));
    assert!(certainly_free(&map, pin, &Translation3::new(20.0, 20.0, 50.1).into()));
    assert!(certainly_free(&map, pin, &Translation3::new(60.0, 20.0, 0.0).into()), "beside the map");
}

#[test]
fn no_pose_without_numbers_is_certainly_free() {
    let map = build(&waves(), &Isometry3::identity(), 2.0);
    for solid in solids() {
        for bad in [f64::NAN, f64::INFINITY] {
            assert!(!certainly_free(&map, &solid, &Translation3::new(0.0, bad, 500.0).into()));
        }
    }
    let hollow = RoundFrustum { z_low: 0.0, z_high: f64::NAN, radius_low: 1.0, radius_high: 1.0, rounding: 0.0 };
    assert!(!certainly_free(&map, &Solid::Frustum(hollow), &Translation3::new(0.0, 0.0, 500.0).into()));
}
