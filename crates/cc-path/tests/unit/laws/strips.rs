//! Laws between neighbouring levels.

use super::*;

#[test]
fn strips_are_never_wider_than_allowed_on_the_facets_of_a_cylinder() {
    let (radius, n) = (50.0, 60);
    let s = surface(cylinder(radius, 30.0, 1.3, 4, n));
    let at = |k: u32| 1.3 * (2.0 * f64::from(k) / f64::from(n) - 1.0);
    // Way along the facets from the first edge to the level y.
    let way = |y: f64| {
        let mut sum = 0.0;
        for k in 0..n {
            let [p, q] = [at(k), at(k + 1)].map(|a| (radius * a.sin(), radius * a.cos()));
            let part = ((y - p.0) / (q.0 - p.0)).clamp(0.0, 1.0);
            sum += part * (q.0 - p.0).hypot(q.1 - p.1);
        }
        sum
    };
    for even in [false, true] {
        let settings = LaySettings { max_step_over: 3.0, even, ..LaySettings::default() };
        let laid = lay(&s, &planes(Vector3::y_axis()), &settings);
        let strips: Vec<f64> = laid.passes.windows(2).map(|w| way(w[1].level) - way(w[0].level)).collect();
        assert!(strips.iter().all(|w| *w <= 3.0 + 1e-9), "{strips:?}");
        // Steeper facets in reach make a step shorter, by their curvature over one strip at most.
        assert!(strips.iter().rev().skip(1).all(|w| *w > 2.0), "{strips:?}");
        let widest = strips.iter().copied().fold(0.0, f64::max);
        assert!(laid.largest_step_over <= 3.0 + 1e-9 && laid.largest_step_over > widest - 1e-9);
        assert_eq!(laid.n_wide_strips, 0);
    }
}

#[test]
fn strips_follow_the_width_that_the_caller_allows() {
    let s = surface(plane(60.0, 100.0, 1, 1));
    let allowed = |y: f64| 0.5 + 0.05 * y;
    let width = |cc: &CcPoint| allowed(cc.position.y);
    for order in [LevelOrder::Increasing, LevelOrder::Decreasing] {
        let settings = LaySettings { max_step_over: 4.0, even: false, order, ..LaySettings::default() };
        let strategy = planes(Vector3::y_axis());
        let laid = lay_passes(&s, &Region::default(), &strategy, &settings, &width, &Silent).unwrap();
        let mut levels: Vec<f64> = laid.passes.iter().map(|p| p.level).collect();
        assert_eq!(order == LevelOrder::Increasing, levels[0] < levels[1]);
        levels.sort_by(f64::total_cmp);
        for w in levels.windows(2) {
            assert!(w[1] - w[0] <= allowed(w[0]).min(4.0) + 1e-9, "{w:?}");
            // Not narrower than the width one piece of the region (4 mm) away.
            assert!(w[1] - w[0] >= allowed(w[0] - 5.0).min(2.0) || w[0] < 5.0 || w[1] > 99.0, "{w:?}");
        }
    }
    let never = |_: &CcPoint| f64::NAN;
    let strategy = planes(Vector3::y_axis());
    let e = lay_passes(&s, &Region::default(), &strategy, &LaySettings::default(), &never, &Silent).unwrap_err();
    assert!(matches!(e, PathError::StripWidth { .. }), "{e}");
}

#[test]
fn widths_below_the_smallest_step_over_are_counted() {
    let s = surface(plane(60.0, 100.0, 6, 10));
    let width = |cc: &CcPoint| if cc.position.y > 79.0 && cc.position.y < 81.0 { 0.01 } else { 5.0 };
    let settings = LaySettings { max_step_over: 5.0, min_step_over: 1.0, even: false, ..LaySettings::default() };
    let laid = lay_passes(&s, &Region::default(), &planes(Vector3::y_axis()), &settings, &width, &Silent).unwrap();
    assert!(laid.passes.windows(2).rev().skip(1).all(|w| w[1].level - w[0].level >= 1.0 - 1e-9));
    assert!(laid.n_wide_strips >= 1 && laid.n_wide_strips <= 12, "{}", laid.n_wide_strips);
}

#[test]
fn every_place_of_the_region_is_within_a_step_over_of_a_pass() {
    let cone = NormalCone { axis: Vector3::z_axis(), half_angle: 0.5 };
    let bounds = Aabb { min: Point3::new(11.0, 7.0, -4.0), max: Point3::new(83.0, 66.0, 20.0) };
    let region = Region { normal_cone: Some(cone), bounds: Some(bounds), ..Region::default() };
    let s = surface(waves(40));
    let settings = LaySettings { max_step_over: 3.0, ..LaySettings::default() };
    for strategy in [planes(oblique()), rings(Point3::new(-10.0, 20.0, 0.0), 0.0, 1e4)] {
        let laid = lay_on(&s, &region, &strategy, &settings);
        assert_eq!(laid.n_wide_strips, 0);
        let mut rng = Random(5);
        let mut n_tried = 0;
        while n_tried < 1500 {
            let t = (rng.unit() * 3200.0) as u32;
            let (u, v) = (rng.unit(), rng.unit());
            let p = s.point(t, [1.0 - u, u * (1.0 - v), u * v]).position;
            if bounds.contains(&p) && cone.contains(&s.facet_normal(t).unwrap()) {
                n_tried += 1;
                let d = distance_to_passes(&p, &laid);
                assert!(d <= 3.0 + settings.chord_tolerance, "{p} is {d} mm from the nearest pass");
            }
        }
        for (_, cc) in points(&laid) {
            assert!(bounds.dilated(1e-9).contains(&cc.position));
        }
    }
}
