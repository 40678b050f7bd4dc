//! A written program checked against meshes by the kit's own interpreter, kinematics and distances.
//! All data comes from the files of the job alone.

use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use serde_json::Value;

use crate::jobs::JobFolder;
use crate::oracles::brute::{Bins, Frustum, RoundedCylinder};
use crate::oracles::interpreter::{Axes, Motion};
use crate::oracles::paper_machine::{PIVOT_TO_FACE, tool_on_table};

/// A mesh that must not be cut.
pub struct KeepOutMesh {
    /// Its role in the job: `drive`, `part`, `check`, `fixture`.
    pub role: String,
    /// Its triangles, workpiece frame.
    pub bins: Bins,
    /// Material that the cutter leaves on it, mm.
    pub allowance: f64,
    /// Distance that other bodies keep from it, besides their own clearance, mm: the stock on it or
    /// its allowance.
    pub thickness: f64,
}

/// A body that does not cut.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// Its shape.
    pub shape: Frustum,
    /// Distance that it keeps from everything, mm.
    pub clearance: f64,
}

/// A setup of a job on the head-B, table-C mill, as far as it can be gouged.
pub struct ReadBack {
    /// Obstacles, which must not be cut.
    pub grounds: Vec<KeepOutMesh>,
    /// The cutter.
    pub cutter: RoundedCylinder,
    /// Cutter body, holder, spindle nose.
    pub bodies: Vec<Body>,
    /// From the B pivot to the tip, mm.
    pub pivot_length: f64,
    /// How the workpiece is mounted.
    pub table_from_work: Isometry3<f64>,
    /// Work offset of X, Y and Z, mm.
    pub work_offset: [f64; 3],
    /// Distance that the tool keeps in rapids, mm.
    pub rapid_clearance: f64,
}

/// A place of the tool: tip and axis, workpiece frame.
pub type TipAndAxis = (Point3<f64>, Unit<Vector3<f64>>);

/// A number of a JSON file.
///
/// # Panics
/// When it is none.
pub fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or_else(|| panic!("no number: {v}"))
}

fn vector(v: &Value) -> Vector3<f64> {
    Vector3::from_iterator(v.as_array().expect("three numbers").iter().map(number))
}

/// A pose of a job file; identity where it is missing.
///
/// # Panics
/// When a number is missing.
pub fn pose(file: &Value) -> Isometry3<f64> {
    let part = |key: &str| file.get(key).map(vector);
    let angle = file.get("rotation_deg").map_or(0.0, number).to_radians();
    let axis = Unit::new_normalize(part("rotation_axis").unwrap_or_else(Vector3::z));
    let shift = Translation3::from(part("translation_mm").unwrap_or_else(Vector3::zeros));
    Isometry3::from_parts(shift, UnitQuaternion::from_axis_angle(&axis, angle))
}

fn matches(pattern: &str, name: &str) -> bool {
    match pattern.strip_suffix('*') {
        Some(start) => name.starts_with(start),
        None => name == pattern,
    }
}

impl ReadBack {
    /// Of a setup of a job, from 0.
    ///
    /// # Panics
    /// When a file cannot be read, or the job is of a kind that this is not made for.
    pub fn of(job: &JobFolder, setup: usize) -> Self {
        let (file, tool) = (job.json("job.json"), job.json("tool.json"));
        let file = &file["setups"][setup];
        Self { grounds: grounds(job, setup, file), ..Self::without_obstacles(file, &tool) }
    }

    /// Of a setup of a job file with a tool file, with nothing that must not be cut.
    ///
    /// # Panics
    /// When the sections of the tool do not add up to its gauge length, or numbers are missing.
    pub fn without_obstacles(setup: &Value, tool: &Value) -> Self {
        let (bodies, gauge) = bodies(tool);
        assert!((gauge - number(&tool["gauge_length_mm"])).abs() < 1e-9, "sections of {gauge} mm");
        Self {
            grounds: Vec::new(),
            cutter: RoundedCylinder {
                radius: number(&tool["radius_mm"]),
                corner: number(&tool["corner_radius_mm"]),
                height: number(&tool["flute_length_mm"]),
            },
            bodies,
            pivot_length: PIVOT_TO_FACE + gauge,
            table_from_work: pose(&setup["table_from_work"]),
            work_offset: ["X", "Y", "Z"].map(|a| setup["work_offset"]["linear_mm"].get(a).map_or(0.0, number)),
            rapid_clearance: setup.get("rapid_clearance_mm").map_or(5.0, number),
        }
    }

