use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

use crate::map::{ZMapError, ZMapSettings, grid_over};
use crate::raster::{Grid, extent, height_over, width_at};

/// The heights of a Z-map's nodes alone: what the paper's test needs, at a fraction of the time of a [`crate::ZMap`],
/// whose proven maxima of the cells they lack.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeHeights {
    grid: Grid,
    nodes: Vec<f64>,
}

impl NodeHeights {
    /// The largest z of a mesh over every node, in the frame that `map_from_mesh` leads to; exact up to rounding.
    ///
    /// Runs in parallel; the result does not depend on the number of threads.
    ///
    /// # Errors
    /// As [`crate::ZMap::build`].
    pub fn build(mesh: &TriMesh, map_from_mesh: &Isometry3<f64>, settings: &ZMapSettings) -> Result<Self, ZMapError> {
        let vertices = moved(mesh, map_from_mesh);
        let grid = grid_over(mesh, &vertices, map_from_mesh, settings)?;
        Ok(Self { grid, nodes: rasterised(&grid, &vertices, mesh.triangles()) })
    }

    /// Number of nodes along x and y.
    pub fn n_nodes(&self) -> [usize; 2] {
        [self.grid.nx + 1, self.grid.ny + 1]
    }

    /// Position of the node (i, j) in the map's xy plane.
    pub fn node_position(&self, i: usize, j: usize) -> [f64; 2] {
        [self.grid.node_x(i), self.grid.node_y(j)]
    }

    /// Height of the mesh over the node (i, j), map frame, mm. `None` where there is no surface or no such node.
    pub fn node_height(&self, i: usize, j: usize) -> Option<f64> {
        let [nx, ny] = self.n_nodes();
        (i < nx && j < ny).then(|| self.nodes[j * nx + i]).filter(|z| z.is_finite())
    }
}

/// Rows of nodes per unit of parallel work.
const STRIP: usize = 16;

/// Triangles sorted into strips at a time.
const CHUNK: usize = 1 << 14;

/// Columns of nodes from which a row of a triangle is looked at between its edges only.
const WIDE: usize = 8;

/// What the rows and columns of a triangle are widened by, in cells: covers the rounding of a division, and costs the test of
/// a node now and then.
const MARGIN: f64 = 1e-6;

/// The mesh's vertices in the map's frame.
pub(crate) fn moved(mesh: &TriMesh, map_from_mesh: &Isometry3<f64>) -> Vec<Point3<f64>> {
    let (turn, shift) = (map_from_mesh.rotation.to_rotation_matrix(), map_from_mesh.translation.vector);
    mesh.vertices().par_iter().map(|p| Point3::from(turn * p.coords + shift)).collect()
}

