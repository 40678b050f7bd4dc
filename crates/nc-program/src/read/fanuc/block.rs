//! Effects of the words of one block on the modal state, and its motion.

use crate::program::Coolant;
use crate::read::error::{ReadError, ReadFault};
use crate::read::fanuc::lexer::{FanucWord, LexedLine};
use crate::read::fanuc::variant::Variant;
use crate::read::modal::Modal;
use crate::read::program::{CallKind, MacroKind, ReadBlock, ReadCall, ReadCommand};
use crate::read::unfollowed::Cause;
use crate::words::axis_words::{AxisKind, AxisLetter};
use crate::words::said_words::StateWord;

/// mm per inch.
pub(super) const INCH: f64 = 25.4;

/// Role of the axis words of a block.
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

/// Resolves the words of `line`, whose text is `text`, and fills the block.
pub(super) fn interpret(
    line: &mut LexedLine,
    variant: Variant,
    modal: &mut Modal,
    text: &[u8],
    block: &mut ReadBlock,
) -> Result<(), ReadError> {
    check_repeated(line, variant)?;
    let mut reading = FanucBlock {
        line,
        variant,
        modal,
        text,
        block,
        role: AxisRole::Target,
        has_parameters: false,
        has_lost_axis: false,
        names_axes: false,
    };
    reading.modal.position.start_block();
    reading.g_words()?;
    reading.corners();
    reading.cancelled_axes();
    reading.unfollowed_words();
    reading.spindle_number()?;
    reading.m_words()?;
    reading.compensation_register()?;
    reading.feed_and_speed()?;
    reading.dwell()?;
    reading.motion()?;
    reading.feed_place();
    reading.variable_words();
    reading.check_all_used()?;
    reading.end_block();
    Ok(())
}

/// Every word but G and M occurs once in a block; on Mazak controls a second T makes the next tool
/// ready.
fn check_repeated(line: &LexedLine, variant: Variant) -> Result<(), ReadError> {
    for (k, word) in line.words.iter().enumerate() {
        let is_same = |other: &FanucWord| other.letter == word.letter && other.index == word.index;
        let may_repeat = matches!(word.letter, b'G' | b'M') || word.letter == b'T' && variant == Variant::Mazak;
        if !may_repeat && line.words[..k].iter().any(is_same) {
            return Err(line.word_error(word, ReadFault::Repeated(line.word_text(word))));
        }
    }
    Ok(())
}

/// A block being read. Its G words are in `g_words`, its moves in `motion`.
pub(super) struct FanucBlock<'a> {
    pub(super) line: &'a mut LexedLine,
    pub(super) variant: Variant,
    pub(super) modal: &'a mut Modal,
    /// The line without blanks at its ends.
    text: &'a [u8],
    pub(super) block: &'a mut ReadBlock,
    pub(super) role: AxisRole,
    /// Whether the block may hold P, Q, R, I, J, K, L.
    pub(super) has_parameters: bool,
    /// A word moves its axis to a place that is not known: by a variable, or by a way from an
    /// unknown place.
    pub(super) has_lost_axis: bool,
    /// The block has words of axes.
    names_axes: bool,
}

