use crate::error::Remedy;
use crate::layout::levels::*;
use crate::test_kit::Random;

const ANY: StepOverCause = StepOverCause { largest: 5.0, is_largest: true };

fn random_bands(rng: &mut Random) -> Vec<Band> {
    (0..300)
        .map(|_| {
            let low = 100.0 * rng.unit();
            Band {
                low,
                high: low + 5.0 * rng.unit(),
                limit: 0.05 + 4.0 * rng.unit().powi(3),
                requested: 0.0,
                slope: 1.0,
            }
        })
        .collect()
}

fn allowed(bands: &[Band], from: f64, to: f64) -> bool {
    bands.iter().all(|b| b.high <= from || b.low >= to || to - from <= b.limit * (1.0 + 1e-12))
}

#[test]
fn no_step_is_larger_than_a_band_it_reaches_into_allows_and_none_could_be_longer() {
    let mut rng = Random(7);
    for _ in 0..20 {
        let bands = random_bands(&mut rng);
        let levels = plan_levels(&bands, ANY, 0.0, 100.0, false).unwrap();
        assert_eq!((levels[0], levels[levels.len() - 1]), (0.0, 100.0));
        for w in levels.windows(2) {
            assert!(allowed(&bands, w[0], w[1]), "{w:?}");
        }
        for w in levels.windows(2).rev().skip(1) {
            assert!(!allowed(&bands, w[0], w[1] + 1e-6), "{w:?} could be longer");
        }
    }
}

#[test]
fn even_levels_are_as_many_and_leave_no_rest() {
    let bands = [Band { low: 0.0, high: 100.0, limit: 3.0, requested: 3.0, slope: 1.0 }];
    let levels = plan_levels(&bands, ANY, 0.0, 100.0, true).unwrap();
    assert_eq!(levels.len(), 35);
    assert!(levels.windows(2).all(|w| (w[1] - w[0] - 100.0 / 34.0).abs() < 1e-9));
    let mut rng = Random(8);
    let bands = random_bands(&mut rng);
    let (largest, even) =
        (plan_levels(&bands, ANY, 0.0, 100.0, false).unwrap(), plan_levels(&bands, ANY, 0.0, 100.0, true).unwrap());
    assert_eq!(largest.len(), even.len());
    assert!(even.windows(2).all(|w| allowed(&bands, w[0], w[1])));
}

#[test]
fn only_steps_wider_than_requested_count_as_wide() {
    let at = |low: f64, requested: f64| Band { low, high: low + 1.0, limit: 2.0, requested, slope: 0.5 };
    let levels = [0.0, 2.0, 4.0, 6.0];
    assert_eq!(count_wide(&[at(0.0, 2.0), at(2.5, 3.0)], &levels), 0);
    assert_eq!(count_wide(&[at(0.0, 2.0), at(2.5, 0.5), at(2.7, 1.9)], &levels), 1);
    assert_eq!(count_wide(&[at(3.5, 0.5)], &levels), 2);
    assert_eq!(count_wide(&[at(-3.0, 0.5), at(7.0, 0.5)], &levels), 0);
    assert_eq!(count_wide(&[at(3.5, 0.5)], &[1.0]), 0);
    assert_eq!(widest_strip(&[at(3.5, 0.5)], &levels), 4.0);
    assert_eq!(widest_strip(&[at(-3.0, 0.5), at(6.0, 0.5)], &levels), 0.0);
}

#[test]
fn one_level_for_no_range_and_an_error_for_steps_without_end() {
    assert_eq!(plan_levels(&[], ANY, 5.0, 5.0, true).unwrap(), [5.0]);
    assert_eq!(plan_levels(&[], ANY, 5.0, 8.0, true).unwrap(), [5.0, 8.0]);
    for limit in [1e-12, 1e-3, 0.004] {
        let band = Band { low: 0.0, high: 100.0, limit, requested: limit, slope: 1.0 };
        let cause = StepOverCause { largest: limit, is_largest: true };
        let Err(PathError::TooManyPasses { remedy, .. }) = plan_levels(&[band], cause, 0.0, 100.0, false) else {
            panic!("{limit}")
        };
        // The value it names is enough, and no more than needed.
        let Remedy::LargestStepOver(limit) = remedy else { panic!("{remedy}") };
        let levels = plan_levels(&[Band { limit, ..band }], cause, 0.0, 100.0, true).unwrap();
        assert!((MAX_LEVELS / 2..=MAX_LEVELS).contains(&levels.len()), "{limit}: {}", levels.len());
    }
    // Many bands side by side.
    let bands = vec![Band { low: 0.0, high: 100.0, limit: 0.02, requested: 0.02, slope: 1.0 }; 10_000];
    assert!(matches!(plan_levels(&bands, ANY, 0.0, 100.0, false), Err(PathError::TooManyPasses { .. })));
}
