//! Passes beside a point, against strips of known width and against the ridges of a ball on the
//! surface, place by place.

use facemill_cl_data::{CcPoint, Posture};
use facemill_cutter_location::cusp::Ridge;
use facemill_cutter_location::cusp::cut_point::CutPoint;
use facemill_cutter_location::cusp::neighbours::{Beside, CutPass, NeighbourReach, Neighbours, OwnPlace};
use facemill_tool_model::{Cusp, Cutter};
use nalgebra::{Point3, Vector3};

/// Step-over of all families, mm.
const STEP: f64 = 5.0;

/// Radius of the ball, mm: its cusp depends on no posture.
const BALL: f64 = 10.0;

/// A surface over x and y with its outward normal.
struct Shape {
    at: fn(f64, f64) -> Point3<f64>,
    normal: fn(f64, f64) -> Vector3<f64>,
}

const PLANE: Shape = Shape { at: |x, y| Point3::new(x, y, 0.0), normal: |_, _| Vector3::z() };

/// About the x axis, 50 mm below; y is the arc length.
const CYLINDER: Shape = Shape {
    at: |x, y| Point3::new(x, 50.0 * (y / 50.0).sin(), 50.0 * (y / 50.0).cos() - 50.0),
    normal: |_, y| Vector3::new(0.0, (y / 50.0).sin(), (y / 50.0).cos()),
};

const SADDLE: Shape = Shape {
    at: |x, y| Point3::new(x, y, (x * x - y * y) / 400.0),
    normal: |x, y| Vector3::new(-x / 200.0, y / 200.0, 1.0),
};

/// A pass over a curve in x and y.
fn pass(shape: &Shape, curve: &[[f64; 2]]) -> CutPass {
    let at = |k: usize| (shape.at)(curve[k][0], curve[k][1]);
    let point = |k: usize| {
        let ([x, y], last) = (curve[k], curve.len() - 1);
        // The exact tangent hardly differs from that of a parabola through three points.
        let feed = match k {
            0 => (at(1) - at(0)) * 2.0 - (at(2) - at(0)) * 0.5,
            k if k == last => (at(k) - at(k - 1)) * 2.0 - (at(k) - at(k - 2)) * 0.5,
            k => at(k + 1) - at(k - 1),
        };
        let cc = CcPoint::new(at(k), (shape.normal)(x, y), feed).expect("a point");
        CutPoint { cc, posture: Posture { tilt: 0.2, rotate: -0.3 } }
    };
    // They run to +x, one to the left of the other.
    CutPass { points: (0..curve.len()).map(point).collect(), uncut_left: true }
}

/// A straight line along x.
fn line(from: f64, to: f64, y: f64) -> Vec<[f64; 2]> {
    let n = ((to - from) / 2.0).round().max(2.0);
    (0..=n as i32).map(|k| [from + (to - from) * f64::from(k) / n, y]).collect()
}

/// A line along x that ends in a bend by 110° to the left, the inner one with a radius of 8 mm:
/// parallel curves.
fn hook(number: f64) -> Vec<[f64; 2]> {
    let radius = 8.0 + STEP * number;
    let bend = (1..=44).map(|k| f64::from(k) * 2.5f64.to_radians());
    let straight = line(0.0, 60.0, -STEP * number);
    let curved = bend.map(|t| [60.0 + radius * t.sin(), 8.0 - radius * t.cos()]);
    straight.into_iter().chain(curved).collect()
}

const REACH: NeighbourReach = NeighbourReach { far: 60.0, opposed: 20.0 };

/// Returns the neighbours of all points of a pass.
fn beside(neighbours: &Neighbours, pass: usize) -> Vec<Beside> {
    let n = neighbours.passes()[pass].points.len();
    (0..n).map(|point| neighbours.of(OwnPlace { pass, point })).collect()
}

/// Returns the steps toward the passes before at all points of a pass.
fn steps(neighbours: &Neighbours, pass: usize) -> Vec<Vec<f64>> {
    let of = |beside: Beside| beside.before().map(|n| n.strip.step_over).collect();
    beside(neighbours, pass).into_iter().map(of).collect()
}

