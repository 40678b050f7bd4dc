//! Laws of fronts of constant scallop.

use std::f64::consts::{PI, TAU};

use facemill_surface_model::Group;

use super::*;

fn scallop(seeds: Vec<Seed>) -> Strategy {
    Strategy::ConstantScallop(ConstantScallop { seeds, within: None })
}

fn at_plane(origin: Point3<f64>, normal: Vector3<f64>) -> Seed {
    Seed::Plane { origin, normal: Unit::new_normalize(normal) }
}

fn settings(max_step_over: f64) -> LaySettings {
    LaySettings { max_step_over, chord_tolerance: 0.002, max_step: 2.0, ..LaySettings::default() }
}

type Width<'a> = &'a (dyn Fn(&CcPoint) -> f64 + Sync);

fn lay_by(s: &Surface, strategy: &Strategy, settings: &LaySettings, width: Width) -> PassLayout {
    lay_passes(s, &Region::default(), strategy, settings, width, &Silent).unwrap()
}

fn length(laid: &PassLayout) -> f64 {
    laid.passes.iter().map(|p| p.length).sum()
}

/// The largest distance of a place of the surface from the nearest pass, over half the width
/// allowed there; places are spread over all triangles by area.
fn worst_reach(s: &Surface, laid: &PassLayout, n: usize, width: impl Fn(&Point3<f64>) -> f64) -> (f64, f64) {
    let mut rng = Random(7);
    let n_triangles = s.mesh().triangles().len();
    let (mut worst, mut n_open, mut n_tried) = (0.0f64, 0, 0);
    let largest = (0..n_triangles).map(|t| s.mesh().scaled_normal(t).norm()).fold(0.0, f64::max);
    while n_tried < n {
        let t = ((rng.unit() * n_triangles as f64) as usize).min(n_triangles - 1);
        if rng.unit() * largest > s.mesh().scaled_normal(t).norm() {
            continue;
        }
        let (u, v) = (rng.unit().sqrt(), rng.unit());
        let p = s.point(t as u32, [1.0 - u, u * (1.0 - v), u * v]).position;
        let reach = distance_to_passes(&p, laid) / (0.5 * width(&p));
        worst = worst.max(reach);
        n_open += usize::from(reach > 1.03);
        n_tried += 1;
    }
    (worst, n_open as f64 / n as f64)
}

/// Distances of neighbouring passes as a coordinate across them gives them.
fn steps_by(laid: &PassLayout, across: impl Fn(&Point3<f64>) -> f64) -> Vec<f64> {
    let mean = |p: &LaidPass| {
        let n = p.pass.points.len() as f64;
        p.pass.points.iter().map(|cc| across(&cc.position)).sum::<f64>() / n
    };
    let mut at: Vec<f64> = laid.passes.iter().map(mean).collect();
    at.sort_by(f64::total_cmp);
    at.windows(2).map(|w| w[1] - w[0]).collect()
}

/// Largest spread of the coordinate across passes within one of them.
fn noise_by(laid: &PassLayout, across: impl Fn(&Point3<f64>) -> f64) -> f64 {
    let spread = |p: &LaidPass| {
        let at = || p.pass.points.iter().map(|cc| across(&cc.position));
        at().fold(f64::NEG_INFINITY, f64::max) - at().fold(f64::INFINITY, f64::min)
    };
    laid.passes.iter().map(spread).fold(0.0, f64::max)
}

#[test]
fn spacing_on_ramps_is_that_on_the_flat() {
    for slope in [0.0f64, 30.0, 45.0] {
        let (sin, cos) = slope.to_radians().sin_cos();
        // Stretched 4:1 and skewed.
        let s = surface(grid(80, 25, |u, v| {
            let along = 100.0 * v + 3.0 * (11.0 * u).sin() * v * (1.0 - v);
            Point3::new(80.0 * u, along * cos, along * sin)
        }));
        let strategy = scallop(vec![at_plane(Point3::new(0.0, 1e-6, 0.0), Vector3::y())]);
        let laid = lay_by(&s, &strategy, &settings(8.0), &|_| 8.0);
        let up = |p: &Point3<f64>| p.y * cos + p.z * sin;
        let steps = steps_by(&laid, up);
        assert_eq!(laid.passes.len(), 13, "{slope}: {steps:?}");
        for step in &steps {
            assert!((step / 8.0 - 1.0).abs() < 1e-3, "{slope}: {steps:?}");
        }
        assert!(noise_by(&laid, up) < 0.02, "{}", noise_by(&laid, up));
        let (worst, _) = worst_reach(&s, &laid, 500, |_| 8.0);
        assert!(worst < 1.01, "{worst}");
    }
}

