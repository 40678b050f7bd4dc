//! Building the tree: median splits, a slab around every node.

use nalgebra::Point3;

use crate::bound::Slab;

/// Triangles of a leaf, at most: with more, a leaf's slab misses what those of its parts would exclude (8 is slower on
/// the wavy patch); with fewer, the tree grows and gains nothing there.
pub(crate) const LEAF: usize = 4;

/// A node: its slab, and either a run of triangles or two children next to each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) slab: Slab,
    /// First triangle of a leaf, or first of the two children.
    pub(crate) first: u32,
    /// Number of triangles of a leaf; 0 for an inner node.
    pub(crate) n_triangles: u32,
}

/// Nodes with the root first, and the triangles in the order of the leaves.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    pub(crate) nodes: Vec<Node>,
    pub(crate) order: Vec<u32>,
}

impl Tree {
    /// A tree of one leaf, for looking at every triangle.
    pub(crate) fn single_leaf(corners: &[[Point3<f64>; 3]]) -> Self {
        let order: Vec<u32> = (0..corners.len() as u32).collect();
        let nodes = if order.is_empty() { Vec::new() } else { vec![node(corners, &order, 0)] };
        Self { nodes, order }
    }

    /// The tree over triangles given by their corners; empty for none.
    pub(crate) fn build(corners: &[[Point3<f64>; 3]]) -> Self {
        let n = corners.len();
        let mut order: Vec<u32> = (0..n as u32).collect();
        let mut nodes = Vec::with_capacity(2 * n.div_ceil(LEAF));
        if n == 0 {
            return Self { nodes, order };
        }
        let centers: Vec<_> = corners.iter().map(|[a, b, c]| (a.coords + b.coords + c.coords) / 3.0).collect();
        nodes.push(node(corners, &order, 0));
        let mut pending = vec![(0usize, 0usize, n)];
        while let Some((parent, start, end)) = pending.pop() {
            if end - start <= LEAF {
                continue;
            }
            let run = &mut order[start..end];
            let axis = widest_axis(run.iter().map(|&t| &centers[t as usize]));
            let half = run.len() / 2;
            // Ties by index: the tree depends on nothing but the mesh.
            run.select_nth_unstable_by(half, |&a, &b| {
                centers[a as usize][axis].total_cmp(&centers[b as usize][axis]).then(a.cmp(&b))
            });
            let first_child = nodes.len();
            (nodes[parent].first, nodes[parent].n_triangles) = (first_child as u32, 0);
            let middle = start + half;
            nodes.push(node(corners, &order[start..middle], start));
            nodes.push(node(corners, &order[middle..end], middle));
            pending.push((first_child, start, middle));
            pending.push((first_child + 1, middle, end));
        }
        Self { nodes, order }
    }
}

/// A leaf of these triangles, which start at `first` of the order.
fn node(corners: &[[Point3<f64>; 3]], run: &[u32], first: usize) -> Node {
    let slab = Slab::around(run.iter().flat_map(|&t| &corners[t as usize]));
    Node { slab, first: first as u32, n_triangles: run.len() as u32 }
}

/// The coordinate in which the points spread most.
fn widest_axis<'a>(points: impl Iterator<Item = &'a nalgebra::Vector3<f64>>) -> usize {
    let (mut min, mut max) = (nalgebra::Vector3::repeat(f64::INFINITY), nalgebra::Vector3::repeat(f64::NEG_INFINITY));
    for p in points {
        (min, max) = (min.inf(p), max.sup(p));
    }
    (max - min).imax()
}
