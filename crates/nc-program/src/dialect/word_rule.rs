//! The words of a dialect file besides those of motion laws.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::dialect::file::Switch;

/// Length compensation switched on with a move. `{register}` is the length register, `{law}` the
/// words of the cutting law.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LengthRule {
    /// Lines before the move.
    pub before: Vec<String>,
    /// Words before the axis words.
    pub code: String,
    /// Words behind the axis words.
    pub end: String,
}

/// Words of the body.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WordRule {
    /// Word that makes words absolute, written with the feed mode in the first motion; empty where
    /// words are so anyway.
    pub absolute: String,
    /// A rapid.
    pub rapid: String,
    /// Text at the end of a rapid; never left out.
    pub rapid_end: String,
    /// A cut.
    pub linear: String,
    /// Text before F in a cut; never left out.
    pub linear_end: String,
    /// Whether rapid and cut are remembered, and left out where nothing changes.
    pub motion_is_modal: bool,
    /// Length compensation along the axis.
    pub length: LengthRule,
    /// Lines that end it; none where it goes on as long as the tool is in the spindle.
    pub length_off: Vec<String>,
    /// The way to the reference position.
    pub home: HomeRule,
    /// Lines that change to tool `{number}`.
    pub tool_change: Vec<String>,
    /// Lines that start the only spindle: `{rpm}`, `{code}` of `clockwise` or `counter_clockwise`,
    /// `{m}` its number.
    pub spindle_on: Vec<String>,
    /// Lines that stop it.
    pub spindle_off: Vec<String>,
    /// The same for spindle `{spindle}` of several; absent where there is one alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spindles: Option<Switch>,
    /// M word of a spindle that turns clockwise.
    pub clockwise: String,
    /// M word of one that turns counter-clockwise.
    pub counter_clockwise: String,
    /// Coolant words.
    pub coolant: CoolantRule,
    /// Lines of a dwell: `{ms}` or `{s}`.
    pub dwell: Vec<String>,
    /// Work offsets, by number.
    pub work_offsets: Vec<OffsetRule>,
    /// Lines that wait for the operator.
    pub stop: Vec<String>,
    /// Lines that end the program.
    pub end: Vec<String>,
}

/// Coolant words; what is absent is refused.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CoolantRule {
    /// None.
    pub off: String,
    /// Flood.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flood: Option<String>,
    /// Mist or air.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mist: Option<String>,
}

/// Work offsets `first` to `last` as `{n}`, which is the offset's number plus `plus`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OffsetRule {
    /// First number, from 1.
    pub first: u16,
    /// Last number.
    pub last: u16,
    /// Difference.
    pub plus: i32,
    /// The word; of a control that needs more, what comments call the offset.
    pub word: String,
    /// Lines that select it; the word alone where there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<String>,
}

/// How axes go to the reference position.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HomeRule {
    /// Meaning of the axis words of such a block.
    pub words: HomeWords,
    /// Lines before the move, of a control that takes one command a line.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub before: Vec<String>,
    /// Words before them.
    pub code: String,
    /// Words behind them.
    pub end: String,
    /// Lines behind the move.
    pub after: Vec<String>,
    /// Whether it can be said under RTCP.
    pub under_rtcp: bool,
}

/// Meaning of axis words on the way home.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum HomeWords {
    /// Zeros: the control knows the place (G28 with G91).
    Zeros,
    /// Machine values of the reference position (G53).
    MachineValues,
}
