//! Forms of what a control needs beside a program: tables and subprograms.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Form of a control's tool table and work offsets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum TableForm {
    /// Programs of G10 lines: L10 and L11 for lengths, L2 and L20 for work offsets.
    G10,
    /// Tool table `tool.tbl`, and a program of G10 L2.
    #[serde(rename = "linuxcnc")]
    LinuxCnc,
    /// Programs that set `$TC_DP…` and `$P_UIFR`.
    #[serde(rename = "siemens_840d")]
    Siemens840d,
    /// Tables TOOL.T and PRESET.PR.
    Heidenhain,
}

/// Subprograms of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SubprogramsFile {
    /// Part of the program that each subprogram holds.
    pub per: SubprogramPart,
    /// Where the subprograms are.
    #[serde(rename = "in")]
    pub place: SubprogramPlace,
    /// Number of the first one, of a control that calls them by number. Default: the dialect's.
    #[schemars(range(min = 1, max = 99_999_999))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_number: Option<u32>,
}

/// Part of a program that a subprogram holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SubprogramPart {
    /// A pass in a place of the pattern, with the way to it.
    Pass,
    /// All passes of an operation.
    Operation,
}

/// Place of subprograms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SubprogramPlace {
    /// In the file of the main program.
    Program,
    /// Each in a file of its own, with the name that the control looks for.
    Files,
}

/// Words of subprograms, by their place; what is absent is refused.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SubprogramRules {
    /// In the file of the main program.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub in_program: Option<SubprogramRule>,
    /// Each in a file of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub in_files: Option<SubprogramRule>,
}

impl SubprogramRules {
    pub(crate) fn is_empty(&self) -> bool {
        self.in_program.is_none() && self.in_files.is_none()
    }

    /// Returns all texts with placeholders.
    pub(crate) fn texts(&self) -> impl Iterator<Item = &String> {
        let rules = self.in_program.iter().chain(&self.in_files);
        rules.flat_map(|r| [&r.call, &r.file].into_iter().chain(&r.begin).chain(&r.end))
    }
}

/// Words of a subprogram: `{number}`, `{padded}` (the number with leading zeros), `{id}` (its name,
/// upper-case letters, digits and underscores), `{lower_id}` (the same in lower case) and `{name}`
/// (text of a comment).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SubprogramRule {
    /// Line that calls it.
    pub call: String,
    /// Lines before its blocks.
    pub begin: Vec<String>,
    /// Lines behind its blocks.
    pub end: Vec<String>,
    /// Name of its file; empty in the file of the main program.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub file: String,
    /// First number.
    pub first_number: u32,
    /// Largest number.
    pub last_number: u32,
    /// Whether a number is free in each main program, as that of a label is.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub numbers_of_program: bool,
    /// Whether it precedes the main program in its file.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub in_front: bool,
}
