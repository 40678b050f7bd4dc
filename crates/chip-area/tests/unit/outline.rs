use super::*;

#[test]
fn steps_edges_and_kinks_are_resolved_to_the_accuracy() {
    // A half disc of radius 3 above z = 0 with a slot of depth 1 in a width of √2 at its top, and
    // nothing beyond.
    let second = |y: f64| (y.abs() <= 3.0).then_some(-(9.0 - y * y).max(0.0).sqrt());
    let first = |y: f64| ((y - 0.1).abs() <= 0.5 * 2f64.sqrt()).then_some(-1.0);
    let half_disc = 4.5 * std::f64::consts::PI;
    for accuracy in [1e-3, 1e-6, 1e-9] {
        let area = chip_area_between_outlines(first, second, |_| 0.0, -4.1..=5.3, accuracy).unwrap();
        assert!((area - (half_disc - 2f64.sqrt())).abs() <= accuracy, "{accuracy}: {area}");
    }
}

#[test]
fn nothing_is_cut_without_second_position_stock_or_range() {
    let flat = |_: f64| Some(0.0);
    let none = |_: f64| None;
    let area = |second: &dyn Fn(f64) -> Option<f64>, top: f64, range| {
        chip_area_between_outlines(none, second, |_| top, range, 1e-6).unwrap()
    };
    assert_eq!(area(&none, 1.0, 0.0..=1.0), 0.0);
    assert_eq!(area(&flat, f64::NEG_INFINITY, 0.0..=1.0), 0.0);
    assert_eq!(area(&flat, 1.0, 1.0..=0.0), 0.0);
    assert!((area(&flat, 1.0, 0.0..=3.0) - 3.0).abs() < 1e-12);
}

#[test]
fn what_is_no_number_is_refused() {
    let flat = |_: f64| Some(0.0);
    let area = |top: f64, range, accuracy| chip_area_between_outlines(|_| None, flat, |_| top, range, accuracy);
    assert_eq!(area(1.0, f64::NEG_INFINITY..=1.0, 1e-6), Err(OutlineError::RangeNotFinite));
    assert_eq!(area(1.0, 0.0..=1.0, 0.0), Err(OutlineError::BadAccuracy { accuracy: 0.0 }));
    assert!(matches!(area(1.0, 0.0..=1.0, f64::NAN), Err(OutlineError::BadAccuracy { .. })));
    assert!(matches!(area(f64::NAN, 0.0..=1.0, 1e-6), Err(OutlineError::HeightNotFinite { .. })));
    assert!(matches!(area(f64::INFINITY, 0.0..=1.0, 1e-6), Err(OutlineError::HeightNotFinite { .. })));
    let nan = chip_area_between_outlines(|_| Some(f64::NAN), flat, |_| 1.0, 0.0..=1.0, 1e-6);
    assert!(matches!(nan, Err(OutlineError::HeightNotFinite { .. })));
    // A height without any regularity.
    let noise = |y: f64| f64::from((y.to_bits().wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as u32);
    let rough = chip_area_between_outlines(|_| None, flat, noise, 0.0..=1.0, 1e-6);
    assert_eq!(rough, Err(OutlineError::TooManyHeights { accuracy: 1e-6 }));
}
