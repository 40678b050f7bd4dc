//! The fastest free way of a link.

use facemill_inverse_kinematics::{AxisKind, AxisValues, BlockLaw};
use facemill_virtual_machine::{LinkStage, ProgramLink};
use rayon::prelude::*;

use crate::links::clock::LinkClock;
use crate::links::link_paths::{LinkEnds, RetractStrategy, path_of_heads};

/// A way in place of a link.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// Kind of the way.
    pub kind: RetractStrategy,
    /// The positions, as given by their rounded words.
    pub through: Vec<AxisValues>,
    /// Time, s.
    pub time: f64,
}

/// Times of a link, and a faster way where there is one.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Time of the original link, s.
    pub before: f64,
    /// Time of the slowest axis by itself, ignoring obstacles, s.
    pub lower_bound: f64,
    /// Faster way; `None` where there is none.
    pub better: Option<Chosen>,
}

/// Number of distances out that are tried for every kind of way, spaced as squares up to the
/// largest.
const RUNGS: u32 = 14;

/// Halvings between the last distance out that was not free and the first one that was.
const HALVINGS: u32 = 5;

/// Fractions of the distance to the straight line by which places in between are pulled in, one
/// after the other.
const PULLS: [f64; 4] = [0.5, 0.25, 0.25, 0.125];

/// Least gain of a faster way, s: less is rounding.
const FASTER: f64 = 1e-4;

/// Context of the choice.
pub struct Chooser<'c, 'a> {
    /// Ends of the link for each head of the machine; at least one.
    pub heads: &'c [LinkEnds<'a>],
    /// Times of links.
    pub clock: &'c LinkClock<'a>,
    /// Motion of the axes between two positions.
    pub law: BlockLaw,
    /// Positions as rounded words give them; `None` where they have no words.
    pub rounded: &'c (dyn Fn(&AxisValues) -> Option<AxisValues> + Sync),
}

/// A way that is not tested yet.
struct LinkPath {
    kind: RetractStrategy,
    out: f64,
    way: Chosen,
}

/// The free way of one kind that leads least far out.
struct Innermost<'t> {
    found: &'t LinkPath,
    /// Distance out of the next one inside, which is not free; `None` without one.
    blocked: Option<f64>,
}

/// Returns the innermost free way of one kind, by halving: from the outermost one, or from the
/// middle one where the outermost is not free.
fn innermost<'t>(ways: &[&'t LinkPath], is_free: impl Fn(&LinkPath) -> bool) -> Option<Innermost<'t>> {
    let outermost = ways.len().checked_sub(1)?;
    // Index of a free way, and the number of blocked ones inside of it.
    let mut free = [outermost, outermost / 2].into_iter().find(|k| is_free(ways[*k]))?;
    let mut blocked = 0;
    while blocked < free {
        let middle = (blocked + free) / 2;
        if is_free(ways[middle]) { free = middle } else { blocked = middle + 1 }
    }
    Some(Innermost { found: ways[free], blocked: blocked.checked_sub(1).map(|k| ways[k].out) })
}

/// Returns the way with its rotary axes turning all along that leads as far out as this one, where
/// it is faster and free. Such ways may be free only at some distances between others that are not,
/// because farther out more of the turn happens near the ends.
fn spread<'t>(timed: &'t [LinkPath], best: Innermost<'t>, is_free: impl Fn(&LinkPath) -> bool) -> Innermost<'t> {
    let kind = match best.found.kind {
        RetractStrategy::Lifted => RetractStrategy::LiftedSpread,
        RetractStrategy::AlongTool => RetractStrategy::AlongToolSpread,
        _ => return best,
    };
    let is_it = |t: &&LinkPath| t.kind == kind && t.out == best.found.out && t.way.time < best.found.way.time - FASTER;
    match timed.iter().find(is_it) {
        Some(found) if is_free(found) => Innermost { found, ..best },
        _ => best,
    }
}

