//! Machine files from kinematics of other programs.

pub(crate) mod family;
pub(crate) mod joint_lines;
pub(crate) mod value;

pub use crate::import::family::{Family, Nutation, RotaryRole};
pub use crate::import::joint_lines::JointLine;
pub use crate::machine_file::axis_lines::{AxisLine, rows_from_axes};

use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};

use crate::axes::axis::Carrier;
use crate::import::value::{Unit as UnitOf, direction, number, numbers};
use crate::machine_file::assumed::{AssumedFile, AssumedValue};
use crate::machine_file::{
    ControlToleranceFile, CuttingLawFile, FeedFile, Joint, MachineFile, MachineFormat, MotionFile, PrismaticJoint,
    RapidLawFile, RevoluteJoint, RevoluteRange, Sense, ToolChain, WorkpieceChain,
};

/// Reason why a file of another program cannot be turned into a machine file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The text is not XML.
    #[error("is no XML: {0}")]
    Xml(String),
    /// A part is missing or wrong, or has an unknown meaning.
    #[error("line {line}, {element}: {problem}")]
    Element {
        /// Line of the element, from 1.
        line: u32,
        /// The element, such as `<axis id="U">`.
        element: String,
        /// Its fault, and the remedy.
        problem: String,
    },
}

/// Typical values, of a machining centre of medium size, for data that machine files of others
/// lack.
mod typical {
    /// Linear axes: mm/min, mm/s², mm/s³.
    pub(super) const LINEAR: [f64; 3] = [30_000.0, 3_000.0, 30_000.0];
    /// Rotary axes: deg/min, deg/s², deg/s³.
    pub(super) const ROTARY: [f64; 3] = [7_200.0, 500.0, 5_000.0];
    /// Feeds, mm/min.
    pub(super) const FEED: [f64; 2] = [1.0, 24_000.0];
    /// Control tolerance: mm, deg.
    pub(super) const TOLERANCE: [f64; 2] = [0.01, 0.005];
}

/// One `<axis>` in our units.
struct ImportedAxis {
    letter: &'static str,
    is_linear: bool,
    carrier: Carrier,
    line: AxisLine,
    has_velocity: bool,
}

/// Reads the file of an Autodesk machine (`.machine`, XML of the namespace `…/xml/2009/machine`).
///
/// It takes order, axis vectors, offsets, ranges, home positions, feeds, table and tool attach
/// points and the spindle's direction; lengths are rounded to 1e-5 mm, which removes the noise of
/// the CAD models they come from. Accelerations, jerks, motion laws and other missing data become
/// typical values, listed in `assumed`. There are no bodies: such files keep them elsewhere.
/// Conventions, as read from the files: docs/machines.md.
///
/// # Errors
/// With line and element where data is missing, has no meaning, or an unknown one.
pub fn import_autodesk_machine(text: &str) -> Result<MachineFile, ImportError> {
    let document = Document::parse(text).map_err(|e| ImportError::Xml(e.to_string()))?;
    let root = document.root_element();
    if root.tag_name().name() != "machine" {
        return Err(wrong(&root, "is not <machine>: this is no Autodesk machine file"));
    }
    let axes: Vec<ImportedAxis> = children(&root, "axis").map(|node| read_axis(&node)).collect::<Result<_, _>>()?;
    refuse_orders(&root, &axes)?;
    let (bed_from_table, bed_from_nose) = ends(&root)?;
    let of = |carrier| axes.iter().filter(move |a: &&ImportedAxis| a.carrier == carrier);
    let table: Vec<AxisLine> = of(Carrier::Table).map(|a| a.line.clone()).collect();
    // Such files list rotary axes of a head from the tool to the bed, everything else from the bed
    // outward.
    let mut head: Vec<AxisLine> = of(Carrier::Head).filter(|a| a.is_linear).map(|a| a.line.clone()).collect();
    let rotary: Vec<&ImportedAxis> = of(Carrier::Head).filter(|a| !a.is_linear).collect();
    head.extend(rotary.iter().rev().map(|a| a.line.clone()));
    let (feed, feed_is_known) = feed(&root)?;
    Ok(MachineFile {
        format: MachineFormat::V1,
        name: name(&root),
        source: Some(source(&root)),
        assumed: assumed(&axes, feed_is_known),
        workpiece_chain: WorkpieceChain { rows: rows_from_axes(&table, &bed_from_table), lines: None },
        tool_chains: vec![ToolChain {
            channel: 1,
            tool_interface: None,
            rows: rows_from_axes(&head, &bed_from_nose),
            lines: None,
        }],
        bed_bodies: Vec::new(),
        motion: MotionFile {
            cutting: CuttingLawFile::AxesLinear,
            rapid: RapidLawFile::Linear,
            control_tolerance: ControlToleranceFile {
                path_mm: typical::TOLERANCE[0],
                orientation_deg: typical::TOLERANCE[1],
            },
        },
        feed,
        tool_change_s: None,
    })
}

