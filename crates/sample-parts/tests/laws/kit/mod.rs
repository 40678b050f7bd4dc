//! Measuring meshes: independent of the code that makes them.
#![allow(dead_code, reason = "every test uses its share")]

use facemill_blade_file::{BladeFile, read_blade};
use facemill_sample_parts::BladeSections;
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use facemill_surface_model::TriMesh;
use nalgebra::{Point2, Point3};

/// Edges by their ends, with how often they are run through forward and backward.
fn edge_counts(mesh: &TriMesh) -> BTreeMap<(u32, u32), (usize, usize)> {
    let mut counts = BTreeMap::new();
    for t in mesh.triangles() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            let (forward, backward): &mut (usize, usize) = counts.entry((a.min(b), a.max(b))).or_default();
            if a < b { *forward += 1 } else { *backward += 1 }
        }
    }
    counts
}

/// Every edge is used by two triangles, in opposite senses.
pub(crate) fn is_closed(mesh: &TriMesh) -> bool {
    edge_counts(mesh).values().all(|&count| count == (1, 1))
}

/// No edge is used twice in the same sense.
pub(crate) fn is_consistent(mesh: &TriMesh) -> bool {
    edge_counts(mesh).values().all(|&(forward, backward)| forward <= 1 && backward <= 1)
}

/// Volume by the divergence theorem, mm³.
pub(crate) fn volume(mesh: &TriMesh) -> f64 {
    facemill_test_kit::volume(mesh.vertices(), mesh.triangles())
}

/// Triangles of a group.
pub(crate) fn group(mesh: &TriMesh, name: &str) -> std::ops::Range<usize> {
    mesh.groups().iter().find(|g| g.name == name).unwrap_or_else(|| panic!("no group {name}")).triangles.clone()
}

/// Largest angle between neighbouring facets of some triangles, rad.
pub(crate) fn largest_bend(mesh: &TriMesh, triangles: std::ops::Range<usize>) -> f64 {
    let mut beside = BTreeMap::<(u32, u32), Vec<usize>>::new();
    for t in triangles {
        let [a, b, c] = mesh.triangles()[t];
        for (p, q) in [(a, b), (b, c), (c, a)] {
            beside.entry((p.min(q), p.max(q))).or_default().push(t);
        }
    }
    let pairs = beside.values().filter(|pair| pair.len() == 2);
    pairs.map(|pair| mesh.scaled_normal(pair[0]).angle(&mesh.scaled_normal(pair[1]))).fold(0.0, f64::max)
}

/// Where a mesh cuts the cylinder of a radius about z, unrolled to (r·θ, z), θ from +X; one segment
/// per cut triangle.
pub(crate) fn cylinder_cut(mesh: &TriMesh, radius: f64) -> Vec<[Point2<f64>; 2]> {
    let mut segments = Vec::new();
    for t in 0..mesh.triangles().len() {
        let corners = mesh.corners(t);
        let crossings: Vec<_> =
            (0..3).filter_map(|k| edge_crossing(&corners[k], &corners[(k + 1) % 3], radius)).collect();
        if let [p, q] = crossings[..] {
            segments.push([unrolled(&p, radius), unrolled(&q, radius)]);
        }
    }
    segments
}

pub(crate) fn unrolled(p: &Point3<f64>, radius: f64) -> Point2<f64> {
    Point2::new(radius * p.y.atan2(p.x), p.z)
}

fn edge_crossing(p: &Point3<f64>, q: &Point3<f64>, radius: f64) -> Option<Point3<f64>> {
    let outside = |p: &Point3<f64>| p.x.hypot(p.y) >= radius;
    if outside(p) == outside(q) {
        return None;
    }
    let (mut a, mut b) = (*p, *q);
    for _ in 0..60 {
        let middle = nalgebra::center(&a, &b);
        if outside(&middle) == outside(p) { a = middle } else { b = middle }
    }
    Some(a)
}

/// Where the open edges of a mesh go through the cylinder of a radius about z, unrolled.
pub(crate) fn open_edges_on_cylinder(mesh: &TriMesh, radius: f64) -> Vec<Point2<f64>> {
    let open = edge_counts(mesh).into_iter().filter(|&(_, (forward, backward))| forward + backward == 1);
    let vertex = |v: u32| &mesh.vertices()[v as usize];
    open.filter_map(|((a, b), _)| edge_crossing(vertex(a), vertex(b), radius)).map(|p| unrolled(&p, radius)).collect()
}

/// A cylinder cut turned into section coordinates: along the helix of a pitch and across it, origin
/// where θ = z = 0.
pub(crate) struct Cut {
    pub(crate) segments: Vec<[Point2<f64>; 2]>,
}

