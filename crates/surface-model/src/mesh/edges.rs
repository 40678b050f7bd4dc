use std::ops::Range;

use crate::mesh::tri_mesh::TriMesh;

/// The edges of a mesh, with the triangle sides on each.
///
/// A side is numbered `3 * triangle + k` and runs from corner k to corner k + 1 (mod 3). Sides
/// whose two corners are the same vertex lie on no edge. Methods panic when an edge or triangle is
/// out of range, as a slice does; [`Edges::across`] and [`Edges::directions`] take the mesh it was
/// made of.
#[derive(Clone, Debug)]
pub struct Edges {
    edges: Vec<Edge>,
    sides: Vec<u32>,
    edge_of_side: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Edge {
    vertices: [u32; 2],
    first_side: u32,
    n_sides: u32,
}

const NO_EDGE: u32 = u32::MAX;

impl Edges {
    /// Finds the edges; they are ordered by their vertices, the sides on each by number.
    ///
    /// # Panics
    /// When the mesh has more than 2³⁰ triangles.
    #[must_use]
    pub fn of(mesh: &TriMesh) -> Self {
        let triangles = mesh.triangles();
        assert!(triangles.len() <= 1 << 30, "sides are numbered with 32 bits");
        let keyed = sides_by_edge(mesh);
        let mut edge_of_side = vec![NO_EDGE; 3 * triangles.len()];
        let mut edges = Vec::new();
        for (place, run) in runs(&keyed) {
            for &(_, side) in run {
                edge_of_side[side as usize] = edges.len() as u32;
            }
            edges.push(Edge { vertices: run[0].0, first_side: place as u32, n_sides: run.len() as u32 });
        }
        Self { edges, sides: keyed.into_iter().map(|(_, s)| s).collect(), edge_of_side }
    }

    /// Returns the number of edges.
    pub fn len(&self) -> usize {
        self.edges.len()
    }

    /// Returns whether there is no edge.
    pub fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    /// Returns its two vertices, the lower index first.
    pub fn vertices(&self, edge: u32) -> [u32; 2] {
        self.edges[edge as usize].vertices
    }

    /// Returns the sides on an edge, at least one.
    pub fn sides(&self, edge: u32) -> &[u32] {
        let e = &self.edges[edge as usize];
        &self.sides[Range { start: e.first_side as usize, end: (e.first_side + e.n_sides) as usize }]
    }

    /// Returns the edge of a side; `None` where both its corners are the same vertex.
    pub fn of_side(&self, triangle: u32, k: usize) -> Option<u32> {
        Some(self.edge_of_side[3 * triangle as usize + k]).filter(|&e| e != NO_EDGE)
    }

    /// Returns the side across, where exactly two triangles meet in the edge and are wound alike:
    /// (triangle, k).
    pub fn across(&self, mesh: &TriMesh, triangle: u32, k: usize) -> Option<(u32, usize)> {
        let &[a, b] = self.sides(self.of_side(triangle, k)?) else { return None };
        let this = 3 * triangle + k as u32;
        let other = if a == this { b } else { a };
        let (t, j) = (other / 3, (other % 3) as usize);
        let start = |t: u32, k: usize| mesh.triangles()[t as usize][k];
        (start(triangle, k) != start(t, j)).then_some((t, j))
    }

    /// Counts the sides that run from the lower vertex to the higher one, and those the other way.
    pub fn directions(&self, mesh: &TriMesh, edge: u32) -> (usize, usize) {
        let low = self.vertices(edge)[0];
        let sides = self.sides(edge);
        let up = sides.iter().filter(|&&s| mesh.triangles()[s as usize / 3][s as usize % 3] == low).count();
        (up, sides.len() - up)
    }
}

/// Returns the sides between different vertices with these, the lower index first, in rising order.
fn sides_by_edge(mesh: &TriMesh) -> Vec<([u32; 2], u32)> {
    let corners = mesh.triangles().as_flattened();
    let key = |side: usize| {
        let (a, b) = (corners[side], corners[side - side % 3 + (side + 1) % 3]);
        [a.min(b), a.max(b)]
    };
    let keys = || (0..corners.len()).map(|side| (key(side), side as u32)).filter(|([a, b], _)| a != b);
    // By the lower vertex at once: few sides have the same one.
    let mut starts = vec![0; mesh.vertices().len() + 1];
    keys().for_each(|([low, _], _)| starts[low as usize + 1] += 1);
    for v in 1..starts.len() {
        starts[v] += starts[v - 1];
    }
    let mut keyed = vec![([0; 2], 0); starts[mesh.vertices().len()]];
    let mut next = starts.clone();
    for entry in keys() {
        let place = &mut next[entry.0[0] as usize];
        keyed[*place] = entry;
        *place += 1;
    }
    starts.windows(2).for_each(|run| keyed[run[0]..run[1]].sort_unstable());
    keyed
}

/// Returns runs of entries with the same key, and where each starts.
fn runs<K: PartialEq, V>(keyed: &[(K, V)]) -> impl Iterator<Item = (usize, &[(K, V)])> {
    let mut place = 0;
    keyed.chunk_by(|a, b| a.0 == b.0).map(move |run| {
        place += run.len();
        (place - run.len(), run)
    })
}

/// Sets that are joined step by step; the lowest member represents its set.
pub(crate) struct DisjointSets(Vec<u32>);

impl DisjointSets {
    pub(crate) fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    pub(crate) fn find(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            self.0[i as usize] = self.0[self.0[i as usize] as usize];
            i = self.0[i as usize];
        }
        i
    }

    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
#[path = "../../tests/unit/mesh/edges.rs"]
mod tests;
