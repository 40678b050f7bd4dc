//! Fronts: passes that advance by the local strip width, with partial passes where strips are
//! narrow at an edge.

use crate::layout::edge_fill::columns::{Columns, STEEPEST};
use crate::layout::edge_fill::front::Front;

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

/// Ends of partial passes that are compared, evenly spread along the passes.
const ENDS: usize = 16;

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
    let best = Planner { columns, settings, factor: 1.0 }.run(most)?;
    if !settings.even || best.fronts.len() < 3 {
        return Some(best);
    }
    let most = best.fronts.len();
    let (mut low, mut high, mut best) = (0.7, 1.0, best);
    // Six halvings leave the last step full to a hundredth.
    for _ in 0..6 {
        let factor = 0.5 * (low + high);
        let plan = Planner { columns, settings, factor }.run(most);
        match plan.filter(|p| p.cost <= 1.002 * best.cost) {
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
}

/// A front with what it brings.
#[derive(Clone)]
struct Candidate {
    front: Front,
    work: f64,
    cost: f64,
    is_partial: bool,
}

/// Sums over some passes.
#[derive(Clone, Copy, Default)]
struct Sum {
    work: f64,
    cost: f64,
}

impl Sum {
    fn and(&self, candidate: &Candidate) -> Self {
        Self { work: self.work + candidate.work, cost: self.cost + candidate.cost }
    }

    fn rate(&self) -> f64 {
        self.work / self.cost
    }
}

impl Planner<'_> {
    fn run(&self, most: usize) -> Option<FrontPlan> {
        let n = self.columns.row.n;
        let first = self.first_front();
        if self.length(&first) <= 0.0 {
            // The region is thinner than its lower border is uneven.
            return None;
        }
        let mut covered = first.levels.clone();
        let mut cost = self.length(&first) + self.settings.pass_cost;
        let mut fronts = vec![first];
        // Since the last pass that went all along.
        let mut cycle = Sum::default();
        while let Some(next) = self.next(&covered, &cycle) {
            let reached = after(&next.front, &covered, n);
            // A step lost in rounding would never end.
            if fronts.len() >= most || reached == covered {
                return None;
            }
            covered = reached;
            cost += next.cost;
            cycle = if next.is_partial { cycle.and(&next) } else { Sum::default() };
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
        Front { levels: self.smooth(&targets), span: [0, n - 1], joins: [false; 2] }
    }

    /// The columns that a coefficient has a say on.
    fn support(&self, j: usize) -> impl Iterator<Item = usize> + use<> {
        j.saturating_sub(2)..(j + 1).min(self.columns.row.n)
    }

    /// The next pass, after those since the last that went all along; `None` when all is covered.
    fn next(&self, covered: &[f64], cycle: &Sum) -> Option<Candidate> {
        let targets = self.targets(covered);
        if targets.iter().all(|t| t.is_infinite()) {
            return None;
        }
        let full = self.candidate(covered, &targets, None)?;
        let alone = cycle.and(&full).rate();
        let sides = [0, 1].map(|side| self.partials(covered, &targets, &full, side));
        let rate = |partials: &[&Candidate]| self.rate(covered, cycle, partials);
        let of_side = |side: &'_ [Candidate]| best(side.iter().filter_map(|p| Some((rate(&[p])?, p.clone()))));
        let [left, right] = [of_side(&sides[0]), of_side(&sides[1])];
        // A pass that both ends hold back gains nothing from one partial pass.
        let both = left.as_ref().and_then(|(_, left)| {
            let apart = sides[1].iter().filter(|right| right.front.span[0] > left.front.span[1]);
            best(apart.filter_map(|right| Some((rate(&[left, right])?, left.clone()))))
        });
        // It has to gain more than rounding and the grain of the columns.
        let partial = best([left, right, both].into_iter().flatten()).filter(|(rate, _)| *rate > 1.005 * alone);
        Some(partial.map_or(full, |(_, partial)| partial))
    }

    /// Partial passes from an end of the region, in place of a full one.
    fn partials(&self, covered: &[f64], targets: &[f64], full: &Candidate, side: usize) -> Vec<Candidate> {
        if !self.settings.partial_from[side] {
            return Vec::new();
        }
        // Ends are compared where the region is at the levels to be cut.
        let n = self.columns.row.n;
        let holds = |i: &usize| self.columns.holds(*i, full.front.mean(*i));
        let (Some(from), Some(last)) = ((0..n).find(holds), (0..n).rfind(holds)) else { return Vec::new() };
        let beyond = if side == 0 { from } else { n - 1 - last };
        let reaches = (1..ENDS).map(|k| beyond + (last + 1 - from) * k / ENDS + 1);
        reaches.filter_map(|reach| self.partial(covered, targets, side, reach)).collect()
    }

    /// Work per length and cost of some partial passes, the full pass after them, and the passes of
    /// the cycle before.
    fn rate(&self, covered: &[f64], cycle: &Sum, partials: &[&Candidate]) -> Option<f64> {
        let covered = partials.iter().fold(covered.to_vec(), |at, p| after(&p.front, &at, self.columns.row.n));
        let full = self.candidate(&covered, &self.targets(&covered), None)?;
        Some(partials.iter().fold(*cycle, |sum, p| sum.and(p)).and(&full).rate())
    }

    /// Highest level of the next pass for each coefficient.
    fn targets(&self, covered: &[f64]) -> Vec<f64> {
        let target = |j: usize| {
            let reach = |i: usize| self.columns.reach(i, covered[j], self.factor);
            self.support(j).map(reach).fold(f64::INFINITY, f64::min)
        };
        (0..covered.len()).map(target).collect()
    }

    /// The partial pass from an end of the region over so many coefficients, joined to the passes
    /// before beyond them.
    fn partial(&self, covered: &[f64], targets: &[f64], from: usize, reach: usize) -> Option<Candidate> {
        let n = targets.len();
        let is_within = |j: usize| if from == 0 { j < reach } else { n - j <= reach };
        let joined: Vec<f64> = (0..n).map(|j| if is_within(j) { targets[j] } else { covered[j] }).collect();
        let candidate = self.candidate(covered, &joined, Some(from))?;
        let long_enough = self.length(&candidate.front) >= self.settings.shortest;
        (long_enough && candidate.front.joins[1 - from]).then_some(candidate)
    }

    /// The front below some targets, over the columns where it covers more than has been cut: all
    /// along, or from one end of the region.
    fn candidate(&self, covered: &[f64], targets: &[f64], partial_from: Option<usize>) -> Option<Candidate> {
        let n = self.columns.row.n;
        let levels = self.smooth(targets);
        let mut front = Front { levels, span: [0, n - 1], joins: [false; 2] };
        let before = Front { levels: covered.to_vec(), span: [0, n - 1], joins: [false; 2] };
        let gains = |i: usize| {
            let (step, at) = (front.mean(i) - before.mean(i), before.mean(i));
            let allowed = self.columns.reach(i, at, self.factor) - at;
            allowed.is_finite() && step > COVERED * allowed
        };
        let (first, last) = ((0..n).find(|&i| gains(i))?, (0..n).rfind(|&i| gains(i))?);
        let mut span = [first, last];
        let holds = |i: usize| self.columns.holds(i, front.mean(i));
        let joins = [(0..first).any(holds), (last + 1..n).any(holds)];
        for side in 0..2 {
            let may = partial_from.map_or(self.settings.may_join[side], |from| side != from);
            if !(may && joins[side]) {
                span[side] = if side == 0 { 0 } else { n - 1 };
            }
        }
        front.span = span;
        if partial_from.is_none() && self.length(&front) < self.settings.shortest {
            front.span = [0, n - 1];
        }
        let [from, to] = front.span;
        front.joins = [from > 0 && joins[0], to + 1 < n && joins[1]];
        let work = (from..=to).map(|i| self.columns.work(i, before.mean(i), front.mean(i))).sum();
        let cost = self.length(&front) + self.settings.pass_cost;
        Some(Candidate { work, cost, is_partial: partial_from.is_some(), front })
    }

    /// Length of the pass on a front, mm.
    fn length(&self, front: &Front) -> f64 {
        (front.span[0]..=front.span[1]).map(|i| self.columns.length(i, front.mean(i))).sum()
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
        let rises: Vec<f64> = (0..targets.len()).map(rise).collect();
        let finite: Vec<usize> = (0..targets.len()).filter(|&j| targets[j].is_finite()).collect();
        let mut levels: Vec<f64> = (0..targets.len())
            .map(|j| finite.iter().map(|&i| targets[i] + rises[i.abs_diff(j)]).fold(f64::INFINITY, f64::min))
            .collect();
        // Crests between two narrow places are taken off: the mean of the neighbours where it is
        // lower.
        for _ in 0..CREST_ROUNDS {
            let mean = |j: usize| match (levels.get(j.wrapping_sub(1)), levels.get(j + 1)) {
                (Some(a), Some(b)) => (0.25 * a + 0.5 * levels[j] + 0.25 * b).min(levels[j]),
                _ => levels[j],
            };
            levels = (0..levels.len()).map(mean).collect();
        }
        levels
    }
}

/// The first of the candidates with the highest rate.
fn best(rated: impl Iterator<Item = (f64, Candidate)>) -> Option<(f64, Candidate)> {
    rated.reduce(|best, next| if next.0 > best.0 { next } else { best })
}

/// Rounds of smoothing of crests; each takes them off over one column more.
const CREST_ROUNDS: usize = 6;

/// Covered levels after a front: its own, where all columns that they have a say on are cut.
fn after(front: &Front, covered: &[f64], n: usize) -> Vec<f64> {
    let cut = |j: usize| {
        let (from, to) = (j.saturating_sub(2), j.min(n - 1));
        front.span[0] <= from && to <= front.span[1]
    };
    (0..covered.len()).map(|j| if cut(j) { covered[j].max(front.levels[j]) } else { covered[j] }).collect()
}
