use super::*;
use nalgebra::Point3;

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
    let [beside, across] = planes_of(&points).unwrap();
    // Planes along the strip have their normal across it.
    assert!(Vector3::from(beside.normal).normalize().dot(&Vector3::z()) > 1.0 - 1e-6, "{beside:?}");
    assert!(Vector3::from(across.normal).normalize().dot(&along) > 1.0 - 1e-6, "{across:?}");
    points.reverse();
    assert_eq!(planes_of(&points).unwrap(), [beside, across]);
    assert!(planes_of(&[]).is_none());
}

#[test]
fn a_sphere_has_no_side_for_planes() {
    let at = |k: u32| f64::from(k) * 0.7;
    let normal = |k: u32| Vector3::new(at(k).cos(), at(k).sin(), (1.3 * at(k)).sin());
    let points: Vec<CcPoint> = (0..400)
        .map(|k| CcPoint::new(Point3::from(normal(k)), normal(k), Vector3::new(0.3, -0.2, 0.9)).unwrap())
        .collect();
    assert!(planes_of(&points).is_none());
}

#[test]
fn strategies_that_need_data_are_no_candidates() {
    let names: Vec<String> = further_strategies().into_iter().map(|(name, _)| name).collect();
    assert!(names.iter().all(|n| n != "parallel planes" && n != "cylindrical sections"), "{names:?}");
}
