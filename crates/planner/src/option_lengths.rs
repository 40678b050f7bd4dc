//! Lengths that are given by options: a wrong one is told with its option, before any file is read.

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
