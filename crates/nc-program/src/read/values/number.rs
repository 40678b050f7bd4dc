//! Numbers of NC words, as fast as a program of a million blocks wants them.

/// Longest number: twice what any control takes.
const MAX_DIGITS: usize = 30;

/// Digits that a mantissa holds exactly: 10¹⁵ is below 2⁵³.
const EXACT_DIGITS: usize = 15;

/// Powers of ten that are exact, up to as many decimals as [`EXACT_DIGITS`].
const POWERS: [f64; EXACT_DIGITS + 1] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

/// `-12.5`, `.5`, `5.`: at least one digit, at most one point, a sign only in front. The nearest number there is: with
/// few digits as a quotient of two exact numbers, which is rounded once, else by the standard library.
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
mod tests {
    use crate::read::values::number::*;

    #[test]
    fn numbers_are_those_of_the_standard_library() {
        let mut state = 0x1234_5678_9abc_def0_u64;
        for _ in 0..200_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let digits = format!("{}", state >> (state % 60));
            let point = (state >> 7) as usize % (digits.len() + 1);
            let sign = ["", "-", "+"][(state >> 40) as usize % 3];
            let text = format!("{sign}{}.{}", &digits[..point], &digits[point..]);
            let expected: f64 = text.parse().unwrap();
            assert_eq!(parse(text.as_bytes()).map(f64::to_bits), Some(expected.to_bits()), "{text}");
        }
    }

    #[test]
    fn what_is_no_number_has_none() {
        for text in ["", "-", ".", "+.", "1.2.3", "1-", "--1", "1e5", "1234567890123456789012345678901", "1 2", "x"] {
            assert_eq!(parse(text.as_bytes()), None, "{text}");
        }
    }
}
