//! Ridges where fronts meet, and the passes along them.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use crate::distance::patch_vertices::{PatchVertices, on_edge};
use crate::layout::scallop::advance::{Advance, are_met};
use crate::layout::scallop::coverage::{COVERED, Coverage};
use crate::layout::scallop::surface_path::SurfacePath;
use crate::strategy::patch::Patch;

/// A node of the ridges: on an edge, or inside a triangle where three of them meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Node {
    Edge(u32),
    Triangle(u32),
}

/// A place on a ridge.
#[derive(Clone, Copy)]
struct RidgePoint {
    position: Point3<f64>,
    /// Whether no pass covers it.
    is_open: bool,
    width: f64,
}

/// The ridges of a patch, from node to node through its triangles.
#[derive(Default)]
struct Ridges {
    points: BTreeMap<Node, RidgePoint>,
    /// Neighbours of each node, with the triangle between.
    next: BTreeMap<Node, Vec<(Node, u32)>>,
}

/// Gaps between two stretches of a ridge are cut with them when they are no longer than this, in
/// widths: a link takes longer.
const LONGEST_GAP: f64 = 3.0;

/// Passes along the ridges where fronts meet, where no pass covers them.
pub(crate) fn ridge_passes(
    patch: &Patch,
    vertices: &PatchVertices,
    advance: &Advance,
    coverage: &Coverage,
) -> Vec<SurfacePath> {
    let ridges = Ridges::of(patch, vertices, advance, coverage);
    ridges.chains().iter().flat_map(|chain| ridges.open_parts(chain)).collect()
}

impl Ridges {
    fn of(patch: &Patch, vertices: &PatchVertices, advance: &Advance, coverage: &Coverage) -> Self {
        let mut this = Self::default();
        for (t, v) in patch.mesh.triangles().iter().enumerate() {
            let t = t as u32;
            let crossed: Vec<u32> = (0..3)
                .filter(|&k| is_crossed(patch, advance, [v[k], v[(k + 1) % 3]]))
                .filter_map(|k| patch.edges.of_side(t, k))
                .collect();
            for &edge in &crossed {
                let ends = patch.edges.vertices(edge);
                this.points.entry(Node::Edge(edge)).or_insert_with(|| {
                    let share = meeting_share(patch, advance, ends);
                    let widths = ends.map(|v| advance.widths[v as usize]);
                    let open = coverage.share_on_edge(patch, vertices, &advance.widths, ends, share) > COVERED;
                    RidgePoint { position: on_edge(patch, ends, share), is_open: open, width: widths[0].min(widths[1]) }
                });
            }
            match crossed[..] {
                [a, b] => this.join(Node::Edge(a), Node::Edge(b), t),
                [a, b, c] => {
                    let of: [RidgePoint; 3] = [a, b, c].map(|e| this.points[&Node::Edge(e)]);
                    let middle = of.iter().map(|p| p.position.coords).sum::<Vector3<f64>>() / 3.0;
                    let is_open = of.iter().all(|p| p.is_open);
                    let point = RidgePoint { position: Point3::from(middle), is_open, width: of[0].width };
                    this.points.insert(Node::Triangle(t), point);
                    crossed.iter().for_each(|&e| this.join(Node::Edge(e), Node::Triangle(t), t));
                }
                _ => {}
            }
        }
        this
    }

    fn join(&mut self, a: Node, b: Node, triangle: u32) {
        self.next.entry(a).or_default().push((b, triangle));
        self.next.entry(b).or_default().push((a, triangle));
    }

    /// The ridges between nodes where not exactly two meet, then closed ones: nodes with the
    /// triangle behind each.
    fn chains(&self) -> Vec<Vec<(Node, u32)>> {
        let mut used: BTreeMap<(Node, Node), bool> = BTreeMap::new();
        let mut chains = Vec::new();
        for closed in [false, true] {
            for (&start, next) in &self.next {
                if !closed && next.len() == 2 {
                    continue;
                }
                for &(to, triangle) in next {
                    if !used.contains_key(&(start, to)) {
                        chains.push(self.chain(start, to, triangle, &mut used));
                    }
                }
            }
        }
        chains
    }

    fn chain(&self, start: Node, to: Node, triangle: u32, used: &mut BTreeMap<(Node, Node), bool>) -> Vec<(Node, u32)> {
        let mut chain = vec![(start, triangle)];
        let (mut from, mut at, mut triangle) = (start, to, triangle);
        loop {
            used.insert((from, at), true);
            used.insert((at, from), true);
            let next = &self.next[&at];
            let onward = next.iter().find(|(n, _)| *n != from && !used.contains_key(&(at, *n)));
            let onward = onward.filter(|_| next.len() == 2);
            chain.push((at, onward.map_or(triangle, |&(_, t)| t)));
            let Some(&(n, t)) = onward else { return chain };
            (from, at, triangle) = (at, n, t);
        }
    }

    /// The parts of a chain that no pass covers, with the short gaps between them.
    fn open_parts(&self, chain: &[(Node, u32)]) -> Vec<SurfacePath> {
        let points: Vec<RidgePoint> = chain.iter().map(|(n, _)| self.points[n]).collect();
        let mut ways = vec![0.0];
        for w in points.windows(2) {
            ways.push(ways[ways.len() - 1] + (w[1].position - w[0].position).norm());
        }
        let mut parts: Vec<[usize; 2]> = Vec::new();
        for k in (0..points.len()).filter(|&k| points[k].is_open) {
            match parts.last_mut() {
                Some([_, last]) if ways[k] - ways[*last] <= LONGEST_GAP * points[k].width => *last = k,
                _ => parts.push([k, k]),
            }
        }
        let path = |[from, to]: [usize; 2]| {
            // One node more on each side, so that the ends are covered too.
            let (from, to) = (from.saturating_sub(1), (to + 1).min(points.len() - 1));
            let mut nodes: Vec<Point3<f64>> = Vec::new();
            let mut triangles = Vec::new();
            for k in from..=to {
                if nodes.last() != Some(&points[k].position) {
                    nodes.push(points[k].position);
                    triangles.push(chain[k].1);
                }
            }
            if let Some(last) = triangles.last_mut() {
                *last = chain[to.saturating_sub(1).max(from)].1;
            }
            (nodes.len() >= 2).then_some(SurfacePath { nodes, triangles, closed: false })
        };
        parts.into_iter().filter_map(path).collect()
    }
}

/// Whether fronts meet on an edge.
fn is_crossed(patch: &Patch, advance: &Advance, [a, b]: [u32; 2]) -> bool {
    let known = |v: u32| advance.arrivals[v as usize].is_finite();
    let edge = patch.mesh.vertices()[b as usize] - patch.mesh.vertices()[a as usize];
    known(a) && known(b) && are_met(&edge, &advance.away[a as usize], &advance.away[b as usize])
}

/// Share of the edge at which the fronts from both sides arrive at once: each goes on straight.
fn meeting_share(patch: &Patch, advance: &Advance, [a, b]: [u32; 2]) -> f64 {
    let edge = patch.mesh.vertices()[b as usize] - patch.mesh.vertices()[a as usize];
    let slope_a = edge.dot(&advance.away[a as usize]);
    let slope_b = -edge.dot(&advance.away[b as usize]);
    let ahead = advance.arrivals[b as usize] - advance.arrivals[a as usize];
    let share = (ahead + slope_b) / (slope_a + slope_b);
    if share.is_nan() { 0.5 } else { share.clamp(0.0, 1.0) }
}
