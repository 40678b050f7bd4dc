//! Data of a template. Names and comments are in the control's characters, positions are words.

use serde::Serialize;

use crate::dialect::file::{RtcpLaw, Switch};
use crate::program::FeedMode;
use crate::words::axis_words::AxisLetter;

/// All of it.
#[derive(Serialize)]
pub(super) struct Context {
    pub(super) program: ProgramContext,
    pub(super) job: JobContext,
    pub(super) section: SectionContext,
    pub(super) tool: ToolContext,
    pub(super) spindle: SpindleContext,
    /// Empty for one head.
    pub(super) heads: Vec<HeadContext>,
    pub(super) coolant: CodeContext,
    pub(super) work_offset: String,
    pub(super) work_offset_lines: Vec<String>,
    pub(super) feed: FeedContext,
    pub(super) rapid: RapidContext,
    pub(super) rtcp: RtcpContext,
    pub(super) tolerance: ToleranceContext,
    pub(super) blending: Switch,
    pub(super) look_ahead: Switch,
    pub(super) axes: Vec<AxisContext>,
    pub(super) home: WordsContext,
    /// Machine values of the reference position.
    pub(super) reference: Option<WordsContext>,
    pub(super) first: WordsContext,
    pub(super) approach: WordsContext,
    pub(super) body: &'static str,
}

#[derive(Serialize)]
pub(super) struct ProgramContext {
    pub(super) number: u32,
    /// With leading zeros.
    pub(super) padded: String,
    pub(super) name: String,
    /// Letters, digits and underscores.
    pub(super) id: String,
}

#[derive(Serialize)]
pub(super) struct JobContext {
    pub(super) name: String,
}

/// Part of a program with one tool.
#[derive(Clone, Serialize)]
pub(super) struct SectionContext {
    /// From 1.
    pub(super) number: usize,
    pub(super) first: bool,
    pub(super) last: bool,
    /// For labels: empty in the first one, `_2` in the second.
    pub(super) suffix: String,
}

impl SectionContext {
    /// Returns the section of this index among so many.
    pub(super) fn new(index: usize, n: usize) -> Self {
        let suffix = if index == 0 { String::new() } else { format!("_{}", index + 1) };
        Self { number: index + 1, first: index == 0, last: index + 1 == n, suffix }
    }
}

#[derive(Serialize)]
pub(super) struct ToolContext {
    pub(super) number: u32,
    pub(super) name: String,
    pub(super) radius: f64,
    pub(super) corner_radius: f64,
    pub(super) length: f64,
    pub(super) length_register: u32,
}

#[derive(Serialize)]
pub(super) struct SpindleContext {
    pub(super) rpm: i64,
    pub(super) clockwise: bool,
    pub(super) code: String,
}

#[derive(Serialize)]
pub(super) struct HeadContext {
    pub(super) name: String,
    pub(super) tool: ToolContext,
    pub(super) spindle: SpindleContext,
    pub(super) spindle_number: u32,
    pub(super) spindle_axis: AxisLetter,
    /// Word of its spindle axis at the first position.
    pub(super) first: String,
}

#[derive(Serialize)]
pub(super) struct CodeContext {
    pub(super) code: String,
    /// Word that switches it off.
    pub(super) off: String,
}

#[derive(Serialize)]
pub(super) struct FeedContext {
    pub(super) mode: FeedMode,
    pub(super) code: String,
    /// Word that goes back to feed per minute.
    pub(super) per_minute: String,
}

#[derive(Serialize)]
pub(super) struct RapidContext {
    pub(super) linear: bool,
    pub(super) code: String,
    pub(super) note: String,
}

/// Empty without RTCP.
#[derive(Default, Serialize)]
pub(super) struct RtcpContext {
    pub(super) law: Option<RtcpLaw>,
    /// Words that select the law.
    pub(super) code: String,
    /// Lines before the move that switches it on.
    pub(super) before: Vec<String>,
    pub(super) off: Vec<String>,
    pub(super) vectors: bool,
}

/// Tolerances that plan and verification allow the control.
#[derive(Serialize)]
pub(super) struct ToleranceContext {
    /// mm.
    pub(super) path: f64,
    /// deg.
    pub(super) orientation: f64,
}

#[derive(Serialize)]
pub(super) struct AxisContext {
    pub(super) letter: AxisLetter,
    pub(super) rotary: bool,
    pub(super) along_spindle: bool,
    /// Machine limits as words' numbers, none for an axis without one.
    pub(super) min: Option<String>,
    pub(super) max: Option<String>,
    /// Machine value where words are 0, as a word's number.
    pub(super) work_offset: Option<String>,
}

/// Words of one position, joined by blanks and sorted by what moves together.
#[derive(Default, Serialize)]
pub(super) struct WordsContext {
    /// The axis along the spindle.
    pub(super) spindle: String,
    /// The other linear axes.
    pub(super) across: String,
    /// All linear axes.
    pub(super) linear: String,
    pub(super) rotary: String,
    /// Every axis.
    pub(super) all: String,
}
