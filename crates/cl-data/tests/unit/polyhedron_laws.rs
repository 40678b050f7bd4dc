//! Laws of convex polyhedra around points.

use facemill_test_kit::Random;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::polyhedron::ConvexPolyhedron;
use crate::polyhedron_build::PolyhedronError;

/// Returns points in a ball, most of them inside its hull where there are many; some twice.
fn random_points(random: &mut Random, n: usize) -> Vec<Point3<f64>> {
    let mut points: Vec<Point3<f64>> = (0..n).map(|_| (random.vector(1.0).normalize() * 100.0).into()).collect();
    points.extend_from_within(..2);
    points
}

fn corners_of_box(half: Vector3<f64>, pose: &Isometry3<f64>) -> Vec<Point3<f64>> {
    let sign = |k: usize, axis: usize| if k >> axis & 1 == 0 { -1.0 } else { 1.0 };
    (0..8).map(|k| pose * Point3::from(Vector3::from_fn(|axis, _| sign(k, axis) * half[axis]))).collect()
}

fn check_invariants(p: &ConvexPolyhedron) {
    assert!(p.vertices().len() <= ConvexPolyhedron::MOST_VERTICES);
    let deep = p.height(&p.center()).0;
    assert!(deep < 0.0 && -deep <= p.inner_radius_bound() + 1e-9);
    assert!(p.volume() > 0.0);
    for face in p.faces() {
        assert!((face.normal.norm() - 1.0).abs() < 1e-12);
        for v in p.vertices() {
            assert!(face.normal.dot(&v.coords) <= face.offset, "behind all planes");
        }
        for &corner in &face.corners {
            let height = face.normal.dot(&p.vertices()[corner as usize].coords) - face.offset;
            assert!(height > -1e-8, "corners are on their plane: {height}");
        }
    }
}

/// Returns the distance from a polyhedron: among all projections onto planes of faces, lines of two
/// planes and vertices that belong to the polyhedron, the nearest.
fn brute_distance(polyhedron: &ConvexPolyhedron, p: &Point3<f64>) -> f64 {
    let faces = polyhedron.faces();
    let mut best = f64::INFINITY;
    let mut consider = |q: Point3<f64>| {
        if polyhedron.height(&q).0 <= 1e-9 {
            best = best.min((p - q).norm());
        }
    };
    polyhedron.vertices().iter().for_each(|v| consider(*v));
    for (k, a) in faces.iter().enumerate() {
        let above_a = a.normal.dot(&p.coords) - a.offset;
        consider(p - a.normal * above_a);
        for b in &faces[..k] {
            let (cos, above_b) = (a.normal.dot(&b.normal), b.normal.dot(&p.coords) - b.offset);
            let sin_sq = 1.0 - cos * cos;
            if sin_sq > 1e-6 {
                let by_a = (above_a - cos * above_b) / sin_sq;
                let by_b = (above_b - cos * above_a) / sin_sq;
                consider(p - a.normal * by_a - b.normal * by_b);
            }
        }
    }
    best
}

#[test]
fn polyhedron_holds_its_points_whatever_they_are() {
    let mut lcg = Random(1);
    for n in [4, 5, 6, 8, 12, 20, 34, 60, 200, 1000] {
        for _ in 0..4 {
            let points = random_points(&mut lcg, n);
            let polyhedron = ConvexPolyhedron::around(&points, []).unwrap();
            check_invariants(&polyhedron);
            for p in &points {
                assert!(polyhedron.height(p).0 <= 1e-9 && polyhedron.nearest(p).distance <= 1e-9);
            }
        }
    }
}

#[test]
fn with_few_facets_it_is_the_hull() {
    let mut lcg = Random(2);
    for _ in 0..40 {
        let (half, pose) = (lcg.vector(1.0).abs().add_scalar(0.05) * 100.0, lcg.motion(300.0));
        let cube = ConvexPolyhedron::around(&corners_of_box(half, &pose), []).unwrap();
        check_invariants(&cube);
        assert_eq!((cube.vertices().len(), cube.faces().len()), (8, 6));
        assert!((cube.volume() / (8.0 * half.product()) - 1.0).abs() < 1e-10);
        assert!((cube.inner_radius_bound() - half.min()).abs() < 1e-9);
        let simplex = random_points(&mut lcg, 4);
        let [a, b, c, d] = [simplex[0], simplex[1], simplex[2], simplex[3]];
        let volume = (b - a).cross(&(c - a)).dot(&(d - a)).abs() / 6.0;
        if volume > 1e3 {
            let hull = ConvexPolyhedron::around(&simplex, []).unwrap();
            assert!((hull.volume() - volume).abs() < 1e-6 * volume, "{} {volume}", hull.volume());
        }
    }
}

