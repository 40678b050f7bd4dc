//! Complete example jobs: mesh, tool, machine and job file.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use facemill_propeller_file::read_propeller;
use facemill_sample_parts::{
    BladeResolution, BladeSurface, PatchSpec, PropellerSeries, PropellerSpec, RotorResolution, blade, blade_pose,
    chord_error, hub, patch, rotor37,
};
use facemill_surface_model::{NamedNode, TriMesh, write_glb, write_obj};
use nalgebra::{Isometry3, Point3};
use serde_json::{Value, json};

use crate::examples::new_blade::{blade_job, groups_obj};
use crate::examples::new_dual::dual_propeller_job;
use crate::files;

/// An example job.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum NewJob {
    /// A propeller on the B-head, C-table mill, suction side up.
    Propeller {
        /// Its series.
        series: Series,
        /// Its diameter, mm.
        diameter_mm: f64,
    },
    /// A propeller of the user's own, suction side up.
    OwnPropeller {
        /// Its table.
        table: PathBuf,
        /// Its diameter, mm, if not that of the table.
        diameter_mm: Option<f64>,
    },
    /// DTMB 4119 on the mill with two heads, both sides at once.
    DualPropeller {
        /// Its diameter, mm.
        diameter_mm: f64,
    },
    /// A wavy patch.
    Patch {
        /// Length of its sides, mm.
        size_mm: f64,
    },
    /// The blade of NASA Rotor 37, one side up.
    Rotor37 {
        /// Factor on the real size.
        scale: f64,
    },
    /// A blade from a BladeGen description, one side after the other up.
    Blade {
        /// Its `.inf` file.
        from: PathBuf,
        /// Factor on the size in the file.
        scale: f64,
    },
}

/// A propeller series.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Series {
    /// DTMB 4119.
    Dtmb4119,
    /// DTMB 4382.
    Dtmb4382,
    /// SVA Potsdam VP1304.
    Vp1304,
    /// Wageningen B.
    WageningenB {
        /// Number of blades.
        blades: u32,
        /// Expanded area ratio.
        area_ratio: f64,
        /// Pitch ratio.
        pitch_ratio: f64,
    },
}

/// Scales of [`NewJob::Rotor37`] and [`NewJob::Blade`]: below them no cutter is small enough, above
/// them no machine is large enough.
pub const ROTOR_SCALES: RangeInclusive<f64> = 0.1..=100.0;

/// Returns the files of an example job, names relative to its folder. The same job always gives the
/// same bytes.
///
/// # Errors
/// If numbers or files describe no part.
pub fn new_job(job: &NewJob) -> Result<Vec<(String, Vec<u8>)>, String> {
    match *job {
        NewJob::Propeller { series, diameter_mm } => series_job(series, diameter_mm),
        NewJob::OwnPropeller { ref table, diameter_mm } => table_job(table, diameter_mm),
        NewJob::DualPropeller { diameter_mm } => dual_propeller_job(diameter_mm),
        NewJob::Patch { size_mm } => patch_job(size_mm),
        NewJob::Rotor37 { scale } => rotor37_job(scale),
        NewJob::Blade { ref from, scale } => blade_job(from, scale),
    }
}

/// Quads between hub and tip, and between leading and trailing edge: facets of about 10 mm on a
/// blade of 3 m diameter, 2 MB for the file.
pub const RADIAL_QUADS: usize = 160;

/// Quads of a blade along the chord.
pub const CHORD_QUADS: usize = 120;

/// Radii of face mills that can be bought, mm.
const CUTTER_RADII: [f64; 12] = [4.0, 5.0, 6.0, 8.0, 10.0, 12.5, 16.0, 20.0, 25.0, 40.0, 63.0, 80.0];

/// Returns the largest cutter that is not larger than wanted.
pub fn cutter_radius(wanted: f64) -> f64 {
    CUTTER_RADII.iter().rev().copied().find(|r| *r <= wanted * 1.001).unwrap_or(CUTTER_RADII[0])
}

/// Rounds a number for a file: no more digits than anyone types.
pub fn round_to(value: f64, decimals: i32) -> f64 {
    let unit = 10f64.powi(decimals);
    (value * unit).round() / unit
}

