//! Tool libraries of Fusion: all tools of a file, each read or refused by name.

use facemill_tool_model::ToolFile;

use crate::archive::{is_archive, library_text};
use crate::fault::{LibraryError, MAX_TOOLS, ToolFault};
use crate::fields::Fields;
use crate::fusion_tool::{CutterKind, ReadTool, read_tool};
use crate::json_value::{JsonText, JsonValue};
use crate::presets::CuttingPreset;

/// A tool of a library, in the order of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct LibraryTool {
    /// Position in the file, from 1.
    pub position: usize,
    /// Number in the magazine, where the file has one.
    pub number: Option<u32>,
    /// Description, else product, else empty.
    pub description: String,
    /// Type, as the library names it, such as `face mill`.
    pub kind: String,
    /// The tool, or the reason why it is refused.
    pub import: Result<ImportedTool, ToolRefusal>,
}

impl LibraryTool {
    /// Returns the tool's name for messages: its number, else its position, and its description.
    #[must_use]
    pub fn label(&self) -> String {
        let number = self
            .number
            .map_or_else(|| format!("tool at position {}", self.position), |number| format!("tool {number}"));
        if self.description.is_empty() { number } else { format!("{number} \"{}\"", self.description) }
    }
}

/// A tool that was read from a library.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedTool {
    /// The tool; `assumed` names what the library does not give.
    pub file: ToolFile,
    /// Kind of cutter.
    pub kind: CutterKind,
    /// Values of the library that a tool file cannot hold, or that contradict others, as sentences.
    pub notes: Vec<String>,
    /// Cutting data.
    pub presets: Vec<CuttingPreset>,
}

/// Why a tool of a library was not read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ToolRefusal {
    /// This program does not read tools of the type.
    #[error("type \"{0}\" is not read; those read are {READ_KINDS}")]
    OtherKind(String),
    /// Values are missing or wrong.
    #[error("{}{}", joined(.first), more_faults(*.more))]
    Faults {
        /// Faults in the order of reading, at most [`MAX_FAULTS`].
        first: Vec<ToolFault>,
        /// Number of further faults.
        more: usize,
    },
}

/// Most faults of a tool that are named; a tool of another program has a fault at every key.
pub const MAX_FAULTS: usize = 20;

impl ToolRefusal {
    fn of_faults(mut first: Vec<ToolFault>) -> Self {
        let more = first.len().saturating_sub(MAX_FAULTS);
        first.truncate(MAX_FAULTS);
        Self::Faults { first, more }
    }
}

fn joined(faults: &[ToolFault]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

fn more_faults(more: usize) -> String {
    if more == 0 { String::new() } else { format!("; and {more} more") }
}

const READ_KINDS: &str = "face mill, bull nose end mill, ball end mill, flat end mill";

/// Reads a tool library that Fusion exported: JSON (`.json`), or the zip archive with it
/// (`.tools`). Lengths in mm; tool and holder may each be in inches.
///
/// Takes memory in proportion to the file, and at most some 200 MB whatever the file holds.
///
/// # Errors
/// Where the file as a whole is no library. A tool with faults is no error: its
/// [`LibraryTool::import`] has them.
pub fn read_library(bytes: &[u8]) -> Result<Vec<LibraryTool>, LibraryError> {
    if is_archive(bytes) {
        return read_text(&library_text(bytes)?);
    }
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let first = text.iter().find(|byte| !byte.is_ascii_whitespace());
    if !first.is_some_and(|byte| b"{[".contains(byte)) {
        return Err(LibraryError::OtherFile);
    }
    read_text(text)
}

/// Returns whether bytes are laid out as a library: an archive, or an object with a list of tools.
/// Their content may still be wrong.
#[must_use]
pub fn is_library(bytes: &[u8]) -> bool {
    is_archive(bytes)
        || facemill_file_format::from_json::<JsonText>(bytes)
            .is_ok_and(|text| matches!(text.0.get("data"), Some(JsonValue::List(_))))
}

fn read_text(text: &[u8]) -> Result<Vec<LibraryTool>, LibraryError> {
    let JsonText(root) = facemill_file_format::from_json(text)?;
    let Some(JsonValue::List(tools)) = root.get("data") else { return Err(LibraryError::NoTools) };
    if tools.len() > MAX_TOOLS {
        return Err(LibraryError::TooManyTools(tools.len()));
    }
    Ok(tools.iter().enumerate().map(|(k, tool)| of_entry(k + 1, tool)).collect())
}

fn of_entry(position: usize, entry: &JsonValue) -> LibraryTool {
    let mut faults = Vec::new();
    if !matches!(entry, JsonValue::Object(_)) {
        let fault = ToolFault { key: format!("data[{}]", position - 1), fault: format!("is {}", entry.kind()) };
        let import = Err(ToolRefusal::of_faults(vec![fault]));
        return LibraryTool { position, number: None, description: String::new(), kind: String::new(), import };
    }
    let tool = Fields::of(entry);
    let description = tool.text("description").or_else(|| tool.text("product-id")).unwrap_or_default();
    // A description is a name in programs, tables and files.
    let description: String = description.chars().take(120).collect();
    // Faults of the number are reported by the tool's own reader.
    let number = tool.part("post-process", &mut Vec::new()).count("number", 99_999_999, &mut Vec::new());
    let Some(kind) = tool.text("type") else {
        let fault = match entry.get("type").filter(|value| !matches!(value, JsonValue::Null | JsonValue::Text(_))) {
            Some(other) => format!("is {}; it must be a text", other.kind()),
            None => "is missing; select a type of tool in Fusion".to_owned(),
        };
        faults.push(ToolFault::new("type", fault));
        let import = Err(ToolRefusal::of_faults(faults));
        return LibraryTool { position, number, description, kind: String::new(), import };
    };
    let import = match CutterKind::of(&kind) {
        None => Err(ToolRefusal::OtherKind(kind.chars().take(40).collect())),
        Some(cutter) => match read_tool(&tool, cutter, &description) {
            Ok(ReadTool { file, notes, presets }) => Ok(ImportedTool { file, kind: cutter, notes, presets }),
            Err(faults) => Err(ToolRefusal::of_faults(faults)),
        },
    };
    LibraryTool { position, number, description, kind: kind.chars().take(40).collect(), import }
}
