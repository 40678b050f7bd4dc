//! What the words of one block do to the modal state, and where they move the axes.

use super::{
    lexer::{Line, Word},
    modal::Modal,
};
use crate::{AxisKind, AxisLetter, Coolant, MacroKind, ReadBlock, ReadCommand, ReadError, ReadFault};

/// mm per inch.
const INCH: f64 = 25.4;

/// What the axis words of a block are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AxisRole {
    /// Where to go, in the work offset.
    Target,
    /// Where to go, in machine values (G53).
    MachineTarget,
    /// Over this point to a reference position of this number (G28, G30).
    Reference(u8),
    /// A time (G4).
    Dwell,
    /// Values of a setting or arguments of a call.
    Data,
}

/// Resolves the words of `line` and fills the block.
pub(super) fn interpret(line: &mut Line, modal: &mut Modal, block: &mut ReadBlock) -> Result<(), ReadError> {
    check_repeated(line)?;
    let mut reading = BlockReading { line, modal, block, role: AxisRole::Target, has_parameters: false };
    reading.modal.position.start_block();
    reading.g_words()?;
    reading.spindle_number()?;
    reading.m_words()?;
    reading.compensation_register()?;
    reading.feed_and_speed()?;
    reading.dwell()?;
    reading.motion()?;
    reading.check_all_used()
}

/// Every word but G and M stands once in a block.
fn check_repeated(line: &Line) -> Result<(), ReadError> {
    for (k, word) in line.words.iter().enumerate() {
        let is_same = |other: &Word| other.letter == word.letter && other.index == word.index;
        if !matches!(word.letter, b'G' | b'M') && line.words[..k].iter().any(is_same) {
            return Err(line.word_error(word, ReadFault::Repeated(line.word_text(word))));
        }
    }
    Ok(())
}

/// A block being read. Its G words are in `g_words`, its moves in `motion`.
pub(super) struct BlockReading<'a> {
    pub(super) line: &'a mut Line,
    pub(super) modal: &'a mut Modal,
    pub(super) block: &'a mut ReadBlock,
    pub(super) role: AxisRole,
    /// Whether the block may hold P, Q, R, I, J, K, L.
    pub(super) has_parameters: bool,
}

impl BlockReading<'_> {
    /// P behind S, M3, M4 or M5: which spindle they are for. Behind other M functions it is theirs.
    fn spindle_number(&mut self) -> Result<(), ReadError> {
        let is_switch = |w: &Word| w.letter == b'M' && matches!(w.value, 3.0 | 4.0 | 5.0);
        let words = &self.line.words;
        let is_for_spindle = words.iter().any(|w| w.letter == b'S' || is_switch(w));
        let has_other = words.iter().any(|w| w.letter == b'M' && !is_switch(w));
        if self.role != AxisRole::Target || self.has_parameters || has_other || !is_for_spindle {
            return Ok(());
        }
        if let Some(word) = self.take(b'P') {
            let number = self.whole(&word)?;
            self.block.commands.push(ReadCommand::Spindle(number));
        }
        Ok(())
    }

    fn m_words(&mut self) -> Result<(), ReadError> {
        for k in 0..self.line.words.len() {
            let word = self.line.words[k];
            if word.letter == b'M' {
                let code = self.whole(&word)?;
                self.line.words[k].is_used = true;
                self.m_word(code);
            }
        }
        Ok(())
    }

    fn m_word(&mut self, code: u32) {
        let command = match code {
            0 | 1 => ReadCommand::Stop { optional: code == 1 },
            2 | 30 => ReadCommand::End,
            3 | 4 => ReadCommand::SpindleOn { clockwise: code == 3 },
            5 => ReadCommand::SpindleOff,
            6 => ReadCommand::ToolChange,
            7 => ReadCommand::Coolant(Coolant::Mist),
            8 => ReadCommand::Coolant(Coolant::Flood),
            9 => ReadCommand::Coolant(Coolant::Off),
            98 | 99 => return self.set_role(AxisRole::Data, MacroKind::Call),
            _ => {
                self.has_parameters = true;
                ReadCommand::Function(code)
            }
        };
        self.block.commands.push(command);
    }

    fn feed_and_speed(&mut self) -> Result<(), ReadError> {
        if let Some(word) = self.take(b'T') {
            let number = self.whole(&word)?;
            self.block.commands.push(ReadCommand::Tool(number));
        }
        if let Some(word) = self.take(b'S') {
            self.block.commands.push(ReadCommand::SpindleSpeed(word.value));
        }
        if let Some(word) = self.take(b'F') {
            let unit = if self.modal.is_inch && !self.modal.inverse_time { INCH } else { 1.0 };
            self.modal.feed = Some(word.value * unit);
        } else if self.modal.inverse_time {
            // The time of another block is none of this one's.
            self.modal.feed = None;
        }
        Ok(())
    }

    /// G4 P in ms without a decimal point, otherwise and with X or U in s.
    fn dwell(&mut self) -> Result<(), ReadError> {
        if self.role != AxisRole::Dwell {
            return Ok(());
        }
        let seconds = if let Some(word) = self.take(b'P') {
            if word.has_point { word.value } else { word.value * 1e-3 }
        } else if let Some(word) = self.take(b'X').or_else(|| self.take(b'U')) {
            word.value
        } else {
            0.0
        };
        self.block.commands.push(ReadCommand::Dwell(seconds));
        Ok(())
    }

    fn check_all_used(&self) -> Result<(), ReadError> {
        // Calls pass any letter on.
        let any_letter = self.role == AxisRole::Data;
        for word in self.line.words.iter().filter(|w| !w.is_used) {
            let is_parameter = word.index == 0 && matches!(word.letter, b'P' | b'Q' | b'R' | b'I' | b'J' | b'K' | b'L');
            let is_known = is_parameter || axis_of(word).is_some();
            if self.has_parameters && (is_parameter || any_letter) {
                continue;
            }
            return Err(self.fault(word, if is_known { ReadFault::StrayWord } else { ReadFault::UnknownWord }));
        }
        Ok(())
    }

    /// The word of a letter that nothing has used, marked as used.
    pub(super) fn take(&mut self, letter: u8) -> Option<Word> {
        let word = self.line.words.iter_mut().find(|w| w.letter == letter && w.index == 0 && !w.is_used)?;
        word.is_used = true;
        Some(*word)
    }

    pub(super) fn whole(&self, word: &Word) -> Result<u32, ReadError> {
        let is_whole = word.index == 0 && word.value.fract() == 0.0 && (0.0..=99_999_999.0).contains(&word.value);
        if is_whole { Ok(word.value as u32) } else { Err(self.fault(word, ReadFault::Number)) }
    }

    pub(super) fn axis_unit(&self, axis: AxisLetter) -> f64 {
        if axis.kind() == AxisKind::Linear { self.length_unit() } else { 1.0 }
    }

    pub(super) fn length_unit(&self) -> f64 {
        if self.modal.is_inch { INCH } else { 1.0 }
    }

    pub(super) fn fault(&self, word: &Word, fault: impl FnOnce(String) -> ReadFault) -> ReadError {
        self.line.word_error(word, fault(self.line.word_text(word)))
    }

    pub(super) fn unsupported(&self, word: &Word, why: &'static str) -> ReadError {
        self.fault(word, |word| ReadFault::Unsupported { word, why })
    }
}

/// The axis that a word is of.
pub(super) fn axis_of(word: &Word) -> Option<AxisLetter> {
    AxisLetter::new(char::from(word.letter), word.index)
}
