use std::collections::VecDeque;

use nalgebra::{Point3, Unit, Vector3};

use crate::layout::offset::corner_normals::CornerNormals;
use crate::layout::section_walk::SectionWalk;

/// Section of a patch across an edge: way and turn of the normal, convex turns rising.
///
/// It is walked as far as its windows need.
pub(crate) struct RidgeProfile<'a> {
    normals: &'a CornerNormals<'a>,
    nodes: VecDeque<ProfileNode>,
    ahead: HalfWalk<'a>,
    behind: HalfWalk<'a>,
}

#[derive(Clone, Copy, Debug)]
struct ProfileNode {
    /// Way from the middle, mm.
    way: f64,
    /// Turn of the normal in the plane of the section since the middle, rad.
    turn: f64,
    position: Point3<f64>,
    /// The triangle behind the node, toward the end.
    triangle: u32,
}

/// Walk from the middle of a profile to one side.
struct HalfWalk<'a> {
    walk: SectionWalk<'a>,
    /// Axis about which convex turns are positive.
    axis: Vector3<f64>,
    /// Vector along the normal where it is.
    normal: Vector3<f64>,
    /// Side of a triangle that it has come through, with the share of the way along it.
    entry: Option<([u32; 2], f64)>,
    way: f64,
    turn: f64,
    position: Point3<f64>,
}

/// Where a profile bends most.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RidgePlace {
    pub(crate) position: Point3<f64>,
    pub(crate) triangle: u32,
    /// Way from the middle of the profile, mm.
    pub(crate) way: f64,
    /// Turn within the window, rad.
    pub(crate) turn: f64,
    /// Whether the windows searched turn less on both sides.
    pub(crate) is_top: bool,
    /// Whether the profile goes on for two windows on both sides.
    pub(crate) is_whole: bool,
}

/// Nodes that most profiles have room in.
const USUAL_NODES: usize = 128;

/// Steps of half a window in which windows are tried.
const HALF_STEPS: i32 = 8;

/// Steps in which windows are tried, as a share of their length.
const STEP: f64 = 0.5 / HALF_STEPS as f64;

/// The middle of a ridge is searched so many steps to both sides of the profile's: 4 windows.
const SEARCHED: i32 = 8 * HALF_STEPS;

/// The windows that a ridge is compared with begin and end so many windows from it.
const BESIDE: [f64; 2] = [3.0, 4.0];

/// Profiles that end nearer than so many windows to a ridge are cut off by a border.
const WHOLE: f64 = 2.0;

/// Largest turn of a window beside a ridge, as a share of the ridge's.
const FLATTER: f64 = 0.5;

/// Windows with at least this share of the largest turn are the top of a ridge; its middle is the
/// ridge. Larger: the faceting of the mesh decides. Smaller: what is beside the ridge does.
const TOP: f64 = 0.9;

impl<'a> RidgeProfile<'a> {
    /// The section by the plane at right angles to `along` through a place of a triangle; `None`
    /// where there is none.
    pub(crate) fn at(
        normals: &'a CornerNormals<'a>,
        triangle: u32,
        place: Point3<f64>,
        along: &Unit<Vector3<f64>>,
    ) -> Option<Self> {
        let patch = normals.patch();
        let normal = patch.normal(triangle, &place);
        let across = normal.cross(along);
        let half = |toward: Vector3<f64>, axis: Vector3<f64>| {
            let walk = SectionWalk::from_place(patch, triangle, place, *along, &toward)?;
            let normal = normal.into_inner();
            Some(HalfWalk { walk, axis, normal, entry: None, way: 0.0, turn: 0.0, position: place })
        };
        let axis = along.into_inner();
        let (ahead, behind) = (half(across, -axis)?, half(-across, axis)?);
        let middle = ProfileNode { way: 0.0, turn: 0.0, position: place, triangle };
        let mut nodes = VecDeque::with_capacity(USUAL_NODES);
        nodes.push_back(middle);
        Some(Self { normals, nodes, ahead, behind })
    }

    /// Walks on until the profile reaches so far, mm, or ends.
    fn reach(&mut self, way: f64) {
        while self.ahead.way <= way {
            let Some(nodes) = self.ahead.next_nodes(self.normals) else { break };
            self.nodes.extend(nodes);
        }
        while self.behind.way <= way {
            let Some(nodes) = self.behind.next_nodes(self.normals) else { break };
            for node in nodes {
                self.nodes.push_front(ProfileNode { way: -node.way, turn: -node.turn, ..node });
            }
        }
        self.nodes.make_contiguous();
    }

    fn nodes(&self) -> &[ProfileNode] {
        self.nodes.as_slices().0
    }

    /// The turn within a window about a way.
    fn window_turn(&self, middle: f64, window: f64) -> f64 {
        turn_at(self.nodes(), middle + 0.5 * window) - turn_at(self.nodes(), middle - 0.5 * window)
    }