impl FanucBlock<'_> {
    /// `,R5.` and `,C2.` round or chamfer the corner at the end of the block; `,A30.` is the angle
    /// of a line, whose end another word follows from. `@` and `^` are distance and angle from a
    /// pole. A comment that a control may take for words is none of these, and as unclear.
    fn corners(&mut self) {
        for word in &mut self.line.words {
            let (cause, why) = match word.letter {
                b'r' => (Cause::Corner, "the corner is rounded (,R), which is not followed"),
                b'c' => (Cause::Corner, "the corner is chamfered (,C), which is not followed"),
                b'a' => (Cause::Block, "a line by its angle (,A) is not followed"),
                b'@' | b'^' => (Cause::Block, "polar words (@, ^) are not followed"),
                _ => continue,
            };
            word.is_used = true;
            self.modal.unfollowed.begin(cause, why);
        }
        if self.line.has_doubtful_comment {
            let why =
                "parentheses inside the comment: a control may end it at the first `)` and run the text behind it";
            self.modal.unfollowed.begin(Cause::Block, why);
        }
    }

    /// Words say no positions while what they do is not followed; of a corner they do, for later
    /// ones.
    fn unfollowed_words(&mut self) {
        self.names_axes = self.line.words.iter().any(|w| axis_of(w).is_some());
        let is_home = matches!(self.role, AxisRole::Reference(_) | AxisRole::Dwell);
        if self.modal.unfollowed.loses_all() && !is_home {
            (self.role, self.has_parameters) = (AxisRole::Data, true);
        }
    }

    fn end_block(&mut self) {
        self.modal.end_block(self.block, self.names_axes);
    }

    /// P behind S, M3, M4 or M5: which spindle they are for. Behind other M functions it is theirs.
    fn spindle_number(&mut self) -> Result<(), ReadError> {
        let is_switch = |w: &FanucWord| w.letter == b'M' && matches!(w.value, 3.0 | 4.0 | 5.0);
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
            98 | 99 => {
                if code == 99 {
                    self.say(StateWord::Return);
                }
                self.set_role(AxisRole::Data, MacroKind::Call);
                if code == 98 {
                    self.keep_call(false);
                }
                return;
            }
            _ if self.variant_function(code) => return,
            _ => {
                self.has_parameters = true;
                ReadCommand::Function(code)
            }
        };
        self.block.commands.push(command);
    }

    fn feed_and_speed(&mut self) -> Result<(), ReadError> {
        // S and T of a macro call are its arguments, and S of G92 is the largest speed that there
        // may be.
        let is_macro = self.has_code(65.0) || self.has_code(66.0);
        if !is_macro {
            self.tools()?;
        }
        let speed = if is_macro || self.has_code(92.0) { None } else { self.take(b'S') };
        if let Some(word) = speed.filter(|w| w.is_known) {
            self.block.commands.push(ReadCommand::SpindleSpeed(word.value));
        }
        // Of a call it is an argument.
        let word = if self.is_call() { None } else { self.take(b'F') };
        if let Some(word) = word {
            let unit = if self.modal.is_inch && !self.modal.inverse_time { INCH } else { 1.0 };
            self.modal.feed = word.is_known.then_some(word.value * unit);
            let (bytes, number) = self.line.word_bytes(&word);
            self.block.feed_place.set_word(bytes, number);
        } else if self.modal.inverse_time {
            // The time of another block is none of this one's.
            self.modal.feed = None;
        }
        Ok(())
    }

    fn tools(&mut self) -> Result<(), ReadError> {
        let mut is_first = true;
        while let Some(word) = self.take(b'T') {
            let is_named = self.variant == Variant::Mazak && word.is_known && word.value.fract() != 0.0;
            let command = match (is_named, is_first) {
                (true, true) => ReadCommand::ToolName(self.line.word_text(&word)[1..].to_owned()),
                (true, false) => continue,
                (false, _) if !word.is_known => continue,
                (false, true) => ReadCommand::Tool(self.whole(&word)?),
                (false, false) => ReadCommand::NextTool(self.whole(&word)?),
            };
            self.block.commands.push(command);
            is_first = false;
        }
        Ok(())
    }

    fn is_call(&self) -> bool {
        let is_call = |c: &ReadCommand| matches!(c, ReadCommand::Macro { kind: MacroKind::Call, .. });
        self.role == AxisRole::Data && self.block.commands.iter().any(is_call)
    }

    /// Where a feed belongs in a block that has none.
    fn feed_place(&mut self) {
        if self.block.motion.is_some() && !self.block.feed_place.has_word() {
            self.block.feed_place.set_insert(self.line.code_end());
        }
    }

    /// Tells that words of the block have values that are not known.
    fn variable_words(&mut self) {
        let is_unknown = self.has_lost_axis || self.line.words.iter().any(|w| !w.is_known);
        if self.role != AxisRole::Data && is_unknown {
            self.keep_macro(MacroKind::VariableWords);
        }
    }

    pub(super) fn keep_macro(&mut self, kind: MacroKind) {
        let text = String::from_utf8_lossy(self.text).into_owned();
        self.block.commands.push(ReadCommand::Macro { kind, text });
    }

    /// Keeps what a block calls: the number behind P, and all other words as arguments.
    pub(super) fn keep_call(&mut self, is_modal: bool) {
        let is_name = |w: &&FanucWord| w.letter == b'P';
        let name =
            self.line.words.iter().find(is_name).map_or(String::new(), |w| self.line.word_text(w)[1..].to_owned());
        let arguments = self.line.words_text(|w| !matches!(w.letter, b'G' | b'M' | b'P'));
        let call = ReadCall { kind: CallKind::Subprogram, name, arguments, is_modal };
        self.block.commands.push(ReadCommand::Call(Box::new(call)));
    }

    /// G4 P in ms without a decimal point, otherwise and with X or U in s.
    fn dwell(&mut self) -> Result<(), ReadError> {
        if self.role != AxisRole::Dwell {
            return Ok(());
        }
        let seconds = if let Some(word) = self.take(b'P') {
            if word.has_point || self.variant == Variant::LinuxCnc { word.value } else { word.value * 1e-3 }
        } else if let Some(word) = self.take(b'X').or_else(|| self.take(b'U')) {
            word.value
        } else {
            0.0
        };
        if seconds.is_finite() {
            self.block.commands.push(ReadCommand::Dwell(seconds));
        }
        Ok(())
    }

    fn check_all_used(&self) -> Result<(), ReadError> {
        // Calls pass any letter on.
        let any_letter = self.role == AxisRole::Data;
        for word in self.line.words.iter().filter(|w| !w.is_used) {
            let is_letter = matches!(word.letter, b'P' | b'Q' | b'R' | b'I' | b'J' | b'K' | b'L')
                || matches!(word.letter, b'E' | b'D') && self.variant != Variant::Fanuc;
            let is_parameter = word.index == 0 && is_letter;
            let is_known = is_parameter || axis_of(word).is_some();
            if self.has_parameters && (is_parameter || any_letter) {
                continue;
            }
            return Err(self.fault(word, if is_known { ReadFault::StrayWord } else { ReadFault::UnknownWord }));
        }
        Ok(())
    }

    /// The word of a letter that nothing has used, marked as used.
    pub(super) fn take(&mut self, letter: u8) -> Option<FanucWord> {
        let word = self.line.words.iter_mut().find(|w| w.letter == letter && w.index == 0 && !w.is_used)?;
        word.is_used = true;
        Some(*word)
    }

    pub(super) fn whole(&self, word: &FanucWord) -> Result<u32, ReadError> {
        let is_whole =
            word.index == 0 && word.is_known && word.value.fract() == 0.0 && (0.0..=99_999_999.0).contains(&word.value);
        if is_whole { Ok(word.value as u32) } else { Err(self.fault(word, ReadFault::Number)) }
    }

    pub(super) fn axis_unit(&self, axis: AxisLetter) -> f64 {
        if axis.kind() == AxisKind::Linear { self.length_unit() } else { 1.0 }
    }

    pub(super) fn length_unit(&self) -> f64 {
        if self.modal.is_inch { INCH } else { 1.0 }
    }

    pub(super) fn fault(&self, word: &FanucWord, fault: impl FnOnce(String) -> ReadFault) -> ReadError {
        self.line.word_error(word, fault(self.line.word_text(word)))
    }
}

/// The axis that a word is of.
pub(super) fn axis_of(word: &FanucWord) -> Option<AxisLetter> {
    AxisLetter::new(char::from(word.letter), word.index)
}
