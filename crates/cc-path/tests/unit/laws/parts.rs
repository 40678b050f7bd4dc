//! Laws of a whole path: motion, threads, real and broken parts, wrong input.

use super::*;

#[test]
fn a_rigid_motion_of_everything_moves_the_passes_with_it() {
    let mut rng = Random(9);
    let mesh = waves(20);
    let settings = LaySettings { pattern: Pattern::Zigzag, ..LaySettings::default() };
    let cone = |axis| Some(NormalCone { axis, half_angle: 0.45 });
    let axis_origin = Point3::new(20.0, -10.0, 0.0);
    let still = Region { normal_cone: cone(Vector3::z_axis()), ..Region::default() };
    for strategy in [planes(oblique()), rings(axis_origin, 20.0, 80.0)] {
        let width = |cc: &CcPoint| 2.0 + cc.normal.dot(&Vector3::z());
        let laid = lay_passes(&surface(mesh.clone()), &still, &strategy, &settings, &width, &Silent).unwrap();
        let to_from: Isometry3<f64> = rng.motion(200.0);
        let axis = to_from * Vector3::z_axis();
        let moved_strategy = match strategy.sections().unwrap() {
            Sections::ParallelPlanes(s) => {
                let (origin, normal) = (to_from * s.origin, to_from * s.normal);
                Strategy::ParallelPlanes(ParallelPlanes { origin, normal, ..s })
            }
            Sections::CylindricalSections(s) => Strategy::CylindricalSections(CylindricalSections {
                axis_origin: to_from * s.axis_origin,
                axis_direction: to_from * s.axis_direction,
                ..s
            }),
        };
        let region = Region { normal_cone: cone(axis), ..Region::default() };
        let width = |cc: &CcPoint| 2.0 + cc.normal.dot(&axis);
        let s = surface(mesh.transformed(&to_from));
        let moved = lay_passes(&s, &region, &moved_strategy, &settings, &width, &Silent).unwrap();
        assert_eq!(laid.passes.len(), moved.passes.len());
        for ((p, a), (q, b)) in points(&laid).zip(points(&moved)) {
            assert_eq!((p.uncut, p.closed, p.pass.points.len()), (q.uncut, q.closed, q.pass.points.len()));
            assert!((p.level - q.level).abs() < 1e-9, "{} {}", p.level, q.level);
            let a = a.transformed(&to_from);
            assert!((a.position - b.position).norm() < 1e-6, "{}", (a.position - b.position).norm());
            assert!(a.feed.angle(&b.feed) < 1e-6 && a.normal.angle(&b.normal) < 1e-6);
        }
    }
}

#[test]
fn the_path_is_the_same_on_one_and_two_threads() {
    let s = surface(waves(40));
    let settings = LaySettings { max_step_over: 2.0, pattern: Pattern::Zigzag, ..LaySettings::default() };
    let width = |cc: &CcPoint| 1.0 + cc.position.x / 50.0;
    let on = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| lay_passes(&s, &Region::default(), &planes(oblique()), &settings, &width, &Silent)).unwrap()
    };
    let (one, two) = (on(1), on(2));
    assert_eq!(one, two);
    assert_eq!(write_path_file(&PathFile::from_passes(one.passes.iter().map(|p| &p.pass))), {
        write_path_file(&PathFile::from_passes(two.passes.iter().map(|p| &p.pass)))
    });
}

#[test]
fn wrong_settings_and_regions_are_named() {
    let s = surface(plane(10.0, 10.0, 2, 2));
    let error = |strategy: Strategy, settings: LaySettings| {
        let e = lay_passes(&s, &Region::default(), &strategy, &settings, &|_| 1.0, &Silent).unwrap_err();
        e.to_string()
    };
    let y = planes(Vector3::y_axis());
    let e = error(y.clone(), LaySettings { max_step: 0.0, ..LaySettings::default() });
    assert_eq!(e, "max_step is 0, but has to be finite and above 0");
    let e = error(y.clone(), LaySettings { edge_margin: -1.0, ..LaySettings::default() });
    assert!(e.starts_with("edge_margin is -1"), "{e}");
    let e = error(y.clone(), LaySettings { min_step_over: 9.0, ..LaySettings::default() });
    assert!(e.contains("at most max_step_over"), "{e}");
    let e = error(y.clone(), LaySettings { chord_tolerance: f64::NAN, ..LaySettings::default() });
    assert!(e.starts_with("chord_tolerance is NaN"), "{e}");
    let e = error(rings(Point3::origin(), 30.0, 20.0), LaySettings::default());
    assert!(e.starts_with("to_radius is 20"), "{e}");
    let e = error(rings(Point3::origin(), 30.0, 40.0), LaySettings::default());
    assert!(e.contains("within box and levels"), "{e}");
    let e = error(planes(Vector3::z_axis()), LaySettings::default());
    assert!(e.contains("check the direction of the strategy"), "{e}");
    let e = error(y.clone(), LaySettings { max_step: 1e-6, chord_tolerance: 1e-6, ..LaySettings::default() });
    assert!(e.contains("more than 2000000; take a largest step of"), "{e}");
}

