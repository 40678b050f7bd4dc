use nalgebra::Point3;
use serde_json::json;

use super::*;
use crate::test_kit::patch_job;

#[test]
fn planes_lie_along_and_across_the_longest_extent_whatever_the_order_of_points() {
    // A strip of 200 × 40 in the plane y = 0.2 x, seen along its normal.
    let along = Vector3::new(1.0, 0.2, 0.0).normalize();
    let normal = Vector3::new(-0.2, 1.0, 0.0);
    let point = |k: u32, l: u32| {
        let position = Point3::from(along * (10.0 * f64::from(k)) + Vector3::z() * (10.0 * f64::from(l)));
        CcPoint::new(position, normal, along).unwrap()
    };
    let mut points: Vec<CcPoint> = (0..=20).flat_map(|k| (0..=4).map(move |l| point(k, l))).collect();
    let planes = |points: &[CcPoint]| Extent::of(points).unwrap().planes().map(|p| p.file);
    let [beside, across, diagonal, counter] = planes(&points);
    // Planes along the strip have their normal across it.
    assert!(Vector3::from(beside.normal).normalize().dot(&Vector3::z()) > 1.0 - 1e-6, "{beside:?}");
    assert!(Vector3::from(across.normal).normalize().dot(&along) > 1.0 - 1e-6, "{across:?}");
    // Diagonals are as far from both, and square to each other.
    let [diagonal_normal, counter_normal] = [&diagonal, &counter].map(|p| Vector3::from(p.normal).normalize());
    for normal in [diagonal_normal, counter_normal] {
        assert!((normal.dot(&along).abs() - normal.z.abs()).abs() < 1e-3, "{normal}");
    }
    assert!(diagonal_normal.dot(&counter_normal).abs() < 1e-3);
    points.reverse();
    assert_eq!(planes(&points), [beside, across, diagonal, counter]);
    assert!(Extent::of(&[]).is_none());
}

#[test]
fn noise_of_the_normals_leaves_planes_along_the_axes_exact() {
    let place = |k: u32, l: u32| Point3::new(10.0 * f64::from(k), 10.0 * f64::from(l), 0.0);
    let noisy = |k: u32, l: u32| Vector3::new(0.004, 0.003 * (f64::from(k) - f64::from(l)).sin(), 1.0);
    let points: Vec<CcPoint> = (0..=20)
        .flat_map(|k| (0..=4).map(move |l| CcPoint::new(place(k, l), noisy(k, l), Vector3::x()).unwrap()))
        .collect();
    let [along, across, ..] = Extent::of(&points).unwrap().planes().map(|p| p.file.normal);
    assert_eq!([along, across], [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]);
}

#[test]
fn a_sphere_has_no_side_for_planes() {
    let at = |k: u32| f64::from(k) * 0.7;
    let normal = |k: u32| Vector3::new(at(k).cos(), at(k).sin(), (1.3 * at(k)).sin());
    let points: Vec<CcPoint> = (0..400)
        .map(|k| CcPoint::new(Point3::from(normal(k)), normal(k), Vector3::new(0.3, -0.2, 0.9)).unwrap())
        .collect();
    assert!(Extent::of(&points).is_none());
}

#[test]
fn the_longer_side_is_that_of_the_smallest_rectangle_whatever_the_order_of_points() {
    let (sin, cos) = 20f64.to_radians().sin_cos();
    let turned = |x: f64, y: f64| [x * cos - y * sin, x * sin + y * cos];
    let rectangle = |x: f64, y: f64| -> Vec<[f64; 2]> {
        (0..=8).flat_map(|i| (0..=8).map(move |j| turned(x * f64::from(i) / 8.0, y * f64::from(j) / 8.0))).collect()
    };
    let is_along = |found: Option<[f64; 2]>, angle: f64| {
        let side = found.unwrap();
        let (sin, cos) = angle.to_radians().sin_cos();
        assert!((side[0] * cos + side[1] * sin).abs() > 1.0 - 1e-9, "{side:?}");
    };
    is_along(longest_side(rectangle(30.0, 10.0)), 20.0);
    is_along(longest_side(rectangle(10.0, 30.0)), 110.0);
    // Of a square the side nearer to the first axis counts.
    let mut square = rectangle(10.0, 10.0);
    is_along(longest_side(square.clone()), 20.0);
    square.reverse();
    is_along(longest_side(square), 20.0);
    assert!(longest_side(vec![[1.0, 2.0]; 3]).is_none() && longest_side(Vec::new()).is_none());
}

/// Returns a ridge of 24 mm radius along y.
fn ridge(x: f64) -> f64 {
    (576.0 - x * x).sqrt() - 24.0
}

/// Returns the planes for the ridge, turned on its table by this angle, in a region that is longest
/// along x.
fn planes_of_ridge(turn_deg: f64) -> Vec<DirectedPlanes> {
    let folder = tempfile::tempdir().unwrap();
    let path = json!({ "strategy": {
        "strategy": { "parallel_planes": { "normal": [0, 1, 0] } },
        "region": { "box": { "min_mm": [-6, -4, -90], "max_mm": [6, 4, 90] } },
    } });
    let mut job = patch_job(&folder, ridge, &path);
    job.file.setups[0].work_from_part.rotation_deg = turn_deg;
    crate::candidates::candidates_of_operations(&job).unwrap().swap_remove(0).planes
}

#[test]
fn the_rotary_axes_choose_a_direction_along_a_ridge_between_those_by_the_extent() {
    // The ridge is 120 deg from x, so planes along it have a normal 30 deg from x.
    let planes = planes_of_ridge(30.0);
    let names: Vec<&str> = planes.iter().map(|p| p.direction).collect();
    assert_eq!(names, DIRECTIONS);
    let normal = Vector3::from(planes[4].file.normal).normalize();
    let along = Vector3::new(30f64.to_radians().cos(), 30f64.to_radians().sin(), 0.0);
    assert!(normal.dot(&along) > 0.999, "{normal}");
}

#[test]
fn a_ridge_along_the_extent_needs_no_further_direction() {
    for turn_deg in [0.0, 90.0] {
        let planes = planes_of_ridge(turn_deg);
        assert!(planes.iter().all(|p| p.direction != CALM) && planes.len() == 4, "{planes:?}");
    }
}
