//! Laws of every point.

use super::*;

#[test]
fn every_point_lies_on_the_mesh_and_on_its_level_with_the_feed_along_it() {
    let cases = [
        (surface(waves(25)), planes(oblique())),
        (surface(waves(25)), rings(Point3::new(30.0, 20.0, 0.0), 5.0, 60.0)),
        (surface(plane(100.0, 80.0, 1, 1)), rings(Point3::new(40.0, 30.0, 7.0), 1.0, 90.0)),
        (surface(sphere_patch(50.0, 0.6, 9)), rings(Point3::new(300.0, 0.0, 0.0), 100.0, 1e4)),
        (surface(cylinder(50.0, 100.0, 1.0, 3, 20)), planes(Vector3::y_axis())),
    ];
    for (s, strategy) in &cases {
        let laid = lay(s, strategy, &LaySettings { max_step_over: 4.0, ..LaySettings::default() });
        assert!(laid.passes.len() > 12);
        for (p, cc) in points(&laid) {
            let on_mesh = s.closest_point(&cc.position, 1.0).unwrap();
            assert!(on_mesh.distance < 1e-9, "{} off the mesh", on_mesh.distance);
            assert!((strategy.sections().unwrap().level(&cc.position) - p.level).abs() < 1e-9);
            assert!(cc.normal.angle(&s.normal_at(&on_mesh)) < 1e-6);
            assert!(cc.feed.dot(&strategy.sections().unwrap().gradient(&cc.position).unwrap()).abs() < 1e-9);
        }
    }
}

#[test]
fn no_two_points_in_a_row_are_the_same_and_passes_run_from_border_to_border() {
    let laid = lay(&surface(plane(100.0, 80.0, 13, 7)), &planes(Vector3::y_axis()), &LaySettings::default());
    assert_eq!((laid.passes.len(), laid.n_levels, laid.n_dropped_pieces), (17, 17, 0));
    for (_, [a, b]) in gaps(&laid) {
        assert!((a.position - b.position).norm() > 1e-3);
    }
    for p in &laid.passes {
        let ends = [p.pass.points[0].position.x, p.pass.points[p.pass.points.len() - 1].position.x];
        // Forward has the higher levels on the left.
        assert!(ends[0].abs() < 1e-12 && (ends[1] - 100.0).abs() < 1e-12, "{ends:?}");
        assert!((p.length - 100.0).abs() < 1e-9);
        assert_eq!(p.pass.points.len(), 21, "twenty steps of 5 mm");
    }
    // The first and the last pass lie on the border, all others evenly between.
    for (k, p) in laid.passes.iter().enumerate() {
        assert!((p.level - 5.0 * k as f64).abs() < 1.3e-4, "{k}: {}", p.level);
    }
}

#[test]
fn chords_keep_to_the_tolerance_on_a_sphere_whose_facets_are_far_coarser() {
    let radius = 50.0;
    // Facets of 6 mm: 0.09 mm below the sphere, far more than the tolerances.
    let s = surface(sphere_patch(radius, 0.6, 12));
    for tolerance in [0.03, 0.01, 0.002] {
        let settings = LaySettings { chord_tolerance: tolerance, max_step: 20.0, ..LaySettings::default() };
        let laid = lay(&s, &planes(Vector3::y_axis()), &settings);
        assert!(laid.largest_chord <= tolerance);
        let [mut largest, mut at_border]: [f64; 2] = [0.0, 0.0];
        for (_, [a, b]) in gaps(&laid) {
            // The line is a chord of the sphere.
            let half = 0.5 * (a.position - b.position).norm();
            let chord = radius - (radius * radius - half * half).sqrt();
            let angle_x = |cc: &CcPoint| (cc.position.x / cc.position.z).atan().abs();
            // The facets along the border end at 0.6, and begin at 0.5.
            let worst = if angle_x(a).max(angle_x(b)) > 0.5 { &mut at_border } else { &mut largest };
            *worst = worst.max(chord);
        }
        // The smooth normals turn a little unevenly over the facets: that is the mesh's error, not
        // the path's.
        assert!(largest <= 1.12 * tolerance, "{largest} of {tolerance}");
        assert!(largest >= 0.8 * tolerance, "points are too dense: {largest} of {tolerance}");
        // Normals on the border are means of those of its facets, which are right at a third and at
        // two thirds of the way across them: over these facets normals turn by a third to two
        // thirds of what the sphere does, and chords are taken for as much lower.
        assert!(at_border <= 1.12 * 3.0 * tolerance, "{at_border} of {tolerance}");
    }
}

