//! Lines of written files for lines of an expanded text.

/// Line of the written files for each line of an expanded text. Lines of several files count on:
/// the main program has 1 to its last one, and the other files follow in the order of their first
/// calls.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LineMap {
    /// Runs of lines that follow each other in both: first line of the text, first written line.
    runs: Vec<(u32, u32)>,
    n_lines: u32,
}

impl LineMap {
    /// Appends a line.
    pub(crate) fn push(&mut self, written: u32) {
        self.n_lines += 1;
        let follows = self.runs.last().is_some_and(|(line, first)| first + (self.n_lines - line) == written);
        if !follows {
            self.runs.push((self.n_lines, written));
        }
    }

    /// Returns runs of lines that follow each other in both: first and last line of the text, and
    /// the written line of the first one.
    pub fn runs(&self) -> impl Iterator<Item = ([u32; 2], u32)> {
        let ends = self.runs.iter().skip(1).map(|(next, _)| next - 1).chain([self.n_lines]);
        self.runs.iter().zip(ends).map(|((first, written), last)| ([*first, last], *written))
    }

    /// Returns the written line of a line of the text, both from 1; of a line behind the text that
    /// of its last line.
    #[must_use]
    pub fn written(&self, line: u32) -> u32 {
        let line = line.clamp(1, self.n_lines.max(1));
        let behind = self.runs.partition_point(|(first, _)| *first <= line);
        behind.checked_sub(1).map_or(line, |k| self.runs[k].1 + (line - self.runs[k].0))
    }
}