fn series_job(series: Series, diameter: f64) -> Result<Vec<(String, Vec<u8>)>, String> {
    let (series, name) = match series {
        Series::Dtmb4119 => (PropellerSeries::Dtmb4119, "DTMB 4119".to_owned()),
        Series::Dtmb4382 => (PropellerSeries::Dtmb4382, "DTMB 4382".to_owned()),
        Series::Vp1304 => (PropellerSeries::Vp1304, "VP1304".to_owned()),
        Series::WageningenB { blades, area_ratio, pitch_ratio } => (
            PropellerSeries::WageningenB { n_blades: blades as usize, area_ratio, pitch_ratio },
            format!("Wageningen B{blades}-{:.0}", 100.0 * area_ratio),
        ),
    };
    // Blades of high area ratio overlap: a thin tool that reaches far comes between most of them,
    // and regions out of its reach in one setup are left out.
    let overlapping = match series {
        PropellerSeries::Dtmb4119 => false,
        PropellerSeries::WageningenB { n_blades, area_ratio, .. } => n_blades > 4 || area_ratio > 0.6,
        // The thin tool is free for every series.
        _ => true,
    };
    propeller_job(&PropellerSpec::new(series, diameter).map_err(|e| e.to_string())?, &name, overlapping)
}

/// Returns the job of a propeller by its table.
fn table_job(table: &Path, diameter: Option<f64>) -> Result<Vec<(String, Vec<u8>)>, String> {
    let bytes = files::read_text(table).map_err(|e| e.to_string())?;
    let file = read_propeller(&table.display().to_string(), &bytes).map_err(|e| e.to_string())?;
    let spec = file.spec(diameter).map_err(|e| e.to_string())?;
    // Above 0.7, chords that tilt hide each other from most tools.
    let covered = BladeSurface::new(&spec).covered_share(0.3 * spec.diameter());
    let stem = || table.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    propeller_job(&spec, &file.name.unwrap_or_else(stem), spec.n_blades() > 4 || covered > 0.7)
}

fn propeller_job(spec: &PropellerSpec, name: &str, overlapping: bool) -> Result<Vec<(String, Vec<u8>)>, String> {
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
        operation["path"]["strategy"]["width_rounds"] = json!(1);
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

/// Returns the propeller as a file, and its lowest and highest z, mm.
pub fn propeller_glb(spec: &PropellerSpec, resolution: BladeResolution) -> Result<(Vec<u8>, [f64; 2]), String> {
    let blade = blade(spec, resolution);
    let hub = hub(spec, 2e-4 * spec.hub_radius()).map_err(|e| e.to_string())?;
    let blade_groups: Vec<String> = blade.groups().iter().map(|g| g.name.clone()).collect();
    let hub_groups: Vec<String> = hub.groups().iter().map(|g| g.name.clone()).collect();
    let part = |mesh: &TriMesh, group: &str| compact(&mesh.select_groups(|name| name == group));
    let meshes: Vec<TriMesh> =
        blade_groups.iter().map(|g| part(&blade, g)).chain(hub_groups.iter().map(|g| part(&hub, g))).collect();
    let mut nodes: Vec<(String, usize, Isometry3<f64>)> = Vec::new();
    for k in 0..spec.n_blades() {
        for (mesh, group) in blade_groups.iter().enumerate() {
            nodes.push((format!("blade-{}/{group}", k + 1), mesh, blade_pose(spec, k)));
        }
    }
    for (k, group) in hub_groups.iter().enumerate() {
        nodes.push((format!("hub/{group}"), blade_groups.len() + k, Isometry3::identity()));
    }
    let nodes: Vec<NamedNode<'_>> =
        nodes.iter().map(|(name, mesh, transform)| NamedNode { name, mesh: *mesh, transform: *transform }).collect();
    // Blades turn about z: all are as high as the first.
    let heights = || meshes.iter().flat_map(TriMesh::vertices).map(|p| p.z);
    let reach = [heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max)];
    let meshes: Vec<&TriMesh> = meshes.iter().collect();
    Ok((write_glb(&meshes, &nodes).map_err(|e| e.to_string())?, reach))
}

/// Returns the mesh without vertices that no triangle uses.
pub(crate) fn compact(mesh: &TriMesh) -> TriMesh {
    let mut new_index = vec![u32::MAX; mesh.vertices().len()];
    let mut vertices: Vec<Point3<f64>> = Vec::new();
    let triangles: Vec<[u32; 3]> = mesh
        .triangles()
        .iter()
        .map(|t| {
            t.map(|v| {
                let new = &mut new_index[v as usize];
                if *new == u32::MAX {
                    *new = vertices.len() as u32;
                    vertices.push(mesh.vertices()[v as usize]);
                }
                *new
            })
        })
        .collect();
    TriMesh::with_groups(vertices, triangles, mesh.groups().to_vec()).unwrap_or_default()
}

