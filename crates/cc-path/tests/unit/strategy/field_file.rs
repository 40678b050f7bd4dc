use crate::sections::Sections;
use crate::strategy::Strategy;
use crate::strategy::field_file::*;
use crate::strategy::file::StrategyFile;
use facemill_file_format::from_json;

fn strategy(json: &str) -> Result<Strategy, PathError> {
    from_json::<StrategyFile>(json.as_bytes()).unwrap().to_strategy()
}

#[test]
fn flows_and_spirals_are_read_with_their_defaults() {
    let flow = strategy(
        r#"{ "flow": { "from": { "group": "hub" }, "to": { "cylinder": { "axis_direction": [0, 0, 2], "radius_mm": 30 } } } }"#,
    );
    let Ok(Strategy::Flow(flow)) = flow else { panic!("{flow:?}") };
    assert_eq!((flow.from, flow.within), (FlowEnd::Group("hub".to_owned()), 0.05));
    let FlowEnd::Cylinder { axis_direction, radius, .. } = flow.to else { panic!() };
    assert_eq!((axis_direction.z, radius), (1.0, 30.0));
    let spiral = strategy(r#"{ "spiral": { "parallel_planes": { "normal": [0, 0, 3], "from_mm": 2 } } }"#);
    let Ok(Strategy::Spiral(Spiral { levels: SpiralLevels::Sections(Sections::ParallelPlanes(planes)) })) = spiral
    else {
        panic!("{spiral:?}")
    };
    assert_eq!((planes.normal.z, planes.from), (1.0, Some(2.0)));
    let flow = r#"{ "from": { "plane": { "normal": [1, 0, 0] } }, "to": { "curve": { "points_mm": [[0, 0, 1], [2, 0, 1]] } } }"#;
    assert!(matches!(strategy(&format!(r#"{{ "spiral": {{ "flow": {flow} }} }}"#)), Ok(Strategy::Spiral(_))));
}

#[test]
fn numbers_out_of_range_are_named() {
    for (from, named) in [
        (r#""plane": { "normal": [0, 0, 0] }"#, "length of flow.from.plane.normal is 0"),
        (r#""cylinder": { "axis_direction": [0, 0, 1], "radius_mm": -1 }"#, "flow.from.cylinder.radius is -1"),
        (r#""curve": { "points_mm": [[0, 0, 0]] }"#, "points of flow.from.curve is 1"),
    ] {
        let e =
            strategy(&format!(r#"{{ "flow": {{ "from": {{ {from} }}, "to": {{ "group": "tip" }} }} }}"#)).unwrap_err();
        assert!(e.to_string().starts_with(named), "{e}");
    }
    let none = r#"{ "flow": { "from": { "group": "a" }, "to": { "group": "b" }, "within_mm": 0 } }"#;
    assert!(strategy(none).unwrap_err().to_string().starts_with("flow.within is 0"));
}
