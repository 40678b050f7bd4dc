//! The sample job of a whole propeller: sides, roots, hub, fillets, edges and tips, from the
//! casting.

use serde_json::{Value, json};

use crate::job_parts::{JobFiles, job_file, round_to};
use crate::new_cast::{CastPropeller, SIDES, Sample};

/// Diameters for which the bull nose and ball nose mills reach the root, mm.
const DIAMETERS: [f64; 2] = [900.0, 1100.0];

/// Radii between which the bull nose mill cuts the sides, over that of the tip.
const ROOT: [f64; 2] = [0.242, 0.548];

/// Radius up to which the face mill finishes the sides, over that of the tip.
const FACE_TO: f64 = 0.998;

/// Radii between which the ball nose mill cuts the edges, each half from its side, over that of the
/// tip.
const EDGES: [f64; 2] = [0.435, 0.998];

/// Radii between which it cuts both halves of an edge at once, from the root on, over that of the
/// tip.
const EDGE_ROOT: [f64; 2] = [0.222, 0.44];

/// Radii between which the ball nose mill cuts the strip of a side beside the fillet, over that of
/// the tip.
const STRIP: [f64; 2] = [0.21, 0.246];

/// Angle of the middle between two blades on the hub, at half of its height, from the blade that
/// bounds it in front, deg.
const MIDDLE: f64 = -60.0;

/// Slope of the space between two blades on the hub: tangent of the angle between it and the
/// propeller's axis.
const SLOPE: f64 = 0.346;

/// Passes on the hub between two blades: from short of the middle to the fillet, over the radius of
/// the tip.
const HUB: [f64; 2] = [-0.016, 0.088];

/// Level on the hub from which on the ball nose mill cuts the space between the passes of the bull
/// nose mill and the fillet, over the radius of the tip.
const BESIDE: f64 = 0.076;

/// Normal of the plane along the middle of a blade's root.
const ROOT_PLANE: [f64; 3] = [0.0, 0.9015, -0.4327];

/// Parts of a fillet with the hub beside it. In each, the ball nose mill points between blade and
/// hub and away from the neighbour.
const PARTS: [FilletPart; 2] = [
    FilletPart {
        name: "fillet low",
        z: [-0.308, 0.03],
        to: 0.01,
        axis: AxisTo { at: [0.114, -0.16, -0.14], angle: -66.0, rise: 0.2 },
    },
    FilletPart {
        name: "fillet up",
        z: [0.02, 0.332],
        to: -0.016,
        axis: AxisTo { at: [0.19, 0.0, 0.16], angle: -8.0, rise: 0.5 },
    },
];

/// End of the fillet around the upper edge, with the hub beside it. The tool points outward and
/// along the chord there.
const END: FilletPart = FilletPart {
    name: "fillet end",
    z: [0.172, 0.334],
    to: 0.028,
    axis: AxisTo { at: [0.16, 0.144, 0.3], angle: 75.0, rise: 1.19 },
};

/// Distance from the plane along the middle of the root from which on fillet and hub belong to the
/// end, over the radius of the tip.
const END_FROM: f64 = -0.019;

/// Least coordinate along x of the end, and its largest radius, over that of the tip.
const END_WITHIN: [f64; 2] = [0.06, 0.23];

/// Direction of the tool at the root of the upper edge: both of its halves are seen from there.
const EDGE_ROOT_AXIS: AxisTo = AxisTo { at: [0.19, 0.19, 0.27], angle: 113.0, rise: 1.0 };

/// Width of the tip on both sides of the line where both sides of the blade meet, over the radius
/// of the tip.
const TIP_WIDTH: f64 = 0.002;

/// Point that the tool's axis goes to at the tip: outward and up. With a tool across the work the
/// head meets the table.
const TIP_AXIS: [f64; 3] = [3.8, 0.0, 2.8];

/// Part of a fillet; lengths over the radius of the tip.
struct FilletPart {
    name: &'static str,
    /// Heights between which it lies.
    z: [f64; 2],
    /// Distance from the plane along the middle of the root up to which fillet and hub belong to
    /// it.
    to: f64,
    axis: AxisTo,
}

