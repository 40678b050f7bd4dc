//! Blocks that name the tool's axis as a vector: where the control turns the rotary axes to.

use facemill_cl_data::ClPoint;
use facemill_inverse_kinematics::{AxisValues, Machine, UnclearChoice};
use facemill_nc_program::AxisLetter;
use facemill_nc_program::read::ToolVectors;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::finding::FindingKind;

/// Why it is not known where a vector turns the axes to.
pub(crate) enum Unturned {
    /// The action of the control is unknown.
    Unclear(UnclearChoice),
    /// The vector has no length.
    NoLength,
    /// The block names this rotary axis, too.
    AxisToo(AxisLetter),
}

impl Unturned {
    /// Returns it as a finding.
    pub(crate) fn finding(&self) -> (FindingKind, Option<AxisLetter>, String) {
        let letter = |text: &str| text.parse().ok();
        match self {
            Self::Unclear(UnclearChoice::Unreachable(why)) => {
                (FindingKind::ReachFailure, None, format!("no axes turn the tool to its vector: {why}"))
            }
            Self::Unclear(why) => {
                let axis = match why {
                    UnclearChoice::Pole { axis, .. } | UnclearChoice::BeyondLimit { axis, .. } => letter(axis.as_str()),
                    _ => None,
                };
                let note = format!("where the control turns the axes to for the tool vector is not known: {why}");
                (FindingKind::UnknownPosition, axis, note)
            }
            Self::NoLength => (FindingKind::UnknownPosition, None, "the tool vector has no length".to_owned()),
            Self::AxisToo(axis) => {
                let note =
                    "is in a block with a tool vector: which of the two the control takes is not known".to_owned();
                (FindingKind::UnknownPosition, Some(*axis), note)
            }
        }
    }
}

/// By how much the length of a unit vector may differ from 1: three decimals, more than any
/// rounding of programs.
const SAME_LENGTH: f64 = 1e-3;

/// Which vectors of a block are none of length 1 within 0.001, in words. Heidenhain controls take
/// them as they stand; others bring them to length 1 themselves.
pub fn not_unit(tool: &ToolVectors) -> impl Iterator<Item = &'static str> {
    let is_unit = |v: [f64; 3]| (Vector3::from(v).norm() - 1.0).abs() <= SAME_LENGTH;
    let of = |v: Option<[f64; 3]>, note| v.filter(|v| !is_unit(*v)).map(|_| note);
    let vectors = [
        of(tool.axis, "TX TY TZ: the control takes the tool's axis as it stands"),
        of(tool.normal, "NX NY NZ: the control takes the surface normal as it stands"),
    ];
    vectors.into_iter().flatten()
}

/// Axis values at the end of a block from `from` with the tip at `tip` (table frame) and the tool
/// along a vector of the frame of the tip's words, given with its table frame ← frame of the words.
pub(crate) fn turned_to(
    (machine, tool_length): (&Machine, f64),
    from: &AxisValues,
    tip: Point3<f64>,
    (frame, vector): (Isometry3<f64>, [f64; 3]),
) -> Result<AxisValues, Unturned> {
    let in_words = Vector3::from(vector);
    // Written so that NaN is refused, too.
    let axis = Unit::try_new(in_words, f64::MIN_POSITIVE).filter(|a| a.iter().all(|c| c.is_finite()));
    let cl = ClPoint { tip, axis: frame * axis.ok_or(Unturned::NoLength)? };
    machine.control_choice(from, &cl, tool_length).map_err(Unturned::Unclear)
}
