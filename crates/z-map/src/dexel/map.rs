use nalgebra::Isometry3;
use rayon::prelude::*;

use crate::dexel::grid::{DexelGrid, GridError};
use crate::dexel::tile::{Interval, LINES, SIDE, Tile};

/// A solid as parallel lines, each with the intervals that are material.
///
/// The lines are along z of the map's frame ([`DexelGrid`]). Each holds disjoint closed intervals
/// in rising order, none empty, no two touching. A line is exact up to rounding; between the lines
/// the map is unknown, and counts each line for its whole cell.
#[derive(Clone, Debug, PartialEq)]
pub struct DexelMap {
    pub(crate) grid: DexelGrid,
    /// Row by row.
    pub(crate) tiles: Vec<Tile>,
    /// As whoever made the map says; empty where nobody does.
    pub(crate) origin: Vec<u8>,
}

/// Why there is no stock of a simple shape.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StockError {
    /// There is no lattice.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The stock has no height.
    #[error("stock from {low} to {high} mm along the lines has no height")]
    BadHeight {
        /// Lower end, map frame, mm.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// The cylinder has no radius.
    #[error("a stock cylinder of radius {radius} mm is not a cylinder")]
    BadRadius {
        /// Requested radius, mm.
        radius: f64,
    },
}

/// Fault that [`DexelMap::check_invariants`] found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("dexel line ({i}, {j}): {what}")]
pub struct Broken {
    /// Column of the line.
    pub i: usize,
    /// Row of the line.
    pub j: usize,
    /// Fault there.
    pub what: String,
}

impl DexelMap {
    /// A map without material.
    pub fn empty(grid: DexelGrid) -> Self {
        let [nx, ny] = grid.n_lines().map(|n| n.div_ceil(SIDE));
        Self { grid, tiles: vec![Tile::empty(); nx * ny], origin: Vec::new() }
    }

    /// The map with a mark of what it was before anything was cut. Cuts keep it, and so do files;
    /// what the bytes mean is known to whoever made them.
    #[must_use]
    pub fn with_origin(self, origin: Vec<u8>) -> Self {
        Self { origin, ..self }
    }

    /// The same material, moved.
    #[must_use]
    pub fn moved(self, motion: &Isometry3<f64>) -> Self {
        Self { grid: self.grid.moved(motion), ..self }
    }

    /// The mark of [`with_origin`](Self::with_origin); empty where there is none.
    pub fn origin(&self) -> &[u8] {
        &self.origin
    }

    /// The box between two corners of the map's frame, with a lattice that begins at the low one.
    ///
    /// # Errors
    /// When a length is no number to work with, or the map too large.
    pub fn of_box(
        work_from_map: &Isometry3<f64>,
        low: [f64; 3],
        high: [f64; 3],
        cell: f64,
    ) -> Result<Self, StockError> {
        let grid = DexelGrid::over(work_from_map, [low[0], low[1]], [high[0], high[1]], cell)?;
        Self::upright(grid, [low[2], high[2]], |x, y| x <= high[0] && y <= high[1])
    }