impl Cut {
    pub(crate) fn new(mesh: &TriMesh, radius: f64, pitch: f64) -> Self {
        let (sin, cos) = pitch.atan2(std::f64::consts::TAU * radius).sin_cos();
        let turn = |p: Point2<f64>| Point2::new(p.x * cos + p.y * sin, p.y * cos - p.x * sin);
        Self { segments: cylinder_cut(mesh, radius).into_iter().map(|s| s.map(turn)).collect() }
    }

    /// The points farthest along the helix: leading and trailing edge.
    pub(crate) fn ends(&self) -> [Point2<f64>; 2] {
        let points = || self.segments.iter().flatten().copied();
        let leading = points().reduce(|a, b| if b.x > a.x { b } else { a });
        let trailing = points().reduce(|a, b| if b.x < a.x { b } else { a });
        [leading.expect("cut is not empty"), trailing.expect("cut is not empty")]
    }

    pub(crate) fn chord(&self) -> f64 {
        let [leading, trailing] = self.ends();
        leading.x - trailing.x
    }

    /// Heights of the section over a chord fraction from the leading edge, low and high.
    pub(crate) fn heights(&self, chord_fraction: f64) -> [f64; 2] {
        let [leading, trailing] = self.ends();
        let s = leading.x + (trailing.x - leading.x) * chord_fraction;
        let over = self.segments.iter().filter(|[a, b]| (a.x < s) != (b.x < s));
        let heights = over.map(|[a, b]| a.y + (b.y - a.y) * (s - a.x) / (b.x - a.x));
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], h| [low.min(h), high.max(h)])
    }
}

/// Triangles of a mesh in runs of neighbours, each in a ball.
pub(crate) struct TriangleRuns(Vec<TriangleRun>);

struct TriangleRun {
    centre: Point3<f64>,
    radius: f64,
    triangles: Vec<[Point3<f64>; 3]>,
}

impl TriangleRuns {
    pub(crate) fn of(mesh: &TriMesh) -> Self {
        let all: Vec<_> = (0..mesh.triangles().len()).map(|t| mesh.corners(t)).collect();
        let run = |triangles: &[[Point3<f64>; 3]]| {
            let corners = || triangles.iter().flatten();
            let sum = corners().fold(nalgebra::Vector3::zeros(), |sum, p| sum + p.coords);
            let centre = Point3::from(sum / (3.0 * triangles.len() as f64));
            let radius = corners().map(|p| (p - centre).norm()).fold(0.0, f64::max);
            TriangleRun { centre, radius, triangles: triangles.to_vec() }
        };
        Self(all.chunks(32).map(run).collect())
    }

    /// Distance of a point from the mesh, by all triangles of every run whose ball is near enough.
    pub(crate) fn distance(&self, point: &Point3<f64>) -> f64 {
        let off = |run: &TriangleRun| (point - run.centre).norm() - run.radius;
        let of_run = |run: &TriangleRun| {
            run.triangles.iter().map(|t| distance_point_triangle(point, t)).fold(f64::INFINITY, f64::min)
        };
        let nearest = self.0.iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("a triangle");
        let first = of_run(nearest);
        self.0.iter().fold(first, |best, run| if off(run) < best { best.min(of_run(run)) } else { best })
    }
}

