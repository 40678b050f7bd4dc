use crate::strategy::file::*;
use facemill_file_format::{from_json, to_json};

fn strategy(text: &str) -> Result<Strategy, String> {
    from_json::<StrategyFile>(text.as_bytes())
        .map_err(|e| e.to_string())
        .and_then(|f| f.to_strategy().map_err(|e| e.to_string()))
}

#[test]
fn strategies_are_read_with_their_defaults() {
    let planes = strategy(r#"{"parallel_planes": {"normal": [0, 3e-200, 4e-200]}}"#).unwrap();
    let expected = ParallelPlanes {
        origin: Point3::origin(),
        normal: Unit::new_normalize(Vector3::new(0.0, 0.6, 0.8)),
        from: None,
        to: None,
    };
    let Strategy::ParallelPlanes(planes) = planes else { panic!("{planes:?}") };
    assert!((planes.normal.into_inner() - expected.normal.into_inner()).norm() < 1e-15);
    assert_eq!(ParallelPlanes { normal: expected.normal, ..planes }, expected);
    let text = r#"{"cylindrical_sections": {"axis_direction": [0, 0, 2], "from_radius_mm": 10, "to_radius_mm": 20}}"#;
    let Ok(Strategy::CylindricalSections(sections)) = strategy(text) else { panic!("{text}") };
    assert_eq!((sections.axis_direction, sections.from_radius, sections.to_radius), (Vector3::z_axis(), 10.0, 20.0));
}

#[test]
fn what_is_wrong_with_a_strategy_is_named() {
    let wrong = [
        (r#"{"parallel_plane": {"normal": [0, 0, 1]}}"#, "did you mean `parallel_planes`"),
        (r#"{"parallel_planes": {"normal": [0, 0, 0]}}"#, "length of parallel_planes.normal is 0"),
        (r#"{"parallel_planes": {"normal": [0, 0, 1], "from_mm": 3, "to_mm": 1}}"#, "parallel_planes.to_mm is 1"),
        (r#"{"parallel_planes": {"norml": [0, 0, 1]}}"#, "did you mean `normal`"),
        (
            r#"{"cylindrical_sections": {"axis_direction": [0,0,1], "from_radius_mm": -1, "to_radius_mm": 5}}"#,
            "cylindrical_sections.from_radius_mm is -1",
        ),
    ];
    for (text, expected) in wrong {
        let e = strategy(text).unwrap_err();
        assert!(e.contains(expected), "{e}");
    }
}

#[test]
fn regions_are_read_with_all_their_conditions_and_written_back() {
    let text = r#"{"groups": ["blade"], "normal_cone": {"axis": [0, 0, 2], "half_angle_deg": 90},
            "box": {"min_mm": [0, 1, 2], "max_mm": [3, 4, 5]},
            "between": {"parallel_planes": {"normal": [0, 0, 3], "from_mm": 2}}}"#;
    let file: RegionFile = from_json(text.as_bytes()).unwrap();
    let region = file.to_region().unwrap();
    assert_eq!(region.groups, Some(vec!["blade".to_owned()]));
    let half_angle = std::f64::consts::FRAC_PI_2;
    assert_eq!(region.normal_cone, Some(NormalCone { axis: Vector3::z_axis(), half_angle }));
    assert_eq!(region.bounds.unwrap().max, Point3::new(3.0, 4.0, 5.0));
    assert_eq!(region.between.unwrap().range(), (2.0, f64::INFINITY));
    assert_eq!(from_json::<RegionFile>(to_json(&file).as_bytes()), Ok(file));
    assert_eq!(from_json::<RegionFile>(b"{}").unwrap().to_region().unwrap(), Region::default());
    let empty: RegionFile = from_json(br#"{"box": {"min_mm": [0, 9, 0], "max_mm": [1, 2, 3]}}"#).unwrap();
    assert!(empty.to_region().unwrap_err().to_string().contains("region.box.max_mm[1] is 2"));
    let text = br#"{"between": {"parallel_planes": {"normal": [1, 0, 0], "from_mm": 3, "to_mm": 1}}}"#;
    let empty: RegionFile = from_json(text).unwrap();
    assert!(empty.to_region().unwrap_err().to_string().contains("parallel_planes.to_mm is 1"));
}
