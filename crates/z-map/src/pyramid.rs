//! Highest values of blocks of cells, level by level.

use rayon::prelude::*;

/// Maxima of a grid of cells, of blocks of 2 × 2 of them, of 2 × 2 of those, and so on up to a
/// single value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pyramid {
    /// From the cells to the top.
    levels: Vec<Level>,
}

#[derive(Clone, Debug, PartialEq)]
struct Level {
    nx: usize,
    ny: usize,
    max: Vec<f64>,
}

/// A block of 2^level × 2^level cells, cut off at the grid's border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Block {
    pub(crate) level: usize,
    pub(crate) i: usize,
    pub(crate) j: usize,
}

impl Pyramid {
    /// `cells` row by row, at least one of them.
    pub(crate) fn new(nx: usize, ny: usize, cells: Vec<f64>) -> Self {
        let mut levels = vec![Level { nx, ny, max: cells }];
        while let Some(last) = levels.last()
            && (last.nx > 1 || last.ny > 1)
        {
            let next = last.coarser();
            levels.push(next);
        }
        Self { levels }
    }

    pub(crate) fn top(&self) -> Block {
        Block { level: self.levels.len() - 1, i: 0, j: 0 }
    }

    pub(crate) fn max(&self, block: Block) -> f64 {
        self.levels[block.level].at(block.i, block.j)
    }

    /// The up to four blocks that a block above the cells consists of.
    pub(crate) fn children(&self, block: Block) -> impl Iterator<Item = Block> + use<> {
        let level = block.level.saturating_sub(1);
        let (nx, ny) = (self.levels[level].nx, self.levels[level].ny);
        let all = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(di, dj)| (2 * block.i + di, 2 * block.j + dj));
        let is_above_cells = block.level > 0;
        all.into_iter().filter(move |&(i, j)| is_above_cells && i < nx && j < ny).map(move |(i, j)| Block {
            level,
            i,
            j,
        })
    }

    /// Columns and rows of cells of a block, ends excluded.
    pub(crate) fn cells(&self, block: Block) -> [std::ops::Range<usize>; 2] {
        let range = |k: usize, n: usize| k << block.level..((k + 1) << block.level).min(n);
        [range(block.i, self.levels[0].nx), range(block.j, self.levels[0].ny)]
    }

    /// Largest value over a range of cells; −∞ for an empty range.
    pub(crate) fn max_over(&self, columns: std::ops::Range<usize>, rows: std::ops::Range<usize>) -> f64 {
        let mut best = f64::NEG_INFINITY;
        let mut open = vec![self.top()];
        while let Some(block) = open.pop() {
            let [i, j] = self.cells(block);
            let misses = i.end <= columns.start || columns.end <= i.start || j.end <= rows.start || rows.end <= j.start;
            if misses || self.max(block) <= best {
                continue;
            }
            let within = columns.start <= i.start && i.end <= columns.end && rows.start <= j.start && j.end <= rows.end;
            if within {
                best = self.max(block);
            } else {
                open.extend(self.children(block));
            }
        }
        best
    }

    /// Whether every block holds the maximum of its parts, and none is NaN.
    pub(crate) fn check(&self) -> Result<(), String> {
        for (level, l) in self.levels.iter().enumerate() {
            if l.max.len() != l.nx * l.ny || l.max.iter().any(|z| z.is_nan()) {
                return Err(format!("level {level} of the pyramid has a NaN or a wrong size"));
            }
        }
        match self.levels.windows(2).position(|pair| pair[0].coarser() != pair[1]) {
            Some(level) => Err(format!("level {} of the pyramid does not hold the maxima of level {level}", level + 1)),
            None if self.max(self.top()) == self.max_over(0..self.levels[0].nx, 0..self.levels[0].ny) => Ok(()),
            None => Err("the top of the pyramid is not one block".to_owned()),
        }
    }
}

impl Level {
    fn at(&self, i: usize, j: usize) -> f64 {
        self.max[j * self.nx + i]
    }

    fn coarser(&self) -> Self {
        let (nx, ny) = (self.nx.div_ceil(2), self.ny.div_ceil(2));
        let row = |j: usize| {
            (0..nx).map(move |i| {
                let (right, above) = ((2 * i + 1).min(self.nx - 1), (2 * j + 1).min(self.ny - 1));
                let below = self.at(2 * i, 2 * j).max(self.at(right, 2 * j));
                below.max(self.at(2 * i, above)).max(self.at(right, above))
            })
        };
        Self { nx, ny, max: (0..ny).into_par_iter().flat_map_iter(row).collect() }
    }
}

#[cfg(test)]
#[path = "../tests/unit/pyramid.rs"]
mod tests;
