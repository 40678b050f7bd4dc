use super::*;
use crate::tool_file::{FORMAT, FormatTag};

const TOOL: &str = r#"{
        "format": "facemill-tool/1", "name": "D160 R6", "number": 7,
        "radius_mm": 80, "corner_radius_mm": 6, "n_inserts": 8, "flute_length_mm": 7,
        "dead_core_radius_mm": 60, "max_ramp_angle_deg": 1.5, "spindle_rotation": "clockwise",
        "stick_out_mm": 63, "gauge_length_mm": 183,
        "body": {"clearance_mm": 0.5, "sections": [{"length_mm": 56, "diameter_low_mm": 158, "diameter_high_mm": 130}]},
        "holder": {"clearance_mm": 2, "sections": [
            {"length_mm": 20, "diameter_low_mm": 89, "diameter_high_mm": 89},
            {"length_mm": 100, "diameter_low_mm": 89, "diameter_high_mm": 128}]}
    }"#;

fn changed(key: &str, to: &str) -> Result<ToolAssembly, ToolFileError> {
    assert!(TOOL.contains(key), "{key}");
    ToolAssembly::from_json(TOOL.replacen(key, to, 1).as_bytes())
}

fn field_of(e: ToolFileError) -> String {
    match e {
        ToolFileError::Format(e) => e.field,
        ToolFileError::Cutter(e) => e.to_string(),
        ToolFileError::OutOfRange { field, .. } => field,
        ToolFileError::Gap { field, .. } => field.to_owned(),
    }
}

#[test]
fn file_survives_writing_and_reading() {
    let tool = ToolAssembly::from_json(TOOL.as_bytes()).unwrap();
    let text = facemill_file_format::to_json(&tool.to_file());
    assert!(text.contains(FORMAT));
    assert_eq!(ToolAssembly::from_json(text.as_bytes()).unwrap(), tool);
    assert_eq!(tool.to_file().format, FormatTag::V1);
    assert!(facemill_file_format::schema::<ToolFile>().contains(FORMAT));
}

#[test]
fn bodies_stand_on_each_other_from_flute_to_gauge_line() {
    let tool = ToolAssembly::from_json(TOOL.as_bytes()).unwrap();
    let mut ends = Vec::new();
    for body in tool.collision_bodies() {
        let Solid::Frustum(f) = body.solid else { panic!("{} is turned", body.name) };
        assert_eq!(body.frame_from_solid, Isometry3::identity());
        ends.push((body.name, f.z_low, f.z_high, f.radius_high, f.rounding));
    }
    let expected = [
        ("cutter body section 1".to_owned(), 7.0, 63.0, 65.0, 0.5),
        ("holder section 1".to_owned(), 63.0, 83.0, 44.5, 2.0),
        ("holder section 2".to_owned(), 83.0, 183.0, 64.0, 2.0),
    ];
    assert_eq!(ends, expected);
}

#[test]
fn faults_name_their_field() {
    let cases = [
        ("\"radius_mm\": 80", "\"radius_mm\": 0", "radius_mm"),
        ("\"corner_radius_mm\": 6", "\"corner_radius_mm\": 81", "corner radius 81 mm"),
        ("\"flute_length_mm\": 7", "\"flute_length_mm\": 5", "flute length 5 mm"),
        ("\"dead_core_radius_mm\": 60", "\"dead_core_radius_mm\": 80", "dead_core_radius_mm"),
        ("\"max_ramp_angle_deg\": 1.5", "\"max_ramp_angle_deg\": -1", "max_ramp_angle_deg"),
        ("\"n_inserts\": 8", "\"n_inserts\": 0", "n_inserts"),
        ("\"stick_out_mm\": 63", "\"stick_out_mm\": 3", "stick_out_mm"),
        ("\"stick_out_mm\": 63", "\"stick_out_mm\": 64", "body"),
        ("\"gauge_length_mm\": 183", "\"gauge_length_mm\": 184", "holder"),
        ("\"gauge_length_mm\": 183", "\"gauge_length_mm\": 60", "gauge_length_mm"),
        ("\"clearance_mm\": 2", "\"clearance_mm\": -2", "holder.clearance_mm"),
        ("\"length_mm\": 100", "\"length_mm\": 0", "holder.sections[1].length_mm"),
        ("\"length_mm\": 100", "\"length_mm\": 1e5", "holder.sections[1].length_mm"),
        ("\"radius_mm\": 80", "\"radius_mm\": 80000", "radius_mm"),
        ("\"diameter_low_mm\": 158", "\"diameter_low_mm\": -158", "body.sections[0].diameter_low_mm"),
        ("\"cloc", "\"clock", "spindle_rotation"),
        ("facemill-tool/1", "facemill-tool/2", "format"),
        ("\"name\"", "\"nmae\"", "nmae"),
    ];
    for (from, to, field) in cases {
        let found = field_of(changed(from, to).unwrap_err());
        assert!(found.contains(field), "{to}: {found}");
    }
    assert!(changed("\"n_inserts\": 8", "\"cutting_edge_angle_deg\": 91, \"n_inserts\": 8").is_err());
}

