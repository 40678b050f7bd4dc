use rayon::prelude::*;

use crate::dexel::bodies::sweep::{Sweep, SweepError};
use crate::dexel::cut::{Contact, CutTile, Deepest, Glance, deeper};
use crate::dexel::job::{BATCH, Plan, Wider, tasks};
use crate::dexel::map::DexelMap;
use crate::dexel::tile::{SIDE, Tile};

/// Operations on the stock, one after the other.
#[derive(Clone, Copy, Debug)]
pub enum Step<'a> {
    /// Takes what is swept out of it, as [`DexelMap::remove`] does.
    Remove(Sweep<'a>),
    /// Asks where what is swept meets it as it is then, as [`DexelMap::meets`] does.
    Ask(Sweep<'a>),
}

/// Material that a step removed or met.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepResult {
    /// Removed volume, mm³; 0 of a query.
    pub volume: f64,
    /// Lines that lost material, counted once for each part of a motion that turns.
    pub lines: u64,
    /// Place where a query meets the material deepest.
    pub deepest: Option<Contact>,
}

impl<'a> Step<'a> {
    pub(crate) fn sweep(&self) -> &Sweep<'a> {
        match self {
            Step::Remove(sweep) | Step::Ask(sweep) => sweep,
        }
    }
}

/// Result of a step on one tile.
type OnTile = (usize, [f64; 2], Option<Deepest>);

impl DexelMap {
    /// Takes steps one after the other, each on the stock that those before it have left: in
    /// parallel over the tiles, which know nothing of each other, with the same result on any
    /// number of threads.
    ///
    /// # Errors
    /// As [`DexelMap::remove_all`]; the map is unchanged then.
    pub fn run(&mut self, steps: &[Step<'_>], tolerance: f64) -> Result<Vec<StepResult>, SweepError> {
        let tasks = tasks(&self.grid, steps, tolerance)?;
        let wider = Wider::of(&tasks, tolerance);
        let grid = self.grid;
        let tiles_x = self.tiles_x();
        let arch = pulp::Arch::new();
        let mut results = vec![StepResult::default(); steps.len()];
        let mut deepest: Vec<Option<Deepest>> = vec![None; steps.len()];
        for batch in tasks.chunks(BATCH) {
            let plan = Plan::new(self, batch, &wider, tolerance);
            let of_tile = |(k, tile, of_tile): Busy<'_, '_>| -> Vec<OnTile> {
                let (i0, j0) = (k % tiles_x * SIDE, k / tiles_x * SIDE);
                let mut window = CutTile { grid: &grid, i0, j0, tile, arch };
                let done = of_tile.iter().filter_map(|&(_, job)| {
                    let job = &plan.jobs[job as usize];
                    match steps[job.step] {
                        Step::Remove(_) => {
                            let loss = window.cut(&job.swept);
                            (loss[0] > 0.0).then_some((job.step, loss, None))
                        }
                        Step::Ask(_) => {
                            let glance = Glance { grid: &grid, i0, j0, tile: window.tile, arch };
                            job.deepest(&glance).map(|met| (job.step, [0.0; 2], Some(met)))
                        }
                    }
                });
                done.collect()
            };
            let busy = busy(&mut self.tiles, &plan);
            let of_tiles: Vec<Vec<OnTile>> = if plan.jobs.len() > 4 {
                busy.into_par_iter().map(of_tile).collect()
            } else {
                busy.into_iter().map(of_tile).collect()
            };
            for (step, [length, lines], met) in of_tiles.into_iter().flatten() {
                results[step].volume += length;
                results[step].lines += lines as u64;
                deepest[step] = deepest[step].into_iter().chain(met).reduce(deeper);
            }
        }
        for (result, met) in results.iter_mut().zip(deepest) {
            result.volume *= grid.cell() * grid.cell();
            result.deepest = met
                .map(|(i, j, [from, to])| Contact { place: grid.in_work(i, j, 0.5 * (from + to)), depth: to - from });
        }
        Ok(results)
    }
}

/// A tile, and its jobs.
type Busy<'t, 'p> = (usize, &'t mut Tile, &'p [(u32, u32)]);

/// The tiles that have something to do, each with what.
fn busy<'t, 'p>(tiles: &'t mut [Tile], plan: &'p Plan) -> Vec<Busy<'t, 'p>> {
    let mut rest = tiles.iter_mut().enumerate();
    let mut next = 0;
    let of_tile = |(k, of_tile)| {
        let (_, tile) = rest.nth(k - next)?;
        next = k + 1;
        Some((k, tile, of_tile))
    };
    plan.of_tiles().filter_map(of_tile).collect()
}
