//! Building the tree: median splits into eight parts, a slab around each.

use std::collections::BTreeMap;

use facemill_surface_model::TriMesh;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::body::bound::{Slab, Slabs};
use crate::body::lanes::N;

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

/// Runs of at least so many triangles are sorted by several threads; shorter ones are done before a
/// thread has started.
const PARALLEL: usize = 1 << 13;

/// Most nodes made by a thread at a time: small, because those of the topmost levels take long.
const CHUNK: usize = 1 << 10;

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
}

/// Nodes with the root first, each before those below it, and the triangles in the order of the
/// leaves.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    pub(crate) nodes: Vec<Node>,
    /// Indices in the mesh.
    pub(crate) order: Vec<u32>,
    pub(crate) corners: Vec<[Point3<f64>; 3]>,
}

impl Tree {
    /// The tree over the triangles of a mesh; empty for none. The same for any number of threads.
    pub(crate) fn build(mesh: &TriMesh) -> Self {
        if mesh.triangles().is_empty() {
            return Self::default();
        }
        let mut items = items(mesh);
        sort(&mut items);
        let order: Vec<u32> = items.par_iter().map(|item| item.triangle).collect();
        let corners: Vec<_> = order.par_iter().map(|&t| mesh.corners(t as usize)).collect();
        let sizes = Sizes::of(corners.len());
        let nodes = sizes
            .runs(corners.len())
            .par_iter()
            .enumerate()
            .with_max_len(CHUNK)
            .map(|(at, run)| node(&corners[run.first as usize..][..run.len as usize], at as u32, run.first, &sizes))
            .collect();
        Self { nodes, order, corners }
    }
}

/// The node at an index over a run of triangles that starts at `first` of the order.
fn node(corners: &[[Point3<f64>; 3]], at: u32, first: u32, sizes: &Sizes) -> Node {
    let mut node = Node::EMPTY;
    let mut below = at + 1;
    for lane in 0..n_parts(corners.len()) {
        let [from, to] = [lane, lane + 1].map(|k| boundary(corners.len(), k));
        let child = if to - from == 1 { Child::Triangle(first + from as u32) } else { Child::Node(below) };
        node.set(lane, &Slab::around(&corners[from..to]), child);
        below += sizes.n_nodes(to - from);
    }
    node
}

/// Parts of a run of triangles: as many as full subtrees of the next height are needed, so that all
/// nodes but the topmost are nearly full.
fn n_parts(len: usize) -> usize {
    let mut capacity = 1;
    while capacity * N < len {
        capacity *= N;
    }
    len.div_ceil(capacity)
}

/// Where a part of a run begins; their sizes differ by one at most.
fn boundary(len: usize, part: usize) -> usize {
    len * part / n_parts(len)
}

/// Numbers of nodes by the number of triangles.
struct Sizes(BTreeMap<usize, u32>);

/// Triangles of a node: so many from a place in the order on.
struct NodeTriangles {
    first: u32,
    len: u32,
}

impl Sizes {
    /// For a tree of so many triangles and every subtree of it.
    fn of(len: usize) -> Self {
        let mut sizes = Self(BTreeMap::new());
        sizes.add(len);
        sizes
    }

    fn add(&mut self, len: usize) {
        if len <= N || self.0.contains_key(&len) {
            return;
        }
        let mut n = 1;
        for part in 0..n_parts(len) {
            let part = boundary(len, part + 1) - boundary(len, part);
            self.add(part);
            n += self.n_nodes(part);
        }
        self.0.insert(len, n);
    }

    fn n_nodes(&self, len: usize) -> u32 {
        if len <= N { u32::from(len > 1) } else { self.0[&len] }
    }

    /// The runs of all nodes, the root's first, each before those below it.
    fn runs(&self, len: usize) -> Vec<NodeTriangles> {
        // A tree of one triangle has a root nevertheless.
        let mut runs = Vec::with_capacity(self.n_nodes(len).max(1) as usize);
        let mut pending = vec![NodeTriangles { first: 0, len: len as u32 }];
        while let Some(run) = pending.pop() {
            let len = run.len as usize;
            for part in (0..n_parts(len)).rev() {
                let [from, to] = [part, part + 1].map(|k| boundary(len, k));
                if to - from > 1 {
                    pending.push(NodeTriangles { first: run.first + from as u32, len: (to - from) as u32 });
                }
            }
            runs.push(run);
        }
        runs
    }
}

/// A triangle to be sorted.
#[derive(Clone, Copy)]
struct Item {
    /// Its centre, in parts of the mesh's extent.
    center: [u32; 3],
    triangle: u32,
}

/// The triangles with their centres. Centres nearer than a 2³²th of the extent may count as equal:
/// that costs nothing but a trifle of the tree's quality.
fn items(mesh: &TriMesh) -> Vec<Item> {
    let center = |t: &[u32; 3]| t.map(|v| mesh.vertices()[v as usize].coords / 3.0).iter().sum::<Vector3<f64>>();
    let none = [Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)];
    let wider = |[low, high]: [Vector3<f64>; 2], [a, b]: [Vector3<f64>; 2]| [low.inf(&a), high.sup(&b)];
    let of_chunk = |chunk: &[[u32; 3]]| chunk.iter().map(center).map(|c| [c, c]).fold(none, wider);
    let chunks: Vec<_> = mesh.triangles().par_chunks(PARALLEL).map(of_chunk).collect();
    let [low, high] = chunks.into_iter().fold(none, wider);
    let scale = f64::from(u32::MAX) / (high - low).max();
    let item = |(t, corners): (usize, &[u32; 3])| {
        let from_low = (center(corners) - low) * scale;
        Item { center: [from_low.x as u32, from_low.y as u32, from_low.z as u32], triangle: t as u32 }
    };
    mesh.triangles().par_iter().enumerate().map(item).collect()
}

/// Puts triangles into the order of the leaves.
fn sort(items: &mut [Item]) {
    // Children that are triangles may stand in any order.
    if items.len() > N {
        split(items, items.len(), 0, n_parts(items.len()));
    }
}

/// Splits a node's run at medians into its parts, of which `items` are those from `first_part` on
/// up to `end_part`, and sorts each.
fn split(items: &mut [Item], node_len: usize, first_part: usize, end_part: usize) {
    if end_part - first_part == 1 {
        return sort(items);
    }
    let middle_part = (first_part + end_part) / 2;
    let middle = boundary(node_len, middle_part) - boundary(node_len, first_part);
    let axis = widest_axis(items);
    // Ties by index: the tree depends on nothing but the mesh.
    let key = |item: &Item| u64::from(item.center[axis]) << 32 | u64::from(item.triangle);
    items.select_nth_unstable_by_key(middle, key);
    let is_long = items.len() >= PARALLEL;
    let (left, right) = items.split_at_mut(middle);
    let mut halves =
        (|| split(left, node_len, first_part, middle_part), || split(right, node_len, middle_part, end_part));
    if is_long {
        rayon::join(halves.0, halves.1);
    } else {
        halves.0();
        halves.1();
    }
}

/// The coordinate in which the centres spread most.
fn widest_axis(items: &[Item]) -> usize {
    let (mut low, mut high) = ([u32::MAX; 3], [0; 3]);
    for item in items {
        for k in 0..3 {
            (low[k], high[k]) = (low[k].min(item.center[k]), high[k].max(item.center[k]));
        }
    }
    let spread = |k: usize| high[k] - low[k];
    (1..3).fold(0, |widest, k| if spread(k) > spread(widest) { k } else { widest })
}

#[cfg(test)]
#[path = "../../tests/unit/mesh_tree/build.rs"]
mod tests;
