//! Tool files.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The value of a tool file's `format` key.
pub const FORMAT: &str = "facemill-tool/1";

/// The `format` key: only [`FORMAT`] is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FormatTag {
    /// `facemill-tool/1`.
    #[default]
    #[serde(rename = "facemill-tool/1")]
    V1,
}

/// A tool file as written. `ToolAssembly::new` checks that its numbers make a tool.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToolFile {
    /// `"facemill-tool/1"`.
    pub format: FormatTag,
    /// Name of the tool in reports and in the NC program.
    pub name: String,
    /// Number in the magazine (the T word).
    pub number: u32,
    /// Register of the control that holds its length (the H word); the number, where the key is
    /// missing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length_register: Option<u32>,
    /// Cutter radius R: half of the largest cutting diameter.
    pub radius_mm: f64,
    /// Corner or insert radius r: 0 for sharp corners, R for a ball.
    pub corner_radius_mm: f64,
    /// Number of inserts or teeth.
    pub n_inserts: u32,
    /// Cutting height: from the tip up to where the cutter cuts no more.
    pub flute_length_mm: f64,
    /// Radius about the axis within which the cutter's bottom does not cut; 0 for a cutter that
    /// cuts to its centre.
    #[serde(default)]
    pub dead_core_radius_mm: f64,
    /// Steepest ramp on which the cutter may enter the material downward.
    pub max_ramp_angle_deg: f64,
    /// Sense of the spindle for cutting, seen from the spindle toward the tip.
    pub spindle_rotation: SpindleRotation,
    /// Cutting edge angle of the inserts (ISO 13399 KAPR), where they have one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cutting_edge_angle_deg: Option<f64>,
    /// From the tip to the nose of the holder.
    pub stick_out_mm: f64,
    /// From the tip to the gauge line (spindle nose).
    pub gauge_length_mm: f64,
    /// Cutter body and shank: from the end of the flute upward, at least to the nose of the holder.
    pub body: Stack,
    /// Holder: from its nose upward, at least to the gauge line.
    pub holder: Stack,
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

/// Turned sections one on the other, with the clearance they are to keep.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stack {
    /// Distance that every section keeps from part, fixture and stock.
    pub clearance_mm: f64,
    /// From the lowest to the highest.
    pub sections: Vec<Section>,
}

/// A frustum of a [`Stack`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Height along the tool axis.
    pub length_mm: f64,
    /// Diameter at the lower end.
    pub diameter_low_mm: f64,
    /// Diameter at the upper end.
    pub diameter_high_mm: f64,
}

impl Stack {
    /// Sum of the sections' lengths, mm.
    pub fn length_mm(&self) -> f64 {
        self.sections.iter().map(|s| s.length_mm).sum()
    }
}
