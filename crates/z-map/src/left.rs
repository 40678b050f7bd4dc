//! Heights of material that a moving cutter leaves on places of a surface.

mod gauge;
mod leaf;
pub(crate) mod place;
mod tree;

use std::borrow::Borrow;

use facemill_cl_data::{Cancelled, Monitor};
use facemill_tool_model::Cutter;
use rayon::prelude::*;

use crate::left::gauge::Gauge;
use crate::left::place::{CutterMotion, LeftHeight, SurfacePlace};
use crate::left::tree::Tree;

/// Places that one thread looks at one after the other: a neighbour's motion is a good first guess.
const PLACES_PER_CHUNK: usize = 128;

/// Heights that several cutters together leave on places, in their order: on each the least.
///
/// The result does not depend on the number of threads. A step of `monitor` is a place.
///
/// # Errors
/// When the monitor cancels.
pub fn left_heights(
    sweeps: &[impl Borrow<SweptCutter> + Sync],
    places: &[SurfacePlace],
    monitor: &dyn Monitor,
) -> Result<Vec<LeftHeight>, Cancelled> {
    let of_chunk = |chunk: &[SurfacePlace]| {
        monitor.checkpoint()?;
        let mut guesses = vec![None; sweeps.len()];
        let lowest = |place: &SurfacePlace| {
            let mut lowest = LeftHeight { height: place.stock, cut_by: None };
            let mut below = bound_by_guesses(sweeps, &guesses, place);
            for (sweep, guess) in sweeps.iter().zip(&mut guesses) {
                let Some((height, motion)) = sweep.borrow().left_below(place, below, *guess) else { continue };
                let cut_by = sweep.borrow().motions[motion].id;
                (lowest, below, *guess) = (LeftHeight { height, cut_by: Some(cut_by) }, height, Some(motion));
            }
            lowest
        };
        let found: Vec<LeftHeight> = chunk.iter().map(lowest).collect();
        monitor.advance(chunk.len());
        Ok(found)
    };
    let chunks: Vec<Vec<LeftHeight>> =
        places.par_chunks(PLACES_PER_CHUNK).map(of_chunk).collect::<Result<_, Cancelled>>()?;
    Ok(chunks.concat())
}

/// Returns a height that is above the least on a place or is the stock's, by the motions that cut
/// the place before it.
fn bound_by_guesses(sweeps: &[impl Borrow<SweptCutter>], guesses: &[Option<usize>], place: &SurfacePlace) -> f64 {
    // A single sweep begins with its guess by itself.
    if sweeps.len() < 2 {
        return place.stock;
    }
    let entry = |(sweep, guess): (&_, &Option<usize>)| Borrow::<SweptCutter>::borrow(sweep).entry((*guess)?, place);
    let least = sweeps.iter().zip(guesses).filter_map(entry).fold(f64::INFINITY, f64::min);
    least.next_up().min(place.stock)
}

/// Everything that one cutter sweeps in its cutting motions, for queries of what it leaves.
///
/// The height left on a place p with normal n is the least s ≥ 0 at which p + s·n is in the cutter
/// at some time of a motion, and at most the stock's. The cutter is the solid of revolution of its
/// flute; where p itself is in it, nothing is left.
///
/// Guarantee: every height is that of a pose of the motions, to [`SweptCutter::ENTRY`]; so it is
/// never less than the truth by more than that. It is more than the truth by at most
/// [`SweptCutter::ACCURACY`] on motions whose axis does not turn, for which the time of the least
/// height is found by convexity; where the axis turns within a motion, keep motions short (the turn
/// times the cutter's size small against its radius of curvature), and the same holds as an
/// estimate.
pub struct SweptCutter {
    radius: f64,
    gauge: Gauge,
    motions: Vec<CutterMotion>,
    tree: Tree,
}

impl SweptCutter {
    /// Depth to which the entry of a line into the cutter is found, mm.
    pub const ENTRY: f64 = gauge::ENTRY;

    /// Largest excess of a height over the least one along a motion, mm.
    pub const ACCURACY: f64 = 1e-4;

    /// The sweep of a cutter in motions, in any order.
    pub fn new(cutter: &Cutter, motions: Vec<CutterMotion>) -> Self {
        let gauge = Gauge::of(cutter);
        let tree = Tree::over(&gauge, &motions);
        Self { radius: cutter.radius(), gauge, motions, tree }
    }

    /// Radius of the cutter, mm.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Number of its motions.
    pub fn n_motions(&self) -> usize {
        self.motions.len()
    }

    /// Returns the height at which a motion enters the line above a place; `None` if it does not.
    fn entry(&self, motion: usize, place: &SurfacePlace) -> Option<f64> {
        self.gauge.least_entry(&self.motions[motion], place, Self::ACCURACY)
    }

    /// Returns the height that is left on a place, and the index of the motion that cuts lowest;
    /// `None` if none cuts below a height. The motion `guess` is tried first.
    pub(crate) fn left_below(&self, place: &SurfacePlace, height: f64, guess: Option<usize>) -> Option<(f64, usize)> {
        let mut best = (height, None);
        let mut visit = |k: usize, best: &mut (f64, Option<usize>)| {
            let Some(entry) = self.entry(k, place) else { return };
            // Of equal ones the first, whatever the order of visits.
            if entry < best.0 || (entry == best.0 && best.1.is_some_and(|b| k < b)) {
                *best = (entry, Some(k));
            }
        };
        if let Some(guess) = guess {
            visit(guess, &mut best);
        }
        self.tree.visit(&self.gauge, place, &mut best, &mut visit);
        Some((best.0, best.1?))
    }
}
