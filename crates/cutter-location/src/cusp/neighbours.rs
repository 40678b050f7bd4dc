//! Finds the passes beside a point of a pass, in the plane across its feed.

mod crosses;
mod curvature_along;
mod ends;
mod nearest_crossings;
mod section;

use std::cell::Cell;

use facemill_cl_data::{Aabb, CcPoint};
use facemill_surface_model::{Below, NodeId, Tree};
use facemill_tool_model::FeedCurvature;

use crate::cusp::cut_point::{CutPoint, Strip};
use crate::cusp::neighbours::curvature_along::curvatures_along;
use crate::cusp::neighbours::ends::{BesideEnd, continued};
use crate::cusp::neighbours::nearest_crossings::NearestCrossings;
use crate::cusp::neighbours::section::section_crossing;

/// A pass, or part of one, among others.
#[derive(Clone, Debug, PartialEq)]
pub struct CutPass {
    /// Its points in cutting order.
    pub points: Vec<CutPoint>,
    /// Whether the uncut stock lies to the left of its feed.
    pub uncut_left: bool,
}

/// How far from a point a pass counts as beside it, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeighbourReach {
    /// Distance to any pass. Larger: wider strips that stay uncut are seen.
    pub far: f64,
    /// Distance to a pass whose uncut stock is on the same side as the point's, seen from the strip
    /// between both. Then either the file gives the wrong side for one of them, or the area between
    /// is not one strip, as between both arms of a hairpin.
    pub opposed: f64,
}

/// Passes in cutting order, which can be queried for the neighbours of a point.
#[derive(Clone, Debug)]
pub struct Neighbours {
    passes: Vec<CutPass>,
    /// Pass of each segment, and the number of its first point.
    segments: Vec<[u32; 2]>,
    /// Box of each segment.
    boxes: Vec<Aabb>,
    /// Curvature of the surface along each segment, and its twist; nothing across.
    curvatures: Vec<FeedCurvature>,
    tree: Tree,
    /// Pass of each end, and whether it is the first point.
    ends: Vec<(u32, bool)>,
    end_tree: Tree,
    reach: NeighbourReach,
}

/// A point of one of the passes, by number of the pass and of the point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnPlace {
    /// Number of the pass.
    pub pass: usize,
    /// Number of the point.
    pub point: usize,
}

/// A pass beside a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Where the plane across the point's feed meets the pass, with the posture of the nearer of
    /// the two points around; the end of the pass where it ends beside the point.
    pub point: CutPoint,
    /// The surface between the point and the pass.
    pub strip: Strip,
    /// Arc length in the plane, mm: more than the step-over where both feeds diverge.
    pub arc: f64,
    /// Whether it lies to the left of the feed.
    pub is_left: bool,
    /// Whether it is cut before the point.
    pub is_earlier: bool,
}

/// Neighbours of a point: index 0 to the right of its feed, 1 to the left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Beside {
    /// The nearest pass.
    pub nearest: [Option<Neighbour>; 2],
    /// The nearest pass among those that are cut before.
    pub earlier: [Option<Neighbour>; 2],
}

impl Beside {
    /// Returns the passes toward which this point's pass leaves a ridge: the nearest ones, where
    /// they are cut before. A pass that is cut later leaves the ridge itself.
    pub fn before(&self) -> impl Iterator<Item = &Neighbour> {
        self.nearest.iter().flatten().filter(|n| n.is_earlier)
    }

    /// Returns the strip that decides this point's posture: the widest toward a pass cut before,
    /// else the narrowest toward one cut later.
    pub fn strip(&self) -> Option<Strip> {
        let widest = |a: Strip, b: Strip| if b.step_over > a.step_over { b } else { a };
        let narrowest = |a: Strip, b: Strip| if b.step_over < a.step_over { b } else { a };
        let before = self.before().map(|n| n.strip).reduce(widest);
        before.or_else(|| self.nearest.iter().flatten().map(|n| n.strip).reduce(narrowest))
    }

