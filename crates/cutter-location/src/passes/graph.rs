//! Graph of postures along a pass: layers of feasible ones, and the cheapest way through.

use facemill_cl_data::{Cancelled, Monitor, Posture};
use facemill_inverse_kinematics::{Branch, BranchPreference};

use crate::passes::cost::MotionScale;
use crate::passes::layers::ShortestWays;
use crate::passes::smooth_pass::{Gap, Node, PassClock, SmoothPass, seen_from};
use crate::pose::workcell::{Configuration, Hints};
use crate::search;

/// Cost of a turn or axis step beyond its limit, or of a change of branch, s: more than it can save
/// on a pass of any length. It grows with the excess.
const JUMP: f64 = 1e4;

/// Graph of one pass. A layer keeps only the indices of its nodes to save memory per point; their
/// configurations are computed again when they are needed.
pub(crate) struct PassGraph<'g, 's, 'a> {
    pass: &'g SmoothPass<'s, 'a>,
    pub(crate) clock: &'g PassClock,
    pub(crate) scale: &'g MotionScale,
    layers: Vec<Layer>,
}

/// A CC point at which postures are chosen.
struct Layer {
    point: usize,
    /// A posture in addition to the lattice: the smallest feasible one of the search curve.
    found: Option<Posture>,
    /// The nodes; `None` as long as nothing has been tested.
    nodes: Option<Vec<NodeIndex>>,
}

/// Index of a posture (the last one is the one in addition to the lattice), and of one of the
/// machine's configurations in it.
type NodeIndex = (u16, u8);

/// The cheapest sequence.
pub(crate) struct Chosen {
    /// One node of every layer that has any.
    pub(crate) nodes: Vec<ChosenNode>,
    /// Cost, s.
    pub(crate) cost: f64,
}

/// A node of the cheapest sequence.
pub(crate) struct ChosenNode {
    pub(crate) point: usize,
    /// Time from the middle of the way from the layer before to the middle of the way to the next,
    /// s.
    pub(crate) share: f64,
    pub(crate) node: Node,
    index: NodeIndex,
}

impl<'g, 's, 'a> PassGraph<'g, 's, 'a> {
    /// A graph with layers at these points, in order.
    pub(crate) fn new(
        pass: &'g SmoothPass<'s, 'a>,
        clock: &'g PassClock,
        scale: &'g MotionScale,
        points: Vec<usize>,
    ) -> Self {
        let layers = points.into_iter().map(|point| Layer { point, found: None, nodes: None }).collect();
        Self { pass, clock, scale, layers }
    }

    /// Finds the cheapest sequence of nodes. Layers are tested when they are first reached.
    pub(crate) fn cheapest(&mut self, hints: &mut Hints, monitor: &dyn Monitor) -> Result<Chosen, Cancelled> {
        let mut used: Vec<usize> = Vec::new();
        let mut ways: Option<ShortestWays> = None;
        let mut before: Vec<Node> = Vec::new();
        for k in 0..self.layers.len() {
            monitor.checkpoint()?;
            let nodes = self.nodes(k, hints);
            if nodes.is_empty() {
                continue;
            }
            let share = self.share(k);
            let mut costs: Vec<f64> = nodes.iter().map(|node| share * node.cusp_rate).collect();
            match (&mut ways, used.last()) {
                (Some(ways), Some(&last)) => {
                    let gap = self.clock.gap(self.layers[last].point, self.layers[k].point);
                    ways.extend(&costs, |from, to| self.step(&before[from], &nodes[to], gap));
                }
                _ => {
                    for (cost, node) in costs.iter_mut().zip(&nodes) {
                        *cost += self.start(node);
                    }
                    ways = Some(ShortestWays::new(costs));
                }
            }
            used.push(k);
            before = nodes;
        }
        let Some(way) = ways.and_then(|ways| ways.cheapest()) else {
            return Ok(Chosen { nodes: Vec::new(), cost: 0.0 });
        };
        let chosen = used.iter().zip(&way.nodes).filter_map(|(&k, &at)| self.chosen(k, at)).collect();
        Ok(Chosen { nodes: chosen, cost: way.cost })
    }

    fn chosen(&self, layer: usize, at: usize) -> Option<ChosenNode> {
        let Layer { point, nodes, .. } = &self.layers[layer];
        let index = *nodes.as_ref()?.get(at)?;
        let node = *self.standing(layer, index.0).get(usize::from(index.1))?;
        Some(ChosenNode { point: *point, share: self.share(layer), node, index })
    }

    /// Time share of a layer, s.
    fn share(&self, layer: usize) -> f64 {
        let time = |k: usize| self.clock.times[self.layers[k].point];
        0.5 * (time((layer + 1).min(self.layers.len() - 1)) - time(layer.saturating_sub(1)))
    }

