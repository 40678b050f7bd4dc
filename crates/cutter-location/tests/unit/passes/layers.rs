use crate::passes::layers::*;

/// Costs by a hash of their place, on a coarse grid so that many ways cost the same.
struct Hashed {
    seed: u64,
    sizes: Vec<usize>,
}

impl Hashed {
    fn value(&self, words: [usize; 3]) -> f64 {
        let mut z = self.seed;
        for w in words {
            z = (z ^ w as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            z ^= z >> 29;
        }
        (z % 16) as f64 / 4.0
    }
}

impl Hashed {
    fn node_cost(&self, layer: usize, node: usize) -> f64 {
        self.value([layer, node, 1000])
    }
    fn edge_cost(&self, layer: usize, from: usize, to: usize) -> f64 {
        self.value([layer, from, to])
    }
    fn layer(&self, layer: usize) -> Vec<f64> {
        (0..self.sizes[layer]).map(|node| self.node_cost(layer, node)).collect()
    }
    fn shortest_way(&self) -> Option<LayeredPath> {
        let mut ways = ShortestWays::new(self.layer(0));
        for layer in 1..self.sizes.len() {
            ways.extend(&self.layer(layer), |from, to| self.edge_cost(layer, from, to));
        }
        ways.cheapest()
    }
}

fn cost_of(graph: &Hashed, nodes: &[usize]) -> f64 {
    let own: f64 = nodes.iter().enumerate().map(|(layer, &node)| graph.node_cost(layer, node)).sum();
    own + (1..nodes.len()).map(|layer| graph.edge_cost(layer, nodes[layer - 1], nodes[layer])).sum::<f64>()
}

/// Returns every possible way.
fn all_ways(sizes: &[usize]) -> Vec<Vec<usize>> {
    sizes.iter().fold(vec![Vec::new()], |ways, &size| {
        let longer = |way: &Vec<usize>, node| way.iter().copied().chain([node]).collect();
        ways.iter().flat_map(|way| (0..size).map(move |node| longer(way, node))).collect()
    })
}

#[test]
fn no_way_of_all_is_cheaper() {
    for seed in 0..300 {
        let layers = 1 + seed as usize % 6;
        let sizes: Vec<usize> = (0..layers).map(|k| 1 + (seed as usize * 7 + k * 5) % 4).collect();
        let graph = Hashed { seed, sizes };
        let way = graph.shortest_way().expect("every layer has a node");
        let cheapest = all_ways(&graph.sizes).iter().map(|w| cost_of(&graph, w)).fold(f64::INFINITY, f64::min);
        assert_eq!(way.cost, cheapest, "seed {seed}");
        assert_eq!(cost_of(&graph, &way.nodes), cheapest, "seed {seed}");
    }
}

#[test]
fn an_empty_layer_lets_nothing_through() {
    assert_eq!(Hashed { seed: 1, sizes: vec![2, 0, 3] }.shortest_way(), None);
    assert_eq!(Hashed { seed: 1, sizes: vec![0] }.shortest_way(), None);
}
