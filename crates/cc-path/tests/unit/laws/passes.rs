//! Ends, order and sides of passes.

use super::*;

/// The side of the feed on which the other pass lies, where the two are nearest.
fn side_of(other: &LaidPass, of: &LaidPass) -> UncutSide {
    let pairs = of.pass.points.iter().flat_map(|cc| other.pass.points.iter().map(move |o| (cc, o.position)));
    let way = |(cc, p): &(&CcPoint, Point3<f64>)| (p - cc.position).norm();
    let (cc, p) = pairs.min_by(|a, b| way(a).total_cmp(&way(b))).unwrap();
    if cc.left().dot(&(p - cc.position)) > 0.0 { UncutSide::Left } else { UncutSide::Right }
}

#[test]
fn the_uncut_side_is_where_the_next_level_lies_in_every_order_direction_and_pattern() {
    let s = surface(sphere_patch(50.0, 0.6, 15));
    for strategy in [planes(oblique()), rings(Point3::new(80.0, 0.0, 0.0), 10.0, 200.0)] {
        for order in [LevelOrder::Increasing, LevelOrder::Decreasing] {
            for direction in [Direction::Forward, Direction::Reverse] {
                for pattern in [Pattern::OneWay, Pattern::Zigzag] {
                    let settings = LaySettings { order, direction, pattern, ..LaySettings::default() };
                    let laid = lay(&s, &strategy, &settings);
                    assert_eq!(laid.passes[0].uncut, direction.uncut_side(order));
                    // On its first level the curved border leaves several pieces.
                    let of_level = |w: &&[LaidPass]| w[0].level != w[1].level;
                    for w in laid.passes.windows(2).filter(of_level) {
                        assert_eq!(side_of(&w[1], &w[0]), w[0].uncut);
                        assert_ne!(
                            side_of(&w[0], &w[1]),
                            w[1].uncut,
                            "{settings:?} {:?} {:?}",
                            w[0].pass.points,
                            w[1].pass.points
                        );
                        assert_eq!(w[0].uncut == w[1].uncut, pattern == Pattern::OneWay, "zigzag alternates");
                        let turned = w[0].pass.points[1].feed.dot(&w[1].pass.points[1].feed) < 0.0;
                        assert_eq!(turned, pattern == Pattern::Zigzag);
                        assert_eq!(w[0].level < w[1].level, order == LevelOrder::Increasing);
                    }
                    for side in [UncutSide::Left, UncutSide::Right] {
                        let requested = LaySettings { uncut: Some(side), ..settings.clone() };
                        assert_eq!(lay(&s, &strategy, &requested).passes[0].uncut, side);
                    }
                }
            }
        }
    }
}

#[test]
fn passes_end_the_margin_before_the_border_and_short_ones_are_dropped_and_counted() {
    // A right triangle: sections by y = const are 100 − y long.
    let corners = [[0.0, 0.0], [100.0, 0.0], [0.0, 100.0]].map(|[x, y]| Point3::new(x, y, 0.0));
    let s = surface(TriMesh::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap());
    let settings = LaySettings { edge_margin: 7.0, min_pass_length: 20.0, ..LaySettings::default() };
    let laid = lay(&s, &planes(Vector3::y_axis()), &settings);
    for p in &laid.passes {
        let (first, last) = (&p.pass.points[0], &p.pass.points[p.pass.points.len() - 1]);
        assert!((first.position.x - 7.0).abs() < 1e-9);
        assert!((last.position.x - (100.0 - p.level - 7.0)).abs() < 1e-9);
        assert!((p.length - (100.0 - p.level - 14.0)).abs() < 1e-9 && p.length >= 20.0);
    }
    // Step 5: levels 0, 5, … 65 are long enough, 70 … 95 are not; 100 is a corner, cut just below
    // it.
    assert_eq!((laid.passes.len(), laid.n_levels, laid.n_dropped_pieces), (14, 21, 7));
    let e = LaySettings { min_pass_length: 200.0, ..settings };
    let e = lay_passes(&s, &Region::default(), &planes(Vector3::y_axis()), &e, &|_| 5.0, &Silent).unwrap_err();
    assert_eq!(e, PathError::NoPasses { n_dropped_pieces: 21 });
}

