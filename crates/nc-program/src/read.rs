//! Readers of NC text, a folder for each family of controls.

pub(crate) mod error;
pub(crate) mod fanuc;
pub(crate) mod feed_place;
pub(crate) mod heidenhain;
pub(crate) mod length_check;
pub(crate) mod modal;
pub(crate) mod notes;
pub(crate) mod position;
pub(crate) mod program;
pub(crate) mod reader;
pub(crate) mod siemens;
pub(crate) mod source;
mod tool_sections;
pub(crate) mod unfollowed;
pub(crate) mod values;

pub use crate::read::error::{ReadError, ReadFault};
pub use crate::read::fanuc::{FanucReader, read_fanuc, read_haas, read_linuxcnc, read_mazak};
pub use crate::read::feed_place::FeedPlace;
pub use crate::read::heidenhain::{HeidenhainReader, read_heidenhain};
pub use crate::read::length_check::LengthRelation;
pub use crate::read::position::{AxisAt, ReadPosition};
pub use crate::read::program::{
    ArcWords, CallKind, Compensation, Feed, MacroKind, MotionKind, NoteKind, Plane, ReadBlock, ReadCall, ReadCommand,
    ReadMotion, ReadNote, ToolLengthCheck, ToolLengthNote, ToolVectors,
};
pub use crate::read::reader::ProgramReader;
pub use crate::read::siemens::{SiemensReader, read_siemens};

use crate::dialect::Dialect;
use crate::read::program::ReadProgram;

/// Reads a program of a dialect.
///
/// # Errors
/// When a word is not understood, with its place.
pub fn read_program(text: impl AsRef<[u8]>, dialect: Dialect) -> Result<ReadProgram, ReadError> {
    match dialect {
        Dialect::Fanuc => read_fanuc(text),
        Dialect::Haas => read_haas(text),
        Dialect::Mazak => read_mazak(text),
        Dialect::LinuxCnc => read_linuxcnc(text),
        Dialect::Siemens840d => read_siemens(text),
        Dialect::Heidenhain => read_heidenhain(text),
    }
}
