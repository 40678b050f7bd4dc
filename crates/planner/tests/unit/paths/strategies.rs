use super::*;

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
