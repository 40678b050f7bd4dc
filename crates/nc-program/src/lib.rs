//! NC programs: from blocks to a control's text and back.
//!
//! An [`NcProgram`] is what happens, as [`Block`]s of [`AxisWords`]. A [`WordMap`] makes such words
//! from joint values and takes them back. [`write_program`] gives the text of a [`Dialect`]: the
//! blocks, with what the control remembers left out, inside a template (header, tool change, safe
//! start and end) that the user can edit. [`read_program`] takes a text back to a [`ReadProgram`]:
//! modal state resolved, nothing executed, nothing skipped that is not understood.
//!
//! ```
//! use facemill_nc_program::*;
//! use facemill_nc_program::dialect::PostFile;
//! use facemill_nc_program::read::{AxisAt, MotionKind};
//!
//! let at = |x, b| AxisWords::from_words([(AxisLetter::X, x), (AxisLetter::Z, 50.0), (AxisLetter::B, b)]).unwrap();
//! let axis = |letter| AxisSpec {
//!     letter,
//!     min: -900.0,
//!     max: 900.0,
//!     along_spindle: letter == AxisLetter::Z,
//!     work_offset: 0.0,
//! };
//! let spec = ProgramSpec {
//!     job_name: "Blade".to_owned(),
//!     tool: ToolSpec {
//!         number: 7,
//!         name: "D160 R6".to_owned(),
//!         radius: 80.0,
//!         corner_radius: 6.0,
//!         length: 420.0,
//!         length_register: 7,
//!     },
//!     spindle: SpindleSpec { rpm: 350.0, clockwise: true },
//!     coolant: Coolant::Off,
//!     work_offset: WorkOffset::default(),
//!     axes: [AxisLetter::X, AxisLetter::Z, AxisLetter::B].map(axis).to_vec(),
//!     smallest_feed: 1.0,
//!     program: NcProgram {
//!         blocks: vec![
//!             Block::Rapid { words: at(0.0, 0.0) },
//!             Block::Linear { words: at(100.0, -12.5), feed: 800.0 },
//!         ],
//!     },
//!     rapid: facemill_cl_data::RapidLaw::Linear,
//!     approach: None,
//! };
//! let post: PostFile = facemill_file_format::from_json(br#"{"dialect": "fanuc"}"#)?;
//! let text = write_program(&spec, &post.settings(None)?)?;
//! assert!(text.contains("G1 X100. B-12.5 F800.\n"));
//!
//! let read = read_program(&text, Dialect::Fanuc)?;
//! let (_, cut) = read.motions().find(|(_, motion)| motion.kind == MotionKind::Linear).unwrap();
//! assert_eq!(cut.position.get(AxisLetter::Z), Some(AxisAt::Word(50.0)));
//! assert_eq!(read.tool_length(), Some(420.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Guarantees: an axis word that is read back differs from the number it was written from by at
//! most [`PostSettings::rounding_bound`]; a feed is not faster than it was given but where no
//! smaller word says it; leaving out modal words changes no position, feed or mode; no text makes a
//! reader panic. Not guaranteed: that a control accepts the text of an edited template.
//!
//! Machines of several heads: [`write_program_of_heads`] writes the words of all of them into one
//! block, with a length, tool and spindle for each ([`HeadSpec`]), and [`WordMap::with_heads`]
//! takes them back.
//!
//! Programs from elsewhere: [`read_haas`], [`read_mazak`], [`read_linuxcnc`], [`read_siemens`] and
//! [`read_heidenhain`] end in a [`ReadProgram`], too. Each block records the place of its feed in
//! the source ([`FeedPlace`]).
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `words` | words of NC text: axes, lengths and numbers |
//! | `program` | programs before they have a dialect, their tools and heads |
//! | `dialect` | the dialects that come with the crate, and what makes a dialect file one that can be written with |
//! | `read` | readers of NC text, a folder for each family of controls |
//! | `word_map` | axis words from joint values, and back |
//! | `write` | programs as text: the template of a dialect around a body of blocks, both by the rules of the dialect's file |
//!
//! It must not know surfaces, and of machines only axis letters, offsets and the tool length.
//!
//! [`FeedPlace`]: read::FeedPlace
//! [`read_haas`]: read::read_haas
//! [`read_heidenhain`]: read::read_heidenhain
//! [`read_linuxcnc`]: read::read_linuxcnc
//! [`read_mazak`]: read::read_mazak
//! [`read_siemens`]: read::read_siemens

pub mod dialect;
mod program;
pub mod read;
mod word_map;
pub mod words;
mod write;

pub use crate::dialect::Dialect;
pub use crate::dialect::post_file::PostSettings;
pub use crate::program::heads::{HeadError, HeadSpec, MappedAxis, MappedHead, check_heads};
pub use crate::program::spec::{AxisSpec, ProgramSpec, SpindleSpec, ToolSpec};
pub use crate::program::write_error::WriteError;
pub use crate::program::{Block, Coolant, CutVectors, FeedMode, NcProgram, WorkOffset};
pub use crate::read::program::ReadProgram;
pub use crate::read::read_program;
pub use crate::word_map::{WordMap, WordMapError};
pub use crate::words::axis_words::{AxisLetter, AxisWords};
pub use crate::write::codes::spindle_speed;
pub use crate::write::offset_table::{WrittenTable, write_work_offset};
pub use crate::write::text::clean_fanuc_comment;
pub use crate::write::{
    WrittenProgram, WrittenSections, write_program, write_program_of_heads, write_program_with_lines, write_sections,
};
