//! Laws of depths.

use std::f64::consts::FRAC_PI_2;

use facemill_cl_data::{RoundBox, RoundFrustum, Solid};
use facemill_interference::{Interference, MeshTree, ParryMesh, lift_to_free, penetration};
use facemill_surface_model::TriMesh;
use facemill_test_kit::least_over_triangle;
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::kit::{Random, SECTIONS, cube, frustum, patch, sample_solids, soup, sphere, square};
use crate::reference::{Stepped, closed_contains};

/// Signed distance of a point from the dilated solid, negative inside: the largest over the planes
/// that hold it.
fn signed_distance(solid: &Solid, p: &Point3<f64>) -> f64 {
    let outside = solid.core_distance(p);
    if outside > 0.0 {
        return outside - solid.rounding();
    }
    let inside = match solid {
        Solid::Box(RoundBox { half_extents: h, .. }) => (p.coords.abs() - h).max(),
        Solid::Hull(h) => h.core.height(p).0,
        Solid::Frustum(f) => {
            let RoundFrustum { z_low, z_high, radius_low, radius_high, .. } = *f;
            let slant = (radius_high - radius_low).hypot(z_high - z_low);
            let out = (p.x.hypot(p.y) - radius_low) * (z_high - z_low) - (p.z - z_low) * (radius_high - radius_low);
            let wall = if slant > 0.0 { out / slant } else { 0.0 };
            wall.max(z_low - p.z).max(p.z - z_high)
        }
    };
    inside - solid.rounding()
}

/// Radius of the largest ball in the undilated body, from below: the deepest of many points.
fn inner_radius(solid: &Solid) -> f64 {
    let core = solid.dilated(-solid.rounding());
    let bounds = core.aabb();
    let n = 24;
    let at = |k: i32| f64::from(k) / f64::from(n);
    let point = |i, j, k| bounds.min + (bounds.max - bounds.min).component_mul(&Vector3::new(at(i), at(j), at(k)));
    let cells = (0..=n).flat_map(|i| (0..=n).flat_map(move |j| (0..=n).map(move |k| [i, j, k])));
    cells.map(|[i, j, k]| -signed_distance(&core, &point(i, j, k))).fold(0.0, f64::max)
}

/// Largest depth of a point of the mesh in the solid, by golden sections over every triangle;
/// negative where none is in it.
fn brute_depth(solid: &Solid, pose: &Isometry3<f64>, mesh: &TriMesh) -> f64 {
    let mut deepest = f64::NEG_INFINITY;
    for t in 0..mesh.triangles().len() {
        let corners = mesh.corners(t).map(|p| pose.inverse_transform_point(&p));
        let [a, b, c] = corners;
        // No point of the triangle is farther from `a` than its longer side.
        let size = (b - a).norm().max((c - a).norm());
        if size - signed_distance(solid, &a) < deepest.max(-1.0) {
            continue;
        }
        let depth = -least_over_triangle(SECTIONS, &corners, |p| signed_distance(solid, p));
        deepest = deepest.max(depth);
    }
    deepest
}

