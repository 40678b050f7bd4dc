use crate::links::clock::*;

/// Returns the way of an axis that always changes its acceleration by the jerk, or keeps the
/// largest one or the largest speed: integrated step by step to the middle of its time, and
/// doubled.
fn way_in(time: f64, velocity: f64, acceleration: f64, jerk: f64) -> f64 {
    let n = 40_000;
    let (step, ramp) = (0.5 * time / f64::from(n), (acceleration / jerk).min((velocity / jerk).sqrt()));
    // Gains speed for `ramp`, holds, and stops gaining in `ramp`, so that it is at its largest
    // speed in the middle at the latest.
    let hold = (velocity / (jerk * ramp) - ramp).min(0.5 * time - 2.0 * ramp).max(0.0);
    let ramp = ramp.min(0.25 * time);
    let (mut v, mut way) = (0.0, 0.0);
    for k in 0..n {
        let t = (f64::from(k) + 0.5) * step;
        let a = (jerk * t).min(jerk * ramp).min((jerk * (2.0 * ramp + hold - t)).max(0.0));
        way += (v + 0.5 * a * step) * step;
        v += a * step;
    }
    2.0 * way
}

#[test]
fn an_axis_by_itself_takes_as_long_as_its_way_integrated() {
    for (velocity, acceleration, jerk) in [(500.0, 2000.0, 40_000.0), (100.0, 500.0, 1000.0), (0.8, 0.5, 1.5)] {
        let mut before = 0.0;
        for way in [1e-3, 0.1, 1.0, 5.0, 30.0, 200.0, 3000.0] {
            let time = rest_to_rest(way, velocity, acceleration, jerk);
            let gone = way_in(time, velocity, acceleration, jerk);
            assert!((gone - way).abs() < 1e-3 * way, "{way} in {time}: {gone}");
            assert!(time > before && time > way / velocity);
            before = time;
        }
    }
    assert_eq!(rest_to_rest(0.0, 1.0, 1.0, 1.0), 0.0);
}
