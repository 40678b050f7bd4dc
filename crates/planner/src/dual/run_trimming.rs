//! Remainders of both operations beside runs: no point that a head alone would cut is lost, and
//! both heads cut remainders at once where possible.

use std::collections::BTreeSet;

use facemill_cl_data::Monitor;
use facemill_job::failure::Failure;
use facemill_tool_path::moves::reach;
use facemill_tool_path::segments::PassSegment;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::dual::moves::{DualMover, ReachedRun};
use crate::dual::pairing::{PiecePair, length, stations};
use crate::dual::runs::{Causes, Gap, PairRun, RunPlanner, gaps, part_of};

/// Planner for the remainders of runs.
pub(crate) struct Remains<'m, 'r, 'a> {
    pub mover: &'m DualMover<'r, 'a>,
    /// Pieces of each operation.
    pub pieces: [&'m [PassSegment]; 2],
    /// As [`RunPlanner::shortest`].
    pub shortest: f64,
}

/// Gap that was tried, by its numbers.
type Tried = (usize, usize, [u64; 2]);

impl Remains<'_, '_, '_> {
    /// Shortens runs at their ends so that each head alone has an entry into the remainder beside
    /// them and an exit out of it. A run that would keep too little is given back as a whole.
    ///
    /// Each round removes stops or is the last.
    ///
    /// # Errors
    /// Returns an error if the monitor cancels.
    pub(crate) fn trimmed(
        &self,
        mut runs: Vec<ReachedRun>,
        causes: &mut Causes,
        monitor: &dyn Monitor,
    ) -> Result<Vec<ReachedRun>, Failure> {
        let mut sound: BTreeSet<Tried> = BTreeSet::new();
        loop {
            let mut kept = vec![[EVERYWHERE; 2]; runs.len()];
            for head in 0..2 {
                self.widen(head, &runs, &mut sound, &mut kept, monitor)?;
            }
            if kept.iter().all(|of_run| *of_run == [EVERYWHERE; 2]) {
                return Ok(runs);
            }
            let mut next = Vec::new();
            for (run, kept) in runs.into_iter().zip(kept) {
                if kept == [EVERYWHERE; 2] {
                    next.push(run);
                } else {
                    let (reached, why) = self.mover.reach(self.shortened(run.run, &kept, causes), monitor)?;
                    next.extend(reached);
                    causes.join(why);
                }
            }
            runs = next;
        }
    }

    /// Widens the remainder of a head where it would lose points; `kept` has the stops that each
    /// run then keeps.
    fn widen(
        &self,
        head: usize,
        runs: &[ReachedRun],
        sound: &mut BTreeSet<Tried>,
        kept: &mut [[[f64; 2]; 2]],
        monitor: &dyn Monitor,
    ) -> Result<(), Failure> {
        let key = |gap: &Gap| (head, gap.piece, gap.at.map(f64::to_bits));
        let runs: Vec<&PairRun> = runs.iter().map(|r| &r.run).collect();
        let mut open = gaps(self.pieces[head], head, &runs);
        open.retain(|gap| !sound.contains(&key(gap)));
        let wide: Vec<[f64; 2]> = open
            .par_iter()
            .map(|gap| monitor.checkpoint().map(|()| self.wide_enough(head, gap)))
            .collect::<Result<_, _>>()?;
        for (gap, at) in open.iter().zip(wide) {
            sound.insert(key(&Gap { at, ..*gap }));
            for (side, run) in gap.beside.iter().enumerate() {
                if let Some(run) = run.filter(|_| at[side] != gap.at[side]) {
                    kept[run][head][1 - side] = at[side];
                }
            }
        }
        Ok(())
    }

    /// Returns the narrowest gap around one that a head alone cuts without losing points; the whole
    /// piece if there is none.
    fn wide_enough(&self, head: usize, gap: &Gap) -> [f64; 2] {
        let whole = [0.0, self.pieces[head][gap.piece].places().count().saturating_sub(1) as f64];
        let wider = |by: f64| {
            let [before, behind] = gap.beside.map(|run| if run.is_some() { by } else { 0.0 });
            [(gap.at[0] - before).max(whole[0]), (gap.at[1] + behind).min(whole[1])]
        };
        let tried = GIVEN_BACK.iter().map(|&by| wider(by));
        tried.into_iter().find(|at| !self.loses(head, &Gap { at: *at, ..*gap })).unwrap_or(match gap.beside {
            [None, None] => gap.at,
            _ => whole,
        })
    }

    /// Returns whether a head alone loses points of a gap that no run beside it cuts.
    fn loses(&self, head: usize, gap: &Gap) -> bool {
        let piece = &self.pieces[head][gap.piece];
        let Some(part) = part_of(piece, gap.at) else { return false };
        let place = |p: &Point3<f64>| -> [u64; 3] { p.coords.map(f64::to_bits).into() };
        let own = |k: f64| {
            (k > gap.at[0] || gap.beside[0].is_none() && k == gap.at[0])
                && (k < gap.at[1] || gap.beside[1].is_none() && k == gap.at[1])
        };
        let points = piece.places().enumerate().filter(|(k, c)| own(*k as f64) && !c.inserted);
        let own: BTreeSet<[u64; 3]> = points.map(|(_, c)| place(&c.cc.position)).collect();
        let (reached, lost) = reach(self.mover.test.tests[head], self.mover.settings[head], part);
        !own.is_empty() && (reached.is_none() || lost.iter().any(|l| own.contains(&place(&l.place))))
    }

    /// Returns a run with the stops that both heads keep; `None` if they are too few.
    fn shortened(&self, run: PairRun, kept: &[[f64; 2]; 2], causes: &mut Causes) -> Vec<PairRun> {
        let why = "what one head would leave there for itself has no entry or exit of its own";
        let is_kept = |at: &[f64; 2]| (0..2).all(|h| kept[h][0] <= at[h] && at[h] <= kept[h][1]);
        let (stops, given): (Vec<_>, Vec<_>) = run.stops.iter().partition(|s| is_kept(&s.at));
        let short = PairRun { stops, ..run.clone() };
        let enough = !short.is_shorter_than(self.shortest);
        for stop in if enough { &given } else { &run.stops } {
            causes.add(why.to_owned(), why.to_owned(), &stop.cc[0]);
        }
        if enough { vec![short] } else { Vec::new() }
    }
}

