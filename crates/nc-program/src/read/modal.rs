use crate::program::{FeedMode, WorkOffset};
use crate::read::position::{AxisAt, ReadPosition};
use crate::read::program::{
    ArcWords, Compensation, Feed, MacroKind, MotionKind, Plane, ReadBlock, ReadCommand, ReadMotion,
};
use crate::read::unfollowed::{Cause, Unfollowed};
use crate::words::axis_lengths::AxisLengths;
use crate::words::axis_words::{AxisKind, AxisLetter};

/// State that a control remembers from block to block, as far as a program's text sets it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Modal {
    /// G0 to G3; `None` before the first and behind text that is not evaluated.
    pub(crate) motion: Option<MotionCode>,
    /// G73 to G89.
    pub(crate) cycle: Option<u8>,
    pub(crate) is_incremental: bool,
    pub(crate) is_inch: bool,
    pub(crate) plane: Plane,
    /// Arc centres are words and not ways from the start (G90.1).
    pub(crate) is_centre_absolute: bool,
    pub(crate) inverse_time: bool,
    /// mm/min that an F of 1 is, where F does not count in mm/min.
    pub(crate) inch_feed: Option<f64>,
    /// mm/min of G94.
    pub(crate) feed: Option<f64>,
    pub(crate) work_offset: WorkOffset,
    pub(crate) compensation: Compensation,
    /// The same by axis.
    pub(crate) lengths: AxisLengths,
    /// H as last said; `None` before the first, where a control takes the length of the tool or
    /// none.
    pub(crate) length_register: Option<u32>,
    pub(crate) position: ReadPosition,
    /// Whether the origin of words has been set in a way that is not resolved.
    pub(crate) has_frame: bool,
    /// Something that is not evaluated may have changed the motion word in force.
    pub(crate) has_lost_motion: bool,
    /// Why words say no positions now.
    pub(crate) unfollowed: Unfollowed,
}

/// Interpolation group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MotionCode {
    Rapid,
    Linear,
    Arc { clockwise: bool },
}

impl Modal {
    /// Something that is not evaluated may have changed everything that matters to a motion.
    pub(crate) fn forget_motion(&mut self) {
        self.motion = None;
        self.has_lost_motion = true;
        self.cycle = None;
        self.feed = None;
        self.position.forget_all();
    }

    /// Records that the origin of words is set in a way that is not resolved here: words of axes
    /// that do not move now would be other numbers.
    pub(crate) fn set_frame(&mut self) {
        self.has_frame = true;
        self.position.forget_words();
    }

    /// A frame is switched off. Where the text has set none, none is taken to be on, and words stay
    /// what they are.
    pub(crate) fn cancel_frame(&mut self) {
        if self.has_frame {
            self.position.forget_words();
        }
    }

    /// Ends a block whose words may say no positions: it moves nothing that is known then, but for
    /// axes that go to their references, and says why. Of a way to them over a point the end alone
    /// is known. `moves` tells whether it has words that would.
    pub(crate) fn end_block(&mut self, block: &mut ReadBlock, moves: bool) {
        let is_new = self.unfollowed.begins();
        let Some((why, loses_all)) = self.unfollowed.end_block() else { return };
        let home = block.motion.as_mut().filter(|m| m.kind == MotionKind::ReferenceReturn && !is_new);
        if let Some(motion) = home {
            // The point that it goes over is in words; where it ends is not.
            if motion.via.take().is_some_and(|via| !via.is_empty()) {
                block.commands.push(ReadCommand::Macro { kind: MacroKind::NotFollowed, text: why.to_owned() });
            }
            return;
        }
        if loses_all {
            self.position.forget_all();
        }
        block.motion = None;
        if is_new || moves {
            block.commands.push(ReadCommand::Macro { kind: MacroKind::NotFollowed, text: why.to_owned() });
        }
    }

    /// Ends a block that sends axes to a reference position. Under RTCP they go alone, so that the
    /// tip leaves its words: until these are named again it stays where the axes have it.
    pub(crate) fn end_return(&mut self) {
        if matches!(self.compensation, Compensation::Rtcp(_)) {
            self.position.forget_words();
        }
    }

