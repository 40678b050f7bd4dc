use crate::pairs::values::*;
use facemill_test_kit::Random;

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
    let bend = |run: &[(usize, f64, f64)]| run.windows(3).map(|w| (w[0].2 - 2.0 * w[1].2 + w[2].2).abs()).sum::<f64>();
    let mut free = ValuePath { runs: vec![before.clone()], blocked: Vec::new() };
    free.smooth(|_, _| true);
    assert!(bend(&free.runs[0]) < 0.5 * bend(&before));
}
