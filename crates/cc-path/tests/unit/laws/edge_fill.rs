//! Laws of passes that fill edges.

use super::*;

/// Settings with edge fill for strips up to 8 mm.
fn filled() -> LaySettings {
    LaySettings { max_step_over: 8.0, edge_fill: true, pass_cost: 20.0, min_pass_length: 5.0, ..LaySettings::default() }
}

fn length(layout: &PassLayout) -> f64 {
    layout.passes.iter().map(|p| p.length).sum()
}

fn lay_by(
    s: &Surface,
    strategy: &Strategy,
    settings: &LaySettings,
    width: &(dyn Fn(&CcPoint) -> f64 + Sync),
) -> PassLayout {
    lay_passes(s, &Region::default(), strategy, settings, width, &Silent).unwrap()
}

/// A parallelogram of 200 × 120 mm in the plane, its sides leaning by `lean` mm per mm.
fn skewed(lean: f64) -> TriMesh {
    grid(40, 24, |u, v| Point3::new(200.0 * u + lean * 120.0 * v, 120.0 * v, 0.0))
}

/// Largest ratio of the distance from a place of the plane to the nearest pass, to half the width
/// allowed there.
fn worst_reach(layout: &PassLayout, places: &[Point3<f64>], width: impl Fn(&Point3<f64>) -> f64) -> f64 {
    places.iter().map(|p| distance_to_passes(p, layout) / (0.5 * width(p))).fold(0.0, f64::max)
}

#[test]
fn narrow_strips_at_an_edge_get_partial_passes_and_the_rest_wide_ones() {
    for (side, direction) in [(0.0, Direction::Forward), (200.0, Direction::Reverse)] {
        let s = surface(skewed(0.0));
        // As beside a leading edge: a third of the width over 20 mm, then wide.
        let at = move |p: &Point3<f64>| if (p.x - side).abs() < 20.0 { 2.5 } else { 8.0 };
        let strategy = planes(Vector3::y_axis());
        // Forward is +x here: higher levels are to the left of the feed.
        let forward = strategy.sections().unwrap().gradient(&Point3::origin()).unwrap().cross(&Vector3::z()).x;
        assert!(forward > 0.0);
        let settings = LaySettings { direction, ..filled() };
        let plain =
            lay_by(&s, &strategy, &LaySettings { edge_fill: false, ..settings.clone() }, &|cc| at(&cc.position));
        let layout = lay_by(&s, &strategy, &settings, &|cc| at(&cc.position));
        assert!(length(&layout) < 0.62 * length(&plain), "{} of {}", length(&layout), length(&plain));
        let short: Vec<&LaidPass> = layout.passes.iter().filter(|p| p.partial && p.length < 100.0).collect();
        assert!(short.len() > 10, "{}", short.len());
        // They start at the narrow edge.
        assert!(short.iter().all(|p| (p.pass.points[0].position.x - side).abs() < 1e-6));
        let mut rng = Random(3);
        let places: Vec<_> = (0..3000).map(|_| Point3::new(200.0 * rng.unit(), 120.0 * rng.unit(), 0.0)).collect();
        let worst = worst_reach(&layout, &places, at);
        assert!(worst < 1.02, "{worst}");
    }
}

