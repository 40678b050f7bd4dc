//! Effects of the G codes of a block on the state of the control.

use crate::program::WorkOffset;
use crate::read::error::{ReadError, ReadFault};
use crate::read::modal::MotionCode;
use crate::read::program::Plane;
use crate::read::siemens::block::{INCH, Role, SiemensBlock};
use crate::read::siemens::items::Item;
use crate::read::unfollowed::Cause;
use crate::words::said_words::StateWord;

pub(super) const ISO: &str = "the ISO language (G291) is not followed";

impl SiemensBlock<'_> {
    /// Every G code of the block, in order.
    pub(super) fn g_codes(&mut self) -> Result<(), ReadError> {
        for k in 0..self.items.len() {
            if self.items[k].letter == b'G' && !self.items[k].is_used {
                let item = self.items[k].clone();
                self.items[k].is_used = true;
                if item.index > 0 {
                    return Err(self.unsupported(&item, "a G code by the number of its group"));
                }
                match self.whole(&item).map_err(|_| self.fault(&item, ReadFault::UnknownWord))? {
                    Some(code) => self.g_code(&item, code)?,
                    None => return Err(self.unsupported(&item, "a G code that is not known")),
                }
            }
        }
        Ok(())
    }

    fn g_code(&mut self, item: &Item, code: u32) -> Result<(), ReadError> {
        let modal = &mut self.state.modal;
        match code {
            0 => self.set_motion(MotionCode::Rapid),
            1 => self.set_motion(MotionCode::Linear),
            2 | 3 => self.set_motion(MotionCode::Arc { clockwise: code == 2 }),
            4 => self.role = Role::Dwell,
            // Exact stop, path modes, feed at corners.
            9 | 60 | 62 | 64 | 601..=603 | 621 | 641..=645 => self.keep_mode(item),
            // Radius compensation off, and how it would be switched.
            40 => {
                modal.unfollowed.end(Cause::Radius);
                self.say(StateWord::RadiusOff);
            }
            140..=143 | 450 | 451 | 460..=462 => {}
            17 => modal.plane = Plane::Xy,
            18 => modal.plane = Plane::Zx,
            19 => modal.plane = Plane::Yz,
            // Limits of the working field.
            25 | 26 => self.role = Role::Data,
            53 | 153 => self.role = Role::MachineTarget,
            54..=57 | 505..=599 => self.offset(code),
            500 => self.setting(self.role),
            58 | 59 => self.setting(Role::Data),
            70 | 71 | 700 | 710 => {
                (modal.is_inch, self.state.has_inch_feed) = (matches!(code, 70 | 700), code == 700);
                modal.set_feed_unit((code == 700).then_some(INCH));
                self.say(StateWord::Unit);
            }
            74 => self.role = Role::Reference(1),
            75 => self.role = Role::Reference(self.fixed_point()?),
            90 | 91 => {
                modal.is_incremental = code == 91;
                self.say(StateWord::Distance);
            }
            93 | 94 => self.feed_mode(code == 93),
            971 => self.feed_mode(false),
            // Poles of polar words, which are refused where they stand.
            110..=112 => self.role = Role::Data,
            290 => {}
            41 | 42 => self.leave(Cause::Radius, "cutter radius compensation moves the tool off the words"),
            95..=97 | 961 | 962 | 972 | 973 => {
                self.leave(Cause::Feed, "a feed per revolution or a constant surface speed is not followed");
            }
            33..=35 | 63 | 331 | 332 => self.leave(Cause::Path, "a move that follows the spindle is not followed"),
            147 | 148 | 247 | 248 | 340 | 341 | 347 | 348 => {
                self.leave(Cause::Block, "an approach on a path of its own is not followed");
            }
            291 => {
                self.state.is_iso = true;
                self.leave(Cause::Forever, ISO);
            }
            _ => self.leave(Cause::Forever, "a G code that is not known here may do anything"),
        }
        Ok(())
    }

    fn set_motion(&mut self, code: MotionCode) {
        self.state.modal.motion = Some(code);
        self.state.modal.unfollowed.end(Cause::Path);
    }

    /// G54 to G57, then G505 and on.
    fn offset(&mut self, code: u32) {
        let number = if code < 500 { code - 53 } else { code - 500 };
        if let Some(offset) = u16::try_from(number).ok().and_then(WorkOffset::new) {
            self.say(StateWord::WorkOffset);
            self.state.modal.set_offset(offset);
        }
    }

    fn feed_mode(&mut self, inverse_time: bool) {
        self.say(StateWord::FeedMode);
        self.state.modal.set_feed_mode(inverse_time);
    }

    fn fixed_point(&mut self) -> Result<u8, ReadError> {
        let Some(item) = self.take_name("FP") else { return Ok(1) };
        let number = self.whole(&item)?.and_then(|n| u8::try_from(n).ok()).filter(|n| (1..=4).contains(n));
        number.ok_or_else(|| self.fault(&item, ReadFault::Number))
    }
}
