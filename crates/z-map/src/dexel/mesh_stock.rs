pub(crate) mod dilated;

use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

use crate::dexel::grid::{DexelGrid, GridError};
use crate::dexel::map::DexelMap;
use crate::dexel::mesh_stock::dilated::Dilated;
use crate::dexel::tile::{Interval, LINES, SIDE, Tile};

/// Why a mesh is not a stock.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshStockError {
    /// There is no lattice.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// A line goes in and out of the mesh at different numbers of places, or out before in.
    #[error("the stock mesh is not closed and wound outward: the line through ({:.3}, {:.3}, {:.3}) mm goes \
        in {n_in} times and out {n_out} times, or out first; close the mesh there or turn its triangles", at.x, at.y, at.z)]
    NotClosed {
        /// Where the line is first out of order, workpiece frame, mm.
        at: Point3<f64>,
        /// Triangles through which the line goes in.
        n_in: usize,
        /// Triangles through which it goes out.
        n_out: usize,
    },
    /// The allowance is negative or not finite.
    #[error("a stock allowance of {allowance} mm is not a length of 0 or more")]
    BadAllowance {
        /// Requested allowance, mm.
        allowance: f64,
    },
    /// The requested rectangle is none, or has no stock.
    #[error("the region from ({}, {}) to ({}, {}) mm is no rectangle with stock in it; the stock is from ({:.3}, {:.3}) to \
        ({:.3}, {:.3}) mm", region[0][0], region[0][1], region[1][0], region[1][1], low.x, low.y, high.x, high.y)]
    BadRegion {
        /// Requested region, map frame, mm.
        region: [[f64; 2]; 2],
        /// Low corner of the stock.
        low: Point3<f64>,
        /// Its high corner.
        high: Point3<f64>,
    },
    /// The mesh is too far from the map's origin to be counted in whole quanta of 2⁻²⁶ mm.
    #[error("the stock mesh reaches {reach:.3e} mm from the dexels' origin, more than {:.3e} mm; move it", MAX_REACH)]
    TooFar {
        /// Largest coordinate, map frame, mm.
        reach: f64,
    },
}

/// Where triangles and lines are rounded to in the lattice's plane, mm: sides of edges are then
/// whole numbers, and exact. Larger, the stock would be wrong by more; smaller, large parts would
/// not fit.
pub(crate) const QUANTUM: f64 = 1.0 / (1u64 << 26) as f64;

/// Largest coordinate: products of two differences must fit into 127 bits with room to spare.
pub(crate) const MAX_REACH: f64 = (1u64 << 24) as f64;

/// Distance by which lines may seem to leave a solid before they enter it, mm: heights of two
/// triangles that touch are rounded.
const ROUNDING: f64 = 1e-6;

/// A place in the lattice's plane, in quanta.
pub(crate) type LatticePoint = [i64; 2];

/// A triangle's corners in the map's frame.
pub(crate) struct ProjectedTriangle {
    pub(crate) places: [LatticePoint; 3],
    pub(crate) heights: [f64; 3],
}

/// An end of material on a line: where, and whether it begins.
#[derive(Clone, Copy, Debug)]
struct End {
    line: u16,
    height: f64,
    is_begin: bool,
    /// Whether it is of the mesh and not of its allowance.
    is_mesh: bool,
}

impl DexelMap {
    /// The solid that a closed mesh bounds, as lines of a lattice that begins at its low corner.
    /// Where shells overlap there is material.
    ///
    /// Lines through edges and corners do not leak: each line counts as moved by an infinitely
    /// small step, along x and by far less along y, and sides are decided exactly on coordinates
    /// rounded to 1.5·10⁻⁸ mm.
    ///
    /// # Errors
    /// When a line finds the mesh not closed or not wound outward, a length is no number to work
    /// with, or the map too large.
    pub fn of_mesh(mesh: &TriMesh, work_from_map: &Isometry3<f64>, cell: f64) -> Result<Self, MeshStockError> {
        Self::of_mesh_with_allowance(mesh, work_from_map, cell, 0.0)
    }

