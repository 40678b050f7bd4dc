use facemill_cl_data::{PlacedSolid, RoundFrustum, Solid};
use facemill_file_format::{FormatError, KeyLimit};
use nalgebra::Isometry3;

use crate::cutter::{Cutter, CutterError};
use crate::tool_file::{SpindleRotation, Stack, ToolFile};

/// A whole tool: cutter, cutter body, holder, and what cutting with it needs to know. Tool frame, mm and rad.
///
/// Checked: the cutter body closes the gap between flute and holder, the holder reaches the gauge line.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolAssembly {
    file: ToolFile,
    cutter: Cutter,
}

/// Why bytes are not a tool.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ToolFileError {
    /// The text is not a tool file: not JSON, an unknown or missing key, a value of the wrong kind, another format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// Radius, corner radius and flute length do not make a cutter.
    #[error("radius_mm, corner_radius_mm, flute_length_mm: {0}")]
    Cutter(#[from] CutterError),
    /// A number is out of its range.
    #[error("{field}: {value} is not {expected}")]
    OutOfRange {
        /// Path of the field, such as `holder.sections[1].length_mm`.
        field: String,
        /// Its value.
        value: f64,
        /// What it has to be.
        expected: String,
    },
    /// Two lengths do not fit each other.
    #[error("{field}: reaches to {reaches_mm} mm above the tip, but must reach {needed_mm} mm ({to})")]
    Gap {
        /// Path of the stack.
        field: &'static str,
        /// Where its sections end.
        reaches_mm: f64,
        /// Where they must reach.
        needed_mm: f64,
        /// What is there.
        to: &'static str,
    },
}

/// Sections written in tenths may miss their sum by rounding; a gap of this size (mm) hides nothing that could collide.
const GAP: f64 = 1e-6;

/// Limits of the keys that have some of their own.
///
/// Lengths: no spindle carries a tool of ten metres, and below 10 µm nothing is turned. A body or holder without a diameter would collide
/// with nothing. T words have eight digits; the largest face mills have about a hundred inserts.
pub const TOOL_LIMITS: [KeyLimit; 11] = [
    KeyLimit::new("radius_mm", 0.01, 1e4),
    KeyLimit::new("flute_length_mm", 0.01, 1e4),
    KeyLimit::new("stick_out_mm", 0.01, 1e4),
    KeyLimit::new("gauge_length_mm", 0.01, 1e4),
    KeyLimit::new("length_mm", 1e-12, 1e4),
    KeyLimit::new("diameter_low_mm", 0.01, 1e4),
    KeyLimit::new("diameter_high_mm", 0.01, 1e4),
    KeyLimit::new("clearance_mm", 0.0, 1e3),
    KeyLimit::new("max_ramp_angle_deg", 0.0, 90.0),
    KeyLimit::new("number", 1.0, 99_999_999.0),
    KeyLimit::new("n_inserts", 1.0, 500.0),
];

/// Largest register that controls have for lengths.
const LAST_REGISTER: u32 = 999;

impl ToolAssembly {
    /// Reads a tool file.
    ///
    /// # Errors
    /// When it is not a tool file, or its numbers are not a tool's; the error names the field.
    pub fn from_json(text: &[u8]) -> Result<Self, ToolFileError> {
        Self::new(facemill_file_format::from_json(text)?)
    }

    /// Checks a tool file's numbers.
    ///
    /// # Errors
    /// When a number is out of range or lengths do not fit each other; the error names the field.
    pub fn new(file: ToolFile) -> Result<Self, ToolFileError> {
        check_numbers(&file)?;
        let cutter = Cutter::new(file.radius_mm, file.corner_radius_mm, file.flute_length_mm)?;
        check_stack("body", &file.body)?;
        check_stack("holder", &file.holder)?;
        check_reach("body", &file.body, file.flute_length_mm, file.stick_out_mm, "stick_out_mm")?;
        check_reach("holder", &file.holder, file.stick_out_mm, file.gauge_length_mm, "gauge_length_mm")?;
        Ok(Self { file, cutter })
    }

