use std::{collections::BTreeSet, fmt::Write};

use crate::{BlockNumbers, PostSettings, WriteError, post_file::LAST_BLOCK_NUMBER};

/// Takes the lines of a program, numbers and checks them.
pub(super) struct LineSink {
    text: String,
    numbers: Option<BlockNumbers>,
    next: u32,
    /// Numbers the template uses itself.
    labels: BTreeSet<u32>,
    limit: usize,
    /// Lines written so far.
    n_lines: u32,
}

impl LineSink {
    pub(super) fn new(settings: &PostSettings, labels: BTreeSet<u32>, n_blocks: usize) -> Self {
        Self {
            text: String::with_capacity(2048 + 48 * n_blocks),
            numbers: settings.block_numbers,
            next: settings.block_numbers.map_or(0, |n| n.start),
            labels,
            limit: settings.max_line_length,
            n_lines: 0,
        }
    }

    /// Number of the line that comes next, from 1.
    pub(super) fn next_line(&self) -> u32 {
        self.n_lines + 1
    }

    pub(super) fn limit(&self) -> usize {
        self.limit
    }

    /// A line of the template or of the user: made upper case, checked, and numbered where it is a block without a
    /// number.
    pub(super) fn push_template_line(&mut self, line: &str) -> Result<(), WriteError> {
        let line = line.to_ascii_uppercase();
        check_characters(&line)?;
        let is_block = !line.starts_with(['%', 'O', ':', 'N', '/', '(']);
        self.push(&line, is_block)
    }

    /// A block in the control's characters.
    pub(super) fn push_block(&mut self, line: &str) -> Result<(), WriteError> {
        self.push(line, true)
    }

    /// A line that is no block: a comment.
    pub(super) fn push_plain(&mut self, line: &str) -> Result<(), WriteError> {
        self.push(line, false)
    }

    pub(super) fn into_text(self) -> String {
        self.text
    }

    fn push(&mut self, line: &str, numbered: bool) -> Result<(), WriteError> {
        let start = self.text.len();
        if numbered && let Some(number) = self.next_number() {
            // Writing to a String cannot fail.
            let _ = write!(self.text, "N{number} ");
        }
        self.text.push_str(line);
        if self.text.len() - start > self.limit {
            return Err(WriteError::LineTooLong { text: self.text[start..].to_owned(), limit: self.limit });
        }
        self.text.push('\n');
        self.n_lines += 1;
        Ok(())
    }

    /// `None` also where the template uses every number there is.
    fn next_number(&mut self) -> Option<u32> {
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
}

/// Printable ASCII, and comments not nested.
fn check_characters(line: &str) -> Result<(), WriteError> {
    let mut in_comment = false;
    for character in line.chars() {
        let is_known = character == ' ' || character.is_ascii_graphic();
        let is_nested = character == '(' && in_comment || character == ')' && !in_comment;
        if !is_known || is_nested {
            return Err(WriteError::Character { text: line.to_owned(), character });
        }
        in_comment = character == '(' || in_comment && character != ')';
    }
    if in_comment { Err(WriteError::Character { text: line.to_owned(), character: '(' }) } else { Ok(()) }
}
