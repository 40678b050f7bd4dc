use super::{
    block::{axis_of, interpret},
    lexer::{Line, Word},
    modal::Modal,
};
use crate::{MacroKind, NoteKind, ReadBlock, ReadCommand, ReadError, ReadFault, ReadNote, ReadProgram, ToolLengthNote};

/// Reads a FANUC program, or one of a control close to it: what it says, with modal state resolved and nothing executed.
///
/// Blanks inside words, missing leading zeros, either case, comments in parentheses and behind a semicolon, `/` and `%`
/// are understood. Macro text is kept and not evaluated; where it may have moved an axis, positions are unknown until
/// they are programmed again. A word that is not understood is an error: nothing is skipped silently.
///
/// Axis words without a decimal point are read in mm and deg, feeds in mm/min (and noted once), G4 P in ms where it has
/// none.
///
/// # Errors
/// When a word is not understood or has no meaning in its block, with line, column and text.
pub fn read_fanuc(text: impl AsRef<[u8]>) -> Result<ReadProgram, ReadError> {
    let mut reader = FanucReader::new();
    let mut blocks = Vec::new();
    for line in text.as_ref().split(|byte| *byte == b'\n') {
        blocks.extend(reader.read_line(line)?);
    }
    let (tool_lengths, notes) = reader.finish();
    Ok(ReadProgram { blocks, tool_lengths, notes })
}

/// [`read_fanuc`] line by line, for programs that are not held in memory.
#[derive(Debug, Default)]
pub struct FanucReader {
    modal: Modal,
    line: Line,
    line_number: u32,
    has_started: bool,
    has_ended: bool,
    /// A branch that may turn out to guard nothing but an alarm.
    guard: Option<Guard>,
    tool_lengths: Vec<ToolLengthNote>,
    notes: Vec<ReadNote>,
}

/// `IF […] GOTO n`, and whether the alarm that it jumps over has been read.
#[derive(Debug)]
struct Guard {
    line: u32,
    text: Box<str>,
    label: u32,
    has_alarm: bool,
}

impl FanucReader {
    /// A reader before the first line.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Reads the next line (with or without its line end): its block, or `None` where it is empty, a `%`, or behind the
    /// end.
    ///
    /// # Errors
    /// As [`read_fanuc`].
    pub fn read_line(&mut self, line: &[u8]) -> Result<Option<ReadBlock>, ReadError> {
        self.line_number = self.line_number.saturating_add(1);
        let trimmed = line.trim_ascii();
        if trimmed.is_empty() {
            return Ok(None);
        }
        if self.has_ended {
            self.note(NoteKind::BehindEnd, &String::from_utf8_lossy(trimmed));
            return Ok(None);
        }
        self.line.split(self.line_number, line)?;
        if self.line.code.first() == Some(&b'%') {
            return self.tape_mark();
        }
        self.has_started = true;
        let mut block = ReadBlock {
            line: self.line_number,
            number: None,
            text: String::from_utf8_lossy(trimmed).into(),
            skippable: false,
            sets_state: false,
            compensation: self.modal.compensation,
            lengths: self.modal.lengths,
            motion: None,
            commands: Vec::new(),
        };
        let start = self.block_start(&mut block)?;
        let macro_kind = self.macro_kind(start);
        if !self.line.code.is_empty() {
            self.follow_guard(&block, macro_kind);
        }
        if let Some(kind) = macro_kind {
            self.keep_macro(kind, &mut block);
            return Ok(Some(block));
        }
        self.keep_comments(&mut block);
        self.line.split_words(start)?;
        interpret(&mut self.line, &mut self.modal, &mut block)?;
        block.compensation = self.modal.compensation;
        block.lengths = self.modal.lengths;
        block.sets_state = self.line.sets_state();
        self.note_words(&block);
        Ok(Some(block))
    }

    /// Tool lengths and notes of the lines read.
    #[must_use]
    pub fn finish(mut self) -> (Vec<ToolLengthNote>, Vec<ReadNote>) {
        if let Some(guard) = self.guard.take() {
            self.note_at(guard.line, NoteKind::Branch, &guard.text);
        }
        (self.tool_lengths, self.notes)
    }

