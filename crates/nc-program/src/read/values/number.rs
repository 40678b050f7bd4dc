//! Numbers of NC words, as fast as a program of a million blocks wants them.

/// Longest number: twice what any control takes.
const MAX_DIGITS: usize = 30;

/// Digits that a mantissa holds exactly: 10¹⁵ is below 2⁵³.
const EXACT_DIGITS: usize = 15;

/// Powers of ten that are exact, up to as many decimals as [`EXACT_DIGITS`].
const POWERS: [f64; EXACT_DIGITS + 1] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

/// `-12.5`, `.5`, `5.`: at least one digit, at most one point, a sign only in front. The nearest
/// number there is: with few digits as a quotient of two exact numbers, which is rounded once, else
/// by the standard library.
pub(crate) fn parse(text: &[u8]) -> Option<f64> {
    let (is_negative, unsigned) = match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, text),
    };
    let (mut mantissa, mut digits, mut decimals, mut has_point) = (0_u64, 0, 0, false);
    for byte in unsigned {
        match byte {
            b'0'..=b'9' => {
                // Beyond the exact digits it is not used.
                mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
                digits += 1;
                decimals += usize::from(has_point);
            }
            b'.' if !has_point => has_point = true,
            _ => return None,
        }
    }
    if digits == 0 || digits > MAX_DIGITS {
        return None;
    }
    if digits > EXACT_DIGITS {
        return str::from_utf8(text).ok()?.parse().ok();
    }
    let value = mantissa as f64 / POWERS[decimals];
    Some(if is_negative { -value } else { value })
}

#[cfg(test)]
#[path = "../../../tests/unit/read/values/number.rs"]
mod tests;
