//! Faults of a pair of channel programs.

use facemill_nc_program::AxisLetter;

/// Place and reason of the fault that keeps two texts from being a pair of channel programs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("channel {channel}, line {line}: {fault}")]
#[non_exhaustive]
pub struct SiemensReadError {
    /// 1 or 2.
    pub channel: usize,
    /// From 1.
    pub line: u32,
    /// Fault.
    pub fault: SiemensFault,
}

/// Fault at a line of a channel program.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SiemensFault {
    /// A line that the writer does not write.
    #[error("`{0}` is not understood")]
    NotUnderstood(String),
    /// A line that the writer writes somewhere else.
    #[error("expected is {expected}")]
    NotHere {
        /// Expected text.
        expected: &'static str,
    },
    /// The text ends before its end.
    #[error("the program ends here, expected is {expected}")]
    Ends {
        /// Expected text.
        expected: &'static str,
    },
    /// An axis that the header does not send home, or that both channels do.
    #[error("axis {0} is not one of this channel's alone")]
    Axis(AxisLetter),
    /// An axis whose place is not known.
    #[error("nothing says where axis {0} is")]
    UnknownAxis(AxisLetter),
    /// More axes than a position can hold.
    #[error(transparent)]
    TooManyAxes(#[from] facemill_nc_program::words::TooManyAxes),
    /// Mark whose number does not follow that of the mark before.
    #[error("mark {found} behind mark {before}: they count up and start again at 1")]
    MarkOrder {
        /// Its number.
        found: u32,
        /// Number of the mark before, 0 before the first.
        before: u32,
    },
    /// The other channel does something else there.
    #[error("channel 1 has {first} there, this one {second}")]
    OtherChannel {
        /// In channel 1.
        first: String,
        /// In channel 2.
        second: String,
    },
}
