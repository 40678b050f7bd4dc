//! Heights of a cutter's outline from a table: many heights of the same outline for little more
//! than the points of the table.

use std::f64::consts::FRAC_PI_2;

use facemill_tool_model::Outline;

/// Heights of an outline over the lateral coordinate, by cubics through its points with its slopes.
///
/// The error of heights is less than 1e-4 mm, or, where the outline is steep, less than its rise
/// over 1e-4 of its width.
pub(crate) struct OutlineTable {
    /// By y.
    nodes: Vec<Node>,
}

#[derive(Clone, Copy)]
struct Node {
    phi: f64,
    y: f64,
    z: f64,
    /// dz/dy; infinite at vertical ends.
    slope: f64,
}

/// Points are no farther apart than this fraction of the outline's width, except for the ends of
/// straight pieces.
const WIDTH_PARTS: f64 = 64.0;

/// Largest turn of the normal between points, rad, where the outline is level; less where it is
/// steep.
const TURN: f64 = 0.05;

/// Smallest distance of points at vertical ends, as a fraction of the width.
const AT_ENDS: f64 = 1e-7;

/// Halvings of the outline between points: a straight piece has no normals between those of its
/// ends.
const MAX_HALVINGS: u32 = 24;

impl OutlineTable {
    /// Tabulates an outline, densely over a range of y; beyond it heights are rough.
    pub(crate) fn new(outline: &Outline, range: (f64, f64)) -> Self {
        let node = |phi: f64| {
            let p = outline.point_at(phi);
            let slope = if phi.abs() < FRAC_PI_2 { phi.tan() } else { f64::INFINITY };
            Node { phi, y: p.x, z: p.y, slope }
        };
        let (first, last) = (node(-FRAC_PI_2), node(FRAC_PI_2));
        let width = last.y - first.y;
        let is_dense = |a: &Node, b: &Node| {
            let (apart, turn) = (b.y - a.y, b.phi - a.phi);
            let steep = FRAC_PI_2 - a.phi.abs().max(b.phi.abs());
            let is_outside = b.y < range.0 || range.1 < a.y;
            let at_end = !(a.slope.is_finite() && b.slope.is_finite());
            is_outside
                || apart.hypot(b.z - a.z) <= width / WIDTH_PARTS
                    && if at_end { apart <= AT_ENDS * width } else { turn <= TURN.min(STEEP_SHARE * steep) }
        };
        let mut nodes = vec![first];
        // Open stretches, the nearest last.
        let mut open = vec![(last, 0)];
        let mut at = first;
        while let Some(&(next, halvings)) = open.last() {
            if halvings >= MAX_HALVINGS || is_dense(&at, &next) {
                nodes.push(next);
                at = next;
                open.pop();
            } else {
                open.pop();
                open.push((next, halvings + 1));
                open.push((node(0.5 * (at.phi + next.phi)), halvings + 1));
            }
        }
        Self { nodes }
    }

    /// Returns the lowest z of the outline at y, mm; `None` outside its extent.
    pub(crate) fn height_at(&self, y: f64) -> Option<f64> {
        let k = self.nodes.partition_point(|n| n.y < y);
        let b = self.nodes.get(k)?;
        let Some(a) = k.checked_sub(1).map(|k| &self.nodes[k]) else { return (y == b.y).then_some(b.z) };
        let span = b.y - a.y;
        let t = (y - a.y) / span;
        let chord = (b.z - a.z) / span;
        let straight = a.z + t * (b.z - a.z);
        let bend = if a.slope.is_finite() && b.slope.is_finite() {
            t * (1.0 - t) * span * ((1.0 - t) * (a.slope - chord) - t * (b.slope - chord))
        } else {
            0.0
        };
        Some(straight + bend)
    }
}

/// Turn between points as a fraction of the angle to vertical.
const STEEP_SHARE: f64 = 0.25;

#[cfg(test)]
#[path = "../tests/unit/outline_table.rs"]
mod tests;
