//! Order of passes with the shortest links: an open tour, in which each pass keeps its own
//! direction and its place behind those that have to be cut before it.

use std::collections::BTreeSet;

use rayon::prelude::*;

/// Costs of moving from one pass to another, in any unit that adds up, such as seconds.
#[derive(Clone, Debug, PartialEq)]
pub struct TourCosts {
    n: usize,
    /// Cost from the end of the row's pass to the start of the column's.
    links: Vec<f64>,
    /// Cost from the tool's initial place to the start of each pass.
    first: Vec<f64>,
    /// Cost from the end of each pass to the tool's final place.
    last: Vec<f64>,
    /// Whether the row's pass has to be cut before the column's; empty: any order is allowed.
    before: Vec<bool>,
}

/// An order of passes.
#[derive(Clone, Debug, PartialEq)]
pub struct Tour {
    /// Indices of the passes.
    pub order: Vec<usize>,
    /// Its cost, with the ways to the first pass and from the last.
    pub cost: f64,
    /// Lower bound of the cost of every order.
    pub lower_bound: f64,
    /// Whether it is an order of least cost.
    pub is_exact: bool,
}

/// Reason why there is no tour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TourError {
    /// The numbers of costs do not match.
    #[error(
        "{links} links, {first} ways to the first pass and {last} from the last are not those of one number of passes"
    )]
    Counts {
        /// Number of links.
        links: usize,
        /// Number of ways to the first pass.
        first: usize,
        /// Number of ways from the last pass.
        last: usize,
    },
    /// A cost is negative or not finite.
    #[error("a cost is not a number of at least 0")]
    Cost,
    /// A pass has to be cut before one that does not come behind it.
    #[error("pass {first} cannot be kept before pass {second}: only passes in the order that they have can")]
    Order {
        /// Index of the pass that is to be cut first.
        first: usize,
        /// Index of the other one.
        second: usize,
    },
}

/// Number of passes up to which the order is exact: 2¹² sets of 12 ends are cheap, and each further
/// pass doubles them.
const EXACT: usize = 12;

/// Number of passes from which a nearest-neighbour tour is started: more seldom find anything
/// shorter.
const BEGINNINGS: usize = 16;

/// Longest row of passes moved to another place.
const LONGEST_ROW: usize = 3;

/// Least gain of a change, as a fraction of the cost: less is rounding, and could loop.
const LEAST_GAIN: f64 = 1e-12;

/// Largest number of rounds of improvements: each gains something, so only thousands of passes can
/// reach this.
const MAX_ROUNDS: usize = 1000;

impl TourCosts {
    /// Takes the costs of n passes: `links` row by row, from the end of the row's pass to the start
    /// of the column's.
    ///
    /// # Errors
    /// When there are not n² links for n ways to the first pass and n from the last, or a cost is
    /// negative or not finite.
    pub fn new(links: Vec<f64>, first: Vec<f64>, last: Vec<f64>) -> Result<Self, TourError> {
        let n = first.len();
        if links.len() != n * n || last.len() != n {
            return Err(TourError::Counts { links: links.len(), first: n, last: last.len() });
        }
        // Entries from a pass to itself are unused.
        let mut off_diagonal = links.iter().enumerate().filter(|(k, _)| k / n != k % n).map(|(_, c)| c);
        let is_cost = |c: &f64| *c >= 0.0 && c.is_finite();
        if !(off_diagonal.all(is_cost) && first.iter().all(is_cost) && last.iter().all(is_cost)) {
            return Err(TourError::Cost);
        }
        Ok(Self { n, links, first, last, before: Vec::new() })
    }

    /// Adds pairs of passes, of which the first has to be cut before the second, as in their
    /// present order.
    ///
    /// # Errors
    /// When a second pass does not come behind its first one.
    pub fn keeping(mut self, pairs: impl IntoIterator<Item = (usize, usize)>) -> Result<Self, TourError> {
        for (first, second) in pairs {
            if first >= second || second >= self.n {
                return Err(TourError::Order { first, second });
            }
            self.before.resize(self.n * self.n, false);
            self.before[first * self.n + second] = true;
        }
        Ok(self)
    }

    /// Returns whether a pass has to be cut before another one.
    fn is_before(&self, first: usize, second: usize) -> bool {
        self.before.get(first * self.n + second) == Some(&true)
    }

