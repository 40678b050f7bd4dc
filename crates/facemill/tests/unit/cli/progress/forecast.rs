use crate::cli::progress::forecast::*;

/// Returns the forecasts every 0.2 s of a stage of known progress, with their times.
fn reported(end: f64, share: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let mut forecast = Forecast::default();
    let times = (0..).map(|k| 0.2 * f64::from(k)).take_while(|t| *t <= end);
    times.filter_map(|t| Some((t, forecast.left(t, share(t))?))).collect()
}

#[test]
fn even_steps_end_as_forecast() {
    let all = reported(60.0, |t| t / 60.0);
    assert!(all.len() > 280 && all.iter().all(|(t, left)| (t + left - 60.0).abs() < 0.5), "{all:?}");
}

/// The second half of the steps takes three times as long as the first; the end then moves, and
/// does not jump.
#[test]
fn of_uneven_steps_the_end_moves_slowly() {
    let all = reported(80.0, |t| if t < 20.0 { t / 40.0 } else { 0.5 + (t - 20.0) / 120.0 });
    for pair in all.windows(2) {
        let [before, after] = [pair[0].0 + pair[0].1, pair[1].0 + pair[1].1];
        assert!((after - before).abs() < 1.0, "the end goes from {before:.1} to {after:.1} s in 0.2 s");
    }
    assert!(all.last().is_some_and(|(_, left)| *left < 2.0), "{:?}", all.last());
}

#[test]
fn the_first_steps_have_no_forecast() {
    let mut forecast = Forecast::default();
    assert_eq!([forecast.left(1.0, 0.5), forecast.left(30.0, 0.001), forecast.left(30.0, 0.0)], [None; 3]);
    assert_eq!(forecast.left(30.0, 1.0), Some(0.0));
}
