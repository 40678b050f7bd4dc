use super::*;

/// Checks that it is within its limits at all times, continuous, and ends at the end; each limit
/// reached or not needed.
#[test]
fn phases_join_and_hold_their_limits() {
    for k in 0..600_u32 {
        let of = |n: u32, m: u32| 10.0_f64.powf(f64::from((k * n) % m) / f64::from(m) * 4.0 - 2.0);
        let (length, v, a, j) = (of(7, 31), of(5, 29), of(11, 37), of(13, 41));
        let curve = SCurve::new(length, [v, a, j]);
        let n = 2000;
        let h = curve.duration() / f64::from(n);
        let mut before = curve.at(0.0);
        assert_eq!(before[..3], [0.0; 3]);
        for i in 1..=n {
            let now = curve.at(h * f64::from(i));
            assert!(now[1] <= v * (1.0 + 1e-9) && now[2].abs() <= a * (1.0 + 1e-9) && now[3].abs() <= j);
            for d in 0..3 {
                // A step's change lies within what the limits of the next derivative allow.
                let most = [v, a, j][d] * h;
                assert!((now[d] - before[d]).abs() <= most * (1.0 + 1e-6) + 1e-12, "{k} {i} {d}");
            }
            before = now;
        }
        assert!((before[0] - length).abs() < 1e-12 * length && before[1].abs() < 1e-9 * v, "{k} {before:?}");
    }
}
