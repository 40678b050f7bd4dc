//! Passes inserted between the generated ones: beside trimmed ones, as near as postures permit, and
//! where the chosen postures leave more than the permitted cusp.

#[cfg(test)]
#[path = "../../tests/unit/passes/extra_passes/laws.rs"]
pub(crate) mod laws;

use std::collections::{BTreeMap, BTreeSet};

use facemill_cl_data::{CcPoint, Pass, Posture};
use facemill_cutter_location::cusp::Ridge;
use facemill_cutter_location::cusp::cut_point::{CutPoint, Strip};
use facemill_cutter_location::cusp::neighbours::{CutPass, Neighbour, NeighbourReach, Neighbours, OwnPlace};
use facemill_cutter_location::{Hints, Optimum, Outcome, PassSettings, PassTask, PlannedPass, plan_passes, search};
use facemill_job::failure::Failure;
use facemill_job::stages::{ADDED, Stages};
use facemill_surface_model::Surface;
use facemill_tool_model::{Cusp, Cutter, Outline, step_over_for_cusp};
use facemill_tool_path::segments::LaidTask;
use facemill_tool_path::segments::pole::Tests;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::passes::engagement::carried_on;
use crate::passes::high_places::HighPlaces;
use crate::passes::left_gaps::LeftGaps;
use crate::passes::pole_detours::Detours;

/// Passes with the poses of their points, in cutting order.
#[derive(Clone)]
pub(crate) struct PlannedPath {
    pub(crate) tasks: Vec<LaidTask>,
    pub(crate) outcomes: Vec<Pass<Outcome>>,
    /// Distance of the postures from the optimum, if one was sought.
    pub(crate) optimum: Option<Optimum>,
}

/// Passes inserted between others.
#[derive(Clone, Debug, Default)]
pub(crate) struct ExtraPasses {
    /// Number of passes beside trimmed ones.
    pub moved: usize,
    /// Number of passes where the chosen postures left too much.
    pub between: usize,
    /// Number of passes over high places that are in no strip.
    pub over: usize,
    /// Passes that the last call of [`Interposer::keep_cusp`] has inserted.
    pub put_in: Vec<Vec<CutPoint>>,
    /// Places where no pass could be inserted, with reasons.
    pub refused: Vec<(Point3<f64>, String)>,
}

/// Data for inserting passes between others.
pub(crate) struct Interposer<'i, 'a> {
    pub(crate) tests: &'i Tests<'a>,
    pub(crate) settings: &'i PassSettings,
    pub(crate) detours: &'i Detours<'i, 'a>,
    pub(crate) reach: NeighbourReach,
    /// Surface of the passes, and the passes' height above it.
    pub(crate) surface: &'i Surface,
    pub(crate) allowance: f64,
    /// Permitted cusp, mm.
    pub(crate) cusp: f64,
    /// Gaps in the region: no pass is inserted in them.
    pub(crate) gaps: LeftGaps,
    /// Places where a text with these passes has left more than that.
    pub(crate) high: Option<&'i HighPlaces>,
    /// Whether texts are measured, which decides between passes as they were laid, instead of
    /// expected ridges.
    pub(crate) by_text: bool,
    /// Step-over below which no pass is inserted, mm.
    pub(crate) least_step: f64,
    /// Distance of points along a pass beyond which more are put between, mm.
    pub(crate) longest_gap: f64,
    /// Length up to which shorter passes are extended if their neighbours continue, mm.
    pub(crate) least_length: f64,
}

/// Number of rounds of insertion. Each at least halves a strip, which reduces its cusp to a
/// quarter: three are enough for a cusp of 64 times the permitted one.
const ROUNDS: usize = 3;

/// Largest number of passes in one strip: more in so wide a strip make a different plan.
const MOST_BETWEEN: usize = 8;

/// Factor by which strips are taken wider than needed, for postures that turn out slightly steeper.
const MARGIN: f64 = 1.02;

/// Least ridge to expect between passes with a high place between them, as a share of the permitted
/// cusp: half the width of a strip leaves a quarter.
const EXPECTED: f64 = 0.4;

/// Bisections between an infeasible point and the pass beside it: an eighth of the strip.
const MOVES: u32 = 3;

