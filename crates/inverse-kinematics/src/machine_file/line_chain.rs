//! Chains given by the lines of their axes in place of rows.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::machine_file::{BodyFile, DhRow, Joint, ToolChain, WorkpieceChain};

/// Chain given by the lines of its axes, in the bed's frame with all axes at 0. Rows are made from
/// them when the file is read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineChain {
    /// Axes from the bed outward.
    pub axes: Vec<LineFile>,
    /// Frame at the end of the chain: the table, or the spindle nose with z into the spindle.
    /// Default: the bed's frame.
    #[serde(default)]
    pub end: PlaceFile,
}

/// Axis given by the line it moves along or turns about, in the bed's frame with all axes at 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineFile {
    /// Axis that moves along or about the line; the line's direction is +z of its row.
    pub joint: Joint,
    /// Direction of the line, of any length above 0.
    pub direction: [f64; 3],
    /// A point on the line of a rotary axis, which needs one; that of a linear axis has no effect.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_mm: Option<[f64; 3]>,
    /// Bodies that move with the axis, in the bed's frame with all axes at 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<BodyFile>,
}

/// Place of a frame in the bed's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaceFile {
    /// Origin.
    #[serde(default)]
    pub position_mm: [f64; 3],
    /// Turns about the bed's fixed x, then y, then z axis.
    #[schemars(inner(range(min = -360, max = 360)))]
    #[serde(default)]
    pub rotation_xyz_deg: [f64; 3],
}

impl PlaceFile {
    /// Returns the pose of the frame.
    pub(crate) fn pose(&self) -> Isometry3<f64> {
        pose(self.position_mm, self.rotation_xyz_deg)
    }
}

/// Returns the pose at a position, turned about the fixed x, then y, then z axis.
pub(crate) fn pose(position_mm: [f64; 3], rotation_xyz_deg: [f64; 3]) -> Isometry3<f64> {
    let [x, y, z] = rotation_xyz_deg.map(f64::to_radians);
    Isometry3::from_parts(Translation3::from(position_mm), UnitQuaternion::from_euler_angles(x, y, z))
}

/// Transforms from the bed to the table: `rows`, or `lines` in their place. With no rows the
/// workpiece lies on the bed.
#[derive(Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(
    rename = "WorkpieceChain",
    extend("anyOf" = [{ "required": ["rows"] }, { "required": ["lines"] }], "not" = { "required": ["rows", "lines"] })
)]
pub(crate) struct WorkpieceChainText {
    /// Rows from the bed outward; exactly one of `rows` and `lines` is required.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rows: Option<Vec<DhRow>>,
    /// Lines of the axes (docs/machines.md#axis-lines), in place of `rows`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    lines: Option<LineChain>,
}

/// Transforms from the bed to the spindle nose: `rows`, or `lines` in their place. The nose's
/// origin is the centre of its face, its z points into the spindle.
#[derive(Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(
    rename = "ToolChain",
    extend("anyOf" = [{ "required": ["rows"] }, { "required": ["lines"] }], "not" = { "required": ["rows", "lines"] })
)]
pub(crate) struct ToolChainText {
    /// Channel of the control that programs this head, from 1.
    #[serde(default = "first_channel")]
    channel: u32,
    /// Tool interface of the spindle nose (HSK-A100, SK 50, Capto C8); nothing depends on it,
    /// `machine check` prints it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    tool_interface: Option<String>,
    /// Rows from the bed outward; exactly one of `rows` and `lines` is required.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rows: Option<Vec<DhRow>>,
    /// Lines of the axes (docs/machines.md#axis-lines), in place of `rows`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    lines: Option<LineChain>,
}

fn first_channel() -> u32 {
    1
}

/// Returns rows and lines of a chain if the text has one of them.
fn one_of(rows: Option<Vec<DhRow>>, lines: Option<LineChain>) -> Result<(Vec<DhRow>, Option<LineChain>), &'static str> {
    match (&rows, &lines) {
        (Some(_), Some(_)) => Err("has both `rows` and `lines`: leave one out"),
        (None, None) => Err("has neither `rows` nor `lines`: give the rows of the chain, or the lines of its axes"),
        _ => Ok((rows.unwrap_or_default(), lines)),
    }
}

/// Returns the rows that the text of a chain has.
fn rows_of(rows: Vec<DhRow>, lines: Option<&LineChain>) -> Option<Vec<DhRow>> {
    (lines.is_none() || !rows.is_empty()).then_some(rows)
}

impl TryFrom<WorkpieceChainText> for WorkpieceChain {
    type Error = &'static str;

    fn try_from(text: WorkpieceChainText) -> Result<Self, Self::Error> {
        let (rows, lines) = one_of(text.rows, text.lines)?;
        Ok(Self { rows, lines })
    }
}

impl From<WorkpieceChain> for WorkpieceChainText {
    fn from(chain: WorkpieceChain) -> Self {
        Self { rows: rows_of(chain.rows, chain.lines.as_ref()), lines: chain.lines }
    }
}

impl TryFrom<ToolChainText> for ToolChain {
    type Error = &'static str;

    fn try_from(text: ToolChainText) -> Result<Self, Self::Error> {
        let (rows, lines) = one_of(text.rows, text.lines)?;
        Ok(Self { channel: text.channel, tool_interface: text.tool_interface, rows, lines })
    }
}

impl From<ToolChain> for ToolChainText {
    fn from(chain: ToolChain) -> Self {
        Self {
            channel: chain.channel,
            tool_interface: chain.tool_interface,
            rows: rows_of(chain.rows, chain.lines.as_ref()),
            lines: chain.lines,
        }
    }
}
