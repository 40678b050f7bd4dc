//! Laws of the kit itself: what it hands to the tests of other crates is what it says.

use std::f64::consts::{PI, TAU};

use facemill_test_kit::{
    Mesh, Random, ball_mesh, box_mesh, cap_mesh, crossing_of_line, golden_least, grid_around, grid_by_columns,
    grid_by_rows, least_over_triangle, open_edges, ring_mesh, soup_mesh, volume,
};
use nalgebra::{Point3, Vector3};

/// Numbers to each draw.
const DRAWS: usize = 20_000;

/// Asserts the range of uniform numbers, and their mean within five standard deviations of a mean.
fn assert_uniform(name: &str, [low, high]: [f64; 2], mut draw: impl FnMut() -> f64) {
    let all: Vec<f64> = (0..DRAWS).map(|_| draw()).collect();
    assert!(all.iter().all(|x| (low..high).contains(x)), "{name}");
    let mean = all.iter().sum::<f64>() / DRAWS as f64;
    let deviation = (high - low) / (12.0 * DRAWS as f64).sqrt();
    assert!((mean - 0.5 * (low + high)).abs() < 5.0 * deviation, "{name}: {mean}");
}

#[test]
fn numbers_keep_to_their_range_and_mean() {
    for seed in [0, 1, 77, u64::MAX] {
        let mut random = Random(seed);
        assert_uniform("unit", [0.0, 1.0], || random.unit());
        assert_uniform("between", [-3.0, 7.5], || random.between(-3.0, 7.5));
        let mut counts = [0_usize; 7];
        (0..DRAWS).for_each(|_| counts[random.below(7)] += 1);
        let expected = DRAWS as f64 / 7.0;
        assert!(counts.iter().all(|&n| (n as f64 - expected).abs() < 5.0 * expected.sqrt()), "{counts:?}");
        assert!((0..DRAWS).all(|_| random.coordinate().abs() <= 2500.0));
    }
}

/// First numbers of SplitMix64 of the seed 0, as its authors' program prints them.
#[test]
fn bits_of_the_seed_0_are_those_of_the_published_generator() {
    let mut random = Random(0);
    assert_eq!([0; 3].map(|_| random.bits()), [0xe220_a839_7b1d_cdaf, 0x6e78_9e6a_a1b9_65f4, 0x06c4_5d18_8009_454f]);
}

/// Area vectors of the triangles.
fn areas((vertices, triangles): &Mesh) -> Vec<Vector3<f64>> {
    let corners = triangles.iter().map(|t| t.map(|v| vertices[v as usize]));
    corners.map(|[a, b, c]| (b - a).cross(&(c - a)) * 0.5).collect()
}

#[test]
fn boxes_are_closed_and_wound_outward() {
    let mut random = Random(5);
    for _ in 0..50 {
        let low = [0; 3].map(|_| random.between(-50.0, 50.0));
        let size = [0; 3].map(|_| random.between(0.1, 40.0));
        let solid = box_mesh(low, [0, 1, 2].map(|k| low[k] + size[k]));
        let content: f64 = size.iter().product();
        assert_eq!((solid.0.len(), solid.1.len(), open_edges(&solid.1)), (8, 12, 0));
        assert!((volume(&solid.0, &solid.1) - content).abs() < 1e-9 * (content + 1e5), "{low:?} {size:?}");
    }
}

#[test]
fn grids_cover_their_rectangle_once_and_face_up() {
    let (size, place) = ([7, 4], |i: u32, j: u32| Point3::new(3.0 * f64::from(i), 2.0 * f64::from(j), 0.0));
    for mesh in [grid_by_rows(size, place), grid_by_columns(size, place)] {
        assert_eq!((mesh.0.len(), mesh.1.len(), open_edges(&mesh.1)), (40, 56, 22));
        assert!(areas(&mesh).iter().all(|a| (a - Vector3::new(0.0, 0.0, 3.0)).norm() < 1e-12));
    }
    // The numbering is what tells them apart.
    assert_eq!(grid_by_rows(size, place).0[1], place(1, 0));
    assert_eq!(grid_by_columns(size, place).0[1], place(0, 1));
}

#[test]
fn grids_around_an_axis_close_and_fill_their_ball() {
    let n = 60;
    let ball = grid_around([n, 2 * n], |i, j| {
        let (polar, turn) = (PI * f64::from(i) / f64::from(n), TAU * f64::from(j) / f64::from(2 * n));
        Point3::new(polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos()) * 10.0
    });
    // Only the edges of the poles, of no length, have one side.
    assert_eq!((ball.0.len(), open_edges(&ball.1)), (61 * 120, 2 * 120));
    let content = 4.0 / 3.0 * PI * 1000.0;
    assert!((0.995..1.0).contains(&(volume(&ball.0, &ball.1) / content)), "{}", volume(&ball.0, &ball.1) / content);
}