#[test]
fn prism_of_sixty_sides_is_exact_and_a_ball_is_hardly_larger() {
    let rim = |k: usize| (std::f64::consts::TAU * k as f64 / 60.0).sin_cos();
    let points: Vec<_> =
        (0..120).map(|k| Point3::new(rim(k).1 * 50.0, rim(k).0 * 50.0, if k < 60 { -7.0 } else { 30.0 })).collect();
    let normals = (0..60).map(|k| {
        let (sin, cos) = (std::f64::consts::TAU * (k as f64 + 0.5) / 60.0).sin_cos();
        Vector3::new(cos, sin, 0.0)
    });
    let exact = 37.0 * 60.0 * 0.5 * 2500.0 * (std::f64::consts::TAU / 60.0).sin();
    let prism = ConvexPolyhedron::around(&points, normals).unwrap();
    assert!((prism.volume() / exact - 1.0).abs() < 1e-9, "{} {exact}", prism.volume());
    assert_eq!(prism.vertices().len(), 120);
    let mut lcg = Random(3);
    let ball = ConvexPolyhedron::around(&random_points(&mut lcg, 3000), []).unwrap();
    let of_ball = 4.0 / 3.0 * std::f64::consts::PI * 1e6;
    assert!(ball.volume() > 0.98 * of_ball && ball.volume() < 1.15 * of_ball, "{}", ball.volume() / of_ball);
}

#[test]
fn nearest_point_is_that_of_projections_and_its_plane_supports() {
    let mut lcg = Random(4);
    for n in [4, 6, 12, 40] {
        let polyhedron = ConvexPolyhedron::around(&random_points(&mut lcg, n), []).unwrap();
        for _ in 0..60 {
            let p = Point3::from(lcg.vector(150.0));
            let nearest = polyhedron.nearest(&p);
            let is_inside = polyhedron.height(&p).0 <= 0.0;
            let expected = if is_inside { 0.0 } else { brute_distance(&polyhedron, &p) };
            assert!((nearest.distance - expected).abs() < 1e-8, "{} for {expected}", nearest.distance);
            assert!(((p - nearest.point).norm() - nearest.distance).abs() < 1e-11);
            if nearest.distance > 0.0 {
                assert!((nearest.away.norm() - 1.0).abs() < 1e-12);
                assert!(polyhedron.height(&nearest.point).0 < 1e-9, "it is of the polyhedron");
            }
            let reach = nearest.away.dot(&(polyhedron.support(&nearest.away) - nearest.point));
            assert!(reach < 1e-11, "{reach}");
        }
    }
}

#[test]
fn plane_of_a_point_that_is_hardly_outside_does_not_cut_the_body() {
    let mut lcg = Random(5);
    for n in [4, 8, 30] {
        let polyhedron = ConvexPolyhedron::around(&random_points(&mut lcg, n), []).unwrap();
        for k in 0..4000 {
            let face = &polyhedron.faces()[k % polyhedron.faces().len()];
            let corner = |k: usize| polyhedron.vertices()[face.corners[k % face.corners.len()] as usize];
            // Off a corner, and off an edge.
            let start = if k % 2 == 0 { corner(k) } else { nalgebra::center(&corner(k), &corner(k + 1)) };
            let p = start + lcg.vector(10f64.powf(lcg_exponent(k)));
            let nearest = polyhedron.nearest(&p);
            let reach = nearest.away.dot(&(polyhedron.support(&nearest.away) - nearest.point));
            assert!(reach < 1e-11, "{reach} at {}", nearest.distance);
            let along = nearest.away.dot(&(p - nearest.point));
            let off = nearest.distance - along;
            assert!((-1e-12..1e-11).contains(&off), "{off} at {}", nearest.distance);
        }
    }
}

fn lcg_exponent(k: usize) -> f64 {
    -13.0 + (k % 13) as f64
}

#[test]
fn points_without_a_body_are_refused() {
    let of = |points: &[[f64; 3]]| {
        let points: Vec<_> = points.iter().map(|&p| Point3::from(p)).collect();
        ConvexPolyhedron::around(&points, []).map(|_| ())
    };
    assert_eq!(of(&[]), Err(PolyhedronError::Flat));
    assert_eq!(of(&[[0.0; 3]; 9]), Err(PolyhedronError::Flat));
    assert_eq!(of(&[[0.0; 3], [1.0, 2.0, 3.0], [4.0, 0.0, 1.0]]), Err(PolyhedronError::Flat));
    assert_eq!(
        of(&[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [7.0, 9.0, 0.0]]),
        Err(PolyhedronError::Flat)
    );
    assert_eq!(of(&[[0.0; 3], [1.0, f64::NAN, 0.0]]), Err(PolyhedronError::NotFinite { index: 1 }));
    assert_eq!(of(&[[0.0; 3], [1.0, 2.0, 0.0], [0.0, -2e6, 0.0]]), Err(PolyhedronError::TooFar { index: 2 }));
}