/// Heights of the nodes, row by row; −∞ where there is no surface.
pub(crate) fn rasterised(grid: &Grid, vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<f64> {
    let n = grid.nx + 1;
    let corners = |t: &[u32; 3]| t.map(|v| vertices[v as usize]);
    let n_strips = (grid.ny + 1).div_ceil(STRIP);
    let binned: Vec<Binned> = triangles
        .par_chunks(CHUNK)
        .map(|chunk| Binned::new(chunk.iter().map(|t| Window::of(grid, &corners(t))), n_strips))
        .collect();
    // Zeros come from the system as they are needed, by the thread that fills them.
    let mut nodes = vec![0.0; n * (grid.ny + 1)];
    nodes.par_chunks_mut(STRIP * n).enumerate().for_each(|(strip, rows)| {
        rows.fill(f64::NEG_INFINITY);
        for (chunk, binned) in triangles.chunks(CHUNK).zip(&binned) {
            for &t in binned.of(strip) {
                raise(grid, &corners(&chunk[t as usize]), STRIP * strip, rows);
            }
        }
    });
    nodes
}

/// Columns and rows of the nodes that may be under or over a triangle, both ends included.
#[derive(Clone, Copy)]
struct Window {
    columns: [usize; 2],
    rows: [usize; 2],
}

impl Window {
    /// `None` where there is no node.
    #[inline(always)]
    fn of(grid: &Grid, t: &[Point3<f64>; 3]) -> Option<Self> {
        let per_cell = 1.0 / grid.cell;
        let range = |a: f64, b: f64, c: f64, from: f64, last: usize| {
            let low = (a.min(b).min(c) - from) * per_cell - MARGIN;
            let high = (a.max(b).max(c) - from) * per_cell + MARGIN;
            // Conversion takes what is negative to 0; past the last node there is nothing.
            let first = low as usize + usize::from(low > 0.0);
            (high >= 0.0).then_some([first, (high as usize).min(last)]).filter(|r| r[0] <= r[1])
        };
        Some(Self {
            columns: range(t[0].x, t[1].x, t[2].x, grid.x0, grid.nx)?,
            rows: range(t[0].y, t[1].y, t[2].y, grid.y0, grid.ny)?,
        })
    }
}

/// The triangles of a chunk by strips of rows, in the order of the mesh.
struct Binned {
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl Binned {
    fn new(windows: impl Iterator<Item = Option<Window>>, n_strips: usize) -> Self {
        let some: Vec<(u32, [usize; 2])> =
            (0..).zip(windows).filter_map(|(t, w)| w.map(|w| (t, w.rows.map(|j| j / STRIP)))).collect();
        let mut starts = vec![0u32; n_strips + 1];
        some.iter().for_each(|(_, [low, high])| (*low..=*high).for_each(|k| starts[k + 1] += 1));
        (1..=n_strips).for_each(|k| starts[k] += starts[k - 1]);
        let mut free = starts.clone();
        let mut triangles = vec![0; starts[n_strips] as usize];
        for (t, [low, high]) in some {
            for at in &mut free[low..=high] {
                triangles[*at as usize] = t;
                *at += 1;
            }
        }
        Self { starts, triangles }
    }

    fn of(&self, strip: usize) -> &[u32] {
        &self.triangles[self.starts[strip] as usize..self.starts[strip + 1] as usize]
    }
}

/// Raises nodes to the triangle where they are below it; `nodes` are whole rows from `first_row` on.
#[inline(always)]
fn raise(grid: &Grid, t: &[Point3<f64>; 3], first_row: usize, nodes: &mut [f64]) {
    let Some(window) = Window::of(grid, t) else { return };
    let n = grid.nx + 1;
    let edges = [Edge::new(&t[1], &t[2]), Edge::new(&t[2], &t[0]), Edge::new(&t[0], &t[1])];
    let low = t[0].z.min(t[1].z).min(t[2].z);
    let high = t[0].z.max(t[1].z).max(t[2].z);
    let [first, last] = window.rows;
    for j in first.max(first_row)..=last.min(first_row + nodes.len() / n - 1) {
        let y = grid.node_y(j);
        let [left, right] = if window.columns[1] - window.columns[0] < WIDE {
            window.columns
        } else {
            let Some(columns) = between_edges(grid, t, y, &window) else { continue };
            columns
        };
        let at_row = edges.map(|e| e.dx * (y - e.ay));
        let row = &mut nodes[(j - first_row) * n..(j - first_row + 1) * n];
        if left > right {
            continue;
        }
        for (k, height) in row[left..=right].iter_mut().enumerate() {
            let x = grid.node_x(left + k);
            let [a, b, c] = [0, 1, 2].map(|k| edges[k].sign * (at_row[k] - edges[k].dy * (x - edges[k].ax)));
            if !((a >= 0.0 && b >= 0.0 && c >= 0.0) || (a <= 0.0 && b <= 0.0 && c <= 0.0)) {
                continue;
            }
            let sum = a + b + c;
            if sum == 0.0 {
                *height = height.max(height_over(t, x, y).unwrap_or(f64::NEG_INFINITY));
            } else {
                let z = (a * t[0].z + b * t[1].z + c * t[2].z) / sum;
                *height = height.max(z.max(low).min(high));
            }
        }
    }
}

/// Columns between the edges of a triangle at y, widened by a cell; `None` where y is beyond the triangle.
fn between_edges(grid: &Grid, t: &[Point3<f64>; 3], y: f64, window: &Window) -> Option<[usize; 2]> {
    let [low, high] = extent(t, 1);
    if !(low <= y && y <= high) {
        return None;
    }
    let [left, right] = width_at(t, y);
    let columns = [grid.column(left - grid.cell), grid.column(right + grid.cell) + 1];
    Some([columns[0].max(window.columns[0]), columns[1].min(window.columns[1])])
}

/// An edge of the projection, from its smaller end to the larger one: so that both triangles at it round alike, and a point on
/// it cannot fall outside of both.
#[derive(Clone, Copy)]
struct Edge {
    ax: f64,
    ay: f64,
    dx: f64,
    dy: f64,
    /// −1 where the edge was turned round.
    sign: f64,
}

impl Edge {
    #[inline(always)]
    fn new(a: &Point3<f64>, b: &Point3<f64>) -> Self {
        let is_turned = b.x < a.x || (b.x == a.x && b.y < a.y);
        let (a, b) = if is_turned { (b, a) } else { (a, b) };
        Self { ax: a.x, ay: a.y, dx: b.x - a.x, dy: b.y - a.y, sign: if is_turned { -1.0 } else { 1.0 } }
    }
}