/// Stops that are kept if nothing has to be given back.
const EVERYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Numbers of points of the path to try to give back at each end.
const GIVEN_BACK: [f64; 10] = [0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0];

/// Returns runs of pieces that each head would cut alone, if both can cut them at once from end to
/// end: remainders at one end of the blade with remainders at the other. The planner's pieces are
/// these.
///
/// # Errors
/// Returns an error if the monitor cancels.
pub(crate) fn paired_left(
    mover: &DualMover<'_, '_>,
    planner: &RunPlanner<'_, '_>,
    feeds: [f64; 2],
    monitor: &dyn Monitor,
) -> Result<Vec<ReachedRun>, Failure> {
    let radii = mover.test.tests.map(|t| t.cell.tool.cutter().radius());
    let couples: Vec<[usize; 2]> =
        (0..planner.pieces[0].len()).flat_map(|i| partners(planner.pieces, i, radii[0] + radii[1])).collect();
    let found: Vec<([usize; 2], Option<ReachedRun>)> = couples
        .into_par_iter()
        .map(|couple| Ok((couple, whole_run(mover, planner, couple, feeds, monitor)?)))
        .collect::<Result<_, Failure>>()?;
    let mut taken = [BTreeSet::new(), BTreeSet::new()];
    let mut runs = Vec::new();
    for (couple, run) in found {
        if let Some(run) = run.filter(|_| (0..2).all(|h| !taken[h].contains(&couple[h]))) {
            (0..2).for_each(|h| {
                taken[h].insert(couple[h]);
            });
            runs.push(run);
        }
    }
    Ok(runs)
}

/// Returns pieces of the second head that may go with one of the first: beyond both cutters, the
/// nearest in length first.
fn partners(pieces: [&[PassSegment]; 2], i: usize, apart: f64) -> impl Iterator<Item = [usize; 2]> {
    let first = &pieces[0][i];
    let middle = |p: &PassSegment| p.cuts[p.cuts.len() / 2].cc.position;
    let own = length(first);
    let mut of_lengths: Vec<(f64, usize)> = pieces[1]
        .iter()
        .enumerate()
        .filter(|(_, p)| p.copy == first.copy && (middle(p) - middle(first)).norm() > apart)
        .map(|(j, p)| ((length(p) / own).ln().abs(), j))
        .collect();
    of_lengths.sort_by(|a, b| a.0.total_cmp(&b.0));
    of_lengths.into_iter().take(MOST_PARTNERS).map(move |(_, j)| [i, j])
}

/// Number of partners to try for each piece.
const MOST_PARTNERS: usize = 6;

/// Returns the run of both heads over two whole pieces, if there is one.
fn whole_run(
    mover: &DualMover<'_, '_>,
    planner: &RunPlanner<'_, '_>,
    couple: [usize; 2],
    feeds: [f64; 2],
    monitor: &dyn Monitor,
) -> Result<Option<ReachedRun>, Failure> {
    monitor.advance(1);
    let pieces = [&planner.pieces[0][couple[0]], &planner.pieces[1][couple[1]]];
    let [a, b] = pieces.map(|p| p.places().map(|c| c.cc).collect::<Vec<_>>());
    let pair = PiecePair { pieces: couple, stations: stations([&a, &b], feeds) };
    let ends = pieces.map(|p| p.places().count().saturating_sub(1) as f64);
    let whole = |run: &PairRun| {
        let [first, last] = [run.stops.first(), run.stops.last()].map(|s| s.map(|s| s.at));
        first == Some([0.0; 2]) && last == Some(ends)
    };
    let (mut runs, _) = planner.runs(&pair, monitor)?;
    if runs.len() != 1 || !whole(&runs[0]) {
        return Ok(None);
    }
    let (mut reached, _) = mover.reach(vec![runs.remove(0)], monitor)?;
    Ok(reached.pop().filter(|r| whole(&r.run)))
}