fn patch_job(size: f64) -> Result<Vec<(String, Vec<u8>)>, String> {
    let spec = PatchSpec::new([size, size], 0.02 * size, [1.2, 1.0]).map_err(|e| e.to_string())?;
    let mesh = patch(&spec, 120, 120).map_err(|e| e.to_string())?;
    let nodes = [NamedNode { name: "patch", mesh: 0, transform: Isometry3::identity() }];
    let obj = write_obj(&[&mesh], &nodes).map_err(|e| e.to_string())?;
    let radius = cutter_radius(0.05 * size);
    let setup = json!({
        "name": "top",
        "table_from_work": { "translation_mm": [0.0, 0.0, 300.0] },
        "meshes": [{ "file": "patch.obj", "role": "drive", "unit": "millimetre", "up_axis": "z" }],
        "stock": { "offset": { "allowance_mm": stock_for(radius) } },
        "clearance": { "plane": { "origin_mm": [0.0, 0.0, round_to(0.05 * size + 10.0, 0)] } },
    });
    let strategy = json!({ "parallel_planes": { "normal": [0.0, 1.0, 0.0] } });
    let operation = operation("patch", radius, &strategy, size / 1600.0);
    Ok(job_folder(
        ("patch.obj", obj),
        &job_file(&format!("wavy patch of {size} mm"), setup, operation),
        (radius, 4.0 * radius),
    ))
}

fn rotor37_job(scale: f64) -> Result<Vec<(String, Vec<u8>)>, String> {
    if !ROTOR_SCALES.contains(&scale) {
        return Err(format!("scale must be from {} to {}, is {scale}", ROTOR_SCALES.start(), ROTOR_SCALES.end()));
    }
    let blade = rotor37(RotorResolution::default());
    let vertices: Vec<Point3<f64>> = blade.vertices().iter().map(|p| p * scale).collect();
    let mesh = TriMesh::with_groups(vertices, blade.triangles().to_vec(), blade.groups().to_vec())
        .map_err(|e| e.to_string())?;
    let (names, obj) = groups_obj(&mesh)?;
    let radius = cutter_radius(2.0 * scale);
    let suction = names.iter().find(|n| n.contains("suction")).or(names.first()).cloned().unwrap_or_default();
    // The blade points along +X at its radius; on the table it lies, its span toward the operator.
    let setup = json!({
        "name": "suction side",
        "work_from_part": { "rotation_axis": [1.0, 0.0, 0.0], "rotation_deg": 90.0 },
        "table_from_work": { "translation_mm": [round_to(-21.5 * scale * 10.0, 0), 0.0, round_to(40.0 * scale + 20.0, 0)] },
        "meshes": [
            { "file": "rotor37.obj", "groups": [suction], "role": "drive", "unit": "millimetre", "up_axis": "z" },
            { "file": "rotor37.obj", "role": "part", "unit": "millimetre", "up_axis": "z" },
        ],
        "stock": { "offset": { "allowance_mm": stock_for(radius) } },
        "clearance": { "plane": { "origin_mm": [0.0, 0.0, round_to(60.0 * scale, 0)] } },
    });
    let strategy = json!({ "parallel_planes": { "normal": [1.0, 0.0, 0.0] } });
    let operation = operation("suction side", radius, &strategy, scale / 40.0);
    Ok(job_folder(
        ("rotor37.obj", obj),
        &job_file(&format!("NASA Rotor 37 blade, scale {scale}"), setup, operation),
        (radius, 4.0 * radius),
    ))
}

/// Returns the material that a cutter removes in one finishing cut, mm.
pub fn stock_for(radius: f64) -> f64 {
    round_to((radius / 40.0).max(0.2), 2)
}

/// Returns an operation; `scale` is 1 for parts of about 3 m, for which lengths along the path are
/// given.
pub fn operation(name: &str, radius: f64, strategy: &Value, scale: f64) -> Value {
    // So flat that the cutter is in the stock only where it descends by less than its ramp angle.
    let arc = json!({ "tangential_arc": { "radius_mm": round_to(12.5 * radius, 1), "angle_deg": 8.0 } });
    json!({
        "name": name,
        "path": { "strategy": { "strategy": strategy, "min_pass_length_mm": round_to(0.5 * radius, 1) } },
        "direction": "climb",
        "entry": arc,
        "exit": arc,
        "search": {
            "tilt_deg": [2.0, 15.0],
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
pub fn job_file(name: &str, setup: Value, operation: Value) -> Value {
    json!({
        "format": crate::format::job_file::JOB_FORMAT,
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
pub fn tool_file(radius: f64, reach: f64) -> Value {
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
                { "length_mm": flange, "diameter_low_mm": 128.57, "diameter_high_mm": 128.57 },
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
