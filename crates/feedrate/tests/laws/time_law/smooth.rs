//! The least time along smooth paths.

use facemill_feedrate::*;
use facemill_inverse_kinematics::AxisValues;

use super::checks::worst_share;
use super::closed_form::rest_to_rest;
use super::spline_path::{SplinePath, joints, published_bounds};

/// Bound from acceleration limits only: no law of the benchmark is faster.
const FLOOR: f64 = 7.107;

fn law(path: &dyn JointPath, bounds: &MotionBounds, spans: usize) -> TimeLaw {
    minimum_time_law(path, bounds, &TimeLawSettings { spans, ..TimeLawSettings::default() }).unwrap()
}

/// A path by one closure of jets, in one piece from 0 to 1.
struct Curve<F>(F);

impl<const N: usize, F: Fn(Jet) -> [Jet; N]> JointPath for Curve<F> {
    fn breaks(&self) -> Vec<f64> {
        vec![0.0, 1.0]
    }
    fn at(&self, _: usize, u: f64) -> PathPoint {
        let q = self.0(Jet::parameter(u));
        PathPoint { axes: [0, 1, 2, 3].map(|d| AxisValues::from_fn(N, |k| q[k].0[d])), tip: None }
    }
}

/// Two axes on a wave with a loop, of size and shape by `k`.
fn wave(k: u32) -> Curve<impl Fn(Jet) -> [Jet; 2]> {
    let (turns, height) = (2.0 + f64::from(k % 5), 3.0 + f64::from(k % 3) * 20.0);
    Curve(move |u: Jet| {
        let x = u * 80.0 + (u * (3.0 * turns)).cos() * 5.0;
        [x, (u * u * turns + u * 2.0).sin() * height]
    })
}

fn two_axes() -> MotionBounds {
    let x = AxisBounds { velocity: 100.0, acceleration: 800.0, jerk: 9000.0 };
    MotionBounds::new(vec![x, AxisBounds { velocity: 60.0, acceleration: 500.0, jerk: 15000.0 }])
}

#[test]
fn the_published_benchmark_is_met_and_no_limit_violated() {
    let bounds = published_bounds();
    let law = minimum_time_law(&SplinePath, &bounds, &TimeLawSettings::default()).unwrap();
    let time = law.total_time();
    assert!(time > FLOOR && time <= 8.2, "{time}");
    // From the path's own formula without derivatives, and from the law's positions.
    let on_path = |t: f64| AxisValues::from(joints(law.parameter_at(t.clamp(0.0, time))));
    for k in 0..=1000 {
        let t = time * f64::from(k) / 1000.0;
        let (a, b) = (on_path(t), law.at(t).position);
        assert!(a.iter().zip(b.iter()).all(|(a, b)| (a - b).abs() < 1e-11), "{t}: {a:?} {b:?}");
    }
    // Steps of 4 ms: third differences of 60 mm and 3 rad, rounded, are exact to 1e-6 of their
    // limits.
    for offset in [0.0, 0.3, 0.7] {
        let shift = offset * time / 2000.0;
        let (limit, share, t) = worst_share(&bounds, time, 2000, |t| on_path(t + shift));
        assert!(share <= 1.0 + 2e-6, "{limit:?} {share} at {t}");
    }
    let dense = (0..=100_000).map(|k| law.at(time * f64::from(k) / 100_000.0));
    let most = dense.filter_map(|m| m.binding(&bounds)).map(|b| b.1).fold(0.0, f64::max);
    assert!(most <= 1.0 + 1e-9 && most > 0.999, "{most}");
}

#[test]
fn derivatives_in_time_are_those_of_the_positions() {
    let law = law(&SplinePath, &published_bounds(), 100);
    let h = 1e-5;
    for k in 1..500 {
        let t = law.total_time() * (f64::from(k) + 0.37) / 501.0;
        let (low, mid, high) = (law.at(t - h), law.at(t), law.at(t + h));
        for axis in 0..5 {
            let slopes = [
                ((high.position[axis] - low.position[axis]) / (2.0 * h), mid.velocity[axis]),
                ((high.velocity[axis] - low.velocity[axis]) / (2.0 * h), mid.acceleration[axis]),
            ];
            for (slope, value) in slopes {
                assert!((slope - value).abs() < 1e-4 * (1.0 + value.abs()), "{t} {axis}: {slope} {value}");
            }
        }
    }
}

#[test]
fn one_axis_from_rest_to_rest_takes_the_time_of_the_closed_form() {
    let bounds = AxisBounds { velocity: 100.0, acceleration: 500.0, jerk: 5000.0 };
    // No limit but jerk; jerk and acceleration; all of them; all for long.
    for distance in [0.01, 4.0, 12.0, 30.0, 60.0, 400.0] {
        let path = Curve(|u: Jet| [u * distance]);
        let least = rest_to_rest(distance, &bounds);
        let time = law(&path, &MotionBounds::new(vec![bounds]), 400).total_time();
        assert!(time >= least * (1.0 - 1e-9) && time <= least * 1.004, "{distance}: {time} {least}");
    }
}