#[test]
fn partial_passes_run_out_along_the_pass_before_them() {
    // Widths that fall to a third beside the edge, at once or over 60 mm, on a plate and a ridge.
    let [step, ramp] = [0.0, 60.0].map(|over: f64| {
        move |p: &Point3<f64>| {
            let share = if over > 0.0 { ((p.x - 20.0) / over).clamp(0.0, 1.0) } else { f64::from(p.x > 20.0) };
            2.5 + 5.5 * share
        }
    });
    let shapes = [skewed(0.0), grid(80, 48, |u, v| Point3::new(200.0 * u, 120.0 * v, 15.0 * (3.0 * v).sin()))];
    let widths = [&step, &ramp];
    for s in shapes.map(surface) {
        for width in widths {
            let layout = lay_by(&s, &planes(Vector3::y_axis()), &filled(), &|cc| width(&cc.position));
            let (mut n, mut leaning) = (0, 0);
            for joined in layout.passes.iter().filter(|p| p.partial) {
                let points = &joined.pass.points;
                for end in [&points[0], &points[points.len() - 1]] {
                    let to_border = [end.position.x, 200.0 - end.position.x].into_iter().fold(f64::INFINITY, f64::min);
                    if to_border < 1.0 {
                        continue;
                    }
                    let others = gaps(&layout).filter(|(p, _)| !std::ptr::eq(*p, joined));
                    let apart = |[a, b]: &[&CcPoint; 2]| distance_to_segment(&end.position, &a.position, &b.position);
                    let (_, beside) = others.min_by(|(_, a), (_, b)| apart(a).total_cmp(&apart(b))).unwrap();
                    let (apart, turn) = (apart(&beside), (beside[1].position - beside[0].position).angle(&end.feed));
                    let share = apart / width(&end.position);
                    // Where the pass before falls as steeply, it ends within a tenth of the strip
                    // on a column, and each of both passes slopes by up to 0.2.
                    assert!(share < 0.16 && turn <= 2.0 * 0.2f64.atan() + 0.01, "{share} {turn}");
                    leaning += usize::from(share > 0.02 || turn > 0.1);
                    n += 1;
                }
            }
            assert!(n > 10 && 10 * leaning <= n, "{leaning} of {n}");
        }
    }
}

#[test]
fn plates_behind_one_another_are_covered_whole() {
    // Two plates with a gap across the passes, wider than a strip, and a narrow edge.
    let plate = |from: f64, to: f64| grid(40, 12, |u, v| Point3::new(200.0 * u, from + (to - from) * v, 0.0));
    let ranges = [(0.0, 50.0), (70.0, 120.0)];
    let s = surface(plate(0.0, 50.0).joined(&plate(70.0, 120.0)));
    let mut rng = Random(4);
    let places: Vec<_> = (0..3000)
        .map(|k| {
            let (from, to) = ranges[k % 2];
            Point3::new(200.0 * rng.unit(), from + (to - from) * rng.unit(), 0.0)
        })
        .collect();
    for narrow in [2.5, 8.0] {
        let at = move |p: &Point3<f64>| if p.x < 20.0 { narrow } else { 8.0 };
        for order in [LevelOrder::Increasing, LevelOrder::Decreasing] {
            let settings = LaySettings { order, ..filled() };
            let layout = lay_by(&s, &planes(Vector3::y_axis()), &settings, &|cc| at(&cc.position));
            let worst = worst_reach(&layout, &places, at);
            assert!(worst < 1.02, "{narrow}, {order:?}: {worst}");
        }
    }
}

#[test]
fn passes_of_even_width_stay_levels() {
    let s = surface(skewed(0.0));
    let strategy = planes(Vector3::y_axis());
    let settings = filled();
    let plain = lay_by(&s, &strategy, &LaySettings { edge_fill: false, ..settings.clone() }, &|_| 6.0);
    assert_eq!(plain, lay_by(&s, &strategy, &settings, &|_| 6.0));
}

#[test]
fn even_widths_stay_levels_on_a_mesh_that_is_coarser_than_the_band() {
    // Facets as large as the band reach beyond its levels by different ways.
    for lean in [0.0, 0.3] {
        let s = surface(grid(16, 16, |u, v| Point3::new(80.0 * u - 40.0, 80.0 * v - 40.0, lean * (80.0 * u - 40.0))));
        // The last step of each is wider than the quarter that fronts leave out.
        for to in [1.2, 2.0, 3.0] {
            let strategy = Strategy::ParallelPlanes(ParallelPlanes {
                origin: Point3::origin(),
                normal: Vector3::y_axis(),
                from: Some(-2.0),
                to: Some(to),
            });
            let settings = LaySettings { max_step_over: 1.7, ..filled() };
            let plain = lay_by(&s, &strategy, &LaySettings { edge_fill: false, ..settings.clone() }, &|_| 1.7);
            assert!(plain == lay_by(&s, &strategy, &settings, &|_| 1.7), "lean {lean}, to {to}");
        }
    }
}

