use super::*;

#[test]
fn constant_scallop_from_the_border_is_a_candidate_and_strategies_that_need_data_are_none() {
    let planes: StrategyFile =
        from_value(serde_json::json!({ "parallel_planes": { "normal": [0.0, 1.0, 0.0] } })).unwrap();
    // What a job file needs of it is the seed alone, and the levels between which the job cuts.
    let written = serde_json::to_value(constant_scallop(SeedFile::Border, &planes)).unwrap();
    assert_eq!(written, serde_json::json!({ "constant_scallop": { "seed": "border" } }));
    let between: StrategyFile =
        from_value(serde_json::json!({ "parallel_planes": { "normal": [0.0, 1.0, 0.0], "to_mm": 7.0 } })).unwrap();
    let written = serde_json::to_value(constant_scallop(SeedFile::Border, &between)).unwrap();
    assert_eq!(written["constant_scallop"]["within"]["parallel_planes"]["to_mm"], 7.0);
    let schema: Value = serde_json::from_str(&facemill_file_format::schema::<StrategyFile>()).unwrap();
    let kinds = schema["oneOf"].as_array().unwrap().iter().filter_map(|kind| kind["required"][0].as_str());
    let by_name_alone = |name: &&str| from_value::<StrategyFile>(serde_json::json!({ *name: {} })).is_ok();
    let kinds: Vec<&str> = kinds.collect();
    assert!(kinds.len() >= 6, "{kinds:?}");
    // One that needs no data at all is to be among the candidates.
    assert_eq!(kinds.iter().find(|name| by_name_alone(name)), None);
}

#[test]
fn what_bounds_the_passes_of_a_strategy_bounds_those_that_take_its_place() {
    let range = |value: Value| range_of(&from_value(value).unwrap()).map(|file| serde_json::to_value(file).unwrap());
    let planes = |to: Value| serde_json::json!({ "parallel_planes": { "normal": [0.0, 1.0, 0.0], "to_mm": to } });
    assert_eq!(range(planes(Value::Null)), None);
    assert_eq!(range(planes(7.0.into())).unwrap()["parallel_planes"]["to_mm"], 7.0);
    let rings = serde_json::json!({ "cylindrical_sections": {
        "axis_direction": [0.0, 0.0, 1.0], "from_radius_mm": 3.0, "to_radius_mm": 9.0 } });
    assert_eq!(range(rings).unwrap()["cylindrical_sections"]["to_radius_mm"], 9.0);
    assert_eq!(range(serde_json::json!({ "constant_scallop": { "seed": "border" } })), None);
}
