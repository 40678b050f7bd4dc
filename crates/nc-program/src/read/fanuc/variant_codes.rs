//! G codes that the relatives of FANUC have besides FANUC's own, or understand in their own way.

use crate::program::WorkOffset;
use crate::read::error::ReadError;
use crate::read::fanuc::block::{AxisRole, FanucBlock, axis_of};
use crate::read::fanuc::g_words::{PLANE, RADIUS};
use crate::read::fanuc::lexer::FanucWord;
use crate::read::fanuc::variant::Variant;
use crate::read::program::{CallKind, Compensation, MacroKind, ReadCall, ReadCommand};
use crate::read::unfollowed::Cause;
use crate::words::said_words::StateWord;

const MAPPING: &str = "cylindrical or polar interpolation is not followed";

const THREAD: &str = "a move that follows the spindle is not followed";

impl FanucBlock<'_> {
    /// Takes a G word as the variant has it; `false` where it is as on all controls. `code` is ten
    /// times its number.
    pub(super) fn variant_code(&mut self, word: &FanucWord, code: u16) -> Result<bool, ReadError> {
        match self.variant {
            Variant::Fanuc => Ok(self.common_code(code)),
            Variant::Haas => Ok(self.haas_code(word, code)? || self.common_code(code)),
            Variant::Mazak => Ok(self.mazak_code(word, code) || self.common_code(code)),
            Variant::LinuxCnc => Ok(self.linuxcnc_code(code)),
        }
    }

    /// Reads codes that FANUC and its closer relatives share beyond the table of `g_words`.
    fn common_code(&mut self, code: u16) -> bool {
        match code {
            // Stroke limits: their words are no targets.
            220 => (self.role, self.has_parameters) = (AxisRole::Data, true),
            // The way from the reference position; the tool axis along the plane's normal: the text
            // does not say where they end.
            290 | 531 => self.call_here(code),
            310 => self.skip(),
            542 | 544 => self.table_offset(),
            71 | 121 | 1121 => self.leave(Cause::Mapping, MAPPING),
            1131 => self.end(Cause::Mapping),
            330 | 331 | 340 | 350 | 360 => self.leave_path(THREAD),
            370 | 721 | 722 => self.call_here(code),
            431 => self.leave(Cause::Vectors, "a length along the tool is not followed"),
            512 => self.leave(Cause::Mirror, "polygon turning is not followed"),
            502 => self.end(Cause::Mirror),
            600 => self.leave(Cause::Block, "positions approached over another point are not followed"),
            _ => return false,
        }
        true
    }

    fn haas_code(&mut self, word: &FanucWord, code: u16) -> Result<bool, ReadError> {
        match code {
            // Pockets, probing, engraving, bolt circles, taps off the vertical.
            120 | 130 | 350 | 360 | 370 | 470 | 700 | 710 | 720 | 1500 | 1740 | 1840 | 2530 => self.call_here(code),
            770 | 1530 | 1550 | 1610..=1690 if code.is_multiple_of(10) => {
                self.modal.cycle = Some((code / 10) as u8);
                self.has_parameters = true;
                self.keep_cycle(word);
            }
            1870 => self.keep_mode(word),
            // Look-ahead limit.
            1030 => self.has_parameters = true,
            // Axes whose mirror is switched off, axes to a screen: their words are no targets.
            1000 | 1020 => {
                (self.role, self.has_parameters) = (AxisRole::Data, true);
                if code == 1000 {
                    self.end(Cause::Mirror);
                }
            }
            1100..=1290 if code.is_multiple_of(10) => self.set_offset(WorkOffset::new(code / 10 - 103)),
            1540 => self.additional_offset(word)?,
            2690 => {
                self.end(Cause::Plane);
                self.set_role(AxisRole::Data, MacroKind::Setting);
            }
            1360 | 2540 | 2550 => self.set_role(AxisRole::Data, MacroKind::Setting),
            2340 => self.set_compensation(Compensation::Rtcp(0)),
            1010 => self.leave(Cause::Mirror, "mirrored words are not followed"),
            1070 => self.leave(Cause::Mapping, MAPPING),
            1410 => self.leave(Cause::Radius, RADIUS),
            1430 => self.leave(Cause::Vectors, "length compensation by the angles of the axes is not followed"),
            2680 => self.leave(Cause::Plane, PLANE),
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn mazak_code(&mut self, word: &FanucWord, code: u16) -> bool {
        match code {
            612 => self.keep_mode(word),
            // Rotated planes switched off.
            695 => {
                self.end(Cause::Plane);
                self.has_parameters = true;
            }
            109 | 925 | 1090 => self.set_role(AxisRole::Data, MacroKind::Setting),
            685 => self.leave(Cause::Plane, PLANE),
            1100 | 1110 => self.leave(Cause::Forever, "axes of another name are not followed"),
            _ => return false,
        }
        true
    }

    fn linuxcnc_code(&mut self, code: u16) -> bool {
        match code {
            // Words are radii, as ever on a mill.
            80 => self.end(Cause::Diameter),
            921 | 922 => self.frame_off(),
            281 | 301 | 432 | 923 => self.set_role(AxisRole::Data, MacroKind::Setting),
            431 => {
                self.set_compensation(Compensation::Length(0));
                self.set_role(AxisRole::Data, MacroKind::Setting);
            }
            382..=385 => self.skip(),
            591..=593 => self.set_offset(WorkOffset::new(code - 584)),
            901 => self.modal.is_centre_absolute = true,
            911 => self.modal.is_centre_absolute = false,
            70 => self.leave(Cause::Diameter, "words that are diameters are not followed"),
            330 | 331 => self.leave_path(THREAD),
            411 | 421 => self.leave(Cause::Radius, RADIUS),
            50..=53 => self.leave_path("a spline is not followed"),
            _ => return false,
        }
        true
    }

    /// Finds the role of axis words beside a word that switches something off. Those of G50.1 name
    /// the axes whose mirror ends. Data (G11), polar interpolation (G13.1), polar words (G15),
    /// stroke limits (G23), scale (G50, G50.2) and turn (G69, G69.5) end without any of their own:
    /// beside a word that moves they are its targets; else, and where G50.1 is beside a motion,
    /// their role is unknown and the block is kept as it is. States that stay (G40, G80, G97, G98,
    /// G99) have no such doubt: words beside them go on with the motion in force.
    pub(super) fn cancelled_axes(&mut self) {
        let tenths = |w: &FanucWord| (w.value * 10.0).round() as u16;
        let has = |wanted: fn(u16) -> bool| self.line.words.iter().any(|w| w.letter == b'G' && wanted(tenths(w)));
        let ends_mirror = has(|code| code == 501);
        let ends_frame = has(|code| matches!(code, 110 | 131 | 150 | 230 | 500 | 502 | 690 | 695));
        let moves = self.role != AxisRole::Target || has(|code| matches!(code, 0 | 10 | 20 | 30 | 730..=890));
        let has_axes = self.line.words.iter().any(|w| axis_of(w).is_some());
        if self.role == AxisRole::Data || !has_axes {
            return;
        }
        if ends_mirror && !moves && !ends_frame {
            self.role = AxisRole::Data;
        } else if ends_mirror || ends_frame && !moves {
            self.set_role(AxisRole::Data, MacroKind::Setting);
        }
    }

    /// A cycle that runs here with the words of the block: the text does not say where it ends.
    fn call_here(&mut self, code: u16) {
        self.role = AxisRole::Data;
        self.has_parameters = true;
        self.modal.position.forget_all();
        self.keep_macro(MacroKind::Call);
        let number = f64::from(code) / 10.0;
        let arguments = self.line.words_text(|w| !(w.letter == b'G' && w.value == number));
        let call = ReadCall { kind: CallKind::Cycle, name: format!("G{number}"), arguments, is_modal: false };
        self.block.commands.push(ReadCommand::Call(Box::new(call)));
    }

    /// Keeps what a cycle is described with, which further positions repeat.
    pub(super) fn keep_cycle(&mut self, word: &FanucWord) {
        let name = self.line.word_text(word);
        let arguments = self.line.words_text(|w| !matches!(w.letter, b'G' | b'M' | b'F' | b'S' | b'T'));
        let call = ReadCall { kind: CallKind::Cycle, name, arguments, is_modal: true };
        self.block.commands.push(ReadCommand::Call(Box::new(call)));
    }

    /// A move that ends where the text does not tell, such as one that a probe ends.
    pub(super) fn skip(&mut self) {
        self.role = AxisRole::Data;
        self.has_parameters = true;
        self.modal.position.forget_all();
        self.keep_macro(MacroKind::VariableWords);
    }

    /// M functions that only this variant has; `false` for all others.
    pub(super) fn variant_function(&mut self, code: u32) -> bool {
        match (self.variant, code) {
            // A subprogram from elsewhere (M198); a macro whenever a signal comes (M96), a jump
            // where none does (Haas); a subprogram in the same program, or a jump (M97 of Haas).
            (Variant::Fanuc | Variant::Mazak, 96 | 198) | (Variant::Haas, 96..=97 | 198) => {
                self.set_role(AxisRole::Data, MacroKind::Call);
                self.keep_call(false);
            }
            (Variant::Haas, 16) => self.block.commands.push(ReadCommand::ToolChange),
            // Modal state comes back that was saved before; programs of the user that run outside
            // of the control.
            (Variant::LinuxCnc, 72 | 100..=199) => self.set_role(AxisRole::Data, MacroKind::Call),
            // Another tool is said to be in the spindle.
            (Variant::LinuxCnc, 61) => self.set_role(AxisRole::Data, MacroKind::Setting),
            // Kinematics of the tip, and of the joints, as all sample configurations with a table
            // or a head call them.
            (Variant::LinuxCnc, 428 | 429) => {
                self.has_parameters = true;
                if code == 429 {
                    self.say(StateWord::RtcpOff);
                }
                self.change_compensation(match (code, self.modal.compensation) {
                    (428, Compensation::Off) => Compensation::Rtcp(0),
                    (428, Compensation::Length(register)) => Compensation::Rtcp(register),
                    (429, Compensation::Rtcp(0)) => Compensation::Off,
                    (429, Compensation::Rtcp(register)) => Compensation::Length(register),
                    (_, before) => before,
                });
            }
            _ => return false,
        }
        true
    }
}
