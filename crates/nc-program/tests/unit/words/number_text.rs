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
    let mut random = facemill_test_kit::Random(0x1234_5678_9abc_def0);
    for _ in 0..20_000 {
        let state = random.bits();
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