#[test]
fn chords_beside_the_line_keep_to_the_tolerance_on_a_plane() {
    let s = surface(plane(100.0, 80.0, 2, 2));
    let axis = Point3::new(-20.0, 40.0, 0.0);
    let settings = LaySettings { chord_tolerance: 0.005, max_step: 50.0, ..LaySettings::default() };
    let laid = lay(&s, &rings(axis, 25.0, 120.0), &settings);
    let mut largest: f64 = 0.0;
    for (p, [a, b]) in gaps(&laid) {
        let half = 0.5 * (a.position - b.position).norm();
        largest = largest.max(p.level - (p.level * p.level - half * half).sqrt());
    }
    assert!(largest <= 0.005 && largest > 0.003, "{largest}");
}

#[test]
fn steps_and_turns_keep_to_their_bounds_and_to_no_more_points_than_needed() {
    let s = surface(cylinder(50.0, 100.0, 1.0, 10, 100));
    let settings =
        LaySettings { chord_tolerance: 10.0, max_step: 7.0, max_normal_change: Some(0.05), ..LaySettings::default() };
    let across = lay(&s, &planes(Vector3::x_axis()), &settings);
    for (_, [a, b]) in gaps(&across) {
        assert!(a.normal.angle(&b.normal) <= 0.05 + 1e-12);
    }
    // 2 rad in steps of 0.05.
    assert!(across.passes.iter().all(|p| (41..=43).contains(&p.pass.points.len())));
    let along = lay(&s, &planes(Vector3::y_axis()), &settings);
    for (_, [a, b]) in gaps(&along) {
        assert!((a.position - b.position).norm() <= 7.0 * (1.0 + 1e-9));
    }
    assert!(along.passes.iter().all(|p| p.pass.points.len() == 16));
}

#[test]
fn feeds_point_along_the_pass() {
    let laid = lay(&surface(waves(30)), &planes(oblique()), &LaySettings { max_step: 1.0, ..Default::default() });
    for (_, [a, b]) in gaps(&laid) {
        let way = b.position - a.position;
        // The smooth tangent against a chord of facets of 3 mm.
        assert!(a.feed.angle(&way) < 0.15 && b.feed.angle(&way) < 0.15, "{}", a.feed.angle(&way));
    }
}

#[test]
fn laid_passes_written_and_projected_again_are_themselves() {
    let s = surface(waves(30));
    let laid = lay(&s, &planes(oblique()), &LaySettings { max_step: 0.5, ..LaySettings::default() });
    let file = read_path_file(write_path_file(&PathFile::from_passes(laid.passes.iter().map(|p| &p.pass))).as_bytes());
    let settings = ProjectSettings { max_distance: 1e-6, work_from_mesh: Isometry3::identity() };
    let passes = project(&file.unwrap(), &s, &settings).unwrap();
    assert_eq!(passes.len(), laid.passes.len());
    for (p, q) in passes.iter().zip(&laid.passes) {
        for (a, b) in p.points.iter().zip(&q.pass.points) {
            assert!((a.position - b.position).norm() < 1e-9 && a.normal.angle(&b.normal) < 1e-7);
            assert!(a.feed.angle(&b.feed) < 0.15);
        }
    }
}
