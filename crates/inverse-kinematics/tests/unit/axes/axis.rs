use crate::axes::axis::*;

#[test]
fn letters_are_read_written_and_ordered_as_nc_words() {
    for good in ["X", "Z", "A", "C", "X2", "B2", "W"] {
        assert_eq!(AxisLetter::parse(good).map(|l| l.to_string()).as_deref(), Some(good));
    }
    for bad in ["", "x", "Q", "X0", "X22", "XY", "é"] {
        assert_eq!(AxisLetter::parse(bad), None, "{bad}");
    }
    let mut letters = ["B2", "C", "X2", "A", "Z", "X"].map(|l| AxisLetter::parse(l).unwrap());
    letters.sort();
    assert_eq!(letters.map(|l| l.to_string()), ["X", "Z", "A", "C", "X2", "B2"]);
}
