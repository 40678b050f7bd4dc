//! Laws that hold for every [`Interference`], and between them.

use facemill_cl_data::{RoundFrustum, Solid};
use facemill_interference::{Interference, MeshTree, ParryMesh, Verdict, lift_to_free};
use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::kit::{Random, brute_distance, cube, frustum, patch, sample_solids, soup, square};
use crate::reference::{Stepped, closed_contains};

/// Open and wavy, closed and axis-parallel, a soup of awkward triangles.
fn meshes() -> Vec<TriMesh> {
    vec![patch(9), cube(15.0, 3), soup(&mut Random(3), 60)]
}

/// Poses from deep in a mesh to well off it.
fn pose(lcg: &mut Random) -> Isometry3<f64> {
    let reach = if lcg.between(0.0, 1.0) < 0.5 { 20.0 } else { 45.0 };
    lcg.pose(reach)
}

fn shifted(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    Isometry3::from(Translation3::new(x, y, z))
}

#[test]
fn tree_agrees_with_brute_force() {
    agrees_with_brute_force(1, 8);
}

#[test]
#[ignore = "the same at ten times as many poses: half a minute"]
fn tree_agrees_with_brute_force_at_thousands_of_poses() {
    agrees_with_brute_force(11, 80);
}

fn agrees_with_brute_force(seed: u64, poses: usize) {
    let mut lcg = Random(seed);
    let mut n_free = 0;
    for mesh in meshes() {
        let tree = MeshTree::new(&mesh);
        for solid in sample_solids() {
            for _ in 0..poses {
                let pose = pose(&mut lcg);
                let brute = brute_distance(&solid, &pose, &mesh, 12.0);
                let found = tree.core_distance(&solid, &pose, 12.0, None);
                match found {
                    Some(s) => assert!((s.distance - brute).abs() < 1e-9, "{solid:?} {pose}: {s:?} for {brute}"),
                    None => assert!(brute > 12.0 - 1e-9, "{solid:?} {pose}: none for {brute}"),
                }
                // Grazing on purpose: the same core with a rounding just short of the distance and
                // just beyond it.
                let core = solid.dilated(-solid.rounding());
                if brute < 12.0 && brute > 1e-6 {
                    let closed = closed_contains(&tree, &core, &pose);
                    assert_eq!(
                        tree.verdict(&core.dilated(brute - 1e-7), &pose, None).is_free(),
                        !closed,
                        "{core:?} {pose} {brute} {found:?}"
                    );
                    n_free += usize::from(!closed);
                    assert!(!tree.verdict(&core.dilated(brute + 1e-7), &pose, None).is_free());
                } else if brute <= 0.0 {
                    assert!(!tree.verdict(&core, &pose, None).is_free(), "{core:?} {pose} {found:?}");
                }
            }
        }
    }
    assert!(n_free > 6 * poses, "{n_free}");
}

#[test]
fn tree_agrees_with_parry() {
    let mut lcg = Random(2);
    let (mut n_hit, mut n_free) = (0, 0);
    for mesh in meshes() {
        let (tree, parry) = (MeshTree::new(&mesh), ParryMesh::new(&mesh));
        for solid in sample_solids() {
            for _ in 0..60 {
                let pose = pose(&mut lcg);
                let at_most = 15.0;
                let (ours, theirs) = (
                    tree.core_distance(&solid, &pose, at_most, None),
                    parry.core_distance(&solid, &pose, at_most, None),
                );
                let (a, b) = (ours.map_or(at_most, |s| s.distance), theirs.map_or(at_most, |s| s.distance));
                // GJK stops at 5e-8 of the distance, and calls a pair of roundings apart touching.
                assert!((a - b).abs() < 1e-6 * (1.0 + a), "{solid:?} {pose}: {ours:?} and {theirs:?}");
                if (a - solid.rounding()).abs() > 2e-6 {
                    let verdict = tree.verdict(&solid, &pose, None);
                    assert_eq!(verdict.is_free(), parry.verdict(&solid, &pose, None).is_free(), "{solid:?} {pose}");
                    n_hit += usize::from(!verdict.is_free());
                    n_free += usize::from(verdict.is_free());
                }
            }
        }
    }
    assert!(n_hit > 300 && n_free > 300, "{n_hit} hits, {n_free} free");
}

