//! Z-map: heights over a grid, with the highest of each cell.

pub(crate) mod heights;

use std::ops::RangeInclusive;

use facemill_cl_data::Aabb;
use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

use crate::pyramid::{Block, Pyramid};
use crate::raster::{Band, Grid};

/// How fine a Z-map is and how far it reaches. Lengths are mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZMapSettings {
    /// Distance of the nodes.
    pub cell: f64,
    /// Reach of the grid beyond the mesh on each side. The answers do not depend on it: beyond the
    /// mesh there is no surface.
    pub margin: f64,
}

impl Default for ZMapSettings {
    fn default() -> Self {
        Self { cell: 1.0, margin: 0.0 }
    }
}

/// Why there is no Z-map.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ZMapError {
    /// The mesh has no triangle.
    #[error("the mesh has no triangle")]
    EmptyMesh,
    /// The cell size is not a positive number.
    #[error("a Z-map cell of {cell} mm is not a positive length")]
    BadCell {
        /// Requested cell size, mm.
        cell: f64,
    },
    /// The margin is negative or not finite.
    #[error("a Z-map margin of {margin} mm is not a length of 0 or more")]
    BadMargin {
        /// Requested margin, mm.
        margin: f64,
    },
    /// The map's frame is not finite, or moves the mesh out of the range of numbers.
    #[error("the Z-map's frame moves the mesh to coordinates that are not finite")]
    FrameNotFinite,
    /// The map would take too much memory.
    #[error(
        "a Z-map cell of {cell} mm makes {n_cells:.3e} cells, more than {} ({} GB); use {coarser} mm or more",
        ZMap::MAX_CELLS, ZMap::MAX_CELLS as f64 * 19e-9
    )]
    TooManyCells {
        /// Requested cell size, mm.
        cell: f64,
        /// Number of cells it makes.
        n_cells: f64,
        /// A cell size that is coarse enough, mm.
        coarser: f64,
    },
}

/// Heights of a mesh over a regular grid of the xy plane of a frame of the caller's choice.
///
/// A node's height is the largest z of the mesh over the node: exact up to rounding, and says
/// nothing of what is between the nodes. A cell's maximum is not below any point of the mesh over
/// the closed cell: all of it, not only its nodes; what it is too high by is rounding (about 1e-14
/// of the largest coordinate). Where there is no surface both are −∞ inside, `None` outside. No
/// value is NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct ZMap {
    grid: Grid,
    map_from_work: Isometry3<f64>,
    /// (nx + 1) × (ny + 1), row by row.
    nodes: Vec<f64>,
    pyramid: Pyramid,
}

/// Rows per unit of parallel work.
const BAND: usize = 16;

impl ZMap {
    /// Largest number of cells of a map: about 0.6 GB.
    pub const MAX_CELLS: usize = 1 << 25;

    /// The Z-map of a mesh in the frame that `map_from_mesh` leads to, covering the mesh and the
    /// margin around it.
    ///
    /// Runs in parallel; the result does not depend on the number of threads.
    ///
    /// # Errors
    /// When the mesh is empty, a length or the frame is no number to work with, or the grid would
    /// have more than [`ZMap::MAX_CELLS`] cells.
    pub fn build(mesh: &TriMesh, map_from_mesh: &Isometry3<f64>, settings: &ZMapSettings) -> Result<Self, ZMapError> {
        let vertices = heights::moved(mesh, map_from_mesh);
        let grid = grid_over(mesh, &vertices, map_from_mesh, settings)?;
        let nodes = heights::rasterised(&grid, &vertices, mesh.triangles());
        let triangles: Vec<[Point3<f64>; 3]> =
            mesh.triangles().par_iter().map(|t| t.map(|v| vertices[v as usize])).collect();
        let cells = cell_maxima(&grid, &triangles);
        Ok(Self { grid, map_from_work: *map_from_mesh, nodes, pyramid: Pyramid::new(grid.nx, grid.ny, cells) })
    }

    /// Motion from the frame of the mesh, in planning the workpiece's, to the map's: what
    /// [`ZMap::build`] was given.
    pub fn map_from_work(&self) -> &Isometry3<f64> {
        &self.map_from_work
    }

    /// Distance of the nodes, mm.
    pub fn cell(&self) -> f64 {
        self.grid.cell
    }

    /// Number of cells along x and y.
    pub fn n_cells(&self) -> [usize; 2] {
        [self.grid.nx, self.grid.ny]
    }

    /// Position of the node (i, j) in the map's xy plane, 0 ≤ i ≤ nx, 0 ≤ j ≤ ny.
    pub fn node_position(&self, i: usize, j: usize) -> [f64; 2] {
        [self.grid.node_x(i), self.grid.node_y(j)]
    }

