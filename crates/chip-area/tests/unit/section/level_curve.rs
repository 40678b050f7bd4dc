use crate::section::level_curve::*;

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-12 * (1.0 + b.abs())
}

#[test]
fn branches_are_on_the_circle() {
    let normal = Vector2::new(0.6, 0.8);
    for k in [0.05, -0.05, 1e-9, -1e-9, 0.0] {
        let curve = LevelCurve::offset_of_surface(k, normal, 2.0);
        for x in [-3.0, 0.0, 1.5] {
            let y = curve.y_at(x, Branch::Near);
            assert!(curve.value(&Point2::new(x, y)).abs() < 1e-14, "{k} {x} {y}");
            if k.abs() > 1e-3 {
                let y = curve.y_at(x, Branch::Far);
                assert!(curve.value(&Point2::new(x, y)).abs() < 1e-12, "{k} {x} {y}");
            }
        }
    }
}

#[test]
fn an_offset_surface_keeps_its_centre() {
    for k in [0.05, -0.05] {
        let curve = LevelCurve::offset_of_surface(k, Vector2::new(0.6, 0.8), 2.0);
        let radius = (1.0 / k + 2.0).abs();
        assert!(close(curve.curvature().abs(), 1.0 / radius));
        let [left, right] = curve.extremes().map(Option::unwrap);
        assert!(close((right - left).abs(), 2.0 * radius));
        assert!(close(0.5 * (left + right), -0.6 / k));
    }
}

#[test]
fn crossings_lie_on_both_curves() {
    let a = LevelCurve::circle(Point2::new(1.0, 2.0), 5.0);
    let b = LevelCurve::circle(Point2::new(4.0, -1.0), 3.5);
    // Circles of radius 5 and 3.5 about points √18 apart.
    let (d, s) = (18f64.sqrt(), (25.0 - 12.25 + 18.0) / (2.0 * 18f64.sqrt()));
    let h = (25.0 - s * s).sqrt();
    let expected = [1.0 + (3.0 * s - 3.0 * h) / d, 1.0 + (3.0 * s + 3.0 * h) / d];
    let mut found = a.crossings(&b).map(|p| p.unwrap().x);
    found.sort_by(f64::total_cmp);
    assert!(close(found[0], expected[0]) && close(found[1], expected[1]), "{found:?} {expected:?}");

    let line = LevelCurve::horizontal(2.0);
    for found in [a.crossings(&line), line.crossings(&a)] {
        let mut found = found.map(|p| p.unwrap().x);
        found.sort_by(f64::total_cmp);
        assert!(close(found[0], -4.0) && close(found[1], 6.0));
    }
    assert_eq!(a.crossings(&LevelCurve::circle(Point2::new(1.0, 2.0), 3.0)), [None; 2]);
    assert_eq!(a.crossings(&LevelCurve::circle(Point2::new(10.0, 2.0), 3.0)), [None; 2]);
    let slanted = LevelCurve::offset_of_surface(0.0, Vector2::new(0.6, 0.8), 0.0);
    assert!(slanted.crossings(&line).iter().flatten().any(|p| close(p.x, -8.0 / 3.0) && close(p.y, 2.0)));
    assert_eq!(line.crossings(&LevelCurve::horizontal(3.0)), [None; 2]);
}

#[test]
fn segment_area_is_smooth_where_the_series_ends() {
    for angle in [0.01, 0.0999, 0.1001, 1.0, 3.0f64] {
        let chord = 2.0 * (0.5 * angle).sin();
        // Midpoint rule over the segment's height, an independent way.
        let n = 200_000;
        let sum: f64 = (0..n)
            .map(|i| {
                let x = chord * ((f64::from(i) + 0.5) / f64::from(n) - 0.5);
                ((1.0 - x * x).sqrt() - (0.5 * angle).cos()) * chord / f64::from(n)
            })
            .sum();
        assert!((segment_area(1.0, chord) - sum).abs() < 1e-8 * sum, "{angle}");
        assert!((segment_area(0.25, 4.0 * chord) - 16.0 * sum).abs() < 1e-8 * 16.0 * sum);
    }
}
