//! One milling tool of a library as a tool file.
//!
//! A library describes the shape of cutter, shaft and holder. It does not say where the cutter does
//! not cut, how steeply it may enter, and which distance it keeps: these values are assumed, and
//! listed in the tool file.

use facemill_tool_model::{FormatTag, Section, SpindleRotation, Stack, ToolAssembly, ToolFile};

use crate::fault::ToolFault;
use crate::fields::{Fields, LEAST_DIAMETER_MM, LengthUnit, ROUNDING, rounded};
use crate::holder::holder;
use crate::presets::{CuttingPreset, presets};
use crate::profile::{cylinder, enclosing, segments};
use crate::remarks::ToolRemarks;

/// Kinds of cutters that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CutterKind {
    /// Face mill: r from its inserts.
    FaceMill,
    /// Bull-nose end mill.
    BullNose,
    /// Ball end mill: r = R.
    Ball,
    /// Flat end mill: r = 0.
    Flat,
}

impl CutterKind {
    /// Returns the kind with this name in a library.
    pub(crate) fn of(name: &str) -> Option<Self> {
        Some(match name {
            "face mill" => Self::FaceMill,
            "bull nose end mill" => Self::BullNose,
            "ball end mill" => Self::Ball,
            "flat end mill" => Self::Flat,
            _ => return None,
        })
    }
}

/// Clearances, mm, as of the tools of the examples: a body that runs close to the cutter's own
/// radius must not collide with every wall that the cutter leaves.
const BODY_CLEARANCE: f64 = 1.0;
const HOLDER_CLEARANCE: f64 = 2.0;

/// Steepest ramp, deg. Face mills with round inserts permit some degrees, those with square ones
/// about one.
const RAMP: f64 = 1.0;

/// Deepest recess of the dead core, mm. It follows from core and ramp, and stock in it is no fault:
/// a core taken too wide must not make it deeper than that of any inserted cutter.
const RECESS: f64 = 0.5;

/// Share of R for the dead core of a cutter with sharp corners: a tool file has it below R.
const WHOLE_FLAT: f64 = 0.99;

/// Width, mm, of the ring around the dead core below which verification cannot tell a cut from a
/// plunge: it removes stock in steps of this length.
const NARROW_RING: f64 = 0.5;

/// A tool with all that is to be reported of it.
pub(crate) struct ReadTool {
    pub(crate) file: ToolFile,
    pub(crate) notes: Vec<String>,
    pub(crate) presets: Vec<CuttingPreset>,
}

/// Measures of the cutting part, mm.
struct CutterMeasures {
    radius: f64,
    corner_radius: f64,
    flute: f64,
    stick_out: f64,
}

/// Reads a tool of this kind.
///
/// # Errors
/// All faults that were found, each with its key.
pub(crate) fn read_tool(tool: &Fields<'_>, kind: CutterKind, name: &str) -> Result<ReadTool, Vec<ToolFault>> {
    let mut remarks = ToolRemarks::default();
    let Some(unit) = tool.unit(&mut remarks) else {
        if remarks.faults.is_empty() {
            let fault = "is missing, and so is expressions.tool_unit; the file must say millimeters or inches";
            remarks.faults.push(ToolFault::new("unit", fault));
        }
        return Err(remarks.faults);
    };
    let geometry = tool.part("geometry", &mut remarks.faults);
    if geometry.is_missing() && remarks.faults.is_empty() {
        remarks.faults.push(ToolFault::new("geometry", "is missing; export the library in Fusion"));
    }
    let (number, length_register) = numbers(tool, &mut remarks);
    let cutter = cutter_measures(tool, &geometry, kind, unit, &mut remarks);
    let n_inserts = geometry.count("NOF", 500, &mut remarks.faults);
    if n_inserts.is_none() && !remarks.has_fault_at("geometry.NOF") {
        remarks.fault("geometry.NOF", "is missing; enter the number of flutes in Fusion");
    }
    tool.compare_number("tool_numberOfFlutes", ("geometry.NOF", n_inserts.map(f64::from)), "", &mut remarks);
    let presets = presets(tool, unit, n_inserts, &mut remarks.faults);
    let body = cutter.as_ref().map(|cutter| body(tool, &geometry, unit, cutter, &mut remarks));
    let holder = holder(tool, &geometry, unit, cutter.as_ref().map(|c| c.stick_out), &mut remarks);
    let (Some(number), Some(cutter), Some(n_inserts), Some(body), Some((holder, holder_gauge))) =
        (number, cutter, n_inserts, body, holder)
    else {
        return Err(remarks.faults);
    };
    let spindle_rotation = spindle_rotation(&geometry, &mut remarks);
    let dead_core_radius_mm = dead_core(&cutter, kind, &mut remarks);
    let max_ramp_angle_deg = max_ramp_angle(dead_core_radius_mm, &presets, &mut remarks);
    remarks.assume("body.clearance_mm", format!("a usual one, {BODY_CLEARANCE} mm; the library has none"));
    remarks.assume("holder.clearance_mm", format!("a usual one, {HOLDER_CLEARANCE} mm; the library has none"));
    if kind == CutterKind::FaceMill {
        let note = "the cutting edge angle of the inserts is not in the library: cutting_edge_angle_deg is left out";
        remarks.notes.push(note.to_owned());
    }
    let file = ToolFile {
        format: FormatTag::V1,
        name: if name.is_empty() { format!("tool {number}") } else { name.to_owned() },
        number,
        length_register,
        radius_mm: cutter.radius,
        corner_radius_mm: cutter.corner_radius,
        n_inserts,
        flute_length_mm: cutter.flute,
        dead_core_radius_mm,
        max_ramp_angle_deg,
        spindle_rotation,
        cutting_edge_angle_deg: None,
        stick_out_mm: cutter.stick_out,
        gauge_length_mm: rounded(cutter.stick_out + holder_gauge),
        body: Stack { clearance_mm: BODY_CLEARANCE, sections: body },
        holder: Stack { clearance_mm: HOLDER_CLEARANCE, sections: holder },
        assumed: remarks.assumed,
    };
    // Catches values that a tool file does not permit and that no check above names.
    if remarks.faults.is_empty()
        && let Err(fault) = ToolAssembly::new(file.clone())
    {
        remarks.faults.push(ToolFault::new("geometry", format!("makes no tool: {fault}")));
    }
    if remarks.faults.is_empty() { Ok(ReadTool { file, notes: remarks.notes, presets }) } else { Err(remarks.faults) }
}

