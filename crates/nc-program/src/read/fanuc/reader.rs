use std::io::BufRead;

use crate::read::error::{ReadError, ReadFault};
use crate::read::fanuc::block::{axis_of, interpret};
use crate::read::fanuc::lexer::{Assignment, CommentForm, FanucWord, LexedLine};
use crate::read::fanuc::macros::assignment_kind;
use crate::read::fanuc::variant::Variant;
use crate::read::feed_place::FeedPlace;
use crate::read::length_check::{LengthRelation, LengthVariables, length_check};
use crate::read::modal::Modal;
use crate::read::notes::Notes;
use crate::read::program::{
    Compensation, MacroKind, NoteKind, ReadBlock, ReadCommand, ReadNote, ReadProgram, ToolLengthNote,
};
use crate::read::source::byte_order_mark;
use crate::read::values::variables::Variables;
use crate::words::axis_lengths::AxisLengths;
use crate::words::said_words::SaidWords;

/// Reads a FANUC program, or one of a control close to it: what it says, with modal state resolved
/// and nothing executed.
///
/// Blanks inside words, missing leading zeros, either case, comments in parentheses and behind a
/// semicolon, `/` and `%` are understood. Variables are evaluated where plain assignments say their
/// values, until a branch or a call; all other macro text is kept and not evaluated. Where it may
/// have moved an axis, its position is unknown until it is programmed again. A word that is not
/// understood is an error: nothing is skipped silently.
///
/// Axis words without a decimal point are read in mm and deg, feeds in mm/min (and noted once), G4
/// P in ms where it has none.
///
/// # Errors
/// When a word is not understood or has no meaning in its block, with line, column and text.
pub fn read_fanuc(text: impl AsRef<[u8]>) -> Result<ReadProgram, ReadError> {
    FanucReader::new().read(text.as_ref())
}

/// [`read_fanuc`] line by line, for programs that are not held in memory.
#[derive(Debug, Default)]
pub struct FanucReader {
    variant: Variant,
    keeps_no_text: bool,
    pub(super) modal: Modal,
    pub(super) variables: Variables,
    /// A GOTO has been read: any block with a number may be where it leads.
    pub(super) has_jumped: bool,
    pub(super) line: LexedLine,
    line_number: u32,
    /// Bytes of the source before the line.
    n_bytes: usize,
    has_started: bool,
    has_ended: bool,
    /// Lines before the first `%`, which controls pass by.
    leader: u32,
    /// Lines are parameters of the control (G10 L50), up to G11.
    enters_parameters: bool,
    /// A branch that may turn out to guard nothing but an alarm.
    pub(super) guard: Option<FanucGuard>,
    pub(super) tool_lengths: Vec<ToolLengthNote>,
    pub(super) notes: Notes,
}

/// `IF […] GOTO n`, and whether the alarm that it jumps over has been read; or `On IF […]`, which
/// has none but comments.
#[derive(Debug)]
pub(super) struct FanucGuard {
    /// `On IF […]`, which `On ENDIF` ends.
    pub(super) is_word: bool,
    pub(super) line: u32,
    pub(super) text: Box<str>,
    pub(super) label: u32,
    pub(super) has_alarm: bool,
    /// How long the tool has to be for the alarm not to be raised.
    pub(super) bound: Option<ToolLengthNote>,
}

