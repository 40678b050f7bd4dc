//! From lines to statements: continuation, comments, major word and values.

use facemill_nc_program::read::{ReadError, ReadFault};

/// One statement, continuation lines joined.
#[derive(Debug)]
pub(super) struct RawStatement {
    /// First line, from 1.
    pub(super) line: u32,
    /// Original text, without the continuation marks.
    pub(super) text: String,
    /// Line and column of every byte of `text`.
    places: Vec<(u32, u32)>,
    /// Whether it is longer than [`LONGEST`], and was read no further.
    pub(super) is_too_long: bool,
}

/// Bytes of the longest statement with its continuation lines: CAM systems write a few hundred.
/// More would be a file of another kind, whose bytes take much memory each.
const LONGEST: usize = 100_000;

/// Joins the lines of an APT file. `$$` starts a comment, which becomes a statement of its own if
/// it is alone on its line.
pub(super) struct Statements<'a> {
    /// Text behind the lines read, `None` behind the last.
    rest: Option<&'a [u8]>,
    /// Lines read.
    line: u32,
}

impl<'a> Statements<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Self { rest: Some(text), line: 0 }
    }

    fn next_line(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest?;
        self.line = self.line.saturating_add(1);
        let end = rest.iter().position(|byte| *byte == b'\n');
        self.rest = end.map(|end| &rest[end + 1..]);
        Some(&rest[..end.unwrap_or(rest.len())])
    }
}

impl Iterator for Statements<'_> {
    type Item = RawStatement;

    fn next(&mut self) -> Option<RawStatement> {
        loop {
            let bytes = self.next_line()?;
            let mut statement =
                RawStatement { line: self.line, text: String::new(), places: Vec::new(), is_too_long: false };
            let mut is_continued = statement.append(self.line, bytes);
            while is_continued {
                let Some(bytes) = self.next_line() else { break };
                is_continued = statement.append(self.line, bytes);
            }
            if !statement.text.is_empty() || statement.is_too_long {
                return Some(statement);
            }
        }
    }
}

impl RawStatement {
    /// Appends a line; returns whether the next one belongs to it.
    fn append(&mut self, line: u32, bytes: &[u8]) -> bool {
        self.is_too_long = self.text.len() + bytes.len() > LONGEST;
        if self.is_too_long {
            return false;
        }
        let text = String::from_utf8_lossy(bytes);
        let start = text.len() - text.trim_start().len();
        let body = text.trim();
        let (body, is_continued) = match body.find('$') {
            // Creo's own statements are such comments, and go on behind `$` as others do.
            Some(0) if body.starts_with("$$->") && body.ends_with('$') => (body[..body.len() - 1].trim_end(), true),
            Some(at) if body[at..].starts_with("$$") => (if at == 0 { body } else { body[..at].trim_end() }, false),
            // The text behind the mark is a comment.
            Some(at) => (body[..at].trim_end(), true),
            None => (body, false),
        };
        self.text.push_str(body);
        let column = |k: usize| u32::try_from(start + k + 1).unwrap_or(u32::MAX);
        self.places.extend((0..body.len()).map(|k| (line, column(k))));
        is_continued
    }

    /// Returns the major word, upper case, and the byte its values start at.
    pub(super) fn major_word(&self) -> (String, usize) {
        let end = self.text.find(['/', ' ', ',', '\t']).unwrap_or(self.text.len());
        let rest = self.text[end..].trim_start();
        let rest = rest.strip_prefix('/').unwrap_or(rest);
        (self.text[..end].to_ascii_uppercase(), self.text.len() - rest.len())
    }

    /// Returns the values behind the slash, trimmed, each with its byte.
    pub(super) fn values(&self, start: usize) -> Vec<(usize, &str)> {
        let values = self.text.get(start..).unwrap_or_default();
        if values.trim().is_empty() {
            return Vec::new();
        }
        let mut at = start;
        let mut all = Vec::new();
        for value in values.split(',') {
            all.push((at + value.len() - value.trim_start().len(), value.trim()));
            at += value.len() + 1;
        }
        all
    }

    /// Returns the value as a finite number.
    pub(super) fn number(&self, value: (usize, &str)) -> Result<f64, ReadError> {
        let number = parse(value.1);
        number.ok_or_else(|| self.error(value.0, ReadFault::Number(value.1.to_owned())))
    }

    /// Returns an error at a byte of the text.
    pub(super) fn error(&self, at: usize, fault: ReadFault) -> ReadError {
        let last = self.places.last().copied().unwrap_or((self.line, 1));
        let (line, column) = self.places.get(at).copied().unwrap_or(last);
        ReadError { line, column, fault }
    }
}

/// Parses a finite decimal number, with an exponent or without; words such as `inf` are none.
pub(super) fn parse(text: &str) -> Option<f64> {
    let is_numeric = text.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'+' | b'-' | b'.' | b'e' | b'E'));
    let has_digit = text.bytes().any(|b| b.is_ascii_digit());
    text.parse().ok().filter(|v: &f64| is_numeric && has_digit && v.is_finite())
}