    /// The middle of the windows of this length that turn most; `None` of a profile without length.
    pub(crate) fn sharpest(&mut self, window: f64) -> Option<RidgePlace> {
        self.reach(f64::from(SEARCHED + HALF_STEPS) * STEP * window);
        let nodes = self.nodes();
        if nodes.len() < 2 {
            return None;
        }
        let way_of = |steps: f64| steps * STEP * window;
        let turns = turns_of_windows(nodes, window);
        let best = (0..turns.len()).max_by(|&a, &b| turns[a].total_cmp(&turns[b]))?;
        let top = TOP * turns[best];
        let first = (0..best).rev().find(|&k| turns[k] < top);
        let last = (best..turns.len()).find(|&k| turns[k] < top);
        let steps = |k: usize| k as f64 - f64::from(SEARCHED);
        // Where the turn reaches the top between two steps; at a crease it jumps.
        let border = |below: usize, above: usize| {
            let (mut low, mut high) = (steps(below), steps(above));
            let ends = [-0.5 * window, 0.5 * window].map(|end| {
                let ways = [way_of(low.min(high)) + end, way_of(low.max(high)) + end];
                (between(nodes, ways), end)
            });
            for _ in 0..20 {
                let middle = 0.5 * (low + high);
                let [from, to] = ends.map(|(nodes, end)| turn_at(nodes, way_of(middle) + end));
                if to - from < top { low = middle } else { high = middle }
            }
            high
        };
        let from = first.map_or(steps(0), |k| border(k, k + 1));
        let to = last.map_or(steps(turns.len() - 1), |k| border(k, k - 1));
        let way = way_of(0.5 * (from + to));
        let is_whole = nodes[0].way <= way - WHOLE * window && nodes[nodes.len() - 1].way >= way + WHOLE * window;
        let k = after(nodes, way);
        let (a, b) = (&nodes[k - 1], &nodes[k]);
        let share = if b.way > a.way { ((way - a.way) / (b.way - a.way)).clamp(0.0, 1.0) } else { 1.0 };
        // Behind the middle, a node's triangle is the one toward the beginning.
        let triangle = if way < 0.0 { a.triangle } else { b.triangle };
        Some(RidgePlace {
            position: a.position + (b.position - a.position) * share,
            triangle,
            way,
            turn: turns[best],
            is_top: first.is_some() && last.is_some(),
            is_whole,
        })
    }

    /// Whether windows beside a ridge turn much less; those beyond the ends of the profile are not
    /// known, but one has to be.
    pub(crate) fn is_flatter_beside(&mut self, place: &RidgePlace, window: f64) -> bool {
        let RidgePlace { way, turn, .. } = *place;
        self.reach(way.abs() + BESIDE[1] * window);
        let nodes = self.nodes();
        let (first, last) = (nodes[0].way, nodes[nodes.len() - 1].way);
        let middle = 0.5 * (BESIDE[0] + BESIDE[1]) * window;
        let known = [way - middle, way + middle].into_iter().filter(|&m| m > first && m < last);
        let beside: Vec<f64> = known.map(|m| self.window_turn(m, (BESIDE[1] - BESIDE[0]) * window)).collect();
        !beside.is_empty() && beside.iter().all(|t| *t <= FLATTER * turn)
    }
}

impl HalfWalk<'_> {
    /// The nodes before and behind the next triangle: at a crease the normal jumps from triangle to
    /// triangle.
    fn next_nodes(&mut self, normals: &CornerNormals) -> Option<[ProfileNode; 2]> {
        let step = self.walk.next()?;
        let entering = match self.entry {
            Some((edge, share)) => normals.on_edge(step.triangle, edge, share, &self.position),
            None => self.normal,
        };
        let leaving = normals.on_edge(step.triangle, step.edge, step.share, &step.position);
        if entering != self.normal {
            self.turn += turn_about(&self.axis, &self.normal, &entering);
        }
        let (way, turn, position, triangle) = (self.way, self.turn, self.position, step.triangle);
        self.turn += turn_about(&self.axis, &entering, &leaving);
        (self.way, self.position) = (step.way, step.position);
        (self.normal, self.entry) = (leaving, Some((step.edge, step.share)));
        let behind = ProfileNode { way: self.way, turn: self.turn, position: self.position, triangle };
        Some([ProfileNode { way, turn, position, triangle }, behind])
    }
}

/// The node behind a way, but for the first.
fn after(nodes: &[ProfileNode], way: f64) -> usize {
    nodes.partition_point(|n| n.way <= way).clamp(1, nodes.len() - 1)
}

/// The nodes around some ways, in rising order.
fn between(nodes: &[ProfileNode], [from, to]: [f64; 2]) -> &[ProfileNode] {
    &nodes[after(nodes, from) - 1..=after(nodes, to)]
}

/// The turn up to a way; that of the end beyond it.
fn turn_at(nodes: &[ProfileNode], way: f64) -> f64 {
    turn_before(nodes, after(nodes, way), way)
}

/// The turn up to a way before a node.
fn turn_before(nodes: &[ProfileNode], k: usize, way: f64) -> f64 {
    let (a, b) = (&nodes[k - 1], &nodes[k]);
    if b.way > a.way { a.turn + (b.turn - a.turn) * ((way - a.way) / (b.way - a.way)).clamp(0.0, 1.0) } else { b.turn }
}

/// The turn within each of the windows that are searched, in one sweep over the nodes.
fn turns_of_windows(nodes: &[ProfileNode], window: f64) -> Vec<f64> {
    let ends = SEARCHED + HALF_STEPS;
    let mut k = 1;
    let up_to = (-ends..=ends).map(|steps| {
        let way = f64::from(steps) * STEP * window;
        while k + 1 < nodes.len() && nodes[k].way <= way {
            k += 1;
        }
        turn_before(nodes, k, way)
    });
    let up_to: Vec<f64> = up_to.collect();
    let window = 2 * HALF_STEPS as usize;
    (window..up_to.len()).map(|k| up_to[k] - up_to[k - window]).collect()
}

/// Signed turn from one direction to another about an axis, rad; the directions of any length.
pub(crate) fn turn_about(axis: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    from.cross(to).dot(axis).atan2(from.dot(to))
}

#[cfg(test)]
#[path = "../../../tests/unit/layout/offset/ridge_profile.rs"]
mod tests;