    /// Returns whether all passes are cut behind those that have to be cut before them.
    #[must_use]
    pub fn allow(&self, order: &[usize]) -> bool {
        let behind = |k: usize| order[k + 1..].iter().all(|&later| !self.is_before(later, order[k]));
        (0..order.len()).all(behind)
    }

    /// Raises the cost of a link, or of the way to the first pass.
    fn raise(&mut self, (from, to): TourLink, cost: f64) {
        let present = match from {
            Some(from) => &mut self.links[from * self.n + to],
            None => &mut self.first[to],
        };
        *present = present.max(cost);
    }

    fn link(&self, from: usize, to: usize) -> f64 {
        self.links[from * self.n + to]
    }

    /// Returns the cost of an order.
    #[must_use]
    pub fn of(&self, order: &[usize]) -> f64 {
        let (Some(&first), Some(&last)) = (order.first(), order.last()) else { return 0.0 };
        self.first[first] + order.windows(2).map(|w| self.link(w[0], w[1])).sum::<f64>() + self.last[last]
    }
}

/// Returns an order of passes with the lowest cost found, each behind those that have to be cut
/// before it. Up to twelve passes it is optimal; for more it never costs more than their present
/// order. A bound limits how much less could be possible.
#[must_use]
pub fn shortest_tour(costs: &TourCosts) -> Tour {
    tour_from(costs, &(0..costs.n).collect::<Vec<_>>())
}

/// Returns an order that never costs more than a known one.
fn tour_from(costs: &TourCosts, known: &[usize]) -> Tour {
    if costs.n <= EXACT {
        let order = exact(costs);
        let cost = costs.of(&order);
        return Tour { order, cost, lower_bound: cost, is_exact: true };
    }
    let beginnings: Vec<Vec<usize>> = std::iter::once(known.to_vec())
        .chain((0..BEGINNINGS).filter_map(|k| nearest_next(costs, k * costs.n / BEGINNINGS)))
        .collect();
    let improved: Vec<(f64, Vec<usize>)> =
        beginnings.into_par_iter().map(|order| improved(costs, order)).map(|order| (costs.of(&order), order)).collect();
    let (cost, order) = improved.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
    let lower_bound = lower_bound(costs).min(cost);
    Tour { order, cost, lower_bound, is_exact: false }
}

/// Link from a pass, or from the tool's initial place, to another.
pub type TourLink = (Option<usize>, usize);

/// Result of [`shortest_tour_by`].
#[derive(Clone, Debug, PartialEq)]
pub struct LearntTour {
    /// The order, with the costs of its links as they were learnt.
    pub tour: Tour,
    /// Cost of the present order.
    pub present_cost: f64,
    /// Number of links between passes whose costs were learnt.
    pub links: usize,
}

/// Largest number of orders whose links are learnt besides the present one: each is at least as
/// good, by what is known then, as the best one so far, so later ones gain less and less.
const LEARNT_ORDERS: usize = 12;

/// Returns an order of passes with a low cost where costs of links are expensive to compute:
/// `bounds` are lower bounds of them, and `cost` computes those of the links of the orders that the
/// bounds and the costs learnt before suggest, each at most once. A cost below its bound counts as
/// the bound. The order never costs more than the present one.
///
/// Where `is_exact`, no order costs less: the best one by costs of which none is too high has been
/// learnt as a whole.
///
/// # Errors
/// An error of `cost`.
pub fn shortest_tour_by<E: Send>(
    mut bounds: TourCosts,
    cost: &(dyn Fn(TourLink) -> Result<f64, E> + Sync),
) -> Result<LearntTour, E> {
    let mut learnt: BTreeSet<TourLink> = BTreeSet::new();
    let mut learn = |order: &[usize], costs: &mut TourCosts| {
        let from = std::iter::once(None).chain(order.iter().copied().map(Some));
        let open: Vec<TourLink> = from.zip(order.iter().copied()).filter(|link| !learnt.contains(link)).collect();
        let found: Vec<f64> = open.par_iter().map(|link| cost(*link)).collect::<Result<_, E>>()?;
        open.iter().zip(found).for_each(|(link, cost)| costs.raise(*link, cost));
        learnt.extend(open);
        Ok((costs.of(order), learnt.iter().filter(|(from, _)| from.is_some()).count()))
    };
    let mut order: Vec<usize> = (0..bounds.n).collect();
    let (present_cost, mut links) = learn(&order, &mut bounds)?;
    let mut least = present_cost;
    let mut orders = 0;
    loop {
        let next = tour_from(&bounds, &order);
        let is_best = next.cost >= least * (1.0 - LEAST_GAIN);
        if is_best || orders == LEARNT_ORDERS {
            let lower_bound = next.lower_bound.min(least);
            let tour = Tour { order, cost: least, lower_bound, is_exact: is_best && next.is_exact };
            return Ok(LearntTour { tour, present_cost, links });
        }
        orders += 1;
        let (cost, learnt) = learn(&next.order, &mut bounds)?;
        links = learnt;
        if cost < least {
            (least, order) = (cost, next.order);
        }
    }
}

