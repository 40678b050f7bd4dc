use rayon::prelude::*;

use crate::dexel::cut::{BATCH, Contact, Deepest, Glance, Window, deeper, placed};
use crate::dexel::map::DexelMap;
use crate::dexel::sweep::{Sweep, SweepError};
use crate::dexel::tile::SIDE;

/// What is done with the stock, one step after the other.
#[derive(Clone, Copy, Debug)]
pub enum Step<'a> {
    /// Takes what is swept out of it, as [`DexelMap::remove`] does.
    Remove(Sweep<'a>),
    /// Asks where what is swept meets it as it is then, as [`DexelMap::meets`] does.
    Ask(Sweep<'a>),
}

/// What a step took or met.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepResult {
    /// Volume that was taken out, mm³; 0 of a step that asks.
    pub volume: f64,
    /// Lines that lost material, counted once for each straight piece of the motion.
    pub lines: u64,
    /// Where a step that asks met the material deepest.
    pub deepest: Option<Contact>,
}

impl<'a> Step<'a> {
    fn sweep(&self) -> &Sweep<'a> {
        match self {
            Step::Remove(sweep) | Step::Ask(sweep) => sweep,
        }
    }
}

/// What a step did on one tile.
type OnTile = (usize, [f64; 2], Option<Deepest>);

impl DexelMap {
    /// Takes steps one after the other, each on the stock that those before it have left: in parallel over the tiles, which
    /// know nothing of each other, with the same result on any number of threads.
    ///
    /// # Errors
    /// As [`DexelMap::remove_all`]; the map is unchanged then.
    pub fn run(&mut self, steps: &[Step<'_>], tolerance: f64) -> Result<Vec<StepResult>, SweepError> {
        let sweeps: Vec<Sweep<'_>> = steps.iter().map(|s| *s.sweep()).collect();
        let pieces = self.pieces(&sweeps, tolerance)?;
        let grid = self.grid;
        let tiles_x = self.tiles_x();
        let arch = pulp::Arch::new();
        let mut results = vec![StepResult::default(); steps.len()];
        let mut deepest: Vec<Option<Deepest>> = vec![None; steps.len()];
        for batch in pieces.chunks(BATCH) {
            let placed = placed(batch, &grid);
            let work = self.work(&placed);
            let of_tile = |(k, tile): (usize, &mut _)| -> Vec<OnTile> {
                let (i0, j0) = (k % tiles_x * SIDE, k / tiles_x * SIDE);
                let mut window = Window { grid: &grid, i0, j0, tile, arch };
                let done = work[k].iter().filter_map(|&p| {
                    let (step, straight) = &placed[p as usize];
                    match steps[*step] {
                        Step::Remove(_) => {
                            let loss = window.cut(straight);
                            (loss[0] > 0.0).then_some((*step, loss, None))
                        }
                        Step::Ask(_) => {
                            let glance = Glance { grid: &grid, i0, j0, tile: window.tile, arch };
                            glance.deepest(straight).map(|met| (*step, [0.0; 2], Some(met)))
                        }
                    }
                });
                done.collect()
            };
            let is_worth_threads = placed.len() > 4;
            let of_tiles: Vec<Vec<OnTile>> = if is_worth_threads {
                self.tiles.par_iter_mut().enumerate().map(of_tile).collect()
            } else {
                self.tiles.iter_mut().enumerate().filter(|(k, _)| !work[*k].is_empty()).map(of_tile).collect()
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