#[test]
fn balls_and_rings_are_closed_and_fill_their_shapes() {
    for (solid, content) in [
        (ball_mesh(10.0, [60, 120]), 4.0 / 3.0 * PI * 1000.0),
        (ring_mesh([20.0, 6.0], [200, 100]), 2.0 * PI * PI * 20.0 * 36.0),
    ] {
        assert_eq!(open_edges(&solid.1), 0);
        let share = volume(&solid.0, &solid.1) / content;
        assert!((0.995..1.0).contains(&share), "{share}");
    }
    // Only the last ring of a cap has one side; its area is 2 pi r h (Archimedes).
    let cap = cap_mesh(10.0, 1.0, [30, 90]);
    let area: f64 = areas(&cap).iter().map(Vector3::norm).sum();
    assert_eq!(open_edges(&cap.1), 90);
    assert!((area / (2.0 * PI * 100.0 * (1.0 - 1f64.cos())) - 1.0).abs() < 0.005, "{area}");
    assert!(areas(&cap).iter().all(|a| a.z > 0.0));
    let (vertices, triangles) = ball_mesh(3.0, [2, 3]);
    assert_eq!((vertices.len(), triangles.len(), open_edges(&triangles)), (5, 6, 0));
}

#[test]
fn soups_have_slivers_points_level_and_large_triangles() {
    let soup = soup_mesh(&mut Random(3), 56, [30.0, 25.0]);
    assert_eq!((soup.0.len(), soup.1.len()), (3 * 56, 56 + 8));
    let of_kind = |kind: usize| (kind..56).step_by(8).map(|k| [0, 1, 2].map(|c| soup.0[3 * k + c]));
    let area = |t: [Point3<f64>; 3]| 0.5 * (t[1] - t[0]).cross(&(t[2] - t[0])).norm();
    assert!([0, 2, 3].into_iter().flat_map(of_kind).all(|t| area(t) < 1e-6));
    assert!(of_kind(1).all(|t| area(t) < 0.05 && area(t) > 0.0));
    assert!(of_kind(4).all(|t| t[0].z == t[1].z && t[0].z == t[2].z));
    assert!(of_kind(5).any(|t| area(t) > 500.0));
}

#[test]
fn directions_are_of_length_1_and_poses_are_rigid() {
    let mut random = Random(8);
    let all: Vec<Vector3<f64>> = (0..DRAWS).map(|_| random.direction().into_inner()).collect();
    assert!(all.iter().all(|d| (d.norm() - 1.0).abs() < 1e-12));
    let mean = all.iter().sum::<Vector3<f64>>() / DRAWS as f64;
    // Each coordinate has the variance 1/3.
    assert!(mean.abs().max() < 5.0 / (3.0 * DRAWS as f64).sqrt(), "{mean}");
    let parallel = (0..DRAWS).filter(|_| {
        let pose = random.pose(7.0);
        assert!(pose.translation.vector.abs().max() <= 7.0);
        let axis = pose * Vector3::z();
        assert!((axis.norm() - 1.0).abs() < 1e-12);
        axis.abs().max() > 1.0 - 1e-12
    });
    let expected = DRAWS as f64 / 4.0;
    assert!((parallel.count() as f64 - expected).abs() < 5.0 * expected.sqrt());
}

#[test]
fn lines_cross_a_triangle_inside_and_pass_by_outside() {
    let t = [[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [0.0, 4.0, 1.0]].map(Point3::from);
    let from = |x: f64, y: f64, z: f64| crossing_of_line(&t, &Point3::new(x, y, z), &Vector3::new(0.0, 0.0, 2.0));
    assert_eq!(from(1.0, 1.0, 0.0), Some(0.5));
    assert_eq!(from(1.0, 1.0, 5.0), Some(-2.0));
    assert_eq!(from(2.1, 2.1, 0.0), None);
    assert_eq!(from(-0.1, 1.0, 0.0), None);
    assert_eq!(crossing_of_line(&t, &Point3::new(1.0, 1.0, 1.0), &Vector3::x()), None);
}

#[test]
fn golden_sections_find_least_values_inside_and_at_ends() {
    for at in [-1.0, 0.0, 0.3, 1.0, 4.0_f64] {
        let f = |x: f64| (x - at).powi(2);
        assert!((golden_least(40, f) - f(at.clamp(0.0, 1.0))).abs() < 1e-12, "{at}");
    }
    let mut random = Random(4);
    for _ in 0..50 {
        let t = [0; 3].map(|_| random.point(5.0));
        let p = random.point(8.0);
        let distance = |q: &Point3<f64>| (q - p).norm();
        let found = least_over_triangle(40, &t, distance);
        let share = |k: i32| f64::from(k) / 60.0;
        let nodes = (0..=60).flat_map(|i| (0..=60 - i).map(move |j| (share(i), share(j))));
        let dense = nodes.map(|(u, v)| distance(&(t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * v)));
        let dense = dense.fold(f64::INFINITY, f64::min);
        assert!(found <= dense + 1e-9 && found > dense - 0.5, "{found} {dense}");
    }
}