    /// Height of the mesh over the node (i, j), map frame, mm. `None` where there is no surface or
    /// no such node.
    pub fn node_height(&self, i: usize, j: usize) -> Option<f64> {
        if i > self.grid.nx || j > self.grid.ny {
            return None;
        }
        Some(self.nodes[j * (self.grid.nx + 1) + i]).filter(|z| z.is_finite())
    }

    /// Height at (x, y), map frame, mm, bilinear between the four nodes around it: an estimate
    /// between nodes, exact on them. `None` outside the map and where a node that it depends on has
    /// no surface.
    pub fn height_at(&self, x: f64, y: f64) -> Option<f64> {
        let (u, v) = ((x - self.grid.x0) / self.grid.cell, (y - self.grid.y0) / self.grid.cell);
        if !(0.0 <= u && u <= self.grid.nx as f64 && 0.0 <= v && v <= self.grid.ny as f64) {
            return None;
        }
        let (i, j) = (self.grid.column(x), self.grid.row(y));
        let (u, v) = ((u - i as f64).clamp(0.0, 1.0), (v - j as f64).clamp(0.0, 1.0));
        let corners = [(0, 0, (1.0 - u) * (1.0 - v)), (1, 0, u * (1.0 - v)), (0, 1, (1.0 - u) * v), (1, 1, u * v)];
        let mut height = 0.0;
        for (di, dj, weight) in corners.into_iter().filter(|c| c.2 > 0.0) {
            height += weight * self.node_height(i + di, j + dj)?;
        }
        Some(height)
    }

    /// A z that no point of the mesh over the closed rectangle exceeds, map frame, mm; −∞ where
    /// there is none.
    ///
    /// It is the largest maximum of the cells that the rectangle touches. A bound that is NaN
    /// counts as unbounded.
    pub fn max_over(&self, x: RangeInclusive<f64>, y: RangeInclusive<f64>) -> f64 {
        let (grid, (x0, x1), (y0, y1)) = (&self.grid, x.into_inner(), y.into_inner());
        let (right, top) = (grid.node_x(grid.nx), grid.node_y(grid.ny));
        if x1 < x0 || y1 < y0 || x1 < grid.x0 || x0 > right || y1 < grid.y0 || y0 > top {
            return f64::NEG_INFINITY;
        }
        let last = |from: f64, cell: usize, n: usize| if from.is_nan() { n } else { cell + 1 };
        self.pyramid.max_over(
            grid.column(x0)..last(x1, grid.column(x1), grid.nx),
            grid.row(y0)..last(y1, grid.row(y1), grid.ny),
        )
    }

    /// Whether the map is sound: sizes fit, no height is NaN, no node is above the maximum of a
    /// cell it belongs to, and every block of the pyramid holds the maximum of its parts. It always
    /// is; this is for tests.
    ///
    /// # Errors
    /// If an invariant is broken, which the text names.
    pub fn check_invariants(&self) -> Result<(), String> {
        let (nx, ny) = (self.grid.nx, self.grid.ny);
        if self.nodes.len() != (nx + 1) * (ny + 1) || self.pyramid.cells(self.pyramid.top()) != [0..nx, 0..ny] {
            return Err(format!("{} nodes do not make {nx} × {ny} cells", self.nodes.len()));
        }
        self.pyramid.check()?;
        for j in 0..=ny {
            for i in 0..=nx {
                let z = self.nodes[j * (nx + 1) + i];
                let cells = [i.saturating_sub(1), i.min(nx - 1)]
                    .into_iter()
                    .flat_map(|i| [j.saturating_sub(1), j.min(ny - 1)].map(|j| Block { level: 0, i, j }));
                if z.is_nan() || !cells.into_iter().all(|cell| z <= self.pyramid.max(cell)) {
                    return Err(format!("height {z} of node ({i}, {j}) is above the maximum of one of its cells"));
                }
            }
        }
        Ok(())
    }

    pub(crate) fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    pub(crate) fn grid(&self) -> &Grid {
        &self.grid
    }
}