#[test]
fn witness_and_nearest_point_are_of_their_triangle() {
    let mut lcg = Random(4);
    for mesh in meshes() {
        let tree = MeshTree::new(&mesh);
        let off = |triangle: u32, p: &Point3<f64>| {
            // A triangle is a body of its own: the golden sections of a point against it.
            let point = frustum([0.0, 0.0], [0.0, 0.0], 0.0);
            let corners = mesh.corners(triangle as usize);
            crate::kit::brute_triangle_distance(&point, &shifted(p.x, p.y, p.z), &corners)
        };
        for solid in sample_solids() {
            for _ in 0..30 {
                let pose = pose(&mut lcg);
                if let Verdict::Hit(w) = tree.verdict(&solid, &pose, None) {
                    assert!(off(w.triangle, &w.point) < 1e-9);
                    let depth = solid.distance(&pose.inverse_transform_point(&w.point));
                    assert!(depth <= 1e-9 || closed_contains(&tree, &solid, &pose), "{solid:?}: {depth}");
                }
                if let Some(s) = tree.core_distance(&solid, &pose, 100.0, None) {
                    assert!(off(s.triangle, &s.point) < 1e-9);
                }
            }
        }
    }
}

#[test]
fn hint_changes_no_answer() {
    let mut lcg = Random(5);
    for mesh in meshes() {
        let tree = MeshTree::new(&mesh);
        for solid in sample_solids() {
            for _ in 0..20 {
                let pose = pose(&mut lcg);
                let plain = tree.core_distance(&solid, &pose, 20.0, None).map(|s| s.distance);
                let free = tree.verdict(&solid, &pose, None).is_free();
                for hint in [0, 7, mesh.triangles().len() as u32 - 1, u32::MAX] {
                    let hinted = tree.core_distance(&solid, &pose, 20.0, Some(hint)).map(|s| s.distance);
                    assert_eq!(plain.is_some(), hinted.is_some());
                    assert!((plain.unwrap_or(0.0) - hinted.unwrap_or(0.0)).abs() < 1e-9);
                    assert_eq!(tree.verdict(&solid, &pose, Some(hint)).is_free(), free);
                }
            }
        }
    }
}

#[test]
fn rigid_motion_of_mesh_and_body_changes_nothing() {
    let mut lcg = Random(6);
    for mesh in meshes() {
        let tree = MeshTree::new(&mesh);
        for _ in 0..6 {
            let motion = lcg.pose(900.0);
            let moved = MeshTree::new(&mesh.transformed(&motion));
            for solid in sample_solids() {
                for _ in 0..10 {
                    let pose = pose(&mut lcg);
                    let here = tree.core_distance(&solid, &pose, 60.0, None).map_or(60.0, |s| s.distance);
                    let there = moved.core_distance(&solid, &(motion * pose), 60.0, None).map_or(60.0, |s| s.distance);
                    assert!((here - there).abs() < 1e-9, "{solid:?} {pose}: {here} and {there}");
                    if (here - solid.rounding()).abs() > 1e-8 {
                        let (a, b) = (tree.verdict(&solid, &pose, None), moved.verdict(&solid, &(motion * pose), None));
                        assert_eq!(a.is_free(), b.is_free());
                    }
                }
            }
        }
    }
}

