use std::f64::consts::TAU;

use facemill_surface_model::{Surface, TriMesh};
use nalgebra::{Point3, Vector3};

use super::*;
use crate::distance::source_curve::CurveNode;
use crate::region::Region;
use crate::strategy::patch::Fineness;
use crate::test_kit::{Random, grid, surface};

fn patch_of(surface: &Surface) -> Patch<'_> {
    let fineness = Fineness { max_edge: f64::INFINITY, max_bend: f64::INFINITY, cuts_range: false };
    Patch::new(surface, &Region::default(), None, &fineness).unwrap()
}

/// Vertex of a patch at a vertex of the mesh that it was made of.
fn at(patch: &Patch, v: u32) -> u32 {
    let p = patch.surface.mesh().vertices()[v as usize];
    patch.mesh.vertices().iter().position(|q| *q == p).unwrap() as u32
}

/// The curve through some vertices of the mesh.
fn along(patch: &Patch, vertices: &PatchVertices, through: impl Iterator<Item = u32>, closed: bool) -> SourceCurve {
    let node = |v: u32| {
        let v = at(patch, v);
        let (position, normal) = (patch.mesh.vertices()[v as usize], vertices.normal(v));
        CurveNode { position, normal, triangle: vertices.triangles(v)[0] }
    };
    SourceCurve::new(through.map(node).collect(), closed).unwrap()
}

/// The meshes of `tests/data/geodesic.py`.
mod golden {
    use super::*;

    pub(super) const N: [u32; 2] = [48, 96];
    pub(super) const SOURCE: u32 = 12;

    fn jitter(i: u32, j: u32) -> (f64, f64) {
        if [0, SOURCE, N[0]].contains(&i) || [0, N[1]].contains(&j) {
            return (0.0, 0.0);
        }
        let wave = |a: f64| (a.sin().abs() * 43758.5453).fract() - 0.5;
        let (i, j) = (f64::from(i), f64::from(j));
        (0.6 * wave(12.9898 * i + 78.233 * j), 0.6 * wave(39.346 * i + 11.135 * j))
    }

    fn place(name: &str, u: f64, v: f64) -> Point3<f64> {
        let angle = 1.6 * (u - 0.5);
        match name {
            "plane" => Point3::new(48.0 * u, 384.0 * v, 0.0),
            "cylinder" => Point3::new(40.0 * angle.sin(), 60.0 * v, 40.0 * angle.cos()),
            "torus" => {
                let (ring, turn) = (80.0 + 30.0 * angle.cos(), 0.8 * v);
                Point3::new(ring * turn.cos(), ring * turn.sin(), 30.0 * angle.sin())
            }
            _ => {
                let (x, y) = (60.0 * u, 80.0 * v);
                Point3::new(x, y, 6.0 * (x / 11.0).sin() * (y / 13.0).cos() + 0.1 * y)
            }
        }
    }

    pub(super) fn mesh(name: &str) -> TriMesh {
        let mut vertices = Vec::new();
        for i in 0..=N[0] {
            for j in 0..=N[1] {
                let (di, dj) = jitter(i, j);
                let (u, v) = ((f64::from(i) + di) / f64::from(N[0]), (f64::from(j) + dj) / f64::from(N[1]));
                vertices.push(place(name, u, v));
            }
        }
        let at = |i: u32, j: u32| i * (N[1] + 1) + j;
        let cells = (0..N[0]).flat_map(|i| (0..N[1]).map(move |j| (i, j)));
        let triangles = cells
            .flat_map(|(i, j)| {
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                [[a, b, c], [a, c, d]]
            })
            .collect();
        TriMesh::new(vertices, triangles).unwrap()
    }
}

#[test]
fn distances_are_those_of_exact_geodesics() {
    let lines = include_str!("../../data/geodesic.csv").lines().skip(1);
    let exact: Vec<(&str, u32, f64)> = lines
        .map(|l| {
            let mut fields = l.split(',');
            let mut next = || fields.next().unwrap();
            (next(), next().parse().unwrap(), next().parse().unwrap())
        })
        .collect();
    assert!(exact.len() >= 160);
    for (name, most) in [("plane", 1e-6), ("cylinder", 2e-4), ("torus", 2e-4), ("waves", 1e-3)] {
        let s = surface(golden::mesh(name));
        let patch = patch_of(&s);
        let vertices = PatchVertices::of(&patch);
        let row = golden::N[1] + 1;
        let curve = [along(&patch, &vertices, (0..row).map(|j| golden::SOURCE * row + j), false)];
        let distance = CurveDistance::new(&patch, &vertices, &curve, 25.0, |_| true);
        let (mut n, mut largest) = (0, 0.0f64);
        for &(_, v, exact) in exact.iter().filter(|(mesh, ..)| *mesh == name) {
            let v = at(&patch, v);
            let foot = distance.foot(&[v], &patch.mesh.vertices()[v as usize], &vertices.normal(v)).unwrap();
            largest = largest.max((foot.distance / exact - 1.0).abs());
            n += 1;
        }
        println!("{name}: {largest:.2e}");
        assert!(n >= 40 && largest < most, "{name}: {largest} at {n} places");
    }
}