/// Point that the tool's axis goes to; lengths over the radius of the tip.
struct AxisTo {
    /// Place in the middle of the region.
    at: [f64; 3],
    /// Direction from there about the propeller's axis, deg, and its rise along it per distance
    /// across.
    angle: f64,
    rise: f64,
}

impl AxisTo {
    /// Returns the mode of search with the axis toward the point, three radii away.
    fn mode(&self, tip: f64) -> Value {
        let (sin, cos) = self.angle.to_radians().sin_cos();
        let away = [cos, sin, self.rise].map(|c| 3.0 * tip * c);
        let point: Vec<f64> = self.at.iter().zip(away).map(|(at, away)| round_to(at * tip + away, 1)).collect();
        json!({ "toward": { "point": { "position_mm": point } } })
    }
}

/// Height of the work above the table, over the diameter: with the tool level, the head passes
/// above the table.
const ABOVE_TABLE: f64 = 0.5;

/// Returns the files of a job for a casting of DTMB 4119 with three tools: on each side, in a setup
/// of its own, the face mill cuts the sides outward of their roots, a bull nose mill the roots and
/// half of the hub between the blades, and a ball nose mill fillets and edges, in the second setup
/// the tips, too. `blades` are machined, from the first on; all if it is `None`.
///
/// # Errors
/// If the diameter or the number of blades is out of range.
pub(crate) fn whole_propeller_job(diameter: f64, blades: Option<usize>) -> Result<JobFiles, String> {
    let [least, most] = DIAMETERS;
    if !(least..=most).contains(&diameter) {
        return Err(format!("diameter of a whole propeller must be from {least} to {most} mm, is {diameter}"));
    }
    let cast = CastPropeller::new(diameter)?;
    let sample = Sample::of(&cast);
    let name = format!("DTMB 4119, D {diameter} mm, whole, from the casting");
    let mut job = job_file(&name, Value::Null, Value::Null);
    if let Some(fields) = job.as_object_mut() {
        fields.remove("tool");
    }
    job["tools"] = json!({ FACE: "tool.json", BULL: "tool-2.json", BALL: "tool-3.json" });
    job["setups"] = SIDES.iter().map(|side| setup(&sample, side)).collect();
    let mut operations: Vec<Value> =
        SIDES.iter().flat_map(|side| Side { sample: &sample, side }.operations()).collect();
    let all = sample.n_blades();
    let blades = blades.unwrap_or(all);
    if !(1..=all).contains(&blades) {
        return Err(format!("the propeller has {all} blades; {blades} of them cannot be machined"));
    }
    for operation in &mut operations {
        operation["pattern"]["copies"] = json!(blades);
    }
    job["operations"] = json!(operations);
    let tools = [("tool.json", sample.face_mill()), ("tool-2.json", bull_nose()), ("tool-3.json", ball_nose())];
    cast.files(&job, above_table(&sample), &tools)
}

/// Names of the tools.
const FACE: &str = "face mill";
const BULL: &str = "bull nose";
const BALL: &str = "ball nose";

/// Returns the height of the work above the table, mm.
fn above_table(sample: &Sample<'_>) -> f64 {
    round_to(ABOVE_TABLE * 2.0 * sample.tip(), 0)
}

fn setup(sample: &Sample<'_>, side: &str) -> Value {
    let mut setup = sample.setup(side);
    let mut groups: Vec<String> =
        ["", "-leading-edge", "-trailing-edge", "-tip", "-fillet"].map(|part| format!("blade-1/{side}{part}")).into();
    groups.push("hub/cylinder".to_owned());
    groups.push(format!("blade-1/{}-{}", other(side), upper_edge(side)));
    if side == SIDES[1] {
        groups.push(format!("blade-1/{}-tip", other(side)));
    }
    setup["meshes"][0]["groups"] = json!(groups);
    setup["table_from_work"]["translation_mm"][2] = json!(above_table(sample));
    // Tools between the blades point away from the axis: along them, they come out there.
    setup["clearance"] = json!({ "cylinder": { "radius_mm": round_to(1.06 * sample.tip(), 0) } });
    setup
}

