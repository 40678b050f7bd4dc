use crate::dialect::file::{CommentRule, NumberRule};
use crate::dialect::post_file::PostSettings;
use crate::words::axis_words::AxisLetter;
use crate::words::number_text;

/// Characters of FANUC's comments besides letters, digits and blanks.
const FANUC_CHARACTERS: &str = "+-*/=.,:#&'?[]";

/// Returns a text for a FANUC comment: upper-case ASCII letters, digits, blanks and FANUC's further
/// characters. Parentheses become brackets, underscores hyphens, German umlauts two letters, line
/// ends and tabs blanks, everything else `?`.
pub fn clean_fanuc_comment(text: &str) -> String {
    clean(text, FANUC_CHARACTERS)
}

/// Text for a comment in the control's characters: upper-case ASCII letters, digits, blanks and
/// those of the rule. Parentheses become brackets, underscores hyphens, German umlauts two letters,
/// line ends and tabs blanks, everything else `?`; what replaces something is a blank where it is
/// not allowed itself. Never longer lines: no line end is left.
pub(crate) fn clean_comment(text: &str, rule: &CommentRule) -> String {
    let clean = clean(text, &rule.characters);
    let is_active = rule.active.iter().any(|word| clean.trim_start().starts_with(word.as_str()));
    if is_active { format!(". {}", clean.trim_start()) } else { clean }
}

fn clean(text: &str, allowed: &str) -> String {
    let mut clean = String::with_capacity(text.len());
    let or_blank = |c: char| if allowed.contains(c) { c } else { ' ' };
    for c in text.chars() {
        match c {
            'A'..='Z' | '0'..='9' | ' ' => clean.push(c),
            'a'..='z' => clean.push(c.to_ascii_uppercase()),
            c if allowed.contains(c) => clean.push(c),
            '(' | '{' => clean.push(or_blank('[')),
            ')' | '}' => clean.push(or_blank(']')),
            '_' => clean.push(or_blank('-')),
            'ä' | 'Ä' => clean.push_str("AE"),
            'ö' | 'Ö' => clean.push_str("OE"),
            'ü' | 'Ü' => clean.push_str("UE"),
            'ß' => clean.push_str("SS"),
            '\n' | '\r' | '\t' => clean.push(' '),
            _ => clean.push(or_blank('?')),
        }
    }
    clean
}

/// A clean comment cut into pieces of at most `limit` characters, at blanks where there are any.
pub(super) fn comment_pieces(clean: &str, limit: usize) -> Vec<&str> {
    let limit = limit.max(1);
    let mut pieces = Vec::new();
    let mut rest = clean.trim();
    while rest.len() > limit {
        // Clean text is ASCII, so that every byte is a border.
        let cut = rest[..=limit].rfind(' ').filter(|at| *at > 0).unwrap_or(limit);
        pieces.push(rest[..cut].trim_end());
        rest = rest[cut..].trim_start();
    }
    pieces.push(rest);
    pieces
}

/// The text as a name of a program: upper-case letters, digits and underscores, at most `length` of
/// them, the first of which is no underscore.
pub(super) fn program_id(text: &str, number: u32, length: usize) -> String {
    let clean = clean(text, "");
    let words: Vec<&str> = clean.split(' ').filter(|w| !w.is_empty()).collect();
    let name: String = words.join("_").chars().take(length).collect();
    let name = name.trim_end_matches('_');
    if name.is_empty() { format!("P{number}").chars().take(length).collect() } else { name.to_owned() }
}

/// Appends `X12.5`, or `X2=12.5` for an axis with a number.
pub(super) fn push_axis_word(out: &mut String, axis: AxisLetter, units: i64, settings: &PostSettings) {
    out.push(axis.letter());
    if axis.number() > 0 {
        out.push(char::from(b'0' + axis.number()));
        out.push('=');
    }
    push_number(out, units, settings.decimals.of(axis.kind()), settings.trailing_zeros, settings.rules.numbers);
}

/// Appends a number by the control's rules.
pub(super) fn push_number(out: &mut String, units: i64, decimals: u8, trailing_zeros: bool, rule: NumberRule) {
    if rule.plus_sign && units >= 0 {
        out.push('+');
    }
    number_text::push_units(out, units, decimals, trailing_zeros);
    if !rule.always_point && out.ends_with('.') {
        out.pop();
    }
}

#[cfg(test)]
#[path = "../../tests/unit/write/text.rs"]
mod tests;