/// Paths of JSON of every number with this key.
fn places(value: &serde_json::Value, key: &str, at: &str) -> Vec<String> {
    let children: Vec<(String, &serde_json::Value)> = match value {
        serde_json::Value::Object(map) => map.iter().map(|(k, v)| (k.clone(), v)).collect(),
        serde_json::Value::Array(list) => list.iter().enumerate().map(|(k, v)| (k.to_string(), v)).collect(),
        _ => return Vec::new(),
    };
    let of_child = |(name, child): (String, &serde_json::Value)| {
        let here = format!("{at}/{name}");
        let own = (name == key).then(|| here.clone());
        own.into_iter().chain(places(child, key, &here)).collect::<Vec<_>>()
    };
    children.into_iter().flat_map(of_child).collect()
}

#[test]
fn values_beyond_their_limits_are_refused_with_field_and_limits_and_those_within_are_read() {
    let whole: serde_json::Value = serde_json::from_str(TOOL).unwrap();
    for limit in TOOL_LIMITS {
        let found = places(&whole, limit.key, "");
        assert!(!found.is_empty(), "{}", limit.key);
        let is_count = matches!(limit.key, "number" | "n_inserts");
        for place in found {
            let with = |value: f64| {
                let mut file = whole.clone();
                let number = if is_count { (value as u64).into() } else { serde_json::json!(value) };
                *file.pointer_mut(&place).unwrap() = number;
                ToolAssembly::from_json(file.to_string().as_bytes()).map_err(|e| e.to_string())
            };
            let range = format!("from {} to {}", limit.least, limit.most);
            let away = |value: f64| if is_count { 1.0 } else { (1e-3 * value.abs()).max(1e-9) };
            for outside in [limit.least - away(limit.least), limit.most + away(limit.most), 4e9] {
                let e = with(outside).unwrap_err();
                assert!(e.contains(limit.key) && e.contains(&range), "{place} {outside}: {e}");
            }
            // Within, another law may refuse it: a stick-out shorter than the flute.
            for inside in [limit.least, limit.most] {
                assert!(with(inside).map_or_else(|e| !e.contains(&range), |_| true), "{place} {inside}");
            }
        }
    }
}

#[test]
fn numbers_that_are_no_numbers_are_refused() {
    let good = ToolAssembly::from_json(TOOL.as_bytes()).unwrap().to_file();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let set: [fn(&mut ToolFile, f64); 8] = [
            |f, v| f.radius_mm = v,
            |f, v| f.corner_radius_mm = v,
            |f, v| f.flute_length_mm = v,
            |f, v| f.dead_core_radius_mm = v,
            |f, v| f.stick_out_mm = v,
            |f, v| f.gauge_length_mm = v,
            |f, v| f.holder.clearance_mm = v,
            |f, v| f.body.sections[0].diameter_high_mm = v,
        ];
        for (k, set) in set.iter().enumerate() {
            let mut file = good.clone();
            set(&mut file, bad);
            assert!(ToolAssembly::new(file).is_err(), "setter {k} with {bad}");
        }
    }
}