    /// All that is within an allowance of a mesh, which need not be closed: a layer on both sides
    /// of it.
    ///
    /// # Errors
    /// As for [`DexelMap::of_mesh_with_allowance`], but for a mesh that is not closed.
    pub fn of_layer(
        mesh: &TriMesh,
        work_from_map: &Isometry3<f64>,
        cell: f64,
        allowance: f64,
    ) -> Result<Self, MeshStockError> {
        Self::of_triangles(mesh, work_from_map, cell, (allowance, false), None)
    }

    /// The solid of a closed mesh and all that is within an allowance of it.
    ///
    /// On each line the material is the mesh's own, and of every triangle all that is not farther
    /// from it than the allowance: exact up to rounding, the corners rounded like a ball rolling on
    /// the outside.
    ///
    /// # Errors
    /// As for [`DexelMap::of_mesh`].
    pub fn of_mesh_with_allowance(
        mesh: &TriMesh,
        work_from_map: &Isometry3<f64>,
        cell: f64,
        allowance: f64,
    ) -> Result<Self, MeshStockError> {
        Self::of_triangles(mesh, work_from_map, cell, (allowance, true), None)
    }

    /// [`DexelMap::of_mesh_with_allowance`], or [`DexelMap::of_layer`] where `is_closed` is false,
    /// with lines over a rectangle of the map's xy plane only, between its low and its high corner.
    /// Material beside the region is not represented.
    ///
    /// # Errors
    /// As for those; and when the rectangle is beside the stock.
    pub fn of_mesh_within(
        mesh: &TriMesh,
        work_from_map: &Isometry3<f64>,
        cell: f64,
        (allowance, is_closed): (f64, bool),
        region: [[f64; 2]; 2],
    ) -> Result<Self, MeshStockError> {
        Self::of_triangles(mesh, work_from_map, cell, (allowance, is_closed), Some(region))
    }

    /// [`DexelMap::of_mesh_with_allowance`], or [`DexelMap::of_layer`] where `is_closed` is false,
    /// on the lines of another map: stock to compare that map with. Material beside its lines is
    /// not represented.
    ///
    /// # Errors
    /// As for those, but for lengths and sizes of the lattice.
    pub fn of_mesh_on(
        mesh: &TriMesh,
        grid: &DexelGrid,
        (allowance, is_closed): (f64, bool),
    ) -> Result<Self, MeshStockError> {
        if !(allowance >= 0.0 && allowance.is_finite()) {
            return Err(MeshStockError::BadAllowance { allowance });
        }
        Self::on_lines(&mesh.transformed(&grid.work_from_map().inverse()), *grid, (allowance, is_closed))
    }

    fn of_triangles(
        mesh: &TriMesh,
        work_from_map: &Isometry3<f64>,
        cell: f64,
        (allowance, is_closed): (f64, bool),
        region: Option<[[f64; 2]; 2]>,
    ) -> Result<Self, MeshStockError> {
        if !(allowance >= 0.0 && allowance.is_finite()) {
            return Err(MeshStockError::BadAllowance { allowance });
        }
        let moved = mesh.transformed(&work_from_map.inverse());
        let bounds = moved.aabb();
        let whole = bounds.dilated(allowance);
        let (mut low, mut high) = ([whole.min.x, whole.min.y], [whole.max.x, whole.max.y]);
        if let Some([from, to]) = region {
            (low, high) = ([0, 1].map(|k| low[k].max(from[k])), [0, 1].map(|k| high[k].min(to[k])));
            let is_rectangle =
                [from, to].as_flattened().iter().all(|c| c.is_finite()) && from[0] < to[0] && from[1] < to[1];
            if !is_rectangle || low[0] >= high[0] || low[1] >= high[1] {
                return Err(MeshStockError::BadRegion { region: [from, to], low: whole.min, high: whole.max });
            }
        }
        Self::on_lines(&moved, DexelGrid::over(work_from_map, low, high, cell)?, (allowance, is_closed))
    }

