//! Controls that keep to the lines: closed forms, and a slow planner of speeds at corners.

use facemill_feedrate::{AxisBounds, DeviationSettings, ProgramBlock, TrapezoidLaw, deviation_law};
use facemill_inverse_kinematics::AxisValues;
use facemill_test_kit::Random;

const FAST: f64 = 1e9;

fn axis(velocity: f64, acceleration: f64) -> AxisBounds {
    AxisBounds { velocity, acceleration, jerk: 1e9 }
}

fn block(end: AxisValues) -> ProgramBlock {
    ProgramBlock { end, tip_time: 0.0, exact_stop: false }
}

fn timed(ends: &[AxisValues], axes: &[AxisBounds], is_linear: &[bool], settings: DeviationSettings) -> TrapezoidLaw {
    let blocks: Vec<ProgramBlock> = ends.iter().map(|end| block(*end)).collect();
    deviation_law(&AxisValues::zeros(axes.len()), &blocks, (axes, is_linear), &settings).unwrap()
}

fn total(law: &TrapezoidLaw) -> f64 {
    law.times.iter().sum()
}

const WIDE: DeviationSettings = DeviationSettings { deviation: 0.01, small_segments: 0.0, look_ahead: 1000 };

/// A degree counts as a millimetre: a line of X and C in pieces takes the time of the whole.
#[test]
fn a_line_in_pieces_takes_the_time_of_the_whole() {
    let axes = [axis(50.0, 400.0), axis(2.0, 10.0)];
    let end = AxisValues::from([80.0, 1.5]);
    let whole = timed(&[end], &axes, &[true, false], WIDE);
    // By the weakest axis: shares of the way at its speed and acceleration.
    let (speed, acceleration) = ((50.0_f64 / 80.0).min(2.0 / 1.5), (400.0_f64 / 80.0).min(10.0 / 1.5));
    assert!((total(&whole) - (1.0 / speed + speed / acceleration)).abs() < 1e-12, "{whole:?}");
    let pieces: Vec<AxisValues> = (1..=40).map(|k| AxisValues::from_fn(2, |i| end[i] * f64::from(k) / 40.0)).collect();
    let law = timed(&pieces, &axes, &[true, false], WIDE);
    assert!((total(&law) - total(&whole)).abs() < 1e-9, "{} and {}", total(&law), total(&whole));
}

/// At a right angle the radius is δ·sin 45°/(1 − sin 45°), and both axes share the change.
#[test]
fn a_right_angle_is_taken_at_the_speed_of_its_arc() {
    let (a, length, deviation) = (500.0, 20.0, 0.02);
    let axes = [axis(FAST, a), axis(FAST, a)];
    let ends = [AxisValues::from([length, 0.0]), AxisValues::from([length, length])];
    let law = timed(&ends, &axes, &[true, true], DeviationSettings { deviation, ..WIDE });
    let half = 0.5_f64.sqrt();
    let square = a / half * deviation * half / (1.0 - half);
    let peak = (a * length + 0.5 * square).sqrt();
    let expected = (2.0 * peak - square.sqrt()) / a;
    assert!(law.times.iter().all(|t| (t - expected).abs() < 1e-9), "{law:?}, not {expected}");
    // The axes stand where they turn round, at exact stops, and at every corner without deviation.
    let stopped = 2.0 * 2.0 * (length / a).sqrt();
    let back = [AxisValues::from([length, 0.0]), AxisValues::from([0.0, 0.0])];
    assert!((total(&timed(&back, &axes, &[true, true], WIDE)) - stopped).abs() < 1e-9);
    let none = timed(&ends, &axes, &[true, true], DeviationSettings { deviation: 0.0, ..WIDE });
    assert!((total(&none) - stopped).abs() < 1e-9);
}

