use crate::sections::Sections;
use crate::strategy::Strategy;
use crate::strategy::file::StrategyFile;
use crate::strategy::scallop_file::*;
use facemill_file_format::from_json;

fn strategy(json: &str) -> Result<ConstantScallop, PathError> {
    let file = from_json::<StrategyFile>(format!(r#"{{ "constant_scallop": {json} }}"#).as_bytes()).unwrap();
    file.to_strategy().map(|s| match s {
        Strategy::ConstantScallop(s) => s,
        other => panic!("{other:?}"),
    })
}

#[test]
fn seeds_are_read_with_unit_directions() {
    let of = |seed: &str| strategy(&format!(r#"{{ "seed": {seed} }}"#)).unwrap();
    assert_eq!(of(r#""border""#), ConstantScallop { seeds: vec![Seed::Border], within: None });
    assert_eq!(of(r#"{ "group_border": "hub" }"#).seeds, [Seed::GroupBorder("hub".to_owned())]);
    let points = vec![Point3::new(0.0, 0.0, 1.0), Point3::new(2.0, 0.0, 1.0)];
    assert_eq!(of(r#"{ "points_mm": [[0, 0, 1], [2, 0, 1]] }"#).seeds, [Seed::Curve(points)]);
    let seeds = of(r#"{ "cylinder": { "axis_direction": [0, 0, 2], "radius_mm": 30 } }"#).seeds;
    assert!(matches!(seeds[..], [Seed::Cylinder { axis_direction, radius: 30.0, .. }] if axis_direction.z == 1.0));
}

#[test]
fn a_second_seed_and_bounds_are_read() {
    let read = strategy(
        r#"{ "seed": { "plane": { "normal": [3, 0, 0] } }, "second_seed": "border",
             "within": { "parallel_planes": { "normal": [0, 1, 0], "to_mm": 5 } } }"#,
    );
    let read = read.unwrap();
    assert!(matches!(read.seeds[..], [Seed::Plane { normal, .. }, Seed::Border] if normal.x == 1.0));
    assert!(matches!(read.within, Some(Sections::ParallelPlanes(planes)) if planes.to == Some(5.0)));
}

#[test]
fn a_seed_that_is_given_twice_is_refused() {
    let seeds = |second: &str| {
        let first = r#""plane": { "normal": [3, 0, 0] }"#;
        strategy(&format!(r#"{{ "seed": {{ {first} }}, "second_seed": {{ "plane": {{ {second} }} }} }}"#))
    };
    let e = seeds(r#""normal": [1, 0, 0]"#).unwrap_err().to_string();
    assert!(e.contains("constant_scallop.second_seed is 1, but has to be 2; leave second_seed out"), "{e}");
    assert!(seeds(r#""normal": [1, 0, 0], "origin_mm": [5, 0, 0]"#).is_ok());
}

#[test]
fn numbers_out_of_range_are_named() {
    for (seed, named) in [
        (r#""plane": { "normal": [0, 0, 0] }"#, "length of constant_scallop.seed.plane.normal is 0"),
        (
            r#""cylinder": { "axis_direction": [0, 0, 1], "radius_mm": 0 }"#,
            "constant_scallop.seed.cylinder.radius_mm is 0",
        ),
        (r#""points_mm": [[0, 0, 0]]"#, "number of constant_scallop.seed.points_mm is 1"),
    ] {
        let e = strategy(&format!(r#"{{ "seed": {{ {seed} }} }}"#)).unwrap_err();
        assert!(e.to_string().starts_with(named), "{e}");
    }
}