    /// Fills the lines of a lattice with a mesh in the map's frame.
    fn on_lines(moved: &TriMesh, grid: DexelGrid, (allowance, is_closed): (f64, bool)) -> Result<Self, MeshStockError> {
        let bounds = moved.aabb();
        let reach = bounds.min.coords.amax().max(bounds.max.coords.amax()) + allowance + grid.cell();
        if reach.is_nan() || reach > MAX_REACH {
            return Err(MeshStockError::TooFar { reach });
        }
        let mut map = Self::empty(grid);
        let bins = bins(&map, moved, allowance);
        let tiles_x = map.tiles_x();
        let cast = |(k, tile): (usize, &mut Tile)| {
            let (i0, j0) = (k % tiles_x * SIDE, k / tiles_x * SIDE);
            Cast { grid: &grid, i0, j0, is_closed }.fill(tile, moved, &bins[k], allowance)
        };
        let results: Vec<_> = map.tiles.par_iter_mut().enumerate().map(cast).collect();
        results.into_iter().collect::<Result<(), _>>()?;
        Ok(map)
    }
}

/// The triangles that may be over or under the lines of each tile, in the order of the mesh.
pub(crate) fn bins(map: &DexelMap, mesh: &TriMesh, allowance: f64) -> Vec<Vec<u32>> {
    let mut bins = vec![Vec::new(); map.tiles.len()];
    for index in 0..mesh.triangles().len() {
        let Some([columns, rows]) = window(&map.grid, &mesh.corners(index), allowance) else { continue };
        for tj in rows[0] / SIDE..=rows[1] / SIDE {
            for ti in columns[0] / SIDE..=columns[1] / SIDE {
                bins[tj * map.tiles_x() + ti].push(index as u32);
            }
        }
    }
    bins
}

/// Columns and rows of the lines that may meet a triangle.
pub(crate) fn window(grid: &DexelGrid, corners: &[Point3<f64>; 3], allowance: f64) -> Option<[[usize; 2]; 2]> {
    let range = |axis: usize| {
        let low = corners.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
        let high = corners.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
        grid.between(axis, low - allowance - 2.0 * QUANTUM, high + allowance + 2.0 * QUANTUM)
    };
    Some([range(0)?, range(1)?])
}

/// Lines of one tile through a mesh.
struct Cast<'a> {
    grid: &'a DexelGrid,
    i0: usize,
    j0: usize,
    /// Whether the mesh bounds a solid.
    is_closed: bool,
}

impl Cast<'_> {
    fn fill(&self, tile: &mut Tile, mesh: &TriMesh, bin: &[u32], allowance: f64) -> Result<(), MeshStockError> {
        let mut ends = Vec::new();
        for &index in bin {
            self.add(&mesh.corners(index as usize), allowance, &mut ends);
        }
        let mut ends = by_line(&ends);
        for of_line in ends.chunk_by_mut(|a, b| a.line == b.line) {
            of_line.sort_by(|a, b| a.height.total_cmp(&b.height).then(b.is_begin.cmp(&a.is_begin)));
            let line = usize::from(of_line[0].line);
            self.check(line, of_line)?;
            tile.set(line, &union(of_line));
        }
        (0..SIDE).for_each(|row| tile.refresh_row(row));
        tile.refresh();
        Ok(())
    }

    /// Ends of the material that a triangle makes on the tile's lines.
    fn add(&self, corners: &[Point3<f64>; 3], allowance: f64, ends: &mut Vec<End>) {
        let Some([columns, rows]) = window(self.grid, corners, allowance) else { return };
        let facet = ProjectedTriangle {
            places: corners.map(|p| [p.x, p.y].map(|c| (c / QUANTUM).round() as i64)),
            heights: corners.map(|p| p.z),
        };
        let dilated = (allowance > 0.0).then(|| Dilated::new(corners, allowance));
        for j in rows[0].max(self.j0)..=rows[1].min(self.j0 + SIDE - 1) {
            for i in columns[0].max(self.i0)..=columns[1].min(self.i0 + SIDE - 1) {
                let line = ((j - self.j0) * SIDE + i - self.i0) as u16;
                let (x, y) = (self.grid.x(i), self.grid.y(j));
                let place = [x, y].map(|c| (c / QUANTUM).round() as i64);
                if let Some((height, is_begin)) = facet.crossing(place).filter(|_| self.is_closed) {
                    ends.push(End { line, height, is_begin, is_mesh: true });
                }
                if let Some([bottom, top]) = dilated.as_ref().and_then(|d| d.interval(x, y)) {
                    ends.push(End { line, height: bottom, is_begin: true, is_mesh: false });
                    ends.push(End { line, height: top, is_begin: false, is_mesh: false });
                }
            }
        }
    }

    /// Whether the mesh is closed on a line: the k-th end is not before the k-th beginning.
    fn check(&self, line: usize, ends: &[End]) -> Result<(), MeshStockError> {
        let of = |is_begin: bool| {
            let heights = ends.iter().filter(move |e| e.is_mesh && e.is_begin == is_begin).map(|e| e.height);
            heights.collect::<Vec<f64>>()
        };
        let (begins, ends) = (of(true), of(false));
        let wrong = begins.iter().zip(&ends).find(|(begin, end)| **end < **begin - ROUNDING).map(|(_, end)| *end);
        let unmatched = begins.len().min(ends.len());
        let unmatched = begins.get(unmatched).or(ends.get(unmatched)).copied();
        let Some(height) = wrong.or(unmatched) else { return Ok(()) };
        let at = self.grid.in_work(self.i0 + line % SIDE, self.j0 + line / SIDE, height);
        Err(MeshStockError::NotClosed { at, n_in: begins.len(), n_out: ends.len() })
    }
}

