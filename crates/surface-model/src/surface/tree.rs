use std::ops::Range;

use facemill_cl_data::Aabb;

/// Hierarchy of axis-aligned boxes over items (triangles, mostly), flat in memory, the same for the
/// same boxes.
///
/// Items are numbered as in the slice it was built from. Items with an empty box or one that is not
/// finite are left out: no query returns them.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    nodes: Vec<Node>,
    items: Vec<u32>,
    item_boxes: Vec<Aabb>,
}

/// A box of the hierarchy, named by its position in the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeId(u32);

/// Children of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Below<'a> {
    /// Two nodes.
    Nodes(NodeId, NodeId),
    /// Items, at least one.
    Items(&'a [u32]),
}

#[derive(Clone, Copy, Debug)]
struct Node {
    aabb: Aabb,
    /// Inner node: its second child (the first one follows it). Leaf: its first place in `items`.
    first: u32,
    /// Number of items of a leaf; 0 for an inner node.
    n_items: u32,
}

/// Fewer items than this are not worth a further box test.
const LEAF_ITEMS: usize = 4;

/// Cuts compared along the widest axis by the surface area heuristic.
const BINS: usize = 16;

/// Below this depth nodes are split into halves, so that the depth stays under [`STACK`] for any
/// input.
const HEURISTIC_DEPTH: usize = 40;

/// Largest number of nodes that wait during a traversal: one per level, and 32 levels of halves
/// suffice for 2³² items.
const STACK: usize = HEURISTIC_DEPTH + 34;

impl Tree {
    /// Builds the hierarchy by the surface area heuristic over 16 bins of the widest axis.
    ///
    /// # Panics
    /// When there are more than 2³¹ boxes.
    #[must_use]
    pub fn build(boxes: &[Aabb]) -> Self {
        assert!(boxes.len() <= 1 << 31, "a tree holds at most 2^31 items");
        let finite = |b: &Aabb| !b.is_empty() && b.min.iter().chain(b.max.iter()).all(|c| c.is_finite());
        let mut items: Vec<u32> = (0..boxes.len() as u32).filter(|&i| finite(&boxes[i as usize])).collect();
        let mut nodes = Vec::with_capacity(items.len());
        if !items.is_empty() {
            let n = items.len();
            split(boxes, &mut items, 0..n, 0, &mut nodes);
        }
        let item_boxes = items.iter().map(|&i| boxes[i as usize]).collect();
        Self { nodes, items, item_boxes }
    }