/// Number in the magazine, and the register of the length where it is another one.
fn numbers(tool: &Fields<'_>, remarks: &mut ToolRemarks) -> (Option<u32>, Option<u32>) {
    let post = tool.part("post-process", &mut remarks.faults);
    let before = remarks.faults.len();
    let number = post.count("number", 99_999_999, &mut remarks.faults);
    if number.is_none() && remarks.faults.len() == before {
        remarks.fault("post-process.number", "is missing; give the tool its number in the magazine in Fusion");
    }
    tool.compare_number("tool_number", ("post-process.number", number.map(f64::from)), "", remarks);
    // Controls have no register 0.
    let is_zero = post.number("length-offset", &mut Vec::new()) == Some(0.0);
    let register = if is_zero { None } else { post.count("length-offset", 999, &mut remarks.faults) };
    let register = register.filter(|register| Some(*register) != number);
    if register.is_none() && number.is_some_and(|number| number > 999) && remarks.faults.len() == before {
        let fault = "is missing or the tool's number, which is above 999; controls have length registers 1 to 999";
        remarks.faults.push(ToolFault::new("post-process.length-offset", fault));
    }
    let diameter_offset = post.number("diameter-offset", &mut Vec::new());
    if let Some(other) = diameter_offset.filter(|other| *other != 0.0 && Some(*other) != number.map(f64::from)) {
        let note = format!("the diameter offset {other} has no place in a tool file: programs have no radius offset");
        remarks.notes.push(note);
    }
    (number, register)
}

fn cutter_measures(
    tool: &Fields<'_>,
    geometry: &Fields<'_>,
    kind: CutterKind,
    unit: LengthUnit,
    remarks: &mut ToolRemarks,
) -> Option<CutterMeasures> {
    let faults = &mut remarks.faults;
    let diameter = geometry.needed_length("DC", unit, 2.0 * LEAST_DIAMETER_MM, "diameter", faults);
    let flute = geometry.needed_length("LCF", unit, LEAST_DIAMETER_MM, "flute length", faults);
    let stick_out = geometry.needed_length("LB", unit, LEAST_DIAMETER_MM, "length below the holder", faults);
    let overall = geometry.length("OAL", unit, 0.0, faults);
    let largest = geometry.length("DCX", unit, 0.0, faults).filter(|largest| *largest > 0.0);
    for (expression, key, value) in [
        ("tool_diameter", "geometry.DC", diameter),
        ("tool_fluteLength", "geometry.LCF", flute),
        ("tool_bodyLength", "geometry.LB", stick_out),
        ("tool_overallLength", "geometry.OAL", overall),
        ("tool_maximumCuttingDiameter", "geometry.DCX", largest),
    ] {
        tool.compare_length(expression, (key, value), unit, remarks);
    }
    if let Some((largest, diameter)) =
        largest.zip(diameter).filter(|(largest, diameter)| *largest > diameter + ROUNDING)
    {
        let fault = format!(
            "is {largest} mm, more than the diameter {diameter} mm: the cutter widens above its bottom, and a tool file \
             has only cutters with a straight side; write the tool file by hand"
        );
        remarks.fault("geometry.DCX", fault);
    }
    let radius = diameter.map(|diameter| 0.5 * diameter);
    let corner_radius = corner_radius(tool, geometry, kind, unit, radius, remarks);
    taper(tool, geometry, kind, remarks);
    let (radius, flute, stick_out, corner_radius) = (radius?, flute?, stick_out?, corner_radius?);
    // A ball whose flute is given a little shorter than its radius by rounding.
    let flute = if flute < corner_radius && corner_radius - flute <= ROUNDING { corner_radius } else { flute };
    let faults = &mut remarks.faults;
    if flute < corner_radius {
        let fault = format!("is {flute} mm, shorter than the corner radius {corner_radius} mm; enter the flute length");
        faults.push(ToolFault::new("geometry.LCF", fault));
    }
    if stick_out < flute {
        let fault =
            format!("is {stick_out} mm, shorter than the flute length {flute} mm; enter the length below the holder");
        faults.push(ToolFault::new("geometry.LB", fault));
    }
    if let Some(overall) = overall.filter(|overall| *overall + ROUNDING < stick_out) {
        let note = format!("the overall length {overall} mm is less than the length below the holder, {stick_out} mm");
        remarks.notes.push(note);
    }
    Some(CutterMeasures { radius, corner_radius, flute, stick_out })
}