/// Number of points on either side from which a moved pass keeps the same distance, so that it runs
/// evenly.
const EVEN: usize = 3;

/// Passes that an operation gets besides those of its strategy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AddedPasses {
    /// Beside trimmed passes, and where the chosen postures leave more than the permitted cusp.
    All,
    /// Beside trimmed passes alone, in the order as laid: two heads at once pair passes in this
    /// order and choose postures anew, so only then is it known where the cusp is exceeded.
    BesideTrimmed,
}

/// Time at which inserted passes are cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CutOrder {
    /// In their strip, before the pass that left too much.
    InStrip,
    /// Behind all others, whose order stays.
    Last,
}

/// Pass to insert before a pass, by number; behind the last, the number after it.
pub(crate) struct Extra {
    pub(crate) before: usize,
    pub(crate) task: LaidTask,
    /// Strip that it cuts; `None` if that is the one between the passes beside it.
    pub(crate) strip: Option<Strip>,
}

/// Inserted pass with the poses of its points.
pub(crate) struct PlannedExtra {
    /// Number of the pass before which it is cut.
    before: usize,
    /// Its feasible runs.
    runs: Vec<(LaidTask, Pass<Outcome>)>,
    optimum: Option<Optimum>,
}

impl PlannedExtra {
    /// Returns the number of feasible points.
    pub(crate) fn n_points(&self) -> usize {
        self.runs.iter().map(|(task, _)| task.pass.points.len()).sum()
    }

    /// Returns the feasible runs with their postures.
    fn cuts(&self) -> impl Iterator<Item = Vec<CutPoint>> {
        let cut =
            |(cc, outcome): (&CcPoint, &Outcome)| Some(CutPoint { cc: *cc, posture: outcome.as_ref().ok()?.posture });
        self.runs
            .iter()
            .map(move |(task, outcomes)| task.pass.points.iter().zip(&outcomes.points).filter_map(cut).collect())
    }

    /// Returns the number of feasible runs.
    pub(crate) fn n_runs(&self) -> usize {
        self.runs.len()
    }
}

