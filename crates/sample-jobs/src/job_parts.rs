//! Pieces of job files: operations, tools, folders.

use std::ops::RangeInclusive;
use std::path::Path;

use serde_json::{Value, json};

/// Reader of the files that a description names: returns the bytes, or the reason in one line that
/// names the file.
pub type ReadFile<'a> = &'a dyn Fn(&Path) -> Result<Vec<u8>, String>;

/// Files of a job by their names in its folder.
pub(crate) type JobFiles = Vec<(String, Vec<u8>)>;

/// Format of the job files.
const JOB_FORMAT: &str = "facemill-job/1";

/// Scales of rotor 37 and of blades from files: below them no cutter is small enough, above
/// them no machine is large enough.
pub const ROTOR_SCALES: RangeInclusive<f64> = 0.1..=100.0;

/// Radii of face mills that can be bought, mm.
const CUTTER_RADII: [f64; 12] = [4.0, 5.0, 6.0, 8.0, 10.0, 12.5, 16.0, 20.0, 25.0, 40.0, 63.0, 80.0];

/// Largest tilt of the tools of jobs, deg.
pub(crate) const MOST_TILT_DEG: f64 = 15.0;

/// Diameter of the flange above an arbor, mm.
pub(crate) const FLANGE_DIAMETER: f64 = 128.57;

/// Returns the largest cutter that is not larger than wanted.
pub(crate) fn cutter_radius(wanted: f64) -> f64 {
    CUTTER_RADII.iter().rev().copied().find(|r| *r <= wanted * 1.001).unwrap_or(CUTTER_RADII[0])
}

/// Rounds a number for a file: no more digits than anyone types.
pub fn round_to(value: f64, decimals: i32) -> f64 {
    let unit = 10f64.powi(decimals);
    (value * unit).round() / unit
}

/// Returns the material that a cutter removes in one finishing cut, mm.
pub(crate) fn stock_for(radius: f64) -> f64 {
    round_to((radius / 40.0).max(0.2), 2)
}

/// Returns an operation; `scale` is 1 for parts of about 3 m, for which lengths along the path are
/// given.
pub(crate) fn operation(name: &str, radius: f64, strategy: &Value, scale: f64) -> Value {
    // So flat that the cutter is in the stock only where it descends by less than its ramp angle.
    let arc = json!({ "tangential_arc": { "radius_mm": round_to(12.5 * radius, 1), "angle_deg": 8.0 } });
    json!({
        "name": name,
        "path": { "strategy": { "strategy": strategy, "min_pass_length_mm": round_to(0.5 * radius, 1) } },
        "direction": "climb",
        "entry": arc,
        "exit": arc,
        "search": {
            "tilt_deg": [2.0, MOST_TILT_DEG],
            "rotate_deg": [0.0, 85.0],
            "order": "tilt_first",
            "weight": 1.0,
            "u_step": 0.1,
            "u_tolerance": 0.001,
            "max_turn_deg_per_mm": round_to(0.1 / scale.clamp(0.02, 1.0), 2),
            "preferred_branch": "positive",
        },
        "feeds": { "cutting_mm_min": 1200.0, "approach_mm_min": 2000.0, "spindle_rpm": round_to(24000.0 / radius, 0), "coolant": "flood" },
        "tolerances": {
            "mesh_chord_mm": 0.02,
            "path_chord_mm": 0.02,
            "max_step_mm": round_to((5.0 * scale).max(0.3), 2),
            "linearisation_mm": 0.02,
            "gouge_mm": 0.02,
            "max_lift_mm": 0.06,
            "cusp_mm": 0.1,
            "max_step_over_mm": round_to(0.5 * radius, 1),
        },
        "infeasible": { "trim": { "max_trimmed_fraction": 0.01 } },
    })
}

/// Returns the job file of one setup and one operation.
pub(crate) fn job_file(name: &str, setup: Value, operation: Value) -> Value {
    json!({
        "format": JOB_FORMAT,
        "name": name,
        "tool": "tool.json",
        "machine": "machine.json",
        "setups": [setup],
        "operations": [operation],
        "post": {
            "dialect": "fanuc",
            "feed_mode": "g94",
            "program_number": 1001,
            "decimals": { "linear": 3, "rotary": 4, "feed": 1, "inverse_time": 3 },
        },
    })
}

/// Returns a face mill of this radius on an arbor that reaches between blades.
pub(crate) fn tool_file(radius: f64, reach: f64) -> Value {
    let flute = round_to(0.15 * radius, 2);
    let body = round_to(0.65 * radius, 2);
    let arbor = round_to(reach.max(60.0), 1);
    let flange = 40.0;
    let stick_out = flute + body;
    json!({
        "format": facemill_tool_model::FORMAT,
        "name": format!("face mill D{} r{}", 2.0 * radius, round_to(0.075 * radius, 2)),
        "number": 1,
        "radius_mm": radius,
        "corner_radius_mm": round_to(0.075 * radius, 2),
        "n_inserts": if radius > 30.0 { 8 } else { 4 },
        "flute_length_mm": flute,
        "dead_core_radius_mm": round_to(0.75 * radius, 2),
        "max_ramp_angle_deg": 2.0,
        "spindle_rotation": "clockwise",
        "cutting_edge_angle_deg": 45.0,
        "stick_out_mm": stick_out,
        "gauge_length_mm": stick_out + arbor + flange,
        "body": {
            "clearance_mm": round_to((0.02 * radius).min(2.0), 2),
            "sections": [{ "length_mm": body, "diameter_low_mm": round_to(1.8 * radius, 2), "diameter_high_mm": round_to(1.6 * radius, 2) }],
        },
        "holder": {
            "clearance_mm": 2.0,
            "sections": [
                { "length_mm": arbor, "diameter_low_mm": round_to((1.2 * radius).min(100.0), 1), "diameter_high_mm": round_to((1.4 * radius).clamp(20.0, 110.0), 1) },
                { "length_mm": flange, "diameter_low_mm": FLANGE_DIAMETER, "diameter_high_mm": FLANGE_DIAMETER },
            ],
        },
    })
}

/// Returns the files of a job: mesh, job, and a tool and a machine for it.
pub(crate) fn job_folder(mesh: (&str, Vec<u8>), job: &Value, (radius, reach): (f64, f64)) -> Vec<(String, Vec<u8>)> {
    vec![
        (mesh.0.to_owned(), mesh.1),
        ("job.json".to_owned(), facemill_file_format::to_json(job).into_bytes()),
        ("tool.json".to_owned(), facemill_file_format::to_json(&tool_file(radius, reach)).into_bytes()),
        ("machine.json".to_owned(), facemill_inverse_kinematics::preset_head_b_table_c().as_bytes().to_vec()),
    ]
}