impl ProjectedTriangle {
    /// Height at which a line goes through, and whether it goes in.
    pub(crate) fn crossing(&self, at: LatticePoint) -> Option<(f64, bool)> {
        let [a, b, c] = self.places;
        let sides = [side(b, c, at), side(c, a, at), side(a, b, at)];
        let is_up = sides[0].1;
        if sides.iter().any(|s| s.1 != is_up) {
            return None;
        }
        let weights = sides.map(|s| s.0 as f64);
        let sum: f64 = weights.iter().sum();
        let [low, high] = [
            self.heights.iter().copied().fold(f64::INFINITY, f64::min),
            self.heights.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        ];
        let height = (0..3).map(|k| weights[k] * self.heights[k]).sum::<f64>() / sum;
        Some((height.clamp(low, high), !is_up))
    }
}

/// Twice the area of the triangle from an edge to a place, and whether the place, moved by an
/// infinitely small step along x and a far smaller one along y, is to the left of the edge. The
/// answer for the edge turned round is the opposite.
fn side(a: LatticePoint, b: LatticePoint, at: LatticePoint) -> (i128, bool) {
    let [dx, dy] = [0, 1].map(|k| i128::from(b[k]) - i128::from(a[k]));
    let [px, py] = [0, 1].map(|k| i128::from(at[k]) - i128::from(a[k]));
    let area = dx * py - dy * px;
    let sign = if area != 0 {
        area
    } else if dy != 0 {
        -dy
    } else {
        dx
    };
    (area, sign > 0)
}

/// The ends in the order of their lines, those of a line as they were: by counting, as the lines of
/// a tile are few.
fn by_line(ends: &[End]) -> Vec<End> {
    let mut next = [0; LINES];
    ends.iter().for_each(|end| next[usize::from(end.line)] += 1);
    let mut before = 0;
    for next in &mut next {
        (*next, before) = (before, before + *next);
    }
    let mut sorted = ends.to_vec();
    for end in ends {
        let place = &mut next[usize::from(end.line)];
        sorted[*place] = *end;
        *place += 1;
    }
    sorted
}

/// Material between ends in rising order. A gap within rounding is closed.
fn union(ends: &[End]) -> Vec<Interval> {
    let mut intervals: Vec<Interval> = Vec::new();
    let (mut depth, mut bottom) = (0_i64, 0.0);
    for end in ends {
        if end.is_begin && depth == 0 {
            bottom = end.height;
        }
        depth += if end.is_begin { 1 } else { -1 };
        if !end.is_begin && depth == 0 && bottom < end.height {
            match intervals.last_mut() {
                Some(last) if last.top >= bottom - ROUNDING => last.top = end.height,
                _ => intervals.push(Interval { bottom, top: end.height }),
            }
        }
    }
    intervals
}

const _: () = assert!(LINES <= u16::MAX as usize);
