use nalgebra::{Isometry3, Point3};

/// Where the lines of a dexel map are: along z of a frame, through the centres of a lattice of
/// square cells.
///
/// The line (i, j) is at x = `origin[0]` + (i + ½)·`cell`, y likewise, and represents its
/// whole cell. mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DexelGrid {
    work_from_map: Isometry3<f64>,
    origin: [f64; 2],
    cell: f64,
    n_lines: [usize; 2],
}

/// Why there is no lattice.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// The cell size is not a positive number.
    #[error("a dexel cell of {cell} mm is not a positive length")]
    BadCell {
        /// Requested cell size, mm.
        cell: f64,
    },
    /// A corner or the frame is not finite, or the far corner is not beyond the near one.
    #[error("dexels from ({}, {}) to ({}, {}) mm cover no area that can be counted", low[0], low[1], high[0], high[1])]
    BadExtent {
        /// Corner with the smallest coordinates, map frame, mm.
        low: [f64; 2],
        /// The opposite corner.
        high: [f64; 2],
    },
    /// The map would take too much memory.
    #[error(
        "a dexel cell of {cell} mm makes {n_lines:.3e} lines, more than {}; use {coarser:.3} mm or more",
        DexelGrid::MAX_LINES
    )]
    TooManyLines {
        /// Requested cell size, mm.
        cell: f64,
        /// Number of lines it makes.
        n_lines: f64,
        /// A cell size that is coarse enough, mm.
        coarser: f64,
    },
}

impl DexelGrid {
    /// Largest number of lines of a map: about 1.1 GB.
    pub const MAX_LINES: usize = 1 << 26;

    /// The lattice over a rectangle of the map's xy plane, beginning at its low corner; the last
    /// cells may reach beyond the high corner.
    ///
    /// # Errors
    /// When a length or the frame is no number to work with, or there would be more than
    /// [`DexelGrid::MAX_LINES`].
    pub fn over(work_from_map: &Isometry3<f64>, low: [f64; 2], high: [f64; 2], cell: f64) -> Result<Self, GridError> {
        if !(cell > 0.0 && cell.is_finite()) {
            return Err(GridError::BadCell { cell });
        }
        let size = [high[0] - low[0], high[1] - low[1]];
        let frame = work_from_map.translation.vector.sum() + work_from_map.rotation.coords.sum();
        if !(size[0] > 0.0 && size[1] > 0.0 && (size[0] + size[1] + low[0] + low[1] + frame).is_finite()) {
            return Err(GridError::BadExtent { low, high });
        }
        // A length that is a whole number of cells up to rounding makes that number.
        let n = size.map(|s| (s / cell - 1e-9).ceil().max(1.0));
        let n_lines = n[0] * n[1];
        if n_lines.is_nan() || n_lines > Self::MAX_LINES as f64 {
            let coarser = cell * (n_lines / Self::MAX_LINES as f64).sqrt() * 1.001;
            return Err(GridError::TooManyLines { cell, n_lines, coarser });
        }
        Ok(Self { work_from_map: *work_from_map, origin: low, cell, n_lines: n.map(|n| n as usize) })
    }

    /// Returns the lattice of a file, checked like any other.
    pub(crate) fn from_parts(
        work_from_map: Isometry3<f64>,
        origin: [f64; 2],
        cell: f64,
        n_lines: [usize; 2],
    ) -> Result<Self, GridError> {
        let high = [0, 1].map(|k| origin[k] + n_lines[k] as f64 * cell);
        Self::over(&work_from_map, origin, high, cell)?;
        if n_lines[0].saturating_mul(n_lines[1]) > Self::MAX_LINES || n_lines.contains(&0) {
            return Err(GridError::BadExtent { low: origin, high });
        }
        Ok(Self { work_from_map, origin, cell, n_lines })
    }

    /// The lattice, moved.
    pub(crate) fn moved(&self, motion: &Isometry3<f64>) -> Self {
        Self { work_from_map: motion * self.work_from_map, ..*self }
    }

    /// Motion from the map's frame, whose z the lines are along, to the workpiece's.
    pub fn work_from_map(&self) -> &Isometry3<f64> {
        &self.work_from_map
    }

    /// Corner of the lattice, map frame, mm.
    pub fn origin(&self) -> [f64; 2] {
        self.origin
    }

    /// Distance of the lines, mm.
    pub fn cell(&self) -> f64 {
        self.cell
    }

    /// Number of lines along x and y.
    pub fn n_lines(&self) -> [usize; 2] {
        self.n_lines
    }

    /// x of the lines of a column, map frame, mm.
    pub fn x(&self, i: usize) -> f64 {
        self.origin[0] + (i as f64 + 0.5) * self.cell
    }

    /// y of the lines of a row, map frame, mm.
    pub fn y(&self, j: usize) -> f64 {
        self.origin[1] + (j as f64 + 0.5) * self.cell
    }

    /// Indices of the lines of an axis (0 for x, 1 for y) between two coordinates, ends included up
    /// to rounding; `None` when there are none.
    pub(crate) fn between(&self, axis: usize, low: f64, high: f64) -> Option<[usize; 2]> {
        let place = |v: f64| (v - self.origin[axis]) / self.cell - 0.5;
        let first = (place(low) - 1e-9).ceil().max(0.0);
        let last = (place(high) + 1e-9).floor().min(self.n_lines[axis] as f64 - 1.0);
        (first <= last).then_some([first as usize, last as usize])
    }

    /// A point of the line (i, j) at this height, workpiece frame, mm.
    pub fn in_work(&self, i: usize, j: usize, height: f64) -> Point3<f64> {
        self.work_from_map * Point3::new(self.x(i), self.y(j), height)
    }
}