    /// The cylinder about a line along z of the map's frame: a sawn bar as stock.
    ///
    /// ```
    /// use facemill_z_map::DexelMap;
    /// use nalgebra::Isometry3;
    ///
    /// let bar = DexelMap::of_cylinder(&Isometry3::identity(), [0.0, 0.0], 20.0, [0.0, 50.0], 0.5)?;
    /// let exact = std::f64::consts::PI * 20.0 * 20.0 * 50.0;
    /// assert!((bar.volume() / exact - 1.0).abs() < 0.01);
    /// # Ok::<(), facemill_z_map::StockError>(())
    /// ```
    ///
    /// # Errors
    /// When a length is no number to work with, or the map too large.
    pub fn of_cylinder(
        work_from_map: &Isometry3<f64>,
        centre: [f64; 2],
        radius: f64,
        heights: [f64; 2],
        cell: f64,
    ) -> Result<Self, StockError> {
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(StockError::BadRadius { radius });
        }
        let grid = DexelGrid::over(work_from_map, centre.map(|c| c - radius), centre.map(|c| c + radius), cell)?;
        Self::upright(grid, heights, |x, y| (x - centre[0]).hypot(y - centre[1]) <= radius)
    }

    /// Material between two heights on the lines that are inside an outline.
    fn upright(
        grid: DexelGrid,
        [bottom, top]: [f64; 2],
        is_inside: impl Fn(f64, f64) -> bool + Sync,
    ) -> Result<Self, StockError> {
        if !(bottom < top && bottom.is_finite() && top.is_finite()) {
            return Err(StockError::BadHeight { low: bottom, high: top });
        }
        let mut map = Self::empty(grid);
        map.fill(|i, j| if is_inside(grid.x(i), grid.y(j)) { vec![Interval { bottom, top }] } else { Vec::new() });
        Ok(map)
    }

    /// Sets every line to what a function says of it.
    pub(crate) fn fill(&mut self, line: impl Fn(usize, usize) -> Vec<Interval> + Sync) {
        let [nx, ny] = self.grid.n_lines();
        let tiles_x = self.tiles_x();
        self.tiles.par_iter_mut().enumerate().for_each(|(k, tile)| {
            let (i0, j0) = (k % tiles_x * SIDE, k / tiles_x * SIDE);
            for (row, j) in (j0..ny.min(j0 + SIDE)).enumerate() {
                for (column, i) in (i0..nx.min(i0 + SIDE)).enumerate() {
                    tile.set(row * SIDE + column, &line(i, j));
                }
                tile.refresh_row(row);
            }
            tile.refresh();
        });
    }

    pub(crate) fn tiles_x(&self) -> usize {
        self.grid.n_lines()[0].div_ceil(SIDE)
    }

    /// Tile and place in it of the line (i, j).
    pub(crate) fn place(&self, i: usize, j: usize) -> (usize, usize) {
        (j / SIDE * self.tiles_x() + i / SIDE, j % SIDE * SIDE + i % SIDE)
    }

    /// The material between two heights of the map's frame, mm.
    #[must_use]
    pub fn between(mut self, low: f64, high: f64) -> Self {
        for tile in &mut self.tiles {
            for line in 0..LINES {
                let clipped = |i: Interval| Interval { bottom: i.bottom.max(low), top: i.top.min(high) };
                let kept: Vec<Interval> = tile.intervals(line).map(clipped).filter(|i| i.bottom < i.top).collect();
                tile.set(line, &kept);
            }
            (0..SIDE).for_each(|row| tile.refresh_row(row));
            tile.refresh();
        }
        self
    }

    /// Where the lines are.
    pub fn grid(&self) -> &DexelGrid {
        &self.grid
    }

    /// Intervals of the line (i, j), upward; none where there is no such line. Heights in the map's
    /// frame, mm.
    pub fn intervals(&self, i: usize, j: usize) -> impl Iterator<Item = Interval> + '_ {
        let [nx, ny] = self.grid.n_lines();
        let of_line = (i < nx && j < ny).then(|| self.place(i, j));
        of_line.into_iter().flat_map(|(tile, line)| self.tiles[tile].intervals(line))
    }

    /// Volume of the material, mm³: the length of all intervals by the area of a cell. The same on
    /// any number of threads.
    pub fn volume(&self) -> f64 {
        let lengths: Vec<f64> = self.tiles.par_iter().map(Tile::length).collect();
        lengths.iter().sum::<f64>() * self.grid.cell() * self.grid.cell()
    }

    /// Whether the map is sound: intervals finite, in order, apart and not empty, nothing beyond
    /// the lattice, bounds of rows and tiles those of their lines. It always is; this is for tests
    /// and for what comes from files.
    ///
    /// # Errors
    /// The first line that is not, and how.
    pub fn check_invariants(&self) -> Result<(), Broken> {
        let [nx, ny] = self.grid.n_lines();
        let tiles_x = self.tiles_x();
        for (k, tile) in self.tiles.iter().enumerate() {
            let at = |line: usize| (k % tiles_x * SIDE + line % SIDE, k / tiles_x * SIDE + line / SIDE);
            if let Some((line, what)) = tile.fault() {
                let (i, j) = at(line);
                return Err(Broken { i, j, what });
            }
            for line in 0..LINES {
                let (i, j) = at(line);
                if (i >= nx || j >= ny) && tile.intervals(line).next().is_some() {
                    return Err(Broken { i, j, what: "there is material beyond the lattice".into() });
                }
            }
        }
        Ok(())
    }
}
