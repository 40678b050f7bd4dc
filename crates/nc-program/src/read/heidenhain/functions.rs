//! M functions and S of a block.

use crate::program::Coolant;
use crate::read::error::ReadError;
use crate::read::heidenhain::motion::Reading;
use crate::read::heidenhain::statements::push_call;
use crate::read::heidenhain::words::{HeidenhainWord, Key};
use crate::read::heidenhain::{State, line_macro};
use crate::read::program::{CallKind, MacroKind, ReadBlock, ReadCommand};
use crate::read::unfollowed::Cause;
use crate::words::axis_words::AxisKind;
use crate::words::said_words::StateWord;

impl State {
    /// M functions that switch nothing that words depend on. Returns whether the function is one.
    pub(super) fn simple_function(&mut self, code: u32, block: &mut ReadBlock) -> bool {
        let commands: &[ReadCommand] = match code {
            0 | 1 => &[ReadCommand::Stop { optional: code == 1 }],
            2 | 30 => &[ReadCommand::End],
            3 | 4 => &[ReadCommand::SpindleOn { clockwise: code == 3 }],
            5 => &[ReadCommand::SpindleOff],
            6 => &[ReadCommand::ToolChange],
            7 => &[ReadCommand::Coolant(Coolant::Mist)],
            8 => &[ReadCommand::Coolant(Coolant::Flood)],
            9 => &[ReadCommand::Coolant(Coolant::Off)],
            13 | 14 => &[ReadCommand::SpindleOn { clockwise: code == 13 }, ReadCommand::Coolant(Coolant::Flood)],
            // Said by other means.
            89 | 91 | 92 | 94 | 99 | 104 | 114 | 126 | 127 | 128 | 129 | 130 | 136 | 137 | 143 | 144 | 145 => &[],
            _ => &[ReadCommand::Function(code)],
        };
        block.commands.extend_from_slice(commands);
        !commands.is_empty()
    }
}

impl Reading<'_> {
    fn codes(&self) -> Vec<u32> {
        let of = |w: &HeidenhainWord| {
            let value = w.value.filter(|v| v.fract() == 0.0 && (0.0..1e6).contains(v))?;
            Some(value as u32)
        };
        self.words.iter().filter(|w| w.key == Key::Function).filter_map(of).collect()
    }

    /// Applies the functions that act at the start of the block.
    pub(super) fn functions_before(&mut self) -> Result<(), ReadError> {
        let codes = self.codes();
        if codes.len() != self.words.iter().filter(|w| w.key == Key::Function).count() {
            // Which function it is nobody knows.
            self.block.commands.push(line_macro(MacroKind::Call, self.line));
            self.state.modal.forget_motion();
        }
        for code in codes {
            let unfollowed = &mut self.state.modal.unfollowed;
            match code {
                91 => self.is_machine = true,
                92 | 130 => {
                    unfollowed
                        .begin(Cause::Block, "words of a frame that the machine's parameters hold are not followed");
                }
                114 => {
                    unfollowed.begin(Cause::Turn, "words that the control corrects for tilted axes are not followed")
                }
                115 => unfollowed.end(Cause::Turn),
                136 => unfollowed.begin(Cause::Feed, "a feed per revolution is not followed"),
                137 => self.state.modal.end_feed(),
                126 | 127 => self.state.goes_shorter = code == 126,
                128 => {
                    self.state.has_tcpm = true;
                    self.state.update_compensation();
                }
                // Rotary axes are shown within one turn, and words count so.
                94 => {
                    let words = self.state.modal.position.words();
                    for word in words.iter().filter(|w| w.letter.kind() == AxisKind::Rotary) {
                        self.state.modal.position.forget_word(word.letter);
                    }
                    self.block.commands.push(line_macro(MacroKind::Setting, self.line));
                }
                // The preset before, or none of its turn; kinematics with a head that is changed.
                104 | 143 | 144 | 145 => {
                    self.state.modal.position.forget_words();
                    self.block.commands.push(line_macro(MacroKind::Setting, self.line));
                }
                89 => {
                    self.state.calls_cycle = true;
                    push_call(self.block, CallKind::Defined, "M89".to_owned(), String::new(), true);
                }
                _ => {}
            }
        }
        for word in &self.words {
            if word.key == Key::Speed {
                self.has_unknown |= word.value.is_none();
                self.block.commands.extend(word.value.map(ReadCommand::SpindleSpeed));
            }
        }
        for code in self.codes() {
            self.state.simple_function(code, self.block);
        }
        Ok(())
    }

    /// Applies the functions that act at the end of the block.
    pub(super) fn functions_behind(&mut self) {
        for code in self.codes() {
            match code {
                129 => {
                    self.state.modal.unfollowed.end(Cause::Vectors);
                    self.block.said.add(StateWord::RtcpOff);
                    self.state.has_tcpm = false;
                    self.state.update_compensation();
                }
                // Away along the tool.
                140 => self.run_cycle("M140", MacroKind::Call),
                99 => {
                    self.state.calls_cycle = false;
                    self.run_cycle("M99", MacroKind::CallBehind);
                }
                _ => {}
            }
        }
        if self.state.calls_cycle && self.block.motion.is_some() {
            self.run_cycle("M89", MacroKind::CallBehind);
        }
    }

    fn run_cycle(&mut self, name: &str, kind: MacroKind) {
        push_call(self.block, CallKind::Defined, name.to_owned(), String::new(), false);
        self.block.commands.push(line_macro(kind, self.line));
        self.state.modal.position.forget_all();
    }
}
