use nalgebra::Point3;

use super::*;

fn place(deviation: f64, is_cut: bool) -> DeviationPoint {
    DeviationPoint { position: Point3::origin(), triangle: 1, deviation, is_cut }
}

#[test]
fn stock_that_was_never_there_is_no_gouge() {
    let accuracy = [0.1, 0.02];
    let of = |deviation: f64, is_cut: bool, lacks| {
        Condition::of(Some(&beyond(place(deviation, is_cut), &[0.0, 0.5], lacks)), accuracy)
    };
    // 0.5 mm of allowance: what is 2 mm too deep for the part is 2.5 for the surface.
    assert_eq!(of(-2.0, false, Some(0.1)), Condition::NoStock);
    assert_eq!(of(-2.0, false, None), Condition::Gouged(-2.5));
    assert_eq!(of(-2.0, true, Some(0.1)), Condition::Gouged(-2.5));
    assert_eq!(of(0.45, false, Some(0.1)), Condition::Within(0.45 - 0.5));
    assert_eq!(of(0.55, false, Some(0.1)), Condition::NotReached);
    let figures = |is_cut: bool, lacks| {
        let beyond = beyond(place(-2.0, is_cut), &[0.0, 0.5], lacks);
        let patch = Patch { area: 3.0, is_drive: true, place: Some(beyond) };
        deviation_figures(std::iter::once(beyond), std::iter::once(patch), accuracy)
    };
    let [never, cut] = [false, true].map(|is_cut| figures(is_cut, Some(0.1)));
    assert_eq!((never.largest_gouge, never.area_mm2.no_stock), (None, 3.0));
    assert!(cut.largest_gouge.is_some_and(|gouge| gouge.value_mm == 2.5) && cut.area_mm2.gouged == 3.0);
}