    /// The tool with a cutter of another radius: its body and dead core in proportion, its corner no larger than fits.
    ///
    /// # Errors
    /// When that makes no tool.
    pub fn with_radius(&self, radius: f64) -> Result<Self, ToolFileError> {
        let mut file = self.file.clone();
        let share = radius / file.radius_mm;
        file.radius_mm = radius;
        file.corner_radius_mm = file.corner_radius_mm.min(radius);
        file.dead_core_radius_mm *= share;
        for section in &mut file.body.sections {
            section.diameter_low_mm *= share;
            section.diameter_high_mm *= share;
        }
        Self::new(file)
    }

    /// The tool sticking out of its holder farther: the topmost section of its body longer by as much.
    ///
    /// # Errors
    /// When that makes no tool.
    pub fn longer_by(&self, length: f64) -> Result<Self, ToolFileError> {
        let mut file = self.file.clone();
        file.stick_out_mm += length;
        file.gauge_length_mm += length;
        if let Some(section) = file.body.sections.last_mut() {
            section.length_mm += length;
        }
        Self::new(file)
    }

    /// The tool as a file; reading it gives the same tool.
    pub fn to_file(&self) -> ToolFile {
        self.file.clone()
    }

    /// The cutting part.
    pub fn cutter(&self) -> &Cutter {
        &self.cutter
    }

    /// What reports and the NC program call the tool.
    pub fn name(&self) -> &str {
        &self.file.name
    }

    /// Number in the magazine.
    pub fn number(&self) -> u32 {
        self.file.number
    }

    /// Register of the control that holds the tool's length.
    pub fn length_register(&self) -> u32 {
        self.file.length_register.unwrap_or(self.file.number)
    }

    /// Number of inserts or teeth, at least 1.
    pub fn n_inserts(&self) -> u32 {
        self.file.n_inserts
    }

    /// Radius about the axis within which the bottom does not cut, mm; 0 for a cutter that cuts to its centre.
    pub fn dead_core_radius(&self) -> f64 {
        self.file.dead_core_radius_mm
    }

    /// Steepest ramp on which the cutter may enter the material, rad.
    pub fn max_ramp_angle(&self) -> f64 {
        self.file.max_ramp_angle_deg.to_radians()
    }

    /// Sense of the spindle for cutting, seen from the spindle toward the tip.
    pub fn spindle_rotation(&self) -> SpindleRotation {
        self.file.spindle_rotation
    }

    /// Cutting edge angle of the inserts (κr), rad, where the file gives one.
    pub fn cutting_edge_angle(&self) -> Option<f64> {
        self.file.cutting_edge_angle_deg.map(f64::to_radians)
    }

    /// From the tip to the nose of the holder, mm.
    pub fn stick_out(&self) -> f64 {
        self.file.stick_out_mm
    }

    /// From the tip to the gauge line, mm: the length that kinematics and length compensation work with.
    pub fn gauge_length(&self) -> f64 {
        self.file.gauge_length_mm
    }

    /// Every body of the tool, tool frame, for what is to keep off the whole tool, such as the other head of a machine with two:
    /// the cutter as the cylinder around it, its corners filled, and those of [`ToolAssembly::collision_bodies`]. All that a
    /// body is dilated by is clearance.
    pub fn whole(&self) -> Vec<PlacedSolid> {
        let (radius, flute) = (self.cutter.radius(), self.cutter.flute_length());
        let around = RoundFrustum { z_low: 0.0, z_high: flute, radius_low: radius, radius_high: radius, rounding: 0.0 };
        let cutter = PlacedSolid {
            name: format!("cutter of tool {}", self.number()),
            solid: Solid::Frustum(around),
            frame_from_solid: Isometry3::identity(),
        };
        std::iter::once(cutter).chain(self.collision_bodies()).collect()
    }

    /// Every non-cutting body of the assembly, in the tool frame: the sections of the cutter body from the end of the flute, then
    /// those of the holder from its nose.
    pub fn sections(&self) -> Vec<ToolSection> {
        let body = sections("cutter body", &self.file.body, self.file.flute_length_mm);
        let holder = sections("holder", &self.file.holder, self.file.stick_out_mm);
        body.chain(holder).collect()
    }

