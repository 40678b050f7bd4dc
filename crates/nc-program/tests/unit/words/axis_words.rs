use crate::words::axis_words::*;

#[test]
fn names_are_read_as_they_are_written() {
    for letter in "ABCUVWXYZ".chars() {
        for number in 0..=9 {
            let axis = AxisLetter::new(letter, number).unwrap();
            assert_eq!(axis.to_string().parse(), Ok(axis));
            assert_eq!(axis.kind() == AxisKind::Rotary, "ABC".contains(letter));
        }
    }
    for wrong in ["", "D", "X0", "X10", "2X", "É", "X-"] {
        assert!(wrong.parse::<AxisLetter>().is_err(), "{wrong}");
    }
}

#[test]
fn one_axis_more_than_the_capacity_is_refused() {
    let mut words = AxisWords::new();
    for k in 0..AxisWords::CAPACITY {
        words.set(AxisLetter::new("XYZ".chars().nth(k % 3).unwrap(), k as u8 / 3).unwrap(), k as f64).unwrap();
    }
    assert_eq!(words.set(AxisLetter::B, 1.0), Err(TooManyAxes { letter: AxisLetter::B }));
    assert_eq!(words.set(AxisLetter::X, -1.0), Ok(()));
    assert_eq!(words.get(AxisLetter::X), Some(-1.0));
    assert_eq!(words.len(), AxisWords::CAPACITY);
}