#[test]
fn needle_under_the_disc_is_found() {
    // A spike 0.01 mm wide under the bottom of a face mill that is otherwise 0.1 mm clear of the
    // patch.
    let flat = |x: f64, y: f64| Point3::new(x, y, 0.0);
    let mill = frustum([2.0, 40.0], [23.0, 23.0], 2.0);
    let mut lcg = Random(7);
    for _ in 0..200 {
        let (x, y) = (lcg.between(-15.0, 15.0), lcg.between(-15.0, 15.0));
        let mut vertices = vec![flat(-60.0, -60.0), flat(60.0, -60.0), flat(60.0, 60.0), flat(-60.0, 60.0)];
        vertices.extend([flat(x, y), flat(x + 0.01, y), flat(x, y + 0.01), Point3::new(x, y, 0.11)]);
        let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 7], [5, 6, 7], [6, 4, 7]];
        let tree = MeshTree::new(&TriMesh::new(vertices, triangles).unwrap());
        let Verdict::Hit(w) = tree.verdict(&mill, &shifted(0.0, 0.0, 0.1), None) else { panic!("missed {x} {y}") };
        assert!(w.triangle >= 2);
        assert!(tree.verdict(&mill, &shifted(0.0, 0.0, 0.111), None).is_free());
    }
}

#[test]
fn verdict_on_a_plane_is_the_closed_form() {
    let tree = MeshTree::new(&square(500.0));
    let mut lcg = Random(8);
    for k in 0..2000 {
        let (radius, corner) = (lcg.between(5.0, 80.0), [0.0, 0.3, 4.0][k % 3]);
        // Down to tilts where the rim is level to within a rounding error.
        let tilt = [0.0, 10f64.powf(lcg.between(-12.0, -3.0)), lcg.between(0.0, 1.5)][k / 3 % 3];
        let mill = frustum([corner, corner + 40.0], [radius - corner, radius - corner], corner);
        let about = Unit::new_normalize(Vector3::new(lcg.between(-1.0, 1.0), lcg.between(0.1, 1.0), 0.0));
        let turn = UnitQuaternion::from_axis_angle(&about, tilt);
        // Height of the tip at which the lowest point of the torus touches the plane.
        let touching = (radius - corner) * tilt.sin() + corner - corner * tilt.cos();
        for (offset, free) in [(1e-9, true), (-1e-9, false)] {
            let at = Translation3::new(lcg.between(-50.0, 50.0), lcg.between(-50.0, 50.0), touching + offset);
            let verdict = tree.verdict(&mill, &Isometry3::from_parts(at, turn), None);
            assert_eq!(verdict.is_free(), free, "R {radius} r {corner} tilt {tilt} offset {offset}");
        }
    }
}

#[test]
fn distance_from_a_sphere_converges_to_the_closed_form() {
    // Corner touching a ball from outside: the facets are inside the sphere by at most their chord
    // error.
    let mut lcg = Random(9);
    let ball = crate::kit::sphere(30.0, 40);
    let tree = MeshTree::new(&ball);
    let chord = 30.0 * (1.0 - (std::f64::consts::PI / 80.0).cos()) * 2.0;
    for solid in sample_solids() {
        for _ in 0..40 {
            let pose = lcg.pose(90.0);
            let center = pose.inverse_transform_point(&Point3::origin());
            let exact = solid.core_distance(&center) - 30.0;
            if exact > 0.0 {
                let found = tree.core_distance(&solid, &pose, 500.0, None).unwrap().distance;
                assert!(found >= exact - 1e-9 && found <= exact + chord, "{solid:?} {pose}: {found} for {exact}");
            }
        }
    }
}

#[test]
fn body_inside_a_closed_component_is_hit() {
    let ball = frustum([0.0, 0.0], [0.0, 0.0], 1.0);
    // Axis-parallel half lines through corners and along faces of the squares, and any others.
    let mut lcg = Random(10);
    for n in [1, 2, 4] {
        let mesh = cube(10.0, n);
        let (tree, parry) = (MeshTree::new(&mesh), ParryMesh::new(&mesh));
        assert_eq!(tree.n_closed_components(), 1);
        for k in 0..300 {
            let place = if k % 2 == 0 { Point3::new(5.0, -5.0, 0.0) * f64::from(k % 5 - 2) } else { lcg.point(16.0) };
            let pose = lcg.pose(0.0) * Translation3::identity();
            let pose = Isometry3::from_parts(Translation3::from(place.coords), pose.rotation);
            let inside = place.coords.amax();
            if (inside - 10.0).abs() < 1e-6 {
                continue;
            }
            let beyond = place.coords.abs().add_scalar(-10.0).sup(&Vector3::zeros()).norm();
            let verdict = tree.verdict(&ball, &pose, None);
            assert_eq!(verdict.is_free(), beyond > 1.0, "{place} in {n}");
            assert_eq!(parry.verdict(&ball, &pose, None).is_free(), beyond > 1.0, "{place} in {n}");
        }
    }
}

