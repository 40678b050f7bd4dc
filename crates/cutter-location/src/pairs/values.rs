//! Values of a shared axis along a way: the cheapest of a lattice, smoothed.

use crate::pairs::test::PairBlocked;

/// A value at which both heads have a pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ValueState {
    /// The value.
    pub(crate) value: f64,
    /// Cost per second.
    pub(crate) cost: f64,
}

/// The values of one station.
#[derive(Clone, Debug)]
pub(crate) struct ValueNode {
    pub(crate) station: usize,
    pub(crate) time: f64,
    /// In ascending order; none where `blocked` holds.
    pub(crate) states: Vec<ValueState>,
    pub(crate) blocked: PairBlocked,
}

/// One value for each node that has any, as runs of consecutive nodes.
#[derive(Clone, Debug)]
pub(crate) struct ValuePath {
    /// Station, time, value.
    runs: Vec<Vec<(usize, f64, f64)>>,
    /// Stations with no value, and why.
    blocked: Vec<(usize, PairBlocked)>,
}

/// Fraction of an axis' largest speed that counts as much.
const MUCH: f64 = 0.1;

/// Values further apart than this in one step are not connected, rad: between two stations the axis
/// would turn past values tested at neither.
const WIDEST_STEP: f64 = 0.35;

/// Rounds of smoothing: steps of the lattice are spread over about as many nodes.
const ROUNDS: usize = 12;

impl ValuePath {
    /// Finds the sequence that costs least: each value's cost over the time around it, and the
    /// square of the speed between values against one that is much for the axis.
    pub(crate) fn cheapest(nodes: &[ValueNode], max_velocity: f64) -> Self {
        let mut path = Self { runs: Vec::new(), blocked: Vec::new() };
        let mut from = 0;
        while from < nodes.len() {
            if nodes[from].states.is_empty() {
                path.blocked.push((nodes[from].station, nodes[from].blocked));
                from += 1;
                continue;
            }
            let layers = Layers::forward(&nodes[from..], MUCH * max_velocity);
            path.runs.push(layers.best(&nodes[from..]));
            from += layers.steps.len();
        }
        path
    }

    /// Draws each value to the mean of its neighbours, weighted by time, where that is `feasible`.
    pub(crate) fn smooth(&mut self, mut feasible: impl FnMut(usize, f64) -> bool) {
        for run in &mut self.runs {
            for _ in 0..ROUNDS {
                for k in 1..run.len().saturating_sub(1) {
                    let [(_, t0, v0), (station, t1, v1), (_, t2, v2)] = [run[k - 1], run[k], run[k + 1]];
                    let between = if t2 > t0 { v0 + (v2 - v0) * (t1 - t0) / (t2 - t0) } else { 0.5 * (v0 + v2) };
                    let wanted = 0.5 * (v1 + between);
                    if (wanted - v1).abs() > SETTLED && feasible(station, wanted) {
                        run[k].2 = wanted;
                    }
                }
            }
        }
    }

    /// Returns the value at a station, at its time: on a cubic curve through the nodes around it.
    ///
    /// # Errors
    /// Why there is none.
    pub(crate) fn value(&self, station: usize, time: f64) -> Result<f64, PairBlocked> {
        for run in &self.runs {
            let (Some(first), Some(last)) = (run.first(), run.last()) else { continue };
            if (first.0..=last.0).contains(&station) {
                return Ok(curve(run, station, time));
            }
        }
        let before = self.runs.iter().filter_map(|run| run.last()).map(|n| n.0).filter(|k| *k < station).max();
        let behind = self.runs.iter().filter_map(|run| run.first()).map(|n| n.0).filter(|k| *k > station).min();
        let gap = before.unwrap_or(0)..=behind.unwrap_or(usize::MAX);
        let in_gap = self.blocked.iter().filter(|(k, _)| gap.contains(k));
        Err(in_gap.min_by_key(|(k, _)| k.abs_diff(station)).map_or(PairBlocked::Jump, |(_, why)| *why))
    }
}

