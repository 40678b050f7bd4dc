//! Meshes of plain shapes, as vertices and triangles: each crate makes its own kind of mesh of
//! them.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Vector3};

use crate::random::Random;

/// Vertices (mm) and triangles as triples of their indices.
pub type Mesh = (Vec<Point3<f64>>, Vec<[u32; 3]>);

/// Box between two corners, 8 vertices and 12 triangles, wound outward where `low` is below `high`
/// along each axis. Vertex k is at `high` along the axes whose bits are set in k.
pub fn box_mesh(low: [f64; 3], high: [f64; 3]) -> Mesh {
    let corner = |k: usize| Point3::from([0, 1, 2].map(|axis| if k >> axis & 1 == 1 { high[axis] } else { low[axis] }));
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    ((0..8).map(corner).collect(), triangles.collect())
}

/// Grid of `n` × `m` squares whose nodes (i, j) lie at `place(i, j)`, numbered along i first.
///
/// Each square is cut from (i, j) to (i + 1, j + 1), and wound so that ∂place/∂i × ∂place/∂j points
/// outward. `place` is called once for each node, in the order of the vertices.
pub fn grid_by_rows([n, m]: [u32; 2], mut place: impl FnMut(u32, u32) -> Point3<f64>) -> Mesh {
    let nodes = (0..=m).flat_map(|j| (0..=n).map(move |i| (i, j)));
    let squares = (0..m).flat_map(|j| (0..n).map(move |i| (i, j)));
    (nodes.map(|(i, j)| place(i, j)).collect(), halves(squares, |i, j| j * (n + 1) + i))
}

/// Grid as that of [`grid_by_rows`], numbered along j first.
pub fn grid_by_columns([n, m]: [u32; 2], mut place: impl FnMut(u32, u32) -> Point3<f64>) -> Mesh {
    let nodes = (0..=n).flat_map(|i| (0..=m).map(move |j| (i, j)));
    let squares = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    (nodes.map(|(i, j)| place(i, j)).collect(), halves(squares, |i, j| i * (m + 1) + j))
}

/// Grid as that of [`grid_by_columns`] that closes along j: node (i, `m`) is node (i, 0).
///
/// Rows in one point, as poles of a ball, keep `m` vertices there and triangles without area.
pub fn grid_around([n, m]: [u32; 2], mut place: impl FnMut(u32, u32) -> Point3<f64>) -> Mesh {
    let nodes = (0..=n).flat_map(|i| (0..m).map(move |j| (i, j)));
    let squares = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    (nodes.map(|(i, j)| place(i, j)).collect(), halves(squares, |i, j| i * m + j % m))
}

/// Two triangles for each square.
fn halves(squares: impl Iterator<Item = (u32, u32)>, at: impl Fn(u32, u32) -> u32) -> Vec<[u32; 3]> {
    squares.flat_map(|(i, j)| halves_of([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])).collect()
}

/// Ball about the origin, closed and wound outward: `rows` rows of `around` patches over latitude
/// and longitude, one vertex at each pole, the first two of all, +z first.
///
/// Every other row is turned by half a patch, and both diagonals occur, as in meshes of other
/// programs. Vertices are on the ball, so the mesh lies within it.
pub fn ball_mesh(radius: f64, [rows, around]: [u32; 2]) -> Mesh {
    let mut vertices = vec![Point3::new(0.0, 0.0, radius), Point3::new(0.0, 0.0, -radius)];
    for (i, j) in (1..rows).flat_map(|i| (0..around).map(move |j| (i, j))) {
        let (s, c) = (PI * f64::from(i) / f64::from(rows)).sin_cos();
        let (sin, cos) = (TAU * (f64::from(j) + 0.5 * f64::from(i % 2)) / f64::from(around)).sin_cos();
        vertices.push(Point3::new(radius * s * cos, radius * s * sin, radius * c));
    }
    let at = |i: u32, j: u32| 2 + (i - 1) * around + j % around;
    let mut triangles = Vec::new();
    for j in 0..around {
        triangles.extend([[0, at(1, j), at(1, j + 1)], [1, at(rows - 1, j + 1), at(rows - 1, j)]]);
    }
    for (i, j) in (1..rows - 1).flat_map(|i| (0..around).map(move |j| (i, j))) {
        let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        triangles.extend(if i % 2 == 0 { other_halves_of(corners) } else { halves_of(corners) });
    }
    (vertices, triangles)
}

