use crate::{AxisLetter, PostSettings, number_text};

/// Text for a comment in the control's characters: upper-case ASCII letters, digits and ` +-*/=.,:#&'?[]`. Parentheses
/// become brackets, German umlauts two letters, line ends and tabs blanks, everything else `?`. Never longer lines: no
/// line end is left.
pub(crate) fn clean_comment(text: &str) -> String {
    let mut clean = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            'A'..='Z'
            | '0'..='9'
            | ' '
            | '+'
            | '-'
            | '*'
            | '/'
            | '='
            | '.'
            | ','
            | ':'
            | '#'
            | '&'
            | '\''
            | '['
            | ']' => {
                clean.push(c);
            }
            'a'..='z' => clean.push(c.to_ascii_uppercase()),
            '(' | '{' => clean.push('['),
            ')' | '}' => clean.push(']'),
            '_' => clean.push('-'),
            'ä' | 'Ä' => clean.push_str("AE"),
            'ö' | 'Ö' => clean.push_str("OE"),
            'ü' | 'Ü' => clean.push_str("UE"),
            'ß' => clean.push_str("SS"),
            '\n' | '\r' | '\t' => clean.push(' '),
            _ => clean.push('?'),
        }
    }
    clean
}

/// A clean comment cut into pieces of at most `limit` characters, at blanks where there are any.
pub(super) fn comment_pieces(clean: &str, limit: usize) -> Vec<&str> {
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

/// Appends `X12.5`, or `X2=12.5` for an axis with a number.
pub(super) fn push_axis_word(out: &mut String, axis: AxisLetter, units: i64, settings: &PostSettings) {
    out.push(axis.letter());
    if axis.number() > 0 {
        out.push(char::from(b'0' + axis.number()));
        out.push('=');
    }
    number_text::push_units(out, units, settings.decimals.of(axis.kind()), settings.trailing_zeros);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_keep_to_the_characters_of_the_control() {
        assert_eq!(clean_comment("Prüfung (Ø80) a_b\n단"), "PRUEFUNG [?80] A-B ?");
    }

    #[test]
    fn pieces_hold_every_word_and_fit() {
        let text = clean_comment("one two three four_five_six seven");
        for limit in 1..40 {
            let pieces = comment_pieces(&text, limit);
            assert!(pieces.iter().all(|p| p.len() <= limit), "{limit} {pieces:?}");
            let joined: String = pieces.concat().replace(' ', "");
            assert_eq!(joined, text.replace(' ', ""));
        }
    }
}
