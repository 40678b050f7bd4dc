//! Laws of passes along roots: closed forms of planes with and without a fillet.

use std::f64::consts::PI;

use super::prism::Prism;
use super::*;

fn root(line: RootLine, width: f64) -> Strategy {
    Strategy::Root(Root { line, width })
}

fn corner_of(first: &str, second: &str) -> RootLine {
    RootLine::BetweenGroups([first.to_owned(), second.to_owned()])
}

fn ball(corner_radius: f64) -> LaySettings {
    LaySettings { max_step_over: 1.0, corner_radius, ..LaySettings::default() }
}

#[test]
fn the_first_pass_is_the_track_of_the_rolling_ball_and_the_rest_in_the_corner_is_known() {
    let mut rng = Random(9);
    for opening in [60.0f64, 90.0, 120.0].map(f64::to_radians) {
        let r = 3.0;
        let contact = r / (0.5 * opening).tan();
        let prism = Prism::corner(18.0, 0.0, opening, 25.0);
        let motion = rng.motion(200.0);
        let s = surface(prism.mesh(&[18, 18], 12, &["blade", "hub"]).transformed(&motion));
        let laid = lay(&s, &root(corner_of("blade", "hub"), 6.0), &ball(r));
        let corner = laid.corner.unwrap();
        assert!((corner.height - r * (1.0 / (0.5 * opening).sin() - 1.0)).abs() < 1e-6, "{corner:?}");
        assert!((corner.opening - opening).abs() < 1e-6);
        // Seven on the blade, the track among them; six on the hub.
        assert_eq!(laid.passes.len(), 13);
        assert_eq!(laid.passes[0].level, 0.0);
        for (k, pass) in laid.passes.iter().enumerate() {
            let side = if k < 7 { -1.0 } else { 1.0 };
            for cc in &pass.pass.points {
                let way = prism.way(&(motion.inverse() * cc.position)) - 18.0;
                assert!((way * side - contact - pass.level).abs() < 1e-6, "{way} for {} at {opening}", pass.level);
            }
        }
        // The ball at the first pass touches the other plane.
        let hub = Surface::new(s.mesh().select_groups(|g| g == "hub"), s.settings());
        for cc in &laid.passes[0].pass.points {
            let centre = cc.position + cc.normal.into_inner() * r;
            assert!((hub.closest_point(&centre, 10.0).unwrap().distance - r).abs() < 1e-6);
        }
    }
}

#[test]
fn the_region_of_a_root_is_a_band_on_both_sides_of_the_track_down_to_the_corner() {
    for (opening, r) in [(60.0f64, 3.0), (90.0, 2.0), (120.0, 5.0)] {
        let contact = r / (0.5 * opening.to_radians()).tan();
        let prism = Prism::corner(18.0, 0.0, opening.to_radians(), 15.0);
        let s = surface(prism.mesh(&[18, 18], 8, &["blade", "hub"]));
        let (area, samples) = edges::requested(&s, &root(corner_of("blade", "hub"), 4.0), r);
        let wide = contact.min(4.0) + 4.0;
        assert!((area / (2.0 * wide * 15.0) - 1.0).abs() < 0.03, "{opening}: {area}");
        for sample in samples {
            let off = (prism.way(&sample.position) - 18.0).abs() - contact;
            assert!(off.abs() < 4.05, "{opening}: {off}");
        }
        // With a fillet its middle line is where passes begin.
        let rounded = Prism::corner(12.0, 4.0, opening.to_radians(), 15.0);
        let s = surface(rounded.mesh(&[12, 16, 12], 8, &["blade", "fillet", "hub"]));
        let fillet = RootLine::Fillet("fillet".to_owned());
        let (area, _) = edges::requested(&s, &root(fillet, 7.0), 3.0);
        assert!((area / (2.0 * 7.0 * 15.0) - 1.0).abs() < 0.02, "{opening}: {area}");
    }
}

