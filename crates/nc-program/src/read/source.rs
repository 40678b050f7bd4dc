use crate::dialect::Dialect;
use crate::read::error::{ReadError, ReadFault};
use crate::read::feed_place::FeedPlace;
use crate::read::length_check::{LengthRelation, LengthVariables, length_check};
use crate::read::notes::Notes;
use crate::read::program::{Compensation, NoteKind, ReadBlock, ReadNote, ReadProgram, ToolLengthNote};
use crate::words::axis_lengths::AxisLengths;
use crate::words::said_words::SaidWords;

/// Record of a program's lines besides their meanings.
#[derive(Debug, Default)]
pub(crate) struct Source {
    pub(crate) keeps_no_text: bool,
    pub(crate) line_number: u32,
    /// Bytes of the source before the line.
    line_start: usize,
    /// Bytes of the source before the next line.
    n_bytes: usize,
    pub(crate) notes: Notes,
    pub(crate) tool_lengths: Vec<ToolLengthNote>,
}

impl Source {
    /// Goes to the next line.
    pub(crate) fn next(&mut self, line: &[u8]) {
        self.line_start = self.n_bytes;
        self.n_bytes += line.len() + usize::from(!line.ends_with(b"\n"));
        self.line_number = self.line_number.saturating_add(1);
    }

    /// A block of this line that says nothing yet.
    pub(crate) fn block(&self, line: &[u8]) -> ReadBlock {
        ReadBlock {
            line: self.line_number,
            number: None,
            text: if self.keeps_no_text { Box::default() } else { self.text_of(line) },
            skippable: false,
            sets_state: false,
            said: SaidWords::default(),
            compensation: Compensation::Off,
            lengths: AxisLengths::default(),
            feed_place: FeedPlace::of_line(self.line_start),
            motion: None,
            commands: Vec::new(),
        }
    }

    /// The line without the mark before the first one and blanks at its ends.
    pub(crate) fn text_of(&self, line: &[u8]) -> Box<str> {
        let start = if self.line_number == 1 { byte_order_mark(line) } else { 0 };
        String::from_utf8_lossy(line[start..].trim_ascii()).into()
    }

    /// Takes the mark before the first line out of its code; bytes stay where they are.
    pub(crate) fn blank_mark(&self, code: &mut [u8]) {
        if self.line_number == 1 {
            let length = byte_order_mark(code);
            code[..length].fill(b' ');
        }
    }

    pub(crate) fn note(&mut self, kind: NoteKind, line: &[u8]) {
        self.notes.add(self.line_number, kind, line);
    }

    /// Notes a line that was read before.
    pub(crate) fn note_line(&mut self, number: u32, kind: NoteKind, line: &[u8]) {
        self.notes.add(number, kind, line);
    }

    /// An error at a byte of the line.
    pub(crate) fn error(&self, at: usize, fault: ReadFault) -> ReadError {
        ReadError { line: self.line_number, column: u32::try_from(at + 1).unwrap_or(u32::MAX), fault }
    }

    /// Takes note of the length that a line compares that of the tool with. A bound is returned: it
    /// counts where the line guards an alarm.
    pub(crate) fn length_check(
        &mut self,
        code: &[u8],
        variables: LengthVariables,
        is_inch: bool,
    ) -> Option<ToolLengthNote> {
        let note = ToolLengthNote::of_check(self.line_number, length_check(code, variables)?, is_inch);
        if note.relation != LengthRelation::Same {
            return Some(note);
        }
        note.add_check(&mut self.tool_lengths);
        None
    }

    pub(crate) fn finish(self) -> (Vec<ToolLengthNote>, Vec<ReadNote>) {
        (self.tool_lengths, self.notes.finish())
    }
}

/// Length of the mark that some editors put before the first line of a text, in bytes.
pub(crate) fn byte_order_mark(line: &[u8]) -> usize {
    if line.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 }
}

/// Reads all lines of a text.
pub(crate) fn read_all<R>(
    text: &[u8],
    dialect: Dialect,
    mut reader: R,
    read: impl Fn(&mut R, &[u8]) -> Result<Option<ReadBlock>, ReadError>,
    finish: impl FnOnce(R) -> (Vec<ToolLengthNote>, Vec<ReadNote>),
) -> Result<ReadProgram, ReadError> {
    let mut blocks = Vec::new();
    for line in text.split(|byte| *byte == b'\n') {
        blocks.extend(read(&mut reader, line)?);
    }
    let (tool_lengths, notes) = finish(reader);
    let file = dialect.file();
    let (rtcp_rapids, harmless_functions) = (file.rtcp_rapids(), file.harmless_functions);
    Ok(ReadProgram { dialect, blocks, tool_lengths, notes, rtcp_rapids, harmless_functions, goes_on: false })
}
