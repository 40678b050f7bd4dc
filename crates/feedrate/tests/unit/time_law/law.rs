use super::*;

/// The closed forms against Simpson's rule on ds/√ρ, for upward, downward and no curvature.
#[test]
fn duration_and_position_are_those_of_the_integral() {
    for k in 0..200_u32 {
        let pace = SquaredSpeed([0.2 + f64::from(k % 7), 0.1 + f64::from(k % 11) * 0.7, 0.3 + f64::from(k % 5)]);
        let n = 2000;
        let f = |i: u32| pace.at(f64::from(i) / f64::from(n))[0].sqrt().recip();
        let sum: f64 = (0..n / 2).map(|i| f(2 * i) + 4.0 * f(2 * i + 1) + f(2 * i + 2)).sum();
        let time = sum / (3.0 * f64::from(n));
        assert!((pace.duration() - time).abs() < 1e-8 * time, "{pace:?} {} {time}", pace.duration());
        for s in [0.1, 0.5, 0.93, 1.0] {
            let back = pace.position(pace.time_to(s));
            assert!((back - s).abs() < 1e-12, "{pace:?} {s} {back}");
        }
    }
}
