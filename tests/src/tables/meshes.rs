//! Plans on every shared mesh: dirty ones, open ones, real propellers.

use facemill::{Failure, Planned};
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use serde_json::{Value, json};

use crate::jobs::JobFolder;
use crate::shared::shared;

/// How a shared mesh is machined.
pub struct MeshCase {
    /// File below `data/meshes` of the shared data.
    pub file: &'static str,
    /// Unit of the file.
    pub unit: &'static str,
    /// Up axis of the file.
    pub up_axis: &'static str,
    /// Turn of the part about an axis, deg, so that what is cut faces up.
    pub turn: ([f64; 3], f64),
    /// Lean of the angle plate that the workpiece is clamped on, deg: keeps the tool away from the
    /// upright pose, where B and C are parallel and the rotaries would have to whirl.
    pub plate_deg: f64,
    /// R and r of the cutter, mm.
    pub cutter: [f64; 2],
    /// Largest angle of the cut facets' normals from +Z, deg.
    pub cone_deg: f64,
    /// Box of the region, workpiece frame, where not everything that faces up can be reached.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Strategy.
    pub strategy: fn() -> Value,
    /// Largest rotate of the search, deg.
    pub rotate_deg: f64,
    /// Steepest ramp of the tool into material, deg: few for a face mill, 90 for a ball that cuts
    /// at its centre.
    pub ramp_deg: f64,
    /// Distance of passes and CC points, mm.
    pub steps: [f64; 2],
}

fn planes() -> Value {
    json!({ "parallel_planes": { "normal": [1.0, 0.0, 0.0] } })
}

fn cylinders(from: f64, to: f64) -> Value {
    json!({ "cylindrical_sections": { "axis_direction": [0, 0, 1], "from_radius_mm": from, "to_radius_mm": to } })
}

const STILL: ([f64; 3], f64) = ([0.0, 0.0, 1.0], 0.0);

/// Files that hold the mesh of another file in another format: read and compared, not planned
/// twice.
pub const SAME: [(&str, &str); 1] = [("nasa_rotor37_blade.stl", "nasa_rotor37_blade.obj")];

/// Every shared mesh but those of [`SAME`].
pub const CASES: [MeshCase; 8] = [
    MeshCase {
        file: "bladex_blade_lower.stl",
        unit: "millimetre",
        up_axis: "z",
        // Wound as the suction side is: its triangles face the same way.
        turn: ([0.0, 1.0, 0.0], -90.0),
        plate_deg: 0.0,
        cutter: [5.0, 1.0],
        cone_deg: 60.0,
        bounds: None,
        strategy: planes,
        // Facets of several mm: between points 2 mm apart the cutter would dip into their edges.
        rotate_deg: 150.0,
        ramp_deg: 90.0,
        steps: [4.0, 1.0],
    },
    MeshCase {
        file: "bladex_blade_upper.stl",
        unit: "millimetre",
        up_axis: "z",
        turn: ([0.0, 1.0, 0.0], -90.0),
        plate_deg: 0.0,
        cutter: [5.0, 1.0],
        cone_deg: 60.0,
        bounds: None,
        strategy: planes,
        rotate_deg: 150.0,
        ramp_deg: 90.0,
        steps: [4.0, 2.0],
    },
    MeshCase {
        file: "nasa_rotor37_blade.obj",
        unit: "millimetre",
        up_axis: "z",
        turn: ([1.0, 0.0, 0.0], -90.0),
        plate_deg: 0.0,
        cutter: [3.0, 0.5],
        cone_deg: 75.0,
        bounds: None,
        strategy: || json!({ "parallel_planes": { "normal": [0.0, 1.0, 0.0] } }),
        rotate_deg: 85.0,
        ramp_deg: 8.0,
        steps: [0.6, 0.5],
    },
    MeshCase {
        file: "openfoam_propeller.obj",
        unit: "metre",
        up_axis: "y",
        turn: STILL,
        plate_deg: 0.0,
        cutter: [4.0, 0.8],
        cone_deg: 50.0,
        bounds: None,
        strategy: || cylinders(50.0, 95.0),
        rotate_deg: 150.0,
        ramp_deg: 90.0,
        steps: [4.0, 1.5],
    },
    MeshCase {
        file: "pptc_vp1304_bladex.obj",
        unit: "millimetre",
        up_axis: "x",
        turn: STILL,
        plate_deg: 0.0,
        cutter: [3.0, 3.0],
        cone_deg: 40.0,
        bounds: None,
        strategy: || cylinders(75.0, 115.0),
        rotate_deg: 150.0,
        ramp_deg: 90.0,
        steps: [4.0, 1.5],
    },
    MeshCase {
        file: "pptc_vp1304_bladex_ascii.stl",
        unit: "millimetre",
        up_axis: "x",
        turn: STILL,
        plate_deg: 0.0,
        cutter: [3.0, 0.6],
        cone_deg: 45.0,
        bounds: None,
        strategy: || cylinders(72.0, 114.0),
        rotate_deg: 150.0,
        ramp_deg: 90.0,
        steps: [4.0, 1.0],
    },
    MeshCase {
        file: "r2b2_propeller.stl",
        unit: "millimetre",
        up_axis: "z",
        turn: STILL,
        plate_deg: 0.0,
        cutter: [1.0, 0.2],
        cone_deg: 60.0,
        bounds: None,
        strategy: || cylinders(5.0, 12.5),
        rotate_deg: 85.0,
        ramp_deg: 8.0,
        steps: [0.45, 0.3],
    },
    MeshCase {
        file: "uuv_rov_propeller.glb",
        unit: "metre",
        up_axis: "z",
        turn: ([0.0, 1.0, 0.0], -90.0),
        plate_deg: 60.0,
        cutter: [5.0, 1.0],
        cone_deg: 50.0,
        bounds: None,
        strategy: || cylinders(60.0, 175.0),
        rotate_deg: 150.0,
        ramp_deg: 90.0,
        steps: [5.0, 2.0],
    },
];