    /// Removes a node that turned out to be infeasible where it is seated (it is free at the
    /// largest lift only), and with it the other such nodes of its layer. A layer left without
    /// nodes no longer takes part in the comparison.
    pub(crate) fn remove(&mut self, fallen: &ChosenNode, hints: &mut Hints) {
        let Some(k) = self.layers.iter().position(|layer| layer.point == fallen.point) else { return };
        let indices = self.layers[k].nodes.take().unwrap_or_default();
        let left: Vec<NodeIndex> =
            indices.into_iter().filter(|&index| index != fallen.index && self.is_feasible(k, index, hints)).collect();
        if left.is_empty() {
            self.layers.remove(k);
        } else {
            self.layers[k].nodes = Some(left);
        }
    }

    /// Returns whether a node is feasible once it is seated, on its own branch.
    fn is_feasible(&self, layer: usize, (posture, way): NodeIndex, hints: &mut Hints) -> bool {
        let Some(node) = self.standing(layer, posture).get(usize::from(way)).copied() else { return false };
        let cc = &self.pass.task.pass.points[self.layers[layer].point];
        let pose = self.pass.test.try_posture(cc, node.posture, Some(&node.configuration), hints);
        pose.is_ok_and(|pose| pose.configuration.branch == node.configuration.branch)
    }

    /// Returns the nodes of a layer: those of the lattice, and that of the search, which is at the
    /// border of the feasible set.
    fn nodes(&mut self, layer: usize, hints: &mut Hints) -> Vec<Node> {
        if let Some(indices) = &self.layers[layer].nodes {
            let of_posture = |chunk: &[NodeIndex]| -> Vec<Node> {
                let all = self.standing(layer, chunk[0].0);
                chunk.iter().map(|index| all[usize::from(index.1)]).collect()
            };
            return indices.chunk_by(|a, b| a.0 == b.0).flat_map(of_posture).collect();
        }
        let cc = &self.pass.task.pass.points[self.layers[layer].point];
        let (mut indices, mut nodes) = (Vec::new(), Vec::new());
        let end = self.pass.lattice.postures.len();
        for posture in 0..=end {
            if posture == end {
                let search_settings = &self.pass.settings.search;
                let found = search(self.pass.test, cc, &self.pass.task.curve, search_settings, 0.0, None, hints);
                self.layers[layer].found = found.ok().map(|f| f.pose.posture);
            }
            let Some(posture_there) = self.posture(layer, posture as u16) else { continue };
            let Ok(free) = self.pass.test.configurations_of(cc, posture_there, hints) else { continue };
            let is_free = |node: &Node| free.iter().any(|c| c.branch == node.configuration.branch);
            for (way, node) in self.standing(layer, posture as u16).into_iter().enumerate() {
                if is_free(&node) {
                    indices.push((posture as u16, way as u8));
                    nodes.push(node);
                }
            }
        }
        self.layers[layer].nodes = Some(indices);
        nodes
    }

    /// Returns a posture of the lattice at a layer, by index; behind its end, the additional one.
    fn posture(&self, layer: usize, index: u16) -> Option<Posture> {
        let amount = self.pass.lattice.postures.get(usize::from(index));
        amount.map(|amount| self.pass.signed(*amount)).or(self.layers[layer].found)
    }

    /// Returns all configurations of a posture at the largest lift, feasible or not.
    fn standing(&self, layer: usize, index: u16) -> Vec<Node> {
        let point = self.layers[layer].point;
        let (cc, strip) = (&self.pass.task.pass.points[point], self.pass.strip(point));
        let Some(posture) = self.posture(layer, index) else { return Vec::new() };
        let cusp_rate = self.pass.cusp_scale().rate(posture, &strip);
        let axis = seen_from(cc, &cc.tool_axis(posture));
        let machine = self.pass.test.cell.machine;
        let configurations = self.pass.test.lifted_configurations(cc, posture);
        configurations
            .iter()
            .flat_map(|c| machine.windings(&c.axes).into_iter().map(|axes| Configuration { axes, ..*c }))
            .map(|configuration| Node {
                posture,
                scaled: self.scale.scaled(&configuration.axes),
                configuration,
                axis,
                cusp_rate,
            })
            .collect()
    }

    /// Returns the cost of beginning with a node.
    pub(crate) fn start(&self, node: &Node) -> f64 {
        let wanted = match self.pass.test.cell.preferred_branch {
            BranchPreference::Nearest => return 0.0,
            BranchPreference::Positive => Branch::Positive,
            BranchPreference::Negative => Branch::Negative,
        };
        if node.configuration.branch == wanted { 0.0 } else { JUMP }
    }

    /// Returns the cost of the way from one node to the next.
    pub(crate) fn step(&self, from: &Node, to: &Node, gap: Gap) -> f64 {
        let motion = self.scale.cost(&from.scaled, &to.scaled, gap.time);
        let branch = if from.configuration.branch == to.configuration.branch { 0.0 } else { JUMP };
        let limits =
            self.pass.excess(&from.axis, &to.axis, gap) + self.scale.excess(&from.scaled, &to.scaled, gap.time);
        motion + branch + JUMP * limits
    }
}