    /// Returns the curvature of the surface across the feed, toward the nearest pass.
    pub fn curvature(&self) -> Option<f64> {
        let nearer = |a: Strip, b: Strip| if b.step_over < a.step_over { b } else { a };
        self.nearest.iter().flatten().map(|n| n.strip).reduce(nearer).map(|strip| strip.curvature.across)
    }
}

/// A crossing nearer than this, mm, is the point itself or belongs to a pass that is cut again.
const SAME_POINT: f64 = 1e-6;

/// Least cosine between both feeds: passes that cross at more than 60° leave no strip between them.
const LEAST_ALONG: f64 = 0.5;

/// Largest difference between the sines of the chord's angles to the two tangent planes: on a
/// circle they are equal. Two places are on different walls if one is 0.4 chords further above the
/// other's tangent plane than their normals explain.
const LARGEST_STEP: f64 = 0.8;

/// Largest distance before the plane at which a pass may end and still be beside the point, as a
/// multiple of the distance aside: on the diagonal in between, halfway to a pass twice as far, it
/// cuts as little as that pass.
const LARGEST_GAP: f64 = 1.0;

impl Neighbours {
    /// Collects the passes of one place, in cutting order.
    pub fn new(passes: Vec<CutPass>, reach: NeighbourReach) -> Self {
        let mut segments = Vec::new();
        let (mut boxes, mut curvatures) = (Vec::new(), Vec::new());
        for (pass, of) in passes.iter().enumerate() {
            curvatures.extend(curvatures_along(&of.points));
            for (k, pair) in of.points.windows(2).enumerate() {
                segments.push([pass as u32, k as u32]);
                let [a, b] = [&pair[0].cc, &pair[1].cc];
                // A curve with these feeds at its ends may bulge by this much.
                let bulge = 0.25 * (b.position - a.position).norm() * (1.0 - a.feed.dot(&b.feed)).max(0.0).sqrt();
                boxes.push(Aabb::of_points([&a.position, &b.position]).dilated(bulge));
            }
        }
        let of_pass = |pass: usize| [(pass as u32, true), (pass as u32, false)];
        let ends: Vec<(u32, bool)> =
            (0..passes.len()).filter(|&pass| passes[pass].points.len() > 1).flat_map(of_pass).collect();
        let place = |&(pass, is_first): &(u32, bool)| {
            let points = &passes[pass as usize].points;
            points[if is_first { 0 } else { points.len() - 1 }].cc.position
        };
        let end_boxes: Vec<Aabb> = ends.iter().map(|end| Aabb::of_points([&place(end)])).collect();
        let (tree, end_tree) = (Tree::build(&boxes), Tree::build(&end_boxes));
        Self { tree, end_tree, passes, segments, boxes, curvatures, ends, reach }
    }

    /// Returns the passes as they were given.
    pub fn passes(&self) -> &[CutPass] {
        &self.passes
    }

    /// Returns the neighbours of a point of one of the passes: earlier passes, and its own up to
    /// it, are cut before.
    pub fn of(&self, at: OwnPlace) -> Beside {
        self.find(&self.passes[at.pass].points[at.point], Some(at))
    }

    /// Returns the neighbours of a point of another pass, which is cut after all of these.
    pub fn beside(&self, own: &CutPoint) -> Beside {
        self.find(own, None)
    }

    /// Returns whether any earlier pass comes within a distance of a point of one of the passes, in
    /// any direction.
    pub fn is_near_earlier(&self, at: OwnPlace, distance: f64) -> bool {
        let position = self.passes[at.pass].points[at.point].cc.position;
        let near = |b: &Aabb| b.distance_sq(&position) <= distance * distance;
        let earlier = |k: u32| (self.segments[k as usize][0] < at.pass as u32).then_some(());
        self.tree.find_in_boxes(near, earlier).is_some()
    }

