//! Laws of spirals.

use super::*;

fn spiral(sections: Strategy) -> Strategy {
    Strategy::Spiral(Spiral { levels: SpiralLevels::Sections(sections.sections().unwrap()) })
}

/// A tube about the z axis from z = 0 to `height`, its normal outward.
fn tube(radius: impl Fn(f64) -> f64, height: f64, around: u32, rows: u32) -> TriMesh {
    // Around against the turn about z, so that the normal points outward.
    let (vertices, triangles) = facemill_test_kit::grid_around([rows, around], |j, k| {
        let z = height * f64::from(j) / f64::from(rows);
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(around)).sin_cos();
        Point3::new(radius(z) * cos, -radius(z) * sin, z)
    });
    TriMesh::new(vertices, triangles).unwrap()
}

/// Angle about the z axis along a pass, without jumps, in turns.
fn turns(pass: &LaidPass) -> Vec<f64> {
    let angle = |cc: &CcPoint| cc.position.y.atan2(cc.position.x) / std::f64::consts::TAU;
    let mut sum = angle(&pass.pass.points[0]);
    let steps = pass.pass.points.windows(2).map(|w| {
        let step = angle(&w[1]) - angle(&w[0]);
        sum += step - step.round();
        sum
    });
    std::iter::once(angle(&pass.pass.points[0])).chain(steps).collect()
}

#[test]
fn on_a_cylinder_a_spiral_is_the_helix() {
    let (radius, height, step) = (30.0, 40.0, 3.0);
    let s = surface(tube(|_| radius, height, 90, 33));
    for direction in [Direction::Forward, Direction::Reverse] {
        for order in [LevelOrder::Increasing, LevelOrder::Decreasing] {
            let settings = LaySettings { max_step_over: step, direction, order, ..LaySettings::default() };
            let laid = lay(&s, &spiral(planes(Vector3::z_axis())), &settings);
            let [pass] = laid.passes.as_slice() else { panic!("{} passes", laid.passes.len()) };
            let n = (height / step).ceil();
            assert_eq!((laid.n_levels as f64, laid.n_wide_strips, pass.closed), (n + 2.0, 0, false));
            let uncut = LaySettings { direction, order, ..LaySettings::default() };
            assert_eq!(pass.uncut, direction.uncut_side(uncut.order));
            let turns = turns(pass);
            let sense = (turns[turns.len() - 1] - turns[0]).signum();
            // Seen from outside, higher levels are to the left of a forward feed: it runs to the
            // right hand's fingers.
            assert_eq!(sense > 0.0, direction == Direction::Forward);
            let whole = sense * (turns[turns.len() - 1] - turns[0]);
            assert!((whole - (n + 2.0)).abs() < 1e-6, "{whole} turns");
            for (cc, turn) in pass.pass.points.iter().zip(&turns) {
                let turn = (sense * (turn - turns[0]) - 1.0).clamp(0.0, n);
                let z = match order {
                    LevelOrder::Increasing => height / n * turn,
                    LevelOrder::Decreasing => height - height / n * turn,
                };
                // The facets are flat: the angle of their chords is not even to 2e-4 of a turn.
                assert!((cc.position.z - z).abs() < 2e-3, "{} at {turn}: {z}", cc.position.z);
            }
            let rise = height / n / (std::f64::consts::TAU * radius);
            let up = if order == LevelOrder::Increasing { 1.0 } else { -1.0 };
            let middle = &pass.pass.points[pass.pass.points.len() / 2];
            assert!((middle.feed.z * up - rise).abs() < 2e-3, "{} {rise}", middle.feed.z);
            check_continuous(&laid, &settings);
        }
    }
}

fn check_continuous(laid: &PassLayout, settings: &LaySettings) {
    for (_, [a, b]) in gaps(laid) {
        assert!((b.position - a.position).norm() <= settings.max_step * (1.0 + 1e-6));
        let way = b.position - a.position;
        assert!(a.feed.dot(&b.feed) > 0.5 && way.dot(&a.feed) > 0.0, "{a:?} {b:?}");
    }
}

#[test]
fn on_a_sphere_cap_a_spiral_winds_around_the_pole() {
    let (radius, half_angle, step) = (50.0, 0.9, 2.0);
    let s = surface(sphere_cap(radius, half_angle, 40, 90));
    let settings = LaySettings { max_step_over: step, ..LaySettings::default() };
    let laid = lay(&s, &spiral(rings(Point3::origin(), 0.0, 1e3)), &settings);
    assert_eq!(laid.passes.len(), 1);
    check_continuous(&laid, &settings);
    for (_, cc) in points(&laid) {
        assert!(s.closest_point(&cc.position, 1e-9).is_some());
    }
    // Arc from the pole, at each passage of one meridian.
    let (pass, turns) = (&laid.passes[0], turns(&laid.passes[0]));
    let arc = |cc: &CcPoint| radius * (cc.position.x.hypot(cc.position.y)).atan2(cc.position.z);
    let mut crossings = Vec::new();
    for (w, t) in pass.pass.points.windows(2).zip(turns.windows(2)) {
        let goal = if t[1] > t[0] { t[0].floor() + 1.0 } else { t[1].floor() + 1.0 };
        if (t[0] < goal) != (t[1] < goal) {
            let share = (goal - t[0]) / (t[1] - t[0]);
            crossings.push(arc(&w[0]) + share * (arc(&w[1]) - arc(&w[0])));
        }
    }
    let steps: Vec<f64> = crossings.windows(2).map(|w| w[1] - w[0]).collect();
    println!("cap {steps:?}");
    assert!(steps.iter().all(|s| *s <= 1.01 * step), "{steps:?}");
    let n = radius * half_angle / step;
    assert!((laid.n_levels as f64) < 1.05 * n + 4.0, "{} for {n}", laid.n_levels);
    let mut rng = Random(3);
    for _ in 0..1500 {
        let t = (rng.unit() * s.mesh().triangles().len() as f64) as u32;
        let p = s.point(t, [0.2, 0.5, 0.3]).position;
        let d = distance_to_passes(&p, &laid);
        assert!(d < 0.5 * step * 1.03, "{p}: {d}");
    }
}