impl<'a> Interposer<'_, 'a> {
    /// Inserts passes beside trimmed ones, and if requested between the planned ones, until the
    /// cusp holds or no more fit.
    ///
    /// # Errors
    /// If the stages are cancelled.
    pub(crate) fn improve(
        &self,
        path: &mut PlannedPath,
        added: AddedPasses,
        stages: &dyn Stages,
    ) -> Result<ExtraPasses, Failure> {
        let mut extra = ExtraPasses::default();
        let moved = self.moved(path);
        let moved = self.plan(path, moved, &mut extra.refused, stages)?;
        extra.moved = moved.iter().map(|e| e.runs.len()).sum();
        if extra.moved > 0 {
            *path = path.with(&moved).0;
        }
        if added == AddedPasses::All {
            self.keep_cusp(path, CutOrder::InStrip, &mut extra, stages)?;
        }
        Ok(extra)
    }

    /// Inserts passes between the planned ones, until the cusp holds or no more fit.
    ///
    /// # Errors
    /// If the stages are cancelled.
    pub(crate) fn keep_cusp(
        &self,
        path: &mut PlannedPath,
        order: CutOrder,
        extra: &mut ExtraPasses,
        stages: &dyn Stages,
    ) -> Result<(), Failure> {
        extra.put_in.clear();
        for _ in 0..ROUNDS {
            let mut between = self.between(path);
            if between.is_empty() {
                break;
            }
            if order == CutOrder::Last {
                between.iter_mut().for_each(|e| e.before = path.tasks.len());
            }
            let left = self.left_beyond(path);
            let planned = self.plan(path, between, &mut extra.refused, stages)?;
            let (all, strips) = path.with(&planned);
            let helps = strips_with_less(&left, &self.left_beyond(&all), &strips);
            let kept: Vec<PlannedExtra> = planned.into_iter().filter(|e| helps.contains(&e.before)).collect();
            let n = kept.iter().map(|e| e.runs.len()).sum::<usize>();
            let (best, _) = path.with(&kept);
            if n == 0 || total(&self.left_beyond(&best)) >= total(&left) {
                // Longer, and no better.
                break;
            }
            *path = best;
            extra.between += n;
            extra.put_in.extend(kept.iter().flat_map(PlannedExtra::cuts));
        }
        Ok(())
    }

    /// Returns passes with the feasible runs of their points.
    pub(crate) fn plan(
        &self,
        path: &PlannedPath,
        extras: Vec<Extra>,
        refused: &mut Vec<(Point3<f64>, String)>,
        stages: &dyn Stages,
    ) -> Result<Vec<PlannedExtra>, Failure> {
        if extras.is_empty() {
            return Ok(Vec::new());
        }
        let n_points = extras.iter().map(|e| e.task.pass.points.len()).sum();
        let monitor = stages.start(ADDED, n_points);
        let laid: Vec<LaidTask> = extras.iter().map(|e| e.task.clone()).collect();
        let own: Vec<Option<Strip>> = extras.iter().map(|e| e.strip).collect();
        let strips: Vec<PassTask> = self.tasks_beside(path, &laid, &own);
        let mut planned = plan_passes(self.tests.of(self.settings), &strips, self.settings, &*monitor)?;
        drop(monitor);
        self.detours.take(&strips, &mut planned, stages)?;
        let optima: Vec<Option<Optimum>> = planned.iter().map(|p| p.optimum).collect();
        let mut outcomes: Vec<Pass<Outcome>> =
            planned.into_iter().map(|PlannedPass { outcomes, .. }| outcomes).collect();
        self.tests.at_pole(&laid, self.settings, &mut outcomes);
        let mut found = Vec::new();
        for ((extra, outcomes), optimum) in extras.into_iter().zip(outcomes).zip(optima) {
            for (cc, outcome) in extra.task.pass.points.iter().zip(&outcomes.points) {
                if let Err(why) = outcome {
                    refused.push((cc.position, self.tests.plain.describe(why)));
                }
            }
            let of_run = |run: std::ops::Range<usize>| {
                let pass = Pass::new(extra.task.pass.points[run.clone()].to_vec());
                (LaidTask { pass, ..extra.task.clone() }, Pass::new(outcomes.points[run].to_vec()))
            };
            let runs = runs(&outcomes.points, |o| o.is_ok()).into_iter().map(of_run).collect();
            found.push(PlannedExtra { before: extra.before, runs, optimum });
        }
        Ok(found)
    }

    /// Returns new passes with their own strips, or those to the passes beside them.
    fn tasks_beside(&self, path: &PlannedPath, laid: &[LaidTask], own: &[Option<Strip>]) -> Vec<PassTask> {
        let neighbours = Neighbours::new(path.tasks.iter().map(as_laid).collect(), self.reach);
        let beside = |pass: usize, point: usize| neighbours.beside(&unposed(&laid[pass].pass.points[point])).strip();
        pass_tasks(laid, |pass, point| own[pass].or_else(|| beside(pass, point)))
    }

    /// Returns passes for places where the ridges are too high.
    fn between(&self, path: &PlannedPath) -> Vec<Extra> {
        let planned = path.planned();
        let neighbours = Neighbours::new(planned.passes(), self.reach);
        let of_run = |run: usize| {
            let points = &neighbours.passes()[run].points;
            let mut extras = Vec::new();
            for side in 0..2 {
                let wanted: Vec<Option<(Neighbour, usize)>> = (0..points.len())
                    .map(|point| {
                        let beside = neighbours.of(OwnPlace { pass: run, point });
                        let toward = beside.nearest[side].filter(|n| n.is_earlier)?;
                        Some((toward, self.wanted_between(&points[point], &toward)))
                    })
                    .collect();
                for stretch in self.long_enough(points, &wanted) {
                    let of_stretch = wanted[stretch.clone()].iter().flatten();
                    let n = of_stretch.map(|(_, n)| *n).max().unwrap_or(0).min(MOST_BETWEEN);
                    for k in (1..=n).rev() {
                        let share = k as f64 / (n + 1) as f64;
                        let places = stretch.clone().filter_map(|p| Some((&points[p].cc, wanted[p]?.0, share)));
                        let task = &path.tasks[planned.task[run]];
                        let laid = self.laid(places, task).filter(|t| !neighbours.is_crossed_by(&t.pass.points));
                        extras.extend(laid.map(|task| Extra { before: planned.task[run], task, strip: None }));
                    }
                }
            }
            extras
        };
        (0..neighbours.passes().len()).into_par_iter().map(of_run).collect::<Vec<_>>().into_iter().flatten().collect()
    }

    /// Returns the stock that the ridges of each pass toward earlier ones leave beyond the
    /// permitted cusp, mm³, as if they were as high over the whole strip: a measure for comparing
    /// rounds. A strip that stays uncut counts as high as it is wide.
    fn left_beyond(&self, path: &PlannedPath) -> Vec<f64> {
        let planned = path.planned();
        let neighbours = Neighbours::new(planned.passes(), self.reach);
        let cutter = self.tests.plain.cell.tool.cutter();
        let of_point = |pass: usize, point: usize| -> f64 {
            let points = &neighbours.passes()[pass].points;
            let at = |k: usize| points[k.min(points.len() - 1)].cc.position;
            let length = 0.5 * (at(point + 1) - at(point.saturating_sub(1))).norm();
            let beside = neighbours.of(OwnPlace { pass, point });
            let beyond = |n: &Neighbour| {
                let wide = n.strip.step_over;
                match self.left_toward(cutter, &points[point], n) {
                    Cusp::Height(height) => (height.min(wide) - self.cusp).max(0.0) * wide * length,
                    Cusp::Uncut => wide * wide * length,
                }
            };
            beside.before().map(beyond).sum()
        };
        let of_run = |pass: usize| -> f64 {
            (0..neighbours.passes()[pass].points.len()).map(|point| of_point(pass, point)).sum()
        };
        let of_runs: Vec<f64> = (0..neighbours.passes().len()).into_par_iter().map(of_run).collect();
        let mut left = vec![0.0; path.tasks.len()];
        for (task, beyond) in planned.task.iter().zip(of_runs) {
            left[*task] += beyond;
        }
        left
    }

    /// Returns what a point and the pass beside it leave between them: the expected ridge, or what
    /// is measured there if it is more. A strip that has become much narrower since leaves less.
    /// Where texts are measured and none has left too much there, the permitted cusp is the most.
    fn left_toward(&self, cutter: &Cutter, own: &CutPoint, beside: &Neighbour) -> Cusp {
        if self.gaps.is_between(0, own, beside) {
            return Cusp::Height(0.0);
        }
        let expected = Ridge::toward(cutter, own, beside).cusp;
        if !self.by_text || matches!(expected, Cusp::Height(height) if height <= EXPECTED * self.cusp) {
            return expected;
        }
        match (expected, self.high.and_then(|high| high.in_strip(own, beside))) {
            (Cusp::Height(height), Some(measured)) => Cusp::Height(height.max(measured)),
            (Cusp::Height(height), None) => Cusp::Height(height.min(self.cusp)),
            (Cusp::Uncut, Some(_)) => Cusp::Uncut,
            (Cusp::Uncut, None) => Cusp::Height(self.cusp),
        }
    }

    /// Returns the number of passes that a ridge requires between a point and the pass beside it.
    fn wanted_between(&self, own: &CutPoint, beside: &Neighbour) -> usize {
        let cutter = self.tests.plain.cell.tool.cutter();
        if self.left_toward(cutter, own, beside).is_within(self.cusp) {
            return 0;
        }
        let step = beside.strip.step_over;
        let steepest = |posture: Posture| {
            let outline = Outline::new(cutter, posture);
            step_over_for_cusp(&outline, &outline, self.cusp, &beside.strip.curvature, step)
        };
        let allowed = steepest(own.posture).min(steepest(beside.point.posture)).max(self.least_step);
        let n = (MARGIN * step / allowed).ceil() as usize;
        let n = n.clamp(2, MOST_BETWEEN + 1) - 1;
        if step / (n + 1) as f64 >= self.least_step { n } else { 0 }
    }

    /// Returns the stretches of a run at which passes are needed, each a point longer at both ends,
    /// and as long as passes must be while the pass beside continues.
    fn long_enough(&self, points: &[CutPoint], wanted: &[Option<(Neighbour, usize)>]) -> Vec<std::ops::Range<usize>> {
        let mut stretches: Vec<std::ops::Range<usize>> = Vec::new();
        for run in runs_of_one(wanted, |w| w.is_some_and(|(_, n)| n > 0)) {
            let (mut from, mut to) = (run.start, run.end);
            let is_beside = |k: usize| wanted.get(k).is_some_and(Option::is_some);
            let length = |from: usize, to: usize| -> f64 {
                points[from..to].windows(2).map(|w| (w[1].cc.position - w[0].cc.position).norm()).sum()
            };
            let mut longer = true;
            while longer && (to - from < run.len() + 2 || length(from, to) < self.least_length) {
                let (before, after) = (from > 0 && is_beside(from - 1), is_beside(to));
                from -= usize::from(before);
                to += usize::from(after);
                longer = before || after;
            }
            match stretches.last_mut().filter(|last| last.end >= from) {
                Some(last) => last.end = to,
                None => stretches.push(from..to),
            }
        }
        stretches.into_iter().filter(|s| s.len() >= 2).collect()
    }

    /// Returns passes beside the points of trimmed ones, on both sides as near to them as postures
    /// permit.
    fn moved(&self, path: &PlannedPath) -> Vec<Extra> {
        let Some(search_settings) = self.settings.fallback() else { return Vec::new() };
        let laid = Neighbours::new(path.tasks.iter().map(as_laid).collect(), self.reach);
        let feasible = Neighbours::new(path.planned().passes(), self.reach);
        let of_stretch = |(pass, run, side): (usize, std::ops::Range<usize>, usize)| -> Vec<Extra> {
            let task = &path.tasks[pass];
            let mut hints = Hints::default();
            let mut shares: Vec<Option<(Neighbour, f64)>> = run
                .clone()
                .map(|point| {
                    let cc = &task.pass.points[point];
                    let beside = laid.of(OwnPlace { pass, point }).nearest[side]?;
                    let toward = feasible.beside(&unposed(cc)).nearest[side]?;
                    // A trimmed pass between must be moved itself.
                    if (toward.point.cc.position - beside.point.cc.position).norm() > SAME_PLACE {
                        return None;
                    }
                    let is_feasible = |share: f64| {
                        let moved = self.between_points(cc, &toward.point.cc, share)?;
                        search(self.tests.choosing, &moved, &task.curve, search_settings, 0.0, None, &mut hints).ok()
                    };
                    Some((toward, nearest_feasible(is_feasible)?))
                })
                .collect();
            even_out(&mut shares);
            runs_of_one(&shares, Option::is_some)
                .into_iter()
                .filter_map(|part| {
                    let points = &task.pass.points[run.start..];
                    let places = part.clone().filter_map(|k| shares[k].map(|(n, share)| (&points[k], n, share)));
                    let is_before = shares[part.start].is_some_and(|(n, _)| n.is_left != task.uncut_left);
                    let before = if is_before { pass } else { pass + 1 };
                    Some(Extra { before, task: self.laid(places, task)?, strip: None })
                })
                .collect()
        };
        let trimmed: Vec<(usize, std::ops::Range<usize>, usize)> = path
            .outcomes
            .iter()
            .enumerate()
            .flat_map(|(pass, of)| runs_of_one(&of.points, |o| o.is_err()).into_iter().map(move |run| (pass, run)))
            .flat_map(|(pass, run)| [0, 1].map(|side| (pass, run.clone(), side)))
            .collect();
        trimmed.into_par_iter().map(of_stretch).collect::<Vec<_>>().into_iter().flatten().collect()
    }

    /// Returns a pass through places between points and the pass beside them, each by its share of
    /// the distance.
    fn laid<'c>(
        &self,
        places: impl Iterator<Item = (&'c CcPoint, Neighbour, f64)>,
        like: &LaidTask,
    ) -> Option<LaidTask> {
        let mut points: Vec<CcPoint> = Vec::new();
        for (cc, toward, share) in places {
            let Some(between) = self.between_points(cc, &toward.point.cc, share) else { continue };
            let goes_on = |last: &CcPoint| {
                let step = between.position - last.position;
                step.norm() > SAME_PLACE && step.dot(&last.feed) > 0.0
            };
            if points.last().is_none_or(goes_on) {
                let within = points.last().map_or_else(Vec::new, |last| self.within_gap(last, &between));
                points.extend(within);
                points.push(between);
            }
        }
        if points.len() < 2 {
            return None;
        }
        let at = |k: usize| points[k].position;
        let last = points.len() - 1;
        let feeds: Vec<Vector3<f64>> =
            (0..points.len()).map(|k| at((k + 1).min(last)) - at(k.saturating_sub(1))).collect();
        let turned = |(cc, feed): (&CcPoint, Vector3<f64>)| {
            CcPoint::new(cc.position, cc.normal.into_inner(), feed).unwrap_or(*cc)
        };
        let pass = Pass::new(points.iter().zip(feeds).map(turned).collect());
        Some(LaidTask { pass, ..like.clone() })
    }

    /// Returns points of the surface between two of a pass that are farther apart than the longest
    /// gap. Beside a pass that bends, points spread, and some have no place: the tool would cut
    /// straight through what bends between.
    fn within_gap(&self, last: &CcPoint, next: &CcPoint) -> Vec<CcPoint> {
        let shares = shares_within((next.position - last.position).norm(), self.longest_gap);
        shares.filter_map(|share| self.between_points(last, next, share)).collect()
    }

    /// Returns the point of the surface at a share of the distance from one CC point to another;
    /// `None` if it is far from both.
    fn between_points(&self, from: &CcPoint, to: &CcPoint, share: f64) -> Option<CcPoint> {
        let foot = |cc: &CcPoint| cc.position - cc.normal.into_inner() * self.allowance;
        let (a, b) = (foot(from), foot(to));
        let at = self.surface.closest_point(&(a + (b - a) * share), (b - a).norm())?;
        let normal = self.surface.normal_at(&at);
        let feed = from.feed.lerp(&(to.feed.into_inner() * from.feed.dot(&to.feed).signum()), share);
        CcPoint::new(at.position + normal.into_inner() * self.allowance, normal.into_inner(), feed).ok()
    }
}

