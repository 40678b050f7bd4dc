use serde_json::{Value, json};

use super::*;
use crate::examples::new_job::{NewJob, new_job};
use crate::format::job_file::PathFile;
use crate::validate::validate;

/// Returns the example patch's job with these tools, setups and operations, each as setup and tool.
fn job(tools: &[&str], setups: &[&str], operations: &[[Option<&str>; 2]]) -> JobFile {
    let files = new_job(&NewJob::Patch { size_mm: 80.0 }).unwrap();
    let (_, bytes) = files.iter().find(|(name, _)| name == "job.json").unwrap();
    let mut job: Value = serde_json::from_slice(bytes).unwrap();
    let (setup, operation) = (job["setups"][0].clone(), job["operations"][0].clone());
    let named = |value: &Value, name: &str| {
        let mut value = value.clone();
        value["name"] = json!(name);
        value
    };
    job["setups"] = setups.iter().map(|name| named(&setup, name)).collect();
    let of = |(k, [setup, tool]): (usize, &[Option<&str>; 2])| {
        let mut value = named(&operation, &format!("op {k}"));
        (value["setup"], value["tool"]) = (json!(setup), json!(tool));
        value
    };
    job["operations"] = operations.iter().enumerate().map(of).collect();
    if !tools.is_empty() {
        job.as_object_mut().unwrap().remove("tool");
        job["tools"] = tools.iter().map(|name| ((*name).to_owned(), json!(format!("{name}.json")))).collect();
    }
    serde_json::from_value(job).unwrap()
}

fn names(job: &JobFile) -> Vec<&str> {
    job.setups.iter().map(|s| s.name.as_str()).collect()
}

/// Returns the names of the operations of each setup.
fn members(job: &JobFile) -> Vec<Vec<&str>> {
    let of = |setup| job.operations.iter().filter(|o| belongs(o, setup, job)).map(|o| o.name.as_str()).collect();
    job.setups.iter().map(of).collect()
}

#[test]
fn a_setup_with_several_tools_becomes_one_for_each_row_of_operations_with_one_tool() {
    let up = Some("up");
    let (mill, ball) = (Some("mill"), Some("ball"));
    let file = job(
        &["mill", "ball"],
        &["up", "down"],
        &[[up, mill], [Some("down"), ball], [up, mill], [up, ball], [up, mill]],
    );
    validate(&file).unwrap();
    let by_tool = setups_by_tool(file);
    assert_eq!(names(&by_tool.file), ["up 1 mill", "up 2 ball", "up 3 mill", "down"]);
    assert_eq!(members(&by_tool.file), [vec!["op 0", "op 2"], vec!["op 3"], vec!["op 4"], vec!["op 1"]]);
    assert_eq!(by_tool.written, [0, 0, 0, 1]);
    // Operations keep their order and their keys.
    let order: Vec<&str> = by_tool.file.operations.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(order, ["op 0", "op 1", "op 2", "op 3", "op 4"]);
    let tools: Vec<Option<&str>> = by_tool.file.setups.iter().map(|s| tool_of_setup(&by_tool.file, s)).collect();
    assert_eq!(tools, [mill, ball, mill, ball]);
    // What is so already stays, byte for byte.
    validate(&by_tool.file).unwrap();
    let text = serde_json::to_string(&by_tool.file).unwrap();
    let again = setups_by_tool(by_tool.file);
    assert_eq!(serde_json::to_string(&again.file).unwrap(), text);
    assert_eq!(again.written, [0, 1, 2, 3]);
}

#[test]
fn the_only_setup_need_not_be_named() {
    let (mill, ball) = (Some("mill"), Some("ball"));
    let by_tool = setups_by_tool(job(&["mill", "ball"], &["up"], &[[None, ball], [None, mill], [None, mill]]));
    assert_eq!(names(&by_tool.file), ["up 1 ball", "up 2 mill"]);
    assert_eq!(members(&by_tool.file), [vec!["op 0"], vec!["op 1", "op 2"]]);
    validate(&by_tool.file).unwrap();
}

#[test]
fn a_job_with_one_tool_stays_as_it_is() {
    for file in [
        job(&[], &["up"], &[[None, None], [None, None]]),
        job(&["mill"], &["up", "down"], &[[Some("down"), None], [Some("up"), Some("mill")]]),
    ] {
        validate(&file).unwrap();
        let text = serde_json::to_string(&file).unwrap();
        assert_eq!(serde_json::to_string(&setups_by_tool(file).file).unwrap(), text);
    }
}

#[test]
fn wrong_names_of_tools_are_refused_with_their_keys() {
    let fault = |file: &JobFile| validate(file).unwrap_err();
    let mut none = job(&["mill"], &["up"], &[[None, None]]);
    none.tools.clear();
    assert!(fault(&none).starts_with("tool: is needed"), "{}", fault(&none));
    let mut both = job(&["mill"], &["up"], &[[None, None]]);
    both.tool = Some("tool.json".to_owned());
    assert!(fault(&both).starts_with("tool: leave it out beside `tools` (mill)"), "{}", fault(&both));
    let missing = job(&["mill", "ball"], &["up"], &[[None, Some("mill")], [None, None]]);
    assert_eq!(fault(&missing), "operations[1].tool: is needed because there are several tools: ball, mill");
    let unknown = job(&["mill", "ball"], &["up"], &[[None, Some("bull")]]);
    assert_eq!(fault(&unknown), "operations[0].tool: there is no tool \"bull\" in `tools`: ball, mill");
    let alone = job(&[], &["up"], &[[None, Some("mill")]]);
    assert!(fault(&alone).starts_with("operations[0].tool: names \"mill\", but the job has one tool file"));
    let (mill, ball) = (Some("mill"), Some("ball"));
    let twice = job(
        &["mill", "ball"],
        &["up", "up 1 mill"],
        &[[Some("up"), mill], [Some("up"), ball], [Some("up 1 mill"), ball]],
    );
    assert!(fault(&twice).contains("\"up 1 mill\" is named twice"), "{}", fault(&twice));
}