    fn find(&self, own: &CutPoint, at: Option<OwnPlace>) -> Beside {
        let mut found = NearestCrossings::default();
        let farthest = Cell::new(self.reach.far);
        self.visit_crossing(&own.cc, &farthest, |k| {
            let [pass, segment] = self.segments[k as usize].map(|n| n as usize);
            let is_own = at.filter(|at| at.pass == pass);
            // The segments at the point itself cross the plane there.
            if is_own.is_some_and(|at| segment == at.point || segment + 1 == at.point) {
                return;
            }
            let points = &self.passes[pass].points;
            let crossing = section_crossing(&own.cc, [&points[segment], &points[segment + 1]]);
            let along = &self.curvatures[k as usize];
            let Some(crossing) = crossing.and_then(|point| self.neighbour(own, point, along)) else { return };
            let distance = (crossing.point.cc.position - own.cc.position).norm();
            if at.is_some_and(|at| self.is_apart(at, (pass, &crossing), distance)) {
                return;
            }
            found.take(distance, Neighbour { is_earlier: is_earlier(at, pass, segment), ..crossing });
            farthest.set(found.farthest(self.reach.far));
        });
        found.take_ends(&self.ends_beside(own, at, farthest.get()));
        found.beside()
    }

    /// Calls `visit` with the segments whose boxes the plane across a feed meets no farther than
    /// `farthest` from its point, which `visit` makes less: the nearer parts of the tree first.
    fn visit_crossing(&self, cc: &CcPoint, farthest: &Cell<f64>, mut visit: impl FnMut(u32)) {
        let met = |b: &Aabb| (plane_distance(cc, b) <= SAME_POINT).then(|| b.distance_sq(&cc.position));
        let is_near = |distance_sq: f64| distance_sq <= farthest.get() * farthest.get();
        let of_node = |node: NodeId| met(self.tree.node_aabb(node)).map(|distance_sq| (node, distance_sq));
        let mut pending: Vec<(NodeId, f64)> = self.tree.root().and_then(of_node).into_iter().collect();
        while let Some((node, distance_sq)) = pending.pop() {
            if !is_near(distance_sq) {
                continue;
            }
            match self.tree.below(node) {
                Below::Nodes(a, b) => {
                    let (a, b) = (of_node(a), of_node(b));
                    let is_b_nearer = matches!((a, b), (Some((_, to_a)), Some((_, to_b))) if to_b < to_a);
                    let nearer_last = if is_b_nearer { [a, b] } else { [b, a] };
                    pending.extend(nearer_last.into_iter().flatten());
                }
                Below::Items(segments) => {
                    let near = segments.iter().filter(|&&k| met(&self.boxes[k as usize]).is_some_and(is_near));
                    near.for_each(|&k| visit(k));
                }
            }
        }
    }

    /// Passes that end beside a point, within a distance.
    fn ends_beside(&self, own: &CutPoint, at: Option<OwnPlace>, within: f64) -> Vec<BesideEnd> {
        let enter =
            |b: &Aabb| plane_distance(&own.cc, b) <= within && b.distance_sq(&own.cc.position) <= 2.0 * within * within;
        let mut found = Vec::new();
        self.end_tree.visit_boxes(enter, |k| found.extend(self.end_beside(own, at, self.ends[k as usize])));
        found
    }