#[test]
fn depth_is_that_of_golden_sections() {
    let mut lcg = Random(51);
    let (mut n_shallow, mut n_deep) = (0, 0);
    for mesh in [patch(7), cube(15.0, 2), soup(&mut Random(3), 60)] {
        let (tree, parry) = (MeshTree::new(&mesh), ParryMesh::new(&mesh));
        for solid in sample_solids() {
            for _ in 0..14 {
                let pose = lcg.pose(25.0);
                let brute = brute_depth(&solid, &pose, &mesh);
                match penetration(&tree, &solid, &pose) {
                    Some(p) if brute > -1e-9 => {
                        assert!((p.depth - brute).abs() < 1e-6, "{solid:?} {pose}: {p:?} for {brute}");
                        let there = -signed_distance(&solid, &pose.inverse_transform_point(&p.point));
                        assert!(there > brute - 1e-6, "{solid:?} {pose}: {there} for {brute}");
                        n_shallow += usize::from(brute < solid.rounding());
                        n_deep += usize::from(brute > solid.rounding());
                    }
                    Some(p) => assert!(closed_contains(&tree, &solid, &pose), "{solid:?} {pose}: {p:?} for {brute}"),
                    None => assert!(brute < 1e-9, "{solid:?} {pose}: none for {brute}"),
                }
                // The reference's distances are good to 1e-6 of their size.
                if let (Some(a), Some(b)) = (penetration(&tree, &solid, &pose), penetration(&parry, &solid, &pose)) {
                    // Of a polyhedron the reference knows a bound only.
                    let is_bound = matches!(solid, Solid::Hull(_)) && b.depth > a.depth;
                    assert!(is_bound || (a.depth - b.depth).abs() < 1e-4, "{solid:?} {pose}: {a:?} and {b:?}");
                }
            }
        }
    }
    assert!(n_shallow > 20 && n_deep > 80, "{n_shallow} in the skin, {n_deep} in the core");
}

#[test]
fn depth_of_one_walk_is_that_of_steps_by_distance() {
    let mut lcg = Random(54);
    let (mut n_deep, mut n_whole) = (0, 0);
    for mesh in [patch(60), cube(15.0, 9), soup(&mut Random(4), 900), sphere(22.0, 40)] {
        let tree = MeshTree::new(&mesh);
        for solid in sample_solids() {
            let inner_radius = inner_radius(&solid);
            for _ in 0..40 {
                let pose = lcg.pose(25.0);
                let Some(met) = tree.core_distance(&solid, &pose, 0.0, None) else { continue };
                let (walked, at) = tree.core_depth(&solid, &pose, met);
                let (mut stepped, _) = Stepped(&tree).core_depth(&solid, &pose, met);
                if matches!(solid, Solid::Hull(_)) {
                    // Without its faces it is bounded; golden sections say what it is.
                    assert!(walked <= stepped);
                    stepped = walked;
                }
                assert!((walked - stepped).abs() < 3e-7, "{solid:?} {pose}: {walked} for {stepped}");
                let core = solid.dilated(-solid.rounding());
                let there = -signed_distance(&core, &pose.inverse_transform_point(&at.point));
                assert!((there - walked).abs() < 3e-7, "{solid:?} {pose}: {there} for {walked}");
                n_deep += 1;
                n_whole += usize::from(walked > 0.99 * inner_radius);
            }
        }
    }
    assert!(n_deep > 600 && n_whole > 10, "{n_deep} in the core, {n_whole} to its middle");
}

#[test]
fn depth_in_a_plane_is_the_closed_form() {
    let tree = MeshTree::new(&square(500.0));
    let mut lcg = Random(52);
    for k in 0..600 {
        let (radius, height) = (lcg.between(10.0, 60.0), 80.0);
        let corner = [0.0, 0.5, 4.0][k % 3];
        let mill = frustum([corner, height - corner], [radius - corner, radius - corner], corner);
        let tilt = [0.0, lcg.between(1e-6, 0.01), lcg.between(0.01, FRAC_PI_2)][k / 3 % 3];
        let sunk = 10f64.powf(lcg.between(-5.0, 0.5));
        let (sin, cos) = tilt.sin_cos();
        // The lowest point of the body is so far below the plane.
        let tip = (radius - corner) * sin + corner - corner * cos - sunk;
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), tilt);
        let pose = Isometry3::from_parts(Translation3::new(lcg.between(-9.0, 9.0), 3.0, tip), turn);
        // Within the corner's skin the ball about the deepest point rolls on the plane. Deeper, its
        // centre is on the edge of the smaller cylinder: each step in costs a step of the bottom
        // and one of the wall.
        let expected = if sunk <= corner { sunk } else { corner + (sunk - corner) / (sin + cos) };
        let found = penetration(&tree, &mill, &pose).unwrap().depth;
        assert!(
            (found - expected).abs() < 1e-6,
            "R {radius} r {corner} tilt {tilt} sunk {sunk}: {found} for {expected}"
        );
        let up = lift_to_free(&tree, &mill, &pose, Vector3::z_axis(), 10.0, 1e-6).unwrap();
        assert!((up - sunk).abs() < 1e-6, "{up} for {sunk}");
    }
}

