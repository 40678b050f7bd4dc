//! Programs before they have a dialect, their tools and heads.

pub(crate) mod heads;
pub(crate) mod spec;
pub(crate) mod write_error;

use std::fmt;

use nalgebra::{Unit, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::words::axis_words::{AxisLetter, AxisWords};

/// An NC program before it has a dialect: what happens, in order.
///
/// The writer of a dialect puts its header, tool change and safe end around the blocks (from the
/// template), so a program of one tool holds motions and comments only and starts with a rapid.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NcProgram {
    /// In the order they are executed.
    pub blocks: Vec<Block>,
}

/// One thing an NC program says. Axis words are as programmed: mm and deg, in the work offset, with
/// the length compensation in force (see [`WordMap`](crate::word_map::WordMap)).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Block {
    /// Text for the operator; characters the control does not know are replaced.
    Comment(String),
    /// Move at rapid rate.
    Rapid {
        /// Axes that are given; the others stay.
        words: AxisWords,
    },
    /// Cutting move.
    Linear {
        /// Axes that are given; the others stay.
        words: AxisWords,
        /// In the unit of the program's [`FeedMode`]: mm/min over all axes, 1/min, or mm/min of the
        /// tip. At least half a unit of its last decimal, and not below the control's smallest.
        feed: f64,
    },
    /// The same with the directions that dialects with tool vectors name; others write it as
    /// [`Block::Linear`].
    LinearVectors {
        /// Axes that are given; the others stay.
        words: AxisWords,
        /// As in [`Block::Linear`].
        feed: f64,
        /// At the block's end.
        vectors: Box<CutVectors>,
    },
    /// Change to the tool of this number.
    ToolCall {
        /// Place in the magazine.
        number: u32,
    },
    /// Start the spindle.
    SpindleOn {
        /// Revolutions per minute, positive.
        rpm: f64,
        /// Clockwise seen from the spindle toward the tool (M3).
        clockwise: bool,
        /// Which of several, from 1: that of a head on a machine of several heads, where it must be
        /// said; `None` for the only one.
        spindle: Option<u32>,
    },
    /// Stop the spindle; of several heads all of them.
    SpindleOff,
    /// Switch the coolant.
    Coolant(Coolant),
    /// AdHocSetup still.
    Dwell {
        /// s, not negative.
        seconds: f64,
    },
    /// Select the work offset all following words refer to.
    WorkOffset(WorkOffset),
    /// Switch the length compensation on while going to `words` at rapid rate. The writer picks the
    /// compensation of the feed mode: along the axis (G43), or RTCP.
    LengthCompensation {
        /// Number of the control's length register (H).
        register: u32,
        /// Length the words were computed with, mm; written as a comment.
        length: f64,
        /// Where the axes go; at least the axis along the spindle, because a compensation without a
        /// move moves some controls and not others.
        words: AxisWords,
    },
    /// Switch the length compensation off. Some controls move the axis by the length then: the axis
    /// along the spindle should be at its reference position ([`Block::Home`]).
    LengthCompensationOff,
    /// Send these axes to the machine's reference position, directly, at rapid rate.
    Home {
        /// Which axes.
        axes: Vec<AxisLetter>,
    },
    /// Wait for the operator (M0).
    Stop,
    /// End of the program (M30). The usual template writes its own.
    End,
    /// Text of the dialect, written as it is. It must leave unit and plane as they were; absolute
    /// words, feed mode and all modal words are written anew behind it.
    Raw(String),
}

/// Directions at the end of a cutting move, in the frame that X, Y and Z count in under RTCP: that
/// of the work offset, fixed to the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutVectors {
    /// From the tip to the spindle.
    pub tool_axis: Unit<Vector3<f64>>,
    /// Outward, of the surface at the contact point.
    pub normal: Unit<Vector3<f64>>,
}

/// Meaning of F in cutting moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FeedMode {
    /// mm/min as the Euclidean norm over all axes with 1 deg counted as 1 mm.
    #[default]
    G94,
    /// Inverse time: 1/min, the reciprocal of the block's duration; given in every block.
    G93,
    /// mm/min of the tool tip under RTCP (G43.4); the words are the tip's.
    Rtcp,
}

impl FeedMode {
    /// Its name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::G94 => "g94",
            Self::G93 => "g93",
            Self::Rtcp => "rtcp",
        }
    }
}

/// Coolant state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Coolant {
    /// None (M9).
    #[default]
    Off,
    /// Flood (M8).
    Flood,
    /// Mist or air (M7).
    Mist,
}

/// A work offset of the control, by number: 1 to 6 are G54 to G59, 7 and above the additional ones
/// (G54.1 P1, …).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct WorkOffset(u16);

impl WorkOffset {
    /// Last number: six standard offsets and 300 additional ones.
    pub const MAX: u16 = 306;

    /// The offset of a number from 1 (G54) to [`WorkOffset::MAX`]; `None` for any other.
    #[must_use]
    pub fn new(number: u16) -> Option<Self> {
        (1..=Self::MAX).contains(&number).then_some(Self(number))
    }

    /// The number, from 1.
    #[must_use]
    pub fn number(self) -> u16 {
        self.0
    }
}

impl Default for WorkOffset {
    /// G54.
    fn default() -> Self {
        Self(1)
    }
}

impl fmt::Display for WorkOffset {
    /// As in G-code: `G54` … `G59`, `G54.1 P1` ….
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            n @ 1..=6 => write!(f, "G{}", 53 + n),
            n => write!(f, "G54.1 P{}", n - 6),
        }
    }
}

impl NcProgram {
    /// The words of the first motion, and whether it is a rapid; `None` without a motion.
    /// Compensation moves count, homing does not, because its end is not written in words.
    #[must_use]
    pub fn first_motion(&self) -> Option<(&AxisWords, bool)> {
        self.blocks.iter().find_map(|block| match block {
            Block::Rapid { words } | Block::LengthCompensation { words, .. } => Some((words, true)),
            Block::Linear { words, .. } | Block::LinearVectors { words, .. } => Some((words, false)),
            _ => None,
        })
    }
}