    /// Ends a feed per turn or tooth. Its number is none of what F means from here on.
    pub(crate) fn end_feed(&mut self) {
        if self.unfollowed.has(Cause::Feed) {
            self.feed = None;
        }
        self.unfollowed.end(Cause::Feed);
    }

    /// Selects inverse time, or mm/min. The number of one is none of the other.
    pub(crate) fn set_feed_mode(&mut self, inverse_time: bool) {
        self.end_feed();
        if inverse_time != self.inverse_time {
            self.feed = None;
        }
        self.inverse_time = inverse_time;
    }

    /// Selects the unit of F: mm/min that an F of 1 is, where that is not 1. The number of one is
    /// none of the other.
    pub(crate) fn set_feed_unit(&mut self, unit: Option<f64>) {
        if unit != self.inch_feed && !self.inverse_time {
            self.feed = None;
        }
        self.inch_feed = unit;
    }

    /// Returns the current meaning of F.
    pub(crate) fn feed_mode(&self) -> FeedMode {
        match (self.inverse_time, self.compensation) {
            (true, _) => FeedMode::G93,
            (false, Compensation::Rtcp(_)) => FeedMode::Rtcp,
            (false, _) => FeedMode::G94,
        }
    }

    /// Selects a work offset; words of axes that do not move now would be other numbers.
    pub(crate) fn set_offset(&mut self, offset: WorkOffset) {
        if offset != self.work_offset {
            self.work_offset = offset;
            self.position.forget_words();
        }
    }

    /// Switches the compensation of a control whose length is along Z, or RTCP; words of axes that
    /// do not move now would be other numbers.
    pub(crate) fn switch_compensation(&mut self, compensation: Compensation) {
        let before = std::mem::replace(&mut self.compensation, compensation);
        if before == compensation {
            return;
        }
        let is_rtcp = |c| matches!(c, Compensation::Rtcp(_));
        let all = is_rtcp(before) || is_rtcp(compensation);
        let words = self.position.words();
        for word in words.iter().filter(|w| w.letter.kind() == AxisKind::Linear) {
            if all || word.letter.letter() == 'Z' {
                self.position.forget_word(word.letter);
            }
        }
    }

    /// A machine value as the axis' own place. Whether the tool's length stays in force in a block
    /// of machine values, texts do not say; under RTCP they are the tip's.
    pub(crate) fn machine_target(&self, axis: AxisLetter, value: f64) -> Option<AxisAt> {
        let is_own = match self.compensation {
            Compensation::Off => true,
            Compensation::Length(_) => axis.letter() != 'Z',
            Compensation::Rtcp(_) => axis.kind() == AxisKind::Rotary,
        };
        is_own.then_some(AxisAt::Machine(value))
    }

    /// Where an axis is `way` mm or deg from here; `None` from an unknown place.
    pub(crate) fn by(&self, axis: AxisLetter, way: f64) -> Option<AxisAt> {
        match self.position.get(axis) {
            Some(AxisAt::Word(from)) => Some(AxisAt::Word(from + way)),
            Some(AxisAt::Machine(from)) => Some(AxisAt::Machine(from + way)),
            Some(AxisAt::Reference(n)) if way == 0.0 => Some(AxisAt::Reference(n)),
            Some(AxisAt::Reference(_)) | None => None,
        }
    }

    /// A motion to the position, in the state as it is.
    pub(crate) fn motion(&self, kind: MotionKind, arc: Option<ArcWords>) -> ReadMotion {
        ReadMotion {
            kind,
            position: self.position,
            is_inch: self.is_inch,
            feed_unit: self.inch_feed.filter(|_| !self.inverse_time).unwrap_or(1.0),
            feed: self.feed.filter(|_| !kind.is_rapid()).map(|value| Feed { mode: self.feed_mode(), value }),
            feed_mode: self.feed_mode(),
            work_offset: self.work_offset,
            compensation: self.compensation,
            lengths: self.lengths,
            via: None,
            arc: arc.map(Box::new),
            tool: None,
        }
    }
}
