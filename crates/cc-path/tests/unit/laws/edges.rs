//! Laws of passes along edges: closed forms of rounded wedges, ellipses and group borders.

use std::f64::consts::TAU;

use super::prism::Prism;
use super::*;

fn edge(line: EdgeLine, width: f64) -> Strategy {
    Strategy::Edge(Edge { line, width })
}

fn between(first: &str, second: &str) -> EdgeLine {
    EdgeLine::BetweenGroups([first.to_owned(), second.to_owned()])
}

fn even_steps(step: f64) -> LaySettings {
    LaySettings { max_step_over: step, ..LaySettings::default() }
}

/// Ways of the passes' points along the profile lie at these distances from a way, within
/// `tolerance`.
fn assert_at(prism: &Prism, laid: &PassLayout, back: &Isometry3<f64>, line: f64, tolerance: f64) {
    let mut sign = 0.0;
    for (pass, cc) in points(laid) {
        let way = prism.way(&(back * cc.position)) - line;
        // Which side of a ridge is left follows from the mesh.
        if sign == 0.0 && pass.level.abs() > 0.1 {
            sign = way.signum() * pass.level.signum();
        }
        let level = if sign == 0.0 { pass.level } else { pass.level * sign };
        assert!(
            (way - level).abs() <= tolerance || (way + level).abs() <= tolerance && sign == 0.0,
            "{way} for {level}"
        );
    }
    assert!(sign != 0.0);
}

/// Every place of the strip is within half of it of a pass.
fn assert_covered(prism: &Prism, laid: &PassLayout, line: f64, width: f64, strip: f64) {
    let mut rng = Random(31);
    for _ in 0..400 {
        let p = prism.place(line + width * (2.0 * rng.unit() - 1.0), prism.depth * rng.unit());
        let d = distance_to_passes(&p, laid);
        assert!(d <= 0.5 * strip * 1.01 + 0.02, "{p} is {d} mm from the nearest pass");
    }
}

#[test]
fn passes_lie_at_arc_distances_from_the_ridge_of_a_rounded_wedge_in_any_position() {
    let mut rng = Random(7);
    for turn_deg in [60.0, 100.0, 140.0, 180.0f64] {
        let prism = Prism::rounded(9.0, 1.5, turn_deg.to_radians(), 30.0);
        let motion = rng.motion(200.0);
        let mesh = prism.mesh(&[12, 24, 12], 20, &["left", "nose", "right"]).transformed(&motion);
        let laid = lay(&surface(mesh), &edge(EdgeLine::Ridge, 6.0), &even_steps(1.0));
        assert_eq!(laid.passes.len(), 13, "{turn_deg}");
        assert_eq!((laid.n_wide_strips, laid.n_dropped_pieces), (0, 0));
        assert!((laid.largest_step_over - 1.0).abs() < 1e-9);
        assert_at(&prism, &laid, &motion.inverse(), prism.middle(1), 0.01);
        // Between two edges of the mesh a pass can be short, and its chord there lean by more than
        // the pass does: 2.1° is the most that was found.
        for (_, cc) in points(&laid) {
            let along = motion * Vector3::y();
            let lean = cc.feed.dot(&along).abs().min(1.0).acos().to_degrees();
            assert!(lean < 3.0, "{turn_deg}: {lean}");
        }
        // From end to end.
        assert!(laid.passes.iter().all(|p| (p.length - 30.0).abs() < 0.01));
    }
}

#[test]
fn every_place_of_the_strip_is_within_half_a_strip_of_a_pass() {
    let prism = Prism::rounded(12.0, 2.0, 2.0, 25.0);
    let s = surface(prism.mesh(&[14, 20, 14], 15, &["left", "nose", "right"]));
    let laid = lay(&s, &edge(EdgeLine::Ridge, 9.0), &even_steps(0.8));
    assert_covered(&prism, &laid, prism.middle(1), 9.0, 0.8);
}

/// Area of the region that a strategy is requested on, and its samples.
pub(super) fn requested(s: &Surface, strategy: &Strategy, corner_radius: f64) -> (f64, Vec<RegionSample>) {
    let (region, strategy) = (Region::default(), RequestedStrategy { strategy, corner_radius });
    let samples = RequestedRegion::new(s, &region, Some(strategy)).expect("a line").samples(0.02);
    (samples.iter().map(|sample| sample.area).sum(), samples)
}

