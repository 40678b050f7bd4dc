//! One row of a tile under a straight sweep.

use std::ops::RangeInclusive;

use pulp::NullaryFnOnce;

use crate::dexel::bodies::lanes::{LANES, Verdicts, Wide};
use crate::dexel::bodies::straight::{Swept, Warmth, interval};
use crate::dexel::grid::DexelGrid;
use crate::dexel::tile::{DUST, SIDE, Tile};

/// Distance by which a bound must clear the material, mm: above the rounding of heights and of the
/// slopes that bounds are made of. Larger costs the exact answer for lines that are nearly touched.
const CLEAR: f64 = 1e-6;

/// The lines of a row that may meet a swept solid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LineRun {
    /// First and last column.
    pub(crate) columns: [usize; 2],
    y: f64,
    warmth: Warmth,
}

/// Cutting a run.
///
/// Of its own type, because of a closure called by [`pulp::Arch::dispatch`] only a shell would get
/// the vector instructions.
pub(crate) struct Scan<'a, 'b> {
    pub(crate) grid: &'a DexelGrid,
    pub(crate) swept: &'a Swept<'b>,
    /// First column of the tile.
    pub(crate) i0: usize,
    /// Row of the tile.
    pub(crate) row: usize,
    pub(crate) tile: &'a mut Tile,
    pub(crate) run: LineRun,
}

impl NullaryFnOnce for Scan<'_, '_> {
    /// Length taken out, mm, number of lines that lost any, and what is known then.
    type Output = (f64, u64, Warmth);

    #[inline(always)]
    fn call(mut self) -> Self::Output {
        let [mut i, last] = self.run.columns;
        let mut lost = (0.0, 0);
        while i <= last {
            i += self.block(i, last, &mut lost);
        }
        (lost.0, lost.1, self.run.warmth)
    }
}

impl Scan<'_, '_> {
    /// Sixteen lines or what is left of the row; returns how many.
    #[inline(always)]
    fn block(&mut self, first: usize, last: usize, lost: &mut (f64, u64)) -> usize {
        let n = LANES.min(last - first + 1);
        let line = self.row * SIDE + first - self.i0;
        let tops = tops(self.tile, line, n);
        let x = places(self.grid, first);
        let Some(found) = look(self.swept, &x, &tops, &mut self.run) else { return n };
        for l in 0..n {
            if found.is_untouched[l] || tops[l] == f64::NEG_INFINITY {
                continue;
            }
            if found.cut_from[l].is_nan() {
                self.one(line + l, x[l], tops[l], lost);
            } else {
                count(self.tile.cut_down(line + l, found.cut_from[l]), lost);
            }
        }
        n
    }

    /// One line, by search, of each straight piece.
    #[inline(never)]
    fn one(&mut self, line: usize, x: f64, top: f64, lost: &mut (f64, u64)) {
        let y = self.run.y;
        let removed = match self.swept.pieces() {
            [piece] => interval(piece, [x, y], top, &mut self.run.warmth)
                .map_or(0.0, |[from, to]| self.tile.subtract(line, from, to)),
            pieces => {
                let of_piece = |piece| interval(piece, [x, y], top, &mut Warmth::default());
                pieces.iter().filter_map(of_piece).map(|[from, to]| self.tile.subtract(line, from, to)).sum()
            }
        };
        count(removed, lost);
    }
}

#[inline(always)]
fn count(length: f64, lost: &mut (f64, u64)) {
    lost.0 += length;
    lost.1 += u64::from(length > 0.0);
}

/// Asking a run; of its own type for the reason that [`Scan`] is.
pub(crate) struct Ask<'a, 'b> {
    pub(crate) grid: &'a DexelGrid,
    pub(crate) swept: &'a Swept<'b>,
    /// First column of the tile.
    pub(crate) i0: usize,
    /// Row of the tile.
    pub(crate) row: usize,
    pub(crate) tile: &'a Tile,
    pub(crate) run: LineRun,
}

/// Part of a line in a tile that a solid meets, and its column.
pub(crate) type Met = (usize, [f64; 2]);

impl NullaryFnOnce for Ask<'_, '_> {
    /// Where the run is met deepest, and what is known then.
    type Output = (Option<Met>, Warmth);

    #[inline(always)]
    fn call(mut self) -> Self::Output {
        let [mut i, last] = self.run.columns;
        let mut deepest = None;
        while i <= last {
            i += self.block(i, last, &mut deepest);
        }
        (deepest, self.run.warmth)
    }
}

impl Ask<'_, '_> {
    /// Sixteen lines or what is left of the row; returns how many.
    #[inline(always)]
    fn block(&mut self, first: usize, last: usize, deepest: &mut Option<Met>) -> usize {
        let n = LANES.min(last - first + 1);
        let line = self.row * SIDE + first - self.i0;
        let tops = tops(self.tile, line, n);
        let x = places(self.grid, first);
        let Some(found) = look(self.swept, &x, &tops, &mut self.run) else { return n };
        for l in 0..n {
            if !(found.is_untouched[l] || tops[l] == f64::NEG_INFINITY) {
                self.one(first + l, x[l], tops[l], found.cut_from[l], deepest);
            }
        }
        n
    }

