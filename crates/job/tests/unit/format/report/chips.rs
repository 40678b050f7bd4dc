use crate::format::report::chips::SpreadReport;

#[test]
fn a_spread_is_mean_extremes_and_deviation_over_the_mean() {
    assert_eq!(SpreadReport::of(std::iter::empty()), None);
    let spread = SpreadReport::of([1.0, 3.0].into_iter()).unwrap();
    assert_eq!(spread, SpreadReport { mean: 2.0, min: 1.0, max: 3.0, variation: 0.5 });
    assert_eq!(SpreadReport::of([0.0].into_iter()).unwrap().variation, 0.0);
}