/// Torus about the z axis: ring radius 80, tube radius 30, with triangles stretched 4:1.
fn torus(n: u32) -> TriMesh {
    grid(n, n + n / 20, |u, v| {
        let wobble = 0.3 / f64::from(n) * (97.0 * u * v).sin() * u * (1.0 - u);
        let (polar, turn) = (2.0 * (u + wobble - 0.5), 2.4 * v);
        let ring = 80.0 + 30.0 * polar.cos();
        Point3::new(ring * turn.cos(), ring * turn.sin(), 30.0 * polar.sin())
    })
}

#[test]
fn distances_on_a_stretched_torus_carry_less_noise_than_20_um() {
    let s = surface(torus(80));
    let patch = patch_of(&s);
    let vertices = PatchVertices::of(&patch);
    let curve = [along(&patch, &vertices, (0..=84).map(|j| j * 81), false)];
    let distance = CurveDistance::new(&patch, &vertices, &curve, 25.0, |_| true);
    let mut rng = Random(5);
    let (mut n, mut largest) = (0, 0.0f64);
    for (t, corners) in patch.mesh.triangles().iter().enumerate() {
        let (u, v) = (rng.unit(), rng.unit());
        let [a, b, c] = corners.map(|v| patch.mesh.vertices()[v as usize].coords);
        let p = Point3::from(a * (1.0 - u) + b * (u * (1.0 - v)) + c * (u * v));
        let Some(foot) = distance.foot(corners, &p, &patch.normal(t as u32, &p)) else { continue };
        let polar = p.z.atan2(p.x.hypot(p.y) - 80.0);
        let exact = 30.0 * (polar + 1.0);
        if foot.at.beyond == 0.0 && exact < 20.0 {
            largest = largest.max((foot.distance - exact).abs());
            n += 1;
        }
    }
    assert!(n > 4000 && largest < 0.02, "{largest} at {n} places");
}

#[test]
fn signs_and_feet_follow_a_closed_curve() {
    let s = surface(grid(60, 60, |u, v| Point3::new(60.0 * u - 30.0, 60.0 * v - 30.0, 0.0)));
    let patch = patch_of(&s);
    let vertices = PatchVertices::of(&patch);
    let normal = Vector3::z_axis();
    // A circle of 15 mm, counter-clockwise: its inside is on the left.
    let nodes = (0..90).map(|k| {
        let turn = TAU * f64::from(k) / 90.0;
        let position = Point3::new(15.0 * turn.cos(), 15.0 * turn.sin(), 0.0);
        let triangle = s.closest_point(&position, 1.0).unwrap().triangle;
        CurveNode { position, normal, triangle }
    });
    let circle = [SourceCurve::new(nodes.collect(), true).unwrap()];
    assert!(circle[0].is_closed() && (circle[0].length() / (TAU * 15.0) - 1.0).abs() < 1e-3);
    let distance = CurveDistance::new(&patch, &vertices, &circle, 12.0, |_| true);
    assert!(distance.reached().windows(2).all(|w| w[0].1.distance <= w[1].1.distance));
    for (v, foot) in distance.reached() {
        let p = patch.mesh.vertices()[*v as usize];
        let radius = p.coords.norm();
        assert!((foot.across - (15.0 - radius)).abs() < 2e-4, "{p}: {}", foot.across);
        if radius > 1.0 && foot.distance > 0.01 {
            let out = p.coords / radius * (radius - 15.0).signum();
            assert!((foot.away - out).norm() < 2e-3, "{p}: {} for {out}", foot.away);
            assert!((foot.at.position.coords - p.coords / radius * 15.0).norm() < 0.01);
        }
    }
    assert!(distance.foot(&patch.mesh.triangles()[0], &Point3::new(-29.0, -29.0, 0.0), &normal).is_none());
}