    /// One line, of which it may be known from where on all its material is met.
    #[inline(never)]
    fn one(&mut self, column: usize, x: f64, top: f64, met_from: f64, deepest: &mut Option<Met>) {
        let known = (!met_from.is_nan()).then_some([met_from, f64::INFINITY]);
        let search = |piece| interval(piece, [x, self.run.y], top, &mut self.run.warmth);
        let Some([from, to]) = known.or_else(|| self.swept.pieces().iter().find_map(search)) else { return };
        for interval in self.tile.intervals(self.row * SIDE + column - self.i0) {
            let met = [from.max(interval.bottom), to.min(interval.top)];
            let depth = met[1] - met[0];
            if depth > deepest.map_or(DUST, |(_, [from, to])| to - from) {
                *deepest = Some((column, met));
            }
        }
    }
}

/// Heights at which the material of lines ends, from a line of a tile on; −∞ without material, and
/// beyond the n-th.
#[inline(always)]
fn tops(tile: &Tile, line: usize, n: usize) -> Wide {
    let mut tops = [f64::NEG_INFINITY; LANES];
    let (row, column) = (line / SIDE, line % SIDE);
    if tile.is_row_plain(row) {
        tops[..n].copy_from_slice(&tile.lowest_tops(row)[column..][..n]);
    } else {
        (0..n).for_each(|l| tops[l] = tile.top_of(line + l));
    }
    tops
}

/// x of lines from a column on.
#[inline(always)]
fn places(grid: &DexelGrid, first: usize) -> Wide {
    let (x0, cell) = (grid.x(first), grid.cell());
    let mut x = [0.0; LANES];
    (0..LANES).for_each(|l| x[l] = x0 + l as f64 * cell);
    x
}

/// Returns the quickly found losses of sixteen lines; `None` if bounds prove that none is touched.
#[inline(always)]
fn look(swept: &Swept, x: &Wide, tops: &Wide, run: &mut LineRun) -> Option<Verdicts> {
    let mut floors = [0.0; LANES];
    let mut is_clear = true;
    for l in 0..LANES {
        floors[l] = swept.floor_at(x[l], run.y);
        is_clear &= floors[l] >= tops[l] + CLEAR;
    }
    if is_clear {
        return None;
    }
    // A line without material has its top at −∞; the look at it must be at a number.
    let mut looks = [0.0; LANES];
    for l in 0..LANES {
        looks[l] = if tops[l] == f64::NEG_INFINITY { floors[l] } else { tops[l] };
    }
    Some(swept.verdicts(x, run.y, &looks, &floors, &mut run.warmth))
}

/// Whether bounds tell that a solid is apart from all of a tile's material.
pub(crate) fn is_apart(grid: &DexelGrid, [i0, j0]: [usize; 2], tile: &Tile, swept: &Swept) -> bool {
    let [low, high] = tile.bounds();
    let ends = |a: f64| [a, a + (SIDE - 1) as f64 * grid.cell()];
    high == f64::NEG_INFINITY
        || swept.bounds[1] <= low - CLEAR
        || swept.bounds[0] >= high + CLEAR
        || swept.floor(ends(grid.x(i0)), ends(grid.y(j0))) >= high + CLEAR
}

/// Rows of a tile that a solid may touch; `None` where its bounds are clear of all of the tile's
/// material.
pub(crate) fn rows_to_look_at(
    grid: &DexelGrid,
    i0: usize,
    j0: usize,
    tile: &Tile,
    swept: &Swept,
) -> Option<RangeInclusive<usize>> {
    let (first, last) = (swept.window[0][0].max(j0), swept.window[0][1].min(j0 + SIDE - 1));
    (!is_apart(grid, [i0, j0], tile, swept) && first <= last).then_some(first..=last)
}

/// The lines of a row of a tile that a solid may meet, if they may lose anything; `bounds` are
/// those of the row's material. `warmth` is what is known from the row before.
pub(crate) fn run_of_row(
    grid: &DexelGrid,
    i0: usize,
    j: usize,
    [low, high]: [f64; 2],
    swept: &Swept,
    warmth: &Warmth,
) -> Option<LineRun> {
    let columns = swept.rows.within(j, i0, i0 + SIDE - 1)?;
    if high == f64::NEG_INFINITY || swept.bounds[0] >= high + CLEAR || swept.bounds[1] <= low - CLEAR {
        return None;
    }
    let y = grid.y(j);
    let is_clear = swept.floor(columns.map(|i| grid.x(i)), [y, y]) >= high + CLEAR;
    (!is_clear).then_some(LineRun { columns, y, warmth: *warmth })
}
