//! The sample job of a cast propeller: both sides of its blades, from the casting to the part.

use facemill_sample_parts::{
    BladeResolution, Bore, CastingAllowance, PropellerSeries, PropellerSpec, RootFillet, SolidForm, casting,
    chord_error, propeller_solid,
};
use serde_json::{Value, json};

use crate::job_parts::{JobFiles, cutter_radius, job_file, operation, round_to, tool_file};
use crate::propeller_mesh::grouped_glb;

/// Diameters for which the tools and the machine are made, mm.
const DIAMETERS: [f64; 2] = [800.0, 1200.0];

/// Quads of a blade between hub and tip, and along the chord.
const QUADS: [usize; 2] = [96, 72];

/// Material on the casting, mm: its mean, and how far it varies.
const CASTING: [f64; 2] = [6.0, 3.0];

/// Size of the cells of the lattice that the casting is made on, mm.
const CASTING_CELL: f64 = 5.0;

/// Radius of the root fillets over the diameter: about the thickness of the blade there over 3.
const FILLET: f64 = 0.015;

/// Radius of the bore over that of the hub.
const BORE: f64 = 0.45;

/// Material that the layers leave, and the largest thickness of one, mm.
const LEFT: f64 = 0.4;
const DEPTH: f64 = 4.5;

/// Radii between which the face mill cuts, over that of the tip: farther in, its holder would hit
/// the neighbouring blade; farther out, the blade ends in the rounding of its tip.
const FACE_MILL: [f64; 2] = [0.54, 0.994];

/// Returns the files of a job for a casting of DTMB 4119 with bore and root fillets: in each of two
/// setups, layers and a finish of one side of the blades. Roots, edges, tips and hub keep what is
/// on them.
///
/// # Errors
/// If the diameter is out of range.
pub(crate) fn cast_propeller_job(diameter: f64) -> Result<JobFiles, String> {
    let [least, most] = DIAMETERS;
    if !(least..=most).contains(&diameter) {
        return Err(format!("diameter of a cast propeller must be from {least} to {most} mm, is {diameter}"));
    }
    let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, diameter).map_err(|e| e.to_string())?;
    let resolution = BladeResolution::new(QUADS[0], QUADS[1]).map_err(|e| e.to_string())?;
    let form = SolidForm {
        fillet: RootFillet::constant(FILLET * diameter).map_err(|e| e.to_string())?,
        bore: Some(Bore::cylinder(BORE * spec.hub_radius()).map_err(|e| e.to_string())?),
    };
    let chord = chord_error(&spec, resolution).sides;
    let part = propeller_solid(&spec, &form, resolution, chord).map_err(|e| e.to_string())?;
    let allowance = CastingAllowance::new(CASTING[0], CASTING[1]).map_err(|e| e.to_string())?;
    let cast = casting(&part, allowance, CASTING_CELL).map_err(|e| e.to_string())?;
    let sample = Sample { spec: &spec, radius: cutter_radius(0.02625 * diameter), from: allowance.largest(), chord };
    let bounds = part.aabb();
    let setups = json!([sample.setup("suction", 0.0, bounds.max.z), sample.setup("pressure", 180.0, -bounds.min.z),]);
    let mut operations = Vec::new();
    for side in ["suction", "pressure"] {
        let finish = sample.finish(side);
        operations.push(sample.layers(&finish));
        operations.push(finish);
    }
    let from = FACE_MILL[0] * 0.5 * diameter;
    let name = format!("DTMB 4119, D {diameter} mm, both sides from the casting, from r {from:.0} mm outward");
    let mut job = job_file(&name, Value::Null, Value::Null);
    job["setups"] = setups;
    job["operations"] = json!(operations);
    let file = |value: &Value| facemill_file_format::to_json(value).into_bytes();
    Ok(vec![
        ("propeller.glb".to_owned(), grouped_glb(&part)?),
        ("casting.glb".to_owned(), grouped_glb(&cast)?),
        ("job.json".to_owned(), file(&job)),
        ("tool.json".to_owned(), file(&sample.face_mill())),
        ("machine.json".to_owned(), facemill_inverse_kinematics::preset_head_b_table_c().as_bytes().to_vec()),
    ])
}

/// Measures that the pieces of the job share.
struct Sample<'a> {
    spec: &'a PropellerSpec,
    /// Radius of the face mill, mm.
    radius: f64,
    /// Largest material on the casting, mm.
    from: f64,
    /// Chord error of the mesh, mm.
    chord: f64,
}

