//! Blocks of the program by their lines in the file: a control shows neither.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::format::WrittenLines;

/// Longest text of a block, characters.
const LONGEST: usize = 72;

/// Most blocks of one page: findings of a wrong program can be many.
const MOST: usize = 4000;

/// Returns a line as a person finds it: `file line 33`, or `O2999.nc line 3` of a program whose
/// calls were expanded.
pub(super) fn place_of(written: &[WrittenLines], line: u32) -> String {
    let behind = written.partition_point(|run| run.first_line <= line);
    match behind.checked_sub(1).map(|k| &written[k]) {
        Some(run) => format!("{} line {}", run.file, run.line + (line - run.first_line)),
        None => format!("file line {line}"),
    }
}

/// Lines of a program's text.
pub(super) struct FileLines<'t> {
    lines: Vec<&'t str>,
    written: &'t [WrittenLines],
}

impl<'t> FileLines<'t> {
    /// Reads a text whose lines are written at these places, or are those of a file.
    pub(super) fn of(text: &'t str, written: &'t [WrittenLines]) -> Self {
        Self { lines: text.split('\n').map(str::trim).collect(), written }
    }

    /// Returns the text of a line, from 1, not longer than a row of a sheet.
    pub(super) fn text(&self, line: u32) -> Option<String> {
        let text = self.lines.get((line as usize).checked_sub(1)?).filter(|text| !text.is_empty())?;
        let is_long = text.chars().count() > LONGEST;
        Some(if is_long { text.chars().take(LONGEST - 1).chain(['…']).collect() } else { (*text).to_owned() })
    }

    /// Returns the first line, from 1, that has one of these words and is no comment.
    pub(super) fn first_with(&self, words: &[&str]) -> Option<u32> {
        let has = |line: &&str| {
            let code = line.split(['(', ';']).next().unwrap_or_default().to_uppercase();
            words.iter().any(|word| code.contains(word))
        };
        self.lines.iter().zip(1..).find(|(line, _)| has(line)).map(|(_, number)| number)
    }

    /// Returns the place of a line with its text: `file line 33: "31 L X+0"`.
    pub(super) fn quoted(&self, line: u32) -> String {
        let place = place_of(self.written, line);
        self.text(line).map_or_else(|| place.clone(), |text| format!("{place}: \"{text}\""))
    }

    /// Returns the texts of lines that findings and assumptions of a result name, and of others.
    pub(super) fn named(&self, result: &Value, others: impl Iterator<Item = u32>) -> BTreeMap<u32, String> {
        let list = |key: &str| result.get(key).and_then(Value::as_array).into_iter().flatten();
        let line = |item: &Value, key: &str| item.get(key).and_then(Value::as_u64).and_then(|n| u32::try_from(n).ok());
        let of_findings =
            list("findings").flat_map(|f| ["first_line", "last_line", "worst_line"].map(|key| line(f, key)));
        let of_assumptions = list("assumptions").map(|a| line(a, "line"));
        let all = others.chain(of_assumptions.chain(of_findings).flatten()).take(MOST);
        all.filter_map(|line| Some((line, self.text(line)?))).collect()
    }
}

#[cfg(test)]
#[path = "../../tests/unit/named_lines.rs"]
mod tests;