/// Corner speeds as published for the planner: by the cosine between the lines, then twice over the
/// whole program, and trapezoids between.
fn slow(
    ends: &[AxisValues],
    axes: &[AxisBounds],
    is_linear: &[bool],
    tip: &[f64],
    (deviation, small): (f64, f64),
) -> f64 {
    let unit = |k: usize| if is_linear[k] { 1.0 } else { 180.0 / std::f64::consts::PI };
    let n = axes.len();
    let mut at = vec![0.0; n];
    let mut lines = Vec::new();
    for (end, tip) in ends.iter().zip(tip) {
        let way: Vec<f64> = (0..n).map(|k| (end[k] - at[k]) * unit(k)).collect();
        let length = way.iter().map(|w| w * w).sum::<f64>().sqrt();
        let direction: Vec<f64> = way.iter().map(|w| w / length).collect();
        let least = |limit: &dyn Fn(usize) -> f64, of: &[f64]| {
            (0..n).map(|k| limit(k) / of[k].abs()).fold(f64::INFINITY, f64::min)
        };
        let speed = least(&|k| axes[k].velocity * unit(k), &direction).min(length / tip);
        lines.push((length, speed, least(&|k| axes[k].acceleration * unit(k), &direction), direction));
        at = end.iter().collect();
    }
    let mut square: Vec<f64> = vec![0.0];
    for pair in lines.windows(2) {
        let (u, v) = (&pair[0].3, &pair[1].3);
        let cos: f64 = -u.iter().zip(v).map(|(a, b)| a * b).sum::<f64>();
        let sin = (0.5 * (1.0 - cos)).sqrt();
        let norm = u.iter().zip(v).map(|(a, b)| (b - a) * (b - a)).sum::<f64>().sqrt();
        let most =
            (0..n).map(|k| axes[k].acceleration * unit(k) * norm / (v[k] - u[k]).abs()).fold(f64::INFINITY, f64::min);
        let mut by_corner = most * deviation * sin / (1.0 - sin);
        if pair[1].0 < small && cos < -(0.5_f64.sqrt()) {
            by_corner = by_corner.min(most.min(pair[1].2) * pair[1].0 / (-cos).acos().max(0.033));
        }
        square.push(by_corner.min(pair[0].1.powi(2)).min(pair[1].1.powi(2)));
    }
    square.push(0.0);
    for k in (0..lines.len()).rev() {
        square[k] = square[k].min(square[k + 1] + 2.0 * lines[k].2 * lines[k].0);
    }
    let mut time = 0.0;
    for (k, (length, speed, a, _)) in lines.iter().enumerate() {
        square[k + 1] = square[k + 1].min(square[k] + 2.0 * a * length);
        let peak = (a * length + 0.5 * (square[k] + square[k + 1])).sqrt().min(*speed);
        let ramps = (2.0 * peak * peak - square[k] - square[k + 1]) / (2.0 * a);
        time += (2.0 * peak - square[k].sqrt() - square[k + 1].sqrt()) / a + (length - ramps).max(0.0) / peak;
    }
    time
}

