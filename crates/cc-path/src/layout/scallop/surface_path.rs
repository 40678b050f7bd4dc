use facemill_surface_model::level_curves_among;
use nalgebra::{Point3, Unit};

use crate::distance::patch_vertices::on_edge;
use crate::distance::source_curve::{CurveNode, SourceCurve};
use crate::layout::level_set::bracketed_root;
use crate::layout::section_walk::SectionWalk;
use crate::strategy::patch::Patch;

/// A polyline on a patch.
#[derive(Clone, Debug)]
pub(crate) struct SurfacePath {
    pub(crate) nodes: Vec<Point3<f64>>,
    /// The triangle behind each node; at the end of an open path, the one before it.
    pub(crate) triangles: Vec<u32>,
    /// Whether the last node is followed by the first.
    pub(crate) closed: bool,
}

/// Turn of a path within its spacing from which it is a corner, 35°: a pass ends there and another
/// begins, because no posture follows it at feed.
const CORNER_COS: f64 = 0.82;

impl SurfacePath {
    /// The path with its nodes about `spacing` (mm) apart, as a curve to measure from.
    pub(crate) fn source(&self, patch: &Patch, spacing: f64) -> Option<SourceCurve> {
        let kept = self.spaced(spacing);
        let node = |k: usize| {
            let (position, triangle) = (self.nodes[k], self.triangles[k]);
            CurveNode { position, normal: patch.normal(triangle, &position), triangle }
        };
        SourceCurve::new(kept.into_iter().map(node).collect(), self.closed)
    }

    /// Nodes at least so far apart, the ends among them.
    fn spaced(&self, spacing: f64) -> Vec<usize> {
        let apart = |a: usize, b: usize| (self.nodes[b] - self.nodes[a]).norm();
        let last = self.nodes.len() - 1;
        let mut kept = vec![0];
        for k in 1..=last {
            let before = kept[kept.len() - 1];
            if apart(before, k) >= spacing || k == last {
                kept.push(k);
            }
        }
        let n = kept.len();
        let end = if self.closed { 0 } else { kept[n - 1] };
        let crumb = if self.closed { n - 1 } else { n.saturating_sub(2) };
        if n > 3 && apart(kept[crumb], end) < 0.5 * spacing {
            kept.remove(crumb);
        }
        kept
    }

    /// Length, mm.
    pub(crate) fn length(&self) -> f64 {
        let open: f64 = self.nodes.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        open + if self.closed { (self.nodes[0] - self.nodes[self.nodes.len() - 1]).norm() } else { 0.0 }
    }

    /// The parts of nodes for which `keep` holds, each with one node more at its ends.
    pub(crate) fn parts(self, keep: impl Fn(usize) -> bool) -> Vec<Self> {
        let n = self.nodes.len();
        let Some(out) = (0..n).find(|&k| !keep(k)) else { return vec![self] };
        // A closed path begins where a part ends.
        let order: Vec<usize> = if self.closed { (out..=out + n).map(|k| k % n).collect() } else { (0..n).collect() };
        let mut parts = Vec::new();
        let mut from = 0;
        while let Some(first) = (from..order.len()).find(|&k| keep(order[k])) {
            let end = (first..order.len()).find(|&k| !keep(order[k])).unwrap_or(order.len());
            let range = first.saturating_sub(1)..=end.min(order.len() - 1);
            parts.extend(self.open(&order[range]));
            from = end;
        }
        parts
    }

    fn open(&self, nodes: &[usize]) -> Option<Self> {
        let path = Self {
            nodes: nodes.iter().map(|&k| self.nodes[k]).collect(),
            triangles: nodes.iter().map(|&k| self.triangles[k]).collect(),
            closed: false,
        };
        (path.nodes.len() >= 2).then_some(path)
    }

    /// The paths between its corners. Those that end at one go straight on for half of the width
    /// there, where the surface does: outside of a corner, the places nearest to the next pass are
    /// farther from it than its strip.
    pub(crate) fn between_corners(self, patch: &Patch, spacing: f64, width: impl Fn(u32) -> f64) -> Vec<Self> {
        let closed = self.closed;
        let mut parts = self.split_at_corners(spacing);
        let n_ends = if closed { parts.len() } else { parts.len() - 1 };
        for part in parts.iter_mut().take(n_ends).filter(|p| !p.closed && p.length() >= spacing) {
            let half = 0.5 * width(part.triangles[part.triangles.len() - 1]);
            if half > 0.0 {
                part.go_on(patch, spacing, half);
            }
        }
        parts
    }