/// Corner radius of a kind. A flat or ball end mill that has another radius describes two cutters.
fn corner_radius(
    tool: &Fields<'_>,
    geometry: &Fields<'_>,
    kind: CutterKind,
    unit: LengthUnit,
    radius: Option<f64>,
    remarks: &mut ToolRemarks,
) -> Option<f64> {
    let faults = &mut remarks.faults;
    let needed = matches!(kind, CutterKind::FaceMill | CutterKind::BullNose);
    let given = if needed {
        geometry.needed_length("RE", unit, 0.0, "corner radius (0 for sharp corners)", faults)
    } else {
        geometry.length("RE", unit, 0.0, faults)
    };
    let key = "geometry.RE";
    // A ball needs no radius of its own, and may have 0.
    let compared = if kind == CutterKind::Ball { given.filter(|corner| *corner > 0.0).or(radius) } else { given };
    tool.compare_length("tool_cornerRadius", (key, compared), unit, remarks);
    let radius = radius?;
    match kind {
        CutterKind::FaceMill | CutterKind::BullNose => {
            let corner = given?;
            if corner <= radius {
                return Some(corner);
            }
            if corner - radius <= ROUNDING {
                return Some(radius);
            }
            let fault = format!("is {corner} mm, more than the cutter's radius {radius} mm; correct one of them");
            remarks.fault(key, fault);
        }
        CutterKind::Ball => {
            if given.is_none_or(|corner| corner == 0.0 || (corner - radius).abs() <= ROUNDING) {
                return Some(radius);
            }
            let fault = format!(
                "is {} mm, but a ball of this diameter has {radius} mm; correct the radius or the type",
                given.unwrap_or_default()
            );
            remarks.fault(key, fault);
        }
        CutterKind::Flat => {
            let Some(corner) = given.filter(|corner| *corner > 0.0) else { return Some(0.0) };
            let fault = format!(
                "is {corner} mm, but a flat end mill has sharp corners; make it a bull nose end mill or enter 0"
            );
            remarks.fault(key, fault);
        }
    }
    None
}

/// A side that leans is no side of a cutter here. Only face mills have the angle; others may keep
/// one from a type that they had before.
fn taper(tool: &Fields<'_>, geometry: &Fields<'_>, kind: CutterKind, remarks: &mut ToolRemarks) {
    let angle = geometry.number("TA", &mut remarks.faults).unwrap_or(0.0);
    if kind != CutterKind::FaceMill {
        if angle != 0.0 {
            remarks.note(format!("geometry.TA is {angle}, but this type has no taper angle; ignored"));
        }
        return;
    }
    tool.compare_number("tool_taperAngle", ("geometry.TA", Some(angle)), "deg", remarks);
    if angle != 0.0 {
        let fault = format!(
            "is {angle}: the side leans, and a tool file has only cutters with a straight side; write the tool file by hand"
        );
        remarks.fault("geometry.TA", fault);
    }
}