/// Solves by the least cost over every set of passes that ends at each of them (Held and Karp).
fn exact(costs: &TourCosts) -> Vec<usize> {
    let n = costs.n;
    if n == 0 {
        return Vec::new();
    }
    let all = (1 << n) - 1;
    let needed: Vec<usize> =
        (0..n).map(|k| (0..n).filter(|j| costs.is_before(*j, k)).fold(0, |set, j| set | 1 << j)).collect();
    // Cost and the pass before, by set and last pass.
    let mut best = vec![(f64::INFINITY, n); (all + 1) * n];
    (0..n).filter(|k| needed[*k] == 0).for_each(|k| best[(1 << k) * n + k] = (costs.first[k], n));
    for set in 1..=all {
        for end in (0..n).filter(|end| set >> end & 1 == 1) {
            let here = best[set * n + end].0;
            for next in (0..n).filter(|&next| set >> next & 1 == 0 && set & needed[next] == needed[next]) {
                let cost = here + costs.link(end, next);
                let there = &mut best[(set | 1 << next) * n + next];
                if cost < there.0 {
                    *there = (cost, end);
                }
            }
        }
    }
    let whole = |end: &usize| best[all * n + end].0 + costs.last[*end];
    let mut end = (0..n).min_by(|a, b| whole(a).total_cmp(&whole(b))).unwrap_or(0);
    let (mut order, mut set) = (Vec::with_capacity(n), all);
    while end < n {
        order.push(end);
        let before = best[set * n + end].1;
        set &= !(1 << end);
        end = before;
    }
    order.reverse();
    order
}

/// Moves on to the nearest remaining pass that may be cut next; `None` where the first one is not
/// allowed.
fn nearest_next(costs: &TourCosts, first: usize) -> Option<Vec<usize>> {
    let mut left: Vec<usize> = (0..costs.n).filter(|k| *k != first).collect();
    if left.iter().any(|&k| costs.is_before(k, first)) {
        return None;
    }
    let mut order = vec![first];
    let mut at = first;
    while !left.is_empty() {
        let cost = |k: &usize| costs.link(at, left[*k]);
        // The first remaining one is always allowed.
        let may = |k: &usize| left[..*k].iter().all(|&earlier| !costs.is_before(earlier, left[*k]));
        let nearest = (0..left.len()).filter(may).min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(0);
        at = left.remove(nearest);
        order.push(at);
    }
    Some(order)
}

/// Moves rows of passes to other places and reverses the order of rows, until nothing is shorter.
fn improved(costs: &TourCosts, mut order: Vec<usize>) -> Vec<usize> {
    for _ in 0..MAX_ROUNDS {
        if !(move_a_row(costs, &mut order) | turn_rows(costs, &mut order)) {
            break;
        }
    }
    order
}

/// Returns the cost from the pass at one place of an order to that at another; places outside are
/// the ways in and out.
fn between(costs: &TourCosts, from: Option<usize>, to: Option<usize>) -> f64 {
    match (from, to) {
        (Some(from), Some(to)) => costs.link(from, to),
        (None, Some(to)) => costs.first[to],
        (Some(from), None) => costs.last[from],
        (None, None) => 0.0,
    }
}

