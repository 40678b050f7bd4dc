use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::PathError;
use crate::strategy::settings::require;

/// Limit of a region to places where stock is left, such as
/// `{"height_mm": 0.15, "overlap_mm": 5, "of": {"rest": "rough.stock"}}`. With nothing left, the
/// operation has no passes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeftAboveFile {
    /// Height of the stock above the surface to be left (the drive surface with its allowance),
    /// along the normal, above which a place belongs to the region.
    #[schemars(range(min = 0.001, max = 1_000))]
    pub height_mm: f64,
    /// Distance around such places that the passes cover as well; the material left is measured
    /// without it.
    #[schemars(range(min = 0.1, max = 1_000))]
    pub overlap_mm: f64,
    /// Stock that is measured.
    pub of: LeftOfFile,
}

/// Stock that is measured: `"initial_stock"`, `"operations_before"`, `{"rest": "FILE"}` or
/// `{"programs": […]}`.
// Exhaustive for callers: each is read in its own way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LeftOfFile {
    /// The stock that the setup states, before any cut.
    InitialStock,
    /// The rest of the setup's stock that the job's own programs before this operation's leave
    /// together: of the setups and tools before it with the same stock, and of its
    /// `programs_before`. Operations with the same tool in one setup are in one program, of which
    /// none is before the other.
    OperationsBefore,
    /// Rest that a program left of the setup's stock (`verify --rest-out`), relative to the job
    /// file. It is known on its lines; surface within 10° of upright counts as left.
    Rest(String),
    /// The rest of the setup's stock that programs leave together. They ran on the job's machine,
    /// in this setup's mounting, with one head.
    Programs(#[schemars(length(min = 1))] Vec<ProgramWithToolFile>),
}

/// Program, and the tool that it was run with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProgramWithToolFile {
    /// NC program for the job's control, relative to the job file.
    pub file: String,
    /// Tool file, relative to the job file. Default: the job's tool.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool: Option<String>,
}

impl LeftAboveFile {
    /// # Errors
    /// When a length is out of its range, or no program is named; the error names the field.
    pub(crate) fn check(&self) -> Result<(), PathError> {
        let height = self.height_mm;
        require("region.left_above.height_mm", height, "from 0.001 to 1000", (0.001..=1e3).contains(&height))?;
        let overlap = self.overlap_mm;
        require("region.left_above.overlap_mm", overlap, "from 0.1 to 1000", (0.1..=1e3).contains(&overlap))?;
        let named = !matches!(&self.of, LeftOfFile::Programs(programs) if programs.is_empty());
        require("number of region.left_above.of.programs", 0.0, "at least 1", named)
    }
}

impl ProgramWithToolFile {
    /// Files that it names.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        [Some(&self.file), self.tool.as_ref()].into_iter().flatten().map(String::as_str)
    }

    /// Files that it names, to be renamed.
    pub fn files_mut(&mut self) -> impl Iterator<Item = &mut String> {
        [Some(&mut self.file), self.tool.as_mut()].into_iter().flatten()
    }
}

impl LeftOfFile {
    /// Files that it names.
    pub fn files(&self) -> Vec<&str> {
        match self {
            Self::InitialStock | Self::OperationsBefore => Vec::new(),
            Self::Rest(file) => vec![file],
            Self::Programs(programs) => programs.iter().flat_map(ProgramWithToolFile::files).collect(),
        }
    }

    /// Files that it names, to be renamed.
    pub fn files_mut(&mut self) -> Vec<&mut String> {
        match self {
            Self::InitialStock | Self::OperationsBefore => Vec::new(),
            Self::Rest(file) => vec![file],
            Self::Programs(programs) => programs.iter_mut().flat_map(ProgramWithToolFile::files_mut).collect(),
        }
    }
}
