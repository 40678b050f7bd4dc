//! Lengths that are given by options: a wrong one is told with its option, before any file is read.

/// A length above 0, mm.
pub(crate) fn above_zero(text: &str) -> Result<f64, String> {
    let length = text.parse().ok().filter(|mm: &f64| *mm > 0.0 && mm.is_finite());
    length.ok_or_else(|| "must be a length above 0 mm".to_owned())
}

/// A length of 0 or more, mm.
pub(crate) fn from_zero(text: &str) -> Result<f64, String> {
    let length = text.parse().ok().filter(|mm: &f64| *mm >= 0.0 && mm.is_finite());
    length.ok_or_else(|| "must be a length of at least 0 mm".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_finite_numbers_within_their_range() {
        for text in ["-1", "-1e-9", "nan", "inf", "-inf", "1e400", "", "1mm", "1,5"] {
            assert!(above_zero(text).is_err() && from_zero(text).is_err(), "{text}");
        }
        assert_eq!([above_zero("0.5"), from_zero("0.5")], [Ok(0.5), Ok(0.5)]);
        for zero in ["0", "-0", "1e-400"] {
            assert!(above_zero(zero).is_err() && from_zero(zero).is_ok(), "{zero}");
        }
    }
}
