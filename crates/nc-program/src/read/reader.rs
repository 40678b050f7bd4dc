use std::io::BufRead;

use crate::dialect::Dialect;
use crate::read::error::ReadError;
use crate::read::fanuc::FanucReader;
use crate::read::heidenhain::HeidenhainReader;
use crate::read::program::{ReadBlock, ReadNote, ToolLengthNote};
use crate::read::siemens::SiemensReader;

/// Reads a program of any dialect line by line, for programs that are not held in memory:
/// [`crate::read_program`] without the whole.
#[derive(Debug)]
pub struct ProgramReader(Inner);

#[derive(Debug)]
enum Inner {
    Fanuc(Box<FanucReader>),
    Siemens(Box<SiemensReader>),
    Heidenhain(Box<HeidenhainReader>),
}

impl ProgramReader {
    /// A reader before the first line.
    #[must_use]
    pub fn new(dialect: Dialect) -> Self {
        let fanuc = |reader: FanucReader| Inner::Fanuc(Box::new(reader.without_text()));
        Self(match dialect {
            Dialect::Fanuc => fanuc(FanucReader::new()),
            Dialect::Haas => fanuc(FanucReader::haas()),
            Dialect::Mazak => fanuc(FanucReader::mazak()),
            Dialect::LinuxCnc => fanuc(FanucReader::linuxcnc()),
            Dialect::Siemens840d => Inner::Siemens(Box::new(SiemensReader::new().without_text())),
            Dialect::Heidenhain => Inner::Heidenhain(Box::new(HeidenhainReader::new().without_text())),
        })
    }

    /// A reader of this text before its first line: the text before the first `%` of a FANUC, Haas
    /// or Mazak program is skipped, as controls do.
    #[must_use]
    pub fn of_text(dialect: Dialect, text: &[u8]) -> Self {
        // A text that is there can be read.
        Self::of_source(dialect, text).unwrap_or_else(|_| Self::new(dialect))
    }

    /// A reader of what this source gives, as [`ProgramReader::of_text`]. It is read only as far as
    /// it has to be known for that, in most programs its first line; the lines to read come from
    /// the source's start again.
    ///
    /// # Errors
    /// Those of the source.
    pub fn of_source(dialect: Dialect, source: impl BufRead) -> std::io::Result<Self> {
        let mut reader = Self::new(dialect);
        if let Inner::Fanuc(reader) = &mut reader.0 {
            reader.pass_leader(source)?;
        }
        Ok(reader)
    }

    /// Reads the next line, as [`FanucReader::read_line`]; its block has no text.
    ///
    /// # Errors
    /// As [`crate::read_program`].
    pub fn read_line(&mut self, line: &[u8]) -> Result<Option<ReadBlock>, ReadError> {
        match &mut self.0 {
            Inner::Fanuc(reader) => reader.read_line(line),
            Inner::Siemens(reader) => reader.read_line(line),
            Inner::Heidenhain(reader) => reader.read_line(line),
        }
    }

    /// Tool lengths that the program names, and what could not be decided from the text alone.
    #[must_use]
    pub fn finish(self) -> (Vec<ToolLengthNote>, Vec<ReadNote>) {
        match self.0 {
            Inner::Fanuc(reader) => reader.finish(),
            Inner::Siemens(reader) => reader.finish(),
            Inner::Heidenhain(reader) => reader.finish(),
        }
    }
}