#[test]
fn the_region_of_an_edge_is_the_band_of_its_width_along_the_surface() {
    let mut rng = Random(23);
    for turn_deg in [60.0, 120.0, 150.0, 180.0f64] {
        let prism = Prism::rounded(9.0, 1.5, turn_deg.to_radians(), 20.0);
        let motion = rng.motion(200.0);
        let s = surface(prism.mesh(&[9, 24, 9], 11, &["left", "nose", "right"]).transformed(&motion));
        let back = motion.inverse();
        // On one side of a border between groups the band is as wide as on the other. From the
        // border to the far flank the surface turns by all of the angle: distances over half a turn
        // are not claimed.
        let mut lines = vec![(EdgeLine::Ridge, prism.middle(1))];
        if turn_deg < 180.0 {
            lines.push((between("left", "nose"), 9.0));
        }
        for (line, way) in lines {
            let (area, samples) = requested(&s, &edge(line.clone(), 5.0), 0.0);
            let offs = samples.iter().map(|sample| (prism.way(&(back * sample.position)) - way).abs());
            let off = offs.fold(0.0, f64::max);
            let share = area / (2.0 * 5.0 * 20.0);
            assert!(off < 5.01 && (share - 1.0).abs() < 0.02, "{line:?} {turn_deg}: {off} {area}");
        }
    }
}

#[test]
fn the_region_of_an_edge_without_width_is_its_line_by_length() {
    let mut rng = Random(29);
    let prism = Prism::rounded(9.0, 1.5, 2.0, 20.0);
    let motion = rng.motion(200.0);
    let s = surface(prism.mesh(&[9, 24, 9], 11, &["left", "nose", "right"]).transformed(&motion));
    let back = motion.inverse();
    for (line, way) in [(EdgeLine::Ridge, prism.middle(1)), (between("left", "nose"), 9.0)] {
        let strategy = edge(line, 0.0);
        let region = Region::default();
        let requested = RequestedStrategy { strategy: &strategy, corner_radius: 0.0 };
        let requested = RequestedRegion::new(&s, &region, Some(requested)).expect("a line");
        for area_each in [0.25, 1e-4] {
            let samples = requested.samples(area_each);
            assert!(samples.len() as f64 >= 20.0 / area_each.sqrt() - 1.0 && samples.iter().all(|s| s.area == 0.0));
            let length: f64 = samples.iter().map(RegionSample::weight).sum();
            assert!((length - 20.0).abs() < 0.02, "{length}");
            let mut places: Vec<f64> = samples.iter().map(|sample| (back * sample.position).y).collect();
            places.sort_by(f64::total_cmp);
            let gap =
                places.windows(2).map(|w| w[1] - w[0]).fold(places[0].max(20.0 - places[places.len() - 1]), f64::max);
            assert!(gap < 1.01 * area_each.sqrt(), "{gap}");
            for sample in &samples {
                let off = prism.way(&(back * sample.position)) - way;
                assert!(off.abs() < 0.02 && s.closest_point(&sample.position, 1e-9).is_some(), "{off}");
                let aside = sample.position + motion * Vector3::x() * 0.01;
                let foot = s.closest_point(&aside, 1.0).unwrap();
                assert!(!requested.contains(foot.triangle, &foot.position));
            }
        }
    }
}

#[test]
fn a_box_bounds_an_edge_without_width() {
    let s = surface(Prism::rounded(9.0, 1.5, 2.0, 20.0).mesh(&[9, 24, 9], 11, &["left", "nose", "right"]));
    let (min, max) = (Point3::new(-100.0, 4.0, -100.0), Point3::new(100.0, 11.0, 100.0));
    let region = Region { bounds: Some(Aabb { min, max }), ..Region::default() };
    let strategy = edge(EdgeLine::Ridge, 0.0);
    let requested = RequestedStrategy { strategy: &strategy, corner_radius: 0.0 };
    let samples = RequestedRegion::new(&s, &region, Some(requested)).expect("a line").samples(0.01);
    let length: f64 = samples.iter().map(RegionSample::weight).sum();
    assert!((length - 7.0).abs() < 0.02 && samples.iter().all(|s| (4.0..=11.0).contains(&s.position.y)), "{length}");
}

