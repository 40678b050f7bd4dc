//! The example job for a machine with two heads: a propeller, both sides at once.

use facemill_sample_parts::{BladeResolution, PropellerSeries, PropellerSpec, chord_error};
use serde_json::{Value, json};

use crate::job_parts::{JobFiles, cutter_radius, job_file, operation, round_to, stock_for, tool_file};
use crate::propeller_mesh::{CHORD_QUADS, RADIAL_QUADS, propeller_glb};

/// Diameters that fit the preset machine, mm.
const DIAMETERS: [f64; 2] = [600.0, 1100.0];

/// Returns DTMB 4119 on the mill with two heads along a horizontal C, the suction side cut by head
/// 1 and the pressure side by head 2.
///
/// The tool of head 2 is left-handed: seen from outside, the sides of a blade are mirror images,
/// and so both are cut climbing from the leading to the trailing edge, at opposite places.
pub(crate) fn dual_propeller_job(diameter: f64) -> Result<JobFiles, String> {
    let [least, most] = DIAMETERS;
    if !(least..=most).contains(&diameter) {
        return Err(format!("diameter must be from {least} to {most} mm on the machine with two heads, is {diameter}"));
    }
    let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, diameter).map_err(|e| e.to_string())?;
    let resolution = BladeResolution::new(RADIAL_QUADS, CHORD_QUADS).map_err(|e| e.to_string())?;
    let (glb, [bottom, top]) = propeller_glb(&spec, resolution)?;
    let chord = chord_error(&spec, resolution).sides;
    let radius = cutter_radius(0.026 * diameter);
    let stock = stock_for(radius);
    let plane = |z: f64, normal: f64| json!({ "plane": { "origin_mm": [0.0, 0.0, z], "normal": [0.0, 0.0, normal] } });
    let meshes = json!([
        { "file": "propeller.glb", "groups": ["blade-1/suction", "blade-1/pressure"], "role": "drive", "unit": "metre", "up_axis": "y" },
        { "file": "propeller.glb", "groups": ["blade-*"], "role": "part", "unit": "metre", "up_axis": "y" },
        { "file": "propeller.glb", "groups": ["hub/*"], "role": "check", "unit": "metre", "up_axis": "y", "allowance_mm": 1.0 },
    ]);
    let setup = json!({
        "name": "on the arbor",
        // The hub rests on the arbor's face.
        "table_from_work": { "translation_mm": [0.0, 0.0, round_to((-bottom).ceil(), 0)] },
        "work_offset": { "register": "G54" },
        "meshes": meshes,
        "stock": { "offset": { "allowance_mm": stock } },
        "clearance": plane((top + stock + 10.0).ceil(), 1.0),
        "second_clearance": plane((bottom - stock - 10.0).floor(), -1.0),
        "rapid_clearance_mm": 5.0,
    });
    let side = |name: &str, head: u32, group: &str| {
        let strategy = json!({
            "cylindrical_sections": {
                "axis_direction": [0.0, 0.0, 1.0],
                "from_radius_mm": round_to(0.32 * diameter, 1),
                "to_radius_mm": round_to(0.4875 * diameter, 1),
            }
        });
        let mut operation = operation(name, radius, &strategy, diameter / 3048.0);
        operation["head"] = json!(head);
        let path = &mut operation["path"]["strategy"];
        path["region"] = json!({ "groups": [group] });
        path["order"] = json!("decreasing");
        // Levels give both sides the same passes.
        path["edge_fill"] = json!(false);
        operation["pattern"] = json!({ "copies": spec.n_blades(), "index_angle_deg": 360.0 / spec.n_blades() as f64 });
        let tolerances = &mut operation["tolerances"];
        // Rounded up to the next hundredth.
        tolerances["mesh_chord_mm"] = json!(round_to((100.0 * chord).ceil() / 100.0, 2));
        tolerances["max_step_mm"] = json!(round_to(0.004 * diameter, 1));
        // Both heads tilt a little for the common C.
        tolerances["cusp_mm"] = json!(0.12);
        // Narrower than the cusps require on either side, so that both have the same passes.
        tolerances["max_step_over_mm"] = json!(round_to(0.0065 * diameter, 1));
        operation
    };
    let suction = side("suction side", 1, "blade-1/suction");
    let mut job = job_file(&format!("DTMB 4119, D {diameter} mm, both sides"), setup, suction);
    job["operations"] = json!([job["operations"][0], side("pressure side", 2, "blade-1/pressure")]);
    // Nine words fill a line.
    job["post"]["max_line_length"] = json!(200);
    job["second_tool"] = json!("tool-2.json");
    job["pairs"] = json!([{ "first": "suction side", "second": "pressure side" }]);
    let tool = tool_file(radius, 4.0 * radius);
    let file = |value: &Value| facemill_file_format::to_json(value).into_bytes();
    Ok(vec![
        ("propeller.glb".to_owned(), glb),
        ("job.json".to_owned(), file(&job)),
        ("tool.json".to_owned(), file(&tool)),
        ("tool-2.json".to_owned(), file(&left_handed(tool))),
        ("machine.json".to_owned(), facemill_inverse_kinematics::preset_dual_xyzb().as_bytes().to_vec()),
    ])
}

/// Returns the same tool for the other head.
fn left_handed(mut tool: Value) -> Value {
    let name = format!("{} left-handed", tool["name"].as_str().unwrap_or_default());
    tool["name"] = json!(name);
    tool["number"] = json!(2);
    tool["spindle_rotation"] = json!("counterclockwise");
    tool
}