impl Chooser<'_, '_> {
    /// Returns the fastest free way of a link among all kinds, each as far in as it is free; never
    /// one slower than the link.
    ///
    /// A way that leads farther out is assumed to be free where a nearer one of its kind is, so
    /// only a few of each kind are tested. Where that does not hold, a faster way may be missed,
    /// but the chosen way is always free.
    ///
    /// # Errors
    /// When a way cannot be timed.
    pub fn choose(&self, link: &ProgramLink, stage: &LinkStage<'_, '_>) -> Result<Choice, String> {
        let before = self.clock.time(self.law, &link.start, &link.ends)?;
        let lower_bound = self.clock.least_time(&link.start, &self.heads[0].end);
        let largest = self.largest_out(link);
        let rungs: Vec<f64> = (0..=RUNGS).map(|k| largest * (f64::from(k) / f64::from(RUNGS)).powi(2)).collect();
        let ladder = |kind: RetractStrategy| if kind == RetractStrategy::Direct { &rungs[..1] } else { &rungs[..] };
        let all: Vec<(RetractStrategy, f64)> = RetractStrategy::TRIED
            .into_iter()
            .flat_map(|kind| ladder(kind).iter().map(move |out| (kind, *out)))
            .collect();
        let timed: Vec<Option<LinkPath>> = all.par_iter().map(|&(kind, out)| self.timed(kind, out, before)).collect();
        let timed: Vec<LinkPath> = timed.into_iter().flatten().collect();
        let mut kinds: Vec<&[LinkPath]> = timed.chunk_by(|a, b| a.kind == b.kind).collect();
        let least = |kind: &[LinkPath]| kind.iter().map(|t| t.way.time).fold(f64::INFINITY, f64::min);
        kinds.sort_by(|a, b| least(a).total_cmp(&least(b)));
        let mut best: Option<Innermost<'_>> = None;
        for kind in kinds {
            let limit = best.as_ref().map_or(f64::INFINITY, |b| b.found.way.time - FASTER);
            let faster: Vec<&LinkPath> = kind.iter().filter(|t| t.way.time < limit).collect();
            best = innermost(&faster, |t| stage.is_free(link, &t.way.through)).or(best);
        }
        let better = best.map(|best| {
            let best = spread(&timed, best, |t| stage.is_free(link, &t.way.through));
            let inner = self.further_in(link, stage, &best, before);
            self.pulled_tight(link, stage, inner)
        });
        Ok(Choice { before, lower_bound, better })
    }

    /// Returns a way with its time, where it is faster than `before`.
    fn timed(&self, kind: RetractStrategy, out: f64, before: f64) -> Option<LinkPath> {
        let way = path_of_heads(self.heads, kind, out)?;
        let (last, over) = way.split_last()?;
        let mut through: Vec<AxisValues> = over.iter().map(self.rounded).collect::<Option<_>>()?;
        through.push(*last);
        if through.iter().any(|axes| self.heads[0].machine.first_beyond_limit(axes).is_some()) {
            return None;
        }
        // A link that cannot be timed is no candidate.
        let time = self.clock.time(self.law, &self.heads[0].start, &through).ok()?;
        (time < before - FASTER).then_some(LinkPath { kind, out, way: Chosen { kind, through, time } })
    }

    /// Returns the same kind of way as far in as it is free, starting from the farthest one that
    /// was not.
    fn further_in(
        &self,
        link: &ProgramLink,
        stage: &LinkStage<'_, '_>,
        Innermost { found, blocked }: &Innermost<'_>,
        before: f64,
    ) -> Chosen {
        let mut best = found.way.clone();
        let Some(mut low) = *blocked else { return best };
        let mut high = found.out;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            // Farther in at the same time is better, too.
            match self.timed(found.kind, middle, before.min(best.time + 2.0 * FASTER)) {
                Some(t) if stage.is_free(link, &t.way.through) => (high, best) = (middle, t.way),
                _ => low = middle,
            }
        }
        best
    }

    /// Returns the same way with its places between the ends pulled toward the line through their
    /// neighbours, as far as that is free and faster.
    fn pulled_tight(&self, link: &ProgramLink, stage: &LinkStage<'_, '_>, mut best: Chosen) -> Chosen {
        for by in PULLS {
            for k in 0..best.through.len() - 1 {
                let before = if k == 0 { self.heads[0].start } else { best.through[k - 1] };
                let Some(share) = self.share_of_way(&before, &best.through[k], &best.through[k + 1]) else { continue };
                let straight = before.lerp(&best.through[k + 1], share);
                let Some(pulled) = (self.rounded)(&best.through[k].lerp(&straight, by)) else { continue };
                let mut through = best.through.clone();
                through[k] = pulled;
                let time = self.clock.time(self.law, &self.heads[0].start, &through);
                let is_faster = time.as_ref().is_ok_and(|time| *time < best.time - FASTER);
                if let (true, Ok(time)) = (is_faster && stage.is_free(link, &through), time) {
                    best = Chosen { kind: best.kind, through, time };
                }
            }
        }
        best
    }

    /// Returns the fraction of the tip's path at a position, for the first head whose tip moves.
    fn share_of_way(&self, before: &AxisValues, at: &AxisValues, behind: &AxisValues) -> Option<f64> {
        self.heads.iter().find_map(|head| {
            let [a, b, c] = [before, at, behind].map(|axes| head.tip(axes));
            let all = (b - a).norm() + (c - b).norm();
            (all > 0.0).then(|| (b - a).norm() / all)
        })
    }

    /// Returns the largest worthwhile distance out, mm: the motion of the linear axes on the
    /// original link.
    fn largest_out(&self, link: &ProgramLink) -> f64 {
        let starts = std::iter::once(&link.start).chain(&link.ends);
        let length = |(from, to): (&AxisValues, &AxisValues)| -> f64 {
            let way = |k: usize| to[k] - from[k];
            let axes = self.heads[0].machine.axes().iter().enumerate();
            axes.filter(|(_, a)| a.kind == AxisKind::Linear).map(|(k, _)| way(k).powi(2)).sum::<f64>().sqrt()
        };
        starts.zip(&link.ends).map(length).sum()
    }
}
