//! Places that are certainly outside of all closed components of a mesh.
//!
//! Nearly every free verdict has to exclude that the body is inside a component, by a half line
//! through the whole mesh. Most bodies of a tool are far from the part, in cells of a grid from
//! which a way leads beyond the mesh that meets no triangle: they need no half line.

use facemill_cl_data::Aabb;
use nalgebra::{Point3, Vector3};

/// Cells of a grid around a mesh that are certainly outside of its closed components.
///
/// Proof: every triangle lies in the cells between those of its lowest and its highest corner, for
/// the index of a cell never falls where the coordinate grows, rounding included. Marked are these,
/// widened by [`MARGIN`]. A cell is taken as outside if a chain of unmarked cells, each sharing a
/// side with the next, leads from it to the rim of the grid, which lies beyond the mesh. So a way
/// along which no point is on the surface leads from each of its points beyond the mesh. How often
/// the surface winds around a point, and whether a half line from it crosses the surface an odd
/// number of times, do not change along such a way, and beyond the mesh no component winds around
/// anything.
#[derive(Clone, Debug)]
pub(crate) struct Outside {
    low: Point3<f64>,
    side: f64,
    n: [usize; 3],
    /// A bit for each cell, x fastest; none where only places beyond the grid are known.
    cells: Vec<u64>,
}

/// Cells of a grid, about: 256 KB of bits; of a thin plate, the rim makes them up to three times as
/// many.
const CELLS: f64 = 2_097_152.0;

/// Largest number of cells along an axis.
const MOST_ALONG: f64 = 1024.0;

/// Fewest triangles for which a grid is worth its time.
const FEWEST: usize = 1024;

/// Cells that triangles may mark before the grid is given up, of which most are marked repeatedly.
const MOST_MARKS: usize = 1 << 25;

/// Distance by which the cells of a triangle are widened, mm: crossings of half lines are rounded
/// by far less.
const MARGIN: f64 = 1e-6;

impl Outside {
    /// Finds the cells outside of triangles.
    pub(crate) fn of(corners: &[[Point3<f64>; 3]]) -> Self {
        let bounds = Aabb::of_points(corners.iter().flatten());
        let is_finite = bounds.min.iter().chain(bounds.max.iter()).all(|c| c.is_finite());
        if corners.is_empty() || !is_finite {
            // Nothing is known of any place: the box is all of space.
            return Self {
                low: Point3::from([f64::NEG_INFINITY; 3]),
                side: f64::INFINITY,
                n: [1; 3],
                cells: Vec::new(),
            };
        }
        let size = bounds.max - bounds.min;
        let longest = size.max().max(MARGIN);
        let wide = size.map(|s| s.max(1e-3 * longest));
        let side = (wide.x * wide.y * wide.z / CELLS).cbrt().max(longest / MOST_ALONG).max(4.0 * MARGIN);
        // A rim of cells beyond the mesh, also beyond its margin.
        let low = bounds.min - Vector3::repeat(1.5 * side);
        let n = [0, 1, 2].map(|k| (size[k] / side).ceil() as usize + 4);
        let mut grid = Self { low, side, n, cells: Vec::new() };
        if corners.len() >= FEWEST {
            grid.cells = grid.marked(corners).map_or_else(Vec::new, |marked| grid.reached(&marked));
        }
        grid
    }

    /// Returns whether a place is certainly in no closed component.
    pub(crate) fn holds(&self, p: &Point3<f64>) -> bool {
        if !p.iter().all(|c| c.is_finite()) {
            return false;
        }
        let at = self.scaled(p);
        if (0..3).any(|k| at[k] < 0.0 || at[k] >= self.n[k] as f64) {
            return true;
        }
        // With an infinite side the index is not a number.
        if self.cells.is_empty() {
            return false;
        }
        let cell = self.index(at.map(|c| c as usize));
        self.cells[cell / 64] >> (cell % 64) & 1 == 1
    }

    fn scaled(&self, p: &Point3<f64>) -> [f64; 3] {
        [0, 1, 2].map(|k| (p[k] - self.low[k]) / self.side)
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.n[1] + j) * self.n[0] + i
    }

    fn n_words(&self) -> usize {
        self.n.iter().product::<usize>().div_ceil(64)
    }

    /// Returns a bit for each cell that a triangle may meet; `None` where triangles are too large
    /// for the grid.
    fn marked(&self, corners: &[[Point3<f64>; 3]]) -> Option<Vec<u64>> {
        let mut marked = vec![0; self.n_words()];
        let mut marks = 0;
        for triangle in corners {
            let around = Aabb::of_points(triangle).dilated(MARGIN);
            let [low, high] = [around.min, around.max].map(|p| self.scaled(&p).map(|c| c as usize));
            marks += (0..3).map(|k| high[k] - low[k] + 1).product::<usize>();
            if marks > MOST_MARKS {
                return None;
            }
            for k in low[2]..=high[2] {
                for j in low[1]..=high[1] {
                    let row = self.index([0, j, k]);
                    (row + low[0]..=row + high[0]).for_each(|cell| marked[cell / 64] |= 1 << (cell % 64));
                }
            }
        }
        Some(marked)
    }

    /// Returns a bit for each cell that is reached from the rim without meeting marked ones.
    fn reached(&self, marked: &[u64]) -> Vec<u64> {
        let mut reached = vec![0u64; marked.len()];
        // Up to half of the cells wait at once; their indices along an axis are below 2^11.
        let mut pending: Vec<[u16; 3]> = Vec::new();
        let mut take = |cell: [usize; 3], pending: &mut Vec<[u16; 3]>| {
            let index = self.index(cell);
            let (word, bit) = (index / 64, 1 << (index % 64));
            if (marked[word] | reached[word]) & bit == 0 {
                reached[word] |= bit;
                pending.push(cell.map(|k| k as u16));
            }
        };
        // All of the rim hangs together.
        take([0; 3], &mut pending);
        while let Some(cell) = pending.pop().map(|cell| cell.map(usize::from)) {
            for axis in 0..3 {
                let mut beside = cell;
                if cell[axis] > 0 {
                    beside[axis] = cell[axis] - 1;
                    take(beside, &mut pending);
                }
                if cell[axis] + 1 < self.n[axis] {
                    beside[axis] = cell[axis] + 1;
                    take(beside, &mut pending);
                }
            }
        }
        reached
    }
}

#[cfg(test)]
#[path = "../tests/unit/outside_laws.rs"]
mod tests;