/// A plate that lies a little askew: its border crosses the levels, so that passes on them begin
/// and end along it, and the first is a crumb.
#[test]
fn every_place_of_a_plate_askew_is_within_half_a_strip_of_a_pass() {
    for degrees in [0.005_f64, -0.1, 0.5, -2.0, 5.0, -12.0, 20.0, 30.0, -45.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let at = |x: f64, y: f64| Point3::new(cos * x - sin * y, sin * x + cos * y, 0.0);
        let s = surface(grid(40, 24, |u, v| at(200.0 * u, 120.0 * v)));
        for order in [LevelOrder::Increasing, LevelOrder::Decreasing] {
            let settings = LaySettings { order, ..filled() };
            let layout = lay_by(&s, &planes(Vector3::y_axis()), &settings, &|_| 6.0);
            let mut rng = Random(12);
            let places: Vec<_> = (0..4000)
                .map(|k| {
                    let x = 200.0 * rng.unit();
                    let y = [0.0, 120.0, 120.0 * rng.unit()][k % 3];
                    at(x, y)
                })
                .collect();
            let worst = worst_reach(&layout, &places, |_| 6.0);
            // Fronts follow borders up to 11°; beside steeper ones they end a little farther away.
            let most = if degrees.abs() < 11.0 { 1.03 } else { 1.1 };
            assert!(worst < most, "{degrees}° {order:?}: {worst}");
        }
    }
}

#[test]
fn levels_of_an_even_plate_begin_on_its_border() {
    let s = surface(grid(40, 24, |u, v| Point3::new(200.0 * u, 120.0 * v, 0.0)));
    let settings = LaySettings { edge_fill: false, min_pass_length: 2.0, ..filled() };
    let layout = lay_by(&s, &planes(Vector3::y_axis()), &settings, &|_| 6.0);
    let levels = || layout.passes.iter().map(|p| p.level);
    let (low, high) = (levels().fold(f64::INFINITY, f64::min), levels().fold(f64::NEG_INFINITY, f64::max));
    assert!(low.abs() < 1e-3 && (high - 120.0).abs() < 1e-3, "{low} {high}");
}

/// Levels of a plate askew, whose first and last corners would be cut in crumbs, begin and end half
/// a strip inside.
#[test]
fn levels_of_a_plate_askew_begin_half_a_strip_from_its_corners() {
    for degrees in [2.0_f64, 20.0, -45.0, 60.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let at = |x: f64, y: f64| Point3::new(cos * x - sin * y, sin * x + cos * y, 0.0);
        let s = surface(grid(40, 24, |u, v| at(200.0 * u, 120.0 * v)));
        for order in [LevelOrder::Increasing, LevelOrder::Decreasing] {
            let settings = LaySettings { order, edge_fill: false, min_pass_length: 2.0, ..filled() };
            let layout = lay_by(&s, &planes(Vector3::y_axis()), &settings, &|_| 6.0);
            let corners = [[0.0, 0.0], [200.0, 0.0], [0.0, 120.0], [200.0, 120.0]].map(|[x, y]| at(x, y).y);
            let levels = || layout.passes.iter().map(|p| p.level);
            let (low, high) = (levels().fold(f64::INFINITY, f64::min), levels().fold(f64::NEG_INFINITY, f64::max));
            let least = corners.into_iter().fold(f64::INFINITY, f64::min);
            let most = corners.into_iter().fold(f64::NEG_INFINITY, f64::max);
            assert!(low - least < 3.03 && most - high < 3.03, "{degrees}° {order:?}: {low} {high} of {least} {most}");
        }
    }
}