    /// The [sections](Self::sections) as solids, dilated by their clearance.
    pub fn collision_bodies(&self) -> Vec<PlacedSolid> {
        let placed = |section: ToolSection| PlacedSolid {
            name: section.name,
            solid: Solid::Frustum(section.frustum),
            frame_from_solid: Isometry3::identity(),
        };
        self.sections().into_iter().map(placed).collect()
    }
}

/// A section of a tool's body or holder. There are no bodies of other shapes on a tool: whoever holds them against something has all of
/// it with the frusta.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolSection {
    /// What a finding calls it.
    pub name: String,
    /// About the tool axis, in the tool frame; its rounding is the clearance.
    pub frustum: RoundFrustum,
}

/// The sections of a stack.
fn sections<'a>(name: &'a str, stack: &'a Stack, from: f64) -> impl Iterator<Item = ToolSection> + 'a {
    let mut z = from;
    stack.sections.iter().enumerate().map(move |(k, section)| {
        let z_low = z;
        z += section.length_mm;
        let frustum = RoundFrustum {
            z_low,
            z_high: z,
            radius_low: 0.5 * section.diameter_low_mm,
            radius_high: 0.5 * section.diameter_high_mm,
            rounding: stack.clearance_mm,
        };
        ToolSection { name: format!("{name} section {}", k + 1), frustum }
    })
}

fn check(field: impl Into<String>, value: f64, ok: bool, expected: impl Into<String>) -> Result<(), ToolFileError> {
    // NaN and infinity are in no range, whatever the comparison said.
    if ok && value.is_finite() {
        Ok(())
    } else {
        Err(ToolFileError::OutOfRange { field: field.into(), value, expected: expected.into() })
    }
}

/// Checks a number against the limits of its key, which is the last part of the field's path.
fn check_limits(field: impl Into<String>, value: f64) -> Result<(), ToolFileError> {
    let field = field.into();
    let Some(limit) = KeyLimit::of(&TOOL_LIMITS, &field) else { return Ok(()) };
    check(field, value, limit.contains(value), format!("from {} to {}", limit.least, limit.most))
}

fn check_numbers(file: &ToolFile) -> Result<(), ToolFileError> {
    let limited = [
        ("radius_mm", file.radius_mm),
        ("flute_length_mm", file.flute_length_mm),
        ("max_ramp_angle_deg", file.max_ramp_angle_deg),
        ("number", f64::from(file.number)),
        ("n_inserts", f64::from(file.n_inserts)),
        ("stick_out_mm", file.stick_out_mm),
        ("gauge_length_mm", file.gauge_length_mm),
    ];
    limited.into_iter().try_for_each(|(key, value)| check_limits(key, value))?;
    let core = file.dead_core_radius_mm;
    check("dead_core_radius_mm", core, (0.0..file.radius_mm).contains(&core), "at least 0 and below radius_mm")?;
    if let Some(angle) = file.cutting_edge_angle_deg {
        check("cutting_edge_angle_deg", angle, angle > 0.0 && angle <= 90.0, "an angle above 0 and up to 90 degrees")?;
    }
    let register = file.length_register.unwrap_or(file.number);
    let what = "from 1 to 999 (the tool's number, where the key is missing)";
    check("length_register", f64::from(register), (1..=LAST_REGISTER).contains(&register), what)?;
    let stick_out = file.stick_out_mm;
    check("stick_out_mm", stick_out, stick_out >= file.flute_length_mm, "at least flute_length_mm")?;
    let gauge = file.gauge_length_mm;
    check("gauge_length_mm", gauge, gauge >= stick_out, "at least stick_out_mm")
}

fn check_stack(name: &'static str, stack: &Stack) -> Result<(), ToolFileError> {
    check_limits(format!("{name}.clearance_mm"), stack.clearance_mm)?;
    for (k, s) in stack.sections.iter().enumerate() {
        let limited = [
            ("length_mm", s.length_mm),
            ("diameter_low_mm", s.diameter_low_mm),
            ("diameter_high_mm", s.diameter_high_mm),
        ];
        limited.into_iter().try_for_each(|(key, value)| check_limits(format!("{name}.sections[{k}].{key}"), value))?;
    }
    Ok(())
}