/// Returns the side that faces down where this one faces up.
fn other(side: &str) -> &'static str {
    SIDES[usize::from(side == SIDES[0])]
}

/// Returns the edge that is above the middle of the hub where a side faces up, as names of groups
/// have it.
fn upper_edge(side: &str) -> &'static str {
    if side == SIDES[0] { "leading-edge" } else { "trailing-edge" }
}

/// One side of the blades.
struct Side<'a> {
    sample: &'a Sample<'a>,
    /// Its name.
    side: &'a str,
}

impl Side<'_> {
    /// Returns all operations, in the order in which they are cut.
    fn operations(&self) -> Vec<Value> {
        let [mut layers, mut finish] = self.sample.face_milling(self.side);
        finish["path"]["strategy"]["strategy"]["cylindrical_sections"]["to_radius_mm"] =
            json!(round_to(FACE_TO * self.sample.tip(), 1));
        for operation in [&mut layers, &mut finish] {
            operation["tool"] = json!(FACE);
            operation["path"]["strategy"]["region"]["groups"] = json!([format!("blade-1/{}", self.side)]);
        }
        let (root, hub) = (self.root(&finish), self.hub(&finish));
        let fillets = PARTS.map(|part| self.fillet(&finish, &part));
        let (end, edge_root) = (self.fillet_end(&finish), self.edge_root(&finish));
        let fine = [self.strip(&finish), self.edge(&finish, "leading edge"), self.edge(&finish, "trailing edge")];
        let mut all = vec![layers, finish];
        for (operation, name, beyond) in [(root, "root", 2.0 * self.sample.from()), (hub, "hub", 0.0)] {
            all.push(self.rough(&operation, name, beyond));
            all.push(operation);
        }
        all.extend(fillets.iter().zip(&PARTS).map(|(fillet, part)| self.fillet_rough(fillet, part)));
        all.extend(fillets);
        all.extend(fine);
        // Last, with the least material beside them.
        all.extend([self.fillet_rough(&end, &END), end, edge_root]);
        if self.side == SIDES[1] {
            all.extend(self.tip(&all[1]));
        }
        all
    }

    /// Returns layers and finish of the tip, once both sides are cut.
    fn tip(&self, finish: &Value) -> [Value; 2] {
        let tip = self.sample.tip();
        let groups = SIDES.map(|side| format!("blade-1/{side}-tip"));
        let line = json!({ "between_groups": groups });
        let strategy = json!({ "edge": { "width_mm": round_to(TIP_WIDTH * tip, 2), "line": line } });
        let mut end = self.operation(finish, "tip", &strategy, &groups);
        end["name"] = json!("tip");
        end["path"]["strategy"]["min_pass_length_mm"] = json!(2.0);
        end["search"]["tilt_deg"] = json!([10.0, 75.0]);
        end["search"]["rotate_deg"] = json!([0.0, 90.0]);
        end["search"]["max_turn_deg_per_mm"] = json!(1.0);
        let position = TIP_AXIS.map(|c| round_to(c * tip, 1));
        end["search"]["mode"] = json!({ "toward": { "point": { "position_mm": position } } });
        let end = with_ends(end, 20.0, 40.0, 4.0);
        let mut rough = self.rough(&end, "tip", 0.0);
        rough["name"] = json!("tip rough");
        if let Some(region) = rough["path"]["strategy"]["region"].as_object_mut() {
            region.remove("extend_mm");
        }
        // The mills of the sides leave little there.
        rough["layers"]["depth_mm"] = json!(self.sample.from());
        for key in ["max_step_mm", "path_chord_mm"] {
            rough["tolerances"][key] = end["tolerances"][key].clone();
        }
        [rough, end]
    }

    /// Returns an operation with a bull nose or ball nose mill.
    fn operation(&self, finish: &Value, name: &str, strategy: &Value, groups: &[String]) -> Value {
        let mut operation = finish.clone();
        operation["name"] = json!(format!("{} {name}", self.side));
        operation["tool"] = json!(BALL);
        // A plan of all programs takes ten minutes: rounds of all fronts are the user's choice.
        operation["path"] = json!({
            "strategy": {
                "strategy": strategy, "region": { "groups": groups }, "min_pass_length_mm": 8.0, "width_rounds": 0,
            },
        });
        operation["search"]["tilt_deg"] = json!([20.0, 75.0]);
        operation["search"]["rotate_deg"] = json!([50.0, 90.0]);
        operation["search"]["mode"] = json!("smallest");
        operation["search"]["max_turn_deg_per_mm"] = json!(0.3);
        operation["tolerances"]["max_step_over_mm"] = json!(10.0);
        operation["feeds"] = json!({
            "cutting_mm_min": 1500.0, "approach_mm_min": 2000.0, "spindle_rpm": 2500.0, "coolant": "flood",
        });
        operation["infeasible"]["trim"]["max_trimmed_fraction"] = json!(0.02);
        operation
    }

    /// Returns the finish of the side between fillet and face mill. Passes climb and lean outward:
    /// so the tool neither plunges nor meets the neighbouring blade.
    fn root(&self, finish: &Value) -> Value {
        let tip = self.sample.tip();
        let [from, to] = ROOT.map(|radius| round_to(radius * tip, 1));
        let strategy = json!({
            "cylindrical_sections": { "axis_direction": [0.0, 0.0, 1.0], "from_radius_mm": from, "to_radius_mm": to },
        });
        let mut root = self.operation(finish, "root finish", &strategy, &[format!("blade-1/{}", self.side)]);
        root["tool"] = json!(BULL);
        root["path"]["strategy"]["edge_fill"] = json!(false);
        root["path"]["strategy"]["region"]["extend_mm"] = json!(4.0);
        with_ends(root, 400.0, 5.0, 40.0)
    }

    /// Returns the finish of the hub between the blades, from its middle to the fillet of this
    /// side.
    fn hub(&self, finish: &Value) -> Value {
        let (sin, cos) = MIDDLE.to_radians().sin_cos();
        let [from, to] = HUB.map(|level| round_to(level * self.sample.tip(), 1));
        let strategy = json!({ "parallel_planes": { "normal": across_hub(), "from_mm": from, "to_mm": to } });
        let mut hub = self.operation(finish, "hub finish", &strategy, &["hub/cylinder".to_owned()]);
        hub["tool"] = json!(BULL);
        hub["path"]["strategy"]["edge_fill"] = json!(false);
        hub["path"]["strategy"]["min_pass_length_mm"] = json!(10.0);
        hub["path"]["strategy"]["region"]["normal_cone"] =
            json!({ "axis": [round_to(cos, 4), round_to(sin, 4), 0.0], "half_angle_deg": 75.0 });
        hub["search"]["tilt_deg"] = json!([12.0, 40.0]);
        hub["search"]["rotate_deg"] = json!([0.0, 20.0]);
        with_ends(hub, 200.0, 8.0, 20.0)
    }

    /// Returns the finish of a part of the fillet, with the hub beside it up to the passes of the
    /// bull nose mill.
    fn fillet(&self, finish: &Value, part: &FilletPart) -> Value {
        let tip = self.sample.tip();
        let strategy = json!({
            "constant_scallop": {
                "seed": { "group_border": "hub/cylinder" },
                "within": { "parallel_planes": {
                    "normal": across_hub(), "from_mm": round_to(BESIDE * tip, 1), "to_mm": round_to(0.4 * tip, 1),
                } },
            },
        });
        let groups = [format!("blade-1/{}-fillet", self.side), "hub/cylinder".to_owned()];
        let mut fillet = self.operation(finish, part.name, &strategy, &groups);
        let (wide, [low, high]) = (round_to(0.26 * tip, 1), part.z.map(|z| round_to(z * tip, 1)));
        let region = &mut fillet["path"]["strategy"]["region"];
        region["box"] = json!({ "min_mm": [-wide, -wide, low], "max_mm": [wide, wide, high] });
        region["between"] = json!({ "parallel_planes": {
            "normal": ROOT_PLANE, "from_mm": round_to(-0.4 * tip, 1), "to_mm": round_to(part.to * tip, 1),
        } });
        fillet["search"]["mode"] = part.axis.mode(tip);
        with_ends(fillet, 60.0, 36.0, 0.0)
    }

    /// Returns the finish of the fillet's end around the upper edge, with the hub beside it.
    fn fillet_end(&self, finish: &Value) -> Value {
        let tip = self.sample.tip();
        let [least_x, to] = END_WITHIN.map(|length| round_to(length * tip, 1));
        let mut end = self.fillet(finish, &END);
        let path = &mut end["path"]["strategy"];
        path["min_pass_length_mm"] = json!(4.0);
        path["strategy"]["constant_scallop"]["within"] = json!({ "cylindrical_sections": {
            "axis_direction": [0.0, 0.0, 1.0], "from_radius_mm": 0.0, "to_radius_mm": to,
        } });
        let region = &mut path["region"];
        region["groups"] = json!([
            format!("blade-1/{}-fillet", self.side),
            "hub/cylinder",
            format!("blade-1/{}-{}", self.side, upper_edge(self.side)),
        ]);
        region["box"]["min_mm"][0] = json!(least_x);
        region["between"]["parallel_planes"]["from_mm"] = json!(round_to(END_FROM * tip, 1));
        steep_ends(end)
    }

    /// Returns the layer before the finish of a part of the fillet: one, because the mills before
    /// leave little there. Arcs begin above the casting.
    fn fillet_rough(&self, fillet: &Value, part: &FilletPart) -> Value {
        let mut rough = self.rough(fillet, part.name, 0.0);
        if let Some(region) = rough["path"]["strategy"]["region"].as_object_mut() {
            region.remove("extend_mm");
        }
        rough["layers"]["depth_mm"] = json!(self.sample.from());
        // The fillet is narrow: longer steps cut its corners.
        rough["tolerances"]["max_step_mm"] = fillet["tolerances"]["max_step_mm"].clone();
        rough["tolerances"]["path_chord_mm"] = json!(0.03);
        rough
    }

    /// Returns the finish of the strip of the side between the fillet and the passes of the bull
    /// nose mill.
    fn strip(&self, finish: &Value) -> Value {
        let [from, to] = STRIP.map(|radius| round_to(radius * self.sample.tip(), 1));
        let strategy = json!({
            "constant_scallop": {
                "seed": { "group_border": format!("blade-1/{}-fillet", self.side) },
                "within": { "cylindrical_sections": {
                    "axis_direction": [0.0, 0.0, 1.0], "from_radius_mm": from, "to_radius_mm": to,
                } },
            },
        });
        let strip = self.operation(finish, "strip beside the fillet", &strategy, &[format!("blade-1/{}", self.side)]);
        with_ends(strip, 60.0, 36.0, 0.0)
    }

    /// Returns the finish of both halves of the upper edge from the fillet on, where the neighbour
    /// is beside the other setup's tool.
    fn edge_root(&self, finish: &Value) -> Value {
        let tip = self.sample.tip();
        let [from, to] = EDGE_ROOT.map(|radius| round_to(radius * tip, 1));
        let mut root = self.edge(finish, &upper_edge(self.side).replace('-', " "));
        root["name"] = json!(format!("{} root", root["name"].as_str().unwrap_or_default()));
        let path = &mut root["path"]["strategy"];
        path["min_pass_length_mm"] = json!(4.0);
        let edge = upper_edge(self.side);
        path["region"]["groups"] = json!([self.side, other(self.side)].map(|side| format!("blade-1/{side}-{edge}")));
        let within = &mut path["strategy"]["constant_scallop"]["within"]["cylindrical_sections"];
        within["from_radius_mm"] = json!(from);
        within["to_radius_mm"] = json!(to);
        root["search"]["mode"] = EDGE_ROOT_AXIS.mode(tip);
        // The casting is beside it.
        root["feeds"]["removal_rate"] = json!({ "target_cm3_min": 60.0, "min_mm_min": 200.0 });
        steep_ends(root)
    }

    /// Returns the finish of this side's half of an edge.
    fn edge(&self, finish: &Value, edge: &str) -> Value {
        let [from, to] = EDGES.map(|radius| round_to(radius * self.sample.tip(), 1));
        let strategy = json!({
            "constant_scallop": {
                "seed": { "group_border": format!("blade-1/{}", self.side) },
                "within": {
                    "cylindrical_sections": {
                        "axis_direction": [0.0, 0.0, 1.0], "from_radius_mm": from, "to_radius_mm": to,
                    },
                },
            },
        });
        let group = format!("blade-1/{}-{}", self.side, edge.replace(' ', "-"));
        let mut operation = self.operation(finish, edge, &strategy, &[group]);
        operation["path"]["strategy"]["min_pass_length_mm"] = json!(20.0);
        operation["search"]["tilt_deg"] = json!([10.0, 75.0]);
        operation["search"]["rotate_deg"] = json!([0.0, 90.0]);
        operation["search"]["max_turn_deg_per_mm"] = json!(1.0);
        with_ends(operation, 40.0, 30.0, 28.0)
    }

    /// Returns the layers before a finish, with passes so far beyond the region's border.
    fn rough(&self, finish: &Value, name: &str, beyond: f64) -> Value {
        let mut rough = self.sample.layered(finish);
        rough["name"] = json!(format!("{} {name} rough", self.side));
        rough["path"]["strategy"]["region"]["extend_mm"] = json!(round_to(beyond, 1));
        rough
    }
}

