//! Building the tree: median splits into eight parts, a slab around each.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::bound::{Slab, Slabs};
use crate::lanes::N;

/// A node: up to eight children, each a node or a triangle, with their slabs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) slabs: Slabs,
    children: [u32; N],
}

/// A child of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Child {
    /// Index of a node.
    Node(u32),
    /// Place of a triangle in the order of the leaves.
    Triangle(u32),
}

/// No child.
const NONE: u32 = u32::MAX;

/// Marks a child that is a triangle.
const TRIANGLE: u32 = 1 << 31;

/// Runs of at least so many triangles are worked on by several threads; shorter ones are done before a thread has started.
const PARALLEL: usize = 1 << 13;

impl Child {
    /// The child as one number, as [`Child::unpack`] takes it.
    #[inline(always)]
    pub(crate) fn pack(self) -> u32 {
        match self {
            Self::Node(index) => index,
            Self::Triangle(place) => place | TRIANGLE,
        }
    }

    #[inline(always)]
    pub(crate) fn unpack(packed: u32) -> Self {
        if packed & TRIANGLE == 0 { Self::Node(packed) } else { Self::Triangle(packed & !TRIANGLE) }
    }
}

impl Node {
    const EMPTY: Self = Self { slabs: Slabs::NONE, children: [NONE; N] };

    /// The children as packed numbers with their lanes.
    #[inline(always)]
    pub(crate) fn packed_children(&self) -> impl Iterator<Item = (usize, u32)> {
        self.children.iter().copied().enumerate().filter(|(_, packed)| *packed != NONE)
    }

    fn set(&mut self, lane: usize, slab: &Slab, child: Child) {
        self.slabs.set(lane, slab);
        self.children[lane] = child.pack();
    }

    /// Moves the nodes that are children by an offset.
    fn shift(&mut self, by: u32) {
        for child in &mut self.children {
            if *child & TRIANGLE == 0 {
                *child += by;
            }
        }
    }
}

/// Nodes with the root first, and the triangles in the order of the leaves.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    pub(crate) nodes: Vec<Node>,
    pub(crate) order: Vec<u32>,
}

impl Tree {
    /// The tree over triangles given by their corners; empty for none. The same for any number of threads.
    pub(crate) fn build(corners: &[[Point3<f64>; 3]]) -> Self {
        let mut order: Vec<u32> = (0..corners.len() as u32).collect();
        if order.is_empty() {
            return Self::default();
        }
        let centers: Vec<_> = corners.par_iter().map(|[a, b, c]| (a.coords + b.coords + c.coords) / 3.0).collect();
        let nodes = Builder { corners, centers: &centers }.subtree(&mut order, 0);
        Self { nodes, order }
    }
}

struct Builder<'a> {
    corners: &'a [[Point3<f64>; 3]],
    centers: &'a [Vector3<f64>],
}

impl Builder<'_> {
    /// Nodes over a run of triangles that starts at `first` of the order, root first.
    fn subtree(&self, run: &mut [u32], first: u32) -> Vec<Node> {
        // As many parts as full subtrees of the next height are needed: so all nodes but the topmost are nearly full.
        let mut capacity = 1;
        while capacity * N < run.len() {
            capacity *= N;
        }
        let n_parts = run.len().div_ceil(capacity);
        let parts = self.parts(run, n_parts, first);
        let build = |(run, first): (&mut [u32], u32)| {
            let slab = Slab::around(self.corners, run);
            let nodes = if run.len() == 1 { Vec::new() } else { self.subtree(run, first) };
            (slab, first, nodes)
        };
        let children: Vec<(Slab, u32, Vec<Node>)> = if capacity * N >= PARALLEL {
            parts.into_par_iter().map(build).collect()
        } else {
            parts.into_iter().map(build).collect()
        };
        let mut nodes = vec![Node::EMPTY];
        nodes.reserve(children.iter().map(|(.., n)| n.len()).sum());
        for (lane, (slab, place, below)) in children.into_iter().enumerate() {
            let at = nodes.len() as u32;
            let child = if below.is_empty() { Child::Triangle(place) } else { Child::Node(at) };
            nodes[0].set(lane, &slab, child);
            nodes.extend(below.into_iter().map(|mut node| {
                node.shift(at);
                node
            }));
        }
        nodes
    }

    /// Splits a run at medians into so many parts of equal size, each with its first place in the order.
    fn parts<'r>(&self, run: &'r mut [u32], n_parts: usize, first: u32) -> Vec<(&'r mut [u32], u32)> {
        if n_parts <= 1 {
            return vec![(run, first)];
        }
        let axis = widest_axis(run.iter().map(|&t| &self.centers[t as usize]));
        let n_left = n_parts / 2;
        let middle = run.len() * n_left / n_parts;
        // Ties by index: the tree depends on nothing but the mesh.
        run.select_nth_unstable_by(middle, |&a, &b| {
            self.centers[a as usize][axis].total_cmp(&self.centers[b as usize][axis]).then(a.cmp(&b))
        });
        let is_long = run.len() >= PARALLEL;
        let (left, right) = run.split_at_mut(middle);
        let (n_right, first_right) = (n_parts - n_left, first + middle as u32);
        let (mut parts, right) = if is_long {
            rayon::join(|| self.parts(left, n_left, first), || self.parts(right, n_right, first_right))
        } else {
            (self.parts(left, n_left, first), self.parts(right, n_right, first_right))
        };
        parts.extend(right);
        parts
    }
}

/// The coordinate in which the points spread most.
fn widest_axis<'a>(points: impl Iterator<Item = &'a Vector3<f64>>) -> usize {
    let (mut min, mut max) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for p in points {
        (min, max) = (min.inf(p), max.sup(p));
    }
    (max - min).imax()
}
