use std::collections::BTreeSet;
use std::fmt::Write;

use crate::dialect::file::{DialectFile, Numbering};
use crate::dialect::post_file::{BlockNumbers, LAST_BLOCK_NUMBER, PostSettings};
use crate::program::write_error::WriteError;

/// Takes the lines of a program, numbers and checks them.
pub(super) struct LineSink<'a> {
    text: String,
    rules: &'a DialectFile,
    numbers: Option<BlockNumbers>,
    next: u32,
    /// Numbers the template uses itself.
    labels: BTreeSet<u32>,
    limit: usize,
    /// Lines written so far.
    n_lines: u32,
    /// Whether the line before goes on in the next one.
    is_continued: bool,
}

/// Characters kept for the number of a line, where every line has one: seven digits and a blank.
const NUMBER_WIDTH: usize = 8;

impl<'a> LineSink<'a> {
    pub(super) fn new(settings: &'a PostSettings, labels: BTreeSet<u32>, n_blocks: usize) -> Self {
        Self {
            text: String::with_capacity(2048 + 48 * n_blocks),
            rules: &settings.rules,
            numbers: settings.block_numbers,
            next: settings.block_numbers.map_or(0, |n| n.start),
            labels,
            limit: settings.max_line_length,
            n_lines: 0,
            is_continued: false,
        }
    }

    /// Number of the line that comes next, from 1.
    pub(super) fn next_line(&self) -> u32 {
        self.n_lines + 1
    }

    /// Most characters of a comment's text.
    pub(super) fn comment_limit(&self) -> usize {
        let comments = &self.rules.comments;
        let number = if self.rules.lines.numbering == Numbering::EveryLine { NUMBER_WIDTH } else { 0 };
        self.limit.saturating_sub(comments.open.len() + comments.close.len() + number)
    }

    /// A line of the template or of the user: made upper case, checked, and numbered where it is a
    /// block without a number.
    pub(super) fn push_template_line(&mut self, line: &str) -> Result<(), WriteError> {
        let line = line.to_ascii_uppercase();
        self.check_characters(&line)?;
        let is_block = !self.rules.lines.unnumbered.iter().any(|start| line.starts_with(start.as_str()));
        self.push(&line, is_block)
    }

    /// A block in the control's characters.
    pub(super) fn push_block(&mut self, line: &str) -> Result<(), WriteError> {
        self.push(line, true)
    }

    /// A comment of clean text.
    pub(super) fn push_comment(&mut self, text: &str) -> Result<(), WriteError> {
        let comments = &self.rules.comments;
        self.push(&format!("{}{text}{}", comments.open, comments.close), false)
    }

    pub(super) fn into_text(self) -> String {
        self.text
    }

    fn push(&mut self, line: &str, is_block: bool) -> Result<(), WriteError> {
        let start = self.text.len();
        if let Some((letter, number)) = self.next_number(is_block) {
            // Writing to a String cannot fail.
            let _ = write!(self.text, "{letter}{number} ");
        }
        self.text.push_str(line);
        if self.text.len() - start > self.limit {
            return Err(WriteError::LineTooLong { text: self.text[start..].to_owned(), limit: self.limit });
        }
        self.text.push('\n');
        self.n_lines += 1;
        self.is_continued = self.rules.lines.continued.as_ref().is_some_and(|mark| line.ends_with(mark.as_str()));
        Ok(())
    }

    fn next_number(&mut self, is_block: bool) -> Option<(&'static str, u32)> {
        if self.is_continued {
            return None;
        }
        match self.rules.lines.numbering {
            Numbering::Optional if is_block => self.next_optional().map(|n| ("N", n)),
            Numbering::Optional => None,
            Numbering::EveryLine => {
                self.next = if self.n_lines == 0 { 0 } else { self.next + 1 };
                Some(("", self.next))
            }
        }
    }

    /// `None` also where the template uses every number there is.
    fn next_optional(&mut self) -> Option<u32> {
        let numbers = self.numbers?;
        for _ in 0..=self.labels.len() {
            let number = self.next;
            self.next = Some(number + numbers.step).filter(|n| *n <= LAST_BLOCK_NUMBER).unwrap_or(numbers.start);
            if !self.labels.contains(&number) {
                return Some(number);
            }
        }
        None
    }

    /// Printable ASCII, and comments that end in their line and are not nested.
    fn check_characters(&self, line: &str) -> Result<(), WriteError> {
        let error = |character| Err(WriteError::Character { text: line.to_owned(), character });
        if let Some(character) = line.chars().find(|c| *c != ' ' && !c.is_ascii_graphic()) {
            return error(character);
        }
        // Without a closing mark parentheses are words of the control, and the end of the line ends
        // a comment.
        if self.rules.comments.close.is_empty() {
            return Ok(());
        }
        let mut in_comment = false;
        for character in line.chars() {
            if character == '(' && in_comment || character == ')' && !in_comment {
                return error(character);
            }
            in_comment = character == '(' || in_comment && character != ')';
        }
        if in_comment { error('(') } else { Ok(()) }
    }
}