fn children<'a, 'd>(node: &Node<'a, 'd>, name: &'static str) -> impl Iterator<Item = Node<'a, 'd>> {
    node.children().filter(move |n| n.tag_name().name() == name)
}

/// Returns an error about an element.
pub(crate) fn wrong(node: &Node<'_, '_>, problem: impl Into<String>) -> ImportError {
    let line = node.document().text_pos_at(node.range().start).row;
    let id = node.attribute("id").map(|id| format!(" id=\"{id}\"")).unwrap_or_default();
    ImportError::Element { line, element: format!("<{}{id}>", node.tag_name().name()), problem: problem.into() }
}

fn required<'a>(node: &Node<'a, '_>, attribute: &str) -> Result<&'a str, ImportError> {
    node.attribute(attribute).ok_or_else(|| wrong(node, format!("has no attribute `{attribute}`")))
}

fn read_axis(node: &Node<'_, '_>) -> Result<ImportedAxis, ImportError> {
    let one_of = |attribute: &str, known: &[&'static str]| {
        let text = required(node, attribute)?;
        let position = known.iter().position(|k| *k == text);
        let message = || format!("`{attribute}` is \"{text}\", known are {}", known.join(", "));
        position.ok_or_else(|| wrong(node, message()))
    };
    let is_linear = one_of("actuator", &["linear", "rotational"])? == 0;
    let coordinate = one_of("coordinate", &["X", "Y", "Z"])?;
    let carrier = [Carrier::Head, Carrier::Table][one_of("link", &["head", "table"])?];
    if node.attribute("control").is_some_and(|c| c != "driven") {
        return Err(wrong(node, "is not driven (`control`): an axis moved by hand cannot be planned; take it out"));
    }
    let offset = numbers(node, "offset", UnitOf::Length)?;
    let offset = Vector3::from(offset).map(|v| (v * 1e5).round() / 1e5 + 0.0);
    let mut unit = Vector3::zeros();
    unit[coordinate] = 1.0;
    if is_linear {
        if node.attribute("axis").is_some() || offset != Vector3::zeros() {
            return Err(wrong(node, "is linear with a vector or an offset: what they mean is not known here"));
        }
        let (joint, has_velocity) = prismatic(node, ["X", "Y", "Z"][coordinate], carrier)?;
        let line = AxisLine { joint, direction: Unit::new_unchecked(unit), point: Point3::origin(), bodies: vec![] };
        return Ok(ImportedAxis { letter: ["X", "Y", "Z"][coordinate], is_linear, carrier, line, has_velocity });
    }
    let vector = direction(node, "axis")?;
    let (joint, has_velocity) = revolute(node, ["A", "B", "C"][coordinate], carrier)?;
    // The carried part turns left-handed about the vector: a table's row looks along it and is
    // negative, a head's against.
    let direction = if carrier == Carrier::Table { vector } else { -vector };
    let line = AxisLine { joint, direction, point: Point3::from(offset), bodies: vec![] };
    Ok(ImportedAxis { letter: ["A", "B", "C"][coordinate], is_linear, carrier, line, has_velocity })
}

