//! Where a block moves the axes.

use crate::read::error::ReadError;
use crate::read::fanuc::block::{AxisRole, FanucBlock, axis_of};
use crate::read::fanuc::lexer::FanucWord;
use crate::read::fanuc::variant::Variant;
use crate::read::modal::MotionCode;
use crate::read::position::AxisAt;
use crate::read::program::{ArcWords, MotionKind, ReadMotion};
use crate::read::unfollowed::Cause;
use crate::words::axis_words::{AxisKind, AxisLetter, AxisWords};

impl FanucBlock<'_> {
    /// Moves the axes that the block names, if they are targets.
    pub(super) fn motion(&mut self) -> Result<(), ReadError> {
        if !self.line.words.iter().any(|w| !w.is_used && axis_of(w).is_some()) {
            return self.motion_without_axes();
        }
        match self.role {
            AxisRole::Target | AxisRole::MachineTarget => {
                let Some(kind) = self.motion_kind() else {
                    self.no_motion_code();
                    return Ok(());
                };
                let arc = self.arc_words(kind);
                self.move_axes(kind)?;
                self.push_motion(kind, None, arc);
            }
            AxisRole::Reference(number) => {
                let via = self.return_axes(number)?;
                self.push_motion(MotionKind::ReferenceReturn, via, None);
                self.modal.end_return();
            }
            AxisRole::Data => {
                for word in &mut self.line.words {
                    word.is_used |= axis_of(word).is_some();
                }
            }
            AxisRole::Dwell => {}
        }
        Ok(())
    }

    /// A full circle names its centre only. A reference return without axes takes all of them there
    /// on Haas and LinuxCNC, and which those are the text does not tell.
    fn motion_without_axes(&mut self) -> Result<(), ReadError> {
        if matches!((self.role, self.variant), (AxisRole::Reference(_), Variant::Haas | Variant::LinuxCnc)) {
            self.skip();
            return Ok(());
        }
        let is_arc = matches!(self.modal.motion, Some(MotionCode::Arc { .. })) && self.modal.cycle.is_none();
        let has_centre = self.line.words.iter().any(|w| matches!(w.letter, b'I' | b'J' | b'K'));
        if let (AxisRole::Target, true, true, Some(MotionCode::Arc { clockwise })) =
            (self.role, is_arc, has_centre, self.modal.motion)
        {
            let kind = MotionKind::Arc { clockwise };
            let arc = self.arc_words(kind);
            self.push_motion(kind, None, arc);
        }
        Ok(())
    }

    /// Motion of the block; `None` where something that is not evaluated may have changed it.
    /// Before the first motion word it is a rapid, which is the usual default of controls;
    /// [`StateWord::Motion`] shows whether the text has said one.
    fn motion_kind(&self) -> Option<MotionKind> {
        match (self.modal.cycle, self.modal.motion) {
            (Some(code), _) => Some(MotionKind::Cycle { code }),
            (None, Some(MotionCode::Rapid)) => Some(MotionKind::Rapid),
            (None, Some(MotionCode::Linear)) => Some(MotionKind::Linear),
            (None, Some(MotionCode::Arc { clockwise })) => Some(MotionKind::Arc { clockwise }),
            (None, None) => (!self.modal.has_lost_motion).then_some(MotionKind::Rapid),
        }
    }

    fn no_motion_code(&mut self) {
        self.leave(Cause::Block, "no motion code (G0, G1, …) is known to be in force");
        for word in &mut self.line.words {
            word.is_used |= axis_of(word).is_some();
        }
    }

    fn arc_words(&mut self, kind: MotionKind) -> Option<Box<ArcWords>> {
        if matches!(kind, MotionKind::Cycle { .. }) {
            self.has_parameters = true;
        }
        if !matches!(kind, MotionKind::Arc { .. }) {
            return None;
        }
        let unit = self.length_unit();
        let mut take = |letter| self.take(letter).filter(|w| w.is_known).map(|w| w.value * unit);
        let (i, j, k, r) = (take(b'I'), take(b'J'), take(b'K'), take(b'R'));
        let mut arc = ArcWords { plane: self.modal.plane, i, j, k, r, ..ArcWords::default() };
        if self.modal.is_centre_absolute {
            arc.centre = [arc.i.take(), arc.j.take(), arc.k.take()];
        }
        if self.variant == Variant::LinuxCnc
            && let Some(turns) = self.take(b'P').filter(|w| w.is_known && w.value >= 1.0)
        {
            arc.turns = turns.value as u32 - 1;
        }
        Some(Box::new(arc))
    }

    fn move_axes(&mut self, kind: MotionKind) -> Result<(), ReadError> {
        for k in 0..self.line.words.len() {
            let word = self.line.words[k];
            let Some(axis) = axis_of(&word).filter(|_| !word.is_used) else { continue };
            self.line.words[k].is_used = true;
            let target = self.target(&word, axis);
            // Depth of the hole, from which the cycle returns to a height that it remembers.
            let is_depth = matches!(kind, MotionKind::Cycle { .. }) && axis.letter() == 'Z';
            let at = if is_depth { None } else { target };
            self.has_lost_axis |= target.is_none();
            let is_way = self.modal.is_incremental && self.role != AxisRole::MachineTarget;
            let position = &mut self.modal.position;
            let set = if is_way { position.set_way(axis, at) } else { position.set(axis, at) };
            set.map_err(|e| self.line.word_error(&word, e.into()))?;
        }
        Ok(())
    }

    /// Where a word sends its axis, `None` where it goes from an unknown place.
    fn target(&self, word: &FanucWord, axis: AxisLetter) -> Option<AxisAt> {
        if !word.is_known {
            return None;
        }
        let value = word.value * self.axis_unit(axis);
        if self.role == AxisRole::MachineTarget {
            // With G91 LinuxCNC takes them as they are; others leave G53 out, or the block, or add
            // them to where the axis is.
            let is_open = self.modal.is_incremental && self.variant != Variant::LinuxCnc;
            return (!is_open).then_some(AxisAt::Machine(value));
        }
        if !self.modal.is_incremental {
            return Some(AxisAt::Word(value));
        }
        self.modal.by(axis, value)
    }

    /// Sends the named axes to a reference position and returns the words of the point they go
    /// over, if any.
    fn return_axes(&mut self, number: u8) -> Result<Option<Box<AxisWords>>, ReadError> {
        let mut via = AxisWords::new();
        let mut is_direct = self.modal.is_incremental;
        for k in 0..self.line.words.len() {
            let word = self.line.words[k];
            let Some(axis) = axis_of(&word).filter(|_| !word.is_used) else { continue };
            self.line.words[k].is_used = true;
            is_direct &= word.value == 0.0;
            let over = self.target(&word, axis);
            let is_half_turn = axis.kind() == AxisKind::Rotary && word.value.abs() >= 180.0;
            if self.modal.is_incremental && is_half_turn {
                self.leave(Cause::Block, "an incremental way of half a turn or more to the reference is not followed");
            } else if let Some(AxisAt::Word(value)) = over {
                via.set(axis, value).map_err(|e| self.line.word_error(&word, e.into()))?;
            } else if word.is_known && word.value != 0.0 {
                self.leave(Cause::Block, "an incremental way to the reference from an unknown place is not followed");
            }
            let at = Some(AxisAt::Reference(number));
            self.modal.position.set(axis, at).map_err(|e| self.line.word_error(&word, e.into()))?;
        }
        Ok((!is_direct).then(|| Box::new(via)))
    }

    fn push_motion(&mut self, kind: MotionKind, via: Option<Box<AxisWords>>, arc: Option<Box<ArcWords>>) {
        self.block.motion = Some(ReadMotion { via, arc, ..self.modal.motion(kind, None) });
    }
}
