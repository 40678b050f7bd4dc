//! Ranges of keys in the schemas against those that reading a file enforces.

use facemill::file_format::{KeyLimit, from_value};
use facemill::inverse_kinematics::MACHINE_LIMITS;
use facemill::job::format::job_file::{JobFile, PathFile};
use facemill::job::validate::validate;
use facemill::tool_model::TOOL_LIMITS;
use facemill_tests::shared::workspace;
use serde_json::{Value, json};

fn file(path: &str) -> Value {
    let text = std::fs::read(workspace().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"));
    serde_json::from_slice(&text).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// All properties of a schema with this key, each as the numbers that it holds.
fn properties_of<'s>(schema: &'s Value, key: &str, found: &mut Vec<&'s Value>) {
    if let Some(property) = schema["properties"].get(key) {
        found.push(property.get("items").unwrap_or(property));
    }
    let children = schema.as_object().map(|keys| keys.values().collect::<Vec<_>>());
    let items = schema.as_array().map(|items| items.iter().collect());
    for child in children.or(items).unwrap_or_default() {
        properties_of(child, key, found);
    }
}

fn check_limits(schema: &str, limits: &[KeyLimit], excepted: &[&str]) {
    let schema = file(schema);
    for limit in limits.iter().filter(|l| !excepted.contains(&l.key)) {
        let mut properties = Vec::new();
        properties_of(&schema, limit.key, &mut properties);
        assert!(!properties.is_empty(), "no key {}", limit.key);
        for property in properties {
            let range = [&property["minimum"], &property["maximum"]].map(Value::as_f64);
            assert_eq!(range, [Some(limit.least), Some(limit.most)], "{}", limit.key);
        }
    }
}

#[test]
fn ranges_in_the_schemas_of_tools_and_machines_are_those_that_are_checked() {
    // Sections of tools and of holders are one type, and holders allow no diameter.
    check_limits("docs/schemas/tool.json", &TOOL_LIMITS, &["length_mm", "diameter_low_mm", "diameter_high_mm"]);
    check_limits("docs/schemas/machine.json", &MACHINE_LIMITS, &[]);
}

/// Every number of a value that has a range in its schema: where it is, and numbers beyond the
/// range.
fn beyond(value: &Value, schema: &Value, root: &Value, at: &str, found: &mut Vec<(String, Value)>) {
    let schema = match schema["$ref"].as_str() {
        Some(path) => &root["$defs"][path.rsplit('/').next().unwrap()],
        None => schema,
    };
    for part in ["anyOf", "oneOf"].iter().flat_map(|key| schema[*key].as_array().into_iter().flatten()) {
        beyond(value, part, root, at, found);
    }
    match value {
        Value::Number(_) => {
            let limit = |key: &str| schema[key].as_f64();
            let is_whole = schema["type"] == "integer";
            let number = |value: f64| if is_whole { json!(value.round() as i64) } else { json!(value) };
            let step = |limit: f64| if is_whole { 1.0 } else { 1e-3 * limit.abs() + 1e-9 };
            found.extend(limit("minimum").map(|least| (at.to_owned(), number(least - step(least)))));
            found.extend(limit("exclusiveMinimum").map(|above| (at.to_owned(), number(above))));
            found.extend(limit("maximum").map(|most| (at.to_owned(), number(most + step(most)))));
        }
        Value::Object(keys) => {
            for (key, value) in keys {
                beyond(value, &schema["properties"][key], root, &format!("{at}/{key}"), found);
            }
        }
        Value::Array(items) => {
            for (k, value) in items.iter().enumerate() {
                beyond(value, &schema["items"], root, &format!("{at}/{k}"), found);
            }
        }
        _ => {}
    }
}

/// Job with most of the keys that have a range.
fn whole_job() -> Value {
    let mut job = file("assets/propeller/job.json");
    job["verification"] = json!({ "stock_cell_mm": 5.0, "stock_tolerance_mm": 0.05 });
    let setup = &mut job["setups"][0];
    setup["rapid_clearance_mm"] = json!(5.0);
    setup["work_from_part"] = json!({ "rotation_deg": 10.0 });
    setup["meshes"][0]["allowance_mm"] = json!(0.0);
    setup["stock"] = json!({ "offset": { "allowance_mm": 1.0 } });
    setup["clearance"] = json!({ "sphere": { "radius_mm": 3000.0 } });
    let operation = &mut job["operations"][0];
    operation["pattern"] = json!({ "copies": 2, "index_angle_deg": 90.0 });
    operation["exit"] = json!({ "roll_in": { "radius_mm": 20.0, "angle_deg": 45.0 } });
    operation["path"]["strategy"]["region"]["left_above"] =
        json!({ "height_mm": 0.15, "overlap_mm": 5.0, "of": "initial_stock" });
    operation["finish"] = json!({ "max_above_fraction": 0.1, "max_never_cut_fraction": 0.1 });
    operation["infeasible"] = json!({ "trim": { "max_trimmed_fraction": 0.1 } });
    operation["search"] = json!({
        "tilt_deg": [2, 15], "rotate_deg": [0, 85], "weight": 1, "u_step": 0.1, "u_tolerance": 0.001, "certified_u_width": 0.01,
        "max_turn_deg_per_mm": 0.1, "singular_cone_deg": 1, "tool_axis_cone": { "half_angle_deg": 80 },
        "mode": { "fixed": { "lead_deg": 3, "lean_deg": 0 } }
    });
    operation["feeds"] = json!({
        "cutting_mm_min": 1000, "approach_mm_min": 1000, "spindle_rpm": 300, "air_mm_min": 1000,
        "removal_rate": { "target_cm3_min": 60, "min_mm_min": 300 }, "chip_thickness": { "max_mm": 0.25 }
    });
    job
}

/// Reads a job as planning does, without the files that it names.
fn check(job: &Value) -> Result<(), String> {
    let job: JobFile = from_value(job.clone()).map_err(|e| e.to_string())?;
    validate(&job)?;
    for operation in &job.operations {
        if let PathFile::Strategy(path) = &operation.path {
            path.strategy.to_strategy().map_err(|e| e.to_string())?;
            path.region.to_region().map_err(|e| e.to_string())?;
        }
    }
    Ok(())
}

#[test]
fn a_job_with_a_number_beyond_its_range_in_the_schema_is_refused() {
    let (job, schema) = (whole_job(), file("docs/schemas/job.json"));
    check(&job).unwrap();
    let mut places = Vec::new();
    beyond(&job, &schema, &schema, "", &mut places);
    // Ranges of the program's form are checked with the dialect's own.
    places.retain(|(at, _)| !at.starts_with("/post/"));
    assert!(places.len() > 60, "only {} ranges", places.len());
    for (at, value) in places {
        let mut wrong = job.clone();
        *wrong.pointer_mut(&at).unwrap() = value.clone();
        assert!(check(&wrong).is_err(), "{at}: {value} is taken");
    }
}