/// Returns the sense of an axis: by ISO 841, letters describe the motion of the tool relative to
/// the workpiece, so a table moves against them.
fn sense(carrier: Carrier) -> Sense {
    if carrier == Carrier::Table { Sense::Negative } else { Sense::Positive }
}

/// Returns the rapid speed, else the largest feed, else none: such files write 0 for values that
/// were not filled in.
fn velocity(node: &Node<'_, '_>, unit: UnitOf) -> Result<Option<f64>, ImportError> {
    for attribute in ["rapidFeed", "maximumFeed"] {
        if let Some(text) = node.attribute(attribute) {
            let value = number(node, attribute, text, unit)?;
            if value < 0.0 {
                return Err(wrong(node, format!("`{attribute}` is below 0")));
            }
            if value > 0.0 {
                return Ok(Some(value));
            }
        }
    }
    Ok(None)
}

/// Returns travel and home position, the home inside the travel; `None` without a range.
fn travel(node: &Node<'_, '_>, unit: UnitOf) -> Result<(Option<[f64; 2]>, f64), ImportError> {
    let home = node.attribute("homePosition").map_or(Ok(0.0), |text| number(node, "homePosition", text, unit))?;
    if node.attribute("range").is_none() {
        return Ok((None, home));
    }
    let [min, max] = numbers(node, "range", unit)?;
    if max < min {
        return Err(wrong(node, format!("`range` ends at {max}, below its beginning {min}")));
    }
    if !(min..=max).contains(&home) {
        return Err(wrong(node, format!("`homePosition` {home} is outside the range {min} to {max}")));
    }
    Ok((Some([min, max]), home))
}

fn prismatic(node: &Node<'_, '_>, letter: &str, carrier: Carrier) -> Result<(Joint, bool), ImportError> {
    let (range, home_mm) = travel(node, UnitOf::Length)?;
    let [min_mm, max_mm] =
        range.ok_or_else(|| wrong(node, "has no attribute `range`: a linear axis ends somewhere"))?;
    let velocity = velocity(node, UnitOf::LengthPerMinute)?;
    let joint = PrismaticJoint {
        axis: letter.to_owned(),
        sense: sense(carrier),
        min_mm,
        max_mm,
        home_mm,
        max_velocity_mm_min: velocity.unwrap_or(typical::LINEAR[0]),
        max_acceleration_mm_s2: Some(typical::LINEAR[1]),
        max_jerk_mm_s3: Some(typical::LINEAR[2]),
    };
    Ok((Joint::Prismatic(joint), velocity.is_some()))
}

fn revolute(node: &Node<'_, '_>, letter: &str, carrier: Carrier) -> Result<(Joint, bool), ImportError> {
    let (range, home_deg) = travel(node, UnitOf::Angle)?;
    let velocity = velocity(node, UnitOf::AnglePerMinute)?;
    let joint = RevoluteJoint {
        axis: letter.to_owned(),
        sense: sense(carrier),
        range: range.map_or(RevoluteRange::Endless, |[min_deg, max_deg]| RevoluteRange::Limited { min_deg, max_deg }),
        rollover: None,
        max_wind_up_turns: None,
        home_deg,
        max_velocity_deg_min: velocity.unwrap_or(typical::ROTARY[0]),
        max_acceleration_deg_s2: Some(typical::ROTARY[1]),
        max_jerk_deg_s3: Some(typical::ROTARY[2]),
    };
    Ok((Joint::Revolute(joint), velocity.is_some()))
}