#[test]
fn a_root_needs_no_common_border_and_lies_on_the_side_of_the_region() {
    // The hub reaches through the blade.
    let blade = Prism::corner(18.0, 0.0, 0.5 * PI, 25.0).mesh(&[18, 18], 12, &["blade", "other"]);
    let hub = grid(9, 7, |u, v| {
        // The plane of the second flank, from 7 below the corner.
        let way = -7.0 + 25.0 * u;
        let corner = 18.0 * 0.5f64.sqrt();
        Point3::new(corner + way * 0.5f64.sqrt(), 25.0 * v, -corner + way * 0.5f64.sqrt())
    });
    let blade = blade.select_groups(|g| g == "blade");
    let named = TriMesh::with_groups(
        hub.vertices().to_vec(),
        hub.triangles().to_vec(),
        vec![facemill_surface_model::Group { name: "hub".to_owned(), triangles: 0..hub.triangles().len() }],
    );
    let s = surface(blade.joined(&named.unwrap()));
    let region = Region { groups: Some(vec!["blade".to_owned()]), ..Region::default() };
    let laid = lay_on(&s, &region, &root(corner_of("hub", "blade"), 4.0), &ball(2.5));
    assert_eq!(laid.passes.len(), 5);
    let prism = Prism::corner(18.0, 0.0, 0.5 * PI, 25.0);
    for (pass, cc) in points(&laid) {
        assert!((18.0 - prism.way(&cc.position) - 2.5 - pass.level).abs() < 1e-6);
    }
}

#[test]
fn passes_lie_at_arc_distances_from_the_middle_of_a_fillet() {
    let mut rng = Random(3);
    for opening in [60.0f64, 90.0, 120.0].map(f64::to_radians) {
        let prism = Prism::corner(15.0, 4.0, opening, 30.0);
        let motion = rng.motion(200.0);
        let s = surface(prism.mesh(&[12, 24, 12], 16, &["blade", "fillet", "hub"]).transformed(&motion));
        let laid = lay(&s, &root(RootLine::Fillet("fillet".to_owned()), 8.0), &ball(4.0));
        assert_eq!(laid.passes.len(), 17);
        assert_eq!(laid.corner, None);
        for (pass, cc) in points(&laid) {
            let way = prism.way(&(motion.inverse() * cc.position)) - prism.middle(1);
            assert!((way.abs() - pass.level.abs()).abs() < 0.01, "{way} for {}", pass.level);
        }
        let mut rng = Random(5);
        for _ in 0..300 {
            let way = prism.middle(1) + 8.0 * (2.0 * rng.unit() - 1.0);
            let d = distance_to_passes(&(motion * prism.place(way, 30.0 * rng.unit())), &laid);
            assert!(d <= 0.52, "{d}");
        }
    }
}

#[test]
fn a_cutter_that_does_not_fit_the_fillet_is_refused_with_place_and_radii() {
    let prism = Prism::corner(15.0, 4.0, 1.8, 30.0);
    let s = surface(prism.mesh(&[12, 24, 12], 16, &["blade", "fillet", "hub"]));
    let strategy = root(RootLine::Fillet("fillet".to_owned()), 5.0);
    let lay = |r: f64| lay_passes(&s, &Region::default(), &strategy, &ball(r), &|_| f64::INFINITY, &Silent);
    assert!(lay(3.98).is_ok());
    let e = lay(4.2).unwrap_err();
    let PathError::FilletTooTight { radius, position, corner_radius } = e else { panic!("{e}") };
    assert!((radius - 4.0).abs() < 0.04 && corner_radius == 4.2, "{radius}");
    assert!((prism.way(&position) - prism.middle(1)).abs() < 0.05);
}

#[test]
fn the_tightest_place_of_a_fillet_decides() {
    // Between planes at a right angle along x and z, the radius falls from 5 to 2.5 with y.
    let place = |u: f64, v: f64| {
        let radius = 5.0 - 2.5 * v;
        let flank = 12.0 - radius;
        let (from, to) = (1.0 / 3.0, 2.0 / 3.0);
        let y = 40.0 * v;
        if u <= from {
            Point3::new(0.0, y, 12.0 - 3.0 * u * flank)
        } else if u < to {
            let angle = 0.5 * PI * 3.0 * (u - from);
            Point3::new(radius * (1.0 - angle.cos()), y, radius * (1.0 - angle.sin()))
        } else {
            Point3::new(radius + 3.0 * (u - to) * flank, y, 0.0)
        }
    };
    let columns = 36;
    let (vertices, triangles) = facemill_test_kit::grid_by_columns([columns, 20], |i, j| {
        place(f64::from(i) / f64::from(columns), f64::from(j) / 20.0)
    });
    let n = triangles.len();
    let group = |name: &str, triangles| facemill_surface_model::Group { name: name.to_owned(), triangles };
    let groups = vec![group("wall", 0..n / 3), group("fillet", n / 3..2 * n / 3), group("floor", 2 * n / 3..n)];
    let mesh = TriMesh::with_groups(vertices, triangles, groups).unwrap();
    let normal = mesh.scaled_normal(n - 1);
    let mesh = if normal.z > 0.0 { mesh } else { mesh.reversed() };
    let s = surface(mesh);
    let strategy = root(RootLine::Fillet("fillet".to_owned()), 3.0);
    let lay = |r: f64| lay_passes(&s, &Region::default(), &strategy, &ball(r), &|_| f64::INFINITY, &Silent);
    assert!(lay(2.4).is_ok(), "{:?}", lay(2.4).err());
    let Err(PathError::FilletTooTight { radius, position, .. }) = lay(4.0) else { panic!() };
    assert!((radius - 5.0 + 2.5 * position.y / 40.0).abs() < 0.03 && position.y > 38.0, "{radius} {position}");
}

