//! Which parts of sweeps are looked at on which tiles.

use std::collections::HashMap;
use std::sync::OnceLock;

use rayon::prelude::*;

use crate::dexel::bodies::body::TurnedBody;
use crate::dexel::bodies::straight::Swept;
use crate::dexel::bodies::sweep::{Purpose, SweepError, SweepPart};
use crate::dexel::cut::{Deepest, Glance, deeper};
use crate::dexel::grid::DexelGrid;
use crate::dexel::map::DexelMap;
use crate::dexel::run::is_apart;
use crate::dexel::steps::Step;
use crate::dexel::tile::SIDE;

/// Parts that are placed before tiles are gone through: bounds the memory for their outlines.
pub(crate) const BATCH: usize = 4096;

/// Multiple of the tolerance by which a body is dilated, and its motion may be off, in its first
/// query. A larger one makes fewer pieces of a motion; bodies that come near material are queried a
/// second time.
const COARSER: f64 = 8.0;

/// Part of a step's sweep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Task<'a> {
    step: usize,
    part: SweepPart<'a>,
    is_tested: bool,
}

/// A part that is near material.
pub(crate) struct Job<'a> {
    pub(crate) step: usize,
    pub(crate) swept: Swept<'a>,
    /// Finer query of a part, where `swept`, which contains it, meets material.
    finer: Option<Finer<'a>>,
}

struct Finer<'a> {
    part: SweepPart<'a>,
    pieces: OnceLock<Vec<Swept<'a>>>,
}

impl<'a> Job<'a> {
    /// Where a tile is met deepest.
    pub(crate) fn deepest(&self, glance: &Glance) -> Option<Deepest> {
        let met = glance.deepest(&self.swept)?;
        let Some(Finer { part, pieces }) = &self.finer else { return Some(met) };
        let place = |poses| {
            let mut swept = Swept::straight(part.body, poses, glance.grid)?;
            swept.outline(glance.grid);
            Some(swept)
        };
        let pieces = pieces.get_or_init(|| part.pieces(part.n_pieces).filter_map(place).collect());
        pieces.iter().filter_map(|piece| glance.deepest(piece)).reduce(deeper)
    }
}

/// The tasks of steps, in order.
pub(crate) fn tasks<'a>(grid: &DexelGrid, steps: &'a [Step<'a>], tolerance: f64) -> Result<Vec<Task<'a>>, SweepError> {
    let map_from_work = grid.work_from_map().inverse();
    let mut tasks = Vec::with_capacity(steps.len());
    for (step, kind) in steps.iter().enumerate() {
        let is_tested = matches!(kind, Step::Ask(_));
        let purpose = if is_tested { Purpose::Ask { coarser: COARSER } } else { Purpose::Cut };
        let parts = kind.sweep().parts(step, &map_from_work, tolerance, purpose)?;
        tasks.extend(parts.into_iter().map(|part| Task { step, part, is_tested }));
    }
    Ok(tasks)
}

/// Bodies that contain the queried ones with everything within the first tolerance of them, by
/// the address of the body.
pub(crate) struct Wider(HashMap<usize, TurnedBody>);

impl Wider {
    pub(crate) fn of(tasks: &[Task], tolerance: f64) -> Self {
        let mut bodies = HashMap::new();
        for Task { part, .. } in tasks.iter().filter(|t| t.is_tested && t.part.n_pieces > 1) {
            let dilated = || part.body.dilated((COARSER + 1.0) * tolerance);
            bodies.entry(std::ptr::from_ref(part.body).addr()).or_insert_with(dilated);
        }
        Self(bodies)
    }

    fn body(&self, body: &TurnedBody) -> Option<&TurnedBody> {
        self.0.get(&std::ptr::from_ref(body).addr())
    }
}

/// The jobs of a batch, and for each tile that is near any of them, upward, which: what bounds tell
/// of the map as it is now.
pub(crate) struct Plan<'a> {
    pub(crate) jobs: Vec<Job<'a>>,
    /// Tile and job.
    pairs: Vec<(u32, u32)>,
}

impl<'a> Plan<'a> {
    pub(crate) fn new(map: &DexelMap, batch: &[Task<'a>], wider: &'a Wider, tolerance: f64) -> Self {
        let place = |task: &Task<'a>| map.job(task, wider, tolerance);
        let found: Vec<(Job<'a>, Vec<u32>)> = if batch.len() > 4 {
            batch.par_iter().with_min_len(16).filter_map(place).collect()
        } else {
            batch.iter().filter_map(place).collect()
        };
        let mut plan = Self { jobs: Vec::with_capacity(found.len()), pairs: Vec::new() };
        for (job, tiles) in found {
            let index = plan.jobs.len() as u32;
            plan.pairs.extend(tiles.into_iter().map(|tile| (tile, index)));
            plan.jobs.push(job);
        }
        plan.pairs.sort_unstable();
        plan
    }

    /// The jobs of each tile that has any.
    pub(crate) fn of_tiles(&self) -> impl Iterator<Item = (usize, &[(u32, u32)])> {
        self.pairs.chunk_by(|a, b| a.0 == b.0).map(|of_tile| (of_tile[0].0 as usize, of_tile))
    }
}

impl DexelMap {
    /// A task as it is looked at, and the tiles that it is near; `None` where there is none.
    fn job<'a>(&self, task: &Task<'a>, wider: &'a Wider, tolerance: f64) -> Option<(Job<'a>, Vec<u32>)> {
        let (Task { step, part, is_tested }, grid) = (*task, &self.grid);
        let whole = part.pieces(1).next()?;
        let coarse = wider.body(part.body).filter(|_| is_tested && part.n_pieces > 1);
        let mut swept = match coarse {
            Some(body) => Swept::straight(body, whole, grid)?,
            None if part.n_pieces > 1 => Swept::turning(&part, tolerance, grid)?,
            None => Swept::straight(part.body, whole, grid)?,
        };
        let [rows, columns] = swept.window.map(|range| range.map(|line| line / SIDE));
        let tiles = (rows[0]..=rows[1]).flat_map(|tj| (columns[0]..=columns[1]).map(move |ti| [ti, tj]));
        let near = tiles.filter_map(|[ti, tj]| {
            let k = tj * self.tiles_x() + ti;
            (!is_apart(grid, [ti * SIDE, tj * SIDE], &self.tiles[k], &swept)).then_some(k as u32)
        });
        let near: Vec<u32> = near.collect();
        if near.is_empty() {
            return None;
        }
        swept.outline(grid);
        let finer = coarse.map(|_| Finer { part, pieces: OnceLock::new() });
        Some((Job { step, swept, finer }, near))
    }
}