/// A sheet that goes on beyond the levels to be cut: the first pass lies on the first level, none
/// beyond the last, and nothing between them is farther than half a strip from a pass.
#[test]
fn fronts_of_a_band_of_a_sheet_stay_in_the_band() {
    let s = surface(grid(40, 40, |u, v| Point3::new(80.0 * u - 40.0, 80.0 * v - 40.0, 0.0)));
    let at = |p: &Point3<f64>| if p.x > 30.0 { 1.0 } else { 2.0 };
    for (to, evenly) in [(1.0, true), (5.0, false)] {
        let width = |cc: &CcPoint| if evenly { 2.0 } else { at(&cc.position) };
        let strategy = Strategy::ParallelPlanes(ParallelPlanes {
            origin: Point3::origin(),
            normal: Vector3::y_axis(),
            from: Some(-1.0),
            to: Some(to),
        });
        let settings = LaySettings { max_step_over: 2.0, direction: Direction::Reverse, ..filled() };
        let layout = lay_by(&s, &strategy, &settings, &width);
        let ys = || layout.passes.iter().flat_map(|p| &p.pass.points).map(|cc| cc.position.y);
        // A pass ends at the next side of a triangle, 2·√2 mm on at most, with slopes up to 0.2.
        let most = to + 0.2 * 8f64.sqrt();
        assert!(ys().all(|y| (-1.0 - 1e-3..=most).contains(&y)), "{to}: {:?}", ys().fold(0.0, f64::max));
        let first = &layout.passes[0].pass.points;
        assert!(first.iter().all(|cc| (cc.position.y + 1.0).abs() < 1e-2), "{to}");
        if evenly {
            assert_eq!(layout.passes.len(), 2);
        }
        let mut rng = Random(5);
        let mut place = || Point3::new(80.0 * rng.unit() - 40.0, -1.0 + (to + 1.0) * rng.unit(), 0.0);
        let places: Vec<_> = (0..1000).map(|_| place()).collect();
        let worst = worst_reach(&layout, &places, |p| if evenly { 2.0 } else { at(p) });
        assert!(worst < 1.02, "{to}: {worst}");
    }
}

/// Each lean, pattern and order once; all of them together are for the sweep.
#[test]
fn strips_of_a_skewed_region_are_no_wider_than_allowed() {
    strips_of_skewed_regions(&[-1.2], &[Pattern::OneWay], &[LevelOrder::Increasing]);
    strips_of_skewed_regions(&[0.1], &[Pattern::Zigzag], &[LevelOrder::Decreasing]);
    strips_of_skewed_regions(&[0.5], &[Pattern::Zigzag], &[LevelOrder::Increasing]);
}

#[test]
#[ignore = "the same for all leans, patterns and orders: a quarter of a minute"]
fn strips_of_a_skewed_region_are_no_wider_than_allowed_in_any_order() {
    let (patterns, orders) = ([Pattern::OneWay, Pattern::Zigzag], [LevelOrder::Increasing, LevelOrder::Decreasing]);
    strips_of_skewed_regions(&[-1.2, 0.1, 0.5], &patterns, &orders);
}

fn strips_of_skewed_regions(leans: &[f64], patterns: &[Pattern], orders: &[LevelOrder]) {
    for &lean in leans {
        for &pattern in patterns {
            for &order in orders {
                let s = surface(skewed(lean));
                let at = |p: &Point3<f64>| 2.5 + 5.5 * ((p.x - lean * p.y) / 60.0).clamp(0.0, 1.0);
                let settings = LaySettings { pattern, order, ..filled() };
                let layout = lay_by(&s, &planes(Vector3::y_axis()), &settings, &|cc| at(&cc.position));
                let mut rng = Random(3);
                let place = |rng: &mut Random| {
                    let y = 120.0 * rng.unit();
                    Point3::new(200.0 * rng.unit() + lean * y, y, 0.0)
                };
                let places: Vec<_> = (0..600).map(|_| place(&mut rng)).collect();
                // Beside a leaning side, a front that leans itself ends a little farther away.
                let is_beside = |p: &Point3<f64>| !(4.0..196.0).contains(&(p.x - lean * p.y));
                let (beside, inside): (Vec<_>, Vec<_>) = places.into_iter().partition(is_beside);
                for (places, most) in [(inside, 1.005), (beside, 1.06)] {
                    let worst = worst_reach(&layout, &places, at);
                    assert!(worst < most, "{lean} {pattern:?} {order:?}: {worst}");
                }
                // Levels take 49 · 200 mm; passes as wide as allowed everywhere, 120 mm · ∫ dx / w
                // = 3.6 m.
                assert!(length(&layout) < 7000.0, "{lean} {pattern:?} {order:?}: {}", length(&layout));
                assert!(layout.passes.iter().all(|p| p.length >= 5.0));
            }
        }
    }
}