#[test]
fn open_mesh_has_no_inside() {
    let mesh = cube(10.0, 2);
    let open = TriMesh::new(mesh.vertices().to_vec(), mesh.triangles()[1..].to_vec()).unwrap();
    let tree = MeshTree::new(&open);
    assert_eq!(tree.n_closed_components(), 0);
    assert!(tree.verdict(&frustum([0.0, 0.0], [0.0, 0.0], 1.0), &Isometry3::identity(), None).is_free());
}

#[test]
fn inside_is_known_however_triangles_are_wound_and_components_overlap() {
    let ball = frustum([0.0, 0.0], [0.0, 0.0], 0.5);
    let is_hit = |mesh: &TriMesh, x: f64| !MeshTree::new(mesh).verdict(&ball, &shifted(x, 0.3, 0.2), None).is_free();
    let one = cube(10.0, 2);
    // All inside out, and every third triangle so.
    for every in [1, 3] {
        let turn = |(k, t): (usize, &[u32; 3])| if k % every == 0 { [t[0], t[2], t[1]] } else { *t };
        let turned = one.triangles().iter().enumerate().map(turn).collect();
        let mesh = TriMesh::new(one.vertices().to_vec(), turned).unwrap();
        assert!(is_hit(&mesh, 0.0) && !is_hit(&mesh, 12.0));
    }
    // Two that overlap: inside both is inside, and so is inside either.
    let both = one.clone().joined(&one.transformed(&shifted(8.0, 0.1, 0.1)));
    assert!(is_hit(&both, 4.0) && is_hit(&both, -5.0) && is_hit(&both, 14.0) && !is_hit(&both, 20.0));
    // The same one twice over, which makes every edge one of four triangles.
    assert!(is_hit(&one.clone().joined(&one), 0.0));
}

#[test]
fn lift_is_the_least_that_frees() {
    let mut lcg = Random(13);
    let resolution = 1e-6;
    let mut n_lifted = 0;
    for mesh in meshes() {
        let tree = MeshTree::new(&mesh);
        for solid in sample_solids() {
            for _ in 0..12 {
                let pose = pose(&mut lcg);
                let along = Unit::new_normalize(lcg.direction().into_inner());
                let at = |lift: f64| Translation3::from(along.into_inner() * lift) * pose;
                match lift_to_free(&tree, &solid, &pose, along, 90.0, resolution) {
                    Some(lift) => {
                        assert!(tree.verdict(&solid, &at(lift), None).is_free());
                        n_lifted += usize::from(lift > 0.0);
                        let short = lift - 1.01 * resolution;
                        assert!(short < 0.0 || !tree.verdict(&solid, &at(short), None).is_free(), "{solid:?} {lift}");
                    }
                    None => assert!(!tree.verdict(&solid, &pose, None).is_free()),
                }
            }
        }
    }
    assert!(n_lifted > 100, "{n_lifted}");
}

