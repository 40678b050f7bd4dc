//! Reader of Siemens 840D part programs.

mod block;
mod calls;
mod g_codes;
mod items;
mod motion;
mod names;
mod statements;

use crate::dialect::Dialect;
use crate::read::error::{ReadError, ReadFault};
use crate::read::modal::Modal;
use crate::read::program::{
    CallKind, Compensation, MacroKind, NoteKind, ReadBlock, ReadCommand, ReadNote, ReadProgram, ToolLengthNote,
};
use crate::read::siemens::items::{Item, SiemensCode};
use crate::read::source;
use crate::read::source::Source;
use crate::read::values::variables::Variables;

/// Reads a Siemens 840D part program: what it says, with modal state resolved and nothing executed.
///
/// Blanks between words, either case, comments, block numbers, labels and `/` are understood;
/// `X=AC(…)`, `X=IC(…)`, `C=DC(…)`; R parameters and variables are evaluated where plain
/// assignments say their values, until a branch or a call. Cycles, subprograms, frames (TRANS, ROT,
/// …) and statements are kept with their arguments and not evaluated; where they may have moved an
/// axis or the frame of the words, positions are unknown until they are programmed again. A name
/// that stands alone in its block and that the control does not have is a subprogram. Tool vectors
/// (`A3= B3= C3=`) are kept with their motion, whose rotary axes are unknown then.
///
/// The compensation's register is the D number, which a tool change sets to 1 as controls do by
/// default.
///
/// # Errors
/// When a word is not understood or has no meaning in its block, with line, column and text.
pub fn read_siemens(text: impl AsRef<[u8]>) -> Result<ReadProgram, ReadError> {
    let reader = SiemensReader::new();
    source::read_all(text.as_ref(), Dialect::Siemens840d, reader, SiemensReader::read_line, SiemensReader::finish)
}

/// [`read_siemens`] line by line, for programs that are not held in memory.
#[derive(Debug, Default)]
pub struct SiemensReader {
    source: Source,
    state: State,
    variables: Variables,
    /// A GOTO has been read: any block with a number may be where it leads.
    has_jumped: bool,
    /// A branch that may turn out to guard nothing but an alarm.
    guard: Option<SiemensGuard>,
    /// The line in upper case, without its comment; kept for its memory.
    code: Vec<u8>,
    items: Vec<Item>,
}

/// `IF … GOTOF LABEL`, and whether the alarm (SETAL) that it jumps over has been read.
#[derive(Debug)]
struct SiemensGuard {
    number: u32,
    line: Box<[u8]>,
    label: Vec<u8>,
    has_alarm: bool,
    /// How long the tool has to be for the alarm not to be raised.
    bound: Option<ToolLengthNote>,
}

/// State that the control remembers.
#[derive(Debug, Default)]
struct State {
    modal: Modal,
    /// TRAORI.
    is_transformed: bool,
    /// D as last said, or as a tool change sets it.
    edge: Option<u32>,
    /// Feeds are inch/min (G700).
    has_inch_feed: bool,
    /// Lines are in the ISO language (G291), up to G290.
    is_iso: bool,
    /// Target of MCALL behind every motion, unless it is a drilling cycle.
    modal_call: Option<String>,
}

impl SiemensReader {
    /// A reader before the first line.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The same reader, which keeps neither the text of blocks nor comments nor lines that hold
    /// nothing else: memory for a program does not grow with what only people read.
    #[must_use]
    pub fn without_text(mut self) -> Self {
        self.source.keeps_no_text = true;
        self
    }