impl FanucReader {
    /// A reader before the first line.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    pub(crate) fn of_variant(variant: Variant) -> Self {
        Self { variant, ..Self::default() }
    }

    /// The same reader, which keeps neither the text of blocks nor comments nor lines that hold
    /// nothing else: memory for a program does not grow with what only people read.
    #[must_use]
    pub fn without_text(mut self) -> Self {
        self.keeps_no_text = true;
        self
    }

    /// Reads all lines of a text.
    pub(crate) fn read(mut self, text: &[u8]) -> Result<ReadProgram, ReadError> {
        self.pass_leader(text).unwrap_or_default();
        let mut blocks = Vec::new();
        for line in text.split(|byte| *byte == b'\n') {
            blocks.extend(self.read_line(line)?);
        }
        let dialect = self.variant.dialect();
        let (tool_lengths, notes) = self.finish();
        let file = dialect.file();
        let (rtcp_rapids, harmless_functions) = (file.rtcp_rapids(), file.harmless_functions);
        Ok(ReadProgram { dialect, blocks, tool_lengths, notes, rtcp_rapids, harmless_functions, goes_on: false })
    }

    /// Reads the next line (with or without its line end): its block, or `None` where it is empty,
    /// a `%`, or behind the end. Bytes of the source are counted as if every line but the last had
    /// a line end of one byte, besides a `\r` that it still has.
    ///
    /// # Errors
    /// As [`read_fanuc`].
    pub fn read_line(&mut self, line: &[u8]) -> Result<Option<ReadBlock>, ReadError> {
        let line_start = self.n_bytes;
        self.n_bytes += line.len() + usize::from(!line.ends_with(b"\n"));
        self.line_number = self.line_number.saturating_add(1);
        let start = if self.line_number == 1 { byte_order_mark(line) } else { 0 };
        let trimmed = line[start..].trim_ascii();
        if trimmed.is_empty() {
            return Ok(None);
        }
        if self.line_number <= self.leader {
            let text = ReadCommand::Comment(String::from_utf8_lossy(trimmed).into_owned());
            let block = || ReadBlock { commands: vec![text], ..self.empty_block(trimmed, line_start) };
            return Ok((!self.keeps_no_text).then(block));
        }
        if self.has_ended {
            self.note(NoteKind::BehindEnd, trimmed);
            return Ok(None);
        }
        if !self.has_started && trimmed.first() == Some(&b'%') {
            // Controls ignore the rest of the mark's line.
            self.has_started = true;
            return Ok(None);
        }
        let is_linuxcnc = self.variant == Variant::LinuxCnc;
        let form = CommentForm { keeps_all: !self.keeps_no_text, nests: !is_linuxcnc, runs_python: is_linuxcnc };
        self.line.split(self.line_number, line, form)?;
        if self.line.code.first() == Some(&b'%') {
            return self.tape_mark();
        }
        self.has_started = true;
        if self.keeps_no_text && self.line.code.is_empty() && !self.line.has_program {
            self.keep_comments(None);
            return Ok(None);
        }
        let mut block = self.empty_block(trimmed, line_start);
        self.read_block(trimmed, &mut block)?;
        Ok(Some(block))
    }

    /// Skips the text before the first `%` of a program that begins with one, as controls do: two
    /// lines begin with `%`, and none before the first looks like a block. Reads no more of the
    /// text than that takes.
    ///
    /// # Errors
    /// Those of the source.
    pub(crate) fn pass_leader(&mut self, mut source: impl BufRead) -> std::io::Result<()> {
        if self.variant == Variant::LinuxCnc {
            return Ok(());
        }
        let mut first = None;
        let mut line = Vec::new();
        for number in 0.. {
            line.clear();
            if source.read_until(b'\n', &mut line)? == 0 {
                break;
            }
            let start = if number == 0 { byte_order_mark(&line) } else { 0 };
            let text = line[start..].trim_ascii();
            let is_mark = text.first() == Some(&b'%');
            match first {
                // Nothing precedes it.
                None if is_mark && number == 0 => break,
                None if is_mark => first = Some(number),
                None if looks_like_a_block(text) => break,
                Some(first) if is_mark => {
                    self.leader = first;
                    break;
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn empty_block(&self, text: &[u8], line_start: usize) -> ReadBlock {
        ReadBlock {
            line: self.line_number,
            number: None,
            text: if self.keeps_no_text { Box::default() } else { String::from_utf8_lossy(text).into() },
            skippable: false,
            sets_state: false,
            said: SaidWords::default(),
            compensation: Compensation::Off,
            lengths: AxisLengths::default(),
            feed_place: FeedPlace::of_line(line_start),
            motion: None,
            commands: Vec::new(),
        }
    }

    fn read_block(&mut self, text: &[u8], block: &mut ReadBlock) -> Result<(), ReadError> {
        let start = self.block_start(block, text)?;
        if self.keeps_parameter(start, text, block) {
            return Ok(());
        }
        let macro_kind = self.macro_kind(start);
        if !self.line.code.is_empty() {
            self.follow_guard(block, macro_kind, text);
        }
        if macro_kind == Some(MacroKind::Branch) {
            self.length_check();
        }
        if matches!(macro_kind, Some(MacroKind::Branch | MacroKind::Call | MacroKind::Output)) {
            self.keep_macro(macro_kind, text, block);
        } else {
            self.keep_comments(Some(block));
            self.read_words(start, macro_kind, text, block)?;
        }
        if self.line.has_program {
            // It may move axes and set anything.
            self.variables.forget_all();
            self.modal.forget_motion();
            self.note(NoteKind::NotEvaluated, text);
            let text = String::from_utf8_lossy(text).into_owned();
            block.commands.push(ReadCommand::Macro { kind: MacroKind::Call, text });
        }
        (block.compensation, block.lengths) = (self.modal.compensation, self.modal.lengths);
        Ok(())
    }

    /// Takes note of the length that a condition compares that of the tool with.
    fn length_check(&mut self) {
        let variables = match self.variant {
            Variant::LinuxCnc => LengthVariables::Parameter,
            Variant::Fanuc | Variant::Haas | Variant::Mazak => LengthVariables::Registers,
        };
        if let Some(check) = length_check(&self.line.code, variables) {
            let note = ToolLengthNote::of_check(self.line_number, check, self.modal.is_inch);
            if note.relation == LengthRelation::Same {
                note.add_check(&mut self.tool_lengths);
            } else if let Some(guard) = self.guard.as_mut().filter(|g| g.line == note.line) {
                // Code within `On IF`, the alarm among it, runs if the condition is met; code that
                // GOTO jumps over does not.
                let relation = if guard.is_word { note.relation.opposite() } else { note.relation };
                guard.bound = Some(ToolLengthNote { relation, ..note });
            }
        }
    }

    fn read_words(
        &mut self,
        start: usize,
        macro_kind: Option<MacroKind>,
        text: &[u8],
        block: &mut ReadBlock,
    ) -> Result<(), ReadError> {
        if self.has_jumped && block.number.is_some() {
            self.variables.forget_all();
        }
        match self.line.split_words(start, self.variant, &self.variables) {
            // Controls have more kinds of variables than are read here.
            Err(_) if macro_kind.is_some() => {
                self.variables.forget_all();
                self.keep_macro(macro_kind, text, block);
                return Ok(());
            }
            split => split?,
        }
        if self.line.words.iter().any(|w| !w.is_known) && self.has_unknown_code() {
            self.keep_macro(Some(MacroKind::VariableWords), text, block);
        } else {
            if self.line.inner_skip.is_some() && !block.skippable {
                block.skippable = true;
                self.note(NoteKind::Skippable, text);
            }
            interpret(&mut self.line, self.variant, &mut self.modal, text, block)?;
            self.begin_parameters();
        }
        block.sets_state |= self.line.sets_state();
        self.note_words(block, text);
        self.assign(text, block);
        Ok(())
    }

    /// Begins the lines that are parameters of the control, where the block says so.
    fn begin_parameters(&mut self) {
        let has =
            |letter, values: &[f64]| self.line.words.iter().any(|w| w.letter == letter && values.contains(&w.value));
        let takes_them = matches!(self.variant, Variant::Fanuc | Variant::Mazak);
        self.enters_parameters |= takes_them && has(b'G', &[10.0]) && has(b'L', &[50.0, 52.0]);
    }

    /// Keeps a line that is a parameter of the control (`N1020 P1 R88`), whose N is no block
    /// number; `false` where it is none.
    fn keeps_parameter(&mut self, start: usize, text: &[u8], block: &mut ReadBlock) -> bool {
        if !self.enters_parameters || self.line.code.is_empty() {
            return false;
        }
        let behind = self.line.code[start..].strip_prefix(b"G11");
        if behind.is_some_and(|rest| rest.first().is_none_or(|b| !b.is_ascii_digit() && *b != b'.')) {
            self.enters_parameters = false;
            return false;
        }
        block.number = None;
        self.keep_comments(Some(block));
        self.keep_macro(Some(MacroKind::Setting), text, block);
        true
    }

    /// Whether what the block does depends on a variable that is not known, and not only where it
    /// goes.
    fn has_unknown_code(&self) -> bool {
        let words = &self.line.words;
        let takes_p = |w: &FanucWord| match w.letter {
            b'G' => w.value == 30.0 || w.value == 54.1 || w.value == 154.0,
            b'M' => matches!(w.value, 3.0 | 4.0 | 5.0),
            letter => letter == b'S',
        };
        let has_unknown = |letters: &[u8]| words.iter().any(|w| !w.is_known && letters.contains(&w.letter));
        has_unknown(b"GMHDN") || has_unknown(b"P") && words.iter().any(takes_p)
    }

    /// Takes note of `#1=…`, behind all words: those still had the values before.
    fn assign(&mut self, text: &[u8], block: &mut ReadBlock) {
        for k in 0..self.line.assignments.len() {
            let Assignment { name, value, start } = self.line.assignments[k].clone();
            let kind = assignment_kind(&self.line.code[start + 1..]);
            // Whether a block with `/` is run, a switch decides.
            let value = value.filter(|_| !block.skippable);
            match &name {
                Some(name) if kind == MacroKind::Assignment => self.variables.set(name, value),
                Some(_) => {}
                None => self.variables.forget_all(),
            }
            self.keep_macro(Some(kind), text, block);
        }
    }

    /// Tool lengths and notes of the lines read.
    #[must_use]
    pub fn finish(mut self) -> (Vec<ToolLengthNote>, Vec<ReadNote>) {
        if let Some(guard) = self.guard.take() {
            self.notes.add(guard.line, NoteKind::Branch, guard.text.as_bytes());
        }
        (self.tool_lengths, self.notes.finish())
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
    fn block_start(&mut self, block: &mut ReadBlock, text: &[u8]) -> Result<usize, ReadError> {
        let code = &self.line.code;
        let skip_end = |at: usize| at + 1 + usize::from(matches!(code.get(at + 1), Some(b'1'..=b'9')));
        let mut at = 0;
        if code.first() == Some(&b'/') {
            block.skippable = true;
            at = skip_end(0);
        }
        if code.get(at) == Some(&b'N') {
            let (number, end) = self.digits(at + 1)?;
            block.number = Some(number);
            at = end;
            if code.get(at) == Some(&b'/') && self.variant != Variant::LinuxCnc {
                block.skippable = true;
                at = skip_end(at);
            }
        }
        if let Some(b'O' | b':') = code.get(at)
            && code.get(at + 1).is_some_and(u8::is_ascii_digit)
        {
            let (number, end) = self.digits(at + 1)?;
            // LinuxCNC writes its loops and subprograms as O words; those are macro text and stay
            // whole.
            let is_address = |at: usize| code.get(at).is_some_and(|b| !b.is_ascii_alphabetic());
            if end == code.len() || is_address(end + 1) {
                block.commands.push(ReadCommand::ProgramNumber(number));
                at = end;
            }
        }
        if let Some(name) = program_name(&code[at..]).filter(|_| self.variant != Variant::LinuxCnc) {
            block.commands.push(ReadCommand::Comment(name));
            at = code.len();
        }
        if block.skippable {
            self.note(NoteKind::Skippable, text);
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

    fn keep_comments(&mut self, mut block: Option<&mut ReadBlock>) {
        for comment in self.line.comments.drain(..) {
            if let Some((length, register)) = tool_length(&comment) {
                self.tool_lengths.push(ToolLengthNote {
                    line: self.line_number,
                    length,
                    register,
                    relation: LengthRelation::Same,
                    check: None,
                });
            }
            if let Some(block) = &mut block {
                block.commands.push(ReadCommand::Comment(comment));
            }
        }
    }

    fn note_words(&mut self, block: &ReadBlock, text: &[u8]) {
        let is_not_evaluated = |c: &ReadCommand| {
            use MacroKind::{Call, NotFollowed, Setting, VariableWords};
            matches!(c, ReadCommand::Macro { kind: Call | NotFollowed | Setting | VariableWords, .. })
        };
        if block.commands.iter().any(is_not_evaluated) {
            self.note(NoteKind::NotEvaluated, text);
        }
        if block.commands.iter().any(|c| matches!(c, ReadCommand::Macro { kind: MacroKind::Call, .. })) {
            self.variables.forget_all();
        }
        if self.modal.is_inch && self.line.words.iter().any(|w| w.letter == b'F') {
            self.note(NoteKind::InchFeed, text);
        }
        let counts = |w: &FanucWord| w.letter == b'F' || block.motion.is_some() && axis_of(w).is_some();
        let is_pointless = |w: &FanucWord| !w.has_point && w.value != 0.0;
        if self.variant != Variant::LinuxCnc && self.line.words.iter().any(|w| is_pointless(w) && counts(w)) {
            self.note(NoteKind::NoDecimalPoint, text);
        }
    }

    pub(super) fn note(&mut self, kind: NoteKind, text: &[u8]) {
        self.notes.add(self.line_number, kind, text);
    }
}

/// Whether a line begins with a letter and a number, a comment or a variable.
fn looks_like_a_block(line: &[u8]) -> bool {
    let mut bytes = line.iter().filter(|b| !b.is_ascii_whitespace() && **b != b'/');
    let is_value = |b: &u8| b.is_ascii_digit() || matches!(b, b'+' | b'-' | b'.' | b'#' | b'[' | b'=');
    match bytes.next() {
        Some(b'(' | b'#' | b':' | b'<') => true,
        Some(letter) if letter.is_ascii_alphabetic() => bytes.next().is_some_and(is_value),
        _ => false,
    }
}

/// `<NAME>` or `O<NAME>`, which FANUC has instead of a number.
fn program_name(code: &[u8]) -> Option<String> {
    let name = code.strip_prefix(b"O").unwrap_or(code).strip_prefix(b"<")?.strip_suffix(b">")?;
    Some(String::from_utf8_lossy(name).into_owned())
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