/// Largest distance of equal places, mm.
const SAME_PLACE: f64 = 1e-6;

/// Share of the distance beyond which a pass is not worth its entry and exit: next to the pass
/// beside.
const FARTHEST: f64 = 0.75;

/// Returns the least share of the distance at which a point is feasible, to an eighth of it; `None`
/// if that is next to the pass beside.
fn nearest_feasible<T>(mut is_feasible: impl FnMut(f64) -> Option<T>) -> Option<f64> {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..MOVES {
        let middle = 0.5 * (low + high);
        if is_feasible(middle).is_some() { high = middle } else { low = middle }
    }
    (high <= FARTHEST).then_some(high)
}

/// Returns the shares of a gap at which points divide it into parts of at most half the longest
/// one; none of a gap that is no longer.
fn shares_within(gap: f64, longest: f64) -> impl Iterator<Item = f64> {
    let parts = if gap > longest { (2.0 * gap / longest).ceil() } else { 1.0 };
    (1..parts as u32).map(move |k| f64::from(k) / parts)
}

/// Raises shares along a pass to those of the points around.
fn even_out(shares: &mut [Option<(Neighbour, f64)>]) {
    let before: Vec<Option<f64>> = shares.iter().map(|s| s.map(|(_, share)| share)).collect();
    for (k, share) in shares.iter_mut().enumerate() {
        let around = &before[k.saturating_sub(EVEN)..(k + EVEN + 1).min(before.len())];
        if let Some((_, share)) = share {
            *share = around.iter().flatten().copied().fold(*share, f64::max);
        }
    }
}

