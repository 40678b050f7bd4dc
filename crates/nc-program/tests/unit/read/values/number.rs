use crate::read::values::number::*;

#[test]
fn numbers_are_those_of_the_standard_library() {
    let mut random = facemill_test_kit::Random(0x1234_5678_9abc_def0);
    for _ in 0..200_000 {
        let state = random.bits();
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
