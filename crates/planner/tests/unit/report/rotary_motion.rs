use crate::report::rotary_motion::*;

#[test]
fn turning_points_count_beyond_the_dead_band_only() {
    let wave = |n: usize, size: f64| -> Vec<f64> {
        (0..n).map(|k| size * (k as f64 * std::f64::consts::TAU / 20.0).sin()).collect()
    };
    // Three periods have six turning points.
    assert_eq!(reversals(&wave(61, 1.0)), 6);
    assert_eq!(reversals(&wave(61, 0.4 * DEAD_BAND)), 0);
    let slope: Vec<f64> = wave(61, 0.4 * DEAD_BAND).iter().enumerate().map(|(k, v)| v + k as f64 * 0.01).collect();
    assert_eq!(reversals(&slope), 0);
    assert_eq!(reversals(&[]), 0);
}

#[test]
fn speed_and_acceleration_of_a_parabola_are_its_own() {
    let times: Vec<f64> = (0..50).map(|k| 0.1 * f64::from(k) + 0.03 * f64::from(k % 3)).collect();
    let values: Vec<f64> = times.iter().map(|t| 0.5 * 0.7 * t * t - t).collect();
    let mut sum = Sum::default();
    sum.add(&times, &values);
    assert!((sum.acceleration - 0.7).abs() < 1e-9 && ((sum.square / sum.time).sqrt() - 0.7).abs() < 1e-9);
    let last = times.len() - 1;
    let mean_of_last = 0.7 * 0.5 * (times[last] + times[last - 1]) - 1.0;
    assert!((sum.velocity - mean_of_last.abs()).abs() < 1e-9);
}