#[test]
fn a_cancelled_run_has_no_path() {
    struct Stopped;
    impl Monitor for Stopped {
        fn advance(&self, _steps: usize) {}
        fn is_cancelled(&self) -> bool {
            true
        }
    }
    let s = surface(plane(10.0, 10.0, 2, 2));
    let strategy = planes(Vector3::y_axis());
    let e = lay_passes(&s, &Region::default(), &strategy, &LaySettings::default(), &|_| 1.0, &Stopped);
    assert_eq!(e, Err(PathError::Cancelled(Cancelled)));
}

#[test]
fn a_propeller_blade_is_covered_by_one_pass_per_radius() {
    let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 3048.0).unwrap();
    let s = surface(blade(&spec, BladeResolution::new(60, 90).unwrap()));
    let region = Region { groups: Some(vec!["suction".to_owned()]), ..Region::default() };
    let strategy = rings(Point3::origin(), 1.15 * spec.hub_radius(), 0.99 * 1524.0);
    let settings = LaySettings {
        chord_tolerance: 0.02,
        max_step: 10.0,
        max_step_over: 40.0,
        uncut: Some(UncutSide::Right),
        ..LaySettings::default()
    };
    let laid = lay_on(&s, &region, &strategy, &settings);
    assert_eq!((laid.passes.len(), laid.n_dropped_pieces, laid.n_wide_strips), (laid.n_levels, 0, 0));
    // Radii from 350 to 1,509 mm, along a blade that lies nearly across the levels.
    assert!((30..40).contains(&laid.n_levels), "{}", laid.n_levels);
    assert!(laid.largest_step_over <= 40.0 && laid.largest_step_over > 36.0);
    assert!(laid.largest_chord <= 0.02);
    let suction = s.mesh().groups()[0].triangles.clone();
    for (p, cc) in points(&laid) {
        let at = s.closest_point_where(&cc.position, 1.0, |t| suction.contains(&(t as usize))).unwrap();
        assert!(at.distance < 1e-9 && (strategy.sections().unwrap().level(&cc.position) - p.level).abs() < 1e-9);
        assert_eq!(p.uncut, UncutSide::Right);
    }
    for (_, [a, b]) in gaps(&laid) {
        assert!((b.position - a.position).norm() <= 10.0 * (1.0 + 1e-9));
        assert!(a.feed.dot(&b.feed) > 0.99);
    }
}

#[test]
fn a_heap_of_random_triangles_gives_passes_on_it_or_a_typed_error() {
    heaps_give_passes_or_errors(21, 5);
}

#[test]
#[ignore = "the same for a hundred heaps: a minute"]
fn a_hundred_heaps_of_random_triangles_give_passes_or_a_typed_error() {
    heaps_give_passes_or_errors(23, 100);
}

fn heaps_give_passes_or_errors(seed: u64, heaps: usize) {
    let mut rng = Random(seed);
    let mut n_laid = 0;
    for _ in 0..heaps {
        let n = 12;
        let mut vertices: Vec<Point3<f64>> = (0..n).map(|_| rng.point(30.0)).collect();
        vertices[1] = vertices[0];
        vertices[3].z = vertices[2].z;
        let mut index = || (rng.unit() * n as f64) as u32;
        let triangles = (0..25).map(|_| [index(), index(), index()]).collect();
        let s = surface(TriMesh::new(vertices, triangles).unwrap());
        let bounds = Aabb { min: Point3::new(-20.0, -1e9, -20.0), max: Point3::new(10.0, 9.0, 1e9) };
        let region = Region { bounds: Some(bounds), ..Region::default() };
        let settings = LaySettings { max_step_over: 6.0, min_step_over: 2.0, ..LaySettings::default() };
        for strategy in [planes(rng.direction()), planes(Vector3::z_axis()), rings(rng.point(20.0), 0.0, 1e3)] {
            match lay_passes(&s, &region, &strategy, &settings, &|_| 1.0, &Silent) {
                Ok(laid) => {
                    n_laid += 1;
                    for (p, cc) in points(&laid) {
                        assert!((strategy.sections().unwrap().level(&cc.position) - p.level).abs() < 1e-9);
                        assert!(
                            s.closest_point(&cc.position, 1e-9).is_some()
                                && bounds.dilated(1e-9).contains(&cc.position)
                        );
                        assert!((cc.feed.norm() - 1.0).abs() < 1e-9 && cc.feed.dot(&cc.normal).abs() < 1e-9);
                    }
                }
                Err(e) => assert!(matches!(e, PathError::EmptyRegion { .. } | PathError::NoPasses { .. }), "{e}"),
            }
        }
    }
    assert!(2 * n_laid > 3 * heaps, "{n_laid}");
}

