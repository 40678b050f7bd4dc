//! Numbers of NC words: fixed decimals, no exponent, no negative zero.

/// Values with more digits before the point do not fit a control's eight-digit words.
const LARGEST: f64 = 1e6;

/// `value` in units of its last decimal, rounded to nearest; `None` where it is not finite or not below 10⁶.
///
/// Words are compared as these integers, so that what is suppressed as unchanged is exactly what would be written equal.
pub(crate) fn units(value: f64, decimals: u8) -> Option<i64> {
    (value.abs() < LARGEST).then(|| (value * 10f64.powi(decimals.into())).round() as i64)
}

/// How far above a whole number of units a value may lie by the rounding of its own digits, units. Smaller would take a
/// unit off numbers such as 0.29; a feed larger by so little moves no axis faster than it can.
const DIGITS: f64 = 1e-6;

/// `value` in units of its last decimal, rounded down; `None` where [`units`] has none.
pub(crate) fn units_below(value: f64, decimals: u8) -> Option<i64> {
    (value.abs() < LARGEST).then(|| (value * 10f64.powi(decimals.into()) + DIGITS).floor() as i64)
}

/// `value` in units of its last decimal, rounded up; `None` where [`units`] has none.
pub(crate) fn units_above(value: f64, decimals: u8) -> Option<i64> {
    (value.abs() < LARGEST).then(|| (value * 10f64.powi(decimals.into()) - DIGITS).ceil() as i64)
}

/// Appends the number of these units: `100.` or, with trailing zeros, `100.000`; always with a decimal point.
pub(crate) fn push_units(out: &mut String, units: i64, decimals: u8, trailing_zeros: bool) {
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

/// The number as text, or `None` where [`units`] has none.
pub(crate) fn number(value: f64, decimals: u8, trailing_zeros: bool) -> Option<String> {
    let mut text = String::new();
    push_units(&mut text, units(value, decimals)?, decimals, trailing_zeros);
    Some(text)
}

/// Longest number: twice what any control takes.
const MAX_DIGITS: usize = 30;

/// `-12.5`, `.5`, `5.`: at least one digit, at most one point, a sign only in front.
pub(crate) fn parse(text: &[u8]) -> Option<f64> {
    let unsigned = text.strip_prefix(b"-").or_else(|| text.strip_prefix(b"+")).unwrap_or(text);
    let points = unsigned.iter().filter(|b| **b == b'.').count();
    let digits = unsigned.iter().filter(|b| b.is_ascii_digit()).count();
    if points > 1 || !(1..=MAX_DIGITS).contains(&digits) || points + digits != unsigned.len() {
        return None;
    }
    str::from_utf8(text).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use crate::words::number_text::*;

    #[test]
    fn numbers_have_a_point_and_no_sign_at_zero() {
        let short = |v| number(v, 3, false).unwrap();
        assert_eq!(short(100.0), "100.");
        assert_eq!(short(-0.0004), "0.");
        assert_eq!(short(-0.0), "0.");
        assert_eq!(short(-0.5), "-0.5");
        assert_eq!(short(12.0504), "12.05");
        assert_eq!(short(0.0005), "0.001");
        assert_eq!(number(-7.25, 3, true).unwrap(), "-7.250");
        assert_eq!(number(7.6, 0, true).unwrap(), "8.");
    }

    #[test]
    fn rounding_down_and_up_keeps_numbers_that_words_can_say() {
        for k in 0..100_000_i64 {
            for decimals in 0..=4 {
                let text = {
                    let mut t = String::new();
                    push_units(&mut t, k, decimals, false);
                    t
                };
                let value: f64 = text.parse().unwrap();
                assert_eq!((units_below(value, decimals), units_above(value, decimals)), (Some(k), Some(k)), "{text}");
            }
        }
        assert_eq!((units_below(0.2999, 1), units_above(0.2001, 1)), (Some(2), Some(3)));
    }

    #[test]
    fn what_no_word_can_hold_has_no_text() {
        for v in [f64::NAN, f64::INFINITY, -1e6, 1e300] {
            assert_eq!(number(v, 3, false), None);
        }
    }

    #[test]
    fn written_number_is_within_half_a_unit() {
        let mut state = 0x1234_5678_9abc_def0u64;
        for _ in 0..20_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let value = ((state >> 11) as f64 / (1u64 << 53) as f64 - 0.5) * 2e5;
            for decimals in 0..=6 {
                let text = number(value, decimals, state & 1 == 0).unwrap();
                let read: f64 = text.parse().unwrap();
                // The last term is the rounding of the value itself.
                assert!((read - value).abs() <= 0.5 * 10f64.powi(-i32::from(decimals)) + 3e-11, "{value} {text}");
                assert!(!text.contains('e'));
            }
        }
    }
}