/// Returns the strips in which less is left now than before; `strips` are those of the passes now.
fn strips_with_less(before: &[f64], now: &[f64], strips: &[usize]) -> BTreeSet<usize> {
    let mut of_strip: BTreeMap<usize, f64> = BTreeMap::new();
    for (strip, left) in strips.iter().zip(now) {
        *of_strip.entry(*strip).or_default() += left;
    }
    // Passes that are cut last are in no strip of an earlier pass: all or none of them.
    let is_less = |strip: usize, left: f64| before.get(strip).map_or(total(now) < total(before), |&b| left < b);
    of_strip.into_iter().filter(|&(strip, left)| is_less(strip, left)).map(|(strip, _)| strip).collect()
}

fn total(left: &[f64]) -> f64 {
    left.iter().sum()
}

/// Returns the runs of at least two items for which a condition holds.
fn runs<T>(items: &[T], holds: impl Fn(&T) -> bool) -> Vec<std::ops::Range<usize>> {
    runs_of_one(items, holds).into_iter().filter(|run| run.len() >= 2).collect()
}

/// Returns the runs of items for which a condition holds.
fn runs_of_one<T>(items: &[T], holds: impl Fn(&T) -> bool) -> Vec<std::ops::Range<usize>> {
    let mut found: Vec<std::ops::Range<usize>> = Vec::new();
    for (k, _) in items.iter().enumerate().filter(|(_, item)| holds(item)) {
        match found.last_mut().filter(|run| run.end == k) {
            Some(run) => run.end = k + 1,
            None => found.push(k..k + 1),
        }
    }
    found
}