#[test]
fn no_limit_is_exceeded_on_waves_and_times_stay_above_simple_bounds() {
    let bounds = two_axes();
    for k in 0..15 {
        let path = wave(k);
        let law = law(&path, &bounds, 150);
        let time = law.total_time();
        let (limit, share, t) = worst_share(&bounds, time, 3000, |t| law.at(t).position);
        assert!(share <= 1.0 + 1e-6, "{k}: {limit:?} {share} at {t}");
        // Each axis alone from its start to its end.
        let (start, end) = (law.at(0.0).position, law.at(time).position);
        for axis in 0..2 {
            let alone = rest_to_rest((end[axis] - start[axis]).abs(), &bounds.axes[axis]);
            assert!(time >= alone, "{k} {axis}: {time} {alone}");
        }
    }
}

#[test]
fn reversed_path_takes_the_same_time() {
    for k in 0..6 {
        let forward = law(&wave(k), &two_axes(), 150).total_time();
        let path = wave(k);
        let reversed = Curve(|u: Jet| (path.0)(Jet::constant(1.0) - u));
        let back = law(&reversed, &two_axes(), 150).total_time();
        assert!((forward - back).abs() < 1e-5 * forward, "{k}: {forward} {back}");
    }
}

#[test]
fn limits_of_another_unit_of_time_scale_the_time() {
    for (k, factor) in [(0, 2.0_f64), (1, 0.1), (2, 7.3)] {
        let mut bounds = two_axes();
        let time = law(&wave(k), &bounds, 100).total_time();
        for b in &mut bounds.axes {
            b.velocity *= factor;
            b.acceleration *= factor.powi(2);
            b.jerk *= factor.powi(3);
        }
        let scaled = law(&wave(k), &bounds, 100).total_time();
        assert!((scaled * factor - time).abs() < 1e-6 * time, "{factor}: {scaled} {time}");
    }
}

#[test]
fn a_looser_limit_never_takes_longer() {
    for k in 0..4 {
        let tight = law(&wave(k), &two_axes(), 100).total_time();
        for loosen in 0..6 {
            let mut bounds = two_axes();
            let b = &mut bounds.axes[loosen / 3];
            *[&mut b.velocity, &mut b.acceleration, &mut b.jerk][loosen % 3] *= 1.5;
            let loose = law(&wave(k), &bounds, 100).total_time();
            assert!(loose <= tight * (1.0 + 1e-4), "{k} {loosen}: {loose} {tight}");
        }
    }
}

#[test]
fn more_spans_come_nearer_to_the_least_time() {
    let times = [50, 100, 200, 400].map(|n| law(&SplinePath, &published_bounds(), n).total_time());
    assert!(times.windows(2).all(|t| t[1] < t[0]) && times[3] > FLOOR, "{times:?}");
}

#[test]
fn the_tip_feed_is_capped() {
    let mut bounds = published_bounds();
    bounds.tip_feed = Some(400.0);
    let law = law(&SplinePath, &bounds, 200);
    let n = 20_000;
    let tip = |k: u32| {
        let u = law.parameter_at(law.total_time() * f64::from(k) / f64::from(n));
        super::spline_path::tip(u)
    };
    let step = law.total_time() / f64::from(n);
    let feeds: Vec<f64> = (0..n).map(|k| (tip(k + 1) - tip(k)).norm() / step * 60.0).collect();
    let most = feeds.iter().copied().fold(0.0, f64::max);
    assert!(most <= 400.0 * (1.0 + 1e-6) && most > 399.0, "{most}");
    assert!(feeds.iter().filter(|&&f| f > 390.0).count() > 5000);
}

#[test]
fn a_path_with_more_waves_than_spans_is_kept_to() {
    let f = |u: f64| [100.0 * u, (150.0 * u).sin()];
    let path = Curve(|u: Jet| [u * 100.0, (u * 150.0).sin()]);
    let law = law(&path, &two_axes(), 10);
    for k in 0..=5000 {
        let t = law.total_time() * f64::from(k) / 5000.0;
        let (on_path, q) = (f(law.parameter_at(t)), law.at(t).position);
        assert!((on_path[0] - q[0]).abs() < 2e-6 && (on_path[1] - q[1]).abs() < 2e-6, "{t}");
    }
}

#[test]
fn pieces_end_in_turn_where_the_path_says() {
    let law = law(&SplinePath, &published_bounds(), 100);
    let ends = law.piece_ends();
    assert_eq!(ends.len(), 5);
    for (end, u) in ends.iter().zip([0.2, 0.4, 0.6, 0.8, 1.0]) {
        assert!((law.parameter_at(*end) - u).abs() < 1e-9, "{end} {u}");
    }
    assert_eq!(ends[4], law.total_time());
}