    /// A check that raises an alarm or goes on leaves the way as it is written: it takes three blocks, the branch, the
    /// alarm, and the label. Any other branch may skip blocks or repeat them, and is noted.
    fn follow_guard(&mut self, block: &ReadBlock, kind: Option<MacroKind>) {
        let mut is_guarded = false;
        if let Some(guard) = self.guard.take() {
            if !guard.has_alarm && kind == Some(MacroKind::Alarm) {
                self.guard = Some(Guard { has_alarm: true, ..guard });
                is_guarded = true;
            } else if !guard.has_alarm || block.number != Some(guard.label) {
                self.note_at(guard.line, NoteKind::Branch, &guard.text);
            }
        }
        match (kind, self.branch_label()) {
            (Some(MacroKind::Branch), Some(label)) => {
                self.guard = Some(Guard { line: block.line, text: block.text.clone(), label, has_alarm: false });
            }
            (Some(MacroKind::Branch), None) => self.note(NoteKind::Branch, &block.text),
            (Some(MacroKind::Alarm), _) if !is_guarded => self.note(NoteKind::Branch, &block.text),
            _ => {}
        }
    }

    /// The number of `IF […] GOTO n`.
    fn branch_label(&self) -> Option<u32> {
        let code = str::from_utf8(&self.line.code).ok()?;
        let (condition, label) = code.rsplit_once("GOTO")?;
        label.parse().ok().filter(|_| condition.contains("IF["))
    }

    /// The first `%` starts a program, one behind any block ends it.
    fn tape_mark(&mut self) -> Result<Option<ReadBlock>, ReadError> {
        if let Some(byte) = self.line.code.get(1) {
            return Err(self.line.error(1, ReadFault::Character(char::from(*byte))));
        }
        self.has_ended = self.has_started;
        self.has_started = true;
        Ok(None)
    }

    /// Reads `/`, `/1` to `/9`, N and O in front of a block; where the rest of the code starts.
    fn block_start(&mut self, block: &mut ReadBlock) -> Result<usize, ReadError> {
        let code = &self.line.code;
        let mut at = 0;
        if code.first() == Some(&b'/') {
            block.skippable = true;
            at = if matches!(code.get(1), Some(b'1'..=b'9')) { 2 } else { 1 };
        }
        if code.get(at) == Some(&b'N') {
            let (number, end) = self.digits(at + 1)?;
            block.number = Some(number);
            at = end;
        }
        if let Some(b'O' | b':') = code.get(at)
            && code.get(at + 1).is_some_and(u8::is_ascii_digit)
        {
            let (number, end) = self.digits(at + 1)?;
            // LinuxCNC writes its loops and subprograms as O words; those are macro text and stay whole.
            if end == code.len() {
                block.commands.push(ReadCommand::ProgramNumber(number));
                at = end;
            }
        }
        if block.skippable {
            self.note(NoteKind::Skippable, &block.text);
        }
        Ok(at)
    }

    fn digits(&self, start: usize) -> Result<(u32, usize), ReadError> {
        let code = &self.line.code;
        let end = start + code[start..].iter().take_while(|b| b.is_ascii_digit()).count();
        let text = str::from_utf8(&code[start..end]).unwrap_or_default();
        let fault = |_| self.line.error(start - 1, ReadFault::Number(format!("{}{text}", char::from(code[start - 1]))));
        text.parse().map(|number| (number, end)).map_err(fault)
    }

    /// What kind of macro text the code from `start` on is, if it is any.
    fn macro_kind(&self, start: usize) -> Option<MacroKind> {
        let code = &self.line.code[start..];
        let starts = |words: &[&[u8]]| words.iter().any(|w| code.starts_with(w));
        if starts(&[b"O"]) {
            let is_call = code.windows(4).any(|w| w == b"CALL");
            return Some(if is_call { MacroKind::Call } else { MacroKind::Branch });
        }
        if starts(&[b"IF", b"GOTO", b"WHILE", b"DO", b"END", b"THEN", b"ELSE"]) {
            return Some(MacroKind::Branch);
        }
        if let Some(variable) = code.strip_prefix(b"#") {
            return Some(assignment_kind(variable));
        }
        if !code.iter().any(|b| matches!(b, b'#' | b'[')) {
            return None;
        }
        let is_setting = starts(&[b"G10"]) && !code.get(3).is_some_and(|b| b.is_ascii_digit() || *b == b'.');
        Some(if is_setting { MacroKind::Setting } else { MacroKind::VariableWords })
    }