#[test]
fn a_spiral_flows_between_two_borders_that_are_no_levels() {
    // A vase with a slanted rim: planes would be open there.
    let mesh = tube(|z| 25.0 + 4.0 * (z / 8.0).sin(), 40.0, 80, 40);
    let slant = |p: &Point3<f64>| Point3::new(p.x, p.y, p.z * (1.0 + 0.3 * p.x / 25.0));
    let slanted = TriMesh::new(mesh.vertices().iter().map(slant).collect(), mesh.triangles().to_vec()).unwrap();
    let rim: Vec<Point3<f64>> = (0..=80).map(|k| slanted.vertices()[40 * 80 + k % 80]).collect();
    let s = surface(slanted);
    let from = FlowEnd::Plane { origin: Point3::origin(), normal: Vector3::z_axis() };
    let flow = Flow { from, to: FlowEnd::Curve(rim), within: 1e-3 };
    let strategy = Strategy::Spiral(Spiral { levels: SpiralLevels::Flow(flow) });
    let settings =
        LaySettings { max_step_over: 2.5, closed_start: Some(Point3::new(0.0, 25.0, 0.0)), ..LaySettings::default() };
    let laid = lay(&s, &strategy, &settings);
    assert_eq!(laid.passes.len(), 1);
    check_continuous(&laid, &settings);
    assert!(laid.passes[0].pass.points[0].position.x.abs() < 2.0);
    let mut rng = Random(3);
    for _ in 0..1500 {
        let t = (rng.unit() * s.mesh().triangles().len() as f64) as u32;
        let p = s.point(t, [0.2, 0.5, 0.3]).position;
        let d = distance_to_passes(&p, &laid);
        assert!(d < 0.5 * 2.5 * 1.03, "{p}: {d}");
    }
    // Planes do not close.
    let e = lay_passes(&s, &Region::default(), &spiral(planes(Vector3::z_axis())), &settings, &|_| 2.5, &Silent);
    let e = e.unwrap_err();
    assert!(matches!(e, PathError::NoSpiral { fault: "is open", .. }), "{e}");
}

#[test]
fn the_levels_of_a_spiral_bound_the_region_that_it_finishes() {
    let s = surface(plane(40.0, 40.0, 20, 20));
    let region = Region::default();
    let of_rings = rings(Point3::new(20.0, 20.0, 0.0), 4.0, 10.0);
    let samples = |strategy: &Strategy| {
        let requested = RequestedStrategy { strategy, corner_radius: 1.0 };
        RequestedRegion::new(&s, &region, Some(requested)).unwrap().samples(0.25)
    };
    let of_spiral = samples(&spiral(of_rings.clone()));
    assert_eq!(of_spiral, samples(&of_rings));
    let area: f64 = of_spiral.iter().map(|sample| sample.area).sum();
    let of_ring = std::f64::consts::PI * (10.0 * 10.0 - 4.0 * 4.0);
    assert!((area / of_ring - 1.0).abs() < 0.02, "{area} of {of_ring}");
}

#[test]
fn regions_without_closed_levels_are_named() {
    let error = |s: &Surface, strategy: &Strategy| {
        let e = lay_passes(s, &Region::default(), strategy, &LaySettings::default(), &|_| 2.0, &Silent);
        e.unwrap_err().to_string()
    };
    let flat = surface(plane(40.0, 30.0, 8, 6));
    let e = error(&flat, &spiral(planes(Vector3::y_axis())));
    assert!(e.contains("is open at") && e.contains("bound the levels or the region"), "{e}");
    // Facets reach beyond the last level, which is the one that is named.
    let e = error(&flat, &spiral(rings(Point3::new(20.0, 15.0, 0.0), 5.0, 18.3)));
    assert!(e.contains("level 18.300000 is open at"), "{e}");
    // Two tubes side by side.
    let one = tube(|_| 10.0, 20.0, 24, 8);
    let two = surface(one.clone().joined(&one.transformed(&Isometry3::translation(30.0, 0.0, 0.0))));
    let e = error(&two, &spiral(planes(Vector3::z_axis())));
    assert!(e.contains("has more than one closed curve"), "{e}");
    // A hole in the wall.
    let triangles = one.triangles().iter().enumerate().filter(|(t, _)| !(150..160).contains(t)).map(|(_, t)| *t);
    let holed = surface(TriMesh::new(one.vertices().to_vec(), triangles.collect()).unwrap());
    let e = error(&holed, &spiral(planes(Vector3::z_axis())));
    assert!(e.contains("is open"), "{e}");
}