#[test]
fn passes_lie_at_distances_from_the_border_of_a_rounded_box_edge() {
    let prism = Prism::rounded(10.0, 3.0, 0.5 * std::f64::consts::PI, 40.0);
    let mesh = prism.mesh(&[8, 16, 8], 12, &["side", "round", "top"]);
    for (line, way, sign) in [
        (between("side", "round"), prism.start(1), 1.0),
        (between("round", "side"), prism.start(1), -1.0),
        (between("round", "top"), prism.start(2), 1.0),
    ] {
        let laid = lay(&surface(mesh.clone()), &edge(line, 4.0), &even_steps(0.5));
        assert_eq!(laid.passes.len(), 17);
        for (pass, cc) in points(&laid) {
            let off = sign * (prism.way(&cc.position) - way) - pass.level;
            assert!(off.abs() < 0.005, "{off}");
        }
        assert_covered(&prism, &laid, way, 4.0, 0.5);
    }
}

#[test]
fn passes_lie_on_one_side_where_the_region_does() {
    let prism = Prism::rounded(10.0, 3.0, 0.5 * std::f64::consts::PI, 40.0);
    let s = surface(prism.mesh(&[8, 16, 8], 12, &["side", "round", "top"]));
    let region = Region { groups: Some(vec!["top".to_owned()]), ..Region::default() };
    let laid = lay_on(&s, &region, &edge(between("round", "top"), 4.0), &even_steps(1.0));
    assert_eq!(laid.passes.len(), 5);
    for (pass, cc) in points(&laid) {
        let off = prism.way(&cc.position) - prism.start(2) - pass.level;
        assert!(off.abs() < 0.005, "{off}");
    }
}

#[test]
fn strips_follow_the_width_allowed_across_the_edge() {
    let prism = Prism::rounded(10.0, 2.0, 2.0, 20.0);
    let s = surface(prism.mesh(&[20, 24, 20], 10, &["left", "nose", "right"]));
    let nose = 2.0 * 2.0 * 0.5;
    let allowed =
        |cc: &CcPoint| if (prism.way(&cc.position) - prism.middle(1)).abs() < nose + 0.01 { 0.4 } else { 2.0 };
    let settings = LaySettings { even: false, ..even_steps(2.0) };
    let laid = lay_passes(&s, &Region::default(), &edge(EdgeLine::Ridge, 8.0), &settings, &allowed, &Silent).unwrap();
    let mut levels: Vec<f64> = laid.passes.iter().map(|p| p.level).collect();
    levels.sort_by(f64::total_cmp);
    for w in levels.windows(2) {
        let inner = w[0].abs().min(w[1].abs());
        assert!(w[1] - w[0] <= if inner < nose - 0.01 { 0.4 } else { 2.0 } + 1e-9, "{w:?}");
    }
    // Narrow across the nose and the facets beside it alone: 12 to 14 strips there, and 3 on each
    // flank.
    assert!((19..=21).contains(&levels.len()), "{levels:?}");
}

#[test]
fn both_edges_of_an_elliptic_blade_are_found_at_its_vertices() {
    let (a, b, height) = (20.0, 3.0, 30.0);
    let mesh = grid(240, 16, |u, v| {
        // The seam is on the suction side, and no column of vertices at the vertices of the
        // ellipse.
        let angle = -std::f64::consts::TAU * (u + 0.2501);
        let twist = 0.2 * v;
        let (x, y) = (a * angle.cos(), b * angle.sin());
        Point3::new(x * twist.cos() - y * twist.sin(), x * twist.sin() + y * twist.cos(), height * v)
    });
    let mesh = mesh.reversed();
    let s = surface(mesh);
    let laid = lay(&s, &edge(EdgeLine::Ridge, 2.0), &even_steps(0.5));
    let middle: Vec<&LaidPass> = laid.passes.iter().filter(|p| p.level == 0.0).collect();
    assert_eq!(middle.len(), 2);
    assert_eq!(laid.passes.len(), 18);
    let mut ends = [false; 2];
    for pass in middle {
        assert!(pass.length > 30.0);
        for cc in &pass.pass.points {
            let twist = -0.2 * cc.position.z / height;
            let x = cc.position.x * twist.cos() - cc.position.y * twist.sin();
            let y = cc.position.x * twist.sin() + cc.position.y * twist.cos();
            // The facets are 0.08 mm wide there.
            assert!(y.abs() < 0.04 && x.abs() > a - 0.01, "{x} {y}");
            ends[usize::from(x > 0.0)] = true;
        }
    }
    assert_eq!(ends, [true, true]);
}