    fn end_beside(&self, own: &CutPoint, at: Option<OwnPlace>, (pass, is_first): (u32, bool)) -> Option<BesideEnd> {
        let pass = pass as usize;
        let points = &self.passes[pass].points;
        let last = points.len() - 1;
        let end = if is_first { &points[0] } else { &points[last] };
        // The segments of a pass follow each other.
        let of_pass = self.segments.partition_point(|s| s[0] < pass as u32);
        let along = &self.curvatures[of_pass + if is_first { 0 } else { last - 1 }];
        let there = self.neighbour(own, continued(&own.cc, points, is_first)?, along)?;
        let aside = (there.point.cc.position - own.cc.position).norm();
        let ahead = own.cc.feed.dot(&(end.cc.position - own.cc.position));
        if ahead.abs() > LARGEST_GAP * aside || at.is_some_and(|at| self.is_apart(at, (pass, &there), aside)) {
            return None;
        }
        let is_at_own_end = at.is_some_and(|at| {
            let points = &self.passes[at.pass].points;
            let own_end = if ahead > 0.0 { points.first() } else { points.last() };
            own_end.is_some_and(|end| (end.cc.position - own.cc.position).norm() < aside)
        });
        let is_earlier = is_earlier(at, pass, if is_first { 0 } else { last });
        Some(BesideEnd {
            neighbour: Neighbour { point: *end, is_earlier, ..there },
            aside,
            gap: ahead.abs(),
            is_at_own_end,
        })
    }

    /// Returns whether a crossing is rejected because of the sides on which both passes have their
    /// uncut stock: two arms of the same pass, or passes that are far apart, have it on different
    /// sides of the strip between.
    fn is_apart(&self, at: OwnPlace, (pass, crossing): (usize, &Neighbour), distance: f64) -> bool {
        let own = &self.passes[at.pass];
        let cc = &own.points[at.point].cc;
        let other = &crossing.point.cc;
        let seen_left = other.left().dot(&(cc.position - other.position)) > 0.0;
        let opposed = (crossing.is_left == own.uncut_left) == (seen_left == self.passes[pass].uncut_left);
        opposed && (pass == at.pass || distance > self.reach.opposed)
    }

    /// Returns a place of another pass in the plane across the feed as a neighbour; `None` where it
    /// is not one. `along` is the curvature of the surface along that pass.
    fn neighbour(&self, own: &CutPoint, point: CutPoint, along: &FeedCurvature) -> Option<Neighbour> {
        let between = point.cc.position - own.cc.position;
        let chord = between.norm();
        let aligned = own.cc.feed.dot(&point.cc.feed).abs();
        if chord <= SAME_POINT || chord > self.reach.far || aligned < LEAST_ALONG {
            return None;
        }
        let leaves = -own.cc.normal.dot(&between) / chord;
        let arrives = point.cc.normal.dot(&between) / chord;
        // Within one strip the normals turn by less than a right angle, and the chord leaves both
        // tangent planes at the same angle.
        if own.cc.normal.dot(&point.cc.normal) <= 0.0 || (arrives - leaves).abs() > LARGEST_STEP {
            return None;
        }
        // Normals of a convex surface spread apart.
        let across = (arrives + leaves) / chord;
        let half_turn = 0.5 * chord * across;
        let arc = if half_turn.abs() < 1e-6 { chord } else { 2.0 * half_turn.clamp(-1.0, 1.0).asin() / across };
        // Two diverging lines are as far apart as measured across the middle between them.
        let step_over = arc * aligned / (0.5 * (1.0 + aligned)).sqrt();
        let is_left = own.cc.left().dot(&between) > 0.0;
        let curvature = FeedCurvature { across, ..*along };
        Some(Neighbour { point, strip: Strip { step_over, curvature }, arc, is_left, is_earlier: true })
    }
}

/// Returns whether a point or segment of a pass is cut before a point of one of the passes.
fn is_earlier(at: Option<OwnPlace>, pass: usize, place: usize) -> bool {
    at.is_none_or(|at| pass < at.pass || (pass == at.pass && place < at.point))
}

/// Distance of a box from the plane through a point across its feed; 0 where it meets it.
fn plane_distance(cc: &CcPoint, b: &Aabb) -> f64 {
    let (center, half) = (nalgebra::center(&b.min, &b.max), 0.5 * (b.max - b.min));
    let reaches = cc.feed.x.abs() * half.x + cc.feed.y.abs() * half.y + cc.feed.z.abs() * half.z;
    (cc.feed.dot(&(center - cc.position)).abs() - reaches).max(0.0)
}
