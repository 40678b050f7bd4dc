use super::{LOOSE, normal_equations, solved, third_difference};
use crate::tube::smoothest_within;
use facemill_test_kit::Random;

/// Places from 0 to 3, evenly or not.
fn places(n: usize, uneven: f64, random: &mut Random) -> Vec<f64> {
    let mut at = vec![0.0];
    for k in 1..n {
        at.push(at[k - 1] + 1.0 + uneven * (random.unit() - 0.5));
    }
    let scale = 3.0 / at[n - 1];
    at.iter().map(|x| scale * x).collect()
}

fn rounded(value: f64, half: f64) -> f64 {
    (value / (2.0 * half)).round() * 2.0 * half
}

/// Largest second and third derivative by divided differences.
fn largest_derivatives(at: &[f64], y: &[f64]) -> [f64; 2] {
    let differences = |order: usize, y: &[f64]| -> Vec<f64> {
        (0..y.len() - 1).map(|k| (y[k + 1] - y[k]) * order as f64 / (at[k + order] - at[k])).collect()
    };
    let second = differences(2, &differences(1, y));
    let third = differences(3, &second);
    [second, third].map(|d| d.iter().fold(0.0, |most: f64, d| most.max(d.abs())))
}

#[test]
fn no_value_leaves_its_width_and_those_without_one_stay_to_the_last_bit() {
    let mut random = Random(3);
    for n in [1, 3, 4, 5, 9, 200] {
        let at = places(n, 1.9, &mut random);
        let values: Vec<f64> = (0..n).map(|_| random.unit()).collect();
        let mut width = || if random.unit() < 0.3 { 0.0 } else { 0.2 * random.unit() };
        let widths: Vec<f64> = (0..n).map(|_| width()).collect();
        let smooth = smoothest_within(&at, &values, &widths);
        for k in 0..n {
            assert!((smooth[k] - values[k]).abs() <= widths[k] * (1.0 + 1e-12), "{k} of {n}");
            assert!(widths[k] > 0.0 || smooth[k].to_bits() == values[k].to_bits(), "{k} of {n}");
        }
    }
}

/// Within the width that rounding hides, the curve is recovered nearly as smooth as it was.
#[test]
fn rounding_of_a_smooth_curve_is_taken_out() {
    let mut random = Random(5);
    for (n, half, uneven, third) in [(3000, 5e-6, 0.0, 24.0), (300, 5e-5, 0.0, 12.0), (300, 5e-5, 1.0, 60.0)] {
        let at = places(n, uneven, &mut random);
        let curve: Vec<f64> = at.iter().map(|x| (2.0 * x).sin()).collect();
        let text: Vec<f64> = curve.iter().map(|y| rounded(*y, half)).collect();
        let mut widths = vec![half; n];
        (widths[0], widths[n - 1]) = (0.0, 0.0);
        let smooth = smoothest_within(&at, &text, &widths);
        // The curve's own are 4 and 8.
        let [before, after] = [&text, &smooth].map(|y| largest_derivatives(&at, y));
        assert!(before[0] > 4.6 && after[0] < 4.05, "{n} {before:?} {after:?}");
        assert!(before[1] > 100.0 && after[1] < third, "{n} {before:?} {after:?}");
    }
}

/// A bend larger than the widths remains: at a corner the slopes on both sides, a few places away.
#[test]
fn what_the_widths_do_not_hide_stays() {
    let mut random = Random(9);
    let at = places(301, 0.0, &mut random);
    let corner = |x: f64| if x < 1.5 { 0.3 } else { 0.3 + (x - 1.5) };
    let text: Vec<f64> = at.iter().map(|x| rounded(corner(*x), 5e-6)).collect();
    let smooth = smoothest_within(&at, &text, &vec![5e-6; 301]);
    let [second, _] = largest_derivatives(&at, &smooth);
    // A slope that changes by 1 over a place's 0.01 is a second derivative of 100, or of 50 over
    // two.
    assert!(second > 40.0, "{second}");
    let slope = |k: usize| (smooth[k + 10] - smooth[k]) / (at[k + 10] - at[k]);
    assert!(slope(100).abs() < 1e-4 && (slope(180) - 1.0).abs() < 1e-4, "{} {}", slope(100), slope(180));
}

/// Every small change of the solution is worse.
#[test]
fn the_equations_are_those_of_the_least_roughness() {
    let mut random = Random(21);
    let n = 12;
    let at = places(n, 1.5, &mut random);
    let values: Vec<f64> = (0..n).map(|_| random.unit()).collect();
    let (band, right) = normal_equations(&at, &values);
    let found = solved(&band, &vec![LOOSE; n], &right);
    let energy = |d: &[f64]| -> f64 {
        let third = |k: usize| {
            let weights = third_difference(&at[k..]);
            (0..4).map(|i| weights[i] * (values[k + i] + d[k + i])).sum::<f64>()
        };
        (0..n - 3).map(|k| third(k).powi(2)).sum::<f64>() + LOOSE * d.iter().map(|d| d * d).sum::<f64>()
    };
    let least = energy(&found);
    for k in 0..n {
        for step in [1e-3, -1e-3] {
            let mut other = found.clone();
            other[k] += step;
            assert!(energy(&other) > least, "{k}");
        }
    }
    // Third differences of parabolas are none.
    let parabola: Vec<f64> = at.iter().map(|x| 2.0 - x + 3.0 * x * x).collect();
    let (_, right) = normal_equations(&at, &parabola);
    assert!(right.iter().all(|r| r.abs() < 1e-12), "{right:?}");
}