#[test]
fn a_rim_is_one_closed_pass_with_passes_on_both_sides() {
    // A disc of radius 20 whose rim is rounded by 1.
    let prism = Prism::rounded(6.0, 1.0, std::f64::consts::PI, 1.0);
    let ways = 6.0 + std::f64::consts::PI + 6.0;
    let profile = |u: f64| {
        let p = prism.place(ways * u.min(1.0 - 1e-12), 0.0);
        (p.x, p.z)
    };
    // The heading of the first flank is +z and the nose is its top: that is the rim.
    let mesh = grid(90, 120, |u, v| {
        let (x, z) = profile(u);
        let angle = std::f64::consts::TAU * v;
        Point3::new((14.0 + z) * angle.cos(), (14.0 + z) * angle.sin(), x)
    });
    // Both ends of the turn are the same vertices.
    let rounded = |v: u32| mesh.vertices()[v as usize].coords.map(|c| (c * 1e6).round() as i64);
    let key = |v: u32| <[i64; 3]>::from(rounded(v));
    let n = mesh.vertices().len() as u32;
    let first: std::collections::BTreeMap<[i64; 3], u32> = (0..n).rev().map(|v| (key(v), v)).collect();
    let weld = |v: u32| first[&key(v)];
    let triangles = mesh.triangles().iter().map(|t| t.map(weld)).collect();
    let mesh = TriMesh::new(mesh.vertices().to_vec(), triangles).unwrap();
    let outward = |m: &TriMesh| m.scaled_normal(45 * 240).dot(&m.corners(45 * 240)[0].coords) > 0.0;
    let mesh = if outward(&mesh) { mesh } else { mesh.reversed() };
    let laid = lay(&surface(mesh), &edge(EdgeLine::Ridge, 3.0), &even_steps(0.5));
    assert_eq!(laid.passes.len(), 13);
    assert!(laid.passes.iter().all(|p| p.closed));
    for (pass, cc) in points(&laid) {
        let ring = Point3::new(cc.position.z, 0.0, cc.position.x.hypot(cc.position.y) - 14.0);
        let way = prism.way(&ring) - prism.middle(1);
        // The rim's facets are 0.007 mm off along it.
        assert!((way.abs() - pass.level.abs()).abs() < 0.03, "{way} {}", pass.level);
    }
}

#[test]
fn a_sharp_edge_is_a_ridge() {
    let parts = [[8.0, 0.0], [1e-9, 1.5], [8.0, 0.0]];
    let prism = Prism::new(0.75, &parts, 20.0);
    let flanks = prism.mesh(&[8, 1, 8], 10, &["left", "nose", "right"]);
    // Without the nose, both flanks meet in a crease.
    let n_along = 11;
    let weld = |v: u32| if v / n_along == 9 { v - n_along } else { v };
    let triangles: Vec<[u32; 3]> = flanks.triangles().iter().map(|t| t.map(weld)).collect();
    let kept = triangles.into_iter().filter(|[a, b, c]| a != b && b != c && c != a).collect();
    let mesh = TriMesh::new(flanks.vertices().to_vec(), kept).unwrap();
    let laid = lay(&surface(mesh), &edge(EdgeLine::Ridge, 5.0), &even_steps(1.0));
    assert_eq!(laid.passes.len(), 11);
    assert_at(&prism, &laid, &Isometry3::identity(), 8.0, 0.01);
}

#[test]
fn ridges_are_the_same_on_one_thread_and_on_three() {
    let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 500.0).unwrap();
    let s = surface(blade(&spec, BladeResolution::new(12, 18).unwrap()));
    let on = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| lay(&s, &edge(EdgeLine::Ridge, 4.0), &even_steps(4.0)))
    };
    let (one, three) = (on(1), on(3));
    // Both edges of the blade, from the root to the tip, are among them.
    let long = one.passes.iter().filter(|p| p.level == 0.0 && p.length > 150.0).count();
    assert!(long >= 2, "{long}");
    assert_eq!(one, three);
}