/// Returns the direction across the space between two blades on the hub.
fn across_hub() -> [f64; 3] {
    let (sin, cos) = MIDDLE.to_radians().sin_cos();
    let across = 1.0 / SLOPE.hypot(1.0);
    [-sin * across, cos * across, -SLOPE * across].map(|c| round_to(c, 4))
}

/// Returns an operation with a tangential arc and a straight line at both ends of passes.
fn with_ends(mut operation: Value, radius: f64, angle_deg: f64, straight: f64) -> Value {
    for end in ["entry", "exit"] {
        operation[end] = json!({
            "tangential_arc": { "radius_mm": radius, "angle_deg": angle_deg, "straight_mm": straight },
        });
    }
    operation
}

/// Returns an operation with short, steep arcs at both ends of passes: about the edge's root, flat
/// ones meet the blade or the hub. They begin above the casting, too.
fn steep_ends(operation: Value) -> Value {
    with_ends(operation, 18.0, 85.0, 0.0)
}

/// Returns a bull nose mill that reaches the root.
fn bull_nose() -> Value {
    let mut tool = long_mill("bull nose D32 r8", 2, (16.0, 8.0), (24.0, 190.0), [29.0, 29.0]);
    tool["n_inserts"] = json!(3);
    tool["dead_core_radius_mm"] = json!(6.0);
    tool
}

