//! Fronts: passes that advance by the local strip width, with partial passes where strips are
//! narrow at an edge.

use std::sync::OnceLock;

use rayon::prelude::*;

use crate::layout::edge_fill::columns::{Columns, STEEPEST};
use crate::layout::edge_fill::front::{Front, mean};
use crate::layout::pass_level::Gain;

/// Settings of a plan of fronts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrontSettings {
    /// Ends of the region, along the passes, from which partial passes may start.
    pub(crate) partial_from: [bool; 2],
    /// Ends at which a pass may leave out what is covered already.
    pub(crate) may_join: [bool; 2],
    /// Shortest partial pass, mm.
    pub(crate) shortest: f64,
    /// Length of cutting that takes as long as entry, exit and link of a pass, mm.
    pub(crate) pass_cost: f64,
    /// Whether all steps shrink by one factor, so that the last is no narrower than it has to be.
    pub(crate) even: bool,
}

/// A pass is left out, or ends, where the strip that it covers is narrower than this share of the
/// width allowed: the pass beside it has cut there.
const COVERED: f64 = 0.1;

/// Radius of the bend of fronts at narrow places, as a multiple of the width of a column. Tighter
/// bends turn the tool axis faster than the feed can follow.
const BEND: f64 = 8.0;

/// Slope of a partial pass relative to the pass before it, at its end: the last part of an arc that
/// ends parallel would cut nothing.
const PARALLEL: f64 = 0.05;

/// Tightest bend where a partial pass runs out, as a multiple of the curvature of other bends.
const TIGHTEST: f64 = 2.0;

/// Ends of a pass that runs over its whole span.
const NO_ENDS: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Numbers of ends of partial passes that are compared, evenly spread along the passes. Each next
/// pass is the best one by itself, which need not lead to the best plan: so three are made.
const ENDS: [usize; 3] = [64, 48, 32];

/// Candidates that are too few for a thread of their own.
const FEW: usize = 4;

/// Fronts in the order of cutting, and the length that they take with the cost of each pass, mm.
pub(crate) struct FrontPlan {
    pub(crate) fronts: Vec<Front>,
    pub(crate) cost: f64,
}

/// Plans the fronts of a region; `None` where they would be more than `most`.
///
/// Each next pass is the one that covers most work (length of passes as wide as allowed) per length
/// and cost, or a partial pass where it and the next pass together cover more.
pub(crate) fn plan_fronts(columns: &Columns, settings: &FrontSettings, most: usize) -> Option<FrontPlan> {
    let plan = |ends: usize, factor: f64, most: usize| Planner { columns, settings, factor, ends }.run(most);
    let plans = ENDS.iter().filter_map(|&ends| Some((ends, plan(ends, 1.0, most)?)));
    let (ends, best) = plans.min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))?;
    if !settings.even || best.fronts.len() < 3 {
        return Some(best);
    }
    let most = best.fronts.len();
    let (mut low, mut high, mut best) = (0.7, 1.0, best);
    // Six halvings leave the last step full to a hundredth.
    for _ in 0..6 {
        let factor = 0.5 * (low + high);
        match plan(ends, factor, most).filter(|p| p.cost <= 1.002 * best.cost) {
            Some(plan) => (high, best) = (factor, plan),
            None => low = factor,
        }
    }
    Some(best)
}

/// Cost of passes on levels (in the order of cutting), in the measure of [`FrontPlan::cost`].
pub(crate) fn cost_of_levels(columns: &Columns, levels: &[f64], pass_cost: f64) -> f64 {
    let length = |level: f64| (0..columns.row.n).map(|i| columns.length(i, level)).sum::<f64>();
    levels.iter().map(|&l| length(l) + pass_cost).sum()
}

struct Planner<'a> {
    columns: &'a Columns,
    settings: &'a FrontSettings,
    factor: f64,
    ends: usize,
}

/// A front with what it brings.
#[derive(Clone)]
struct Candidate {
    front: Front,
    length: f64,
    gain: Gain,
    is_partial: bool,
}

