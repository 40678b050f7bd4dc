use std::ops::Range;

/// Place of a block's feed in the source, present or to be inserted.
///
/// All else of the line belongs to other words, so that a program with new feeds is the old one
/// with these ranges replaced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FeedPlace {
    /// Byte of the source at which the line begins.
    line_start: usize,
    /// Bytes of the line, empty where there is no word.
    start: u32,
    end: u32,
    /// Where the number begins.
    number: u32,
    /// Byte of the line plus 1, 0 for nowhere.
    insert: u32,
}

impl FeedPlace {
    /// Of a line that begins at this byte of the source and has no feed.
    pub(crate) fn of_line(line_start: usize) -> Self {
        Self { line_start, ..Self::default() }
    }

    /// Sets the word to these bytes of the line, of which the number begins at `number`.
    pub(crate) fn set_word(&mut self, word: Range<usize>, number: usize) {
        // Lines of 4 GB and more have no place of a feed.
        if let (Ok(start), Ok(end), Ok(number)) =
            (u32::try_from(word.start), u32::try_from(word.end), u32::try_from(number))
        {
            (self.start, self.end, self.number) = (start, end, number);
            self.set_insert(word.start);
        }
    }

    /// A word may be put in front of this byte of the line.
    pub(crate) fn set_insert(&mut self, at: usize) {
        self.insert = u32::try_from(at + 1).unwrap_or(0);
    }

    /// Bytes of the source that are the F word, with blanks and comments inside it; `None` without
    /// one, and where F is the argument of a cycle or call.
    #[must_use]
    pub fn span(&self) -> Option<Range<usize>> {
        (self.start < self.end).then(|| self.at(self.start)..self.at(self.end))
    }

    /// Bytes of the source that are the number of the F word as it is written, or the variable or
    /// expression.
    #[must_use]
    pub fn number_span(&self) -> Option<Range<usize>> {
        (self.start < self.end).then(|| self.at(self.number)..self.at(self.end))
    }

    /// Byte of the source before which a feed belongs that the block does not have yet, with a
    /// blank before and behind it; the start of the word where it has one. `None` where a feed has
    /// no meaning.
    #[must_use]
    pub fn insert_at(&self) -> Option<usize> {
        Some(self.at(self.insert.checked_sub(1)?))
    }

    /// Byte of the source at which the line begins.
    #[must_use]
    pub fn line_start(&self) -> usize {
        self.line_start
    }

    /// The same with places counted from a later byte of the source.
    pub(crate) fn has_word(&self) -> bool {
        self.start < self.end
    }

    fn at(&self, byte: u32) -> usize {
        self.line_start + byte as usize
    }
}