/// Returns a ball nose mill that reaches the fillets, and cuts to its centre.
fn ball_nose() -> Value {
    let mut tool = long_mill("ball nose D20", 3, (10.0, 10.0), (30.0, 170.0), [18.0, 29.0]);
    // It cuts to its centre: what it may ramp is a matter of feed, which follows the removal rate.
    tool["max_ramp_angle_deg"] = json!(40.0);
    tool
}

/// Returns a mill of two inserts with radius and corner radius, length of flute and neck, and the
/// neck's diameters, in a slim holder.
fn long_mill(
    name: &str,
    number: u32,
    (radius, corner): (f64, f64),
    (flute, neck): (f64, f64),
    [low, high]: [f64; 2],
) -> Value {
    let stick_out = flute + neck;
    let gauge = 434.0;
    json!({
        "format": facemill_tool_model::FORMAT,
        "name": name,
        "number": number,
        "radius_mm": radius,
        "corner_radius_mm": corner,
        "n_inserts": 2,
        "flute_length_mm": flute,
        "dead_core_radius_mm": 0.0,
        "max_ramp_angle_deg": 5.0,
        "spindle_rotation": "clockwise",
        "stick_out_mm": stick_out,
        "gauge_length_mm": gauge,
        "body": {
            "clearance_mm": 0.5,
            "sections": [{ "length_mm": neck, "diameter_low_mm": low, "diameter_high_mm": high }],
        },
        "holder": {
            "clearance_mm": 2.0,
            "sections": [{ "length_mm": gauge - stick_out, "diameter_low_mm": 44.0, "diameter_high_mm": 60.0 }],
        },
    })
}
