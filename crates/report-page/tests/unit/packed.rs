use std::io::Read;

use flate2::read::GzDecoder;

use super::*;

/// The numbers of an array as a reader of the format decodes them.
fn decoded(arrays: &Arrays, array: &NumberArray) -> Vec<f64> {
    let mut bytes = Vec::new();
    GzDecoder::new(&gzip(&arrays.bytes[array.array])[..]).read_to_end(&mut bytes).expect("gzip");
    let (mut values, mut whole, mut raw, mut shift) = (Vec::new(), 0_i64, 0_u64, 0);
    for byte in bytes {
        raw |= u64::from(byte & 0x7f) << shift;
        shift += 7;
        if byte < 0x80 {
            whole += (raw >> 1) as i64 ^ -((raw & 1) as i64);
            values.push(if array.gaps && whole == 0 { f64::NAN } else { array.offset + whole as f64 * array.unit });
            (raw, shift) = (0, 0);
        }
    }
    values
}

#[test]
fn numbers_come_back_within_half_a_unit() {
    let values = [0.0, 1234.567, -0.0004, 99_999.999, -2e6, 3.0005];
    let mut arrays = Arrays::default();
    let array = arrays.numbers(values, (1e-3, 0.25));
    assert_eq!(array.n, values.len());
    for (value, back) in values.iter().zip(decoded(&arrays, &array)) {
        assert!((value - back).abs() <= 0.5e-3 + 1e-9, "{value} became {back}");
    }
}

#[test]
fn unknown_numbers_stay_unknown_and_the_least_known_one_does_not_become_one() {
    let values = [None, Some(-3.5), Some(f64::INFINITY), Some(-3.5), Some(0.0), None];
    let mut arrays = Arrays::default();
    let array = arrays.numbers_with_gaps(&values, 0.01).expect("some are known");
    let back = decoded(&arrays, &array);
    assert!(back[0].is_nan() && back[2].is_nan() && back[5].is_nan());
    for (k, value) in [(1, -3.5), (3, -3.5), (4, 0.0)] {
        assert!((back[k] - value).abs() <= 0.005 + 1e-9, "{} instead of {value}", back[k]);
    }
    assert!(arrays.numbers_with_gaps(&[None, Some(f64::NAN)], 1.0).is_none());
}

#[test]
fn base64_is_that_of_the_standard() {
    // RFC 4648, section 10.
    let vectors =
        [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")];
    for (text, expected) in vectors {
        assert_eq!(base64(text.as_bytes()), expected);
    }
}

#[test]
fn the_same_bytes_give_the_same_gzip() {
    let text = "G1 X1. Y2.\n".repeat(1000);
    let [mut a, mut b] = [Arrays::default(), Arrays::default()];
    a.bytes(text.as_bytes());
    b.bytes(text.as_bytes());
    assert_eq!(a.texts(), b.texts());
    // No time and no name in the header.
    assert_eq!(gzip(&a.bytes[0])[3..8], [0; 5]);
}
