//! Laws of flows between two borders.

use std::f64::consts::PI;

use super::*;

fn end(x: [f64; 3], normal: Unit<Vector3<f64>>) -> FlowEnd {
    FlowEnd::Plane { origin: Point3::from(x), normal }
}

fn flow(from: FlowEnd, to: FlowEnd) -> Strategy {
    Strategy::Flow(Flow { from, to, within: 1e-3 })
}

#[test]
fn on_a_rectangle_a_flow_is_the_parallel_planes() {
    let mesh = irregular_grid(25, 15, 0.6, |u, v| Point3::new(100.0 * u, 60.0 * v, 0.0));
    let s = surface(mesh);
    let strategy = flow(end([0.0, 0.0, 0.0], Vector3::y_axis()), end([0.0, 60.0, 0.0], Vector3::y_axis()));
    for order in [LevelOrder::Increasing, LevelOrder::Decreasing] {
        let settings = LaySettings { max_step_over: 4.3, order, ..LaySettings::default() };
        let (laid, by_planes) = (lay(&s, &strategy, &settings), lay(&s, &planes(Vector3::y_axis()), &settings));
        assert_eq!(laid.passes.len(), by_planes.passes.len());
        assert_eq!((laid.n_levels, laid.n_wide_strips), (15, 0));
        for (a, b) in laid.passes.iter().zip(&by_planes.passes) {
            assert_eq!(a.uncut, b.uncut);
            // The first and the last lie on the border, but for a share of the range.
            assert!((a.level - b.level).abs() < 1e-4, "{} {}", a.level, b.level);
            for cc in &a.pass.points {
                assert!((cc.position.y - b.level).abs() < 1e-4 && (cc.feed.x - b.pass.points[0].feed.x).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn on_a_cone_passes_are_as_far_apart_as_allowed() {
    // From its tip, the unrolled cone is a sector: levels are circles about the tip.
    let (sine, near, far) = (0.6, 20.0, 90.0);
    let cosine = f64::sqrt(1.0 - sine * sine);
    let at = |way: f64, turn: f64| Point3::new(sine * way * turn.cos(), sine * way * turn.sin(), -cosine * way);
    let mesh = irregular_grid(60, 60, 0.4, |u, v| at(near + (far - near) * u, 2.5 * v));
    let s = surface(mesh);
    let plane = |way: f64| end([0.0, 0.0, -cosine * way], Vector3::z_axis());
    for allowed in [4.9, 2.05] {
        let settings = LaySettings { max_step_over: allowed, ..LaySettings::default() };
        let laid = lay(&s, &flow(plane(near), plane(far)), &settings);
        let ways: Vec<f64> = laid.passes.iter().map(|p| mean(p, |cc| cc.position.coords.norm())).collect();
        let n = ((far - near) / allowed).ceil();
        assert_eq!((ways.len() as f64, laid.n_wide_strips), (n + 1.0, 0));
        for w in ways.windows(2) {
            let off = (w[1] - w[0]) / ((far - near) / n) - 1.0;
            assert!(off.abs() < 0.01, "{w:?} {off}");
        }
        for (p, cc) in points(&laid) {
            let way = mean(p, |cc| cc.position.coords.norm());
            assert!((cc.position.coords.norm() - way).abs() < 0.05, "{}", cc.position.coords.norm() - way);
            assert!(cc.feed.dot(&cc.position.coords.normalize()).abs() < 0.02);
        }
    }
}

fn mean(pass: &LaidPass, of: impl Fn(&CcPoint) -> f64) -> f64 {
    pass.pass.points.iter().map(of).sum::<f64>() / pass.pass.points.len() as f64
}

#[test]
fn on_a_twisted_ribbon_passes_run_from_end_to_end_and_keep_the_widths() {
    // A helicoid: the ruling turns by a radian over the length. By symmetry the flow from one long
    // edge to the other depends on the place across alone.
    let (length, half) = (100.0, 20.0);
    let at = |u: f64, v: f64| {
        let (turn, y) = (u, half * (2.0 * v - 1.0));
        Point3::new(length * u, y * turn.cos(), y * turn.sin())
    };
    let mesh = irregular_grid(60, 30, 0.6, at);
    let edge = |v: f64| FlowEnd::Curve((0..=600).map(|k| at(f64::from(k) / 600.0, v)).collect());
    let s = surface(mesh);
    let strategy = Strategy::Flow(Flow { from: edge(0.0), to: edge(1.0), within: 0.02 });
    let settings = LaySettings { max_step_over: 3.1, ..LaySettings::default() };
    let laid = lay(&s, &strategy, &settings);
    let across = |cc: &CcPoint| {
        let turn = cc.position.x / length;
        cc.position.y * turn.cos() + cc.position.z * turn.sin()
    };
    let at: Vec<f64> = laid.passes.iter().map(|p| mean(p, across)).collect();
    let n = (2.0 * half / 3.1).ceil();
    assert!(at.len() as f64 <= n + 2.0, "{}", at.len());
    let steps = || at.windows(2).map(|w| w[1] - w[0]);
    let (least, most) = (steps().fold(f64::MAX, f64::min), steps().fold(0.0, f64::max));
    assert!(most <= 1.01 * 3.1 && most <= 1.01 * least, "{least} .. {most}");
    for (pass, mean) in laid.passes.iter().zip(&at) {
        assert!(pass.pass.points.iter().all(|cc| (across(cc) - mean).abs() < 0.1));
    }
}

#[test]
fn every_place_beside_a_hole_is_within_half_a_strip_of_a_pass_or_counted() {
    let whole = plane(100.0, 60.0, 50, 30);
    let outside = |t: &[u32; 3]| {
        let c = t.iter().map(|&v| whole.vertices()[v as usize].coords).sum::<Vector3<f64>>() / 3.0;
        !((40.0..60.0).contains(&c.x) && (24.0..36.0).contains(&c.y))
    };
    let triangles: Vec<[u32; 3]> = whole.triangles().iter().copied().filter(outside).collect();
    // A triangle twice, and a sliver on the border.
    let mut triangles = [triangles.clone(), vec![triangles[7]]].concat();
    let mut vertices = whole.vertices().to_vec();
    vertices.push(Point3::new(101.0e-6 + 100.0, 30.0, 0.0));
    let right = whole.vertices().iter().position(|p| *p == Point3::new(100.0, 30.0, 0.0)).unwrap() as u32;
    let above = whole.vertices().iter().position(|p| *p == Point3::new(100.0, 32.0, 0.0)).unwrap() as u32;
    triangles.push([right, vertices.len() as u32 - 1, above]);
    let s = surface(TriMesh::new(vertices, triangles).unwrap());
    let strategy = flow(end([0.0, 0.0, 0.0], Vector3::y_axis()), end([0.0, 60.0, 0.0], Vector3::y_axis()));
    let settings = LaySettings { max_step_over: 3.0, ..LaySettings::default() };
    let laid = lay(&s, &strategy, &settings);
    let mut rng = Random(11);
    let (mut n_tried, mut n_far) = (0, 0);
    while n_tried < 3000 {
        let p = Point3::new(100.0 * rng.unit(), 60.0 * rng.unit(), 0.0);
        if !((40.0..60.0).contains(&p.x) && (24.0..36.0).contains(&p.y)) {
            n_tried += 1;
            n_far += usize::from(distance_to_passes(&p, &laid) > 1.52);
        }
    }
    println!("hole: {n_far} far, {} wide strips, {} passes", laid.n_wide_strips, laid.passes.len());
    // The flow stands still before and behind the hole.
    assert!(n_far < 60 && (n_far == 0 || laid.n_wide_strips > 0), "{n_far} {}", laid.n_wide_strips);
    let length: f64 = laid.passes.iter().map(|p| p.length).sum();
    assert!(length < 3.5 * 100.0 * 60.0 / 3.0, "{length}");
}

#[test]
fn flows_are_the_same_on_any_number_of_threads_and_move_with_the_part() {
    let s = surface(waves(40));
    let ends =
        |from: f64, to: f64| flow(end([0.0, from, 0.0], Vector3::y_axis()), end([0.0, to, 0.0], Vector3::y_axis()));
    let settings = LaySettings { max_step_over: 4.0, ..LaySettings::default() };
    let on = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| lay(&s, &ends(0.0, 80.0), &settings))
    };
    let laid = on(1);
    assert_eq!(laid, on(3));
    for (_, cc) in points(&laid) {
        assert!(s.closest_point(&cc.position, 1e-9).is_some());
    }
    for (_, [a, b]) in gaps(&laid) {
        assert!(a.feed.dot(&b.feed) > 0.8 && (b.position - a.position).dot(&a.feed) > 0.0);
    }
    let mut rng = Random(5);
    for _ in 0..800 {
        let t = (rng.unit() * 3200.0) as u32;
        let p = s.point(t, [0.2, 0.3, 0.5]).position;
        let d = distance_to_passes(&p, &laid);
        assert!(d <= 2.0 * 1.06, "{p} is {d} mm from the nearest pass");
    }
    // The other way round, levels count from the other end.
    let turned = lay(&s, &ends(80.0, 0.0), &settings);
    assert_eq!(turned.passes.len(), laid.passes.len());
    let (first, last) = (&turned.passes[0].pass.points[0], &laid.passes[laid.passes.len() - 1].pass.points[0]);
    assert!((first.position.y - last.position.y).abs() < 1e-3);
}

#[test]
fn wrong_ends_are_named_with_a_remedy() {
    let (a, b) = (plane(20.0, 10.0, 4, 2), plane(20.0, 10.0, 4, 2));
    let two = a.joined(&b.transformed(&Isometry3::translation(0.0, 30.0, 0.0)));
    let error = |mesh: &TriMesh, from: FlowEnd, to: FlowEnd| {
        let s = surface(mesh.clone());
        let settings = LaySettings::default();
        lay_passes(&s, &Region::default(), &flow(from, to), &settings, &|_| 1.0, &Silent).unwrap_err().to_string()
    };
    let (left, right) = (end([0.0; 3], Vector3::x_axis()), end([20.0, 0.0, 0.0], Vector3::x_axis()));
    let e = error(&two, left.clone(), end([20.4, 0.0, 0.0], Vector3::x_axis()));
    assert!(e.starts_with("flow.to: no border of the region lies within 0.001 mm of its plane"), "{e}");
    assert!(e.contains("0.400 mm away") && e.contains("within_mm"), "{e}");
    let e = error(&two, left.clone(), end([0.0; 3], Vector3::y_axis()));
    assert!(e.contains("the ends of the flow touch at (0.000000, 0.000000, 0.000000)"), "{e}");
    let bottom = FlowEnd::Curve(vec![Point3::origin(), Point3::new(20.0, 0.0, 0.0)]);
    let e = error(&two, bottom, end([0.0, 10.0, 0.0], Vector3::y_axis()));
    assert!(e.contains("does not touch \"from\" of the flow") && e.contains("an operation of its own"), "{e}");
    let e = error(&two, FlowEnd::Group("hub".to_owned()), right.clone());
    assert!(e.contains("no group \"hub\""), "{e}");
    // Ends inside the region, whose box ends just beside columns of vertices: its sides cross the
    // planes in border edges of almost no length.
    let sheet = surface(waves(40));
    let bounds = Aabb { min: Point3::new(20.0 + 1e-6, 10.0, -50.0), max: Point3::new(60.0 + 1e-6, 50.0, 50.0) };
    let region = Region { bounds: Some(bounds), ..Region::default() };
    let inside = [20.0, 40.0].map(|y| end([0.0, y, 0.0], Vector3::y_axis()));
    let [from, to] = inside.clone();
    let strategy = Strategy::Flow(Flow { from, to, within: 0.05 });
    let laid = lay_passes(&sheet, &region, &strategy, &LaySettings::default(), &|_| 2.0, &Silent);
    let e = laid.map(|laid| laid.passes.len()).unwrap_err().to_string();
    assert!(e.starts_with("flow.from: no border of the region lies within 0.05 mm of its plane"), "{e}");
    assert!(e.contains("a border only crosses it") && e.contains("by the region's key between"), "{e}");
    let between =
        ParallelPlanes { origin: Point3::origin(), normal: Vector3::y_axis(), from: Some(20.0), to: Some(40.0) };
    let region = Region { between: Some(Sections::ParallelPlanes(between)), ..region };
    lay_passes(&sheet, &region, &strategy, &LaySettings::default(), &|_| 2.0, &Silent).expect("ends on its border");
    let laid = lay(&surface(two), &flow(left, right), &LaySettings::default());
    assert_eq!(laid.passes.len(), 2 * laid.n_levels, "each level has a pass on both parts");
}

#[test]
fn a_border_that_leaves_its_end_for_a_while_is_an_error_that_says_how_far() {
    // The lower border wobbles by 0.3 mm around y = 0 in its middle.
    let wobble = |u: f64| if (u - 0.5).abs() < 0.1 { 0.3 * (10.0 * PI * (u - 0.5)).cos() } else { 0.0 };
    let mesh = grid(60, 30, |u, v| Point3::new(100.0 * u, 60.0 * v + wobble(u) * (1.0 - v), 0.0));
    let s = surface(mesh);
    let lay = |within: f64| {
        let (from, to) = (end([0.0; 3], Vector3::y_axis()), end([0.0, 60.0, 0.0], Vector3::y_axis()));
        let strategy = Strategy::Flow(Flow { from, to, within });
        let settings = LaySettings { max_step_over: 5.0, ..LaySettings::default() };
        lay_passes(&s, &Region::default(), &strategy, &settings, &|_| f64::INFINITY, &Silent)
    };
    let e = lay(0.05).unwrap_err().to_string();
    assert!(e.contains("flow.from") && e.contains("0.300 mm") && e.contains("allow within_mm 0.31"), "{e}");
    assert!(lay(0.31).is_ok());
    // A slot between two legs is no wobble: passes end at its sides.
    let slotted = grid(50, 30, |u, v| Point3::new(100.0 * u, 60.0 * v, 0.0));
    let keep = |t: &&[u32; 3]| {
        let c = t.iter().map(|&v| slotted.vertices()[v as usize].coords).sum::<Vector3<f64>>() / 3.0;
        (c.x - 50.0).abs() > 10.0 || c.y > 20.0
    };
    let triangles = slotted.triangles().iter().filter(keep).copied().collect();
    let s = surface(TriMesh::new(slotted.vertices().to_vec(), triangles).unwrap());
    let strategy = flow(end([0.0; 3], Vector3::y_axis()), end([0.0, 60.0, 0.0], Vector3::y_axis()));
    assert!(
        !super::lay(&s, &strategy, &LaySettings { max_step_over: 5.0, ..LaySettings::default() }).passes.is_empty()
    );
}
