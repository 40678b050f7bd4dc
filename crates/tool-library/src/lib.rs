//! Tool libraries of Fusion to tools, and tools to the tool tables of controls.
//!
//! [`read_library`] reads a library that Fusion exported, `.json` or `.tools`, to [`LibraryTool`]s:
//! each has its tool file ([`ImportedTool`]), or a [`ToolRefusal`] that names keys and remedies.
//! `assumed` of the tool file lists values that a library does not give.
//! [`linuxcnc_table`], [`siemens_tool_data`], [`g10_tool_lengths`] and [`heidenhain_tool_table`]
//! write tools for a control, if their gauge lengths are not assumed.
//!
//! ```
//! use facemill_tool_library::read_library;
//!
//! let library = br#"{ "data": [{
//!     "type": "bull nose end mill", "unit": "inches", "description": "1/2 r1/16",
//!     "post-process": { "number": 7 },
//!     "geometry": { "DC": 0.5, "RE": 0.0625, "NOF": 4, "LCF": 1.0, "LB": 2.0, "SFDM": 0.5, "HAND": true },
//!     "holder": { "unit": "millimeters", "gaugeLength": 70, "segments": [
//!         { "height": 70, "lower-diameter": 28, "upper-diameter": 40 } ] } }] }"#;
//! let tools = read_library(library)?;
//! let tool = tools[0].import.as_ref().unwrap();
//! assert!((tool.file.radius_mm - 6.35).abs() < 1e-9 && (tool.file.gauge_length_mm - 120.8).abs() < 1e-9);
//! # Ok::<(), facemill_tool_library::LibraryError>(())
//! ```
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `fault` | faults of libraries and of their tools |
//! | `remarks` | faults, assumed values and notes of a tool |
//! | `archive` | libraries in zip archives |
//! | `json_value` | JSON with unknown keys, in bounded memory |
//! | `fields` | values of a tool by key, in mm, with every fault |
//! | `profile` | stacks of frusta from segments of shafts and holders |
//! | `presets` | cutting data as feeds of a job |
//! | `holder` | holder and gauge length of a tool |
//! | `fusion_tool` | one milling tool of a library as a tool file |
//! | `library` | all tools of a library |
//! | `tool_table` | tool tables of controls |
//!
//! It must not know jobs and machines, and opens no file.

mod archive;
mod fault;
mod fields;
mod fusion_tool;
mod holder;
mod json_value;
mod library;
mod presets;
mod profile;
mod remarks;
mod tool_table;

pub use fault::{ArchiveFault, LibraryError, MAX_TOOLS, ToolFault};
pub use fusion_tool::CutterKind;
pub use library::{ImportedTool, LibraryTool, MAX_FAULTS, ToolRefusal, is_library, read_library};
pub use presets::CuttingPreset;
pub use tool_table::{
    G10Control, TableError, TableUnit, g10_tool_lengths, heidenhain_tool_table, linuxcnc_table, siemens_tool_data,
};
