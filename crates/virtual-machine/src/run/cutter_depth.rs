use std::f64::consts::SQRT_2;

use facemill_cl_data::{RoundFrustum, Solid};
use facemill_interference::{Interference, Verdict, Witness};
use facemill_tool_model::Cutter;
use nalgebra::{Isometry3, Point3};

use crate::run::track::{Placement, Shape, Track};

/// The cutter as what its depth in a mesh is measured with.
///
/// The depth is the smallest t for which a body within the cutter that leaves no cutter point
/// farther than t from it is free: no cutter point is deeper than that. Up to the corner radius r
/// it is r − distance(core, mesh), exactly; the core is the cylinder whose r-neighbourhood is the
/// cutter. Deeper, for sharp cutters (r = 0) and at the upper rim of the flute it is found by
/// bisection over t. Of several bodies that serve for a t one free one is enough: the test body of
/// `docs/architecture.md`, the cutter raised by t, the cutter narrowed by t, its upper part lowered
/// by t. So the depth of a flat bottom, a straight wall or a flat ceiling is the true one, and that
/// of an edge at most √2 times it.
#[derive(Clone, Debug)]
pub(crate) struct CutterDepth {
    cutter: Cutter,
    core: Shape,
    /// The cutter above its core, where the core's neighbourhood is rounded and the cutter is not.
    band: Option<Shape>,
}

/// Where the cutter is relative to one obstacle, from pose to pose.
#[derive(Clone, Debug, Default)]
pub(crate) struct CutterTrack {
    core: Track,
    band: Track,
}

/// The cutter somewhere, workpiece frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CutterPlacement {
    work_from_tool: Isometry3<f64>,
    core: Placement,
    band: Option<Placement>,
}

/// How deep, and a point of the mesh in the cutter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Depth {
    pub(crate) depth: f64,
    pub(crate) place: Point3<f64>,
}

/// Accuracy of depths found by bisection, mm: a tenth of the accuracy of findings. Smaller costs
/// verdicts only.
const RESOLUTION: f64 = 1e-3;

impl CutterDepth {
    pub(crate) fn new(cutter: &Cutter) -> Self {
        let shape = |f| Shape::core_of(&Solid::Frustum(f));
        Self { cutter: *cutter, core: shape(cutter.core()), band: band(cutter, 0.0).map(shape) }
    }

    /// The same that only looks whether an edge is in the mesh: the bottom with its corner, and the
    /// upper end of the flute. How deep the cutter then is, is measured of all of it.
    pub(crate) fn at_edges(cutter: &Cutter) -> Self {
        let core = disc(cutter.corner_radius(), cutter.rim_radius());
        Self { cutter: *cutter, core, band: Some(disc(cutter.flute_length(), cutter.radius())) }
    }

    pub(crate) fn placed(&self, work_from_tool: &Isometry3<f64>) -> CutterPlacement {
        CutterPlacement {
            work_from_tool: *work_from_tool,
            core: self.core.placed(*work_from_tool),
            band: self.band.as_ref().map(|s| s.placed(*work_from_tool)),
        }
    }

    /// How deep the cutter is in `mesh` with material of thickness `allowance` on it, where that is
    /// more than `floor` (both mm, at least 0).
    pub(crate) fn beyond(
        &self,
        floor: f64,
        allowance: f64,
        at: &CutterPlacement,
        track: &mut CutterTrack,
        mesh: &dyn Interference,
    ) -> Option<Depth> {
        let skin = self.cutter.corner_radius() + allowance;
        let nearest = track.core.nearest_within((skin - floor).max(0.0), &self.core, &at.core, mesh);
        let exact = nearest.filter(|s| s.distance > 0.0 && skin - s.distance > floor);
        let exact = exact.map(|s| Depth { depth: skin - s.distance, place: s.point });
        let is_deep = nearest.is_some_and(|s| s.distance <= 0.0);
        let is_above =
            self.band.as_ref().zip(at.band.as_ref()).is_some_and(|(shape, placement)| {
                track.band.nearest_within(allowance, shape, placement, mesh).is_some()
            });
        let bisected = (is_deep || is_above)
            .then(|| self.bisect(exact.map_or(floor, |d| d.depth), allowance, &at.work_from_tool, mesh))
            .flatten();
        bisected.or(exact)
    }

