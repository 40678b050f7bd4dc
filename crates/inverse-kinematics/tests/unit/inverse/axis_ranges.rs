use crate::inverse::axis_ranges::*;

#[test]
fn angles_at_both_axes_stay_within_their_halves_where_the_first_turns_back_too() {
    let mut turned_back = 0;
    for (between, spindle) in [(0.5, 0.9), (1.2, 0.4), (1.3, 0.9), (2.0, 0.7), (0.7, 0.7), (1.5, 1.6)] {
        let sides = Sides { between, spindle };
        let (nearest, farthest) = sides.reach();
        for k in 1..60 {
            let to_first = nearest + (farthest - nearest) * f64::from(k) / 60.0;
            let turn = 0.9 * (to_first - nearest).min(farthest - to_first);
            let [first, second] = sides.halves(to_first, turn);
            let at = sides.angles(to_first);
            let mut seen = [0.0f64; 2];
            for j in 0..=200 {
                let a = sides.angles(to_first + turn * (f64::from(j) / 100.0 - 1.0));
                seen = [seen[0].max((a[0] - at[0]).abs()), seen[1].max((a[1] - at[1]).abs())];
            }
            assert!(seen[0] <= first + 1e-12 && seen[1] <= second + 1e-12, "{sides:?} {to_first} {seen:?}");
            assert!(seen[0] > 0.99 * first - 1e-9 && seen[1] > 0.99 * second - 1e-9, "no larger than need be");
            turned_back += usize::from(sides.turning_point().is_some_and(|a| (a - to_first).abs() < turn));
        }
    }
    assert!(turned_back > 10, "{turned_back}");
}