    /// Goes straight on at its end, up to a crease.
    fn go_on(&mut self, patch: &Patch, spacing: f64, beyond: f64) {
        let n = self.nodes.len();
        let (end, triangle) = (self.nodes[n - 1], self.triangles[n - 1]);
        let normal = |t: u32| patch.facet_normal(t).map(Unit::into_inner);
        let Some(own) = normal(self.triangles[n - 2]) else { return };
        let is_smooth = |t: u32| normal(t).is_some_and(|n| n.dot(&own) >= CORNER_COS);
        // At a crease the path ends because no posture follows it.
        if !is_smooth(triangle) {
            return;
        }
        let is_far = |node: &&Point3<f64>| (end - **node).norm() >= spacing;
        let before = self.nodes.iter().rev().find(is_far).unwrap_or(&self.nodes[0]);
        let ahead = end - before;
        let Some(across) = Unit::try_new(ahead.cross(&own), 1e-9) else { return };
        let Some(walk) = SectionWalk::from_place(patch, triangle, end, across, &ahead) else { return };
        let mut from = (end, 0.0);
        for step in walk {
            if !is_smooth(step.triangle) {
                return;
            }
            let is_last = step.way >= beyond;
            let share = if is_last { (beyond - from.1) / (step.way - from.1) } else { 1.0 };
            self.nodes.push(from.0 + (step.position - from.0) * share);
            self.triangles.push(step.triangle);
            if is_last {
                return;
            }
            from = (step.position, step.way);
        }
    }

    fn split_at_corners(self, spacing: f64) -> Vec<Self> {
        let kept = self.spaced(spacing);
        let n = kept.len();
        let at = |k: usize| self.nodes[kept[k % n]];
        let is_corner = |k: usize| {
            let (before, after) = (at(k) - at(k + n - 1), at(k + 1) - at(k));
            before.dot(&after) < CORNER_COS * before.norm() * after.norm()
        };
        let inner = if self.closed { 0..n } else { 1..n.max(2) - 1 };
        let all = self.nodes.len();
        // The node of the path that is farthest around between the neighbours of a corner.
        let place = |k: usize| {
            let (from, to) = (kept[(k + n - 1) % n], kept[(k + 1) % n]);
            let way = |m: usize| {
                let node = self.nodes[m % all];
                (node - self.nodes[from]).norm() + (self.nodes[to] - node).norm()
            };
            let last = if to > from { to } else { to + all };
            (from + 1..last).max_by(|&a, &b| way(a).total_cmp(&way(b))).map_or(kept[k], |m| m % all)
        };
        let mut corners: Vec<usize> = inner.filter(|&k| n > 2 && is_corner(k)).map(place).collect();
        corners.sort_unstable();
        // Two at one bend are one, also where a closed path begins.
        let is_one = |a: usize, b: usize| (self.nodes[a] - self.nodes[b]).norm() < 0.5 * spacing;
        corners.dedup_by(|next, before| is_one(*next, *before));
        if self.closed && corners.len() > 1 && is_one(corners[0], corners[corners.len() - 1]) {
            corners.pop();
        }
        if corners.is_empty() {
            return vec![self];
        }
        let mut cuts = corners.clone();
        if self.closed {
            cuts.push(corners[0] + all);
        } else {
            cuts.insert(0, 0);
            cuts.push(all - 1);
        }
        let part = |w: &[usize]| self.open(&(w[0]..=w[1]).map(|k| k % all).collect::<Vec<_>>());
        cuts.windows(2).filter_map(part).collect()
    }
}

/// The curves on which a function is 0, with higher values on the left; `values` are those at the
/// vertices, and `exact` gives the value a share of the way along an edge.
pub(crate) fn trace_zero(
    patch: &Patch,
    values: &[f64],
    among: &[u32],
    exact: impl Fn([u32; 2], f64) -> f64,
) -> Vec<SurfacePath> {
    let mut paths = Vec::new();
    for curve in level_curves_among(&patch.mesh, &patch.edges, values, 0.0, among.iter().copied()) {
        let (mut nodes, mut triangles): (Vec<Point3<f64>>, Vec<u32>) = (Vec::new(), Vec::new());
        for point in &curve.points {
            let value = |t: f64| exact(point.edge, t);
            let ends = [value(0.0), value(1.0)];
            let crosses = (ends[0] >= 0.0) != (ends[1] >= 0.0);
            let t = if crosses { bracketed_root(value, ends) } else { point.fraction };
            let node = on_edge(patch, point.edge, t);
            if nodes.last() == Some(&node) {
                nodes.pop();
                triangles.pop();
            }
            nodes.push(node);
            triangles.push(point.triangle);
        }
        if nodes.len() >= if curve.closed { 3 } else { 2 } {
            paths.push(SurfacePath { nodes, triangles, closed: curve.closed });
        }
    }
    paths
}
