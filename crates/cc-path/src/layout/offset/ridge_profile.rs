use nalgebra::{Point3, Unit, Vector3};

use crate::layout::offset::section_walk::SectionWalk;
use crate::strategy::patch::Patch;

/// Section of a patch across an edge: way and turn of the normal, convex turns rising.
pub(crate) struct RidgeProfile {
    nodes: Vec<ProfileNode>,
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

/// Where a profile bends most.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RidgePlace {
    pub(crate) position: Point3<f64>,
    pub(crate) triangle: u32,
    /// Way from the middle of the profile, mm.
    pub(crate) way: f64,
    /// Turn within the window, rad.
    pub(crate) turn: f64,
    /// Whether the surface bends much less on both sides.
    pub(crate) stands_out: bool,
    /// Whether the profile goes on for two windows on both sides.
    pub(crate) is_whole: bool,
}

/// Profiles reach so many windows to both sides.
const REACH: f64 = 8.0;

/// The middle of a ridge is searched so many windows to both sides of the profile's.
const SEARCHED: f64 = 4.0;

/// The windows that a ridge is compared with begin and end so many windows from it.
const BESIDE: [f64; 2] = [3.0, 4.0];

/// Profiles that end nearer than so many windows to a ridge are cut off by a border.
const WHOLE: f64 = 2.0;

/// Largest turn of a window beside a ridge, as a share of the ridge's.
const FLATTER: f64 = 0.5;

/// Windows with at least this share of the largest turn are the top of a ridge; its middle is the
/// ridge. Larger: the faceting of the mesh decides. Smaller: what is beside the ridge does.
const TOP: f64 = 0.9;

/// Steps in which windows are tried, as a share of their length.
const STEP: f64 = 1.0 / 16.0;

impl RidgeProfile {
    /// The section by the plane at right angles to `along` through a place of a triangle, as far as
    /// windows of this length (mm) need; `None` where there is none.
    pub(crate) fn of(
        patch: &Patch,
        triangle: u32,
        place: Point3<f64>,
        along: &Unit<Vector3<f64>>,
        window: f64,
    ) -> Option<Self> {
        let normal = patch.normal(triangle, &place);
        let across = normal.cross(along);
        let half = |toward: Vector3<f64>, axis: Vector3<f64>| {
            let mut nodes = vec![ProfileNode { way: 0.0, turn: 0.0, position: place, triangle }];
            let walk = SectionWalk::from_place(patch, triangle, place, *along, &toward)?;
            let mut last = normal;
            for step in walk {
                let before = nodes[nodes.len() - 1];
                // At a crease the normal jumps from triangle to triangle.
                let entering = patch.normal(step.triangle, &before.position);
                let leaving = patch.normal(step.triangle, &step.position);
                let jump = before.turn + turn_about(&axis, &last, &entering);
                let turn = jump + turn_about(&axis, &entering, &leaving);
                nodes.push(ProfileNode { turn: jump, triangle: step.triangle, ..before });
                nodes.push(ProfileNode { way: step.way, turn, position: step.position, triangle: step.triangle });
                last = leaving;
                if step.way > REACH * window {
                    break;
                }
            }
            Some(nodes)
        };
        let axis = along.into_inner();
        let (ahead, behind) = (half(across, -axis)?, half(-across, axis)?);
        let turned = |n: ProfileNode| ProfileNode { way: -n.way, turn: -n.turn, ..n };
        let nodes = behind.into_iter().skip(1).rev().map(turned).chain(ahead).collect();
        Some(Self { nodes })
    }

    /// The turn up to a way; that of the end beyond it.
    fn turn_at(&self, way: f64) -> f64 {
        let k = self.after(way);
        let (a, b) = (&self.nodes[k - 1], &self.nodes[k]);
        if b.way > a.way {
            a.turn + (b.turn - a.turn) * ((way - a.way) / (b.way - a.way)).clamp(0.0, 1.0)
        } else {
            b.turn
        }
    }

    fn after(&self, way: f64) -> usize {
        self.nodes.partition_point(|n| n.way <= way).clamp(1, self.nodes.len() - 1)
    }

    /// The turn within a window about a way.
    fn window_turn(&self, middle: f64, window: f64) -> f64 {
        self.turn_at(middle + 0.5 * window) - self.turn_at(middle - 0.5 * window)
    }

    /// The middle of the windows of this length that turn most; `None` of a profile without length.
    pub(crate) fn sharpest(&self, window: f64) -> Option<RidgePlace> {
        if self.nodes.len() < 2 {
            return None;
        }
        let n = (SEARCHED / STEP) as i32;
        let turns: Vec<f64> = (-n..=n).map(|k| self.window_turn(f64::from(k) * STEP * window, window)).collect();
        let best = (0..turns.len()).max_by(|&a, &b| turns[a].total_cmp(&turns[b]))?;
        let top = TOP * turns[best];
        let way_of = |k: f64| (k - f64::from(n)) * STEP * window;
        let first = (0..best).rev().find(|&k| turns[k] < top);
        let last = (best..turns.len()).find(|&k| turns[k] < top);
        // Where the turn reaches the top between two steps; at a crease it jumps.
        let border = |below: usize, above: usize| {
            let (mut low, mut high) = (below as f64, above as f64);
            for _ in 0..20 {
                let middle = 0.5 * (low + high);
                if self.window_turn(way_of(middle), window) < top { low = middle } else { high = middle }
            }
            high
        };
        let from = first.map_or(0.0, |k| border(k, k + 1));
        let to = last.map_or((turns.len() - 1) as f64, |k| border(k, k - 1));
        let way = way_of(0.5 * (from + to));
        let turn = turns[best];
        let stands_out = first.is_some() && last.is_some() && self.is_flatter_beside(way, turn, window);
        let is_whole =
            self.nodes[0].way <= way - WHOLE * window && self.nodes[self.nodes.len() - 1].way >= way + WHOLE * window;
        let k = self.after(way);
        let (a, b) = (&self.nodes[k - 1], &self.nodes[k]);
        let share = if b.way > a.way { ((way - a.way) / (b.way - a.way)).clamp(0.0, 1.0) } else { 1.0 };
        // Behind the middle, a node's triangle is the one toward the beginning.
        let triangle = if way < 0.0 { a.triangle } else { b.triangle };
        Some(RidgePlace {
            position: a.position + (b.position - a.position) * share,
            triangle,
            way,
            turn,
            stands_out,
            is_whole,
        })
    }

    /// Whether windows beside a ridge turn much less; those beyond the ends of the profile are not
    /// known, but one has to be.
    fn is_flatter_beside(&self, way: f64, turn: f64, window: f64) -> bool {
        let (first, last) = (self.nodes[0].way, self.nodes[self.nodes.len() - 1].way);
        let middle = 0.5 * (BESIDE[0] + BESIDE[1]) * window;
        let known = [way - middle, way + middle].into_iter().filter(|&m| m > first && m < last);
        let beside: Vec<f64> = known.map(|m| self.window_turn(m, (BESIDE[1] - BESIDE[0]) * window)).collect();
        !beside.is_empty() && beside.iter().all(|t| *t <= FLATTER * turn)
    }
}

/// Signed turn from one direction to another about an axis, rad.
pub(crate) fn turn_about(axis: &Vector3<f64>, from: &Unit<Vector3<f64>>, to: &Unit<Vector3<f64>>) -> f64 {
    from.cross(to).dot(axis).atan2(from.dot(to))
}
