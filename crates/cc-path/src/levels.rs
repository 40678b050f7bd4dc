use crate::PathError;

/// A piece of the surface: the levels it reaches over and the largest step of level that keeps passes on it close enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Band {
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// Allowed width × slope, above zero.
    pub(crate) limit: f64,
    /// The same before width and slope were raised to their smallest values.
    pub(crate) asked: f64,
    /// Gain of level per way up the piece, above zero.
    pub(crate) slope: f64,
}

/// Most passes a plan may have. A propeller of 8 m cut at 0.1 mm has 80,000; more is a wrong setting, and would fill the
/// memory before anyone sees it.
const MAX_LEVELS: usize = 200_000;

/// Levels from `first` to `last`, both included and `first` ≤ `last`, in rising order: each step is the largest that no
/// band it reaches into forbids.
///
/// With `even`, the limits are shrunk alike until the same number of steps fits without a rest.
///
/// # Errors
/// When there would be more than 200,000 levels.
pub(crate) fn plan_levels(bands: &[Band], first: f64, last: f64, even: bool) -> Result<Vec<f64>, PathError> {
    let mut sorted = bands.to_vec();
    sorted.sort_by(|a, b| a.low.total_cmp(&b.low).then(a.limit.total_cmp(&b.limit)));
    let too_many = PathError::TooManyPasses { limit: MAX_LEVELS };
    let largest = step_through(&sorted, first, last, 1.0, MAX_LEVELS).ok_or(too_many)?;
    if !even || largest.len() < 3 {
        return Ok(largest);
    }
    // The number of steps falls with the limits' factor, so bisection finds the smallest factor with no more steps. Forty
    // halvings leave the last step full to twelve digits.
    let (mut low, mut high, mut best) = (0.5, 1.0, largest);
    for _ in 0..40 {
        let factor = 0.5 * (low + high);
        match step_through(&sorted, first, last, factor, best.len()) {
            Some(levels) => (high, best) = (factor, levels),
            None => low = factor,
        }
    }
    Ok(best)
}

/// How many of the steps between the levels (in rising order) are larger than was asked for.
pub(crate) fn count_wide(bands: &[Band], levels: &[f64]) -> usize {
    let mut wide = vec![false; levels.len().saturating_sub(1)];
    for b in bands.iter().filter(|b| b.asked < b.limit) {
        for k in steps_into(b, levels) {
            // Rounding of levels up to 1e4 mm is no excess.
            wide[k] |= levels[k + 1] - levels[k] > b.asked + 1e-9;
        }
    }
    wide.into_iter().filter(|&w| w).count()
}

/// Longest way up a piece from one of the levels (in rising order) to the next, as if the piece reached over both.
pub(crate) fn widest_strip(bands: &[Band], levels: &[f64]) -> f64 {
    let way = |b: &Band| steps_into(b, levels).map(|k| (levels[k + 1] - levels[k]) / b.slope).fold(0.0, f64::max);
    bands.iter().map(way).fold(0.0, f64::max)
}

/// The steps, by the index of their lower level, that share more than a border with the band.
fn steps_into(b: &Band, levels: &[f64]) -> std::ops::Range<usize> {
    let n_steps = levels.len().saturating_sub(1);
    let first = levels.partition_point(|&l| l <= b.low).saturating_sub(1);
    let end = levels.partition_point(|&l| l < b.high).min(n_steps);
    first.min(end)..end
}

/// `None` when there are more than `max_levels`.
fn step_through(sorted: &[Band], first: f64, last: f64, factor: f64, max_levels: usize) -> Option<Vec<f64>> {
    let mut levels = vec![first];
    let mut active: Vec<Band> = Vec::new();
    let mut next = 0;
    let mut level = first;
    while level < last {
        while sorted.get(next).is_some_and(|b| b.low <= level) {
            active.push(sorted[next]);
            next += 1;
        }
        active.retain(|b| b.high > level);
        let mut step = active.iter().map(|b| b.limit * factor).fold(last - level, f64::min);
        for b in &sorted[next..] {
            if b.low - level >= step {
                break;
            }
            // The step may go as far as the band without a say of it.
            step = step.min((b.limit * factor).max(b.low - level));
        }
        // A step lost in rounding would never end.
        let stepped = level + step;
        level = if step >= last - level { last } else { stepped.max(level.next_up()) };
        levels.push(level);
        if levels.len() > max_levels {
            return None;
        }
    }
    Some(levels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_kit::Lcg;

    fn random_bands(rng: &mut Lcg) -> Vec<Band> {
        (0..300)
            .map(|_| {
                let low = 100.0 * rng.unit();
                Band {
                    low,
                    high: low + 5.0 * rng.unit(),
                    limit: 0.05 + 4.0 * rng.unit().powi(3),
                    asked: 0.0,
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
        let mut rng = Lcg::new(7);
        for _ in 0..20 {
            let bands = random_bands(&mut rng);
            let levels = plan_levels(&bands, 0.0, 100.0, false).unwrap();
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
        let bands = [Band { low: 0.0, high: 100.0, limit: 3.0, asked: 3.0, slope: 1.0 }];
        let levels = plan_levels(&bands, 0.0, 100.0, true).unwrap();
        assert_eq!(levels.len(), 35);
        assert!(levels.windows(2).all(|w| (w[1] - w[0] - 100.0 / 34.0).abs() < 1e-9));
        let mut rng = Lcg::new(8);
        let bands = random_bands(&mut rng);
        let (largest, even) =
            (plan_levels(&bands, 0.0, 100.0, false).unwrap(), plan_levels(&bands, 0.0, 100.0, true).unwrap());
        assert_eq!(largest.len(), even.len());
        assert!(even.windows(2).all(|w| allowed(&bands, w[0], w[1])));
    }

    #[test]
    fn only_steps_wider_than_asked_for_count_as_wide() {
        let at = |low: f64, asked: f64| Band { low, high: low + 1.0, limit: 2.0, asked, slope: 0.5 };
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
        assert_eq!(plan_levels(&[], 5.0, 5.0, true).unwrap(), [5.0]);
        assert_eq!(plan_levels(&[], 5.0, 8.0, true).unwrap(), [5.0, 8.0]);
        let bands = [Band { low: 0.0, high: 100.0, limit: 1e-12, asked: 1e-12, slope: 1.0 }];
        assert!(matches!(plan_levels(&bands, 0.0, 100.0, false), Err(PathError::TooManyPasses { .. })));
    }
}
