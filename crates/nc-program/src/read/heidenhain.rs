//! Reader of Heidenhain programs in dialogue format.

mod cycles;
mod functions;
mod guards;
mod motion;
mod parameters;
mod statements;
mod words;

use crate::dialect::Dialect;
use crate::read::error::{ReadError, ReadFault};
use crate::read::heidenhain::guards::HeidenhainGuard;
use crate::read::heidenhain::words::HeidenhainCode;
use crate::read::modal::Modal;
use crate::read::program::{
    Compensation, MacroKind, NoteKind, Plane, ReadBlock, ReadCommand, ReadNote, ReadProgram, ToolLengthNote,
};
use crate::read::source;
use crate::read::source::Source;
use crate::read::values::variables::Variables;

/// Reads a Heidenhain program in dialogue format (Klartext): what it says, with modal state
/// resolved and nothing executed.
///
/// Blanks, either case, block numbers, comments, `/` and a comma as decimal point are understood. Q
/// parameters are evaluated where FN 0 to FN 8 and formulas say their values, until a label, branch
/// or call. A branch (FN 9 to FN 12) is followed where its values say that it does not jump, and
/// where it jumps over nothing but an alarm (FN 14) and stops. Cycles, label and program calls,
/// PLANE and FUNCTION are kept with their arguments (a list of Q parameters over several lines as
/// one block for each line); where they may have moved an axis or the frame of the words, positions
/// are unknown until they are programmed again. The vectors of LN are kept with their motion.
///
/// M91 is read as the axes' own places: these blocks count neither presets nor the tool's length.
/// In a tilted plane, and of linear axes under TCPM, what it means is not known.
///
/// The compensation's register is the number of the tool, 0 for a tool that is called by its name.
///
/// # Errors
/// When a word is not understood or has no meaning in its block, with line, column and text.
pub fn read_heidenhain(text: impl AsRef<[u8]>) -> Result<ReadProgram, ReadError> {
    let reader = HeidenhainReader::new();
    source::read_all(text.as_ref(), Dialect::Heidenhain, reader, HeidenhainReader::read_line, HeidenhainReader::finish)
}

/// [`read_heidenhain`] line by line, for programs that are not held in memory.
#[derive(Debug, Default)]
pub struct HeidenhainReader {
    source: Source,
    state: State,
    variables: Variables,
    /// The line in upper case, without its comment; kept for its memory.
    code: Vec<u8>,
    /// Name of what the line before goes on with.
    continued: Option<String>,
    /// A branch that may turn out to jump over an alarm alone.
    guard: Option<HeidenhainGuard>,
}

/// State that the control remembers.
#[derive(Debug, Default)]
struct State {
    modal: Modal,
    /// M128, FUNCTION TCPM.
    has_tcpm: bool,
    /// F is along the programmed axes and not at the tip (FUNCTION TCPM F CONT).
    has_axis_feed: bool,
    /// The tool in the spindle; 0 where it is called by a name.
    tool: Option<u32>,
    /// F of TOOL CALL.
    tool_feed: Option<f64>,
    /// CC, in X, Y, Z.
    pole: [Option<f64>; 3],
    /// PR and PA as last said, mm and deg.
    polar: [Option<f64>; 2],
    /// PLANE or cycle 19 has tilted the frame of the words.
    is_tilted: bool,
    /// M126: rotary axes go the shorter way.
    goes_shorter: bool,
    /// M89: every position calls the cycle.
    calls_cycle: bool,
}

