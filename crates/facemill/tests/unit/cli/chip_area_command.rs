use super::*;

/// Six digits at least come back from the text, of every size, and no row of zeros.
#[test]
fn areas_of_every_size_are_reported_to_six_digits() {
    for exponent in -300..300 {
        for lead in [1.0, 1.234_567_89, 9.999_999_6] {
            let area = lead * 10f64.powi(exponent);
            let text = rounded(area, 0.0);
            let reported: f64 = text.parse().unwrap();
            assert!((reported - area).abs() <= 5.1e-6 * area, "{area:e}: {text}");
            assert!(text.len() <= 20, "{area:e}: {text}");
        }
    }
}

/// For every bound, the text is off by at most the bound and half a unit of the last digit, and
/// that unit is no finer than the bound.
#[test]
fn no_digit_is_printed_that_the_bound_does_not_guarantee() {
    for (area, error_bound, reported) in [
        (12.345_678_9, 1e-12, "12.345679"),
        (12.345_678_9, 3e-4, "12.346"),
        (12.345_678_9, 1e-3, "12.346"),
        (12.345_678_9, 0.4, "12"),
        (1234.567, 30.0, "1200"),
        (2.5e-5, 1e-6, "2.5e-5"),
        (2.5e-5, 1e-4, "0"),
        (0.07, 0.09, "0.1"),
        (3.0, 40.0, "0"),
        (7.654_321e13, 1e10, "7.654e13"),
    ] {
        assert_eq!(rounded(area, error_bound), reported, "{area} {error_bound}");
    }
    for k in 0..2000 {
        let spread = |factor: f64, decades: f64| (f64::from(k) * factor).fract() * decades;
        let area = 10f64.powf(spread(0.618_033_988_75, 20.0) - 8.0);
        let error_bound = area * 10f64.powf(spread(0.414_213_562_37, 12.0) - 11.0);
        let text = rounded(area, error_bound);
        let found: f64 = text.parse().unwrap();
        let unit = 10f64.powf(error_bound.log10().ceil());
        assert!(
            (found - area).abs() <= 0.51 * unit.max(1e-5 * area).max(1e-16 * area),
            "{area:e} {error_bound:e}: {text}"
        );
        // The last digit is a multiple of the unit.
        let multiple = found / unit;
        assert!((multiple - multiple.round()).abs() <= 1e-6 * multiple.max(1.0), "{area:e} {error_bound:e}: {text}");
    }
}

#[test]
fn areas_below_zero_within_their_error_are_zero_and_others_are_reported() {
    assert_eq!([rounded(0.0, 0.0), rounded(-0.0, 0.0), rounded(-1e-15, 1e-14)], ["0"; 3]);
    assert_eq!(rounded(-1e-3, 1e-14), "-0.00100000");
    assert_eq!([rounded(160.0, 0.0), rounded(1e-11, 1e-16)], ["160.000000", "1.00000e-11"]);
}