    /// The tool at an end of a motion, or between them.
    pub fn tool(&self, at: &Axes, rtcp: bool) -> TipAndAxis {
        // Words count from the work offset: of the axes without RTCP, of the tip with it, then on
        // the table.
        let [x, y, z] = self.work_offset;
        let at = Axes { x: at.x + x, y: at.y + y, z: at.z + z, ..*at };
        let (tip, axis) = tool_on_table(&at, self.pivot_length);
        let tip = if rtcp { Point3::new(at.x, at.y, at.z) } else { tip };
        (self.table_from_work.inverse() * tip, self.table_from_work.inverse() * axis)
    }

    /// The tool at the end of a motion.
    pub fn end(&self, m: &Motion) -> TipAndAxis {
        self.tool(&m.to, m.rtcp)
    }

    /// Places along a motion, its end included, tip and rim at most `step` apart.
    pub fn places(&self, m: &Motion, step: f64) -> Vec<TipAndAxis> {
        let ((a, u), (b, v)) = (self.tool(&m.from, m.rtcp), self.end(m));
        // The rotaries may swing the tip out and back within a block.
        let turn = (m.to.b - m.from.b).abs().to_radians() * self.pivot_length
            + (m.to.c - m.from.c).abs().to_radians() * m.from.x.hypot(m.from.y);
        let rim = self.cutter.radius * (u.into_inner() - v.into_inner()).norm();
        let way = ((a - b).norm() + rim).max(turn.min(40.0) * 0.5);
        let n = (way / step).ceil().max(1.0) as usize;
        (1..=n).map(|k| self.tool(&m.from.lerp(&m.to, k as f64 / n as f64), m.rtcp)).collect()
    }

    /// How deep the cutter is in what must stay, allowances included; 0 where it is nowhere.
    pub fn depth(&self, (tip, axis): &TipAndAxis) -> f64 {
        let beyond = |g: &KeepOutMesh| g.allowance - g.bins.gap(&self.cutter, tip, axis, g.allowance);
        self.grounds.iter().map(beyond).fold(0.0, f64::max)
    }

    /// Deepest cutter over every `stride`-th motion, and its line.
    pub fn deepest(&self, motions: &[Motion], stride: usize) -> (f64, usize) {
        let mut deepest = (0.0, 0);
        for m in motions.iter().step_by(stride) {
            for place in self.places(m, 1.0) {
                let depth = self.depth(&place);
                if depth > deepest.0 {
                    deepest = (depth, m.line);
                }
            }
        }
        deepest
    }

    /// Returns the rest of the clearances of all bodies from stock and fixtures at a place,
    /// searched up to `at_most`; negative: one is nearer than it may be.
    pub fn room(&self, (tip, axis): &TipAndAxis, at_most: f64) -> f64 {
        let mut room = at_most;
        for g in &self.grounds {
            for b in &self.bodies {
                let kept = b.clearance + g.thickness;
                room = room.min(g.bins.distance(&b.shape, tip, axis, kept + at_most) - kept);
            }
        }
        room
    }

    /// Distance of cutter and bodies from what they come nearest to, the stock on it included,
    /// searched up to `at_most`.
    pub fn distance(&self, (tip, axis): &TipAndAxis, at_most: f64) -> f64 {
        let mut nearest = at_most;
        for g in &self.grounds {
            let reach = g.thickness + at_most;
            nearest = nearest.min(g.bins.gap(&self.cutter, tip, axis, reach) - g.thickness);
            for b in &self.bodies {
                nearest = nearest.min(g.bins.distance(&b.shape, tip, axis, reach) - g.thickness);
            }
        }
        nearest
    }
}