/// Result for a mesh.
pub struct MeshOutcome {
    /// File.
    pub file: &'static str,
    /// The plan, or why there is none.
    pub result: Result<Planned, Failure>,
    /// Part of the upper side that is cut, see [`coverage`].
    pub coverage: f64,
    /// The case.
    pub case: &'static MeshCase,
}

/// The job of a shared mesh; `None` where the shared data is absent.
///
/// # Panics
/// When the mesh is none of [`CASES`], or cannot be read.
pub fn shared_mesh_job(name: &str) -> Option<JobFolder> {
    let case = CASES.iter().find(|c| c.file == name).unwrap_or_else(|| panic!("no case for {name}"));
    let mesh = std::fs::read(shared(&format!("data/meshes/{name}"))?).expect("a mesh that can be read");
    let text = |value: Value| facemill::file_format::to_json(&value).into_bytes();
    Some(JobFolder::of(&[
        (name.to_owned(), mesh),
        ("job.json".to_owned(), text(job_file(case))),
        ("tool.json".to_owned(), text(tool_file(case))),
        ("machine.json".to_owned(), facemill::inverse_kinematics::preset_head_b_table_c().as_bytes().to_vec()),
    ]))
}

/// Height of the clearance plane above the workpiece origin, and of the workpiece origin above the
/// table, mm.
const CLEARANCE: f64 = 280.0;
const MOUNT: f64 = 1500.0;

/// Height of the ridges between passes, mm.
const CUSP: f64 = 0.5;