/// A value is settled when it is nearer than this to the mean it is drawn to, rad.
const SETTLED: f64 = 1e-6;

/// Evaluates the cubic between nodes, with slopes from their neighbours.
fn curve(run: &[(usize, f64, f64)], station: usize, time: f64) -> f64 {
    let k = run.partition_point(|n| n.0 <= station).saturating_sub(1);
    let Some(&(_, t1, v1)) = run.get(k + 1) else { return run[k].2 };
    let (_, t0, v0) = run[k];
    let span = t1 - t0;
    if span <= 0.0 {
        return v0;
    }
    let slope = |a: usize, b: usize| {
        let ((_, ta, va), (_, tb, vb)) = (run[a], run[b]);
        if tb > ta { (vb - va) / (tb - ta) } else { 0.0 }
    };
    let before = slope(k.saturating_sub(1), k + 1);
    let after = slope(k, (k + 2).min(run.len() - 1));
    let s = ((time - t0) / span).clamp(0.0, 1.0);
    let (s2, s3) = (s * s, s * s * s);
    let hermite = [2.0 * s3 - 3.0 * s2 + 1.0, s3 - 2.0 * s2 + s, 3.0 * s2 - 2.0 * s3, s3 - s2];
    hermite[0] * v0 + hermite[1] * span * before + hermite[2] * v1 + hermite[3] * span * after
}

/// Cheapest costs layer by layer, as far as layers connect.
struct Layers {
    /// For each layer and state: cost up to there, and the state before.
    steps: Vec<Vec<(f64, usize)>>,
}

impl Layers {
    fn forward(nodes: &[ValueNode], much: f64) -> Self {
        let share = |k: usize| {
            let before = if k > 0 { nodes[k].time - nodes[k - 1].time } else { 0.0 };
            let after = nodes.get(k + 1).map_or(0.0, |n| n.time - nodes[k].time);
            0.5 * (before + after)
        };
        let first = nodes[0].states.iter().map(|s| (s.cost * share(0), 0)).collect();
        let mut steps: Vec<Vec<(f64, usize)>> = vec![first];
        for k in 1..nodes.len() {
            let (from, to) = (&nodes[k - 1], &nodes[k]);
            let time = (to.time - from.time).max(f64::MIN_POSITIVE);
            let last = &steps[k - 1];
            let cheapest = |s: &ValueState| {
                let mut best = (f64::INFINITY, 0);
                for (i, f) in from.states.iter().enumerate() {
                    let way = s.value - f.value;
                    let cost = last[i].0 + (way / much).powi(2) / time;
                    if way.abs() <= WIDEST_STEP && cost < best.0 {
                        best = (cost, i);
                    }
                }
                (best.0 + s.cost * share(k), best.1)
            };
            let step: Vec<(f64, usize)> = to.states.iter().map(cheapest).collect();
            if step.iter().all(|(cost, _)| cost.is_infinite()) {
                break;
            }
            steps.push(step);
        }
        Self { steps }
    }

    /// Returns the cheapest way through the layers, with the smallest value among equals.
    fn best(&self, nodes: &[ValueNode]) -> Vec<(usize, f64, f64)> {
        let last = &self.steps[self.steps.len() - 1];
        let mut at = (0..last.len()).min_by(|&a, &b| last[a].0.total_cmp(&last[b].0)).unwrap_or(0);
        let mut way: Vec<(usize, f64, f64)> = (0..self.steps.len())
            .rev()
            .map(|k| {
                let here = at;
                at = self.steps[k][here].1;
                (nodes[k].station, nodes[k].time, nodes[k].states[here].value)
            })
            .collect();
        way.reverse();
        way
    }
}

#[cfg(test)]
#[path = "../../tests/unit/pairs/values.rs"]
mod tests;