#[test]
fn fronts_on_cylinder_cone_sphere_and_torus_are_parallel_circles() {
    let around = |n: u32, m: u32, turn: f64, place: &dyn Fn(f64) -> (f64, f64)| {
        let (turn, place) = (turn, place);
        surface(grid(n, m, |u, v| {
            let (radius, z) = place(v);
            let angle = turn * (u + 0.2 / f64::from(n) * (40.0 * v).sin() * u * (1.0 - u));
            Point3::new(radius * angle.cos(), radius * angle.sin(), z)
        }))
    };
    // Name, profile, way along it, length of the profile, squares around for a stretch of 4:1.
    type Profile = (&'static str, fn(f64) -> (f64, f64), fn(&Point3<f64>) -> f64, f64, u32);
    let profiles: [Profile; 4] = [
        ("cylinder", |v| (40.0, 60.0 * v), |p| p.z, 60.0, 40),
        ("cone", |v| (60.0 - 36.0 * v, 48.0 * v), |p| p.z / 0.8, 60.0, 42),
        (
            "sphere",
            |v| (60.0 * (0.2 + v).cos(), 60.0 * ((0.2 + v).sin() - 0.2f64.sin())),
            |p| 60.0 * ((p.z / 60.0 + 0.2f64.sin()).asin() - 0.2),
            60.0,
            46,
        ),
        (
            "torus",
            |v| (80.0 + 30.0 * (2.0 * v - 1.0).cos(), 30.0 * ((2.0 * v - 1.0).sin() + 1f64.sin())),
            |p| 30.0 * ((p.z / 30.0 - 1f64.sin()).asin() + 1.0),
            60.0,
            105,
        ),
    ];
    for (name, place, way, span, n_around) in profiles {
        let s = around(n_around, 120, 2.0, &place);
        let strategy = scallop(vec![at_plane(Point3::new(0.0, 0.0, 1e-6), Vector3::z())]);
        let laid = lay_by(&s, &strategy, &settings(7.0), &|_| 7.0);
        let steps = steps_by(&laid, way);
        assert!((laid.passes.len() as f64 - 1.0) * 7.0 >= span - 3.6, "{name}: {steps:?}");
        // The last pass lies a quarter of a strip before the border.
        for step in &steps[..steps.len() - 1] {
            assert!((step / 7.0 - 1.0).abs() < 0.005, "{name}: {steps:?}");
        }
        assert!(noise_by(&laid, way) < 0.02, "{name}: {}", noise_by(&laid, way));
    }
}

#[test]
fn loops_of_a_cylinder_leave_the_cusp_of_a_ball_within_one_percent() {
    // Zou, Wang, Feng 2020, figure 2: R 2.5, L 10, ball r 5, cusp 0.05; 8 loops of 125.6 mm there.
    let (radius, ball, cusp): (f64, f64, f64) = (2.5, 5.0, 0.05);
    let s = surface(grid(90, 60, |u, v| {
        let turn = TAU * u;
        Point3::new(radius * turn.cos(), radius * turn.sin(), 10.0 * v)
    }));
    // Rulings are straight across the loops: two balls a width apart meet a cusp above the surface.
    let width = 2.0 * (2.0 * ball * cusp - cusp * cusp).sqrt();
    let strategy = scallop(vec![at_plane(Point3::new(0.0, 0.0, 0.5 * width), Vector3::z())]);
    let laid = lay_by(&s, &strategy, &settings(width), &|_| width);
    let steps = steps_by(&laid, |p| p.z);
    for step in &steps[..steps.len() - 1] {
        let left = ball - (ball * ball - 0.25 * step * step).sqrt();
        assert!((left / cusp - 1.0).abs() < 0.01, "{steps:?}");
    }
    // A region of 7.09 widths takes eight loops, of the polygon that the mesh has around.
    let loops = length(&laid) / (2.0 * PI * radius);
    assert!((loops - 8.0).abs() < 0.01, "{loops}");
    let (worst, _) = worst_reach(&s, &laid, 1000, |_| width);
    assert!(worst < 1.01, "{worst}");
}

#[test]
fn fronts_follow_a_width_that_changes_along_them() {
    let s = surface(grid(80, 60, |u, v| Point3::new(120.0 * u, 90.0 * v, 0.0)));
    let at = |p: &Point3<f64>| 5.0 - 2.0 * (p.x / 120.0 * PI).cos();
    let strategy = scallop(vec![at_plane(Point3::new(0.0, 1e-6, 0.0), Vector3::y())]);
    let laid = lay_by(&s, &strategy, &settings(8.0), &|cc| at(&cc.position));
    let (worst, open) = worst_reach(&s, &laid, 1000, at);
    assert!(worst < 1.1 && open < 0.005, "{worst} {open}");
    // Levels take a pass for every 3 mm: 3.7 m.
    assert!(length(&laid) < 3000.0, "{}", length(&laid));
    for (_, [a, b]) in gaps(&laid) {
        assert!(a.feed.dot(&b.feed) > 0.98, "{} to {}", a.position, b.position);
    }
}

#[test]
fn two_seeds_meet_at_a_ridge_that_gets_a_pass() {
    let s = surface(grid(60, 60, |u, v| Point3::new(60.0 * u, 60.0 * v, 0.0)));
    let seeds = vec![
        at_plane(Point3::new(0.0, 1e-6, 0.0), Vector3::y()),
        at_plane(Point3::new(0.0, 60.0 - 1e-6, 0.0), Vector3::new(0.1, 1.0, 0.0)),
    ];
    let laid = lay_by(&s, &scallop(seeds), &LaySettings { min_pass_length: 3.0, ..settings(7.0) }, &|_| 7.0);
    let (worst, open) = worst_reach(&s, &laid, 1200, |_| 7.0);
    assert!(open < 0.01, "{worst} {open}");
    assert!(length(&laid) < 1.35 * 60.0 * 60.0 / 7.0, "{}", length(&laid));
}

#[test]
fn a_border_is_the_seed_of_loops_that_cover_the_region() {
    let s = surface(grid(60, 60, |u, v| Point3::new(60.0 * u, 45.0 * v, 2.0 * (4.0 * u).sin())));
    let laid =
        lay_by(&s, &scallop(vec![Seed::Border]), &LaySettings { min_pass_length: 3.0, ..settings(5.0) }, &|_| 5.0);
    let (worst, open) = worst_reach(&s, &laid, 1200, |_| 5.0);
    assert!(open < 0.02 && worst < 2.0, "{worst} {open}");
    let share = laid.uncovered_area / (60.0 * 45.0);
    assert!(share < 0.02, "{share}");
    // The first loop lies half a strip inside of one side all along, at its end beyond the corner
    // too; it may cut the corner by a triangle.
    let is_beside = |p: &Point3<f64>| [p.x, 60.0 - p.x, p.y, 45.0 - p.y].iter().any(|d| (d - 2.5).abs() < 0.4);
    assert!(laid.passes[0].pass.points.iter().all(|cc| is_beside(&cc.position)));
}

#[test]
fn a_square_is_cut_in_squares_that_leave_nothing_at_their_corners() {
    for (n, width) in [(60, 5.0), (61, 4.3), (97, 5.0), (40, 6.0)] {
        let s = surface(grid(n, n, |u, v| Point3::new(100.0 * u, 100.0 * v, 2.0 * (4.0 * u).sin())));
        let settings = LaySettings { min_pass_length: 3.0, ..settings(width) };
        let laid = lay_by(&s, &scallop(vec![Seed::Border]), &settings, &|_| width);
        // Four sides to a loop, and what is left in the middle.
        let n_loops = (50.0 / width).ceil() as usize;
        assert!(laid.passes.len() <= 4 * n_loops, "{n} {width}: {}", laid.passes.len());
        // Each side goes on for half a strip at its end.
        let area: f64 = (0..s.mesh().triangles().len()).map(|t| 0.5 * s.mesh().scaled_normal(t).norm()).sum();
        let most = 1.02 * area / width + 4.0 * n_loops as f64 * 0.5 * width;
        assert!(length(&laid) < most, "{n} {width}: {} {most}", length(&laid));
        let (worst, open) = worst_reach(&s, &laid, 4000, |_| width);
        assert!(open < 1e-3, "{n} {width}: {worst} {open}");
        assert!(laid.uncovered_area < 1e-3 * area, "{n} {width}: {}", laid.uncovered_area);
    }
}

#[test]
fn nothing_is_left_within_a_circle_that_is_the_seed() {
    let (axis_origin, axis_direction) = (Point3::new(20.0, 20.0, 0.0), Vector3::z_axis());
    for (n, radius, width) in [(40, 12.0, 10.0), (60, 12.0, 5.0), (31, 17.0, 7.0), (50, 9.0, 4.3)] {
        let s = surface(plane(40.0, 40.0, n, n));
        let strategy = scallop(vec![Seed::Cylinder { axis_origin, axis_direction, radius }]);
        let laid = lay_by(&s, &strategy, &settings(width), &|_| width);
        let mut rng = Random(5);
        for _ in 0..1000 {
            let (sin, cos) = (TAU * rng.unit()).sin_cos();
            let p = axis_origin + Vector3::new(cos, sin, 0.0) * (radius * rng.unit().sqrt());
            let apart = distance_to_passes(&p, &laid);
            assert!(apart < 1.02 * 0.5 * width, "{n} {radius} {width}: {apart} mm at {p}");
        }
    }
}

#[test]
fn the_border_with_a_group_is_a_seed() {
    let mesh = grid(60, 20, |u, v| Point3::new(60.0 * u, 20.0 * v, 0.0));
    let is_left = |t: &[u32; 3]| t.iter().all(|&v| mesh.vertices()[v as usize].x < 30.5);
    let (left, right): (Vec<[u32; 3]>, Vec<[u32; 3]>) = mesh.triangles().iter().partition(|t| is_left(t));
    let group = |name: &str, triangles| Group { name: name.to_owned(), triangles };
    let groups = vec![group("blade", 0..left.len()), group("hub", left.len()..left.len() + right.len())];
    let s = surface(TriMesh::with_groups(mesh.vertices().to_vec(), [left, right].concat(), groups).unwrap());
    let strategy = scallop(vec![Seed::GroupBorder("hub".to_owned())]);
    // From a step of 4 on, edges of the border are halved.
    for step in [4.0, 3.9, 1.0] {
        let lay = |region: Region| lay_on(&s, &region, &strategy, &settings(step));
        let laid = lay(Region { groups: Some(vec!["blade".to_owned()]), ..Region::default() });
        // Half a strip beside x = 30, then strip by strip.
        let xs: Vec<f64> = laid.passes.iter().map(|p| p.pass.points[0].position.x).collect();
        assert_eq!(xs.len(), (30.0 / step + 0.5) as usize, "{xs:?}");
        for (k, x) in xs[..xs.len() - 1].iter().enumerate() {
            assert!((x - (30.0 - step * (0.5 + k as f64))).abs() < 1e-6, "{step}: {xs:?}");
        }
        assert!(laid.passes[..xs.len() - 1].iter().all(|p| (p.length - 20.0).abs() < 1e-6), "{step}");
        // Inside a region of both groups, the border of the group itself.
        let laid = lay(Region::default());
        let beside = 0.5 * step - 0.1;
        assert!(laid.passes.iter().all(|p| (p.pass.points[0].position.x - 30.0).abs() > beside), "{step}");
    }
}

#[test]
fn the_border_with_a_group_is_a_seed_from_end_to_end_where_some_edges_are_halved_and_nothing_is_welded() {
    // Rows of 0.5 mm beside rows of 3 mm; of the groups, each has vertices of its own.
    let y = |v: f64| if v < 0.5 { 8.0 * v } else { 4.0 + 48.0 * (v - 0.5) };
    let part = |name: &str, from: f64| {
        let mesh = grid(10, 16, |u, v| Point3::new(from + 30.0 * u, y(v), 0.0));
        let all = 0..mesh.triangles().len();
        let groups = vec![Group { name: name.to_owned(), triangles: all }];
        TriMesh::with_groups(mesh.vertices().to_vec(), mesh.triangles().to_vec(), groups).unwrap()
    };
    let s = surface(part("blade", 0.0).joined(&part("hub", 30.0)));
    let region = Region { groups: Some(vec!["blade".to_owned()]), ..Region::default() };
    let laid = lay_on(&s, &region, &scallop(vec![Seed::GroupBorder("hub".to_owned())]), &settings(4.0));
    let first = &laid.passes[0];
    assert!((first.length - 28.0).abs() < 1e-6, "{}", first.length);
    assert!(first.pass.points.iter().all(|cc| (cc.position.x - 28.0).abs() < 1e-6));
}

#[test]
fn points_of_a_seed_that_hop_through_a_thin_blade_are_refused_with_the_place() {
    // A blade 3 mm thick, bent by a quarter of a turn; both sides and the edges between them.
    let (radius, half) = (100.0, 1.5);
    let at = |across: f64, along: f64, z: f64| {
        let angle = 0.5 * PI * along;
        Point3::new((radius + across) * angle.cos(), (radius + across) * angle.sin(), z)
    };
    let outer = grid(60, 10, |u, v| at(half, u, 20.0 * v));
    let inner = grid(60, 10, |u, v| at(-half, 1.0 - u, 20.0 * v));
    let s = surface(outer.joined(&inner));
    let seed = |shares: &[f64]| Seed::Curve(shares.iter().map(|&t| at(half, t, 10.0)).collect());
    let lay = |seed: Seed| {
        let settings = LaySettings { min_pass_length: 3.0, ..settings(6.0) };
        lay_passes(&s, &Region::default(), &scallop(vec![seed]), &settings, &|_| 6.0, &Silent)
    };
    let e = lay(seed(&[0.1, 0.8])).unwrap_err().to_string();
    assert!(e.contains("points 0 and 1") && e.contains("put points closer"), "{e}");
    // 16 mm apart, the chords are 0.3 mm below the outer side.
    let close: Vec<f64> = (0..=7).map(|k| 0.1 + 0.1 * f64::from(k)).collect();
    assert!(lay(seed(&close)).is_ok());
}

#[test]
fn a_seed_may_cross_a_sharp_edge_and_lie_above_coarse_facets() {
    // Two planes that meet at 60°.
    let roof = grid(40, 20, |u, v| {
        let way = 40.0 * (u - 0.5);
        Point3::new(0.5 * way, 20.0 * v, -way.abs() * 0.75f64.sqrt())
    });
    let across =
        Seed::Curve([-15.0, 0.0, 15.0].map(|w: f64| Point3::new(0.5 * w, 10.0, -w.abs() * 0.75f64.sqrt())).into());
    // Facets of 9° in a hollow cylinder, and a chord of 60°.
    let hollow = grid(10, 10, |u, v| {
        let angle = 0.5 * PI * (u - 0.5);
        Point3::new(50.0 * angle.sin(), 50.0 * v, 50.0 - 50.0 * angle.cos())
    });
    let chord = [-PI / 12.0, PI / 12.0].map(|a: f64| Point3::new(50.0 * a.sin(), 25.0, 50.0 - 50.0 * a.cos()));
    for (name, mesh, seed) in [("roof", roof, across), ("hollow", hollow, Seed::Curve(chord.into()))] {
        let settings = LaySettings { min_pass_length: 2.0, ..settings(4.0) };
        let laid = lay_passes(&surface(mesh), &Region::default(), &scallop(vec![seed]), &settings, &|_| 4.0, &Silent);
        assert!(laid.is_ok(), "{name}: {}", laid.unwrap_err());
    }
}

#[test]
fn no_place_of_an_adverse_region_is_missed_silently() {
    // A plate with two holes, a second plate beside it, and a plate that folds over itself.
    let plate = |holes: &[(f64, f64, f64)], offset: f64| {
        let mesh = grid(70, 50, |u, v| Point3::new(70.0 * u + offset, 50.0 * v, 0.0));
        let keep = |t: &[u32; 3]| {
            let c = t.iter().map(|&v| mesh.vertices()[v as usize].coords).sum::<Vector3<f64>>() / 3.0;
            holes.iter().all(|h| (c.x - offset - h.0).hypot(c.y - h.1) > h.2)
        };
        let triangles = mesh.triangles().iter().copied().filter(keep).collect();
        TriMesh::new(mesh.vertices().to_vec(), triangles).unwrap()
    };
    let holes = plate(&[(20.0, 25.0, 8.0), (50.0, 15.0, 6.0)], 0.0);
    let two = plate(&[], 0.0).joined(&plate(&[(30.0, 30.0, 9.0)], 90.0));
    let folded = grid(90, 20, |u, v| {
        let x = 90.0 * (u - 0.5);
        Point3::new(x.abs(), 20.0 * v, 0.15 * (x / 2.0).clamp(-1.0, 1.0))
    });
    let seed = || at_plane(Point3::new(0.0, 1.0, 0.0), Vector3::y());
    for (name, mesh) in [("holes", holes), ("two", two), ("folded", folded)] {
        let s = surface(mesh);
        for seeds in [vec![seed()], vec![Seed::Border]] {
            let by_border = seeds == [Seed::Border];
            let settings = LaySettings { min_pass_length: 2.0, ..settings(4.0) };
            let laid = lay_by(&s, &scallop(seeds), &settings, &|_| 4.0);
            let area: f64 = (0..s.mesh().triangles().len()).map(|t| 0.5 * s.mesh().scaled_normal(t).norm()).sum();
            let (worst, open) = worst_reach(&s, &laid, 1000, |_| 4.0);
            let counted = laid.uncovered_area / area;
            assert!(open <= 1.5 * counted + 0.004, "{name} {by_border}: {open} open, {counted} counted, worst {worst}");
            assert!(counted < 0.05, "{name} {by_border}: {counted}");
        }
    }
}

#[test]
fn heaps_of_random_triangles_give_passes_on_them_or_a_typed_error() {
    let mut rng = Random(31);
    for _ in 0..4 {
        let vertices: Vec<Point3<f64>> = (0..12).map(|_| rng.point(30.0)).collect();
        let mut index = || (rng.unit() * 12.0) as u32;
        let mut triangles: Vec<[u32; 3]> = (0..20).map(|_| [index(), index(), index()]).collect();
        triangles.push(triangles[0]);
        let s = surface(TriMesh::new(vertices, triangles).unwrap());
        for seeds in [vec![Seed::Border], vec![at_plane(Point3::origin(), Vector3::z())]] {
            match lay_passes(&s, &Region::default(), &scallop(seeds), &settings(10.0), &|_| 10.0, &Silent) {
                Ok(laid) => assert!(points(&laid).all(|(_, cc)| s.closest_point(&cc.position, 1e-6).is_some())),
                Err(e) => assert!(
                    matches!(
                        e,
                        PathError::EmptyRegion { .. } | PathError::NoPasses { .. } | PathError::SeedNowhere { .. }
                    ),
                    "{e}"
                ),
            }
        }
    }
}

#[test]
fn threads_do_not_change_fronts_and_a_rigid_motion_moves_them_along() {
    let mesh = waves(30);
    let width = |cc: &CcPoint| 4.0 + cc.feed.dot(&cc.normal.into_inner()) + 1e-3 * cc.position.coords.norm();
    let origin = Point3::new(0.0, 1.0, 0.0);
    let s = surface(mesh.clone());
    let lay_in = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| lay_by(&s, &scallop(vec![at_plane(origin, Vector3::y())]), &settings(5.0), &width))
    };
    let laid = lay_in(2);
    assert_eq!(laid, lay_in(1));
    let motion = Isometry3::new(Vector3::new(12.0, -40.0, 7.0), Vector3::new(0.4, 1.1, -0.7));
    let back = motion.inverse();
    let moved = surface(mesh.transformed(&motion));
    let width = |cc: &CcPoint| 4.0 + 1e-3 * (back * cc.position).coords.norm();
    let seed = at_plane(motion * origin, motion * Vector3::y());
    let also = lay_by(&moved, &scallop(vec![seed]), &settings(5.0), &width);
    assert_eq!(laid.passes.len(), also.passes.len());
    for (a, b) in laid.passes.iter().zip(&also.passes) {
        assert!((a.length - b.length).abs() < 1e-4, "{} {}", a.length, b.length);
        let ends = |p: &LaidPass| [p.pass.points[0].position, p.pass.points[p.pass.points.len() - 1].position];
        for (p, q) in ends(a).into_iter().zip(ends(b)) {
            assert!((motion * p - q).norm() < 1e-4);
        }
    }
}

