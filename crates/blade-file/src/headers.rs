//! Comment lines of a profile file that begin sections and blades.

use std::collections::BTreeSet;

/// Meaning of a comment line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SectionHeader {
    /// It begins a section of the same blade.
    SameBlade,
    /// It begins the first section of another blade.
    OtherBlade,
    /// It names another blade, whose sections follow.
    Title,
}

/// Headers of one blade so far.
#[derive(Default)]
pub(crate) struct BladeHeaders {
    /// Numbers of its profiles.
    numbers: BTreeSet<u32>,
    is_splitter: bool,
}

impl BladeHeaders {
    /// Reads a comment line without its first `#`.
    ///
    /// Another blade begins where a line with `##` and the word blade or splitter, or the first one
    /// with the word splitter, has no number of a profile; and where a profile has a number that
    /// the blade has already, or the word splitter for the first time.
    pub(crate) fn read(&mut self, comment: &str) -> SectionHeader {
        let words: Vec<&str> = comment.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect();
        let has = |names: &[&str]| words.iter().any(|word| names.iter().any(|name| word.eq_ignore_ascii_case(name)));
        let number: Option<u32> =
            words.windows(2).find(|pair| pair[0].eq_ignore_ascii_case("profile")).and_then(|pair| pair[1].parse().ok());
        let names_splitter = has(&["splitter", "splitters"]);
        let is_first_splitter = names_splitter && !self.is_splitter;
        let header = match number {
            None if comment.starts_with('#') && (names_splitter || has(&["blade", "blades"])) => SectionHeader::Title,
            None if is_first_splitter => SectionHeader::Title,
            Some(number) if is_first_splitter || self.numbers.contains(&number) => SectionHeader::OtherBlade,
            _ => SectionHeader::SameBlade,
        };
        if header != SectionHeader::SameBlade {
            self.numbers.clear();
            self.is_splitter = names_splitter;
        }
        self.numbers.extend(number);
        header
    }
}