/// Refuses a linear axis listed behind a rotary one of its side: it would be ambiguous which
/// carries which.
fn refuse_orders(root: &Node<'_, '_>, axes: &[ImportedAxis]) -> Result<(), ImportError> {
    let nodes: Vec<Node<'_, '_>> = children(root, "axis").collect();
    if axes.is_empty() {
        return Err(wrong(root, "has no <axis>"));
    }
    for (k, axis) in axes.iter().enumerate() {
        if axes[..k].iter().any(|a| a.letter == axis.letter) {
            return Err(wrong(&nodes[k], format!("is a second axis {}", axis.letter)));
        }
        let behind = axes[..k].iter().find(|a| a.carrier == axis.carrier && !a.is_linear);
        if let (true, Some(rotary)) = (axis.is_linear, behind) {
            let problem = format!(
                "is a linear axis behind the rotary axis {} of its side: which of them carries the other is not known; \
                 write the machine file by hand",
                rotary.letter
            );
            return Err(wrong(&nodes[k], problem));
        }
    }
    Ok(())
}

/// Returns the poses of table and spindle nose with all axes at 0.
fn ends(root: &Node<'_, '_>) -> Result<(Isometry3<f64>, Isometry3<f64>), ImportError> {
    let child = |name: &'static str| {
        children(root, name)
            .next()
            .ok_or_else(|| wrong(root, format!("has no <{name}>, which says where the chains end")))
    };
    let (simulation, spindle) = (child("simulation")?, child("spindle")?);
    let point = |attribute| {
        let place = numbers::<3>(&simulation, attribute, UnitOf::Length)?;
        Ok::<_, ImportError>(Translation3::from(Vector3::from(place).map(|v| (v * 1e5).round() / 1e5 + 0.0)))
    };
    let z = direction(&spindle, "axis")?;
    let half_turn = || UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &z).unwrap_or_else(half_turn);
    Ok((Isometry3::from(point("tableAttachPoint")?), point("toolAttachPoint")? * turn))
}

fn feed(root: &Node<'_, '_>) -> Result<(FeedFile, bool), ImportError> {
    let [min_mm_min, max] = typical::FEED;
    let given = match children(root, "capabilities").next() {
        Some(node) => match node.attribute("maximumFeedrate") {
            Some(text) => number(&node, "maximumFeedrate", text, UnitOf::LengthPerMinute)?,
            None => 0.0,
        },
        None => 0.0,
    };
    let known = given >= min_mm_min;
    Ok((FeedFile { min_mm_min, max_mm_min: if known { given } else { max }, rapid_mm_min: None }, known))
}

fn text_of<'a>(root: &Node<'a, '_>, name: &'static str) -> Option<&'a str> {
    children(root, name).find_map(|n| n.text()).map(str::trim).filter(|t| !t.is_empty())
}

fn name(root: &Node<'_, '_>) -> String {
    let name = [text_of(root, "vendor"), text_of(root, "model")].into_iter().flatten().collect::<Vec<_>>().join(" ");
    if name.is_empty() { "imported machine".to_owned() } else { name }
}

fn source(root: &Node<'_, '_>) -> String {
    let description = text_of(root, "description").map(|d| format!(": {d}")).unwrap_or_default();
    format!("Autodesk machine file{description}")
}

fn assumed(axes: &[ImportedAxis], feed_is_known: bool) -> Vec<AssumedFile> {
    let whole = |value| AssumedFile { value, axes: Vec::new() };
    let slow: Vec<String> = axes.iter().filter(|a| !a.has_velocity).map(|a| a.letter.to_owned()).collect();
    let mut all = Vec::new();
    if !slow.is_empty() {
        all.push(AssumedFile { value: AssumedValue::MaxVelocity, axes: slow });
    }
    all.extend([AssumedValue::MaxAcceleration, AssumedValue::MaxJerk, AssumedValue::Motion].map(whole));
    if !feed_is_known {
        all.push(whole(AssumedValue::Feed));
    }
    all
}