#[test]
fn seeds_that_are_nowhere_are_named_with_a_remedy() {
    let s = surface(grid(10, 10, |u, v| Point3::new(10.0 * u, 10.0 * v, 0.0)));
    let message = |seed: Seed| {
        let strategy = scallop(vec![seed]);
        lay_passes(&s, &Region::default(), &strategy, &settings(2.0), &|_| 2.0, &Silent).unwrap_err().to_string()
    };
    let off = message(at_plane(Point3::new(0.0, 50.0, 0.0), Vector3::y()));
    assert!(off.contains("plane through [0.0, 50.0, 0.0]") && off.contains("move the seed"), "{off}");
    let off = message(Seed::Curve(vec![Point3::new(1.0, 1.0, 0.0), Point3::new(5.0, 1.0, 30.0)]));
    assert!(off.contains("point 1") && off.contains("check frame"), "{off}");
    let off = message(Seed::GroupBorder("hub".to_owned()));
    assert!(off.contains("no group \"hub\""), "{off}");
    let cylinder = Seed::Cylinder { axis_origin: Point3::origin(), axis_direction: Vector3::z_axis(), radius: 90.0 };
    assert!(message(cylinder).contains("cylinder of radius 90 mm"));
    let (vertices, triangles) = facemill_test_kit::ball_mesh(5.0, [12, 24]);
    let closed = surface(TriMesh::new(vertices, triangles).unwrap());
    let strategy = scallop(vec![Seed::Border]);
    let none = lay_passes(&closed, &Region::default(), &strategy, &settings(2.0), &|_| 2.0, &Silent).unwrap_err();
    assert!(none.to_string().contains("closed and has none: take a plane"), "{none}");
}