#[test]
fn programs_take_the_time_of_the_slow_planner() {
    let mut r = Random(631);
    let is_linear = [true, true, true, false, false];
    for round in 0..200 {
        let axes: Vec<AxisBounds> = (0..5)
            .map(|k| {
                if k < 3 {
                    axis(r.between(20.0, 200.0), r.between(100.0, 2000.0))
                } else {
                    axis(1.0, r.between(2.0, 20.0))
                }
            })
            .collect();
        let step = 10_f64.powf(r.between(-1.0, 1.0));
        let mut at = AxisValues::zeros(5);
        let ends: Vec<AxisValues> = (0..60)
            .map(|_| {
                let moved = |k: usize| if k < 3 { r.between(-step, step) } else { 0.02 * r.between(-step, step) };
                let steps: Vec<f64> = (0..5).map(moved).collect();
                at = AxisValues::from_fn(5, |k| at[k] + steps[k]);
                at
            })
            .collect();
        let tip: Vec<f64> = ends.iter().map(|_| step / r.between(5.0, 300.0)).collect();
        let deviation = 10_f64.powf(r.between(-3.0, -1.0));
        let blocks: Vec<ProgramBlock> =
            ends.iter().zip(&tip).map(|(end, tip)| ProgramBlock { tip_time: *tip, ..block(*end) }).collect();
        let run_small = |deviation, small_segments, look_ahead| {
            let settings = DeviationSettings { deviation, small_segments, look_ahead };
            total(&deviation_law(&AxisValues::zeros(5), &blocks, (&axes, &is_linear), &settings).unwrap())
        };
        let run = |deviation, look_ahead| run_small(deviation, 0.0, look_ahead);
        // One pass over all that is in sight is the same as the passes from every block.
        assert!(run(deviation, 60) == run(deviation, 59), "round {round}");
        let (law, expected) = (run(deviation, 1000), slow(&ends, &axes, &is_linear, &tip, (deviation, 0.0)));
        assert!((law - expected).abs() < 1e-9 * expected, "round {round}: {law} and {expected}");
        // More room in a corner, or more sight, is never slower.
        assert!(run(2.0 * deviation, 1000) <= law * (1.0 + 1e-12), "round {round}");
        assert!(run(deviation, 3) >= law * (1.0 - 1e-12), "round {round}");
        assert!(run(deviation, 3) <= run(0.0, 1000) * (1.0 + 1e-12), "round {round}");
    }
}

/// Curves in short steps, whose corners are flat: Marlin's bound is the one that counts there.
#[test]
fn short_segments_at_flat_corners_are_slowed_as_on_an_arc() {
    let mut r = Random(733);
    let is_linear = [true, true, false];
    let mut slowed = 0;
    for round in 0..100 {
        let axes = [axis(300.0, r.between(100.0, 2000.0)), axis(300.0, r.between(100.0, 2000.0)), axis(9.0, 40.0)];
        let (step, turn) = (r.between(0.05, 2.0), r.between(0.001, 1.0));
        let (mut at, mut heading) = (AxisValues::zeros(3), 0.0_f64);
        let ends: Vec<AxisValues> = (0..50)
            .map(|_| {
                heading += turn * r.between(0.5, 1.0);
                let steps = [step * heading.cos(), step * heading.sin(), 0.002 * r.between(-step, step)];
                at = AxisValues::from_fn(3, |k| at[k] + steps[k]);
                at
            })
            .collect();
        let tip = vec![step / 200.0; ends.len()];
        let blocks: Vec<ProgramBlock> =
            ends.iter().zip(&tip).map(|(end, tip)| ProgramBlock { tip_time: *tip, ..block(*end) }).collect();
        let run = |small_segments| {
            let settings = DeviationSettings { deviation: 0.05, small_segments, look_ahead: 1000 };
            total(&deviation_law(&AxisValues::zeros(3), &blocks, (&axes, &is_linear), &settings).unwrap())
        };
        let (law, expected) = (run(1.0), slow(&ends, &axes, &is_linear, &tip, (0.05, 1.0)));
        assert!((law - expected).abs() < 1e-9 * expected, "round {round}: {law} and {expected}");
        assert!(law >= run(0.0) * (1.0 - 1e-12), "round {round}");
        slowed += usize::from(law > 1.05 * run(0.0));
    }
    assert!(slowed > 10, "{slowed} rounds");
    // A straight line in pieces of 0.1 mm: v² is at most a·0.1/0.033.
    let axes = [axis(1e6, 500.0)];
    let ends: Vec<AxisValues> = (1..=2000).map(|k| AxisValues::from([0.1 * f64::from(k)])).collect();
    let law = timed(&ends, &axes, &[true], DeviationSettings { small_segments: 1.0, look_ahead: 5000, ..WIDE });
    let most = (500.0_f64 * 0.1 / 0.033).sqrt();
    // The speed grows a little within each piece, up to the square of most and a half piece.
    let (slowest, fastest) = (0.1 / most, 0.1 / (most * most + 500.0 * 0.1).sqrt());
    let middle = &law.times[900..1100];
    assert!(middle.iter().all(|t| (fastest..slowest * (1.0 + 1e-9)).contains(t)), "{middle:?}");
}
