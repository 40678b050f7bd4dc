//! NC programs: from blocks to a control's text and back, and APT cutter-location files.
//!
//! An [`NcProgram`] is what happens, as [`Block`]s of [`AxisWords`]. A [`WordMap`] makes such words from joint values and
//! takes them back. [`write_program`] gives the text of a [`Dialect`]: the blocks, with what the control remembers left
//! out, inside a template (header, tool change, safe start and end) that the user can edit. [`read_program`] takes a text
//! back to a [`ReadProgram`]: modal state resolved, nothing executed, nothing skipped that is not understood.
//!
//! ```
//! use facemill_nc_program::*;
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
//! Guarantees: an axis word that is read back differs from the number it was written from by at most
//! [`PostSettings::rounding_bound`]; a feed is not faster than it was given but where no
//! smaller word says it; leaving out modal words changes no position, feed or mode; no text makes a reader
//! panic. Not guaranteed: that a control accepts the text of an edited template.
//!
//! Machines of several heads: [`write_program_of_heads`] writes the words of all of them into one block, with a length, tool
//! and spindle for each ([`HeadSpec`]), and [`WordMap::with_heads`] takes them back. [`write_siemens_pair`] writes the same
//! blocks as two channel programs, as an estimate.
//!
//! Programs from elsewhere: [`read_haas`], [`read_mazak`], [`read_linuxcnc`], [`read_siemens`] and [`read_heidenhain`] end in
//! a [`ReadProgram`], too. Each block knows where its feed stands in the source ([`FeedPlace`]).
//!
//! [`write_apt`] and [`read_apt`] do the same for tip and tool axis, before any machine.
//!
//! It must not know surfaces, and of machines only axis letters, offsets and the tool length.

mod apt;
mod channels;
mod dialect;
mod program;
mod read;
mod word_map;
mod words;
mod write;

pub use crate::channels::{
    ReadPair, ReadPairBlock, SiemensFault, SiemensFeed, SiemensPair, SiemensReadError, SiemensSettings,
    read_siemens_pair, write_siemens_pair,
};
pub use crate::dialect::file::Decimals;
pub use crate::dialect::file::{
    BlendingRule, CommentRule, ControlMotion, CornerRule, CuttingRule, DIALECT_FORMAT, DialectFile, FeedRule,
    LimitedBy, LineRule, MotionRule, NumberRule, Numbering, ProgramRule, RapidRule, RotaryBlocks, RtcpLaw, RtcpRapids,
    RtcpRule, Switch, VectorRule,
};
pub use crate::dialect::post_file::{
    BlockNumbers, LAST_PROGRAM_NUMBER, Orientation, PostError, PostFile, PostSettings, RoundingBound, Template,
};
pub use crate::dialect::word_rule::{CoolantRule, HomeRule, HomeWords, LengthRule, OffsetRule, WordRule};
pub use crate::program::heads::MappedAxis;
pub use crate::program::heads::{HeadError, HeadSpec, MappedHead};
pub use crate::program::spec::{AxisSpec, ProgramSpec, SpindleSpec, ToolSpec};
pub use crate::program::write_error::WriteError;
pub use crate::read::error::{ReadError, ReadFault};
pub use crate::read::fanuc::{FanucReader, read_fanuc, read_haas, read_linuxcnc, read_mazak};
pub use crate::read::feed_place::FeedPlace;
pub use crate::read::heidenhain::{HeidenhainReader, read_heidenhain};
pub use crate::read::length_check::LengthRelation;
pub use crate::read::position::{AxisAt, ReadPosition};
pub use crate::read::program::{
    ArcWords, CallKind, Compensation, Feed, MacroKind, MotionKind, NoteKind, Plane, ReadBlock, ReadCall, ReadCommand,
    ReadMotion, ReadNote, ReadProgram, ToolLengthNote, ToolVectors,
};
pub use crate::read::reader::ProgramReader;
pub use crate::read::siemens::{SiemensReader, read_siemens};
pub use crate::words::axis_lengths::AxisLengths;
pub use crate::words::axis_words::{AxisKind, AxisLetter, AxisNameError, AxisWord, AxisWords, TooManyAxes};
pub use crate::words::said_words::{SaidWords, StateWord};
pub use apt::{
    AptCutter, AptFile, AptMeaning, AptMove, AptPoint, AptPointKind, AptSpec, AptStatement, AptUnknownWord, is_cl_file,
    read_apt, write_apt,
};
pub use dialect::Dialect;
pub use program::{Block, Coolant, CutVectors, FeedMode, NcProgram, WorkOffset};
pub use word_map::{WordMap, WordMapError};

/// The program in the dialect of the settings, with `\n` line ends; the same input always gives the same bytes.
///
/// Numbers have fixed decimals, no exponent, no negative zero; whether a whole number has a decimal point (`X100.`, or
/// `X100.000` with trailing zeros) and a positive one its sign, the dialect's file says; rotary words are deg. Feeds are
/// rounded down, also inverse times, where a
/// larger number is faster, but not to zero nor below [`ProgramSpec::smallest_feed`]. The first motion of the body states every word it
/// names, absolute mode and feed mode, so that it does not depend on the template.
///
/// # Errors
/// When the template is wrong, the program does not start with a rapid, a number fits no word, or a line breaks the
/// control's rules.
pub fn write_program(spec: &ProgramSpec, settings: &PostSettings) -> Result<String, WriteError> {
    write_program_with_lines(spec, settings).map(|written| written.text)
}

/// A program's text, and where its blocks are in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WrittenProgram {
    /// The text.
    pub text: String,
    /// For each block of [`NcProgram::blocks`] the line of the text, from 1, at which it begins; a block that writes
    /// nothing has the line of what follows.
    pub block_lines: Vec<u32>,
}

/// [`write_program`], with the line at which each block begins: what a reader of the text calls
/// [`ReadBlock::line`].
///
/// # Errors
/// As [`write_program`].
pub fn write_program_with_lines(spec: &ProgramSpec, settings: &PostSettings) -> Result<WrittenProgram, WriteError> {
    write::write(spec, &[], settings)
}

/// [`write_program_with_lines`] for a machine of several heads, whose axes all stand in one block: `heads` are all of
/// them, and the tool and spindle of `spec` those of the first. The template has them as `heads`.
///
/// Only for dialects with words for each spindle and axes with numbers. FANUC: the length of each head is switched on in a
/// block of its own, for its spindle axis (tool length offset type
/// C), and S, M3, M4 and M5 of each spindle have its number as P.
///
/// # Errors
/// As [`write_program`]; when the heads share a number or an axis, there are not 2 to 4 of them, the first motion says
/// nothing of one, or the feed mode is RTCP, which can follow one tip.
pub fn write_program_of_heads(
    spec: &ProgramSpec,
    heads: &[HeadSpec],
    settings: &PostSettings,
) -> Result<WrittenProgram, WriteError> {
    if heads.is_empty() {
        return Err(HeadError::Count { n: 0 }.into());
    }
    write::write(spec, heads, settings)
}

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