impl Sample<'_> {
    /// Returns the setup in which a side faces up, up to a height.
    fn setup(&self, side: &str, turn_deg: f64, top: f64) -> Value {
        let mesh = |group: &str, role: &str| json!({ "file": "propeller.glb", "groups": [group], "role": role, "unit": "metre", "up_axis": "y" });
        json!({
            "name": format!("{side} side up"),
            "work_from_part": { "rotation_axis": [1.0, 0.0, 0.0], "rotation_deg": turn_deg },
            "table_from_work": { "translation_mm": [0.0, 0.0, round_to(0.25 * self.spec.diameter(), 0)] },
            "work_offset": { "register": "G54" },
            "meshes": [mesh(&format!("blade-1/{side}"), "drive"), mesh("*", "part")],
            "stock": { "mesh": { "file": "casting.glb", "unit": "metre", "up_axis": "y" } },
            "clearance": { "plane": { "origin_mm": [0.0, 0.0, (top + self.from + 10.0).ceil()] } },
            "rapid_clearance_mm": 5.0,
        })
    }

    /// Returns the finish of one side of the blades.
    fn finish(&self, side: &str) -> Value {
        let tip = 0.5 * self.spec.diameter();
        let strategy = json!({
            "cylindrical_sections": {
                "axis_direction": [0.0, 0.0, 1.0],
                "from_radius_mm": round_to(FACE_MILL[0] * tip, 1),
                "to_radius_mm": round_to(FACE_MILL[1] * tip, 1),
            }
        });
        let mut finish = operation(&format!("{side} finish"), self.radius, &strategy, self.spec.diameter() / 3048.0);
        finish["setup"] = json!(format!("{side} side up"));
        finish["tolerances"]["mesh_chord_mm"] = json!(round_to((100.0 * self.chord).ceil() / 100.0, 2));
        let n_blades = self.spec.n_blades();
        finish["pattern"] = json!({ "copies": n_blades, "index_angle_deg": 360.0 / n_blades as f64 });
        let path = &mut finish["path"]["strategy"];
        path["region"] = json!({ "extend_mm": 4.0 });
        path["order"] = json!("decreasing");
        // Passes that begin in the middle of the surface would enter uncut material there.
        path["edge_fill"] = json!(false);
        // Postures that lean ahead and turn slowly: the core stays above what the edges cut.
        finish["search"]["tilt_deg"] = json!([3.0, 15.0]);
        finish["search"]["rotate_deg"] = json!([0.0, 50.0]);
        finish["search"]["max_turn_deg_per_mm"] = json!(0.15);
        for end in ["entry", "exit"] {
            finish[end]["tangential_arc"]["straight_mm"] = json!(round_to(1.2 * self.radius, 1));
        }
        finish
    }

    /// Returns the layers before a finish.
    fn layers(&self, finish: &Value) -> Value {
        let mut rough = finish.clone();
        rough["name"] = json!(rough["name"].as_str().unwrap_or_default().replace("finish", "rough"));
        rough["allowance_mm"] = json!(LEFT);
        rough["layers"] = json!({ "from_mm": self.from, "depth_mm": DEPTH });
        // The casting beside an edge goes with the passes that run on beyond it.
        rough["path"]["strategy"]["region"] = json!({ "extend_mm": round_to(2.0 * self.from, 1) });
        rough["search"]["mode"] = json!("smallest");
        rough["search"]["tilt_deg"] = json!([4.0, 15.0]);
        let tolerances = &mut rough["tolerances"];
        tolerances["cusp_mm"] = json!(0.3);
        tolerances["max_step_over_mm"] = json!(round_to(0.36 * self.radius, 1));
        tolerances["max_step_mm"] = json!(4.0);
        tolerances["path_chord_mm"] = json!(0.1);
        tolerances["linearisation_mm"] = json!(0.05);
        for end in ["entry", "exit"] {
            // As far beyond the edge that the cutter is beside the casting.
            let line = &mut rough[end]["tangential_arc"]["straight_mm"];
            *line = json!(round_to(2.0 * line.as_f64().unwrap_or_default(), 1));
        }
        rough["feeds"]["removal_rate"] = json!({ "target_cm3_min": 60.0, "min_mm_min": 200.0 });
        rough
    }

    /// Returns a face mill whose flute is longer than the casting's material is high.
    fn face_mill(&self) -> Value {
        let mut tool = tool_file(self.radius, (4.0 * self.radius).max(180.0));
        let flute = (1.3 * self.from).ceil();
        let more = flute - tool["flute_length_mm"].as_f64().unwrap_or_default();
        tool["flute_length_mm"] = json!(flute);
        for key in ["stick_out_mm", "gauge_length_mm"] {
            tool[key] = json!(round_to(tool[key].as_f64().unwrap_or_default() + more, 2));
        }
        tool
    }
}
