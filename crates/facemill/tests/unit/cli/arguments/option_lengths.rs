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
fn a_scale_out_of_its_range_is_reported_with_its_option_and_range() {
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