fn job_file(case: &MeshCase) -> Value {
    let [radius, _] = case.cutter;
    let [step_over, step] = case.steps;
    let mut region = json!({ "normal_cone": { "axis": [0, 0, 1], "half_angle_deg": case.cone_deg } });
    if let Some([min, max]) = case.bounds {
        region["box"] = json!({ "min_mm": min, "max_mm": max });
    }
    let arc = json!({ "tangential_arc": { "radius_mm": 10.0 * radius, "angle_deg": 8.0 } });
    json!({
        "format": "facemill-job/1",
        "name": case.file,
        "tool": "tool.json",
        "machine": "machine.json",
        "setups": [{
            "name": "up",
            "work_from_part": { "rotation_axis": case.turn.0, "rotation_deg": case.turn.1 },
            "table_from_work": {
                "translation_mm": [0.0, 0.0, MOUNT], "rotation_axis": [0.0, 1.0, 0.0], "rotation_deg": case.plate_deg,
            },
            "meshes": [{ "file": case.file, "role": "drive", "unit": case.unit, "up_axis": case.up_axis }],
            "stock": { "offset": { "allowance_mm": 0.2 } },
            "clearance": { "plane": { "origin_mm": [0.0, 0.0, CLEARANCE] } },
            "rapid_clearance_mm": 2.0,
        }],
        "operations": [{
            "name": "what faces up",
            "path": { "strategy": { "strategy": (case.strategy)(), "region": region, "min_pass_length_mm": radius } },
            "direction": "climb",
            "entry": arc,
            "exit": arc,
            "search": {
                "tilt_deg": [5.0, 40.0],
                "rotate_deg": [0.0, case.rotate_deg],
                "u_step": 0.05,
                "max_turn_deg_per_mm": 5.0,
                "preferred_branch": "positive",
            },
            "feeds": { "cutting_mm_min": 800.0, "approach_mm_min": 1500.0, "spindle_rpm": 6000.0 },
            "tolerances": {
                "mesh_chord_mm": 0.05,
                "path_chord_mm": 0.02,
                "max_step_mm": step,
                "linearisation_mm": 0.02,
                "gouge_mm": 0.02,
                "max_lift_mm": 0.3,
                "cusp_mm": CUSP,
                "max_step_over_mm": step_over,
            },
            "infeasible": { "trim": { "max_trimmed_fraction": 0.05 } },
        }],
        "post": { "dialect": "fanuc" },
    })
}

/// A slim mill on a long reach.
fn tool_file(case: &MeshCase) -> Value {
    let [radius, corner] = case.cutter;
    let flute = 3.0 * radius;
    let reach = 20.0 * radius;
    json!({
        "format": "facemill-tool/1",
        "name": format!("mill D{} r{corner}", 2.0 * radius),
        "number": 1,
        "radius_mm": radius,
        "corner_radius_mm": corner,
        "n_inserts": 2,
        "flute_length_mm": flute,
        "max_ramp_angle_deg": case.ramp_deg,
        "spindle_rotation": "clockwise",
        "stick_out_mm": flute + reach,
        "gauge_length_mm": flute + reach + 200.0,
        "body": { "clearance_mm": 0.1, "sections": [
            { "length_mm": reach, "diameter_low_mm": 1.7 * radius, "diameter_high_mm": 1.7 * radius }] },
        "holder": { "clearance_mm": 1.0, "sections": [
            { "length_mm": 200.0, "diameter_low_mm": 3.0 * radius, "diameter_high_mm": 40.0 }] },
    })
}

/// Plans the shared meshes of these files that are there, with passes `spread` times as far apart
/// as [`CASES`] says where these are many.
pub fn outcomes(files: &[&str], spread: f64) -> Vec<MeshOutcome> {
    CASES
        .iter()
        .filter(|case| files.contains(&case.file))
        .filter_map(|case| {
            let job = shared_mesh_job(case.file)?;
            let [step_over, _] = case.steps;
            if step_over >= 4.0 {
                let tolerances = [
                    ("/operations/0/tolerances/max_step_over_mm", json!(spread * step_over)),
                    // The cusp grows with the square of the step-over, and more where postures are
                    // steep: none is to be mended here.
                    (
                        "/operations/0/tolerances/cusp_mm",
                        json!(if spread > 1.0 { 8.0 * spread * spread } else { 1.0 } * CUSP),
                    ),
                ];
                job.set("job.json", &tolerances);
            }
            Some(MeshOutcome { file: case.file, coverage: coverage(&job, case), result: job.try_plan(), case })
        })
        .collect()
}

/// Steepest facets that a shop would call the upper side, as the angle of their normals from +Z,
/// deg.
const SIDE_DEG: f64 = 80.0;