    /// Returns the box around all items; empty when there are none.
    pub fn aabb(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, |n| n.aabb)
    }

    /// Returns the node around everything, for custom traversals; `None` when there are no items.
    pub fn root(&self) -> Option<NodeId> {
        (!self.nodes.is_empty()).then_some(NodeId(0))
    }

    /// Returns the box of a node.
    pub fn node_aabb(&self, node: NodeId) -> &Aabb {
        &self.nodes[node.0 as usize].aabb
    }

    /// Returns the children or items of a node.
    pub fn below(&self, node: NodeId) -> Below<'_> {
        let n = &self.nodes[node.0 as usize];
        if n.n_items == 0 {
            Below::Nodes(NodeId(node.0 + 1), NodeId(n.first))
        } else {
            Below::Items(&self.items[n.range()])
        }
    }

    /// Calls `visit` with every item for which `enter` holds on its own box and on all boxes around
    /// it.
    ///
    /// `enter` must hold on a box when it holds on a part of it.
    pub fn visit_boxes(&self, enter: impl Fn(&Aabb) -> bool, mut visit: impl FnMut(u32)) {
        let _: Option<()> = self.find_in_boxes(enter, |item| {
            visit(item);
            None
        });
    }

    /// Visits as [`Tree::visit_boxes`], but stops at the first item for which `find` returns
    /// something, and returns that.
    pub fn find_in_boxes<T>(&self, enter: impl Fn(&Aabb) -> bool, mut find: impl FnMut(u32) -> Option<T>) -> Option<T> {
        let mut stack = Stack::new();
        stack.push(self.root().filter(|&r| enter(self.node_aabb(r))), 0.0);
        while let Some((node, _)) = stack.pop() {
            match self.below(node) {
                Below::Nodes(a, b) => {
                    stack.push(Some(b).filter(|&n| enter(self.node_aabb(n))), 0.0);
                    stack.push(Some(a).filter(|&n| enter(self.node_aabb(n))), 0.0);
                }
                Below::Items(items) => {
                    let boxes = &self.item_boxes[self.nodes[node.0 as usize].range()];
                    let found = items.iter().zip(boxes).filter(|(_, b)| enter(b)).find_map(|(&i, _)| find(i));
                    if found.is_some() {
                        return found;
                    }
                }
            }
        }
        None
    }

    /// Returns the item of least value, at most `limit`, and its value; among items with equal
    /// value the one with the lowest number.
    ///
    /// `bound` must not be more than the value of any item inside the box. `measure` gets an item
    /// and the least value found so far (at first `limit`) and returns the item's value, or `None`
    /// where it has none or it is clearly above that.
    pub fn nearest(
        &self,
        limit: f64,
        bound: impl Fn(&Aabb) -> f64,
        mut measure: impl FnMut(u32, f64) -> Option<f64>,
    ) -> Option<(u32, f64)> {
        let mut best: Option<(u32, f64)> = None;
        let mut least = limit;
        let mut stack = Stack::new();
        stack.push(self.root(), f64::NEG_INFINITY);
        while let Some((node, value)) = stack.pop() {
            if value > least {
                continue;
            }
            match self.below(node) {
                Below::Nodes(a, b) => {
                    let (va, vb) = (bound(self.node_aabb(a)), bound(self.node_aabb(b)));
                    let ((near, vn), (far, vf)) = if vb < va { ((b, vb), (a, va)) } else { ((a, va), (b, vb)) };
                    stack.push(Some(far).filter(|_| vf <= least), vf);
                    stack.push(Some(near).filter(|_| vn <= least), vn);
                }
                Below::Items(items) => {
                    for &item in items {
                        let Some(value) = measure(item, least) else { continue };
                        if value < least || (value == least && best.is_none_or(|(i, v)| value < v || item < i)) {
                            best = Some((item, value));
                            least = value;
                        }
                    }
                }
            }
        }
        best
    }

    /// Checks the invariants of every tree: each item once, every box around everything below it,
    /// depth within the stack.
    ///
    /// # Errors
    /// Names the first node or item that breaks it.
    pub fn check_invariants(&self) -> Result<(), String> {
        let mut seen: Vec<u32> = self.items.clone();
        seen.sort_unstable();
        if seen.windows(2).any(|w| w[0] == w[1]) {
            return Err("an item is there twice".into());
        }
        let Some(root) = self.root() else { return Ok(()) };
        let mut todo = vec![(root, 1)];
        while let Some((node, depth)) = todo.pop() {
            let outer = self.node_aabb(node);
            if depth > STACK {
                return Err(format!("node {} is {depth} levels deep", node.0));
            }
            match self.below(node) {
                Below::Nodes(a, b) => {
                    if outer.union(self.node_aabb(a)).union(self.node_aabb(b)) != *outer {
                        return Err(format!("node {} does not hold its children", node.0));
                    }
                    todo.extend([(a, depth + 1), (b, depth + 1)]);
                }
                Below::Items(_) => {
                    let range = self.nodes[node.0 as usize].range();
                    if self.item_boxes[range].iter().any(|b| outer.union(b) != *outer) {
                        return Err(format!("node {} does not hold its items", node.0));
                    }
                }
            }
        }
        Ok(())
    }
}

impl Node {
    fn range(&self) -> Range<usize> {
        self.first as usize..(self.first + self.n_items) as usize
    }
}

/// Nodes that wait, on the machine's stack: traversals do not allocate.
struct Stack {
    entries: [(NodeId, f64); STACK],
    len: usize,
}

impl Stack {
    fn new() -> Self {
        Self { entries: [(NodeId(0), 0.0); STACK], len: 0 }
    }

