use crate::layout::field::accumulated::*;
use crate::layout::levels::Band;

const CAUSE: StepOverCause = StepOverCause { largest: 5.0, is_largest: false };

fn bands(limit: impl Fn(f64) -> f64) -> Vec<Band> {
    let band = |k: u32| {
        let (low, high) = (0.05 * f64::from(k), 0.05 * f64::from(k + 1));
        Band { low, high, limit: limit(0.5 * (low + high)), requested: 1.0, slope: 1.0 }
    };
    (0..2000).map(band).collect()
}

fn width(bands: &[Band]) -> AccumulatedWidth {
    AccumulatedWidth::of(bands.iter().map(|b| [(b.low, b.limit), (b.high, b.limit)]), [0.0, 100.0])
}

#[test]
fn steps_follow_a_width_that_grows_with_the_level() {
    // Steps of a width proportional to the level are a geometric row.
    let bands = bands(|level| 0.02 * (level + 10.0));
    let width = width(&bands);
    let n = width.n_steps(&bands, CAUSE).unwrap();
    assert_eq!(n, (11.0f64.ln() / 0.02).ceil() as usize);
    for order in [LevelOrder::Increasing, LevelOrder::Decreasing] {
        for even in [true, false] {
            let levels = width.levels(n, &LaySettings { even, order, ..LaySettings::default() });
            assert_eq!((levels.len(), levels[0], levels[n]), (n + 1, 0.0, 100.0));
            let rest = usize::from(!even);
            for w in levels[rest..=n - rest].windows(2) {
                let ratio = (w[1] + 10.0) / (w[0] + 10.0);
                assert!(ratio <= 0.02f64.exp() + 1e-5 && ratio > 0.0199f64.exp(), "{w:?} {ratio}");
            }
        }
    }
}

#[test]
fn even_steps_of_one_width_are_equal() {
    let bands = bands(|_| 4.0);
    let width = width(&bands);
    let n = width.n_steps(&bands, CAUSE).unwrap();
    assert_eq!(n, 25);
    for (k, level) in width.levels(n, &LaySettings::default()).iter().enumerate() {
        assert!((level - 4.0 * k as f64).abs() < 1e-9, "{level}");
    }
}

#[test]
fn widths_that_ask_for_too_many_passes_name_the_remedy() {
    let bands = bands(|_| 1e-3);
    let e = width(&bands).n_steps(&bands, CAUSE).unwrap_err();
    assert!(matches!(e.remedy(), Some(crate::Remedy::StripWidth(times)) if times > 5.0 && times < 6.0), "{e}");
}
