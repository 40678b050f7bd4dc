//! Taking swept solids out of a map, and asking whether they meet it.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::dexel::bodies::straight::{Swept, Warmth};
use crate::dexel::bodies::sweep::{Sweep, SweepError};
use crate::dexel::grid::DexelGrid;
use crate::dexel::job::{BATCH, Plan, Wider, tasks};
use crate::dexel::map::DexelMap;
use crate::dexel::run::{Ask, Scan, rows_to_look_at, run_of_row};
use crate::dexel::steps::{Step, StepResult};
use crate::dexel::tile::{SIDE, Tile};

/// Material that a sweep removed from the stock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cut {
    /// Volume, mm³: length taken out of the lines by the area of a cell.
    pub volume: f64,
    /// Lines that lost material, counted once for each part of a motion that turns.
    pub lines: u64,
}

/// Where a sweep meets the stock deepest along a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Middle of the material that is met there, workpiece frame.
    pub place: Point3<f64>,
    /// Length of the line's material inside the swept solid, mm, in one of its intervals.
    pub depth: f64,
}

impl DexelMap {
    /// Takes what a body sweeps out of the material.
    ///
    /// Without a turn of the axis each line loses exactly what is inside the swept solid, up to
    /// rounding (about 10⁻¹⁰ mm where the line is not nearly a tangent). With a turn it loses what
    /// is inside a solid no point of which is farther than `tolerance` from the swept one, and no
    /// point of the swept one is farther from it.
    ///
    /// # Errors
    /// When a pose or the tolerance is no number to work with; the map is unchanged then.
    pub fn remove(&mut self, sweep: &Sweep, tolerance: f64) -> Result<Cut, SweepError> {
        Ok(self.remove_all(std::slice::from_ref(sweep), tolerance)?[0])
    }

    /// [`DexelMap::remove`] of one sweep after the other, with what each of them took: in parallel
    /// over the tiles, with the same result on any number of threads.
    ///
    /// # Errors
    /// As for one sweep, with the index of the sweep. The map is unchanged then.
    pub fn remove_all(&mut self, sweeps: &[Sweep], tolerance: f64) -> Result<Vec<Cut>, SweepError> {
        let steps: Vec<Step<'_>> = sweeps.iter().map(|sweep| Step::Remove(*sweep)).collect();
        let cuts = self.run(&steps, tolerance)?;
        Ok(cuts.into_iter().map(|StepResult { volume, lines, .. }| Cut { volume, lines }).collect())
    }

    /// Where what a body sweeps is deepest in the material, along the lines; `None` where no line's
    /// material is met. The map stays as it is.
    ///
    /// Lines are samples: a body that meets the solid only between them is not seen. One that is
    /// dilated by half a cell's diagonal is seen wherever the undilated one meets the material of a
    /// cell, taken as a prism with the material of its line.
    ///
    /// # Errors
    /// As for [`DexelMap::remove`].
    pub fn meets(&self, sweep: &Sweep, tolerance: f64) -> Result<Option<Contact>, SweepError> {
        let steps = [Step::Ask(*sweep)];
        let tasks = tasks(&self.grid, &steps, tolerance)?;
        let wider = Wider::of(&tasks, tolerance);
        let tiles_x = self.tiles_x();
        let arch = pulp::Arch::new();
        let mut deepest: Option<Deepest> = None;
        for batch in tasks.chunks(BATCH) {
            let plan = Plan::new(self, batch, &wider, tolerance);
            let busy: Vec<_> = plan.of_tiles().collect();
            let of_tile = |&(k, of_tile): &(usize, &[(u32, u32)])| {
                let (i0, j0) = (k % tiles_x * SIDE, k / tiles_x * SIDE);
                let glance = Glance { grid: &self.grid, i0, j0, tile: &self.tiles[k], arch };
                of_tile.iter().filter_map(|&(_, job)| plan.jobs[job as usize].deepest(&glance)).reduce(deeper)
            };
            let found: Vec<_> = busy.par_iter().filter_map(of_tile).collect();
            deepest = deepest.into_iter().chain(found).reduce(deeper);
        }
        Ok(deepest
            .map(|(i, j, [from, to])| Contact { place: self.grid.in_work(i, j, 0.5 * (from + to)), depth: to - from }))
    }
}

pub(crate) type Deepest = (usize, usize, [f64; 2]);

/// The deeper one; the first of two that are equal.
pub(crate) fn deeper(a: Deepest, b: Deepest) -> Deepest {
    if b.2[1] - b.2[0] > a.2[1] - a.2[0] { b } else { a }
}

/// A tile that is being cut.
pub(crate) struct CutTile<'a> {
    pub(crate) grid: &'a DexelGrid,
    pub(crate) i0: usize,
    pub(crate) j0: usize,
    pub(crate) tile: &'a mut Tile,
    /// Available vector instructions.
    pub(crate) arch: pulp::Arch,
}

impl CutTile<'_> {
    /// Length taken out, and number of lines.
    pub(crate) fn cut(&mut self, swept: &Swept) -> [f64; 2] {
        let Some(rows) = rows_to_look_at(self.grid, self.i0, self.j0, self.tile, swept) else { return [0.0; 2] };
        let (mut length, mut lines) = (0.0, 0);
        let mut warmth = Warmth::default();
        for j in rows {
            let row = j - self.j0;
            let bounds = self.tile.row_bounds(row);
            let Some(run) = run_of_row(self.grid, self.i0, j, bounds, swept, &warmth) else { continue };
            let scan = Scan { grid: self.grid, swept, i0: self.i0, row, tile: self.tile, run };
            let (removed, n, known) = self.arch.dispatch(scan);
            warmth = known;
            if removed > 0.0 {
                self.tile.refresh_row(row);
            }
            length += removed;
            lines += n;
        }
        if length > 0.0 {
            self.tile.refresh();
        }
        [length, lines as f64]
    }
}

/// Tile that is queried.
pub(crate) struct Glance<'a> {
    pub(crate) grid: &'a DexelGrid,
    pub(crate) i0: usize,
    pub(crate) j0: usize,
    pub(crate) tile: &'a Tile,
    /// Available vector instructions.
    pub(crate) arch: pulp::Arch,
}

impl Glance<'_> {
    pub(crate) fn deepest(&self, swept: &Swept) -> Option<Deepest> {
        let (grid, tile) = (self.grid, self.tile);
        let mut deepest: Option<Deepest> = None;
        let mut warmth = Warmth::default();
        for j in rows_to_look_at(grid, self.i0, self.j0, tile, swept)? {
            let row = j - self.j0;
            let Some(run) = run_of_row(grid, self.i0, j, tile.row_bounds(row), swept, &warmth) else { continue };
            let (met, known) = self.arch.dispatch(Ask { grid, swept, i0: self.i0, row, tile, run });
            warmth = known;
            deepest = deepest.into_iter().chain(met.map(|(i, met)| (i, j, met))).reduce(deeper);
        }
        deepest
    }
}