/// A ring about the z axis whose rows of vertices lie at some radii, at a height for each.
fn rows_around(radii: &[f64], around: u32, height: impl Fn(f64) -> f64) -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::grid_around([radii.len() as u32 - 1, around], |j, k| {
        let radius = radii[j as usize];
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(around)).sin_cos();
        Point3::new(radius * cos, radius * sin, height(radius))
    });
    TriMesh::new(vertices, triangles).unwrap()
}

#[test]
fn a_spiral_whose_range_ends_on_rows_of_vertices_winds_from_end_to_end() {
    let mut rng = Random(19);
    let shapes = ["flat", "dome", "cone by planes", "tube by planes"];
    for trial in 0..20 {
        let shape = shapes[trial % 4];
        let (rows, around) = if trial < 4 { (28, 240) } else { (5 + rng.below(26) as u32, 20 + rng.below(180) as u32) };
        let (low, high) = if trial < 4 { (10.0, 38.0) } else { (rng.between(5.0, 15.0), rng.between(30.0, 45.0)) };
        let at: Vec<f64> = (0..=rows).map(|j| low + (high - low) * f64::from(j) / f64::from(rows)).collect();
        let height = |r: f64| match shape {
            "dome" => (6400.0 - r * r).sqrt() - 80.0,
            "cone by planes" => -0.7 * r,
            _ => 0.0,
        };
        let mesh = match shape {
            "tube by planes" => tube(|_| 20.0, high, around, rows),
            _ => rows_around(&at, around, height),
        };
        // Levels of the rows as the sections compute them, the borders among them.
        let level = |k: usize| match shape {
            "tube by planes" => mesh.vertices()[k * around as usize].z,
            "cone by planes" => -mesh.vertices()[k * around as usize].z,
            _ => at[k],
        };
        let (first, last) = if trial < 4 { (1, 27) } else { (rng.below(3), rows as usize - rng.below(3)) };
        let (from, to) = (level(first), level(last));
        let by_planes = |normal: Unit<Vector3<f64>>| {
            let (from, to) = (Some(from), Some(to));
            Strategy::ParallelPlanes(ParallelPlanes { origin: Point3::origin(), normal, from, to })
        };
        let strategy = match shape {
            "tube by planes" => by_planes(Vector3::z_axis()),
            "cone by planes" => by_planes(-Vector3::z_axis()),
            _ => rings(Point3::origin(), from, to),
        };
        let level_of = |cc: &CcPoint| strategy.sections().unwrap().level(&cc.position);
        let s = surface(mesh.clone());
        let n_rows_between = (last - first) as f64;
        let max_step_over = (to - from) / n_rows_between * rng.between(0.7, 2.5);
        for (order, direction) in [
            (LevelOrder::Increasing, Direction::Forward),
            (LevelOrder::Increasing, Direction::Reverse),
            (LevelOrder::Decreasing, Direction::Forward),
            (LevelOrder::Decreasing, Direction::Reverse),
        ] {
            let settings = LaySettings { max_step_over, order, direction, max_step: 2.0, ..LaySettings::default() };
            let name = format!("{trial} {shape} {rows} {around} {from} {to} {max_step_over} {order:?} {direction:?}");
            let laid = lay_passes(&s, &Region::default(), &spiral(strategy.clone()), &settings, &|_| 1e3, &Silent);
            let laid = laid.unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(laid.passes.len(), 1, "{name}");
            check_continuous(&laid, &settings);
            for (_, cc) in points(&laid) {
                assert!(s.closest_point(&cc.position, 1e-9).is_some(), "{name}");
            }
            let (pass, turns) = (&laid.passes[0], turns(&laid.passes[0]));
            let whole = (turns[turns.len() - 1] - turns[0]).abs();
            assert!((whole - laid.n_levels as f64).abs() < 0.03, "{name}: {whole} turns of {}", laid.n_levels);
            // Each end of the range has a whole turn; on the outer border, inside its chords.
            let of_border = last == rows as usize && !shape.contains("planes");
            let sagitta = to * (1.0 - (std::f64::consts::PI / f64::from(around)).cos());
            let off = 0.02 + if of_border { sagitta } else { 0.0 };
            let (begin, end) = if order == LevelOrder::Increasing { (from, to) } else { (to, from) };
            for (cc, turn) in pass.pass.points.iter().zip(&turns) {
                let (after, before) = ((turn - turns[0]).abs(), (turn - turns[turns.len() - 1]).abs());
                for (way, level) in [(after, begin), (before, end)] {
                    assert!(way > 0.999 || (level_of(cc) - level).abs() < off, "{name}: {} at {way}", cc.position);
                }
            }
        }
    }
}