/// Part of the mesh's upper side that lies in the region the passes are laid on, by area.
///
/// # Panics
/// When the mesh cannot be read.
pub fn coverage(job: &JobFolder, case: &MeshCase) -> f64 {
    let meshes = job.file().setups.remove(0).meshes;
    let mesh = facemill::read_mesh(&job.path(case.file), meshes[0].unit, meshes[0].up_axis).expect("a mesh").mesh;
    let axis = Unit::new_normalize(Vector3::from(case.turn.0));
    let turn = UnitQuaternion::from_axis_angle(&axis, case.turn.1.to_radians());
    let strategy = (case.strategy)();
    let radii = strategy
        .get("cylindrical_sections")
        .map(|c| ["from_radius_mm", "to_radius_mm"].map(|key| c[key].as_f64().expect("a radius")));
    let inside = |p: &Point3<f64>| {
        let in_box = case.bounds.is_none_or(|[low, high]| (0..3).all(|k| (low[k]..=high[k]).contains(&p[k])));
        in_box && radii.is_none_or(|[from, to]| (from..=to).contains(&p.x.hypot(p.y)))
    };
    let (mut side, mut region) = (0.0, 0.0);
    for k in 0..mesh.triangles().len() {
        let [a, b, c] = mesh.corners(k).map(|p| turn * p);
        let normal = (b - a).cross(&(c - a));
        let lean = normal.xy().norm().atan2(normal.z).to_degrees();
        if lean <= SIDE_DEG {
            side += 0.5 * normal.norm();
            let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            region += if lean <= case.cone_deg && inside(&middle) { 0.5 * normal.norm() } else { 0.0 };
        }
    }
    region / side
}

/// The table of outcomes as Markdown.
pub fn markdown(outcomes: &[MeshOutcome]) -> String {
    let mut text = String::from(
        "# Meshes from public sources\n\n\
         Every mesh of the shared data, planned on the head-B, table-C mill with a tool that fits: what faces up, by parallel \
         planes or sections by cylinders about +Z. Depths are those of the written program against the mesh, measured by the \
         virtual machine; the budget is what may appear there. *Covered* is the area of the facets that passes are laid on as \
         part of the area of all facets that face up (normals within 80° of +Z), hubs, edges and fillets included; what is \
         missing is steeper than the region's cone, on the hub or its fillet, or at the tip. The angle beside R and r is the \
         steepest ramp of the tool; 90° is given where passes go down into stock more steeply than a face mill may, or the \
         entry has to come in from above. *Planned* is the part of the CC points in the region that is in the program. \
         Findings are faults of the program; the reasons why a job counts as not finished, such as material left between \
         coarse steps, are printed beside the table.\n\n\
         Written by `cargo run --release -p facemill-tests --bin meshes-table > docs/meshes.md`.\n\n\
         | mesh | triangles | degenerate | duplicate | open edges | non-manifold | components | strategy | cutter R / r, ramp | covered | CC points | planned | largest gouge / budget, mm | findings |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for o in outcomes {
        text += &row(o);
    }
    text
}

fn row(o: &MeshOutcome) -> String {
    let strategy = (o.case.strategy)();
    let strategy = if strategy.get("parallel_planes").is_some() { "parallel planes" } else { "cylindrical sections" };
    let ([radius, corner], ramp) = (o.case.cutter, o.case.ramp_deg);
    let covered = 100.0 * o.coverage;
    let report = match &o.result {
        Ok(planned) => &planned.report,
        Err(why) => {
            // The folder the job was in is of no interest.
            let why = why.to_string().rsplit('/').next().unwrap_or_default().replace('|', "/");
            return format!(
                "| {} | | | | | | | {strategy} | {radius} / {corner}, {ramp}° | {covered:.0} % | | | | {why} |\n",
                o.file
            );
        }
    };
    let mesh = &report.meshes[0].repair;
    let count = |key: &str| mesh.get(key).map_or_else(|| "?".to_owned(), Value::to_string);
    let mut kinds: Vec<String> = report.findings.iter().map(|f| f.kind.to_string()).collect();
    kinds.sort();
    let total = kinds.len();
    kinds.dedup();
    let findings = if total == 0 { "none".to_owned() } else { format!("{total}: {}", kinds.join(", ")) };
    format!(
        "| {} | {} | {} | {} | {} | {} | {} | {strategy} | {radius} / {corner}, {ramp}° | {covered:.0} % | {} | {:.1} % | {:.3} / {:.3} | {findings} |\n",
        o.file,
        count("n_triangles_in"),
        count("n_degenerate"),
        count("n_duplicates"),
        count("n_open_edges"),
        count("n_non_manifold_edges"),
        count("n_components"),
        report.totals.cc_points,
        100.0 * report.totals.planned_fraction,
        report.worst.gouge_mm.unwrap_or(0.0),
        report.budgets[0].against_mesh_mm,
    )
}
