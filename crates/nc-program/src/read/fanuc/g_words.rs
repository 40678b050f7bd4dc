//! Effects of the G and H words of a block on the modal state.

use crate::program::WorkOffset;
use crate::read::error::{ReadError, ReadFault};
use crate::read::fanuc::block::{AxisRole, FanucBlock, INCH, axis_of};
use crate::read::fanuc::lexer::FanucWord;
use crate::read::fanuc::variant::Variant;
use crate::read::modal::MotionCode;
use crate::read::program::{Compensation, MacroKind, Plane, ReadCommand};
use crate::read::unfollowed::Cause;
use crate::words::axis_lengths::AxisLengths;
use crate::words::axis_words::{AxisKind, AxisLetter};
use crate::words::said_words::StateWord;

pub(super) const RADIUS: &str = "cutter radius compensation moves the tool off the words";

pub(super) const PLANE: &str = "a tilted working plane is not followed";

const PER_TURN: &str = "a feed per revolution or a constant surface speed is not followed";

impl FanucBlock<'_> {
    /// Every G word of the block, in order.
    pub(super) fn g_words(&mut self) -> Result<(), ReadError> {
        for k in 0..self.line.words.len() {
            let word = self.line.words[k];
            if word.letter == b'G' {
                // Codes have at most one decimal; ten times the number is a whole one.
                let code = (word.value * 10.0).round();
                if (word.value * 10.0 - code).abs() > 1e-9 || !(0.0..10_000.0).contains(&code) || word.index > 0 {
                    return Err(self.fault(&word, ReadFault::UnknownWord));
                }
                self.line.words[k].is_used = true;
                self.g_word(&word, code as u16)?;
            }
        }
        Ok(())
    }

    /// `code` is ten times the G number.
    fn g_word(&mut self, word: &FanucWord, code: u16) -> Result<(), ReadError> {
        if self.variant_code(word, code)? {
            return Ok(());
        }
        let modal = &mut *self.modal;
        match code {
            0 => self.set_motion(MotionCode::Rapid),
            10 => self.set_motion(MotionCode::Linear),
            20 | 30 => self.set_motion(MotionCode::Arc { clockwise: code == 20 }),
            40 => self.role = AxisRole::Dwell,
            50 | 51 => self.look_ahead(word)?,
            // Look-ahead, exact stop, path modes: they change how exactly a path is kept, not where
            // it goes.
            80 | 610 | 611 | 620 | 630 | 640 => self.keep_mode(word),
            // Exact stop of this block, without words of its own.
            90 => self.block.commands.push(ReadCommand::Mode("G9".to_owned())),
            // States that are off: polar words, polar interpolation, scaling, mirror, rotation,
            // stroke check.
            400 => {
                self.say(StateWord::RadiusOff);
                self.end(Cause::Radius);
            }
            131 => self.end(Cause::Mapping),
            150 => self.end(Cause::Polar),
            500 => self.end(Cause::Scale),
            501 => self.end(Cause::Mirror),
            690 => {
                self.end(Cause::Turn);
                self.end(Cause::Plane);
            }
            970 => self.end(Cause::SurfaceSpeed),
            110 | 230 | 980 | 990 => {}
            520 => self.local_frame(),
            100 | 920 => self.set_role(AxisRole::Data, MacroKind::Setting),
            170 => modal.plane = Plane::Xy,
            180 => modal.plane = Plane::Zx,
            190 => modal.plane = Plane::Yz,
            200 | 210 => {
                modal.is_inch = code == 200;
                modal.set_feed_unit((code == 200).then_some(INCH));
                self.say(StateWord::Unit);
            }
            280 => self.role = AxisRole::Reference(1),
            300 => self.role = AxisRole::Reference(self.second_reference()?),
            430 => {
                self.end(Cause::Vectors);
                self.set_compensation(Compensation::Length(0));
            }
            434 => {
                self.end(Cause::Vectors);
                self.set_compensation(Compensation::Rtcp(0));
            }
            490 => {
                self.end(Cause::Vectors);
                self.say(StateWord::LengthOff);
                if self.variant != Variant::LinuxCnc {
                    self.say(StateWord::RtcpOff);
                }
                self.set_compensation(Compensation::Off);
            }
            530 => self.role = AxisRole::MachineTarget,
            540 | 550 | 560 | 570 | 580 | 590 => self.set_offset(WorkOffset::new(code / 10 - 53)),
            541 => self.additional_offset(word)?,
            650 | 660 | 670 => {
                self.set_role(AxisRole::Data, MacroKind::Call);
                self.keep_call(code == 660);
            }
            800 => modal.cycle = None,
            730 | 740 | 760 | 810 | 820 | 830 | 840 | 850 | 860 | 870 | 880 | 890 => {
                modal.cycle = Some((code / 10) as u8);
                self.has_parameters = true;
                self.keep_cycle(word);
            }
            900 | 910 => {
                modal.is_incremental = code == 910;
                self.say(StateWord::Distance);
            }
            930 | 940 => self.set_feed_mode(code == 930),
            410 | 420 | 412..=416 | 422..=426 => self.leave(Cause::Radius, RADIUS),
            435 | 437..=439 => self.leave(Cause::Vectors, "words with tool vectors are not followed"),
            440 => self.leave(Cause::Vectors, "negative length compensation is not followed"),
            450 | 460 | 470 | 480 => self.leave(Cause::Block, "an offset that lengthens the way is not followed"),
            510 => self.leave(Cause::Scale, "scaled words are not followed"),
            511 => self.leave(Cause::Mirror, "mirrored words are not followed"),
            160 => self.leave(Cause::Polar, "polar words are not followed"),
            680 => self.leave(Cause::Turn, "turned words are not followed"),
            682..=684 => self.leave(Cause::Plane, PLANE),
            950 => self.leave(Cause::Feed, PER_TURN),
            960 => self.leave(Cause::SurfaceSpeed, PER_TURN),
            24 | 34 | 62 => self.leave_path("an arc in space or a NURBS curve is not followed"),
            411 | 421 => self.leave(Cause::Forever, "an axis that turns along the path by itself is not followed"),
            _ => self.leave(Cause::Forever, "a G code that is not known here may do anything"),
        }
        Ok(())
    }

    /// G5 P and G5.1 Q switch the look-ahead, and their axis words say for which axes. On some
    /// controls G5 and G5.1 without them are splines.
    fn look_ahead(&mut self, word: &FanucWord) -> Result<(), ReadError> {
        let switch = if word.value == 5.0 { b'P' } else { b'Q' };
        if self.take(switch).is_none() || self.line.words.iter().any(|w| matches!(w.letter, b'I' | b'J')) {
            self.leave_path("a spline is not followed");
            return Ok(());
        }
        self.role = AxisRole::Data;
        self.keep_mode(word);
        Ok(())
    }

    /// Stops following words from here on.
    pub(super) fn leave(&mut self, cause: Cause, why: &'static str) {
        self.has_parameters = true;
        self.modal.unfollowed.begin(cause, why);
    }

    /// The words of this motion, and of those behind it without a motion word, are not followed.
    pub(super) fn leave_path(&mut self, why: &'static str) {
        self.modal.motion = None;
        self.modal.cycle = None;
        self.leave(Cause::Path, why);
    }

    pub(super) fn end(&mut self, cause: Cause) {
        self.modal.unfollowed.end(cause);
    }

    /// Keeps a word that says how a path is kept, with the words that may belong to it.
    pub(super) fn keep_mode(&mut self, word: &FanucWord) {
        self.has_parameters = true;
        let is_code = |w: &FanucWord| w.letter == word.letter && w.value == word.value;
        let is_own = |w: &FanucWord| is_code(w) || matches!(w.letter, b'P' | b'Q' | b'R' | b'E');
        let text = self.line.words_text(is_own);
        self.block.commands.push(ReadCommand::Mode(text));
    }

    pub(super) fn say(&mut self, word: StateWord) {
        self.block.said.add(word);
    }

    fn set_motion(&mut self, code: MotionCode) {
        self.modal.motion = Some(code);
        self.modal.cycle = None;
        self.end(Cause::Path);
        self.say(StateWord::Motion);
    }

    /// Words of this block are no positions, and what it does is not evaluated.
    pub(super) fn set_role(&mut self, role: AxisRole, kind: MacroKind) {
        self.role = role;
        self.has_parameters = true;
        if kind == MacroKind::Call {
            self.modal.forget_motion();
        } else {
            self.modal.set_frame();
        }
        self.keep_macro(kind);
    }

    /// G52: with zeros alone it switches the local frame off.
    fn local_frame(&mut self) {
        let mut axis_words = self.line.words.iter().filter(|w| axis_of(w).is_some()).peekable();
        let is_off = axis_words.peek().is_some() && axis_words.all(|w| w.is_known && w.value == 0.0);
        if is_off {
            self.role = AxisRole::Data;
            self.modal.cancel_frame();
        } else {
            self.set_role(AxisRole::Data, MacroKind::Setting);
        }
    }

    /// A word that needs no axis words switches a frame off; in a block with some, the text does
    /// not show whose they are.
    pub(super) fn frame_off(&mut self) {
        if self.line.words.iter().any(|w| axis_of(w).is_some()) {
            self.set_role(AxisRole::Data, MacroKind::Setting);
        } else {
            self.modal.cancel_frame();
        }
    }

    /// G54.2 P and G54.4 P: an offset that turns with the table, or one for how the workpiece is
    /// set. P0 switches it off; P of an unknown value may be any.
    pub(super) fn table_offset(&mut self) {
        let is_zero = |w: &FanucWord| w.letter == b'P' && w.index == 0 && w.is_known && w.value == 0.0;
        if self.line.words.iter().any(is_zero) {
            self.take(b'P');
            self.frame_off();
        } else {
            self.set_role(AxisRole::Data, MacroKind::Setting);
        }
    }

    fn set_feed_mode(&mut self, inverse_time: bool) {
        self.say(StateWord::FeedMode);
        self.modal.set_feed_mode(inverse_time);
    }

    pub(super) fn set_offset(&mut self, offset: Option<WorkOffset>) {
        if let Some(offset) = offset {
            self.say(StateWord::WorkOffset);
            self.modal.set_offset(offset);
        }
    }

    pub(super) fn additional_offset(&mut self, word: &FanucWord) -> Result<(), ReadError> {
        let number = self.take(b'P').map(|p| self.whole(&p)).transpose()?.unwrap_or(0);
        let offset = u16::try_from(number).ok().filter(|n| *n > 0).and_then(|n| WorkOffset::new(n.saturating_add(6)));
        if offset.is_none() {
            return Err(self.fault(word, ReadFault::Number));
        }
        self.set_offset(offset);
        Ok(())
    }

    fn second_reference(&mut self) -> Result<u8, ReadError> {
        let Some(word) = self.take(b'P') else {
            return Ok(2);
        };
        let number = self.whole(&word)?;
        u8::try_from(number).ok().filter(|n| (2..=4).contains(n)).ok_or_else(|| self.fault(&word, ReadFault::Number))
    }

    /// Length register of the compensation; 0 stands for the one in force.
    pub(super) fn set_compensation(&mut self, compensation: Compensation) {
        let register = self.modal.length_register.unwrap_or(0);
        // Lengths and kinematics are switched each by themselves there.
        let stays_on = self.variant == Variant::LinuxCnc && matches!(self.modal.compensation, Compensation::Rtcp(_));
        let compensation = match compensation {
            Compensation::Off if stays_on => Compensation::Rtcp(0),
            Compensation::Length(_) if stays_on => Compensation::Rtcp(register),
            Compensation::Off => Compensation::Off,
            Compensation::Length(_) => Compensation::Length(register),
            Compensation::Rtcp(_) => Compensation::Rtcp(register),
        };
        self.change_compensation(compensation);
    }

    /// H, in a block with G43 or alone. H0 has no length: it is as G49.
    pub(super) fn compensation_register(&mut self) -> Result<(), ReadError> {
        // Of the tool radius; without a radius compensation it has no effect.
        if self.take(b'D').is_some() {
            self.say(StateWord::RadiusRegister);
        }
        let named = self.take(b'H');
        if let Some(word) = named {
            self.modal.length_register = Some(self.whole(&word)?);
            self.say(StateWord::LengthRegister);
        }
        self.axis_lengths(named.is_some());
        let Some(register) = self.modal.length_register else {
            return Ok(());
        };
        let has_none = self.modal.compensation == Compensation::Rtcp(0) && !self.has_code(43.0);
        if has_none && self.variant == Variant::LinuxCnc {
            // The kinematics of the tip without a length: H alone is for nothing.
            return Ok(());
        }
        self.change_compensation(match (self.modal.compensation, register) {
            (Compensation::Off, _) | (Compensation::Length(_), 0) => Compensation::Off,
            (Compensation::Length(_), register) => Compensation::Length(register),
            (Compensation::Rtcp(_), 0) => {
                self.leave(Cause::Vectors, "RTCP without a tool length (H0) is not followed");
                return Ok(());
            }
            (Compensation::Rtcp(_), register) => Compensation::Rtcp(register),
        });
        Ok(())
    }

    /// Takes the block's compensation as one of type C.
    fn axis_lengths(&mut self, has_register: bool) {
        let is_on = self.has_code(43.0);
        if self.has_code(49.0) {
            self.modal.lengths = AxisLengths::default();
        }
        match (is_on, self.length_axis(), self.modal.length_register) {
            (true, Some(axis), Some(register)) if has_register => self.modal.lengths.set(axis, register),
            (false, ..) if !has_register && !self.has_code(43.4) => {}
            // A register in a block without G43 is for nothing while none is on.
            (false, ..) if self.modal.compensation == Compensation::Off => {}
            _ => self.modal.lengths.set_unclear(),
        }
    }

    pub(super) fn has_code(&self, code: f64) -> bool {
        self.line.words.iter().any(|w| w.letter == b'G' && w.value == code)
    }

    /// The axis that a compensation of type C acts on: that of the block's only linear word, where
    /// it has a number.
    fn length_axis(&self) -> Option<AxisLetter> {
        let mut linear = self.line.words.iter().filter_map(axis_of).filter(|a| a.kind() == AxisKind::Linear);
        linear.next().filter(|axis| axis.number() > 0 && linear.next().is_none())
    }

    /// The words of axes that do not move now would be other numbers: those along the spindle with
    /// a length, all linear ones with RTCP.
    pub(super) fn change_compensation(&mut self, compensation: Compensation) {
        let before = std::mem::replace(&mut self.modal.compensation, compensation);
        if before == compensation {
            return;
        }
        let is_rtcp = |c| matches!(c, Compensation::Rtcp(_));
        let all = is_rtcp(before) || is_rtcp(compensation);
        let named = self.length_axis().filter(|_| !all && self.has_code(43.0));
        let words = self.modal.position.words();
        for word in words.iter().filter(|w| w.letter.kind() == AxisKind::Linear) {
            // The text does not say which linear axis is along the spindle. Controls use Z unless
            // their builder, or with type C the blocks themselves, say otherwise.
            let lengths = &self.modal.lengths;
            let is_lengthened = match named {
                Some(axis) => word.letter == axis,
                None if word.letter.number() == 0 => word.letter.letter() == 'Z',
                None => {
                    word.letter.letter() == 'Z' || lengths.register_of(word.letter).is_some() || !lengths.is_clear()
                }
            };
            if all || is_lengthened {
                self.modal.position.forget_word(word.letter);
            }
        }
    }
}