/// A trapezoid: two corners at the origin and on the x axis with these inner angles, rad.
fn trapezoid([a, b]: [f64; 2], [length, height]: [f64; 2], [n, m]: [u32; 2], share: f64) -> TriMesh {
    irregular_grid(n, m, share, |u, v| {
        let y = height * v;
        let (from, to) = (y / a.tan(), length - y / b.tan());
        Point3::new(from + (to - from) * u, y, 0.0)
    })
}

#[test]
fn corners_that_fronts_leave_out_are_counted() {
    // Where one front ends on one side of a corner and the next on the other, the corner is beyond
    // the ends of both: up to two half strips from them.
    let mut rng = Random(41);
    let angle = |rng: &mut Random| rng.between(PI / 3.0, 2.0 * PI / 3.0);
    let mut n_counted = 0;
    for trial in 0..24 {
        let angles = [angle(&mut rng), angle(&mut rng)];
        let (width, skew) = (rng.between(3.0, 6.5), rng.between(-0.3, 0.3));
        let size = [rng.between(70.0, 90.0), rng.between(25.0, 35.0)];
        let mesh = trapezoid(angles, size, [50 + rng.below(30) as u32, 25 + rng.below(20) as u32], 0.4);
        let s = surface(mesh);
        let seed = match trial % 4 {
            0 => Seed::Border,
            1 => at_plane(Point3::new(0.0, 1e-6, 0.0), Vector3::y()),
            2 => at_plane(Point3::new(0.0, 0.5 * size[1], 0.0), Vector3::new(skew, 1.0, 0.0)),
            _ => at_plane(Point3::new(0.3 * size[0], 0.0, 0.0), Vector3::new(1.0, skew, 0.0)),
        };
        let laid = lay_by(&s, &scallop(vec![seed]), &settings(width), &|_| width);
        let area: f64 = (0..s.mesh().triangles().len()).map(|t| 0.5 * s.mesh().scaled_normal(t).norm()).sum();
        let (worst, open) = worst_reach(&s, &laid, 3000, |_| width);
        let counted = laid.uncovered_area / area;
        assert!(worst < 2.0 && open < 0.01, "{trial}: {worst} {open}");
        assert!(open <= 2.0 * counted + 0.001, "{trial}: {open} open, {counted} counted, worst {worst}");
        n_counted += usize::from(open > 0.0 && counted > 0.0);
    }
    assert!(n_counted >= 3, "{n_counted} regions with a corner left out");
}
