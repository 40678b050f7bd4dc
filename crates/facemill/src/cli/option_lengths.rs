//! Lengths that are given by options: a wrong one is told with its option, before any file is read.

use facemill::STOCK_TOLERANCES;
use facemill::new_job::ROTOR_SCALES;

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

/// A tolerance that stock can be cut within, mm.
pub(crate) fn stock_tolerance(text: &str) -> Result<f64, String> {
    let tolerance = text.parse().ok().filter(|mm| STOCK_TOLERANCES.contains(mm));
    tolerance
        .ok_or_else(|| format!("must be a length from {} to {} mm", STOCK_TOLERANCES.start(), STOCK_TOLERANCES.end()))
}

/// A scale of the example rotor.
pub(crate) fn rotor_scale(text: &str) -> Result<f64, String> {
    let scale = text.parse().ok().filter(|scale| ROTOR_SCALES.contains(scale));
    scale.ok_or_else(|| format!("must be a number from {} to {}", ROTOR_SCALES.start(), ROTOR_SCALES.end()))
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

    #[test]
    fn tolerances_of_stock_are_within_their_range() {
        for text in ["0", "-1", "9e-5", "0.51", "nan", "inf", "ten"] {
            assert!(stock_tolerance(text).is_err_and(|why| why.contains("from 0.0001 to 0.5 mm")), "{text}");
        }
        assert_eq!(["1e-4", "0.05", "0.5"].map(stock_tolerance), [Ok(0.0001), Ok(0.05), Ok(0.5)]);
    }

    #[test]
    fn a_scale_out_of_its_range_is_told_with_its_option_and_range() {
        #[derive(clap::Parser)]
        struct Command {
            #[arg(long, allow_negative_numbers = true, value_parser = rotor_scale)]
            scale: f64,
        }
        let parsed = |text: &str| <Command as clap::Parser>::try_parse_from(["new", "--scale", text]);
        for text in ["0", "-1", "0.09", "101", "nan", "inf", "ten"] {
            let why = parsed(text).err().unwrap_or_else(|| panic!("{text} is taken")).to_string();
            assert!(why.contains("--scale") && why.contains("from 0.1 to 100"), "{why}");
        }
        for (text, scale) in [("0.1", 0.1), ("10", 10.0), ("1e2", 100.0)] {
            assert_eq!(parsed(text).unwrap_or_else(|e| panic!("{e}")).scale, scale);
        }
    }
}