/// So many wedges beside each other, each with one ridge.
fn wedges(n: usize) -> TriMesh {
    let wedge = Prism::rounded(4.0, 1.0, 1.5, 20.0).mesh(&[3, 6, 3], 8, &["left", "nose", "right"]);
    let at = |k: usize| {
        let place = Vector3::new(12.0 * (k % 9) as f64, 25.0 * (k / 9) as f64, 0.0);
        wedge.transformed(&Isometry3::translation(place.x, place.y, place.z))
    };
    (1..n).fold(at(0), |all, k| all.joined(&at(k)))
}

#[test]
fn no_ridge_beyond_the_largest_number_is_dropped_silently() {
    let strategy = edge(EdgeLine::Ridge, 0.0);
    let lay = |n: usize| {
        lay_passes(&surface(wedges(n)), &Region::default(), &strategy, &even_steps(1.0), &|_| f64::INFINITY, &Silent)
    };
    assert_eq!(lay(64).unwrap().passes.len(), 64);
    let e = lay(65).unwrap_err();
    let text = e.to_string();
    assert!(text.contains("more than 64 ridges") && text.contains("bound the region"), "{text}");
    assert!(text.contains("between_groups"), "{text}");
    // The requested region does not shrink to what is found.
    let (s, region) = (surface(wedges(65)), Region::default());
    let requested = RequestedStrategy { strategy: &strategy, corner_radius: 0.0 };
    assert_eq!(RequestedRegion::new(&s, &region, Some(requested)).err(), Some(e));
}

#[test]
fn a_ridge_is_found_behind_thousands_of_sharper_places_that_are_none() {
    let prism = Prism::rounded(60.0, 8.0, 1.5, 100.0);
    let round = cylinder(5.0, 90.0, 1.3, 60, 60).transformed(&Isometry3::translation(0.0, 200.0, 0.0));
    let s = surface(prism.mesh(&[12, 16, 12], 16, &["left", "nose", "right"]).joined(&round));
    let laid = lay(&s, &edge(EdgeLine::Ridge, 0.0), &even_steps(4.0));
    assert_eq!(laid.passes.len(), 1);
    assert!((laid.passes[0].length - 100.0).abs() < 0.1, "{}", laid.passes[0].length);
}

#[test]
fn a_region_that_bends_in_too_many_places_is_refused_with_the_limit() {
    let n = 34.0;
    let bumps = grid(272, 272, |u, v| {
        let height = 1.2 * (TAU * n * u).sin() * (TAU * n * v).sin();
        Point3::new(10.0 * n * u, 10.0 * n * v, height)
    });
    let strategy = edge(EdgeLine::Ridge, 1.0);
    let laid =
        lay_passes(&surface(bumps), &Region::default(), &strategy, &even_steps(10.0), &|_| f64::INFINITY, &Silent);
    let e = laid.unwrap_err();
    let text = e.to_string();
    assert!(text.contains("more than 2000 places") && text.contains("bound the region"), "{text}");
}

#[test]
fn edges_that_are_not_there_are_errors_that_say_what_to_do() {
    let refused = |s: &Surface, region: &Region, strategy: &Strategy| {
        lay_passes(s, region, strategy, &even_steps(1.0), &|_| f64::INFINITY, &Silent).unwrap_err()
    };
    let all = Region::default();
    for mesh in [cylinder(5.0, 30.0, 1.3, 20, 30), plane(20.0, 20.0, 4, 4), sphere_patch(10.0, 0.8, 20)] {
        let e = refused(&surface(mesh), &all, &edge(EdgeLine::Ridge, 3.0));
        assert!(matches!(e, PathError::NoRidge { .. }) && e.to_string().contains("between_groups"), "{e}");
    }
    let prism = Prism::rounded(10.0, 3.0, 1.5, 40.0);
    let s = surface(prism.mesh(&[8, 16, 8], 12, &["side", "round", "top"]));
    let e = refused(&s, &all, &edge(between("side", "top"), 3.0));
    assert!(matches!(e, PathError::NoGroupBorder { .. }) && e.to_string().contains("borders on \"round\""), "{e}");
    let e = refused(&s, &all, &edge(between("side", "bottom"), 3.0));
    assert!(matches!(e, PathError::UnknownGroup { .. }), "{e}");
    let e = refused(&s, &all, &edge(between("side", "side"), 3.0));
    assert!(matches!(e, PathError::SameGroup { .. }), "{e}");
    let e = refused(&s, &all, &edge(EdgeLine::Ridge, f64::NAN));
    assert!(matches!(e, PathError::Setting { .. }), "{e}");
}