#[test]
fn a_rounded_edge_is_no_fillet() {
    let mut rng = Random(13);
    for (radius, corner_radius) in [(3.0, 5.0), (8.0, 2.0)] {
        let prism = Prism::rounded(12.0, radius, 1.5, 40.0);
        let mesh = prism.mesh(&[8, 16, 8], 12, &["side", "round", "top"]).transformed(&rng.motion(200.0));
        let (s, region) = (surface(mesh), Region::default());
        let strategy = root(RootLine::Fillet("round".to_owned()), 4.0);
        let e = lay_passes(&s, &region, &strategy, &ball(corner_radius), &|_| f64::INFINITY, &Silent).unwrap_err();
        let text = e.to_string();
        assert!(matches!(e, PathError::NoFillet { .. }), "{text}");
        assert!(text.contains("it is convex at (") && text.contains("strategy edge"), "{text}");
        let requested = RequestedStrategy { strategy: &strategy, corner_radius };
        assert_eq!(RequestedRegion::new(&s, &region, Some(requested)).err(), Some(e));
    }
}

#[test]
fn a_flat_group_is_no_fillet() {
    let flat =
        Prism::new(0.3, &[[12.0, 0.0], [4.0, 0.0], [12.0, 0.0]], 30.0).mesh(&[8, 4, 8], 12, &["blade", "strip", "hub"]);
    let line = RootLine::Fillet("strip".to_owned());
    let (region, strategy) = (Region::default(), root(line, 4.0));
    let e = lay_passes(&surface(flat), &region, &strategy, &ball(2.0), &|_| f64::INFINITY, &Silent).unwrap_err();
    let text = e.to_string();
    assert!(matches!(e, PathError::NoFillet { .. }), "{text}");
    assert!(text.contains("\"strip\"") && text.contains("it is flat") && text.contains("between_groups"), "{text}");
}

#[test]
fn roots_that_are_not_there_are_errors_that_say_what_to_do() {
    let refused = |s: &Surface, region: &Region, line: RootLine| {
        lay_passes(s, region, &root(line, 3.0), &ball(2.0), &|_| f64::INFINITY, &Silent).unwrap_err()
    };
    let all = Region::default();
    let convex = surface(Prism::rounded(10.0, 3.0, 1.5, 40.0).mesh(&[8, 16, 8], 12, &["side", "round", "top"]));
    let e = refused(&convex, &all, corner_of("side", "top"));
    assert!(matches!(e, PathError::NoCorner { .. }) && e.to_string().contains("strategy edge"), "{e}");
    let fillet = surface(Prism::corner(15.0, 4.0, 1.8, 30.0).mesh(&[12, 24, 12], 16, &["blade", "fillet", "hub"]));
    let e = refused(&fillet, &all, corner_of("blade", "hub"));
    assert!(e.to_string().contains("by fillet"), "{e}");
    let e = refused(&fillet, &all, RootLine::Fillet("blade".to_owned()));
    assert!(matches!(e, PathError::NoFillet { .. }) && e.to_string().contains("1 borders with \"fillet\""), "{e}");
    let only = |group: &str| Region { groups: Some(vec![group.to_owned()]), ..Region::default() };
    let e = refused(&fillet, &only("blade"), RootLine::Fillet("fillet".to_owned()));
    assert!(e.to_string().contains("add it to the region"), "{e}");
    let e = refused(&fillet, &only("fillet"), corner_of("blade", "hub"));
    assert!(matches!(e, PathError::RootOutside { .. }), "{e}");
    let e = refused(&fillet, &all, RootLine::Fillet("floor".to_owned()));
    assert!(matches!(e, PathError::UnknownGroup { .. }), "{e}");
}