    /// Reads the next line (with or without its line end): its block, or `None` where it is empty.
    /// Bytes of the source are counted as if every line but the last had a line end of one byte,
    /// besides a `\r` that it still has.
    ///
    /// # Errors
    /// As [`read_siemens`].
    pub fn read_line(&mut self, line: &[u8]) -> Result<Option<ReadBlock>, ReadError> {
        self.source.next(line);
        let comment = comment_start(line);
        self.code.clear();
        self.code.extend(line[..comment.unwrap_or(line.len())].iter().map(u8::to_ascii_uppercase));
        self.source.blank_mark(&mut self.code);
        if line.trim_ascii().is_empty() {
            return Ok(None);
        }
        let mut block = self.source.block(line);
        let start = self.block_start(line, &mut block)?;
        let is_empty = self.code[start..].trim_ascii().is_empty();
        if self.source.keeps_no_text && is_empty {
            return Ok(None);
        }
        if let Some(at) = comment
            && !self.source.keeps_no_text
        {
            let text = String::from_utf8_lossy(line[at + 1..].trim_ascii()).into_owned();
            block.commands.push(ReadCommand::Comment(text));
        }
        if !is_empty {
            self.follow_guard(start);
            self.read_code(line, start, &mut block)?;
        }
        (block.compensation, block.lengths) = (self.state.modal.compensation, self.state.modal.lengths);
        Ok(Some(block))
    }

    /// Tool lengths and notes of the lines read.
    #[must_use]
    pub fn finish(mut self) -> (Vec<ToolLengthNote>, Vec<ReadNote>) {
        self.end_guard();
        self.source.finish()
    }

    /// Reads `/`, `/0` to `/9`, N and labels in front of a block; where the rest of the code
    /// starts.
    fn block_start(&mut self, line: &[u8], block: &mut ReadBlock) -> Result<usize, ReadError> {
        let code = SiemensCode { text: &self.code, source: &self.source, variables: &self.variables };
        let mut at = code.skip_blanks(0);
        // `%_N_NAME_MPF`: the name of the program in front of it.
        if code.byte(at) == Some(b'%') {
            block.commands.push(ReadCommand::Comment(self.source.text_of(line).into()));
            return Ok(self.code.len());
        }
        if code.byte(at) == Some(b'/') {
            block.skippable = true;
            at += 1 + usize::from(code.byte(at + 1).is_some_and(|b| b.is_ascii_digit()));
            at = code.skip_blanks(at);
        }
        let digits = |at: usize| code.text[at..].iter().take_while(|b| b.is_ascii_digit()).count();
        if matches!(code.byte(at), Some(b'N' | b':')) {
            let start = code.skip_blanks(at + 1);
            let end = start + digits(start.min(code.text.len()));
            if end > start {
                let text = code.string(start..end);
                let fault = |_| code.source.error(at, ReadFault::Number(code.string(at..end)));
                block.number = Some(text.parse().map_err(fault)?);
                at = code.skip_blanks(end);
            }
        }
        // Whoever jumps here has other values.
        let label = at + code.name_length(at);
        let is_label = label > at + 1 && code.byte(label) == Some(b':') && code.byte(label + 1) != Some(b'=');
        let is_guarded =
            self.guard.as_ref().is_some_and(|g| g.has_alarm && is_label && g.label == code.text[at..label]);
        if is_label {
            at = code.skip_blanks(label + 1);
        }
        if is_label || self.has_jumped && block.number.is_some() {
            self.variables.forget_all();
        }
        if let Some(guard) = self.guard.take_if(|_| is_guarded) {
            guard.bound.into_iter().for_each(|bound| bound.add_check(&mut self.source.tool_lengths));
        }
        if block.skippable {
            self.source.note(NoteKind::Skippable, line);
        }
        Ok(at)
    }

    /// A check that raises an alarm or goes on leaves the way as it is written: the branch, the
    /// alarm, M0, and the label. Any other block between makes it a branch like others, which is
    /// noted.
    fn end_guard(&mut self) {
        if let Some(guard) = self.guard.take() {
            self.source.note_line(guard.number, NoteKind::Branch, &guard.line);
        }
    }

    /// Keeps a guard open for the blocks that may stand in it.
    fn follow_guard(&mut self, start: usize) {
        let code = self.code[start..].trim_ascii();
        let is_alarm = code.starts_with(b"SETAL");
        let goes_on = self.guard.as_mut().is_some_and(|guard| {
            let goes_on = if guard.has_alarm { code == b"M0" } else { is_alarm };
            guard.has_alarm |= is_alarm;
            goes_on
        });
        if !goes_on {
            self.end_guard();
        }
    }