/// Moves every short row to its best place (Or-opt); returns whether anything was gained.
fn move_a_row(costs: &TourCosts, order: &mut Vec<usize>) -> bool {
    let (n, mut is_any) = (order.len(), false);
    let least = LEAST_GAIN * costs.of(order);
    for length in 1..=LONGEST_ROW.min(n.saturating_sub(1)) {
        for from in 0..=n - length {
            let row = [order[from], order[from + length - 1]];
            let before = from.checked_sub(1).map(|k| order[k]);
            let behind = order.get(from + length).copied();
            let freed = between(costs, before, Some(row[0])) + between(costs, Some(row[1]), behind)
                - between(costs, before, behind);
            let rest: Vec<usize> = order[..from].iter().chain(&order[from + length..]).copied().collect();
            let row_of = &order[from..from + length];
            let is_needed = |k: &usize| row_of.iter().any(|&r| costs.is_before(rest[*k], r));
            let needs = |k: &usize| row_of.iter().any(|&r| costs.is_before(r, rest[*k]));
            let lowest = (0..from).rev().find(is_needed).map_or(0, |k| k + 1);
            let highest = (from..rest.len()).find(needs).unwrap_or(rest.len());
            let added = |at: usize| {
                let (a, b) = (at.checked_sub(1).map(|k| rest[k]), rest.get(at).copied());
                between(costs, a, Some(row[0])) + between(costs, Some(row[1]), b) - between(costs, a, b)
            };
            let best = (lowest..=highest).min_by(|a, b| added(*a).total_cmp(&added(*b))).unwrap_or(from);
            if added(best) < freed - least {
                let moved: Vec<usize> = order[from..from + length].to_vec();
                *order = rest[..best].iter().chain(&moved).chain(&rest[best..]).copied().collect();
                is_any = true;
            }
        }
    }
    is_any
}

/// Reverses the order of rows where that is shorter (2-opt); each pass keeps its own direction.
fn turn_rows(costs: &TourCosts, order: &mut [usize]) -> bool {
    let (n, mut is_any) = (order.len(), false);
    let least = LEAST_GAIN * costs.of(order);
    for from in 0..n {
        let before = from.checked_sub(1).map(|k| order[k]);
        let (mut onward, mut back) = (0.0, 0.0);
        for to in from + 1..n {
            if order[from..to].iter().any(|&earlier| costs.is_before(earlier, order[to])) {
                break;
            }
            onward += costs.link(order[to - 1], order[to]);
            back += costs.link(order[to], order[to - 1]);
            let behind = order.get(to + 1).copied();
            let now = between(costs, before, Some(order[from])) + onward + between(costs, Some(order[to]), behind);
            let turned = between(costs, before, Some(order[to])) + back + between(costs, Some(order[from]), behind);
            if turned < now - least {
                order[from..=to].reverse();
                (onward, back) = (back, onward);
                is_any = true;
            }
        }
    }
    is_any
}

/// Returns a lower bound of every order: one way in, one way out, and the largest of three bounds
/// on the links: a spanning tree by the cheaper direction of each, and the cheapest link to (and
/// from) every pass except the most expensive one.
fn lower_bound(costs: &TourCosts) -> f64 {
    let n = costs.n;
    let least = |all: &[f64]| all.iter().copied().reduce(f64::min).unwrap_or(0.0);
    let cheapest = |cost: &dyn Fn(usize, usize) -> f64| {
        let of = |k: usize| (0..n).filter(|j| *j != k).map(|j| cost(k, j)).fold(f64::INFINITY, f64::min);
        let each: Vec<f64> = (0..n).map(of).collect();
        each.iter().sum::<f64>() - each.iter().copied().fold(0.0, f64::max)
    };
    let out = cheapest(&|k, j| costs.link(k, j));
    let into = cheapest(&|k, j| costs.link(j, k));
    least(&costs.first) + least(&costs.last) + spanning_tree(costs).max(out).max(into)
}

/// Returns the cost of a least spanning tree (Prim); an order of passes is one.
fn spanning_tree(costs: &TourCosts) -> f64 {
    let n = costs.n;
    let edge = |a: usize, b: usize| costs.link(a, b).min(costs.link(b, a));
    let mut nearest: Vec<f64> = (0..n).map(|k| if k == 0 { 0.0 } else { edge(0, k) }).collect();
    let mut is_in = vec![false; n];
    let mut sum = 0.0;
    for _ in 0..n {
        let outside = (0..n).filter(|k| !is_in[*k]);
        let Some(next) = outside.min_by(|a, b| nearest[*a].total_cmp(&nearest[*b])) else { break };
        is_in[next] = true;
        sum += nearest[next];
        (0..n).for_each(|k| nearest[k] = nearest[k].min(if k == next { f64::INFINITY } else { edge(next, k) }));
    }
    sum
}

#[cfg(test)]
#[path = "../../tests/unit/links/tour.rs"]
mod tests;