/// Returns a CC point without a posture.
pub(crate) fn unposed(cc: &CcPoint) -> CutPoint {
    CutPoint { cc: *cc, posture: Posture::default() }
}

/// Returns a pass as generated.
pub(crate) fn as_laid(task: &LaidTask) -> CutPass {
    CutPass { points: task.pass.points.iter().map(unposed).collect(), uncut_left: task.uncut_left }
}

/// Feasible runs of passes.
pub(crate) struct PlannedRuns {
    passes: Vec<CutPass>,
    /// Number of each run's task.
    task: Vec<usize>,
    /// Lifts of each run's points, mm.
    pub(crate) lifts: Vec<Vec<f64>>,
}

impl PlannedRuns {
    pub(crate) fn passes(&self) -> Vec<CutPass> {
        self.passes.clone()
    }
}

impl PlannedPath {
    /// Returns the path with passes inserted, and for each of its passes the number of the strip
    /// that it is in: that of the pass itself, or of the pass before which it is inserted.
    pub(crate) fn with(&self, extras: &[PlannedExtra]) -> (Self, Vec<usize>) {
        let mut by_strip: BTreeMap<usize, Vec<&(LaidTask, Pass<Outcome>)>> = BTreeMap::new();
        for extra in extras {
            by_strip.entry(extra.before).or_default().extend(&extra.runs);
        }
        let optimum = extras.iter().filter_map(|e| e.optimum).chain(self.optimum).reduce(Optimum::plus);
        let mut path = Self { tasks: Vec::new(), outcomes: Vec::new(), optimum };
        let mut strips = Vec::new();
        for strip in 0..=self.tasks.len() {
            let own = self.tasks.get(strip).zip(self.outcomes.get(strip));
            let inserted = by_strip.remove(&strip).unwrap_or_default().into_iter().map(|(task, of)| (task, of));
            for (task, outcomes) in inserted.chain(own) {
                path.tasks.push(task.clone());
                path.outcomes.push(outcomes.clone());
                strips.push(strip);
            }
        }
        (path, strips)
    }

