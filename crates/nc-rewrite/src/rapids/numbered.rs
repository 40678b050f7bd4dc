//! Replacement of lines in a program, and renumbering if the control numbers every line.

use std::ops::Range;

/// Replaces each of these lists of lines of a program by these texts, at the place of the first
/// line. Returns, for every list, the first and last line of its texts.
///
/// With `counts`, continues the numbers of lines that begin with one (behind a `/`, too): the texts
/// have numbers if the first line that they replace has one, and the numbers of all lines behind
/// change by the difference in lines. Lines without a number get none.
pub(crate) fn replaced(text: &[u8], all: &[(&[u32], &[String])], counts: bool) -> (Vec<u8>, Vec<[u32; 2]>) {
    let mut out = Vec::with_capacity(text.len());
    let mut places = vec![[0; 2]; all.len()];
    let (mut line, mut written) = (0, 0);
    let mut next = 0;
    // Number of additional numbered lines compared with the text.
    let mut shift = 0;
    for source in text.split_inclusive(|byte| *byte == b'\n') {
        line += 1;
        while next < all.len() && all[next].0.last().is_none_or(|last| *last < line) {
            next += 1;
        }
        let number = number_of(source).filter(|_| counts);
        let Some((lines, texts)) = all.get(next).filter(|(lines, _)| lines.contains(&line)) else {
            push_moved(&mut out, source, number, shift);
            written += 1;
            continue;
        };
        if lines.first() == Some(&line) {
            let ending: &[u8] = if source.ends_with(b"\r\n") { b"\r\n" } else { b"\n" };
            places[next] = [written + 1, written + texts.len() as u32];
            for text in *texts {
                if let Some(digits) = &number {
                    out.extend_from_slice(moved(&source[digits.clone()], shift).as_bytes());
                    out.push(b' ');
                    shift += 1;
                }
                out.extend_from_slice(text.as_bytes());
                out.extend_from_slice(ending);
            }
            written += texts.len() as u32;
        }
        shift -= i64::from(number.is_some());
    }
    (out, places)
}

/// Writes the line with its number shifted.
fn push_moved(out: &mut Vec<u8>, source: &[u8], number: Option<Range<usize>>, shift: i64) {
    match number.filter(|_| shift != 0) {
        Some(digits) => {
            out.extend_from_slice(&source[..digits.start]);
            out.extend_from_slice(moved(&source[digits.clone()], shift).as_bytes());
            out.extend_from_slice(&source[digits.end..]);
        }
        None => out.extend_from_slice(source),
    }
}

/// Returns the digits of a shifted number, as many as before if it begins with zeros; at least 0.
fn moved(digits: &[u8], shift: i64) -> String {
    let text = String::from_utf8_lossy(digits);
    let Ok(number) = text.parse::<i64>() else { return text.into_owned() };
    let width = if digits.first() == Some(&b'0') { digits.len() } else { 1 };
    format!("{:0width$}", number.saturating_add(shift).max(0))
}

/// Returns the bytes of a line that are its number.
fn number_of(line: &[u8]) -> Option<Range<usize>> {
    let count = |from: usize, is: fn(&u8) -> bool| line[from..].iter().take_while(|byte| is(byte)).count();
    let blanks = |from: usize| from + count(from, u8::is_ascii_whitespace);
    let mut start = blanks(0);
    if line.get(start) == Some(&b'/') {
        start = blanks(start + 1);
    }
    let end = start + count(start, u8::is_ascii_digit);
    (end > start).then_some(start..end)
}

/// Returns the text without the numbers of its lines.
pub(crate) fn without_numbers(text: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(text.len());
    for source in text.split_inclusive(|byte| *byte == b'\n') {
        let digits = number_of(source).unwrap_or(0..0);
        out.extend_from_slice(&source[..digits.start]);
        out.extend_from_slice(&source[digits.end..]);
    }
    out
}

#[cfg(test)]
#[path = "../../tests/unit/rapids/numbered.rs"]
mod tests;
