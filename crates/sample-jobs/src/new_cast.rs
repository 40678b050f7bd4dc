//! The sample job of a cast propeller: both sides of its blades, from the casting to the part.

use facemill_sample_parts::{
    BladeResolution, Bore, CastingAllowance, PropellerSeries, PropellerSpec, RootFillet, SolidForm, TurnedHub,
    chord_error, propeller_solid, turned_casting, turned_solid,
};
use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Vector3};
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

/// Radii of pedestal and nut over that of the hub, gap between arbor and bore, and height of the
/// nut, mm.
const PEDESTAL: f64 = 0.8;
const NUT: f64 = 0.55;
const ARBOR_GAP: f64 = 0.05;
const NUT_HEIGHT: f64 = 30.0;

/// Returns the turn of the part about x with which a side faces up, deg.
fn turn_deg(side: &str) -> f64 {
    if side == SIDES[0] { 0.0 } else { 180.0 }
}

/// Returns the file of the clamping parts where a side faces up.
fn clamping_file(side: &str) -> String {
    format!("clamping-{side}.glb")
}

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
    cast.files(&job, sample.above_table(), &[("tool.json", sample.face_mill())])
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
        let faces = part.select_groups(|name| name == "hub/faces").aabb();
        let hub = TurnedHub { bore_radius: BORE * spec.hub_radius(), faces: [faces.min.z, faces.max.z] };
        let cast = turned_casting(&part, allowance, CASTING_CELL, hub).map_err(|e| e.to_string())?;
        Ok(Self { spec, part, cast, chord, from: allowance.largest() })
    }

    /// Returns pedestal, arbor and nut that clamp the casting where a side faces up, in the frame
    /// of the part. The hub lies on the pedestal with a face, the arbor goes through its bore, and
    /// the nut lies on the other face.
    fn clamping(&self, side: &str, above_table: f64) -> TriMesh {
        let [low, high] = self.hub_heights(side);
        let (hub, bore) = (self.spec.hub_radius(), BORE * self.spec.hub_radius());
        let (pedestal, arbor, nut) = (PEDESTAL * hub, bore - ARBOR_GAP, NUT * hub);
        let top = high + NUT_HEIGHT;
        let outline = [[pedestal, -above_table], [pedestal, low], [arbor, low], [arbor, high], [nut, high], [nut, top]];
        let solid = turned_solid("clamping", &outline);
        let turn_deg = turn_deg(side);
        if turn_deg == 0.0 {
            solid
        } else {
            solid.transformed(&Isometry3::rotation(Vector3::x() * turn_deg.to_radians()))
        }
    }

    /// Returns the heights of the faces of the hub where a side faces up, mm.
    fn hub_heights(&self, side: &str) -> [f64; 2] {
        let bounds = self.part.select_groups(|name| name.starts_with("hub/")).aabb();
        let [low, high] = [bounds.min.z, bounds.max.z];
        if turn_deg(side) == 0.0 { [low, high] } else { [-high, -low] }
    }

    /// Returns the height of the nut's upper face where a side faces up, mm.
    fn top_of_nut(&self, side: &str) -> f64 {
        self.hub_heights(side)[1] + NUT_HEIGHT
    }

    /// Returns the files of a job with its tools; the work is so high above the table, mm.
    ///
    /// # Errors
    /// If a mesh is too large for a file.
    pub(crate) fn files(&self, job: &Value, above_table: f64, tools: &[(&str, Value)]) -> Result<JobFiles, String> {
        let file = |value: &Value| facemill_file_format::to_json(value).into_bytes();
        let mut files = vec![
            ("propeller.glb".to_owned(), grouped_glb(&self.part)?),
            ("casting.glb".to_owned(), grouped_glb(&self.cast)?),
            ("job.json".to_owned(), file(job)),
        ];
        for side in SIDES {
            files.push((clamping_file(side), grouped_glb(&self.clamping(side, above_table))?));
        }
        files.extend(tools.iter().map(|(name, tool)| ((*name).to_owned(), file(tool))));
        files.push(("machine.json".to_owned(), machine_with_tool_change().into_bytes()));
        Ok(files)
    }
}

/// Typical time of a tool change on a large machine, s.
const TOOL_CHANGE: u32 = 15;

/// Returns the preset machine with the time of a tool change, which it does not have, as assumed.
fn machine_with_tool_change() -> String {
    let preset = facemill_inverse_kinematics::preset_head_b_table_c();
    let listed = preset.replacen("\"assumed\": [", "\"assumed\": [{ \"value\": \"tool_change\" }, ", 1);
    let keys = listed.trim_end().trim_end_matches('}').trim_end();
    format!("{keys},\n  \"tool_change_s\": {TOOL_CHANGE}\n}}\n")
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

    /// Returns the height of the work above the table, mm.
    pub(crate) fn above_table(&self) -> f64 {
        round_to(0.25 * self.cast.spec.diameter(), 0)
    }

    /// Returns the setup in which a side faces up.
    pub(crate) fn setup(&self, side: &str) -> Value {
        let bounds = self.cast.part.aabb();
        let turn_deg = turn_deg(side);
        let top = if turn_deg == 0.0 { bounds.max.z } else { -bounds.min.z };
        let top = (top + self.cast.from).max(self.cast.top_of_nut(side));
        let mesh = |file: &str, groups: &[&str], role: &str| json!({ "file": file, "groups": groups, "role": role, "unit": "metre", "up_axis": "y" });
        let part = "propeller.glb";
        json!({
            "name": format!("{side} side up"),
            "work_from_part": { "rotation_axis": [1.0, 0.0, 0.0], "rotation_deg": turn_deg },
            "table_from_work": { "translation_mm": [0.0, 0.0, self.above_table()] },
            "work_offset": { "register": "G54" },
            "meshes": [
                mesh(part, &[&format!("blade-1/{side}")], "drive"),
                mesh(part, &["*"], "part"),
                mesh(part, &["hub/bore", "hub/faces"], "datum"),
                mesh(&clamping_file(side), &["*"], "fixture"),
            ],
            "stock": { "mesh": { "file": "casting.glb", "unit": "metre", "up_axis": "y" } },
            "clearance": { "plane": { "origin_mm": [0.0, 0.0, (top + 10.0).ceil()] } },
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