    /// Keeps a line of the ISO language; `false` where it is none. G290, which ends the language,
    /// stands alone.
    fn keeps_iso(&mut self, line: &[u8], start: usize, block: &mut ReadBlock) -> bool {
        let code = self.code[start..].trim_ascii();
        self.state.is_iso &= code != b"G290";
        if !self.state.is_iso {
            return false;
        }
        if matches!(code, b"M30" | b"M2" | b"M02") {
            block.commands.push(ReadCommand::End);
        }
        block.commands.push(ReadCommand::Macro { kind: MacroKind::NotFollowed, text: g_codes::ISO.to_owned() });
        block.sets_state = true;
        self.state.modal.forget_motion();
        self.variables.forget_all();
        self.source.note(NoteKind::NotEvaluated, line);
        true
    }

    fn read_code(&mut self, line: &[u8], start: usize, block: &mut ReadBlock) -> Result<(), ReadError> {
        if self.keeps_iso(line, start, block) {
            return Ok(());
        }
        let code = SiemensCode { text: &self.code, source: &self.source, variables: &self.variables };
        let name = &code.text[start..start + code.name_length(start)];
        // Most blocks begin with an address.
        let is_name = name.len() > 1 && name[1].is_ascii_alphabetic();
        let statement = str::from_utf8(name).ok().filter(|_| is_name).and_then(names::statement);
        if let Some(statement) = statement {
            return self.statement(statement, line, start, block);
        }
        self.items.clear();
        code.items(start, &mut self.items)?;
        let is_inch_feed = self.interpret(line, block)?;
        block.sets_state |= self.sets_state();
        self.note_block(line, block, is_inch_feed);
        self.assign(line, block)
    }

    /// Whether any word is neither M, S nor T nor of a dwell.
    fn sets_state(&self) -> bool {
        let is_dwell = |i: &Item| i.letter == b'G' && i.number() == Some(4.0);
        let dwells = self.items.iter().any(is_dwell);
        let is_none = |i: &Item| matches!(i.letter, b'M' | b'S' | b'T') || is_dwell(i) || dwells && i.letter == b'F';
        !self.items.iter().all(is_none)
    }

    fn note_block(&mut self, line: &[u8], block: &ReadBlock, is_inch_feed: bool) {
        let is_call =
            |c: &ReadCommand| matches!(c, ReadCommand::Macro { kind: MacroKind::Call | MacroKind::CallBehind, .. });
        let is_not_evaluated = |c: &ReadCommand| {
            use MacroKind::{NotFollowed, Setting, ToolVector, VariableWords};
            is_call(c)
                || matches!(c, ReadCommand::Macro { kind: NotFollowed | Setting | ToolVector | VariableWords, .. })
        };
        if block.commands.iter().any(is_not_evaluated) {
            self.source.note(NoteKind::NotEvaluated, line);
        }
        // A cycle of the control leaves the program's variables alone, a subprogram may set those
        // that it shares.
        let is_cycle = |c: &ReadCommand| matches!(c, ReadCommand::Call(call) if call.kind == CallKind::Cycle);
        if block.commands.iter().any(is_call) && !block.commands.iter().any(is_cycle) {
            self.variables.forget_all();
        }
        if is_inch_feed {
            self.source.note(NoteKind::InchFeed, line);
        }
    }
}

impl State {
    /// Length compensation and RTCP as D and TRAORI have them.
    fn update_compensation(&mut self) {
        let edge = self.edge.unwrap_or(0);
        self.modal.switch_compensation(match (self.is_transformed, edge) {
            (true, _) => Compensation::Rtcp(edge),
            (false, 0) => Compensation::Off,
            (false, _) => Compensation::Length(edge),
        });
    }
}

/// Byte of the `;` that begins the comment; one inside a text is none.
fn comment_start(line: &[u8]) -> Option<usize> {
    let mut is_text = false;
    line.iter().position(|byte| {
        is_text ^= *byte == b'"';
        *byte == b';' && !is_text
    })
}

/// A macro of the whole line.
fn line_macro(kind: MacroKind, line: &[u8]) -> ReadCommand {
    ReadCommand::Macro { kind, text: String::from_utf8_lossy(line.trim_ascii()).into_owned() }
}
