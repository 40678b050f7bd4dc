//! From a line to words: comments apart, blanks gone (they may stand anywhere), columns kept.

use crate::{ReadError, ReadFault, number_text};

/// A letter and its number.
#[derive(Clone, Copy, Debug)]
pub(super) struct Word {
    /// Upper case.
    pub(super) letter: u8,
    /// The 2 of `X2=`, 0 for a letter alone.
    pub(super) index: u8,
    pub(super) value: f64,
    pub(super) has_point: bool,
    /// Range in the line's code.
    start: usize,
    end: usize,
    pub(super) is_used: bool,
}

/// One line, taken apart. Kept from line to line for its memory.
#[derive(Debug, Default)]
pub(super) struct Line {
    /// Upper case, without comments and blanks.
    pub(super) code: Vec<u8>,
    /// Column of every byte of `code`, from 1.
    columns: Vec<u32>,
    /// Text of the comments, without their marks.
    pub(super) comments: Vec<String>,
    pub(super) words: Vec<Word>,
    number: u32,
}

impl Line {
    /// Takes `bytes` apart into code and comments. Words follow with [`Line::split_words`].
    pub(super) fn split(&mut self, number: u32, bytes: &[u8]) -> Result<(), ReadError> {
        self.number = number;
        self.code.clear();
        self.columns.clear();
        self.comments.clear();
        self.words.clear();
        let mut at = 0;
        while at < bytes.len() {
            let byte = bytes[at];
            let column = u32::try_from(at + 1).unwrap_or(u32::MAX);
            match byte {
                b'(' => {
                    let rest = &bytes[at + 1..];
                    let length = rest.iter().position(|b| *b == b')');
                    let length = length.ok_or(self.error_at(column, ReadFault::OpenComment))?;
                    self.comments.push(String::from_utf8_lossy(&rest[..length]).into_owned());
                    at += length + 1;
                }
                b';' => {
                    self.comments.push(String::from_utf8_lossy(bytes[at + 1..].trim_ascii()).into_owned());
                    return Ok(());
                }
                _ if byte.is_ascii_whitespace() => {}
                _ => {
                    self.code.push(byte.to_ascii_uppercase());
                    self.columns.push(column);
                }
            }
            at += 1;
        }
        Ok(())
    }

    /// Takes the code from byte `start` on apart into words.
    pub(super) fn split_words(&mut self, start: usize) -> Result<(), ReadError> {
        let mut at = start;
        while at < self.code.len() {
            let word = self.word(at)?;
            at = word.end;
            self.words.push(word);
        }
        Ok(())
    }

    fn word(&self, start: usize) -> Result<Word, ReadError> {
        let letter = self.code[start];
        if !letter.is_ascii_uppercase() {
            return Err(self.error(start, ReadFault::Character(char::from(letter))));
        }
        let (index, number_start) = match self.code[start + 1..] {
            [digit @ b'1'..=b'9', b'=', ..] => (digit - b'0', start + 3),
            _ => (0, start + 1),
        };
        let end = number_start + self.code[number_start..].iter().take_while(|b| is_number_byte(**b)).count();
        let text = &self.code[number_start..end];
        let fault = || {
            // What stands there, up to the next word: `GOTO` is one unknown word and not four.
            let is_word = text.is_empty() && self.code.get(number_start).is_some_and(u8::is_ascii_uppercase);
            let text = self.text(start, self.code.len().min(if is_word { start + 12 } else { end.max(start + 1) }));
            self.error(start, if is_word { ReadFault::UnknownWord(text) } else { ReadFault::Number(text) })
        };
        let has_point = text.contains(&b'.');
        let value = number_text::parse(text).ok_or_else(fault)?;
        Ok(Word { letter, index, value, has_point, start, end, is_used: false })
    }

    /// Whether any word is neither M, S or T nor of a dwell.
    pub(super) fn sets_state(&self) -> bool {
        let is_dwell = |w: &Word| w.letter == b'G' && w.value == 4.0;
        let dwells = self.words.iter().any(is_dwell);
        let is_none = |w: &Word| matches!(w.letter, b'M' | b'S' | b'T');
        let is_of_dwell = |w: &Word| dwells && (is_dwell(w) || matches!(w.letter, b'P' | b'X' | b'U'));
        !self.words.iter().all(|w| is_none(w) || is_of_dwell(w))
    }

    /// The word as it stands, without blanks.
    pub(super) fn word_text(&self, word: &Word) -> String {
        self.text(word.start, word.end)
    }

    /// An error at a word.
    pub(super) fn word_error(&self, word: &Word, fault: ReadFault) -> ReadError {
        self.error(word.start, fault)
    }

    /// An error at a byte of the code.
    pub(super) fn error(&self, at: usize, fault: ReadFault) -> ReadError {
        self.error_at(self.columns.get(at).copied().unwrap_or(1), fault)
    }

    fn error_at(&self, column: u32, fault: ReadFault) -> ReadError {
        ReadError { line: self.number, column, fault }
    }

    fn text(&self, start: usize, end: usize) -> String {
        self.code[start..end].iter().map(|b| char::from(*b)).collect()
    }
}

fn is_number_byte(byte: u8) -> bool {
    byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'.')
}
