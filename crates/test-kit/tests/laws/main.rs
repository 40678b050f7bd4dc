//! Laws of the kit itself: what it hands to the tests of other crates is what it says.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use facemill_test_kit::{Lcg, Mesh, Random, box_mesh, grid_around, grid_by_columns, grid_by_rows};
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
fn numbers_of_both_generators_keep_to_their_range_and_mean() {
    for seed in [0, 1, 77, u64::MAX] {
        let (mut random, mut lcg) = (Random(seed), Lcg(seed));
        assert_uniform("unit", [0.0, 1.0], || random.unit());
        assert_uniform("between", [-3.0, 7.5], || random.between(-3.0, 7.5));
        assert_uniform("unit of Lcg", [0.0, 1.0], || lcg.unit());
        assert_uniform("between of Lcg", [-3.0, 7.5], || lcg.between(-3.0, 7.5));
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

fn volume((vertices, triangles): &Mesh) -> f64 {
    let corners = triangles.iter().map(|t| t.map(|v| vertices[v as usize].coords));
    corners.map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0).sum()
}

/// Number of directed edges without the opposite one.
fn open_edges((_, triangles): &Mesh) -> i32 {
    let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
    for (a, b) in triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]) {
        *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
    }
    edges.values().map(|n| n.abs()).sum()
}

#[test]
fn boxes_are_closed_and_wound_outward() {
    let mut random = Random(5);
    for _ in 0..50 {
        let low = [0; 3].map(|_| random.between(-50.0, 50.0));
        let size = [0; 3].map(|_| random.between(0.1, 40.0));
        let solid = box_mesh(low, [0, 1, 2].map(|k| low[k] + size[k]));
        let content: f64 = size.iter().product();
        assert_eq!((solid.0.len(), solid.1.len(), open_edges(&solid)), (8, 12, 0));
        assert!((volume(&solid) - content).abs() < 1e-9 * (content + 1e5), "{low:?} {size:?}");
    }
}

#[test]
fn grids_cover_their_rectangle_once_and_face_up() {
    let (size, place) = ([7, 4], |i: u32, j: u32| Point3::new(3.0 * f64::from(i), 2.0 * f64::from(j), 0.0));
    for mesh in [grid_by_rows(size, place), grid_by_columns(size, place)] {
        assert_eq!((mesh.0.len(), mesh.1.len(), open_edges(&mesh)), (40, 56, 22));
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
    assert_eq!((ball.0.len(), open_edges(&ball)), (61 * 120, 2 * 120));
    let content = 4.0 / 3.0 * PI * 1000.0;
    assert!((0.995..1.0).contains(&(volume(&ball) / content)), "{}", volume(&ball) / content);
}
