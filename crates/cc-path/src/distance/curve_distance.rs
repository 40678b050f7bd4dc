//! Distance from curves on a patch, measured along the surface, with foot and side.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::{Point3, Unit, Vector3};

use crate::distance::patch_vertices::PatchVertices;
use crate::distance::source_curve::{CurvePlace, SourceCurve};
use crate::strategy::patch::Patch;

/// Foot of a place on the nearest of some curves, and the distance from it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CurveFoot {
    /// Index of the curve.
    pub(crate) curve: u32,
    /// Place on the curve.
    pub(crate) at: CurvePlace,
    /// Distance along the surface, mm, not negative.
    pub(crate) distance: f64,
    /// Distance from the curve, or from its straight continuation beyond an end, mm: above 0 to the
    /// left of the curve, seen from outside, below 0 to the right.
    pub(crate) across: f64,
    /// Unit direction in which the distance grows, in the tangent plane of the place; zero on the
    /// curve.
    pub(crate) away: Vector3<f64>,
}

/// Node of a curve from which the foot of a vertex is found downhill.
#[derive(Clone, Copy, Debug)]
struct Hint {
    curve: u32,
    node: u32,
}

impl Hint {
    fn of(foot: &CurveFoot) -> Self {
        Self { curve: foot.curve, node: foot.at.node }
    }
}

/// Distances from curves on a patch to the vertices around them, and to any place between.
///
/// Feet begin at the triangles that the curves run through, and are passed on from vertex to
/// vertex: no foot lies on another sheet of the surface that comes near in space. The way from foot
/// to place is the arc over the chord between them by the smooth normals at both: exact on planes,
/// cylinders and spheres, elsewhere up to the change of curvature along the way. Across a crease it
/// is too short, by up to 10 % at a turn of 60°.
pub(crate) struct CurveDistance<'a> {
    patch: &'a Patch<'a>,
    vertices: &'a PatchVertices,
    curves: &'a [SourceCurve],
    store: DistanceStore,
    reached: Vec<(u32, CurveFoot)>,
}

/// Values that distances keep for every vertex of a patch; distances that are measured one after
/// the other take it over from each other, so that each takes only the time of what it reaches.
#[derive(Default)]
pub(crate) struct DistanceStore {
    /// Index of each vertex in what is reached; [`OUT_OF_REACH`] for others.
    places: Vec<u32>,
    /// Smallest distance that was entered, mm.
    nearest: Vec<f64>,
    /// The vertices that have one.
    entered: Vec<u32>,
}

const OUT_OF_REACH: u32 = u32::MAX;

impl DistanceStore {
    pub(crate) fn new(patch: &Patch) -> Self {
        let n = patch.mesh.vertices().len();
        Self { places: vec![OUT_OF_REACH; n], nearest: vec![f64::INFINITY; n], entered: Vec::new() }
    }

    /// Makes it as it was when it was new.
    fn clear(&mut self) {
        for v in self.entered.drain(..) {
            self.places[v as usize] = OUT_OF_REACH;
            self.nearest[v as usize] = f64::INFINITY;
        }
    }
}

impl<'a> CurveDistance<'a> {
    /// Measures up to `reach` (mm) from the curves, in time that grows with the vertices in reach.
    ///
    /// Feet are passed on by vertices for which `passes_on` holds; those beside them get a distance
    /// too.
    pub(crate) fn new(
        patch: &'a Patch<'a>,
        vertices: &'a PatchVertices,
        curves: &'a [SourceCurve],
        reach: f64,
        passes_on: impl Fn(u32) -> bool,
    ) -> Self {
        Self::with_store(patch, vertices, curves, reach, passes_on, DistanceStore::new(patch))
    }

    /// Does the same with a store of the patch.
    pub(crate) fn with_store(
        patch: &'a Patch<'a>,
        vertices: &'a PatchVertices,
        curves: &'a [SourceCurve],
        reach: f64,
        passes_on: impl Fn(u32) -> bool,
        store: DistanceStore,
    ) -> Self {
        let mut this = Self { patch, vertices, curves, store, reached: Vec::new() };
        let mut queue = Queue { heap: BinaryHeap::new(), feet: Vec::new(), reach };
        for (curve, source) in curves.iter().enumerate() {
            for (node, triangle) in source.nodes() {
                let hint = Hint { curve: curve as u32, node };
                this.offer(hint, triangle, &mut queue);
            }
        }
        while let Some(Reverse((_, [vertex, .., place]))) = queue.heap.pop() {
            let foot = queue.feet[place as usize];
            if foot.distance > this.store.nearest[vertex as usize] || this.foot_of(vertex).is_some() {
                continue;
            }
            this.store.places[vertex as usize] = this.reached.len() as u32;
            this.reached.push((vertex, foot));
            if passes_on(vertex) {
                let hint = Hint::of(&foot);
                vertices.triangles(vertex).iter().for_each(|&t| this.offer(hint, t, &mut queue));
            }
        }
        this
    }