#[test]
fn fronts_of_planes_and_cylinders_lie_on_a_wavy_mesh_within_a_strip_of_each_other() {
    let s = surface(waves(40));
    let axis_origin = Point3::new(50.0, -150.0, 0.0);
    // Narrow at both sides of 100 mm; passes that all run one way fill up one of them only.
    let at = |p: &Point3<f64>| 1.5 + 4.5 * (p.x.min(100.0 - p.x) / 25.0).clamp(0.0, 1.0);
    // Fronts reach places beside the leaning border that rings on levels leave, and cost less.
    for (strategy, share) in [(planes(oblique()), 0.95), (rings(axis_origin, 100.0, 300.0), 0.99)] {
        let settings = LaySettings { max_step_over: 6.0, ..filled() };
        let width = |cc: &CcPoint| at(&cc.position);
        let plain = lay_by(&s, &strategy, &LaySettings { edge_fill: false, ..settings.clone() }, &width);
        let on = |n_threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
            pool.install(|| lay_by(&s, &strategy, &settings, &width))
        };
        let layout = on(2);
        assert_eq!(layout, on(1));
        let cost = |layout: &PassLayout| length(layout) + settings.pass_cost * layout.passes.len() as f64;
        assert!(layout.passes.iter().any(|p| p.partial) && cost(&layout) < share * cost(&plain));
        for (p, cc) in points(&layout) {
            assert!(s.closest_point(&cc.position, 1e-9).is_some());
            assert!((cc.feed.norm() - 1.0).abs() < 1e-9 && cc.feed.dot(&cc.normal).abs() < 1e-9);
            // Fronts lean by at most 0.2 along the passes, and their coordinate by no more than the
            // mesh requires.
            let level = strategy.sections().unwrap().gradient(&cc.position).unwrap();
            assert!(cc.feed.dot(&level).abs() < 0.45, "{} at {}", cc.feed.dot(&level), p.level);
        }
        for (_, [a, b]) in gaps(&layout) {
            assert!(a.feed.dot(&b.feed) > 0.5 && (b.position - a.position).dot(&a.feed) > 0.0);
        }
        let mut rng = Random(8);
        for _ in 0..600 {
            let p = Point3::new(2.0 + 96.0 * rng.unit(), 2.0 + 76.0 * rng.unit(), 0.0);
            let p = s.closest_point(&p, 50.0).unwrap().position;
            let reach = distance_to_passes(&p, &layout) / (0.5 * at(&p));
            assert!(reach < 1.06, "{p}: {reach}");
        }
    }
}

#[test]
fn fronts_on_a_heap_of_random_triangles_lie_on_it_or_give_a_typed_error() {
    let mut rng = Random(22);
    let mut n_laid = 0;
    for _ in 0..6 {
        let vertices: Vec<Point3<f64>> = (0..12).map(|_| rng.point(30.0)).collect();
        let mut index = || (rng.unit() * 12.0) as u32;
        let triangles = (0..25).map(|_| [index(), index(), index()]).collect();
        let s = surface(TriMesh::new(vertices, triangles).unwrap());
        for strategy in [planes(rng.direction()), rings(rng.point(20.0), 0.0, 1e3)] {
            let settings = LaySettings { max_step_over: 6.0, min_step_over: 2.0, ..filled() };
            let width = |cc: &CcPoint| 2.0 + cc.position.x.abs() / 8.0;
            match lay_passes(&s, &Region::default(), &strategy, &settings, &width, &Silent) {
                Ok(layout) => {
                    n_laid += 1;
                    assert!(points(&layout).all(|(_, cc)| s.closest_point(&cc.position, 1e-9).is_some()));
                }
                Err(e) => assert!(matches!(e, PathError::EmptyRegion { .. } | PathError::NoPasses { .. }), "{e}"),
            }
        }
    }
    assert!(n_laid > 6, "{n_laid}");
}

#[test]
fn a_negative_cost_of_a_pass_is_named() {
    let s = surface(skewed(0.0));
    let settings = LaySettings { pass_cost: -1.0, ..filled() };
    let strategy = planes(Vector3::y_axis());
    let e = lay_passes(&s, &Region::default(), &strategy, &settings, &|_| 1.0, &Silent).unwrap_err();
    assert!(e.to_string().starts_with("pass_cost is -1"), "{e}");
}