/// Non-cutting bodies of a tool, and the height of the gauge line.
fn bodies(tool: &Value) -> (Vec<Body>, f64) {
    let mut bodies = Vec::new();
    let mut low = number(&tool["flute_length_mm"]);
    for stack in ["body", "holder"] {
        for s in tool[stack]["sections"].as_array().expect("sections") {
            let high = low + number(&s["length_mm"]);
            let (radius_low, radius_high) = (0.5 * number(&s["diameter_low_mm"]), 0.5 * number(&s["diameter_high_mm"]));
            let shape = Frustum { low, high, radius_low, radius_high };
            bodies.push(Body { shape, clearance: number(&tool[stack]["clearance_mm"]) });
            low = high;
        }
    }
    // The preset machine's spindle nose.
    let nose = Frustum { low, high: low + 250.0, radius_low: 90.0, radius_high: 90.0 };
    bodies.push(Body { shape: nose, clearance: 5.0 });
    (bodies, low)
}

fn grounds(job: &JobFolder, setup: usize, file: &Value) -> Vec<KeepOutMesh> {
    let typed = job.file().setups.remove(setup).meshes;
    let work_from_part = pose(&file["work_from_part"]);
    let stock = file["stock"].pointer("/offset/allowance_mm").map_or(0.0, number);
    let entries = file["meshes"].as_array().expect("meshes");
    // A part has its drive surface in it.
    let in_a_part =
        |m: &Value| m["role"] == "drive" && entries.iter().any(|o| o["role"] == "part" && o["file"] == m["file"]);
    let one = |(m, typed): (&Value, &facemill::job_file::MeshFile)| {
        let all = facemill::read_mesh(&job.path(&typed.file), typed.unit, typed.up_axis).expect("a mesh").mesh;
        let groups: Option<Vec<&str>> = m["groups"].as_array().map(|g| g.iter().filter_map(Value::as_str).collect());
        let mesh = all.select_groups(|name| groups.as_ref().is_none_or(|g| g.iter().any(|p| matches(p, name))));
        let role = m["role"].as_str().expect("a role").to_owned();
        let allowance = m.get("allowance_mm").map_or(0.0, number);
        let thickness = if role == "fixture" { allowance } else { stock.max(allowance) };
        KeepOutMesh { role, bins: Bins::new(&mesh.transformed(&work_from_part), 5.0), allowance, thickness }
    };
    entries.iter().zip(&typed).filter(|(m, _)| !in_a_part(m)).map(one).collect()
}

/// Feed of every point of an APT file in order, mm/min; `None` for rapids.
///
/// # Panics
/// On a feed that is no number.
pub fn apt_feeds(apt: &str) -> Vec<Option<f64>> {
    let (mut feed, mut rapid) = (None, false);
    let mut feeds = Vec::new();
    for line in apt.lines() {
        if line == "RAPID" {
            rapid = true;
        } else if let Some(rest) = line.strip_prefix("FEDRAT/") {
            let f = rest.split(',').next().expect("a word");
            feed = Some(f.parse().unwrap_or_else(|e| panic!("{line}: {e}")));
        } else if line.starts_with("GOTO/") {
            feeds.push(if rapid { None } else { feed });
            rapid = false;
        }
    }
    feeds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn apt_rapids_hold_for_one_point_and_feeds_until_the_next() {
        let apt = "RAPID\nGOTO/1,2,3\nFEDRAT/20.5,MMPM\nGOTO/1,2,4\nRAPID\nGOTO/1,2,3\nGOTO/9,9,9\n";
        assert_eq!(apt_feeds(apt), [None, Some(20.5), None, Some(20.5)]);
    }

    #[test]
    fn poses_turn_then_move() {
        let p =
            pose(&serde_json::json!({ "translation_mm": [1, 2, 3], "rotation_deg": 90, "rotation_axis": [0, 0, 2] }));
        assert!((p * Point3::new(1.0, 0.0, 0.0) - Point3::new(1.0, 3.0, 3.0)).norm() < 1e-12);
        assert_eq!(pose(&Value::Null), Isometry3::identity());
    }
}
