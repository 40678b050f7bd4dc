//! Propellers of a series or a table, one side up.

use std::path::Path;

use facemill_propeller_file::read_propeller_with;
use facemill_sample_parts::{BladeResolution, BladeSurface, Hand, PropellerSpec, chord_error};
use serde_json::json;

use crate::job_parts::{JobFiles, ReadFile, cutter_radius, job_file, job_folder, operation, round_to, stock_for};
use crate::propeller_mesh::{CHORD_QUADS, RADIAL_QUADS, propeller_glb};

/// Returns the job of a propeller by its table.
pub(crate) fn table_job(table: &Path, diameter: Option<f64>, read: ReadFile<'_>) -> Result<JobFiles, String> {
    let (name, spec) = read_table(table, diameter, read)?;
    // Above 0.7, chords that tilt hide each other from most tools.
    let covered = BladeSurface::new(&spec).covered_share(0.3 * spec.diameter());
    propeller_job(&spec, &name, spec.n_blades() > 4 || covered > 0.7)
}

/// Returns number of blades, hand, skew and rake of a propeller by its table in words, so that a
/// wrong sign in it is seen.
pub(crate) fn table_text(table: &Path, diameter: Option<f64>, read: ReadFile<'_>) -> Result<String, String> {
    let (name, spec) = read_table(table, diameter, read)?;
    let surface = BladeSurface::new(&spec);
    let tip = surface.section(0.5 * spec.diameter());
    let hand = match spec.hand() {
        Hand::Left => "left-handed (seen from astern it turns counter-clockwise)",
        Hand::Right => "right-handed (seen from astern it turns clockwise)",
    };
    let skew = match round_to(tip.skew().to_degrees(), 1) {
        0.0 => "no skew".to_owned(),
        skew => format!("skew {} deg {} the rotation", skew.abs(), if skew > 0.0 { "against" } else { "with" }),
    };
    let rake = match round_to(tip.rake(), 1) {
        0.0 => "no rake".to_owned(),
        rake => format!("rake {} mm {}", rake.abs(), if rake < 0.0 { "aft" } else { "ahead" }),
    };
    let (n_blades, diameter) = (spec.n_blades(), spec.diameter());
    Ok(format!("{name}: {n_blades} blades, D {diameter} mm, {hand}; at the tip {skew}, {rake}"))
}

fn read_table(table: &Path, diameter: Option<f64>, read: ReadFile<'_>) -> Result<(String, PropellerSpec), String> {
    let file = read_propeller_with(&table.display().to_string(), &read(table)?, diameter).map_err(|e| e.to_string())?;
    let spec = file.spec(diameter).map_err(|e| e.to_string())?;
    let stem = || table.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    Ok((file.name.unwrap_or_else(stem), spec))
}

/// Returns the job of a propeller; `overlapping` says that its blades hide each other from most
/// tools.
pub(crate) fn propeller_job(spec: &PropellerSpec, name: &str, overlapping: bool) -> Result<JobFiles, String> {
    let resolution = BladeResolution::new(RADIAL_QUADS, CHORD_QUADS).map_err(|e| e.to_string())?;
    let (glb, [_, top]) = propeller_glb(spec, resolution)?;
    let chord = chord_error(spec, resolution).sides;
    let (diameter, n_blades) = (spec.diameter(), spec.n_blades());
    let tip = 0.5 * diameter;
    let radius = cutter_radius(if overlapping { 0.025 } else { 0.02625 } * diameter);
    // Flange and spindle nose are as large for a small propeller as for a large one, and stay above
    // its blades.
    let reach = if overlapping { 0.3 * diameter } else { (4.0 * radius).max(140.0) };
    let from_radius = f64::max(if overlapping { 0.6 } else { 0.535 }, spec.hub_radius() / tip + 0.1);
    let stock = stock_for(radius);
    let meshes = json!([
        { "file": "propeller.glb", "groups": ["blade-1/suction"], "role": "drive", "unit": "metre", "up_axis": "y" },
        { "file": "propeller.glb", "groups": ["blade-*"], "role": "part", "unit": "metre", "up_axis": "y" },
        { "file": "propeller.glb", "groups": ["hub/*"], "role": "check", "unit": "metre", "up_axis": "y", "allowance_mm": 1.0 },
    ]);
    let setup = json!({
        "name": "suction side up",
        "table_from_work": { "translation_mm": [0.0, 0.0, round_to(0.25 * diameter, 0)] },
        "work_offset": { "register": "G54" },
        "meshes": meshes,
        "stock": { "offset": { "allowance_mm": stock } },
        "clearance": { "plane": { "origin_mm": [0.0, 0.0, (top + stock + 10.0).ceil()] } },
        "rapid_clearance_mm": 5.0,
    });
    let strategy = json!({
        "cylindrical_sections": {
            "axis_direction": [0.0, 0.0, 1.0],
            // Further in, the head would hit the neighbouring blade.
            "from_radius_mm": round_to(from_radius * tip, 1),
            "to_radius_mm": round_to(0.975 * tip, 1),
        }
    });
    let mut operation = operation("suction side", radius, &strategy, diameter / 3048.0);
    // Rounded up to the next hundredth.
    operation["tolerances"]["mesh_chord_mm"] = json!(round_to((100.0 * chord).ceil() / 100.0, 2));
    operation["pattern"] = json!({ "copies": n_blades, "index_angle_deg": 360.0 / n_blades as f64 });
    if !overlapping {
        // Strips are narrow at the leading edge alone, and edges lean: fronts, and short arcs that
        // begin beyond the edge. Between blades that overlap, many pass ends need the larger arcs.
        operation["path"]["strategy"]["edge_fill"] = json!(true);
        operation["path"]["strategy"]["width_rounds"] = json!(3);
        let arc = json!({
            "shortest": {
                "radius_mm": round_to(6.25 * radius, 1),
                "angle_deg": 8.0,
                "straight_mm": round_to(0.5 * radius, 1),
            }
        });
        operation["entry"] = arc.clone();
        operation["exit"] = arc;
        operation["tolerances"]["max_lift_mm"] = json!(0.02);
    } else {
        operation["path"]["strategy"]["edge_fill"] = json!(false);
    }
    // From the tip inward: cut climbing, the passes then run down the blade, and their ends leave
    // over its lower edge.
    operation["path"]["strategy"]["order"] = json!("decreasing");
    // The name says which part is not requested and which may be unreachable; a plan that leaves
    // out more than allowed says so, too.
    let hidden = if overlapping { ", except regions hidden by the next blade" } else { "" };
    let name = format!("{name}, D {diameter} mm, from r {:.0} mm outward{hidden}", from_radius * tip);
    let job = job_file(&name, setup, operation);
    Ok(job_folder(("propeller.glb", glb), &job, (radius, reach)))
}