    /// Smallest t above `floor` that [`CutterDepth::hit`] finds free; `None` where `floor` is.
    fn bisect(
        &self,
        floor: f64,
        allowance: f64,
        work_from_tool: &Isometry3<f64>,
        mesh: &dyn Interference,
    ) -> Option<Depth> {
        let hit = |t: f64| self.hit(t, allowance, work_from_tool, mesh);
        let mut place = hit(floor)?.point;
        // At this tolerance nothing is left of the cutter but a line: the depth is at least that.
        let r = self.cutter.corner_radius();
        let deepest = r + (self.cutter.radius().min(self.cutter.flute_length()) - r) * SQRT_2;
        if let Some(w) = hit(deepest) {
            return Some(Depth { depth: deepest.max(floor), place: w.point });
        }
        let (mut cut, mut free) = (floor, deepest);
        while free - cut > RESOLUTION {
            let middle = 0.5 * (cut + free);
            match hit(middle) {
                Some(w) => (cut, place) = (middle, w.point),
                None => free = middle,
            }
        }
        Some(Depth { depth: free, place })
    }

    /// A point of the mesh that may be deeper than `tolerance` in the cutter dilated by the
    /// allowance; `None` where none is.
    fn hit(
        &self,
        tolerance: f64,
        allowance: f64,
        work_from_tool: &Isometry3<f64>,
        mesh: &dyn Interference,
    ) -> Option<Witness> {
        let witness =
            |body: RoundFrustum| match mesh.verdict(&Solid::Frustum(body).dilated(allowance), work_from_tool, None) {
                Verdict::Hit(w) => Some(w),
                Verdict::Free => None,
            };
        let (c, t) = (&self.cutter, tolerance);
        let lower = witness(c.lower_test_body(t));
        if t < c.corner_radius() {
            // Below the band the test body alone tells, in it all bodies do.
            return lower.or_else(|| {
                let upper = c.upper_test_body(t).and_then(witness)?;
                band(c, t).and_then(witness)?;
                lowered_band(c, t).and_then(witness).and(Some(upper))
            });
        }
        let raised = || witness(cylinder(c.radius(), t.min(c.flute_length()), c.flute_length()));
        let narrowed = || witness(cylinder((c.radius() - t).max(0.0), 0.0, c.flute_length()));
        lower.filter(|_| raised().is_some() && narrowed().is_some())
    }
}

/// The part of the cutter above its core, narrowed by `by`; `None` for a sharp cutter, which has
/// none.
fn band(cutter: &Cutter, by: f64) -> Option<RoundFrustum> {
    let z_low = cutter.core().z_high;
    let band = || cylinder((cutter.radius() - by).max(0.0), z_low, cutter.flute_length());
    (z_low < cutter.flute_length()).then(band)
}

/// The same with its top `by` lower.
fn lowered_band(cutter: &Cutter, by: f64) -> Option<RoundFrustum> {
    let (z_low, z_high) = (cutter.core().z_high, cutter.flute_length() - by);
    (z_low < z_high).then(|| cylinder(cutter.radius(), z_low, z_high))
}

fn cylinder(radius: f64, z_low: f64, z_high: f64) -> RoundFrustum {
    RoundFrustum { z_low, z_high, radius_low: radius, radius_high: radius, rounding: 0.0 }
}

/// A disc square to z.
pub(crate) fn disc(z: f64, radius: f64) -> Shape {
    let disc = RoundFrustum { z_low: z, z_high: z, radius_low: radius, radius_high: radius, rounding: 0.0 };
    Shape::core_of(&Solid::Frustum(disc))
}

#[cfg(test)]
#[path = "../../tests/unit/run/cutter_depth.rs"]
mod tests;
