//! From a line to words: comments apart, blanks gone (they may stand anywhere), columns kept.

use std::ops::Range;

use crate::read::error::{ReadError, ReadFault};
use crate::read::fanuc::variant::Variant;
use crate::read::source::byte_order_mark;
use crate::read::values::expression::Syntax;
use crate::read::values::variables::Variables;
use crate::read::values::{expression, number};

/// A letter and its number.
#[derive(Clone, Copy, Debug)]
pub(super) struct FanucWord {
    /// Upper case; lower case behind a comma (`,R5.`).
    pub(super) letter: u8,
    /// The 2 of `X2=`, 0 for a letter alone.
    pub(super) index: u8,
    /// Not to be used where it is not known.
    pub(super) value: f64,
    /// Whether the value is a number or follows from assignments; it does not where a variable is
    /// not known.
    pub(super) is_known: bool,
    pub(super) has_point: bool,
    /// Range in the line's code.
    start: u32,
    number: u32,
    end: u32,
    pub(super) is_used: bool,
}

/// `#1=…` in a line.
#[derive(Clone, Debug)]
pub(super) struct Assignment {
    /// Number or name, `None` where it is not known which.
    pub(super) name: Option<Vec<u8>>,
    pub(super) value: Option<f64>,
    /// Where the `#` is in the line's code.
    pub(super) start: usize,
}

/// One line, taken apart. Kept from line to line for its memory.
#[derive(Debug, Default)]
pub(super) struct LexedLine {
    /// Upper case, without comments and blanks.
    pub(super) code: Vec<u8>,
    /// Column of every byte of `code`, from 1.
    columns: Vec<u32>,
    /// Text of the comments, without their marks.
    pub(super) comments: Vec<String>,
    pub(super) words: Vec<FanucWord>,
    pub(super) assignments: Vec<Assignment>,
    number: u32,
    /// A comment has parentheses inside, behind which a control may find words.
    pub(super) has_doubtful_comment: bool,
    /// A comment is a program that the control runs.
    pub(super) has_program: bool,
    /// Byte of the code with a `/` inside the block: the control may skip the rest of the block.
    pub(super) inner_skip: Option<usize>,
}

/// How comments of a line are read.
#[derive(Clone, Copy, Debug)]
pub(super) struct CommentForm {
    /// Keep them all, and not only those that tell a length.
    pub(super) keeps_all: bool,
    /// They may have parentheses inside.
    pub(super) nests: bool,
    /// Those that begin with PY are run.
    pub(super) runs_python: bool,
}