    /// The store, for the next distances on the patch.
    pub(crate) fn into_store(self) -> DistanceStore {
        let mut store = self.store;
        store.clear();
        store
    }

    /// Enters the corners of a triangle with their feet from a hint, where they are nearer than
    /// before.
    fn offer(&mut self, hint: Hint, triangle: u32, queue: &mut Queue) {
        for vertex in self.patch.mesh.triangles()[triangle as usize] {
            if self.foot_of(vertex).is_none() {
                let p = self.patch.mesh.vertices()[vertex as usize];
                let foot = self.foot_by_hint(hint, &p, &self.vertices.normal(vertex));
                queue.enter(vertex, foot, &mut self.store);
            }
        }
    }

    fn foot_by_hint(&self, hint: Hint, p: &Point3<f64>, normal: &Unit<Vector3<f64>>) -> CurveFoot {
        CurveFoot::of(hint.curve, self.curves[hint.curve as usize].foot(p, hint.node), p, normal)
    }

    /// The foot of a vertex; `None` out of reach.
    pub(crate) fn foot_of(&self, vertex: u32) -> Option<&CurveFoot> {
        // The index of one out of reach is beyond the end.
        self.reached.get(self.store.places[vertex as usize] as usize).map(|(_, foot)| foot)
    }

    /// The vertices in reach with their feet, by rising distance.
    pub(crate) fn reached(&self) -> &[(u32, CurveFoot)] {
        &self.reached
    }

    /// The foot of a place between some vertices, with the smooth normal there: the nearest of
    /// those found from theirs; `None` out of reach.
    pub(crate) fn foot(&self, between: &[u32], p: &Point3<f64>, normal: &Unit<Vector3<f64>>) -> Option<CurveFoot> {
        let feet = between.iter().filter_map(|&v| Some(self.foot_by_hint(Hint::of(self.foot_of(v)?), p, normal)));
        feet.reduce(|best, next| if next.distance < best.distance { next } else { best })
    }
}

impl CurveFoot {
    /// The distance of a place with this normal from its foot on a curve.
    fn of(curve: u32, at: CurvePlace, p: &Point3<f64>, normal: &Unit<Vector3<f64>>) -> Self {
        let chord = p - at.position;
        let Some(direction) = Unit::try_new(chord, 0.0) else {
            return Self { curve, at, distance: 0.0, across: 0.0, away: Vector3::zeros() };
        };
        let distance = chord.norm() * arc_over_chord(&direction, &at.normal, normal);
        let left = at.normal.cross(&at.tangent).dot(&direction);
        let across = (distance * distance - at.beyond * at.beyond).max(0.0).sqrt().copysign(left);
        let tangential = direction.into_inner() - normal.into_inner() * normal.dot(&direction);
        let away = Unit::try_new(tangential, 1e-9).map_or_else(Vector3::zeros, Unit::into_inner);
        Self { curve, at, distance, across, away }
    }
}

/// Length of a curve on the surface over its chord, from the slopes of the surface at both ends
/// against the chord.
///
/// A turn by 2δ from end to end is an arc: δ / sin δ. A slope m common to both ends is an S, of a
/// cubic: 1 + m² / 10 to the fourth order. (Half the mean square of the slope of a cubic with end
/// slopes m ± δ is m² / 10 + δ² / 6.)
fn arc_over_chord(chord: &Unit<Vector3<f64>>, start: &Unit<Vector3<f64>>, end: &Unit<Vector3<f64>>) -> f64 {
    let [from, to] = [start, end].map(|n| n.dot(chord).clamp(-1.0, 1.0).asin());
    let (half_turn, common) = (0.5 * (to - from), 0.5 * (to + from));
    let arc = if half_turn.abs() < 1e-6 { 1.0 } else { half_turn / half_turn.sin() };
    arc + 0.1 * common * common
}

/// Vertices to be settled, the nearest first.
struct Queue {
    /// Bits of the distance, which rise with it, vertex, curve, node, and place of the foot.
    heap: BinaryHeap<Reverse<(u64, [u32; 4])>>,
    feet: Vec<CurveFoot>,
    reach: f64,
}

impl Queue {
    fn enter(&mut self, vertex: u32, foot: CurveFoot, store: &mut DistanceStore) {
        let nearest = &mut store.nearest[vertex as usize];
        if foot.distance < *nearest && foot.distance <= self.reach {
            if nearest.is_infinite() {
                store.entered.push(vertex);
            }
            *nearest = foot.distance;
            let place = self.feet.len() as u32;
            self.heap.push(Reverse((foot.distance.to_bits(), [vertex, foot.curve, foot.at.node, place])));
            self.feet.push(foot);
        }
    }
}

#[cfg(test)]
#[path = "../../tests/unit/distance/curve_distance.rs"]
mod tests;
