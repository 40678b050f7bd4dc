//! The values of a shared axis along a way: the cheapest of a lattice, smoothed.

use crate::pairs::test::PairBlocked;

/// A value that both heads can stand at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ValueState {
    /// The value.
    pub(crate) value: f64,
    /// What it costs per second.
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

/// One value for each node that has any, as runs of nodes that follow each other.
#[derive(Clone, Debug)]
pub(crate) struct ValuePath {
    /// Station, time, value.
    runs: Vec<Vec<(usize, f64, f64)>>,
    /// Stations with no value, and why.
    blocked: Vec<(usize, PairBlocked)>,
}

/// Part of an axis' largest speed that is much for it.
const MUCH: f64 = 0.1;

/// Values further apart than this in one step are no way, rad: between two stations the axis would turn past what was
/// tested at neither.
const WIDEST_STEP: f64 = 0.35;

/// Rounds of smoothing: steps of the lattice are spread over about as many nodes.
const ROUNDS: usize = 12;

impl ValuePath {
    /// The sequence that costs least: each value's cost over the time around it, and the square of the speed between values
    /// against one that is much for the axis.
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

    /// Each value drawn to the mean of its neighbours, weighted by time, where `feasible` there.
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

    /// The value at a station, at its time: on a cubic curve through the nodes around it.
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

/// Values nearer than this to where they are drawn to stay, rad.
const SETTLED: f64 = 1e-6;

/// Cubic between nodes, with the slopes of their neighbours.
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

/// Cheapest costs layer by layer, as far as a way goes on.
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

    /// The cheapest way through the layers, the smallest value of equals.
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
mod tests {
    use crate::pairs::values::*;

    struct Random(u64);

    impl Random {
        fn below(&mut self, n: u64) -> u64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 33) % n
        }

        fn unit(&mut self) -> f64 {
            self.below(1_000_000) as f64 / 1e6
        }
    }

    fn nodes(random: &mut Random, n: usize) -> Vec<ValueNode> {
        let mut time = 0.0;
        (0..n)
            .map(|k| {
                time += 0.05 + random.unit();
                let states = (0..1 + random.below(4))
                    .map(|i| ValueState { value: 0.05 * i as f64 + 0.04 * random.unit(), cost: random.unit() })
                    .collect();
                ValueNode { station: 3 * k, time, states, blocked: PairBlocked::Jump }
            })
            .collect()
    }

    fn cost(nodes: &[ValueNode], choice: &[usize], much: f64) -> f64 {
        let mut sum = 0.0;
        for k in 0..nodes.len() {
            let before = if k > 0 { nodes[k].time - nodes[k - 1].time } else { 0.0 };
            let after = if k + 1 < nodes.len() { nodes[k + 1].time - nodes[k].time } else { 0.0 };
            sum += nodes[k].states[choice[k]].cost * 0.5 * (before + after);
            if k > 0 {
                let way = nodes[k].states[choice[k]].value - nodes[k - 1].states[choice[k - 1]].value;
                sum += (way / much).powi(2) / before;
            }
        }
        sum
    }

    /// All choices of small cases, one by one.
    #[test]
    fn no_sequence_of_values_costs_less_than_the_cheapest() {
        let mut random = Random(11);
        for _ in 0..200 {
            let nodes = nodes(&mut random, 5);
            let max_velocity = 0.2 + random.unit();
            let path = ValuePath::cheapest(&nodes, max_velocity);
            assert_eq!(path.runs.len(), 1);
            let chosen: Vec<usize> = nodes
                .iter()
                .zip(&path.runs[0])
                .map(|(n, c)| n.states.iter().position(|s| s.value == c.2).unwrap())
                .collect();
            let much = MUCH * max_velocity;
            let mut least = f64::INFINITY;
            let mut choice = [0usize; 5];
            loop {
                least = least.min(cost(&nodes, &choice, much));
                let Some(k) = (0..5).find(|&k| choice[k] + 1 < nodes[k].states.len()) else { break };
                choice[k] += 1;
                choice[..k].fill(0);
            }
            let found = cost(&nodes, &chosen, much);
            assert!((found - least).abs() < 1e-9 * (1.0 + least), "{found} for {least}");
        }
    }

    #[test]
    fn values_go_through_the_nodes_and_stop_where_there_are_none() {
        let mut random = Random(5);
        let mut nodes = nodes(&mut random, 9);
        nodes[4].states.clear();
        nodes[4].blocked = PairBlocked::NoCommonValue([Some([1.0, 2.0]), None]);
        let path = ValuePath::cheapest(&nodes, 1.0);
        assert_eq!(path.runs.len(), 2);
        for &(station, time, value) in path.runs.iter().flatten() {
            assert!((path.value(station, time).unwrap() - value).abs() < 1e-12);
        }
        // Stations 10 to 14 lie between the nodes at 9 and 15.
        for station in 10..15 {
            assert_eq!(path.value(station, nodes[4].time), Err(nodes[4].blocked));
        }
    }

    #[test]
    fn smoothing_takes_no_value_that_is_refused() {
        let mut random = Random(7);
        let nodes = nodes(&mut random, 40);
        let mut path = ValuePath::cheapest(&nodes, 1.0);
        let before = path.runs[0].clone();
        path.smooth(|_, value| value < 0.06);
        for (old, new) in before.iter().zip(&path.runs[0]) {
            assert!(new.2 < 0.06 || new.2 == old.2);
        }
        let bend =
            |run: &[(usize, f64, f64)]| run.windows(3).map(|w| (w[0].2 - 2.0 * w[1].2 + w[2].2).abs()).sum::<f64>();
        let mut free = ValuePath { runs: vec![before.clone()], blocked: Vec::new() };
        free.smooth(|_, _| true);
        assert!(bend(&free.runs[0]) < 0.5 * bend(&before));
    }
}