impl LexedLine {
    /// Takes `bytes` apart into code and comments. Words follow with [`LexedLine::split_words`].
    pub(super) fn split(&mut self, number: u32, bytes: &[u8], form: CommentForm) -> Result<(), ReadError> {
        self.number = number;
        self.has_doubtful_comment = false;
        self.has_program = false;
        self.inner_skip = None;
        self.code.clear();
        self.columns.clear();
        self.comments.clear();
        self.words.clear();
        self.assignments.clear();
        let mut at = if number == 1 { byte_order_mark(bytes) } else { 0 };
        while at < bytes.len() {
            let byte = bytes[at];
            let column = u32::try_from(at + 1).unwrap_or(u32::MAX);
            match byte {
                b'(' => {
                    let rest = &bytes[at + 1..];
                    let first = rest.iter().position(|b| *b == b')');
                    let first = first.ok_or(self.error_at(column, ReadFault::OpenComment))?;
                    let length = nested_length(rest).filter(|_| form.nests).unwrap_or(first);
                    self.has_doubtful_comment |= has_words(&rest[first..length]);
                    self.keep_comment(&rest[..length], form);
                    at += length + 1;
                }
                b';' => {
                    self.keep_comment(bytes[at + 1..].trim_ascii(), form);
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

    fn keep_comment(&mut self, text: &[u8], form: CommentForm) {
        let mut letters = text.iter().filter(|b| !b.is_ascii_whitespace()).map(u8::to_ascii_uppercase);
        self.has_program |= form.runs_python && letters.next() == Some(b'P') && letters.next() == Some(b'Y');
        if form.keeps_all || is_length(text) {
            self.comments.push(String::from_utf8_lossy(text).into_owned());
        }
    }

    /// Takes the code from byte `start` on apart into words and assignments.
    pub(super) fn split_words(
        &mut self,
        start: usize,
        variant: Variant,
        variables: &Variables,
    ) -> Result<(), ReadError> {
        let mut at = start;
        while at < self.code.len() {
            let is_corner = |b: &u8| matches!(b, b'R' | b'C' | b'A');
            if self.code[at] == b'#' {
                at = self.assignment(at, variables)?;
            } else if let Some(length) = self.skip_mark(at).filter(|_| variant != Variant::LinuxCnc) {
                self.inner_skip.get_or_insert(at);
                at += length;
            } else if self.code[at] == b','
                && variant != Variant::LinuxCnc
                && self.code.get(at + 1).is_some_and(is_corner)
            {
                let word = self.word(at + 1, variant, variables)?;
                at = word.end as usize;
                self.words.push(FanucWord { letter: word.letter.to_ascii_lowercase(), ..word });
            } else {
                let word = self.word(at, variant, variables)?;
                at = word.end as usize;
                self.words.push(word);
            }
        }
        Ok(())
    }

    /// Length of a `/` or `/1` to `/9` inside the block, with a word or an assignment behind it.
    fn skip_mark(&self, at: usize) -> Option<usize> {
        let rest = self.code[at..].strip_prefix(b"/")?;
        let digits = usize::from(matches!(rest.first(), Some(b'1'..=b'9')));
        let begins = |b: &u8| b.is_ascii_uppercase() || *b == b'#';
        rest.get(digits).is_some_and(begins).then_some(1 + digits)
    }

    fn assignment(&mut self, start: usize, variables: &Variables) -> Result<usize, ReadError> {
        let fault = |at: usize| self.error(at.min(self.code.len().saturating_sub(1)), self.expression_fault(start));
        let (name, value_start) = expression::parse_target(&self.code, start, variables).map_err(fault)?;
        let parsed = expression::parse(&self.code, value_start, Syntax::Brackets, variables).map_err(fault)?;
        self.assignments.push(Assignment { name, value: parsed.value, start });
        Ok(parsed.end)
    }

    fn expression_fault(&self, start: usize) -> ReadFault {
        ReadFault::Expression(self.text(start, self.code.len()))
    }

    fn word(&self, start: usize, variant: Variant, variables: &Variables) -> Result<FanucWord, ReadError> {
        let letter = self.code[start];
        // Distance and angle of polar words.
        let is_polar = variant == Variant::LinuxCnc && matches!(letter, b'@' | b'^');
        if !letter.is_ascii_uppercase() && !is_polar {
            return Err(self.error(start, ReadFault::Character(char::from(letter))));
        }
        let (index, number_start) = match self.code[start + 1..] {
            [digit @ b'1'..=b'9', b'=', ..] => (digit - b'0', start + 3),
            _ => (0, start + 1),
        };
        let word = |value: Option<f64>, end: usize, has_point| FanucWord {
            letter,
            index,
            value: value.unwrap_or(f64::NAN),
            is_known: value.is_some(),
            has_point,
            start: start as u32,
            number: number_start as u32,
            end: end as u32,
            is_used: false,
        };
        if self.is_expression(number_start, variant) {
            let fault = |at: usize| self.error(at.min(self.code.len() - 1), self.expression_fault(start));
            let parsed =
                expression::parse_value(&self.code, number_start, Syntax::Brackets, variables).map_err(fault)?;
            return Ok(word(parsed.value, parsed.end, true));
        }
        let rest = &self.code[number_start..];
        let length = rest.iter().position(|b| !is_number_byte(*b)).unwrap_or(rest.len());
        let text = &rest[..length];
        match number::parse(text) {
            Some(value) => Ok(word(Some(value), number_start + length, text.contains(&b'.'))),
            None => Err(self.number_fault(start, number_start, length)),
        }
    }

    /// Whether a variable, an expression, or (on LinuxCNC) a function follows an address letter.
    fn is_expression(&self, at: usize, variant: Variant) -> bool {
        let rest = &self.code[at..];
        let signs = rest.iter().take_while(|b| matches!(b, b'+' | b'-')).count();
        match rest.get(signs) {
            Some(b'#' | b'[') => true,
            Some(byte) if byte.is_ascii_uppercase() && variant == Variant::LinuxCnc => {
                let name = rest[signs..].iter().take_while(|b| b.is_ascii_uppercase()).count();
                name > 1 && rest.get(signs + name) == Some(&b'[')
            }
            _ => false,
        }
    }

    /// Returns the fault of the text up to the next word: `GOTO` is one unknown word and not four.
    fn number_fault(&self, start: usize, number_start: usize, length: usize) -> ReadError {
        let is_word = length == 0 && self.code.get(number_start).is_some_and(u8::is_ascii_uppercase);
        let end = if is_word { start + 12 } else { (number_start + length).max(start + 1) };
        let text = self.text(start, self.code.len().min(end));
        self.error(start, if is_word { ReadFault::UnknownWord(text) } else { ReadFault::Number(text) })
    }

    /// Whether any word is neither M, S or T nor of a dwell.
    pub(super) fn sets_state(&self) -> bool {
        let is_dwell = |w: &FanucWord| w.letter == b'G' && w.value == 4.0;
        let dwells = self.words.iter().any(is_dwell);
        let is_none = |w: &FanucWord| matches!(w.letter, b'M' | b'S' | b'T');
        let is_of_dwell = |w: &FanucWord| dwells && (is_dwell(w) || matches!(w.letter, b'P' | b'X' | b'U'));
        !self.assignments.is_empty() || !self.words.iter().all(|w| is_none(w) || is_of_dwell(w))
    }

    /// The word as it stands, without blanks.
    pub(super) fn word_text(&self, word: &FanucWord) -> String {
        self.text(word.start as usize, word.end as usize)
    }

    /// The words as they stand, without blanks inside them.
    pub(super) fn words_text(&self, is_meant: impl Fn(&FanucWord) -> bool) -> String {
        let mut text = String::new();
        for word in self.words.iter().filter(|w| is_meant(w)) {
            if !text.is_empty() {
                text.push(' ');
            }
            text.push_str(&self.word_text(word));
        }
        text
    }

    /// Bytes of the line that are the word, and the byte at which its number begins.
    pub(super) fn word_bytes(&self, word: &FanucWord) -> (Range<usize>, usize) {
        let byte = |code: u32| self.columns[code as usize] as usize - 1;
        (byte(word.start)..byte(word.end - 1) + 1, byte(word.number))
    }

    /// Byte of the line behind its last word that is not left out.
    pub(super) fn code_end(&self) -> usize {
        let count = self.inner_skip.unwrap_or(self.columns.len());
        self.columns[..count].last().map_or(0, |column| *column as usize)
    }

    /// An error at a word.
    pub(super) fn word_error(&self, word: &FanucWord, fault: ReadFault) -> ReadError {
        self.error(word.start as usize, fault)
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

/// Length of a comment up to the parenthesis that closes it, behind those that it has inside.
fn nested_length(text: &[u8]) -> Option<usize> {
    let mut depth = 1_u32;
    text.iter().position(|byte| {
        match byte {
            b'(' => depth += 1,
            b')' => depth -= 1,
            _ => {}
        }
        depth == 0
    })
}

/// Whether a letter precedes a number, as in a word.
fn has_words(text: &[u8]) -> bool {
    let mut bytes = text.iter().filter(|b| !b.is_ascii_whitespace()).peekable();
    while let Some(byte) = bytes.next() {
        let is_value = |b: &&u8| b.is_ascii_digit() || matches!(b, b'+' | b'-' | b'.' | b'#' | b'[' | b'=');
        if byte.is_ascii_alphabetic() && bytes.peek().is_some_and(is_value) {
            return true;
        }
    }
    false
}

/// Whether a comment tells a tool length: those are kept by readers that keep no other.
fn is_length(comment: &[u8]) -> bool {
    let text = comment.trim_ascii();
    text.get(..11).is_some_and(|start| start.eq_ignore_ascii_case(b"TOOL LENGTH"))
}

fn is_number_byte(byte: u8) -> bool {
    byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'.')
}
