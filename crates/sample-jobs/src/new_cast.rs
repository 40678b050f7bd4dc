//! The sample job of a cast propeller: both sides of its blades, from the casting to the part.

use facemill_sample_parts::{
    BladeResolution, Bore, CastingAllowance, PropellerSeries, PropellerSpec, RootFillet, SolidForm, casting,
    chord_error, propeller_solid,
};
use facemill_surface_model::TriMesh;
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
    let cast = CastPropeller::new(diameter)?;
    let sample = Sample::of(&cast);
    let from = FACE_MILL[0] * 0.5 * diameter;
    let name = format!("DTMB 4119, D {diameter} mm, both sides from the casting, from r {from:.0} mm outward");
    let mut job = job_file(&name, Value::Null, Value::Null);
    job["setups"] = SIDES.iter().map(|side| sample.setup(side)).collect();
    job["operations"] = SIDES.iter().flat_map(|side| sample.face_milling(side)).collect();
    cast.files(&job, &[("tool.json", sample.face_mill())])
}

/// Sides of a blade, in the order in which they are machined.
pub(crate) const SIDES: [&str; 2] = ["suction", "pressure"];

/// A propeller and its casting.
pub(crate) struct CastPropeller {
    spec: PropellerSpec,
    /// The propeller as one solid.
    part: TriMesh,
    /// The casting.
    cast: TriMesh,
    /// Chord error of the blades' sides, mm.
    chord: f64,
    /// Largest material on the casting, mm.
    from: f64,
}

impl CastPropeller {
    /// # Errors
    /// If the diameter is out of range.
    pub(crate) fn new(diameter: f64) -> Result<Self, String> {
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
        Ok(Self { spec, part, cast, chord, from: allowance.largest() })
    }

    /// Returns the files of a job with its tools.
    ///
    /// # Errors
    /// If a mesh is too large for a file.
    pub(crate) fn files(&self, job: &Value, tools: &[(&str, Value)]) -> Result<JobFiles, String> {
        let file = |value: &Value| facemill_file_format::to_json(value).into_bytes();
        let mut files = vec![
            ("propeller.glb".to_owned(), grouped_glb(&self.part)?),
            ("casting.glb".to_owned(), grouped_glb(&self.cast)?),
            ("job.json".to_owned(), file(job)),
        ];
        files.extend(tools.iter().map(|(name, tool)| ((*name).to_owned(), file(tool))));
        let machine = facemill_inverse_kinematics::preset_head_b_table_c();
        files.push(("machine.json".to_owned(), machine.as_bytes().to_vec()));
        Ok(files)
    }
}

/// Measures that the pieces of the job share.
pub(crate) struct Sample<'a> {
    cast: &'a CastPropeller,
    /// Radius of the face mill, mm.
    radius: f64,
}

impl<'a> Sample<'a> {
    pub(crate) fn of(cast: &'a CastPropeller) -> Self {
        Self { cast, radius: cutter_radius(0.02625 * cast.spec.diameter()) }
    }

    /// Returns the radius of the propeller, mm.
    pub(crate) fn tip(&self) -> f64 {
        0.5 * self.cast.spec.diameter()
    }

    /// Returns the number of blades.
    pub(crate) fn n_blades(&self) -> usize {
        self.cast.spec.n_blades()
    }

    /// Returns the layers and the finish of one side of the blades with the face mill.
    pub(crate) fn face_milling(&self, side: &str) -> [Value; 2] {
        let finish = self.finish(side);
        [self.layers(&finish), finish]
    }

