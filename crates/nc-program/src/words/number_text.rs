//! Numbers of NC words: fixed decimals, no exponent, no negative zero.

/// Values with more digits before the point do not fit a control's eight-digit words.
const LARGEST: f64 = 1e6;

/// `value` in units of its last decimal, rounded to nearest; `None` where it is not finite or not
/// below 10⁶.
///
/// Words are compared as these integers, so that what is suppressed as unchanged is exactly what
/// would be written equal.
pub fn units(value: f64, decimals: u8) -> Option<i64> {
    (value.abs() < LARGEST).then(|| (value * 10f64.powi(decimals.into())).round() as i64)
}

/// How far above a whole number of units a value may lie by the rounding of its own digits, units.
/// Smaller would take a unit off numbers such as 0.29; a feed larger by so little moves no axis
/// faster than it can.
const DIGITS: f64 = 1e-6;

/// `value` in units of its last decimal, rounded down; `None` where [`units`] has none.
pub fn units_below(value: f64, decimals: u8) -> Option<i64> {
    (value.abs() < LARGEST).then(|| (value * 10f64.powi(decimals.into()) + DIGITS).floor() as i64)
}

/// `value` in units of its last decimal, rounded up; `None` where [`units`] has none.
pub fn units_above(value: f64, decimals: u8) -> Option<i64> {
    (value.abs() < LARGEST).then(|| (value * 10f64.powi(decimals.into()) - DIGITS).ceil() as i64)
}

/// Appends the number of these units: `100.` or, with trailing zeros, `100.000`; always with a
/// decimal point.
pub fn push_units(out: &mut String, units: i64, decimals: u8, trailing_zeros: bool) {
    use std::fmt::Write;
    let scale = 10u64.pow(decimals.into());
    let (whole, mut fraction) = (units.unsigned_abs() / scale, units.unsigned_abs() % scale);
    if units < 0 {
        out.push('-');
    }
    // Writing to a String cannot fail.
    let _ = write!(out, "{whole}.");
    let mut width = usize::from(decimals);
    if !trailing_zeros {
        while width > 0 && fraction % 10 == 0 {
            fraction /= 10;
            width -= 1;
        }
    }
    if width > 0 {
        let _ = write!(out, "{fraction:0width$}");
    }
}

/// The number as text, or `None` where `units` has none.
pub fn number(value: f64, decimals: u8, trailing_zeros: bool) -> Option<String> {
    let mut text = String::new();
    push_units(&mut text, units(value, decimals)?, decimals, trailing_zeros);
    Some(text)
}

/// Longest number: twice what any control takes.
const MAX_DIGITS: usize = 30;

/// `-12.5`, `.5`, `5.`: at least one digit, at most one point, a sign only in front.
pub fn parse(text: &[u8]) -> Option<f64> {
    let unsigned = text.strip_prefix(b"-").or_else(|| text.strip_prefix(b"+")).unwrap_or(text);
    let points = unsigned.iter().filter(|b| **b == b'.').count();
    let digits = unsigned.iter().filter(|b| b.is_ascii_digit()).count();
    if points > 1 || !(1..=MAX_DIGITS).contains(&digits) || points + digits != unsigned.len() {
        return None;
    }
    str::from_utf8(text).ok()?.parse().ok()
}

#[cfg(test)]
#[path = "../../tests/unit/words/number_text.rs"]
mod tests;