#[test]
fn seating_on_a_plane_lifts_by_what_it_dips() {
    let tree = MeshTree::new(&square(500.0));
    for corner in [0.0, 6.0] {
        let mill = frustum([corner, 50.0], [80.0 - corner, 80.0 - corner], corner);
        for dip in [1e-7, 0.003, 0.04] {
            let lift = lift_to_free(&tree, &mill, &shifted(3.0, 4.0, -dip), Vector3::z_axis(), 0.05, 1e-6).unwrap();
            assert!(lift > dip && lift <= dip + 1.01e-6, "{lift} for {dip}");
            assert_eq!(lift_to_free(&tree, &mill, &shifted(3.0, 4.0, -dip), Vector3::z_axis(), 0.9 * dip, 1e-6), None);
        }
        assert_eq!(lift_to_free(&tree, &mill, &shifted(0.0, 0.0, 0.1), Vector3::z_axis(), 0.05, 1e-6), Some(0.0));
        assert_eq!(lift_to_free(&tree, &mill, &shifted(0.0, 0.0, -0.1), Vector3::z_axis(), f64::NAN, 1e-6), None);
    }
}

#[test]
fn numbers_that_are_no_numbers_are_never_free() {
    let mesh = patch(4);
    let checks: [&dyn Interference; 2] = [&MeshTree::new(&mesh), &ParryMesh::new(&mesh)];
    for check in checks {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let far = shifted(0.0, bad, 900.0);
            let good = RoundFrustum { z_low: 0.0, z_high: 1.0, radius_low: 1.0, radius_high: 1.0, rounding: 0.5 };
            assert!(!check.verdict(&Solid::Frustum(good), &far, None).is_free());
            assert_eq!(check.core_distance(&Solid::Frustum(good), &far, 1.0, None).map(|s| s.distance), Some(0.0));
            let odd = Solid::Frustum(RoundFrustum { radius_high: bad, ..good });
            assert!(!check.verdict(&odd, &shifted(0.0, 0.0, 900.0), None).is_free());
        }
    }
}

#[test]
fn empty_mesh_is_free_everywhere() {
    let mesh = TriMesh::new(Vec::new(), Vec::new()).unwrap();
    let checks: [&dyn Interference; 2] = [&MeshTree::new(&mesh), &ParryMesh::new(&mesh)];
    for check in checks {
        let mill = frustum([2.0, 40.0], [23.0, 23.0], 2.0);
        assert!(check.verdict(&mill, &Isometry3::identity(), Some(0)).is_free());
        assert_eq!(check.core_distance(&mill, &Isometry3::identity(), f64::INFINITY, None), None);
    }
}

#[test]
fn lift_is_the_first_free_one_of_brute_force() {
    // Both are found without passing over a window: by exits of triangles, and by stepping over the
    // intervals in which golden sections find a triangle touched.
    let mut lcg = Random(14);
    let (mut n_lifted, mut n_windows) = (0, 0);
    for mesh in meshes() {
        let tree = MeshTree::new(&mesh);
        for solid in sample_solids() {
            for _ in 0..6 {
                let pose = pose(&mut lcg);
                let along = Unit::new_normalize(lcg.direction().into_inner());
                let at = |lift: f64| Translation3::from(along.into_inner() * lift) * pose;
                let lift = lift_to_free(&tree, &solid, &pose, along, 90.0, 1e-6);
                // No lift below is free: 300 of them, but for those within the resolution.
                let end = lift.unwrap_or(90.0);
                for k in 0..300 {
                    let below = (end - 1e-6) * (f64::from(k) + lcg.between(0.0, 1.0)) / 300.0;
                    if below >= 0.0 {
                        assert!(
                            !tree.verdict(&solid, &at(below), None).is_free(),
                            "{solid:?} {pose} {below} of {lift:?}"
                        );
                    }
                }
                let Some(lift) = lift else { continue };
                n_lifted += usize::from(lift > 0.0);
                // The steps for any mesh may pass over windows, but find nothing that is lower.
                if let Some(stepped) = lift_to_free(&Stepped(&tree), &solid, &pose, along, 90.0, 1e-6) {
                    assert!(stepped > lift - 2e-6, "{solid:?} {pose}: {stepped} and {lift}");
                    n_windows += usize::from(stepped > lift + 1e-3);
                }
            }
        }
    }
    assert!(n_lifted > 60 && n_windows > 0, "{n_lifted} lifted, {n_windows} windows");
}
