//! A line without number, blanks and comments.

use facemill_nc_program::Dialect;

/// Longest line that may be a call or a mark of a subprogram, bytes.
const LONGEST: usize = 300;

/// Returns the code of a line in upper case: without comments and its block number, and without
/// blanks, which Klartext and Siemens keep as one between two words. Empty for a line that is too
/// long to be a call or a mark.
pub(crate) fn line_code(line: &[u8], dialect: Dialect) -> String {
    #[cfg(test)]
    tests::N_LINES.with(|n| n.set(n.get() + 1));
    if line.len() > LONGEST {
        return String::new();
    }
    let text = String::from_utf8_lossy(line).to_uppercase();
    let text = text.trim_start_matches('\u{feff}');
    let has_parentheses = !matches!(dialect, Dialect::Siemens840d | Dialect::Heidenhain);
    let mut code = String::with_capacity(text.len());
    let mut depth = 0_usize;
    for c in text.chars() {
        match c {
            ';' if depth == 0 => break,
            '(' if has_parentheses => depth += 1,
            ')' if has_parentheses => depth = depth.saturating_sub(1),
            _ if depth > 0 => {}
            c if c.is_whitespace() => {
                if !has_parentheses && !code.is_empty() && !code.ends_with(' ') {
                    code.push(' ');
                }
            }
            c => code.push(c),
        }
    }
    without_number(code.trim_end(), dialect).to_owned()
}

/// Returns a code without its block number.
fn without_number(code: &str, dialect: Dialect) -> &str {
    let behind = if dialect == Dialect::Heidenhain { Some(code) } else { code.strip_prefix('N') };
    let Some(behind) = behind else { return code };
    let rest = behind.trim_start_matches(|c: char| c.is_ascii_digit());
    if rest.len() == behind.len() { code } else { rest.trim_start() }
}

/// Returns the block number of a line that begins with one (`N12`).
pub(crate) fn block_number(line: &[u8]) -> Option<u32> {
    let line = line.trim_ascii_start();
    let digits = line.strip_prefix(b"N").or_else(|| line.strip_prefix(b"n"))?.trim_ascii_start();
    let end = digits.iter().position(|b| !b.is_ascii_digit()).unwrap_or(digits.len());
    std::str::from_utf8(&digits[..end]).ok()?.parse().ok()
}

#[cfg(test)]
#[path = "../tests/unit/line_code.rs"]
mod tests;