/// The grid over a mesh whose vertices in the map's frame are given.
pub(crate) fn grid_over(
    mesh: &TriMesh,
    vertices: &[Point3<f64>],
    map_from_mesh: &Isometry3<f64>,
    settings: &ZMapSettings,
) -> Result<Grid, ZMapError> {
    // Of the vertices that triangles have, chunk by chunk.
    let of_chunk = |chunk: &[[u32; 3]]| {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for &v in chunk.iter().flatten() {
            let p = &vertices[v as usize];
            for k in 0..3 {
                // Every coordinate of a mesh is a number: no need for what `min` and `max` do about
                // others.
                low[k] = if p[k] < low[k] { p[k] } else { low[k] };
                high[k] = if p[k] > high[k] { p[k] } else { high[k] };
            }
        }
        [Point3::from(low), Point3::from(high)]
    };
    let chunks: Vec<[Point3<f64>; 2]> = mesh.triangles().par_chunks(1 << 14).map(of_chunk).collect();
    let bounds = Aabb::of_points(chunks.iter().flatten());
    // Rounding of the motion grows with the coordinates on both sides of it.
    let amax = |chunk: &[Point3<f64>]| chunk.iter().flat_map(|p| p.iter()).fold(0.0, |m: f64, c| m.max(c.abs()));
    let before: Vec<f64> = mesh.vertices().par_chunks(1 << 14).map(amax).collect();
    let after = bounds.min.coords.amax().max(bounds.max.coords.amax());
    let largest = before.into_iter().chain([after]).fold(map_from_mesh.translation.vector.amax(), f64::max);
    let ZMapSettings { cell, margin } = *settings;
    if !(cell > 0.0 && cell.is_finite()) {
        return Err(ZMapError::BadCell { cell });
    }
    if !(margin >= 0.0 && margin.is_finite()) {
        return Err(ZMapError::BadMargin { margin });
    }
    if bounds.is_empty() {
        return Err(ZMapError::EmptyMesh);
    }
    if !largest.is_finite() {
        return Err(ZMapError::FrameNotFinite);
    }
    let size = (bounds.max - bounds.min).xy().add_scalar(2.0 * margin);
    // One cell at least, and the mesh never ends on the last node's far side.
    let count = |cell: f64| (size / cell).map(|n| n.floor() + 1.0);
    let n_cells = count(cell).product();
    if n_cells.is_nan() || n_cells > ZMap::MAX_CELLS as f64 {
        let coarser = coarse_enough(size.x, size.y);
        return Err(ZMapError::TooManyCells { cell, n_cells, coarser });
    }
    let n = count(cell);
    // A few roundings of the motion and of the interpolation along an edge, each of half a unit in
    // the last place.
    let slack = 64.0 * f64::EPSILON * (largest + margin + cell);
    Ok(Grid { x0: bounds.min.x - margin, y0: bounds.min.y - margin, cell, nx: n.x as usize, ny: n.y as usize, slack })
}

/// A cell size, rounded up to two digits, for which a grid of this size has fewer cells than
/// allowed.
fn coarse_enough(width: f64, height: f64) -> f64 {
    let limit = ZMap::MAX_CELLS as f64;
    // (w/c + 1)(h/c + 1) = limit for c.
    let (a, b) = (limit - 1.0, 0.5 * (width + height));
    let cell = (b + (b * b + a * width * height).sqrt()) / a;
    let digit = 10f64.powf(cell.log10().floor() - 1.0);
    (cell / digit).ceil() * digit
}

/// Maxima of the cells, row by row.
fn cell_maxima(grid: &Grid, triangles: &[[Point3<f64>; 3]]) -> Vec<f64> {
    let nx = grid.nx;
    let bins = Bins::new(grid, triangles);
    let mut cells = vec![f64::NEG_INFINITY; nx * grid.ny];
    cells.par_chunks_mut(BAND * nx).enumerate().for_each(|(k, cells)| {
        let mut band = Band { grid: *grid, first_row: k * BAND, cells };
        for &t in bins.of(k) {
            band.add(&triangles[t as usize]);
        }
    });
    cells
}

/// The triangles of each band of rows, in the order of the mesh.
struct Bins {
    starts: Vec<usize>,
    triangles: Vec<u32>,
}

impl Bins {
    fn new(grid: &Grid, triangles: &[[Point3<f64>; 3]]) -> Self {
        let bands = |t: &[Point3<f64>; 3]| {
            let [low, high] = grid.rows(t);
            low / BAND..=high / BAND
        };
        let mut starts = vec![0; grid.ny.div_ceil(BAND) + 1];
        for t in triangles {
            bands(t).for_each(|k| starts[k + 1] += 1);
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        let mut free = starts.clone();
        let mut binned = vec![0; starts[starts.len() - 1]];
        for (index, t) in triangles.iter().enumerate() {
            for k in bands(t) {
                // 2³² triangles would be 51 GB of corners above.
                binned[free[k]] = index as u32;
                free[k] += 1;
            }
        }
        Self { starts, triangles: binned }
    }

    fn of(&self, band: usize) -> &[u32] {
        &self.triangles[self.starts[band]..self.starts[band + 1]]
    }
}
