//! Comments of a program that say which operation and pass follows.

use crate::format::{OperationLines, PassLine};

/// Returns where operations of these names begin, in order of lines.
pub(crate) fn operation_lines<'a>(text: &str, names: impl Iterator<Item = &'a str>) -> Vec<OperationLines> {
    let names: Vec<(&str, String)> = names.map(|name| (name, letters(name))).collect();
    let starts = text.lines().zip(1..).filter_map(|(line, number)| {
        let comment = comment(line)?;
        let found = letters(comment);
        let (name, _) = names.iter().find(|(_, letters)| !letters.is_empty() && *letters == found)?;
        Some(OperationLines { operation: (*name).to_owned(), first_line: number })
    });
    let mut all: Vec<OperationLines> = starts.collect();
    all.dedup_by(|b, a| a.operation == b.operation);
    all
}

/// Returns where passes begin: comments of the form `PASS 3 PLACE 1`.
pub(crate) fn pass_lines(text: &str) -> Vec<PassLine> {
    let pass = |(line, number): (&str, u32)| {
        let words: Vec<&str> = comment(line)?.split_whitespace().collect();
        let [first, pass, second, place] = words[..] else { return None };
        let fits = first.eq_ignore_ascii_case("pass") && second.eq_ignore_ascii_case("place");
        fits.then_some(PassLine { line: number, pass: pass.parse().ok()?, place: place.parse().ok()? })
    };
    text.lines().zip(1..).filter_map(pass).collect()
}

/// Returns the text of a line that is a comment alone, in parentheses or behind a semicolon.
fn comment(line: &str) -> Option<&str> {
    let line = line.trim();
    // A block number may stand before it.
    let rest =
        line.strip_prefix(['N', 'n']).unwrap_or(line).trim_start_matches(|c: char| c.is_ascii_digit()).trim_start();
    let comment = rest.strip_prefix(';').or_else(|| rest.strip_prefix('(')?.strip_suffix(')'))?;
    Some(comment.trim())
}

/// Returns letters and digits in upper case: controls permit few other characters in comments.
fn letters(text: &str) -> String {
    text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_uppercase).collect()
}

#[cfg(test)]
#[path = "../tests/unit/program_text.rs"]
mod tests;
