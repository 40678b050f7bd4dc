//! Tool files.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The value of a tool file's `format` key.
pub const FORMAT: &str = "facemill-tool/1";

/// Format of a tool file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub enum FormatTag {
    /// `facemill-tool/1`.
    #[default]
    #[serde(rename = "facemill-tool/1")]
    V1,
}

/// Tool file. Lengths count from the tip along the axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToolFile {
    /// Always `"facemill-tool/1"`.
    pub format: FormatTag,
    /// Name of the tool in reports and in the NC program.
    pub name: String,
    /// Number in the magazine (the T word).
    #[schemars(range(min = 1, max = 99_999_999))]
    pub number: u32,
    /// Register of the control that holds its length (the H word). Default: `number`.
    #[schemars(range(min = 1, max = 999))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length_register: Option<u32>,
    /// Cutter radius R: half of the largest cutting diameter, no wider than the machine's table.
    #[schemars(range(min = 0.01, max = 10_000))]
    pub radius_mm: f64,
    /// Corner or insert radius r, at most R: 0 for sharp corners, R for a ball.
    #[schemars(range(min = 0))]
    pub corner_radius_mm: f64,
    /// Number of inserts or teeth.
    #[schemars(range(min = 1, max = 500))]
    pub n_inserts: u32,
    /// Cutting height, at least r: from the tip up to where the cutter cuts no more.
    #[schemars(range(min = 0.01, max = 10_000))]
    pub flute_length_mm: f64,
    /// Radius about the axis within which the cutter's bottom does not cut, below R; 0 for a cutter
    /// that cuts to its centre. With `max_ramp_angle_deg` it decides the finding `dead_core`.
    #[schemars(range(min = 0))]
    #[serde(default)]
    pub dead_core_radius_mm: f64,
    /// Steepest ramp on which the cutter may enter the material downward.
    #[schemars(range(min = 0, max = 90))]
    pub max_ramp_angle_deg: f64,
    /// Sense of the spindle for cutting, seen from the spindle toward the tip.
    pub spindle_rotation: SpindleRotation,
    /// Cutting edge angle of the inserts (ISO 13399 KAPR), if they have one.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 90))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cutting_edge_angle_deg: Option<f64>,
    /// Distance from the tip to the nose of the holder, at least the flute length.
    #[schemars(range(min = 0.01, max = 10_000))]
    pub stick_out_mm: f64,
    /// Distance from the tip to the gauge line (spindle nose), at least the stick-out; the length
    /// that the program is computed with.
    #[schemars(range(min = 0.01, max = 10_000))]
    pub gauge_length_mm: f64,
    /// Cutter body and shank: from the end of the flute upward, at least to the nose of the holder.
    pub body: Stack,
    /// Holder: from its nose upward, at least to the gauge line.
    pub holder: Stack,
    /// Values that nobody measured: keys of this file, each with its reason. Replace them by those
    /// of the tool.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub assumed: Vec<AssumedMeasure>,
}

/// Value of a tool file that nobody measured.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AssumedMeasure {
    /// Key of the value in the tool file.
    pub key: String,
    /// Reason for the value.
    pub reason: String,
}

/// Sense of the spindle, seen from the spindle toward the tip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SpindleRotation {
    /// M3.
    Clockwise,
    /// M4.
    Counterclockwise,
}

/// Turned sections one on the other, with the clearance they keep.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stack {
    /// Distance that every section keeps from part, fixture and stock.
    #[schemars(range(min = 0, max = 1_000))]
    pub clearance_mm: f64,
    /// Sections from the lowest to the highest.
    pub sections: Vec<Section>,
}

/// Frustum about the tool axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Height along the tool axis.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 10_000))]
    pub length_mm: f64,
    /// Diameter at the lower end; in a tool at least 0.01.
    #[schemars(range(min = 0, max = 10_000))]
    pub diameter_low_mm: f64,
    /// Diameter at the upper end; in a tool at least 0.01.
    #[schemars(range(min = 0, max = 10_000))]
    pub diameter_high_mm: f64,
}

impl Stack {
    /// Sum of the sections' lengths, mm.
    pub fn length_mm(&self) -> f64 {
        self.sections.iter().map(|s| s.length_mm).sum()
    }
}