/// Body from the end of the flute to the nose of the holder.
///
/// Fusion draws the segments of a shaft from the end of the flute on, or, with a shoulder above
/// the flute, from the end of the shoulder on. The body encloses both.
fn body(
    tool: &Fields<'_>,
    geometry: &Fields<'_>,
    unit: LengthUnit,
    cutter: &CutterMeasures,
    remarks: &mut ToolRemarks,
) -> Vec<Section> {
    let faults = &mut remarks.faults;
    let diameter = 2.0 * cutter.radius;
    let shoulder_length = geometry.length("shoulder-length", unit, 0.0, faults);
    let neck = geometry.length("shoulder-diameter", unit, 0.0, faults).filter(|neck| *neck >= LEAST_DIAMETER_MM);
    let shank = geometry.length("SFDM", unit, 0.0, faults).filter(|shank| *shank >= LEAST_DIAMETER_MM);
    for (expression, key, value) in [
        ("tool_shoulderLength", "geometry.shoulder-length", shoulder_length),
        ("tool_shoulderDiameter", "geometry.shoulder-diameter", neck),
        ("tool_shaftDiameter", "geometry.SFDM", shank),
    ] {
        tool.compare_length(expression, (key, value), unit, remarks);
    }
    let shoulder = shoulder_length.map_or(0.0, |length| length - cutter.flute).max(0.0);
    let shaft = segments(&tool.part("shaft", &mut remarks.faults), unit, &mut remarks.faults);
    let length = (cutter.stick_out - cutter.flute).max(0.0);
    if shoulder > 0.0 && neck.is_none() && length > 0.0 {
        remarks.assume("body.sections", "the shoulder has the cutter's diameter; the library has no shoulder-diameter");
    }
    let covered: f64 = shaft.iter().map(|s| s.length_mm).sum();
    if shank.is_none() && covered + ROUNDING < length && !remarks.has_fault_at("geometry.SFDM") {
        let fault = "is missing, and no segments of the shaft reach from the flute to the holder; enter the shaft \
                     diameter in Fusion";
        remarks.fault("geometry.SFDM", fault);
    }
    // Without a shank the segments end at the holder, up to rounding, and the last one goes on.
    let last = shaft.last().map_or(diameter, |section| section.diameter_high_mm);
    let rest = cylinder(length, shank.unwrap_or(last));
    let from_flute: Vec<Section> = shaft.iter().copied().chain([rest]).collect();
    let mut stacks = vec![from_flute.clone()];
    if shoulder > 0.0 {
        let shouldered = [cylinder(shoulder, neck.unwrap_or(diameter))].into_iter().chain(from_flute).collect();
        // Without segments the shaft begins where the shoulder ends, and nowhere else.
        if shaft.is_empty() { stacks = vec![shouldered] } else { stacks.push(shouldered) }
    }
    enclosing(&stacks, length)
}

fn spindle_rotation(geometry: &Fields<'_>, remarks: &mut ToolRemarks) -> SpindleRotation {
    match geometry.truth("HAND", &mut remarks.faults) {
        Some(false) => SpindleRotation::Counterclockwise,
        Some(true) => SpindleRotation::Clockwise,
        None => {
            remarks.assume("spindle_rotation", "a right-hand cutter; the library has no HAND");
            SpindleRotation::Clockwise
        }
    }
}

/// Dead core: the whole flat bottom, since a library does not say how far in the teeth reach. A
/// ball has no flat; its teeth meet at the tip.
fn dead_core(cutter: &CutterMeasures, kind: CutterKind, remarks: &mut ToolRemarks) -> f64 {
    let flat = rounded(cutter.radius - cutter.corner_radius).min(WHOLE_FLAT * cutter.radius);
    let reason = if kind == CutterKind::Ball {
        "a ball cuts to its centre"
    } else {
        "the whole flat bottom does not cut; the library does not say how far in the teeth reach"
    };
    remarks.assume("dead_core_radius_mm", reason);
    let ring = cutter.radius - flat;
    if flat > 0.0 && ring < NARROW_RING {
        let note = format!(
            "the assumed dead core leaves a cutting ring of {ring:.2} mm, and verification will reject ordinary cuts \
             (dead_core); give dead_core_radius_mm from the maker's data"
        );
        remarks.note(note);
    }
    rounded(flat.max(0.0))
}

/// Steepest ramp, deg: a small one, with which the recess of the dead core stays shallow, or what
/// the flattest preset permits if that is less.
fn max_ramp_angle(dead_core: f64, presets: &[CuttingPreset], remarks: &mut ToolRemarks) -> f64 {
    // On a ramp of angle a the core's trailing edge is 2 c tan a deeper than its leading one.
    let shallow = (0.5 * RECESS).atan2(dead_core).to_degrees();
    let small = RAMP.min((shallow * 100.0).floor() / 100.0);
    let flattest = presets.iter().filter_map(|preset| preset.ramp_deg).fold(small, f64::min);
    let reason = if flattest < small {
        "the smallest ramp angle of the presets; the library has no limit of the cutter".to_owned()
    } else {
        format!("a small one, {small} deg; the library has no limit of the cutter")
    };
    remarks.assume("max_ramp_angle_deg", reason);
    flattest
}
