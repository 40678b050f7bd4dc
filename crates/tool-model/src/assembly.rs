//! Tool assemblies: cutter, shank, holder, spindle as solids of revolution.

use facemill_cl_data::{PlacedSolid, RoundFrustum, Solid};
use facemill_file_format::{FormatError, KeyLimit};
use nalgebra::Isometry3;

use crate::cutter::{Cutter, CutterError};
use crate::tool_file::{SpindleRotation, Stack, ToolFile};

/// A whole tool: cutter, cutter body, holder, and what cutting with it needs to know. Tool frame,
/// mm and rad.
///
/// Checked: the cutter body closes the gap between flute and holder, the holder reaches the gauge
/// line.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolAssembly {
    file: ToolFile,
    cutter: Cutter,
}

/// Why bytes are not a tool.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ToolFileError {
    /// The text is not a tool file: not JSON, an unknown or missing key, a value of the wrong kind,
    /// another format.
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
        /// Required value.
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
        /// Part there.
        to: &'static str,
    },
}

/// Sections written in tenths may miss their sum by rounding; a gap of this size (mm) hides nothing
/// that could collide.
const GAP: f64 = 1e-6;

/// Limits of the keys that have some of their own.
///
/// Lengths: no spindle carries a tool of ten metres, and below 10 µm nothing is turned. A body or
/// holder without a diameter would collide with nothing. T words have eight digits; the largest
/// face mills have about a hundred inserts.
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

    /// The tool with a cutter of another radius: its body and dead core in proportion, its corner
    /// no larger than fits.
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

    /// The tool sticking out of its holder farther: the topmost section of its body longer by as
    /// much.
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

    /// Returns the name of the tool in reports and in the NC program.
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

    /// Radius about the axis within which the bottom does not cut, mm; 0 for a cutter that cuts to
    /// its centre.
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

    /// From the tip to the nose of the holder, mm.
    pub fn stick_out(&self) -> f64 {
        self.file.stick_out_mm
    }

    /// From the tip to the gauge line, mm: the length that kinematics and length compensation work
    /// with.
    pub fn gauge_length(&self) -> f64 {
        self.file.gauge_length_mm
    }

    /// Every body of the tool, tool frame, for what is to keep off the whole tool, such as the
    /// other head of a machine with two: the cutter as the cylinder around it, its corners filled,
    /// and those of [`ToolAssembly::collision_bodies`]. All that a body is dilated by is clearance.
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

    /// Every non-cutting body of the assembly, in the tool frame: the sections of the cutter body
    /// from the end of the flute, then those of the holder from its nose.
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

/// A section of a tool's body or holder. There are no bodies of other shapes on a tool: whoever
/// holds them against something has all of it with the frusta.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolSection {
    /// Name in findings.
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
#[path = "../tests/unit/assembly.rs"]
mod tests;