impl HeidenhainReader {
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
    /// As [`read_heidenhain`].
    pub fn read_line(&mut self, line: &[u8]) -> Result<Option<ReadBlock>, ReadError> {
        self.source.next(line);
        if line.trim_ascii().is_empty() {
            return Ok(None);
        }
        let comment = self.take_code(line);
        let mut block = self.source.block(line);
        let start = self.block_start(line, &mut block)?;
        // A heading of the structure that the control shows.
        let is_heading = self.code.get(start) == Some(&b'*');
        let is_empty = is_heading || self.code[start..].trim_ascii().is_empty();
        if self.source.keeps_no_text && is_empty {
            return Ok(None);
        }
        let text = if is_heading { Some(&line[start + 1..]) } else { comment.map(|at| &line[at + 1..]) };
        if let Some(text) = text.filter(|_| !self.source.keeps_no_text) {
            block.commands.push(ReadCommand::Comment(String::from_utf8_lossy(text.trim_ascii()).into_owned()));
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

    /// The line up to its comment in upper case, a comma between digits as a point; where the
    /// comment begins.
    fn take_code(&mut self, line: &[u8]) -> Option<usize> {
        let mut is_text = false;
        let comment = line.iter().position(|byte| {
            is_text ^= *byte == b'"';
            *byte == b';' && !is_text
        });
        self.code.clear();
        self.code.extend(line[..comment.unwrap_or(line.len())].iter().map(u8::to_ascii_uppercase));
        self.source.blank_mark(&mut self.code);
        for k in 1..self.code.len().saturating_sub(1) {
            let is_number = self.code[k - 1].is_ascii_digit() || matches!(self.code[k - 1], b'+' | b'-');
            if self.code[k] == b',' && is_number && self.code[k + 1].is_ascii_digit() {
                self.code[k] = b'.';
            }
        }
        comment
    }

    /// Reads `/` and the number in front of a block; where the rest of the code starts.
    fn block_start(&mut self, line: &[u8], block: &mut ReadBlock) -> Result<usize, ReadError> {
        let code = HeidenhainCode { text: &self.code, source: &self.source, variables: &self.variables };
        let slash = |at: usize| code.byte(at) == Some(b'/');
        let mut at = code.skip_blanks(0);
        if slash(at) {
            block.skippable = true;
            at = code.skip_blanks(at + 1);
        }
        let digits = code.text[at..].iter().take_while(|b| b.is_ascii_digit()).count();
        if digits > 0 {
            let text = code.string(at..at + digits);
            let fault = |_| code.source.error(at, ReadFault::Number(text.clone()));
            block.number = Some(text.parse().map_err(fault)?);
            at = code.skip_blanks(at + digits);
        }
        if slash(at) {
            block.skippable = true;
            at = code.skip_blanks(at + 1);
        }
        if block.skippable {
            self.source.note(NoteKind::Skippable, line);
        }
        Ok(at)
    }

    fn read_code(&mut self, line: &[u8], start: usize, block: &mut ReadBlock) -> Result<(), ReadError> {
        let goes_on = line.trim_ascii_end().last() == Some(&b'~');
        if self.code.trim_ascii_end().last() == Some(&b'~') {
            let length = self.code.trim_ascii_end().len() - 1;
            self.code.truncate(length);
        }
        block.sets_state = true;
        self.state.modal.position.start_block();
        let name = match self.continued.take() {
            Some(name) => {
                self.continuation(&name, line, start, block);
                Some(name)
            }
            None => self.statement(line, start, block)?,
        };
        let moves = block.motion.is_some();
        self.state.modal.end_block(block, moves);
        if goes_on {
            let code = HeidenhainCode { text: &self.code, source: &self.source, variables: &self.variables };
            let why = "a block that goes on in the next line, other than of a cycle";
            let name = name.ok_or_else(|| code.unsupported(start..code.text.len(), why))?;
            self.continued = Some(name);
        }
        self.note_block(line, block);
        Ok(())
    }

    fn note_block(&mut self, line: &[u8], block: &ReadBlock) {
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
        if block.commands.iter().any(is_call) {
            self.variables.forget_all();
        }
        if self.state.modal.is_inch && block.feed_place.has_word() {
            self.source.note(NoteKind::InchFeed, line);
        }
    }
}

impl State {
    /// Length compensation and RTCP as TOOL CALL and M128 have them.
    fn update_compensation(&mut self) {
        self.modal.switch_compensation(match (self.has_tcpm, self.tool) {
            (true, tool) => Compensation::Rtcp(tool.unwrap_or(0)),
            (false, None) => Compensation::Off,
            (false, Some(tool)) => Compensation::Length(tool),
        });
    }

    /// The axes of the plane, as indices of X, Y, Z.
    fn plane_axes(&self) -> [usize; 2] {
        match self.modal.plane {
            Plane::Xy => [0, 1],
            Plane::Zx => [2, 0],
            Plane::Yz => [1, 2],
        }
    }
}

/// A macro of the whole line.
fn line_macro(kind: MacroKind, line: &[u8]) -> ReadCommand {
    ReadCommand::Macro { kind, text: String::from_utf8_lossy(line.trim_ascii()).into_owned() }
}
