use crate::{AxisLengths, Compensation, FeedMode, Plane, ReadPosition, WorkOffset};

/// What a control remembers from block to block, as far as a program's text tells.
#[derive(Clone, Debug, Default)]
pub(super) struct Modal {
    /// G0 to G3; `None` before the first and behind text that is not evaluated.
    pub(super) motion: Option<MotionCode>,
    /// G73 to G89.
    pub(super) cycle: Option<u8>,
    pub(super) is_incremental: bool,
    pub(super) is_inch: bool,
    pub(super) plane: Plane,
    pub(super) inverse_time: bool,
    /// mm/min of G94.
    pub(super) feed: Option<f64>,
    pub(super) work_offset: WorkOffset,
    pub(super) compensation: Compensation,
    /// The same by axis.
    pub(super) lengths: AxisLengths,
    /// H as last said; `None` before the first, where a control takes the length of the tool or none.
    pub(super) length_register: Option<u32>,
    pub(super) position: ReadPosition,
}

/// Interpolation group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MotionCode {
    Rapid,
    Linear,
    Arc { clockwise: bool },
}

impl Modal {
    /// Something that is not evaluated may have changed everything that matters to a motion.
    pub(super) fn forget_motion(&mut self) {
        self.motion = None;
        self.cycle = None;
        self.feed = None;
        self.position.forget_all();
    }

    /// What F means now.
    pub(super) fn feed_mode(&self) -> FeedMode {
        match (self.inverse_time, self.compensation) {
            (true, _) => FeedMode::G93,
            (false, Compensation::Rtcp(_)) => FeedMode::Rtcp,
            (false, _) => FeedMode::G94,
        }
    }
}
