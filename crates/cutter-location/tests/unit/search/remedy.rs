use crate::search::remedy::smallest;

#[test]
fn smallest_amounts_are_enough_and_their_largest_parts_are_not() {
    for threshold in [1e-3, 0.2, 3.0, 9.9] {
        let amount = smallest(10.0, |x| x >= threshold).unwrap();
        assert!(amount >= threshold && 0.95 * amount < threshold, "{amount} for {threshold}");
    }
    // At 95 % of the amount where bisection ends it helps again: less is reported.
    let windows = |x: f64| (4.27..4.28).contains(&x) || x >= 4.45;
    let amount = smallest(12.0, windows).unwrap();
    assert!((4.27..4.28).contains(&amount), "{amount}");
    assert_eq!(smallest(10.0, |_| true), None);
    assert_eq!(smallest(10.0, |x| x > 10.0), None);
    assert_eq!(smallest(0.0, |_| true), None);
    assert_eq!(smallest(f64::NAN, |_| true), None);
}