#[test]
fn a_region_between_cylinders_is_cut_at_them_by_passes_of_any_direction() {
    // Facets far larger than the ring, with the axis beside the sheet.
    for (n, axis_origin) in [(2, Point3::new(50.0, 40.0, 0.0)), (30, Point3::new(20.0, -15.0, 5.0))] {
        let s = surface(plane(100.0, 80.0, n, n));
        let (from, to) = (22.0, 31.0);
        let radius = |p: &Point3<f64>| (p - axis_origin).xy().norm();
        let Strategy::CylindricalSections(between) = rings(axis_origin, from, to) else { panic!("rings") };
        let region = Region { between: Some(Sections::CylindricalSections(between)), ..Region::default() };
        let requested = RequestedRegion::new(&s, &region, None).unwrap();
        let mut rng = Random(41);
        let places: Vec<_> = (0..20_000).map(|_| Point3::new(100.0 * rng.unit(), 80.0 * rng.unit(), 0.0)).collect();
        let in_ring: Vec<_> = places.iter().filter(|p| (from..=to).contains(&radius(p))).collect();
        let expected = 8000.0 * in_ring.len() as f64 / places.len() as f64;
        let area: f64 = requested.samples(1.0).iter().map(|sample| sample.area).sum();
        assert!((area / expected - 1.0).abs() < 0.05, "{area} of {expected}");
        for strategy in [planes(Vector3::x_axis()), planes(oblique())] {
            let settings =
                LaySettings { max_step_over: 2.0, edge_fill: true, pass_cost: 5.0, ..LaySettings::default() };
            let laid = lay_passes(&s, &region, &strategy, &settings, &|_| 2.0, &Silent).unwrap();
            // Cylinders are cut as polygons within half the chord.
            let most = settings.chord_tolerance;
            for (_, cc) in points(&laid) {
                assert!((from - most..=to + most).contains(&radius(&cc.position)), "{}", cc.position);
            }
            let far = |p: &&&Point3<f64>| distance_to_passes(p, &laid) > 1.1;
            let n_far = in_ring.iter().take(1500).filter(far).count();
            // Passes cross a ring at an angle, and end at its border.
            assert!(n_far < 10, "{n_far} of {}", in_ring.len().min(1500));
        }
    }
}

#[test]
fn edges_and_passes_are_between_the_same_cylinders_on_coarse_facets() {
    // A roof of four facets along x. The cylinders about an axis beside its ridge cross that four
    // times, and its ends are outside.
    let roof = grid(1, 2, |u, v| Point3::new(100.0 * u, 60.0 * v - 30.0, -20.0 * (2.0 * v - 1.0).abs()));
    let s = surface(roof);
    let Strategy::CylindricalSections(between) = rings(Point3::new(50.0, 40.0, 0.0), 41.0, 52.0) else {
        panic!("rings")
    };
    let region = Region { between: Some(Sections::CylindricalSections(between)), ..Region::default() };
    let strategy = Strategy::Edge(Edge { line: EdgeLine::Ridge, width: 0.0 });
    let requested = RequestedStrategy { strategy: &strategy, corner_radius: 1.0 };
    let length: f64 =
        RequestedRegion::new(&s, &region, Some(requested)).unwrap().samples(0.25).iter().map(|p| p.length).sum();
    let half = |radius: f64| (radius * radius - 1600.0).sqrt();
    let expected = 2.0 * (half(52.0) - half(41.0));
    assert!((length - expected).abs() < 1.0, "{length} of {expected}");
    let laid = lay_on(&s, &region, &strategy, &LaySettings::default());
    let laid: f64 = laid.passes.iter().map(|p| p.length).sum();
    assert!((laid - expected).abs() < 1.0, "{laid} of {expected}");
}

#[test]
#[ignore = "two million pieces: some seconds, and half a gigabyte"]
fn a_surface_along_the_cylinder_that_bounds_its_region_is_an_error_in_bounded_memory() {
    let s = surface(cylinder(50.0, 100.0, 1.5, 40, 4));
    let Strategy::CylindricalSections(between) = rings(Point3::origin(), 10.0, 50.0) else { panic!("rings") };
    let axis_direction = Vector3::x_axis();
    let between = Sections::CylindricalSections(CylindricalSections { axis_direction, ..between });
    let region = Region { between: Some(between), ..Region::default() };
    let settings = LaySettings { chord_tolerance: 1e-6, ..LaySettings::default() };
    let e = lay_passes(&s, &region, &planes(Vector3::x_axis()), &settings, &|_| 2.0, &Silent).unwrap_err();
    assert!(e.to_string().starts_with("region.between is 50"), "{e}");
}
