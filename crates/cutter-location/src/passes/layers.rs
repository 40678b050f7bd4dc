//! Shortest way through a layered graph.

/// A way, one node of every layer, and its cost.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LayeredPath {
    /// A node of every layer.
    pub(crate) nodes: Vec<usize>,
    /// Sum over nodes and edges.
    pub(crate) cost: f64,
}

/// Cheapest ways to all nodes of the last layer so far (Bellman's recursion): every edge is
/// evaluated once, and of earlier layers only the predecessor of each node is kept.
#[derive(Clone, Debug)]
pub(crate) struct ShortestWays {
    cost: Vec<f64>,
    before: Vec<Vec<u32>>,
}

impl ShortestWays {
    /// Ways of one layer whose nodes cost this much.
    pub(crate) fn new(node_costs: Vec<f64>) -> Self {
        Self { cost: node_costs, before: Vec::new() }
    }

    /// Adds another layer, from the costs of its nodes and of an edge from a node of the layer
    /// before to one of its own.
    pub(crate) fn extend(&mut self, node_costs: &[f64], edge_cost: impl Fn(usize, usize) -> f64) {
        let reached = node_costs.iter().enumerate().map(|(to, own)| {
            let mut best = (f64::INFINITY, 0);
            for (from, so_far) in self.cost.iter().enumerate() {
                let sum = so_far + edge_cost(from, to);
                if sum < best.0 {
                    best = (sum, from as u32);
                }
            }
            (best.0 + own, best.1)
        });
        let (cost, before) = reached.unzip();
        self.cost = cost;
        self.before.push(before);
    }

    /// Returns the cheapest way; among equals, the one with the smaller node in the last layer
    /// where they differ; `None` where a layer has no node or no way has a finite cost.
    pub(crate) fn cheapest(&self) -> Option<LayeredPath> {
        let ends = self.cost.iter().copied().enumerate().filter(|(_, cost)| cost.is_finite());
        let (last, cost) = ends.reduce(|a, b| if b.1 < a.1 { b } else { a })?;
        let mut nodes = vec![last];
        for before in self.before.iter().rev() {
            nodes.push(before[*nodes.last()?] as usize);
        }
        nodes.reverse();
        Some(LayeredPath { nodes, cost })
    }
}

#[cfg(test)]
#[path = "../../tests/unit/passes/layers.rs"]
mod tests;