fn check_reach(
    field: &'static str,
    stack: &Stack,
    from_mm: f64,
    needed_mm: f64,
    to: &'static str,
) -> Result<(), ToolFileError> {
    let reaches_mm = from_mm + stack.length_mm();
    if reaches_mm >= needed_mm - GAP {
        return Ok(());
    }
    Err(ToolFileError::Gap { field, reaches_mm, needed_mm, to })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tool_file::{FORMAT, FormatTag};

    const TOOL: &str = r#"{
        "format": "facemill-tool/1", "name": "D160 R6", "number": 7,
        "radius_mm": 80, "corner_radius_mm": 6, "n_inserts": 8, "flute_length_mm": 7,
        "dead_core_radius_mm": 60, "max_ramp_angle_deg": 1.5, "spindle_rotation": "clockwise",
        "stick_out_mm": 63, "gauge_length_mm": 183,
        "body": {"clearance_mm": 0.5, "sections": [{"length_mm": 56, "diameter_low_mm": 158, "diameter_high_mm": 130}]},
        "holder": {"clearance_mm": 2, "sections": [
            {"length_mm": 20, "diameter_low_mm": 89, "diameter_high_mm": 89},
            {"length_mm": 100, "diameter_low_mm": 89, "diameter_high_mm": 128}]}
    }"#;

    fn changed(key: &str, to: &str) -> Result<ToolAssembly, ToolFileError> {
        assert!(TOOL.contains(key), "{key}");
        ToolAssembly::from_json(TOOL.replacen(key, to, 1).as_bytes())
    }

    fn field_of(e: ToolFileError) -> String {
        match e {
            ToolFileError::Format(e) => e.field,
            ToolFileError::Cutter(e) => e.to_string(),
            ToolFileError::OutOfRange { field, .. } => field,
            ToolFileError::Gap { field, .. } => field.to_owned(),
        }
    }

    #[test]
    fn file_survives_writing_and_reading() {
        let tool = ToolAssembly::from_json(TOOL.as_bytes()).unwrap();
        let text = facemill_file_format::to_json(&tool.to_file());
        assert!(text.contains(FORMAT));
        assert_eq!(ToolAssembly::from_json(text.as_bytes()).unwrap(), tool);
        assert_eq!(tool.to_file().format, FormatTag::V1);
        assert!(facemill_file_format::schema::<ToolFile>().contains(FORMAT));
    }

    #[test]
    fn bodies_stand_on_each_other_from_flute_to_gauge_line() {
        let tool = ToolAssembly::from_json(TOOL.as_bytes()).unwrap();
        let mut ends = Vec::new();
        for body in tool.collision_bodies() {
            let Solid::Frustum(f) = body.solid else { panic!("{} is turned", body.name) };
            assert_eq!(body.frame_from_solid, Isometry3::identity());
            ends.push((body.name, f.z_low, f.z_high, f.radius_high, f.rounding));
        }
        let expected = [
            ("cutter body section 1".to_owned(), 7.0, 63.0, 65.0, 0.5),
            ("holder section 1".to_owned(), 63.0, 83.0, 44.5, 2.0),
            ("holder section 2".to_owned(), 83.0, 183.0, 64.0, 2.0),
        ];
        assert_eq!(ends, expected);
    }

    #[test]
    fn faults_name_their_field() {
        let cases = [
            ("\"radius_mm\": 80", "\"radius_mm\": 0", "radius_mm"),
            ("\"corner_radius_mm\": 6", "\"corner_radius_mm\": 81", "corner radius 81 mm"),
            ("\"flute_length_mm\": 7", "\"flute_length_mm\": 5", "flute length 5 mm"),
            ("\"dead_core_radius_mm\": 60", "\"dead_core_radius_mm\": 80", "dead_core_radius_mm"),
            ("\"max_ramp_angle_deg\": 1.5", "\"max_ramp_angle_deg\": -1", "max_ramp_angle_deg"),
            ("\"n_inserts\": 8", "\"n_inserts\": 0", "n_inserts"),
            ("\"stick_out_mm\": 63", "\"stick_out_mm\": 3", "stick_out_mm"),
            ("\"stick_out_mm\": 63", "\"stick_out_mm\": 64", "body"),
            ("\"gauge_length_mm\": 183", "\"gauge_length_mm\": 184", "holder"),
            ("\"gauge_length_mm\": 183", "\"gauge_length_mm\": 60", "gauge_length_mm"),
            ("\"clearance_mm\": 2", "\"clearance_mm\": -2", "holder.clearance_mm"),
            ("\"length_mm\": 100", "\"length_mm\": 0", "holder.sections[1].length_mm"),
            ("\"length_mm\": 100", "\"length_mm\": 1e5", "holder.sections[1].length_mm"),
            ("\"radius_mm\": 80", "\"radius_mm\": 80000", "radius_mm"),
            ("\"diameter_low_mm\": 158", "\"diameter_low_mm\": -158", "body.sections[0].diameter_low_mm"),
            ("\"cloc", "\"clock", "spindle_rotation"),
            ("facemill-tool/1", "facemill-tool/2", "format"),
            ("\"name\"", "\"nmae\"", "nmae"),
        ];
        for (from, to, field) in cases {
            let found = field_of(changed(from, to).unwrap_err());
            assert!(found.contains(field), "{to}: {found}");
        }
        assert!(changed("\"n_inserts\": 8", "\"cutting_edge_angle_deg\": 91, \"n_inserts\": 8").is_err());
    }

    /// Paths of JSON of every number with this key.
    fn places(value: &serde_json::Value, key: &str, at: &str) -> Vec<String> {
        let children: Vec<(String, &serde_json::Value)> = match value {
            serde_json::Value::Object(map) => map.iter().map(|(k, v)| (k.clone(), v)).collect(),
            serde_json::Value::Array(list) => list.iter().enumerate().map(|(k, v)| (k.to_string(), v)).collect(),
            _ => return Vec::new(),
        };
        let of_child = |(name, child): (String, &serde_json::Value)| {
            let here = format!("{at}/{name}");
            let own = (name == key).then(|| here.clone());
            own.into_iter().chain(places(child, key, &here)).collect::<Vec<_>>()
        };
        children.into_iter().flat_map(of_child).collect()
    }

    #[test]
    fn values_beyond_their_limits_are_refused_with_field_and_limits_and_those_within_are_read() {
        let whole: serde_json::Value = serde_json::from_str(TOOL).unwrap();
        for limit in TOOL_LIMITS {
            let found = places(&whole, limit.key, "");
            assert!(!found.is_empty(), "{}", limit.key);
            let is_count = matches!(limit.key, "number" | "n_inserts");
            for place in found {
                let with = |value: f64| {
                    let mut file = whole.clone();
                    let number = if is_count { (value as u64).into() } else { serde_json::json!(value) };
                    *file.pointer_mut(&place).unwrap() = number;
                    ToolAssembly::from_json(file.to_string().as_bytes()).map_err(|e| e.to_string())
                };
                let range = format!("from {} to {}", limit.least, limit.most);
                let away = |value: f64| if is_count { 1.0 } else { (1e-3 * value.abs()).max(1e-9) };
                for outside in [limit.least - away(limit.least), limit.most + away(limit.most), 4e9] {
                    let e = with(outside).unwrap_err();
                    assert!(e.contains(limit.key) && e.contains(&range), "{place} {outside}: {e}");
                }
                // Within, another law may refuse it: a stick-out shorter than the flute.
                for inside in [limit.least, limit.most] {
                    assert!(with(inside).map_or_else(|e| !e.contains(&range), |_| true), "{place} {inside}");
                }
            }
        }
    }

    #[test]
    fn numbers_that_are_no_numbers_are_refused() {
        let good = ToolAssembly::from_json(TOOL.as_bytes()).unwrap().to_file();
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let set: [fn(&mut ToolFile, f64); 8] = [
                |f, v| f.radius_mm = v,
                |f, v| f.corner_radius_mm = v,
                |f, v| f.flute_length_mm = v,
                |f, v| f.dead_core_radius_mm = v,
                |f, v| f.stick_out_mm = v,
                |f, v| f.gauge_length_mm = v,
                |f, v| f.holder.clearance_mm = v,
                |f, v| f.body.sections[0].diameter_high_mm = v,
            ];
            for (k, set) in set.iter().enumerate() {
                let mut file = good.clone();
                set(&mut file, bad);
                assert!(ToolAssembly::new(file).is_err(), "setter {k} with {bad}");
            }
        }
    }
}