#[test]
fn levels_become_operations_with_a_setup_each_from_the_top_of_the_stock() {
    let mut file = job(&[], &["up"], &[[None, None], [None, None]]);
    let stock = json!({ "cylinder": { "base_mm": [0, 0, 2], "radius_mm": 30, "height_mm": 28 } });
    file.setups[0].stock = serde_json::from_value(stock).unwrap();
    let mut part = file.setups[0].meshes[0].clone();
    part.role = RoleFile::Part;
    file.setups[0].meshes.push(part);
    let levels = json!({ "axis": [0.0, 0.0, 2.0], "to_mm": 21.0, "depth_mm": 4.0 });
    file.operations[0].levels = serde_json::from_value(levels).unwrap();
    file.operations[0].allowance_mm = 0.5;
    validate(&file).unwrap();
    let by_tool = setups_by_tool(file);
    assert_eq!(names(&by_tool.file), ["up 1 tool", "up 2 tool", "up 3 tool", "up 4 tool"]);
    assert_eq!(members(&by_tool.file)[1], ["op 0 2 of 3"]);
    let of_level = |o: &OperationFile| o.levels.map(|l| [l.from_mm.unwrap(), l.to_mm]);
    let heights: Vec<[f64; 2]> = by_tool.file.operations.iter().filter_map(of_level).collect();
    assert_eq!(heights, [[30.0, 27.0], [27.0, 24.0], [24.0, 21.0]]);
    // The allowance is left on all of the part, and by the levels alone.
    let left: Vec<Vec<f64>> =
        by_tool.file.setups.iter().map(|s| s.meshes.iter().map(|m| m.allowance_mm).collect()).collect();
    assert_eq!(left, [[0.5, 0.5], [0.5, 0.5], [0.5, 0.5], [0.0, 0.0]]);
    let later: Vec<Option<bool>> = by_tool.file.operations.iter().map(|o| o.levels.map(|l| l.is_later)).collect();
    assert_eq!(later, [Some(false), Some(true), Some(true), None]);
    let text = serde_json::to_string(&by_tool.file).unwrap();
    assert_eq!(serde_json::to_string(&setups_by_tool(by_tool.file).file).unwrap(), text);

    // A lying bar is as high as its radius over its axis; a tilted box as its highest corner.
    let top = |stock: Value, axis: [f64; 3]| {
        let mut file = job(&[], &["up"], &[[None, None]]);
        file.setups[0].stock = serde_json::from_value(stock).unwrap();
        let levels = json!({ "axis": axis, "to_mm": 0.0, "depth_mm": 50.0 });
        file.operations[0].levels = serde_json::from_value(levels).unwrap();
        setups_by_tool(file).file.operations[0].levels.unwrap().from_mm.unwrap()
    };
    let lying = json!({ "cylinder": { "base_mm": [0, 0, 5], "axis": [1, 0, 0], "radius_mm": 20, "height_mm": 80 } });
    let found = top(lying, [0.0, 0.0, 1.0]);
    assert!((25.0..25.1).contains(&found), "{found}");
    let found = top(json!({ "box": { "min_mm": [-3, -4, 0], "max_mm": [3, 4, 10] } }), [0.0, -0.6, 0.8]);
    assert!((found - (2.4 + 8.0)).abs() < 1e-12, "{found}");
}

/// Returns the rounds of the operations of a job of one operation with this path and these layers.
fn rounds(path: &Value, layers: &Value) -> Vec<u32> {
    let mut job = serde_json::to_value(job(&[], &["up"], &[[None, None]])).unwrap();
    job["operations"][0]["path"]["strategy"] = path.clone();
    job["operations"][0]["layers"] = layers.clone();
    let by_tool = setups_by_tool(serde_json::from_value(job).unwrap());
    let rounds = |o: &OperationFile| match &o.path {
        PathFile::Strategy(strategy) => strategy.largest_width_rounds(),
        _ => panic!("not laid"),
    };
    by_tool.file.operations.iter().map(rounds).collect()
}

#[test]
fn fronts_alone_have_rounds_by_themselves_and_layers_have_none() {
    let fronts = json!({ "constant_scallop": { "seed": "border" } });
    let planes = json!({ "parallel_planes": { "normal": [0, 1, 0] } });
    let layers = json!({ "from_mm": 5.0, "depth_mm": 3.0 });
    assert_eq!(rounds(&json!({ "strategy": fronts }), &Value::Null), [3]);
    assert_eq!(rounds(&json!({ "strategy": planes }), &Value::Null), [0]);
    assert_eq!(rounds(&json!({ "strategy": fronts, "width_rounds": 1 }), &Value::Null), [1]);
    assert_eq!(rounds(&json!({ "strategy": fronts }), &layers), [0, 0]);
    assert_eq!(rounds(&json!({ "strategy": fronts, "width_rounds": 2 }), &layers), [2, 2]);
}
