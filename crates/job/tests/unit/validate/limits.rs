use facemill_file_format::from_json;
use serde_json::{Value, json};

use crate::examples::new_job::{NewJob, new_job};
use crate::validate::limits::*;
use crate::validate::validate;

/// Returns example jobs with all keys that have limits between them.
fn jobs() -> [Value; 6] {
    let files = new_job(&NewJob::Patch { size_mm: 100.0 }).unwrap();
    let mut laid: Value =
        serde_json::from_slice(&files.iter().find(|(name, _)| name == "job.json").unwrap().1).unwrap();
    laid["verification"] = json!({ "stock_cell_mm": 1.0, "stock_tolerance_mm": 0.05 });
    let operation = &mut laid["operations"][0];
    operation["pattern"] = json!({ "copies": 3, "index_angle_deg": 120.0, "axis": [0, 0, 1] });
    operation["search"]["certified_u_width"] = json!(0.01);
    let mut read = laid.clone();
    read["operations"][0]["path"] = json!({ "file": { "file": "path.json", "max_distance_mm": 1.0 } });
    for key in ["entry", "exit"] {
        read["operations"][0][key] = json!({ "roll_in": { "radius_mm": 30.0, "angle_deg": 20.0 } });
    }
    let mut short = laid.clone();
    for key in ["entry", "exit"] {
        short["operations"][0][key] =
            json!({ "shortest": { "radius_mm": 30.0, "angle_deg": 20.0, "straight_mm": 5.0 } });
    }
    let mut layers = laid.clone();
    layers["operations"][0]["layers"] = json!({ "from_mm": 5.0, "depth_mm": 2.0 });
    layers["setups"][0]["rest_cell_mm"] = json!(1.0);
    let mut cl = laid.clone();
    cl["operations"][0]["path"] = json!({ "cl": { "file": "part.apt", "axes": "searched", "max_distance_mm": 0.1 } });
    let mut levels = laid.clone();
    levels["operations"][0]["levels"] = json!({ "axis": [0, 0, 1], "from_mm": 5.0, "to_mm": 0.0, "depth_mm": 2.0 });
    levels["operations"][0].as_object_mut().unwrap().remove("pattern");
    levels["setups"][0]["stock"] = json!({ "box": { "min_mm": [-60, -60, -10], "max_mm": [60, 60, 20] } });
    [laid, read, short, layers, cl, levels]
}

/// Replaces a value and returns the result of the whole check of the job.
fn with(job: &Value, place: &str, value: f64, is_count: bool) -> Result<(), String> {
    let mut job = job.clone();
    let mut at = &mut job;
    for part in place.split('/') {
        at = match part.parse::<usize>() {
            Ok(index) => &mut at[index],
            Err(_) => &mut at[part],
        };
    }
    *at = if is_count { json!(value as u64) } else { json!(value) };
    validate(&from_json::<JobFile>(job.to_string().as_bytes()).map_err(|e| e.to_string())?)
}

/// Tries the limits of a table with values just outside and inside.
fn walk<T>(limits: &[JobLimit<T>], below: &str, of: impl Fn(&JobFile) -> &T) {
    for limit in limits {
        let jobs = jobs();
        let has_it = |job: &&Value| {
            let file: JobFile = from_json(job.to_string().as_bytes()).unwrap();
            (limit.of)(of(&file)).is_some()
        };
        let job = jobs.iter().find(has_it).unwrap_or_else(|| panic!("{}", limit.key));
        let is_count = ["pattern.copies", "path.strategy.width_rounds"].contains(&limit.key);
        let place = format!("{below}/{}", limit.key.replace('.', "/"));
        let range = format!("from {} to {}", limit.least, limit.most);
        let away = |value: f64| if is_count { 1.0 } else { (1e-3 * value.abs()).max(1e-9) };
        let outside = [limit.least - away(limit.least), limit.most + away(limit.most), 4e9];
        // A count below 0 is no count, which its type refuses.
        for outside in outside.into_iter().filter(|&value| !is_count || value >= 0.0) {
            let e = with(job, &place, outside, is_count).unwrap_err();
            assert!(e.contains(limit.key) && e.contains(&range), "{place} {outside}: {e}");
        }
        // Within, another law may refuse it: copies that come back to the first place.
        for inside in [limit.least, limit.most] {
            let taken = with(job, &place, inside, is_count);
            assert!(taken.as_ref().map_or_else(|e| !e.contains(&range), |()| true), "{place} {inside}: {taken:?}");
        }
    }
}

#[test]
fn values_beyond_their_limits_are_refused_with_field_and_limits_and_those_within_are_read() {
    for job in jobs() {
        validate(&from_json::<JobFile>(job.to_string().as_bytes()).unwrap()).unwrap();
    }
    walk(&OPERATION_LIMITS, "operations/0", |job| &job.operations[0]);
    walk(&SETUP_LIMITS, "setups/0", |job| &job.setups[0]);
    walk(&JOB_LIMITS, "verification", |job| job);
}