#[test]
fn places_beyond_an_end_keep_their_side() {
    let s = surface(grid(40, 40, |u, v| Point3::new(40.0 * u, 40.0 * v, 0.0)));
    let patch = patch_of(&s);
    let vertices = PatchVertices::of(&patch);
    // Along x from 10 to 20 at y = 20.
    let curve = [along(&patch, &vertices, (10..=20).map(|i| 20 * 41 + i), false)];
    let curve_x = |k: usize| curve[0].foot(&Point3::new(10.0 * k as f64, 20.0, 0.0), 0).way;
    assert!((curve_x(1) - 0.0).abs() < 1e-12 && (curve_x(2) - 10.0).abs() < 1e-12);
    let distance = CurveDistance::new(&patch, &vertices, &curve, 15.0, |_| true);
    for (v, foot) in distance.reached() {
        let p = patch.mesh.vertices()[*v as usize];
        let beyond = (10.0 - p.x).max(p.x - 20.0).max(0.0);
        assert!((foot.at.beyond - beyond).abs() < 1e-9 && (foot.across.abs() - (p.y - 20.0).abs()).abs() < 1e-9);
        assert!((foot.distance - (p.y - 20.0).hypot(beyond)).abs() < 1e-9);
        assert!((p.y - 20.0).abs() < 1e-9 || foot.across.signum() == (p.y - 20.0).signum());
    }
}

#[test]
fn the_other_side_of_a_thin_blade_is_out_of_reach() {
    // A sheet folded over at x = 0 with a gap of 0.2 mm, 60 mm long on each side.
    let fold = |u: f64, v: f64| {
        let x = 120.0 * (u - 0.5);
        Point3::new(x.abs(), 40.0 * v, 0.1 * (x / 0.5).clamp(-1.0, 1.0))
    };
    let s = surface(grid(120, 10, fold));
    let patch = patch_of(&s);
    let vertices = PatchVertices::of(&patch);
    let curve = [along(&patch, &vertices, (0..=10).map(|j| j * 121 + 20), false)];
    let distance = CurveDistance::new(&patch, &vertices, &curve, 20.0, |_| true);
    assert!(distance.reached().len() >= 41 * 11 - 11 && distance.reached().len() <= 41 * 11 + 11);
    assert!(distance.reached().iter().all(|(v, _)| patch.mesh.vertices()[*v as usize].z < 0.1 - 1e-9));
}

#[test]
fn what_is_not_passed_on_ends_the_band() {
    let s = surface(grid(40, 4, |u, v| Point3::new(40.0 * u, 4.0 * v, 0.0)));
    let patch = patch_of(&s);
    let vertices = PatchVertices::of(&patch);
    let curve = [along(&patch, &vertices, (0..5).map(|j| j * 41 + 20), false)];
    let right = |v: u32| patch.mesh.vertices()[v as usize].x > 19.5;
    let distance = CurveDistance::new(&patch, &vertices, &curve, 100.0, right);
    let least = distance.reached().iter().map(|(v, _)| patch.mesh.vertices()[*v as usize].x).fold(f64::MAX, f64::min);
    let most = distance.reached().iter().map(|(v, _)| patch.mesh.vertices()[*v as usize].x).fold(0.0, f64::max);
    assert!((19.0..20.0).contains(&least) && most == 40.0, "{least}..{most}");
}

#[test]
fn distances_with_a_store_that_was_used_are_the_same() {
    let s = surface(grid(40, 30, |u, v| Point3::new(40.0 * u, 30.0 * v, 3.0 * (6.0 * u).sin() * (5.0 * v).cos())));
    let patch = patch_of(&s);
    let vertices = PatchVertices::of(&patch);
    let column = |i: u32| [along(&patch, &vertices, (0..=30).map(|j| j * 41 + i), false)];
    let (curves, mut store) = ([8, 20, 12].map(column), DistanceStore::new(&patch));
    for (curve, reach) in curves.iter().zip([15.0, 6.0, 9.0]) {
        let below = |v: u32| patch.mesh.vertices()[v as usize].y < 20.0;
        let alone = CurveDistance::new(&patch, &vertices, curve, reach, below);
        let shared = CurveDistance::with_store(&patch, &vertices, curve, reach, below, store);
        assert_eq!(format!("{:?}", alone.reached()), format!("{:?}", shared.reached()));
        for v in 0..patch.mesh.vertices().len() as u32 {
            assert_eq!(format!("{:?}", alone.foot_of(v)), format!("{:?}", shared.foot_of(v)));
        }
        store = shared.into_store();
    }
}