#[test]
fn a_hole_makes_several_passes_of_a_level_in_the_order_of_the_feed() {
    let whole = plane(100.0, 60.0, 50, 30);
    let outside = |t: &[u32; 3]| {
        let c = t.iter().map(|&v| whole.vertices()[v as usize].coords).sum::<Vector3<f64>>() / 3.0;
        !((30.0..50.0).contains(&c.x) && (20.0..40.0).contains(&c.y))
    };
    let triangles = whole.triangles().iter().copied().filter(outside).collect();
    let s = surface(TriMesh::new(whole.vertices().to_vec(), triangles).unwrap());
    for pattern in [Pattern::OneWay, Pattern::Zigzag] {
        let settings = LaySettings { max_step_over: 3.0, pattern, ..LaySettings::default() };
        let laid = lay(&s, &planes(Vector3::y_axis()), &settings);
        let beside = |p: &&LaidPass| p.level > 20.0 && p.level < 40.0;
        let split: Vec<&LaidPass> = laid.passes.iter().filter(beside).collect();
        assert!(split.len() >= 12 && split.len().is_multiple_of(2));
        for pair in split.chunks(2) {
            assert_eq!(pair[0].level, pair[1].level);
            let along = pair[0].pass.points[0].feed.x;
            let [a, b] = [pair[0], pair[1]].map(|p| p.pass.points[0].position.x);
            assert!((b - a) * along > 0.0 || pattern == Pattern::OneWay, "{a} {b}");
        }
    }
}

#[test]
fn closed_passes_begin_and_end_at_the_requested_place() {
    let s = surface(sphere_cap(50.0, 0.9, 30, 90));
    let start = Point3::new(0.0, 70.0, 0.0);
    let settings = LaySettings { max_step_over: 2.0, closed_start: Some(start), ..LaySettings::default() };
    let laid = lay(&s, &planes(Vector3::z_axis()), &settings);
    assert!(laid.passes.len() > 22);
    for p in &laid.passes {
        let ring = (2500.0 - p.level * p.level).sqrt();
        let (first, last) = (&p.pass.points[0], &p.pass.points[p.pass.points.len() - 1]);
        assert!(p.closed && first.position == last.position);
        // 90 points on a ring: nodes are 1/29 of its radius apart at most.
        assert!((first.position - Point3::new(0.0, ring, p.level)).norm() < 0.04 * ring + 0.3 / ring);
        // Facets lie inside the sphere: 0.006 mm along the meridian, which is more beside it the
        // flatter it is.
        assert!((p.length / (std::f64::consts::TAU * ring) - 1.0).abs() < 1e-3 + 0.3 / (ring * ring));
    }
    let mut rng = Random(3);
    for _ in 0..500 {
        let t = (rng.unit() * s.mesh().triangles().len() as f64) as u32;
        let p = s.point(t, [0.2, 0.5, 0.3]).position;
        assert!(distance_to_passes(&p, &laid) < 2.0, "also over the pole, where the surface lies along the levels");
    }
}

#[test]
fn circles_inside_one_large_facet_are_found() {
    let s = surface(plane(100.0, 80.0, 1, 1));
    let laid = lay(&s, &rings(Point3::new(50.0, 40.0, 0.0), 2.0, 38.0), &LaySettings::default());
    assert_eq!(laid.passes.len(), 9);
    for p in &laid.passes {
        assert!(p.closed && (p.length - std::f64::consts::TAU * p.level).abs() < 1e-2 * p.level);
    }
    // Forward: outward is to the left, so clockwise seen from outside.
    let [a, b] = [0, 1].map(|k| laid.passes[3].pass.points[k].position - Point3::new(50.0, 40.0, 0.0));
    assert!(a.cross(&b).z < 0.0);
}
