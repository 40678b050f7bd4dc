//! Meshes of plain shapes, as vertices and triangles: each crate makes its own kind of mesh of
//! them.

use nalgebra::Point3;

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
    let pair = |(i, j): (u32, u32)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    squares.flat_map(pair).collect()
}