    fn push(&mut self, node: Option<NodeId>, value: f64) {
        if let Some(node) = node {
            self.entries[self.len] = (node, value);
            self.len += 1;
        }
    }

    fn pop(&mut self) -> Option<(NodeId, f64)> {
        self.len = self.len.checked_sub(1)?;
        Some(self.entries[self.len])
    }
}

/// Appends the node over `items[range]` and all below it.
fn split(boxes: &[Aabb], items: &mut [u32], range: Range<usize>, depth: usize, nodes: &mut Vec<Node>) {
    let part = &mut items[range.clone()];
    let aabb = part.iter().fold(Aabb::EMPTY, |a, &i| a.union(&boxes[i as usize]));
    let node = nodes.len();
    nodes.push(Node { aabb, first: range.start as u32, n_items: part.len() as u32 });
    if part.len() <= LEAF_ITEMS {
        return;
    }
    let middle = range.start + partition(boxes, part, depth);
    split(boxes, items, range.start..middle, depth + 1, nodes);
    nodes[node].first = nodes.len() as u32;
    nodes[node].n_items = 0;
    split(boxes, items, middle..range.end, depth + 1, nodes);
}

/// Reorders the items so that the first ones, whose number is returned, go to one child and the
/// rest to the other.
fn partition(boxes: &[Aabb], part: &mut [u32], depth: usize) -> usize {
    let center = |i: u32| boxes[i as usize].center();
    let centers = part.iter().fold(Aabb::EMPTY, |a, &i| a.with_point(&center(i)));
    let size = centers.max - centers.min;
    let axis = size.imax();
    let (low, width) = (centers.min[axis], size[axis]);
    let bin = |i: u32| (((center(i)[axis] - low) / width * BINS as f64) as usize).min(BINS - 1);
    if depth < HEURISTIC_DEPTH && width > 0.0 && width.is_finite() {
        let cut = cheapest_cut(part.iter().map(|&i| (bin(i), &boxes[i as usize])));
        // A stable partition keeps the items of a leaf in ascending order, whatever the sorting
        // algorithm of std.
        let (mut low_side, mut high_side) = (Vec::with_capacity(part.len()), Vec::new());
        for &i in part.iter() {
            if bin(i) < cut { low_side.push(i) } else { high_side.push(i) }
        }
        let n_low = low_side.len();
        if n_low > 0 && !high_side.is_empty() {
            low_side.append(&mut high_side);
            part.copy_from_slice(&low_side);
            return n_low;
        }
    }
    part.sort_by(|&a, &b| center(a)[axis].total_cmp(&center(b)[axis]).then(a.cmp(&b)));
    part.len() / 2
}

/// First bin of the upper side for the cut of least (area × items) on both sides.
fn cheapest_cut<'a>(entries: impl Iterator<Item = (usize, &'a Aabb)>) -> usize {
    let mut bins = [(Aabb::EMPTY, 0usize); BINS];
    for (k, b) in entries {
        bins[k] = (bins[k].0.union(b), bins[k].1 + 1);
    }
    let mut above = [0.0; BINS];
    let (mut aabb, mut n) = (Aabb::EMPTY, 0);
    for k in (1..BINS).rev() {
        (aabb, n) = (aabb.union(&bins[k].0), n + bins[k].1);
        above[k] = half_area(&aabb) * n as f64;
    }
    let (mut aabb, mut n) = (Aabb::EMPTY, 0);
    let (mut best, mut cut) = (f64::INFINITY, BINS / 2);
    for k in 1..BINS {
        (aabb, n) = (aabb.union(&bins[k - 1].0), n + bins[k - 1].1);
        let cost = half_area(&aabb) * n as f64 + above[k];
        if cost < best {
            (best, cut) = (cost, k);
        }
    }
    cut
}

fn half_area(b: &Aabb) -> f64 {
    if b.is_empty() {
        return 0.0;
    }
    let s = b.max - b.min;
    s.x * s.y + s.y * s.z + s.z * s.x
}

#[cfg(test)]
#[path = "../../tests/unit/surface/tree.rs"]
mod tests;