    fn keep_macro(&mut self, kind: MacroKind, block: &mut ReadBlock) {
        match kind {
            // What a branch leads to is read as it stands.
            MacroKind::Assignment | MacroKind::Alarm | MacroKind::Branch => {}
            MacroKind::Setting => {
                self.modal.position.forget_words();
                self.note(NoteKind::NotEvaluated, &block.text);
            }
            MacroKind::Call | MacroKind::VariableWords => {
                self.modal.forget_motion();
                self.note(NoteKind::NotEvaluated, &block.text);
            }
        }
        block.sets_state = true;
        block.commands.push(ReadCommand::Macro { kind, text: block.text.to_string() });
    }

    fn keep_comments(&mut self, block: &mut ReadBlock) {
        for comment in self.line.comments.drain(..) {
            if let Some((length, register)) = tool_length(&comment) {
                self.tool_lengths.push(ToolLengthNote { line: self.line_number, length, register });
            }
            block.commands.push(ReadCommand::Comment(comment));
        }
    }

    fn note_words(&mut self, block: &ReadBlock) {
        let is_not_evaluated = block
            .commands
            .iter()
            .any(|c| matches!(c, ReadCommand::Macro { kind: MacroKind::Call | MacroKind::Setting, .. }));
        if is_not_evaluated {
            self.note(NoteKind::NotEvaluated, &block.text);
        }
        if self.modal.is_inch && self.line.words.iter().any(|w| w.letter == b'F') {
            self.note(NoteKind::InchFeed, &block.text);
        }
        let counts = |w: &Word| w.letter == b'F' || block.motion.is_some() && axis_of(w).is_some();
        if self.line.words.iter().any(|w| !w.has_point && w.value != 0.0 && counts(w)) {
            self.note(NoteKind::NoDecimalPoint, &block.text);
        }
    }

    fn note(&mut self, kind: NoteKind, text: &str) {
        self.note_at(self.line_number, kind, text);
    }

    fn note_at(&mut self, line: u32, kind: NoteKind, text: &str) {
        match self.notes.iter_mut().find(|note| note.kind == kind) {
            Some(note) => {
                note.count += 1;
                if line < note.line {
                    (note.line, note.text) = (line, text.into());
                }
            }
            None => self.notes.push(ReadNote { line, text: text.into(), count: 1, kind }),
        }
    }
}

/// What an assignment to `#variable=…` does: common variables hold numbers, system variables hold offsets and settings.
fn assignment_kind(variable: &[u8]) -> MacroKind {
    let digits = variable.iter().take_while(|b| b.is_ascii_digit()).count();
    let number: Option<u32> = str::from_utf8(&variable[..digits]).ok().and_then(|text| text.parse().ok());
    let is_plain_name =
        variable.starts_with(b"<") && !variable.starts_with(b"<_HAL") && !variable.starts_with(b"<_INI");
    match number {
        Some(3000) => MacroKind::Alarm,
        Some(0..1000) => MacroKind::Assignment,
        None if is_plain_name => MacroKind::Assignment,
        _ => MacroKind::Setting,
    }
}

/// Length and register of a `TOOL LENGTH 420.000` or `TOOL LENGTH 420.000 H2` comment.
fn tool_length(comment: &str) -> Option<(f64, Option<u32>)> {
    let text = comment.trim().to_ascii_uppercase();
    let mut words = text.strip_prefix("TOOL LENGTH ")?.split_ascii_whitespace();
    let length: f64 = words.next()?.parse().ok()?;
    let register = match words.next() {
        Some(word) => Some(word.strip_prefix('H')?.parse().ok()?),
        None => None,
    };
    (length.is_finite() && words.next().is_none()).then_some((length, register))
}
