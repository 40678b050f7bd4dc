//! Motions in a binary tree over time, with bounds on where the cutter is in each part.

use facemill_cl_data::{Aabb, ClPoint};
use nalgebra::{Point3, Unit, Vector3};

use super::gauge::Gauge;
use crate::left::place::{CutterMotion, SurfacePlace};

/// A run of motions. At every time of it the cutter lies within the one at `middle`, moved by
/// λ·`half` with λ from −1 to 1, and dilated by `slack`.
struct Node {
    bounds: Aabb,
    middle: ClPoint,
    half: Vector3<f64>,
    slack: f64,
    /// First motion, and their number.
    first: u32,
    n: u32,
    /// Node of the second half; that of the first one follows this.
    second: u32,
}

pub(super) struct Tree {
    nodes: Vec<Node>,
}

/// Best height so far, and the motion that leaves it.
type Best = (f64, Option<usize>);

/// Least cosine of a pose's axis and a node's, from which on turns between motions stay within the
/// larger of their ends' turns.
const NEAR_AXES: f64 = 0.1;

impl Tree {
    pub(super) fn over(gauge: &Gauge, motions: &[CutterMotion]) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(2 * motions.len()) };
        if !motions.is_empty() {
            tree.add(gauge, motions, 0);
        }
        tree
    }

    /// Adds the node of these motions and all below it, and returns its index.
    fn add(&mut self, gauge: &Gauge, motions: &[CutterMotion], first: usize) -> u32 {
        let index = self.nodes.len();
        self.nodes.push(node(gauge, motions, first));
        if let [m] = motions {
            self.nodes[index].bounds = bounds(gauge, m);
            return index as u32;
        }
        let (a, b) = motions.split_at(motions.len() / 2);
        let low = self.add(gauge, a, first);
        let second = self.add(gauge, b, first + a.len());
        let both = self.nodes[low as usize].bounds.union(&self.nodes[second as usize].bounds);
        (self.nodes[index].bounds, self.nodes[index].second) = (both, second);
        index as u32
    }

    /// Visits all motions that may leave less on a place than the best so far, which `visit` makes
    /// better.
    pub(super) fn visit(
        &self,
        gauge: &Gauge,
        place: &SurfacePlace,
        best: &mut Best,
        visit: &mut impl FnMut(usize, &mut Best),
    ) {
        // Each with its bound, and the height for which this holds.
        let mut open: Vec<(u32, f64, f64)> = Vec::with_capacity(64);
        let bound = |k: u32, best: f64| self.nodes[k as usize].distance_over(gauge, place, best);
        if !self.nodes.is_empty() {
            open.push((0, bound(0, best.0), best.0));
        }
        while let Some((k, distance, height)) = open.pop() {
            let node = &self.nodes[k as usize];
            if distance > 0.0 || (height != best.0 && bound(k, best.0) > 0.0) {
                continue;
            }
            if node.n == 1 {
                visit(node.first as usize, best);
                continue;
            }
            let children = [k + 1, node.second].map(|c| (c, bound(c, best.0), best.0));
            let [near, far] = if children[0].1 <= children[1].1 { [0, 1] } else { [1, 0] };
            open.extend([children[far], children[near]].into_iter().filter(|(_, distance, _)| *distance <= 0.0));
        }
    }
}

impl Node {
    /// Lower bound on the distance of the cutter, at all times of the node, from all points up to
    /// `height` over a place; of 0 or less where it may be nearer, and the less the nearer it may
    /// be.
    fn distance_over(&self, gauge: &Gauge, place: &SurfacePlace, height: f64) -> f64 {
        let top = place.position + place.normal.into_inner() * height;
        if !meets(&self.bounds, &place.position, &top) {
            return f64::INFINITY;
        }
        // A convex function is nowhere below its tangent plane.
        let (distance, outward) = gauge.beyond(&self.middle, &top);
        if distance == 0.0 {
            return -self.slack - self.half.norm();
        }
        let toward_place = height * outward.dot(&place.normal).max(0.0);
        distance - toward_place - outward.dot(&self.half).abs() - self.slack - ROUNDING
    }
}

/// Returns whether a box meets the smallest box around two points. Most nodes are passed over by
/// this alone.
#[inline(always)]
fn meets(bounds: &Aabb, a: &Point3<f64>, b: &Point3<f64>) -> bool {
    (0..3).all(|k| bounds.min[k] <= a[k].max(b[k]) && a[k].min(b[k]) <= bounds.max[k])
}

/// Rounding of distances, mm.
const ROUNDING: f64 = 1e-9;

/// Bounds of a single motion: between its ends the axis, and so each end of the flute, strays from
/// its chord by less than its turn squared times the length.
fn bounds(gauge: &Gauge, m: &CutterMotion) -> Aabb {
    let chord = (m.to.axis.into_inner() - m.from.axis.into_inner()).norm();
    gauge.aabb(&m.from).union(&gauge.aabb(&m.to)).dilated(gauge.reach() * chord * chord + ROUNDING)
}

fn node(gauge: &Gauge, motions: &[CutterMotion], first: usize) -> Node {
    let ends = [motions[0].from.tip, motions[motions.len() - 1].to.tip];
    let half = (ends[1] - ends[0]) * 0.5;
    let tip = ends[0] + half;
    let at = motions[motions.len() / 2];
    let axis = Unit::try_new(at.from.axis.into_inner() + at.to.axis.into_inner(), 0.5).unwrap_or(at.from.axis);
    let mut slack = 0.0_f64;
    for pose in motions.iter().flat_map(|m| [m.from, m.to]) {
        let cos = pose.axis.dot(&axis);
        let turned = gauge.reach() * (pose.axis.into_inner() - axis.into_inner()).norm();
        let beside = beside(&(pose.tip - tip), &half);
        slack = slack.max(if cos < NEAR_AXES { f64::INFINITY } else { beside + turned });
    }
    Node {
        bounds: Aabb::EMPTY,
        middle: ClPoint { tip, axis },
        half,
        slack,
        first: first as u32,
        n: motions.len() as u32,
        second: 0,
    }
}

/// Distance of a point from the line's part from −`half` to `half`.
fn beside(point: &Vector3<f64>, half: &Vector3<f64>) -> f64 {
    let length_sq = half.norm_squared();
    let share = if length_sq > 0.0 { (point.dot(half) / length_sq).clamp(-1.0, 1.0) } else { 0.0 };
    (Point3::from(*point) - Point3::from(half * share)).norm()
}