fn distance_point_triangle(p: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> f64 {
    // Barycentric coordinates in the plane; outside, the nearest of the edges.
    let (u, v, w) = (b - a, c - a, p - a);
    let (uu, uv, vv, wu, wv) = (u.dot(&u), u.dot(&v), v.dot(&v), w.dot(&u), w.dot(&v));
    let det = uu * vv - uv * uv;
    let (s, t) = ((vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det);
    if det > 0.0 && s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        return (w - u * s - v * t).norm();
    }
    let edge = |q: &Point3<f64>, r: &Point3<f64>| {
        let d = r - q;
        let k = ((p - q).dot(&d) / d.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (p - (q + d * k)).norm()
    };
    edge(a, b).min(edge(b, c)).min(edge(c, a))
}

/// Pairs of triangles without a common vertex that cut through each other.
pub(crate) fn self_intersections(mesh: &TriMesh) -> Vec<(usize, usize)> {
    let n = mesh.triangles().len();
    let corners: Vec<_> = (0..n).map(|t| mesh.corners(t)).collect();
    let range = |t: usize, axis: usize| {
        let c = corners[t].map(|p| p[axis]);
        (c[0].min(c[1]).min(c[2]), c[0].max(c[1]).max(c[2]))
    };
    let boxes: Vec<_> = (0..n).map(|t| [range(t, 0), range(t, 1), range(t, 2)]).collect();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| boxes[a][0].0.total_cmp(&boxes[b][0].0));
    let mut found = Vec::new();
    for (k, &s) in order.iter().enumerate() {
        for &t in order[k + 1..].iter().take_while(|&&t| boxes[t][0].0 <= boxes[s][0].1) {
            let apart = (1..3).any(|axis| boxes[s][axis].0 > boxes[t][axis].1 || boxes[t][axis].0 > boxes[s][axis].1);
            let share = mesh.triangles()[s].iter().any(|v| mesh.triangles()[t].contains(v));
            if !apart && !share && (pierces(&corners[s], &corners[t]) || pierces(&corners[t], &corners[s])) {
                found.push((s, t));
            }
        }
    }
    found
}

/// An edge of `s` goes through the inside of `t`, by more than the rounding of facets in one plane.
fn pierces(s: &[Point3<f64>; 3], t: &[Point3<f64>; 3]) -> bool {
    let volume =
        |a: &Point3<f64>, b: &Point3<f64>, c: &Point3<f64>, d: &Point3<f64>| (b - a).cross(&(c - a)).dot(&(d - a));
    let rounding = 1e-9 * (t[1] - t[0]).cross(&(t[2] - t[0])).norm();
    (0..3).any(|k| {
        let (p, q) = (&s[k], &s[(k + 1) % 3]);
        let sides = [volume(&t[0], &t[1], &t[2], p), volume(&t[0], &t[1], &t[2], q)];
        let around = [0, 1, 2].map(|i| volume(p, q, &t[i], &t[(i + 1) % 3]));
        let is_through = sides[0] * sides[1] < 0.0 && sides.iter().all(|side| side.abs() > rounding);
        is_through && (around.iter().all(|&v| v > 0.0) || around.iter().all(|&v| v < 0.0))
    })
}

/// A file of the shared data, or `None` with the reason printed when it is not there.
pub(crate) fn shared(file: &str) -> Option<PathBuf> {
    let root = std::env::var_os("FACEMILL_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let path = root.join(file);
    if path.is_file() {
        return Some(path);
    }
    println!("skipped: {} is not there (set FACEMILL_SHARED to the folder of shared data)", path.display());
    None
}

/// Triangles of an STL file as they are, binary or ASCII.
pub(crate) fn read_stl(path: &Path) -> Vec<[Point3<f64>; 3]> {
    let bytes = std::fs::read(path).expect("the file can be read");
    let count = bytes.get(80..84).map_or(0, |n| u32::from_le_bytes(n.try_into().expect("four bytes")) as usize);
    let numbers: Vec<f64> = if bytes.len() == 84 + 50 * count {
        let float = |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")));
        (0..count).flat_map(|t| (0..9).map(move |k| 84 + 50 * t + 12 + 4 * k)).map(float).collect()
    } else {
        let text = String::from_utf8(bytes).expect("ASCII");
        let lines = text.lines().filter_map(|line| line.trim().strip_prefix("vertex"));
        lines.flat_map(str::split_whitespace).map(|word| word.parse().expect("a number")).collect()
    };
    let point = |c: &[f64]| Point3::new(c[0], c[1], c[2]);
    numbers.chunks_exact(9).map(|c| [point(&c[..3]), point(&c[3..6]), point(&c[6..])]).collect()
}

/// A mesh of loose triangles, vertices at equal places welded.
pub(crate) fn welded(triangles: &[[Point3<f64>; 3]]) -> TriMesh {
    let (mut vertices, mut known) = (Vec::new(), BTreeMap::new());
    let mut index = |p: &Point3<f64>| {
        *known.entry([p.x, p.y, p.z].map(|c| (c + 0.0).to_bits())).or_insert_with(|| {
            vertices.push(*p);
            vertices.len() as u32 - 1
        })
    };
    let triangles = triangles.iter().map(|t| [index(&t[0]), index(&t[1]), index(&t[2])]).collect();
    TriMesh::new(vertices, triangles).expect("finite and in range")
}

/// A blade of the shared data by its `.inf` file, with its sections; `None` where it is absent.
pub(crate) fn shared_blade(name: &str) -> Option<(BladeFile, BladeSections)> {
    let path = shared(&format!("data/blades/{name}"))?;
    let open = |file: &str| std::fs::read(path.with_file_name(file)).map_err(|e| e.to_string());
    let file = read_blade(name, &std::fs::read(&path).unwrap(), open).unwrap();
    let sections = file.blades[0].sections.iter().map(|section| section.points.clone()).collect();
    Some((file, BladeSections { sections, ..BladeSections::default() }))
}