/// Levels up to which all is cut, with what they allow the next pass.
struct Covered {
    /// Levels at the coefficients of fronts.
    levels: Vec<f64>,
    /// Highest level of the next pass for each coefficient.
    targets: Vec<f64>,
    /// Mean level on each column.
    means: Vec<f64>,
    /// Largest step from the mean level of each column, once it has been computed.
    steps: Vec<OnceLock<f64>>,
}

impl Planner<'_> {
    fn run(&self, most: usize) -> Option<FrontPlan> {
        let first = self.first_front();
        let mut covered = self.covered(first.levels.clone(), &[]);
        let length = self.length(&covered.means, first.span);
        if length <= 0.0 {
            // The region is thinner than its lower border is uneven.
            return None;
        }
        let mut cost = length + self.settings.pass_cost;
        let mut fronts = vec![first];
        // Since the last pass that went all along.
        let mut cycle = Gain::default();
        while let Some(next) = self.next(&covered, &cycle) {
            let reached = self.after(&next.front, &covered, None);
            // A step lost in rounding would never end.
            if fronts.len() >= most || reached.levels == covered.levels {
                return None;
            }
            covered = reached;
            cost += next.gain.cost;
            cycle = if next.is_partial { cycle.and(next.gain) } else { Gain::default() };
            fronts.push(next.front);
        }
        Some(FrontPlan { fronts, cost })
    }

    /// The pass along the lower border: inside the region where the border allows it, and nowhere
    /// more than half a strip from it.
    fn first_front(&self) -> Front {
        let n = self.columns.row.n;
        let target = |j: usize| {
            let starts = || self.support(j).filter_map(|i| self.columns.start(i));
            let alike = starts().all(|start| start.is_gentle) || starts().all(|start| !start.is_gentle);
            let both = |a: f64, b: f64| if alike { a.max(b) } else { a.min(b) };
            let inside = starts().map(|start| start.inside).reduce(both).unwrap_or(f64::INFINITY);
            starts().map(|start| start.most).fold(inside, f64::min)
        };
        let targets: Vec<f64> = (0..n + 2).map(target).collect();
        Front { levels: self.smooth(&targets), span: [0, n - 1], ends: NO_ENDS, joins: [false; 2] }
    }

    /// The columns that a coefficient has a say on.
    fn support(&self, j: usize) -> impl Iterator<Item = usize> + use<> {
        j.saturating_sub(2)..(j + 1).min(self.columns.row.n)
    }

    /// Completes covered levels; what `others` have in common with them is taken from there.
    fn covered(&self, levels: Vec<f64>, others: &[&Covered]) -> Covered {
        let target = |j: usize| match others.iter().find(|other| other.levels[j] == levels[j]) {
            Some(other) => other.targets[j],
            None => {
                self.support(j).map(|i| self.columns.reach(i, levels[j], self.factor)).fold(f64::INFINITY, f64::min)
            }
        };
        let targets = (0..levels.len()).map(target).collect();
        let means = means(&levels);
        let steps = vec![OnceLock::new(); means.len()];
        Covered { levels, targets, means, steps }
    }

    /// Covers levels up to those of a front, where all columns that they have a say on are cut;
    /// `other` has some of them, too.
    fn after(&self, front: &Front, covered: &Covered, other: Option<&Covered>) -> Covered {
        let n = self.columns.row.n;
        let whole = front.whole_columns();
        let cut = |j: usize| whole.contains(&j.saturating_sub(2)) && whole.contains(&j.min(n - 1));
        let level = |(j, level): (usize, &f64)| if cut(j) { level.max(front.levels[j]) } else { *level };
        let levels = covered.levels.iter().enumerate().map(level).collect();
        self.covered(levels, &[covered, other.unwrap_or(covered)])
    }

    /// The next pass, after those since the last that went all along; `None` when all is covered.
    fn next(&self, covered: &Covered, cycle: &Gain) -> Option<Candidate> {
        if covered.targets.iter().all(|t| t.is_infinite()) {
            return None;
        }
        let full = self.candidate(covered, &covered.targets, None)?;
        let alone = cycle.and(full.gain).rate();
        let sides = [0, 1].map(|side| self.partials(covered, &full, side));
        // Away from where they join, partial passes are as the full one.
        let after_full = self.after(&full.front, covered, None);
        let after = |covered: &Covered, partial: &Candidate| self.after(&partial.front, covered, Some(&after_full));
        let rate = |covered: &Covered, cycle: &Gain, partial: &Candidate| {
            let covered = after(covered, partial);
            let full = self.candidate(&covered, &covered.targets, None)?;
            Some(cycle.and(partial.gain).and(full.gain).rate())
        };
        let of_side = |side: usize| {
            let rates: Vec<Option<f64>> =
                sides[side].par_iter().with_min_len(FEW).map(|p| rate(covered, cycle, p)).collect();
            best(rates.into_iter().zip(&sides[side]))
        };
        let [left, right] = [of_side(0), of_side(1)];
        // A pass that both ends hold back gains nothing from one partial pass.
        let both = left.and_then(|(_, left)| {
            let (covered, cycle) = (after(covered, left), cycle.and(left.gain));
            let apart = |right: &Candidate| right.front.span[0] > left.front.span[1];
            let of_both = |right: &Candidate| apart(right).then(|| rate(&covered, &cycle, right)).flatten();
            let rates: Vec<Option<f64>> = sides[1].par_iter().with_min_len(FEW).map(of_both).collect();
            best(rates.into_iter().map(|rate| (rate, left)))
        });
        // It has to gain more than rounding and the grain of the columns.
        let of_all = [left, right, both].into_iter().flatten().map(|(rate, partial)| (Some(rate), partial));
        let partial = best(of_all).filter(|(rate, _)| *rate > 1.005 * alone).map(|(_, partial)| partial.clone());
        Some(partial.unwrap_or(full))
    }

    /// Partial passes from an end of the region, in place of a full one.
    fn partials(&self, covered: &Covered, full: &Candidate, side: usize) -> Vec<Candidate> {
        if !self.settings.partial_from[side] {
            return Vec::new();
        }
        // Ends are compared where the region is at the levels to be cut.
        let n = self.columns.row.n;
        let holds = |i: &usize| self.columns.holds(*i, full.front.mean(*i));
        let (Some(from), Some(last)) = ((0..n).find(holds), (0..n).rfind(holds)) else { return Vec::new() };
        let beyond = if side == 0 { from } else { n - 1 - last };
        let (n_columns, n_ends) = (last + 1 - from, self.ends.min(last + 1 - from));
        let reaches = (1..n_ends).into_par_iter().with_min_len(FEW).map(|k| beyond + n_columns * k / n_ends + 1);
        reaches.filter_map(|reach| self.partial(covered, side, reach)).collect()
    }

    /// The partial pass from an end of the region over so many coefficients, joined to the passes
    /// before beyond them.
    fn partial(&self, covered: &Covered, from: usize, reach: usize) -> Option<Candidate> {
        let n = covered.levels.len();
        let is_within = |j: usize| if from == 0 { j < reach } else { n - j <= reach };
        let target = |j: usize| if is_within(j) { covered.targets[j] } else { covered.levels[j] };
        let joined: Vec<f64> = (0..n).map(target).collect();
        let candidate = self.candidate(covered, &joined, Some(from))?;
        let long_enough = candidate.length >= self.settings.shortest;
        (long_enough && candidate.front.joins[1 - from]).then_some(candidate)
    }

    /// The front below some targets, over the columns where it covers more than has been cut: all
    /// along, or from one end of the region.
    fn candidate(&self, covered: &Covered, targets: &[f64], partial_from: Option<usize>) -> Option<Candidate> {
        let n = self.columns.row.n;
        let mut levels = self.smooth(targets);
        let mut ends = NO_ENDS;
        if let Some(side) = partial_from.map(|from| 1 - from)
            && let Some((out, end)) = self.run_out(covered, &levels, side)
        {
            (levels, ends[side]) = (out, end);
        }
        let means = means(&levels);
        let gains = |i: usize| {
            let at = covered.means[i];
            let allowed = *covered.steps[i].get_or_init(|| self.columns.reach(i, at, self.factor) - at);
            allowed.is_finite() && means[i] - at > COVERED * allowed
        };
        let (first, last) = ((0..n).find(|&i| gains(i))?, (0..n).rfind(|&i| gains(i))?);
        let at_end = |side: usize| ends[side].is_finite().then(|| self.columns.row.interval(ends[side]).0);
        let (first, last) = (at_end(0).unwrap_or(first), at_end(1).unwrap_or(last));
        let mut span = [first, last];
        let holds = |i: usize| self.columns.holds(i, means[i]);
        let joins = [(0..first).any(holds), (last + 1..n).any(holds)];
        for side in 0..2 {
            let may = partial_from.map_or(self.settings.may_join[side], |from| side != from);
            if !(may && joins[side]) {
                span[side] = if side == 0 { 0 } else { n - 1 };
                ends[side] = NO_ENDS[side];
            }
        }
        let mut length = self.length(&means, span);
        if partial_from.is_none() && length < self.settings.shortest {
            span = [0, n - 1];
            length = self.length(&means, span);
        }
        let [from, to] = span;
        let front = Front { levels, span, ends, joins: [from > 0 && joins[0], to + 1 < n && joins[1]] };
        let work = (from..=to).map(|i| self.columns.work(i, covered.means[i], means[i])).sum();
        let gain = Gain { work, cost: length + self.settings.pass_cost };
        Some(Candidate { front, length, gain, is_partial: partial_from.is_some() })
    }

    /// Returns the levels of a partial pass that runs out on a side, along an arc of the radius of
    /// bends that ends tangent to the levels covered, and the coordinate where it is almost
    /// parallel to them; `None` where the arc would be too steep or too tight, lead out of what the
    /// widths allow, or end beyond the region.
    fn run_out(&self, covered: &Covered, levels: &[f64], side: usize) -> Option<(Vec<f64>, f64)> {
        let (n, width) = (levels.len(), self.columns.row.width);
        // Coefficients are counted toward the side.
        let at = |k: usize| if side == 0 { n - 1 - k } else { k };
        // The arc that ends at coefficient e is at curve·(e − k)² above the levels covered.
        let curve = 0.5 * width / BEND;
        let gap = |k: usize| levels[at(k)] - covered.levels[at(k)];
        let end_by = |k: usize| k as f64 + (gap(k) / curve).sqrt();
        let risen = (0..n).filter(|&k| gap(k) > 0.0 && gap(k).is_finite());
        // The first arc that is nowhere below the pass touches it here.
        let touch = risen.max_by(|a, b| end_by(*a).total_cmp(&end_by(*b)))?;
        let end = end_by(touch);
        let mut out = levels.to_vec();
        let beyond = n.min(end.ceil() as usize + 3);
        for k in touch..beyond {
            out[at(k)] = covered.levels[at(k)] + curve * (end - k as f64).max(0.0).powi(2);
        }
        let steepest = STEEPEST * width * (1.0 + 1e-9);
        let is_gentle = |k: usize| (out[at(k)] - out[at(k - 1)]).abs() <= steepest;
        // Bends of the pass before it add to the arc's own.
        let is_wide = |k: usize| out[at(k - 1)] - 2.0 * out[at(k)] + out[at(k + 1)] <= TIGHTEST * 2.0 * curve;
        let is_within = |k: usize| out[at(k)] <= covered.targets[at(k)].max(levels[at(k)]);
        let is_smooth = (touch + 1..n.min(beyond + 1)).all(is_gentle) && (touch.max(1)..beyond.min(n - 1)).all(is_wide);
        if !is_smooth || !(touch..beyond).all(is_within) {
            return None;
        }
        let end = end - PARALLEL * BEND;
        let x = self.columns.row.of_coefficient(if side == 0 { (n - 1) as f64 - end } else { end });
        let column = self.columns.row.interval(x).0;
        let means = means(&out);
        let mut beyond = if side == 0 { 0..column } else { column + 1..n - 2 };
        beyond.any(|i| self.columns.holds(i, means[i])).then_some((out, x))
    }

    /// Length of a pass over some columns by its mean levels on all, mm.
    fn length(&self, means: &[f64], [from, to]: [usize; 2]) -> f64 {
        (from..=to).map(|i| self.columns.length(i, means[i])).sum()
    }

    /// The highest levels below the targets with slopes up to the steepest, rounded off at narrow
    /// places: the least over all targets of target + rise, where the rise at a distance is that of
    /// an arc that runs out in the steepest slope.
    fn smooth(&self, targets: &[f64]) -> Vec<f64> {
        let width = self.columns.row.width;
        let radius = BEND * width;
        let rise = |k: usize| {
            let d = width * k as f64;
            let arc = STEEPEST * radius;
            if d < arc { 0.5 * d * d / radius } else { STEEPEST * (d - 0.5 * arc) }
        };
        // By the distance from the last target to the first and on to the last again: a slice of
        // them has those from one target to all.
        let n = targets.len();
        let rises: Vec<f64> = (1..n).rev().chain(0..n).map(rise).collect();
        let mut levels = vec![f64::INFINITY; n];
        let running_most = |most: &mut f64, target: &f64| {
            *most = most.max(*target);
            Some(*most)
        };
        let most_before: Vec<f64> = targets.iter().scan(f64::NEG_INFINITY, running_most).collect();
        let mut most_behind: Vec<f64> = targets.iter().rev().scan(f64::NEG_INFINITY, running_most).collect();
        most_behind.reverse();
        for (i, target) in targets.iter().enumerate().filter(|(_, target)| target.is_finite()) {
            // Farther away it is above all targets.
            let has_say = |d: usize, most: Option<&f64>| most.is_some_and(|most| target + rises[n - 1 + d] < *most);
            let behind = (1..).map(|k| k * BLOCK).find(|&d| !has_say(d, most_behind.get(i + d))).unwrap_or(n);
            let before = (1..)
                .map(|k| k * BLOCK)
                .find(|&d| !has_say(d, i.checked_sub(d).and_then(|j| most_before.get(j))))
                .unwrap_or(n);
            let (from, to) = (i.saturating_sub(before), (i + behind).min(n));
            for (level, rise) in levels[from..to].iter_mut().zip(&rises[n - 1 + from - i..]) {
                let risen = target + rise;
                // Comparisons without NaN, so that several are done at once.
                *level = if risen < *level { risen } else { *level };
            }
        }
        // Crests between two narrow places are taken off: the mean of the neighbours where it is
        // lower.
        for _ in 0..CREST_ROUNDS {
            let lowered = |w: &[f64]| (0.25 * w[0] + 0.5 * w[1] + 0.25 * w[2]).min(w[1]);
            let between: Vec<f64> = levels.windows(3).map(lowered).collect();
            levels[1..n - 1].copy_from_slice(&between);
        }
        levels
    }
}

/// The first of the candidates with the highest rate.
fn best<'a>(rated: impl Iterator<Item = (Option<f64>, &'a Candidate)>) -> Option<(f64, &'a Candidate)> {
    let rated = rated.filter_map(|(rate, candidate)| Some((rate?, candidate)));
    rated.reduce(|best, next| if next.0 > best.0 { next } else { best })
}

/// Mean level on each column of a front with these levels.
fn means(levels: &[f64]) -> Vec<f64> {
    levels.windows(3).map(mean).collect()
}

/// Coefficients over which a target is followed at once.
const BLOCK: usize = 8;

/// Rounds of smoothing of crests; each takes them off over one column more.
const CREST_ROUNDS: usize = 6;