    /// Returns the runs of feasible points with their postures.
    pub(crate) fn planned(&self) -> PlannedRuns {
        let mut found = PlannedRuns { passes: Vec::new(), task: Vec::new(), lifts: Vec::new() };
        for (k, (task, outcome)) in self.tasks.iter().zip(&self.outcomes).enumerate() {
            for run in runs(&outcome.points, |o| o.is_ok()) {
                let cut = |p: usize| {
                    let pose = outcome.points[p].as_ref().ok()?;
                    Some(CutPoint { cc: task.pass.points[p], posture: pose.posture })
                };
                let points = run.clone().filter_map(cut).collect();
                found.lifts.push(outcome.points[run].iter().flatten().map(|pose| pose.lift).collect());
                found.passes.push(CutPass { points, uncut_left: task.uncut_left });
                found.task.push(k);
            }
        }
        found
    }
}

/// Returns each pass with its search curve and the strip at every point, by numbers of pass and
/// point.
pub(crate) fn pass_tasks(tasks: &[LaidTask], strip: impl Fn(usize, usize) -> Option<Strip> + Sync) -> Vec<PassTask> {
    tasks
        .par_iter()
        .enumerate()
        .map(|(pass, task)| {
            let strips = (0..task.pass.points.len()).map(|point| strip(pass, point)).collect();
            PassTask {
                pass: task.pass.clone(),
                curve: task.curve,
                strips: carried_on(strips),
                given: task.given.clone(),
            }
        })
        .collect()
}