/// Returns the highest ridge that balls along all passes leave between two places of the surface:
/// every place against every ball.
fn left_by_balls(passes: &[CutPass], from: &CcPoint, to: &CcPoint) -> f64 {
    let mut centers: Vec<Point3<f64>> = Vec::new();
    for pass in passes {
        for pair in pass.points.windows(2) {
            let center = |p: &CutPoint| p.cc.position + p.cc.normal.into_inner() * BALL;
            let (a, b) = (center(&pair[0]), center(&pair[1]));
            centers.extend((0..10).map(|k| a + (b - a) * (f64::from(k) / 10.0)));
            centers.push(b);
        }
    }
    let height = |foot: &Point3<f64>, normal: &Vector3<f64>| {
        let lowest = |center: &Point3<f64>| {
            let toward = center - foot;
            let along = toward.dot(normal);
            let inside = BALL * BALL - (toward.norm_squared() - along * along);
            if inside < 0.0 { f64::INFINITY } else { along - inside.sqrt() }
        };
        centers.iter().map(lowest).fold(f64::INFINITY, f64::min)
    };
    // The surface between is the circle through both, as exactly as balls show over 5 mm.
    let chord = to.position - from.position;
    let bend = (to.normal.into_inner() - from.normal.into_inner()).dot(&chord) / chord.norm_squared();
    (0..=40)
        .map(|k| {
            let t = f64::from(k) / 40.0;
            let normal = (from.normal.into_inner() * (1.0 - t) + to.normal.into_inner() * t).normalize();
            let foot = from.position + chord * t + normal * (0.5 * bend * t * (1.0 - t) * chord.norm_squared());
            height(&foot, &normal)
        })
        .fold(0.0, f64::max)
}

#[test]
fn passes_five_apart_are_reported_as_such_with_the_cusp_that_balls_leave() {
    let arc_on_saddle = |number: f64| {
        // y of the parabola −y²/400 at this arc length.
        let (mut y, arc) = (0.0, STEP * number);
        for _ in 0..5000 {
            let slope: f64 = y / 200.0;
            y += arc / 5000.0 / slope.hypot(1.0);
        }
        y
    };
    let lines = |shape: &Shape, y: &dyn Fn(f64) -> f64| -> Vec<CutPass> {
        (0..5).map(|k| pass(shape, &line(-20.0, 20.0, y(f64::from(k))))).collect()
    };
    let hooks = |shape: &Shape| -> Vec<CutPass> { (0..6).rev().map(|k| pass(shape, &hook(f64::from(k)))).collect() };
    let cases = [
        ("plane", lines(&PLANE, &|k| STEP * k)),
        ("cylinder", lines(&CYLINDER, &|k| STEP * k)),
        ("saddle", lines(&SADDLE, &arc_on_saddle)),
        ("hooks", hooks(&PLANE)),
        ("hooks on a cylinder", hooks(&CYLINDER)),
    ];
    let cutter = Cutter::new(BALL, BALL, 40.0).expect("a ball");
    for (name, passes) in cases {
        let neighbours = Neighbours::new(passes.clone(), REACH);
        for k in 1..passes.len() {
            for (point, beside) in beside(&neighbours, k).into_iter().enumerate() {
                let own = &passes[k].points[point];
                let before: Vec<_> = beside.before().collect();
                assert_eq!(before.len(), 1, "{name}: pass {k} point {point}");
                let ridge = Ridge::toward(&cutter, own, before[0]);
                assert!((ridge.step_over - STEP).abs() < 0.01 * STEP, "{name} {k} {point}: {}", ridge.step_over);
                let Cusp::Height(cusp) = ridge.cusp else { panic!("{name} {k} {point}: uncut") };
                let left = left_by_balls(&passes, &own.cc, &before[0].point.cc);
                assert!((cusp - left).abs() < 0.03 * left, "{name} pass {k} point {point}: {cusp}, left {left}");
                if name == "plane" {
                    let exact = BALL - (BALL * BALL - 0.25 * STEP * STEP).sqrt();
                    assert!((cusp - exact).abs() < 1e-9);
                }
            }
        }
    }
}

/// x of the point of a pass.
fn x(neighbours: &Neighbours, pass: usize, point: usize) -> f64 {
    neighbours.passes()[pass].points[point].cc.position.x
}

#[test]
fn partial_passes_are_neighbours_where_they_are_and_nowhere_else() {
    let full = |y: f64| pass(&PLANE, &line(0.0, 100.0, y));
    let partial = |y: f64| pass(&PLANE, &line(40.0, 100.0, y));
    // The partial pass is cut between both others, then after them.
    let between = Neighbours::new(vec![full(0.0), partial(STEP), full(2.0 * STEP)], REACH);
    for (point, found) in steps(&between, 2).iter().enumerate() {
        let missing = (40.0 - x(&between, 2, point)).max(0.0);
        // Before its start, a ball reaches as far back from its end as to the places that are as
        // near to this pass.
        let expected = (STEP + missing * missing / STEP).min(2.0 * STEP);
        assert!(found.len() == 1 && (found[0] - expected).abs() < 1e-9, "{point}: {found:?}");
    }
    let after = Neighbours::new(vec![full(0.0), full(2.0 * STEP), partial(STEP)], REACH);
    for (point, found) in steps(&after, 1).iter().enumerate() {
        // Where the partial pass lies between, the ridge is the partial pass's own.
        let expected: &[f64] = if x(&after, 1, point) < 40.0 - 0.1 { &[2.0 * STEP] } else { &[] };
        assert!(found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9));
    }
    for (point, found) in steps(&after, 2).iter().enumerate() {
        assert!(found.len() == 2 && found.iter().all(|s| (s - STEP).abs() < 1e-9), "{point}: {found:?}");
        assert!(after.of(OwnPlace { pass: 2, point }).earlier.iter().all(Option::is_some));
    }
    // A pass behind several partial ones, where none is directly before it in number.
    let many = Neighbours::new(vec![full(0.0), partial(-STEP), partial(-2.0 * STEP), full(STEP)], REACH);
    assert!(steps(&many, 3).iter().all(|found| found.len() == 1 && (found[0] - STEP).abs() < 1e-9));
}

