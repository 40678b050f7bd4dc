//! Holders to choose from.

use facemill_file_format::FormatError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::assembly::{ToolAssembly, ToolFileError};
use crate::open_assembly::OpenAssembly;
use crate::tool_file::{Section, Stack};

/// Format of a holder file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub enum HoldersFormatTag {
    /// `facemill-holders/1`.
    #[default]
    #[serde(rename = "facemill-holders/1")]
    V1,
}

/// Holders to choose from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HoldersFile {
    /// Always `"facemill-holders/1"`.
    pub format: HoldersFormatTag,
    /// Holders, in any order.
    #[schemars(length(min = 1))]
    pub holders: Vec<HolderFile>,
}

/// A holder as it is on the shelf.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HolderFile {
    /// Name in reports; no two holders have the same.
    pub name: String,
    /// Diameter of the shank that it takes: within 0.05 mm that of the topmost section of the
    /// tool's `body`.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 10_000))]
    pub bore_mm: f64,
    /// Shortest and longest distance from the tip to its nose at which it holds the tool safely,
    /// each above 0.
    #[schemars(inner(range(min = 0, max = 10_000)))]
    pub stick_out_mm: [f64; 2],
    /// Distance from its nose to the gauge line (spindle face).
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 10_000))]
    pub projection_mm: f64,
    /// Distance that it keeps from part, fixture and stock.
    #[schemars(range(min = 0, max = 10_000))]
    pub clearance_mm: f64,
    /// Sections from its nose upward, at least to the gauge line, as in a tool file.
    pub sections: Vec<Section>,
    /// Source of its dimensions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
}

/// Holders whose numbers have been checked; no two have the same name.
#[derive(Clone, Debug, PartialEq)]
pub struct HolderLibrary {
    holders: Vec<HolderFile>,
}

/// Why bytes are not a holder library, or a holder and a tool no assembly.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HolderError {
    /// The text is not a holder file.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// There is nothing to choose from.
    #[error("holders: there is none")]
    Empty,
    /// Two holders have one name.
    #[error("holders[{index}].name: \"{name}\" is the name of another one, too")]
    SameName {
        /// Which of them, from 0.
        index: usize,
        /// The name.
        name: String,
    },
    /// A number is out of its range.
    #[error("holders[{index}].{field}: {value} is not {expected}")]
    OutOfRange {
        /// Which holder, from 0.
        index: usize,
        /// Its field.
        field: &'static str,
        /// The value.
        value: f64,
        /// Required value.
        expected: &'static str,
    },
    /// The sections of a holder are none, or end below the gauge line.
    #[error("holders[{index}].sections: {problem}")]
    Sections {
        /// Which holder, from 0.
        index: usize,
        /// Fault.
        problem: String,
    },
    /// The shank has another diameter than the holder takes.
    #[error("takes shanks of {bore_mm} mm, the tool's is {shank_mm} mm")]
    OtherShank {
        /// Of the holder.
        bore_mm: f64,
        /// Of the tool's body at its top.
        shank_mm: f64,
    },
    /// The tool has no shank.
    #[error("the tool has no body section that a holder could take")]
    NoShank,
    /// Tool and holder make no tool.
    #[error(transparent)]
    Tool(#[from] ToolFileError),
}

/// By how much a shank may differ from a holder's bore, mm: fits are a hundredth of it.
const SAME_DIAMETER: f64 = 0.05;

/// Longest length of a holder, mm.
const LONGEST: f64 = 1e4;

impl HolderLibrary {
    /// Reads a holder file.
    ///
    /// # Errors
    /// When it is not one, or its numbers are not holders'; the error names the field.
    pub fn from_json(text: &[u8]) -> Result<Self, HolderError> {
        Self::new(facemill_file_format::from_json(text)?)
    }

    /// Checks a holder file's numbers.
    ///
    /// # Errors
    /// When there is no holder, two have one name, a number is out of range, or sections end below
    /// the gauge line.
    pub fn new(file: HoldersFile) -> Result<Self, HolderError> {
        if file.holders.is_empty() {
            return Err(HolderError::Empty);
        }
        for (index, holder) in file.holders.iter().enumerate() {
            if file.holders[..index].iter().any(|other| other.name == holder.name) {
                return Err(HolderError::SameName { index, name: holder.name.clone() });
            }
            check(index, holder)?;
        }
        Ok(Self { holders: file.holders })
    }

    /// The holders, in the order of the file.
    #[must_use]
    pub fn holders(&self) -> &[HolderFile] {
        &self.holders
    }
}

fn check(index: usize, holder: &HolderFile) -> Result<(), HolderError> {
    let length = |field, value: f64, least: f64, expected| {
        // NaN is in no range.
        if value >= least && value <= LONGEST {
            Ok(())
        } else {
            Err(HolderError::OutOfRange { index, field, value, expected })
        }
    };
    const SOME: &str = "more than 0 and at most 10,000 mm";
    length("bore_mm", holder.bore_mm, f64::MIN_POSITIVE, SOME)?;
    let [least, most] = holder.stick_out_mm;
    length("stick_out_mm[0]", least, f64::MIN_POSITIVE, SOME)?;
    length("stick_out_mm[1]", most, least, "at least stick_out_mm[0] and at most 10,000 mm")?;
    length("projection_mm", holder.projection_mm, f64::MIN_POSITIVE, SOME)?;
    length("clearance_mm", holder.clearance_mm, 0.0, "at least 0 and at most 10,000 mm")?;
    for s in &holder.sections {
        length("sections[].length_mm", s.length_mm, f64::MIN_POSITIVE, SOME)?;
        for diameter in [s.diameter_low_mm, s.diameter_high_mm] {
            length("sections[].diameter_mm", diameter, 0.0, "at least 0 and at most 10,000 mm")?;
        }
    }
    let reaches: f64 = holder.sections.iter().map(|s| s.length_mm).sum();
    if reaches < holder.projection_mm - 1e-6 {
        let problem = format!("reach to {reaches} mm above the nose, but must reach projection_mm");
        return Err(HolderError::Sections { index, problem });
    }
    Ok(())
}

impl HolderFile {
    /// The tool in this holder, at its shortest stick-out or the one that the tool's body leaves,
    /// where that is longer; the stick-out is open.
    ///
    /// # Errors
    /// When the holder takes other shanks, or both make no tool.
    pub fn with_tool(&self, tool: &ToolAssembly) -> Result<OpenAssembly, HolderError> {
        let mut file = tool.to_file();
        let shank_mm = file.body.sections.last().ok_or(HolderError::NoShank)?.diameter_high_mm;
        if (shank_mm - self.bore_mm).abs() > SAME_DIAMETER {
            return Err(HolderError::OtherShank { bore_mm: self.bore_mm, shank_mm });
        }
        file.holder = Stack { clearance_mm: self.clearance_mm, sections: self.sections.clone() };
        file.gauge_length_mm = file.stick_out_mm + self.projection_mm;
        let assembly = ToolAssembly::new(file)?;
        Ok(OpenAssembly::with_rigid_holder(&assembly, self.stick_out_mm[0]))
    }

    /// Largest diameter of its lowest section, mm: of two that stick out as far the wider one bends
    /// less.
    #[must_use]
    pub fn nose_diameter(&self) -> f64 {
        self.sections.first().map_or(0.0, |s| s.diameter_low_mm.max(s.diameter_high_mm))
    }
}

#[cfg(test)]
#[path = "../tests/unit/holder_library.rs"]
mod tests;
