//! Settings of a pair, and a pair that was read.

use facemill_nc_program::dialect::{BlockNumbers, Decimals};
use facemill_nc_program::{AxisWords, FeedMode};

/// How two channel programs are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SiemensSettings {
    /// Meaning of the feeds of the program to be written: G94 (norm over all axes of both heads) or
    /// G93.
    pub program_feed: FeedMode,
    /// How F is written.
    pub feed: SiemensFeed,
    /// Most cutting blocks between two marks, at least 1. At a mark the channels stop and wait for
    /// each other.
    pub blocks_per_mark: u32,
    /// Largest number of a mark, 2 to 99; after it the numbers restart at 1. Every control accepts
    /// 9.
    pub last_mark: u32,
    /// Decimals of the words.
    pub decimals: Decimals,
    /// Block numbers (N); none where `None`.
    pub block_numbers: Option<BlockNumbers>,
}

/// How the feed of a channel is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SiemensFeed {
    /// Inverse time, 1/min: both channels must take the same time for a block, so both have the
    /// same number.
    #[default]
    G93,
    /// mm/min: norm over all axes of the channel, 1 deg as 1 mm, rounded separately in each
    /// channel.
    G94,
}

impl Default for SiemensSettings {
    /// A G93 program written with G93, a mark every 50 blocks.
    fn default() -> Self {
        Self {
            program_feed: FeedMode::G93,
            feed: SiemensFeed::default(),
            blocks_per_mark: 50,
            last_mark: 9,
            decimals: Decimals::default(),
            block_numbers: Some(BlockNumbers { start: 1, step: 1 }),
        }
    }
}

/// The texts of both channels, with `\n` line ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SiemensPair {
    /// Text of channel 1, which has the first head and the axes of no head, then of channel 2.
    pub channels: [String; 2],
}

/// Two channel programs as one.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadPair {
    /// The blocks of the body, in order.
    pub blocks: Vec<ReadPairBlock>,
    /// Numbers of all marks in order, including those of header and end; the same in both channels.
    pub marks: Vec<u32>,
    /// Tool lengths that the channels check (mm).
    pub tool_lengths: [f64; 2],
}

/// A block of both channels.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadPairBlock {
    /// G0.
    pub is_rapid: bool,
    /// Words of all axes of both channels at the end of the block.
    pub words: AxisWords,
    /// Duration of the block in each channel, s; 0 for rapids.
    pub times: [f64; 2],
    /// Number of marks before it.
    pub marks_before: usize,
    /// Its line in each channel, from 1.
    pub lines: [u32; 2],
}