/// Cap of a ball about the origin around the pole +z, up to the polar angle `half_angle` (rad),
/// open and wound outward: `rings` rings of `around` patches, the vertex at the pole first.
pub fn cap_mesh(radius: f64, half_angle: f64, [rings, around]: [u32; 2]) -> Mesh {
    let mut vertices = vec![Point3::new(0.0, 0.0, radius)];
    for (ring, k) in (1..=rings).flat_map(|ring| (0..around).map(move |k| (ring, k))) {
        let (s, c) = (half_angle * f64::from(ring) / f64::from(rings)).sin_cos();
        let (sin, cos) = (TAU * f64::from(k) / f64::from(around)).sin_cos();
        vertices.push(Point3::new(radius * s * cos, radius * s * sin, radius * c));
    }
    let at = |ring: u32, k: u32| 1 + (ring - 1) * around + k % around;
    let mut triangles: Vec<_> = (0..around).map(|k| [0, at(1, k), at(1, k + 1)]).collect();
    for (ring, k) in (1..rings).flat_map(|ring| (0..around).map(move |k| (ring, k))) {
        triangles.extend(halves_of([at(ring, k), at(ring + 1, k), at(ring + 1, k + 1), at(ring, k + 1)]));
    }
    (vertices, triangles)
}

/// Ring about z, closed and wound outward: a circle of the radius `minor` around one of `major`, in
/// `n` × `m` patches, along the large circle first. Both diagonals occur.
pub fn ring_mesh([major, minor]: [f64; 2], [n, m]: [u32; 2]) -> Mesh {
    let place = |i: u32, j: u32| {
        let [(sin, cos), (s, c)] = [(i, n), (j, m)].map(|(k, n)| (TAU * f64::from(k) / f64::from(n)).sin_cos());
        let rho = major + minor * c;
        Point3::new(rho * cos, rho * sin, minor * s)
    };
    let at = |i: u32, j: u32| i % n * m + j % m;
    let patches = || (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    let triangles = patches().flat_map(|(i, j)| {
        let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        if (i + j) % 2 == 0 { halves_of(corners) } else { other_halves_of(corners) }
    });
    let triangles = triangles.collect();
    (patches().map(|(i, j)| place(i, j)).collect(), triangles)
}

/// Two triangles of a square, cut from its first corner to the third.
fn halves_of([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

/// Two triangles of a square, cut from its second corner to the fourth.
fn other_halves_of([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    [[a, b, d], [b, c, d]]
}

/// `n` unconnected triangles, one of each kind of [`odd_triangle`] after the other; every seventh
/// is there twice.
pub fn soup_mesh(random: &mut Random, n: u32, size: [f64; 2]) -> Mesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for k in 0..n {
        let first = vertices.len() as u32;
        vertices.extend(odd_triangle(random, k, size));
        let copies = if k % 7 == 0 { 2 } else { 1 };
        triangles.extend(std::iter::repeat_n([first, first + 1, first + 2], copies));
    }
    (vertices, triangles)
}

/// Triangle of the awkward kind `kind` % 8: slivers of two widths, one without area, a point with
/// an edge, a level one, a large one, and two of any shape.
///
/// Its first corner is within `reach` (mm) of the origin along each axis, and its edges from there
/// are up to `edge` long, those of the large one four times as long.
pub fn odd_triangle(random: &mut Random, kind: u32, [reach, edge]: [f64; 2]) -> [Point3<f64>; 3] {
    let a = random.point(reach);
    let [u, v] = [0; 2].map(|_| random.direction().into_inner() * random.between(0.1, edge));
    match kind % 8 {
        0 => [a, a + u, a + u * 0.6 + v * 1e-9],
        1 => [a, a + u, a + u * 0.6 + v * 1e-4],
        2 => [a, a + u, a + u * 0.3],
        3 => [a, a, a + u],
        4 => [a, a + Vector3::new(u.x, u.y, 0.0), a + Vector3::new(v.x, v.y, 0.0)],
        5 => [a, a + u * 4.0, a + v * 4.0],
        _ => [a, a + u, a + v],
    }
}
