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
fn constant_scallop_from_the_border_is_a_candidate_and_strategies_that_need_data_are_none() {
    let further = further_strategies();
    let names: Vec<&str> = further.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["constant scallop"]);
    // What a job file needs of it is the seed alone.
    let written = serde_json::to_value(&further[0].1).unwrap();
    assert_eq!(written, serde_json::json!({ "constant_scallop": { "seed": "border" } }));
    let schema: Value = serde_json::from_str(&facemill_file_format::schema::<StrategyFile>()).unwrap();
    let kinds = schema["oneOf"].as_array().unwrap().iter().filter_map(|kind| kind["required"][0].as_str());
    let by_name_alone = |name: &&str| from_value::<StrategyFile>(serde_json::json!({ *name: {} })).is_ok();
    let kinds: Vec<&str> = kinds.collect();
    assert!(kinds.len() >= 6, "{kinds:?}");
    // One that needs no data at all is to be among the candidates.
    assert_eq!(kinds.iter().find(|name| by_name_alone(name)), None);
}