#[test]
fn depth_in_a_sphere_converges_to_the_closed_form() {
    // Two balls, and a ball with the bottom of a mill: the depth is along the line of the centres.
    let mut lcg = Random(53);
    let radius = 30.0;
    for n in [24u32, 96] {
        let tree = MeshTree::new(&sphere(radius, n));
        let chord = 2.0 * radius * (1.0 - (std::f64::consts::PI / f64::from(2 * n)).cos());
        for _ in 0..60 {
            let along = lcg.direction().into_inner();
            let sunk = lcg.between(0.2, 3.0);
            let ball = frustum([6.0, 6.0], [0.0, 0.0], 6.0);
            let mill = frustum([2.0, 60.0], [20.0, 20.0], 2.0);
            let turn = UnitQuaternion::rotation_between(&Vector3::z(), &along).unwrap();
            let pose = Isometry3::from_parts(Translation3::from(along * (radius - sunk)), turn);
            for solid in [ball, mill] {
                let found = penetration(&tree, &solid, &pose).unwrap().depth;
                assert!(
                    found <= sunk + 1e-6 && found >= sunk - chord - 1e-6,
                    "{solid:?}: {found} for {sunk} ({chord})"
                );
            }
        }
    }
}

#[test]
fn body_inside_counts_as_deep_as_it_can_be_and_a_free_one_has_no_depth() {
    let tree = MeshTree::new(&cube(10.0, 2));
    let small = frustum([0.0, 6.0], [2.0, 2.0], 0.5);
    assert_eq!(penetration(&tree, &small, &Isometry3::identity()).map(|p| p.depth), Some(2.5));
    assert_eq!(penetration(&tree, &small, &Isometry3::translation(30.0, 0.0, 0.0)), None);
    // The way out of the cube goes up.
    let up = lift_to_free(&tree, &small, &Isometry3::identity(), Vector3::z_axis(), 50.0, 1e-6).unwrap();
    assert!((up - 10.5).abs() < 1e-6, "{up}");
    assert!(tree.verdict(&small, &Isometry3::translation(0.0, 0.0, 10.4), None).triangle().is_some());
}

#[test]
fn lift_on_fine_meshes_is_free_and_hits_just_below() {
    // Thousands of small triangles near the trial: what one walk keeps aside must suffice, or the
    // walk be repeated.
    let mut lcg = Random(55);
    let mut n_lifted = 0;
    for mesh in [patch(90), sphere(25.0, 60), soup(&mut Random(5), 3000)] {
        let tree = MeshTree::new(&mesh);
        for solid in sample_solids() {
            for k in 0..40 {
                let pose = lcg.pose(25.0);
                let along =
                    if k % 2 == 0 { Vector3::z_axis() } else { Unit::new_normalize(lcg.direction().into_inner()) };
                let resolution = [1e-6, 1e-3][k % 2];
                let at = |lift: f64| Translation3::from(along.into_inner() * lift) * pose;
                let Some(lift) = lift_to_free(&tree, &solid, &pose, along, 120.0, resolution) else { continue };
                assert!(tree.verdict(&solid, &at(lift), None).is_free(), "{solid:?} {pose} {lift}");
                let short = lift - 1.01 * resolution;
                assert!(short < 0.0 || !tree.verdict(&solid, &at(short), None).is_free(), "{solid:?} {pose} {lift}");
                n_lifted += usize::from(lift > 0.0);
            }
        }
    }
    assert!(n_lifted > 400, "{n_lifted}");
}