    /// Returns the setup in which a side faces up.
    pub(crate) fn setup(&self, side: &str) -> Value {
        let bounds = self.cast.part.aabb();
        let (turn_deg, top) = if side == SIDES[0] { (0.0, bounds.max.z) } else { (180.0, -bounds.min.z) };
        let mesh = |group: &str, role: &str| json!({ "file": "propeller.glb", "groups": [group], "role": role, "unit": "metre", "up_axis": "y" });
        json!({
            "name": format!("{side} side up"),
            "work_from_part": { "rotation_axis": [1.0, 0.0, 0.0], "rotation_deg": turn_deg },
            "table_from_work": { "translation_mm": [0.0, 0.0, round_to(0.25 * self.cast.spec.diameter(), 0)] },
            "work_offset": { "register": "G54" },
            "meshes": [mesh(&format!("blade-1/{side}"), "drive"), mesh("*", "part")],
            "stock": { "mesh": { "file": "casting.glb", "unit": "metre", "up_axis": "y" } },
            "clearance": { "plane": { "origin_mm": [0.0, 0.0, (top + self.cast.from + 10.0).ceil()] } },
            "rapid_clearance_mm": 5.0,
        })
    }

    /// Returns the finish of one side of the blades.
    fn finish(&self, side: &str) -> Value {
        let tip = self.tip();
        let strategy = json!({
            "cylindrical_sections": {
                "axis_direction": [0.0, 0.0, 1.0],
                "from_radius_mm": round_to(FACE_MILL[0] * tip, 1),
                "to_radius_mm": round_to(FACE_MILL[1] * tip, 1),
            }
        });
        let mut finish =
            operation(&format!("{side} finish"), self.radius, &strategy, self.cast.spec.diameter() / 3048.0);
        finish["setup"] = json!(format!("{side} side up"));
        finish["tolerances"]["mesh_chord_mm"] = json!(round_to((100.0 * self.cast.chord).ceil() / 100.0, 2));
        let n_blades = self.n_blades();
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

    /// Returns the layers before a finish with the face mill.
    fn layers(&self, finish: &Value) -> Value {
        let mut rough = self.layered(finish);
        rough["name"] = json!(rough["name"].as_str().unwrap_or_default().replace("finish", "rough"));
        // The casting beside an edge goes with the passes that run on beyond it.
        rough["path"]["strategy"]["region"] = json!({ "extend_mm": round_to(2.0 * self.cast.from, 1) });
        rough["search"]["mode"] = json!("smallest");
        rough["search"]["tilt_deg"] = json!([4.0, 15.0]);
        rough["tolerances"]["max_step_over_mm"] = json!(round_to(0.36 * self.radius, 1));
        for end in ["entry", "exit"] {
            // As far beyond the edge that the cutter is beside the casting.
            let line = &mut rough[end]["tangential_arc"]["straight_mm"];
            *line = json!(round_to(2.0 * line.as_f64().unwrap_or_default(), 1));
        }
        rough
    }

    /// Returns an operation with the region and tool of a finish, in layers and with coarse steps.
    pub(crate) fn layered(&self, finish: &Value) -> Value {
        let mut rough = finish.clone();
        rough["allowance_mm"] = json!(LEFT);
        rough["layers"] = json!({ "from_mm": self.cast.from, "depth_mm": DEPTH });
        let tolerances = &mut rough["tolerances"];
        tolerances["cusp_mm"] = json!(0.3);
        tolerances["max_step_mm"] = json!(4.0);
        tolerances["path_chord_mm"] = json!(0.1);
        tolerances["linearisation_mm"] = json!(0.05);
        rough["feeds"]["removal_rate"] = json!({ "target_cm3_min": 60.0, "min_mm_min": 200.0 });
        rough
    }

    /// Returns the largest material on the casting, mm.
    pub(crate) fn from(&self) -> f64 {
        self.cast.from
    }

    /// Returns a face mill whose flute is longer than the casting's material is high.
    pub(crate) fn face_mill(&self) -> Value {
        let mut tool = tool_file(self.radius, (4.0 * self.radius).max(180.0));
        let flute = (1.3 * self.cast.from).ceil();
        let more = flute - tool["flute_length_mm"].as_f64().unwrap_or_default();
        tool["flute_length_mm"] = json!(flute);
        for key in ["stick_out_mm", "gauge_length_mm"] {
            tool[key] = json!(round_to(tool[key].as_f64().unwrap_or_default() + more, 2));
        }
        tool
    }
}