#[test]
fn what_is_on_another_arm_wall_or_across_is_no_neighbour() {
    // A hairpin with arms 40 mm apart: no strip between the arms.
    let arm = |y: f64, back: bool| {
        let mut points = line(0.0, 60.0, y);
        if back {
            points.reverse();
        }
        points
    };
    let bend = (1..18).map(|k| {
        let t = f64::from(k) * 10f64.to_radians();
        [60.0 + 20.0 * t.sin(), -20.0 * t.cos()]
    });
    let hairpin: Vec<[f64; 2]> = arm(-20.0, false).into_iter().chain(bend).chain(arm(20.0, true)).collect();
    let alone = Neighbours::new(vec![pass(&PLANE, &hairpin)], REACH);
    assert!(steps(&alone, 0).iter().all(Vec::is_empty));
    // A closed spiral's turns are neighbours of each other.
    let turns = (0..=216).map(|k| {
        let t = f64::from(k) * 5f64.to_radians();
        let radius = 40.0 - STEP * t / std::f64::consts::TAU;
        [radius * t.cos(), radius * t.sin()]
    });
    let spiral = Neighbours::new(vec![pass(&PLANE, &turns.collect::<Vec<_>>())], REACH);
    let found = steps(&spiral, 0);
    assert!(found[..60].iter().all(Vec::is_empty));
    assert!(found[76..].iter().all(|f| f.len() == 1 && (f[0] - STEP).abs() < 0.05), "{found:?}");
    // Passes across, on the other side of a wall 3 mm thick, and 20 mm higher with the same normal.
    let own = pass(&PLANE, &line(0.0, 60.0, 0.0));
    let across: Vec<[f64; 2]> = line(-30.0, 30.0, 0.0).into_iter().map(|[a, b]| [30.0 + b, a - 34.0]).collect();
    let below = Shape { at: |x, y| Point3::new(x, y, -3.0), normal: |_, _| -Vector3::z() };
    let above = Shape { at: |x, y| Point3::new(x, y, 20.0), normal: |_, _| Vector3::z() };
    for other in [pass(&PLANE, &across), pass(&below, &line(0.0, 60.0, 1.0)), pass(&above, &line(0.0, 60.0, -5.0))] {
        let both = Neighbours::new(vec![other, own.clone()], REACH);
        assert!(steps(&both, 1).iter().all(Vec::is_empty));
    }
}

#[test]
fn a_pass_goes_across_another_on_one_surface_alone() {
    let shapes = [PLANE, CYLINDER, SADDLE];
    for shape in &shapes {
        let laid =
            Neighbours::new(vec![pass(shape, &line(-30.0, 30.0, 0.0)), pass(shape, &line(-30.0, 30.0, STEP))], REACH);
        let is_across = |curve: &[[f64; 2]]| {
            let points: Vec<CcPoint> = pass(shape, curve).points.iter().map(|p| p.cc).collect();
            laid.is_crossed_by(&points)
        };
        let lean = |from: f64, to: f64| -> Vec<[f64; 2]> {
            (0..=20).map(|k| f64::from(k) / 20.0).map(|t| [-20.0 + 40.0 * t, from + (to - from) * t]).collect()
        };
        // Between, beside, and ending short of the one it leads to; then over one of them at a
        // slant, and over both.
        assert!(!is_across(&line(-30.0, 30.0, 0.5 * STEP)) && !is_across(&lean(-0.3 * STEP, -0.1 * STEP)));
        assert!(!is_across(&lean(0.1 * STEP, 0.9 * STEP)));
        assert!(is_across(&lean(-0.1 * STEP, 0.2 * STEP)) && is_across(&lean(0.9 * STEP, 1.1 * STEP)));
        assert!(is_across(&lean(-STEP, 2.0 * STEP)));
    }
    // Above and below, it crosses only in projection; on the other side of a thin wall another
    // surface is cut.
    let laid = Neighbours::new(vec![pass(&PLANE, &line(-30.0, 30.0, 0.0))], REACH);
    let over: Vec<[f64; 2]> = line(-10.0, 10.0, 0.0).into_iter().map(|[a, b]| [b, a]).collect();
    let above = Shape { at: |x, y| Point3::new(x, y, 20.0), normal: |_, _| Vector3::z() };
    let below = Shape { at: |x, y| Point3::new(x, y, -0.5), normal: |_, _| -Vector3::z() };
    for shape in [above, below] {
        let points: Vec<CcPoint> = pass(&shape, &over).points.iter().map(|p| p.cc).collect();
        assert!(!laid.is_crossed_by(&points));
    }
}
