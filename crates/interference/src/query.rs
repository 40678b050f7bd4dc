//! Queries of interference and distance, and their answers.

pub(crate) mod depth;
pub(crate) mod lift;
pub(crate) mod sweep_verdict;
pub(crate) mod verdict;

use facemill_cl_data::{Aabb, Solid};
use nalgebra::{Isometry3, Unit, Vector3};

use crate::query::depth::stepped_depth;
use crate::query::lift::stepped_lift;
use crate::query::sweep_verdict::{MotionInterval, SweepVerdict, TurnRange};
use crate::query::verdict::{Separation, Verdict};

/// Answers about convex bodies and one mesh. Mesh frame, mm.
///
/// `hint` is a triangle of the mesh to look at first, such as that of the last answer. It changes
/// the speed, and which of several witnesses or nearest points is named, but never the verdict nor
/// (by more than 1e-9 mm) the distance. A hint that is no triangle is ignored.
pub trait Interference: Sync {
    /// Whether the dilated solid touches the mesh's surface or is wholly inside one of its closed
    /// components.
    ///
    /// Touching counts as a hit: free means that every point of the mesh is farther than the
    /// rounding from the core.
    fn verdict(&self, solid: &Solid, mesh_from_solid: &Isometry3<f64>, hint: Option<u32>) -> Verdict;

    /// Verdict on several solids in one frame, each dilated by `dilation` mm more: the first hit in
    /// their order, or free if all are. For what is one body but not one solid, such as a cutter
    /// (`Cutter::test_bodies` of `facemill-tool-model`).
    fn verdict_of_all(
        &self,
        solids: &[Solid],
        dilation: f64,
        mesh_from_solids: &Isometry3<f64>,
        hint: Option<u32>,
    ) -> Verdict {
        let verdicts = solids.iter().map(|solid| self.verdict(&solid.dilated(dilation), mesh_from_solids, hint));
        verdicts.into_iter().find(|verdict| !verdict.is_free()).unwrap_or(Verdict::Free)
    }

    /// Distance from the mesh's surface to the undilated core of the solid, 0 where they meet,
    /// searched up to `at_most` mm; `None` where it is larger. The surface only: a core inside a
    /// closed component has a distance too.
    fn core_distance(
        &self,
        solid: &Solid,
        mesh_from_solid: &Isometry3<f64>,
        at_most: f64,
        hint: Option<u32>,
    ) -> Option<Separation>;

    /// Whether the dilated solid touches nothing of the mesh at any time of an interval, and is in
    /// no closed component. Clear is proven; where an implementation proves nothing, everything is
    /// unproven. Where it is not clear, the solid may touch, its core does in the middle of the
    /// interval, or the interval is too long; a shorter one may prove more.
    fn sweep(&self, solid: &Solid, motion: &MotionInterval, hint: Option<u32>) -> SweepVerdict {
        let _ = (solid, motion, hint);
        SweepVerdict::Unproven(None)
    }

    /// Whether the dilated solid touches nothing of the mesh in any pose of a range of turns about
    /// a fixed point, and is in no closed component. Clear is proven, up to the rounding band of
    /// verdicts; Unproven says that the solid may touch, or that the range is too large. An
    /// implementation may prove nothing.
    fn turn(&self, solid: &Solid, range: &TurnRange, hint: Option<u32>) -> SweepVerdict {
        let _ = (solid, range, hint);
        SweepVerdict::Unproven(None)
    }

    /// Returns the result of [`lift_to_free`](crate::query::lift::lift_to_free) for a positive
    /// resolution; in steps unless the mesh knows better.
    fn least_lift(
        &self,
        solid: &Solid,
        mesh_from_solid: &Isometry3<f64>,
        direction: Unit<Vector3<f64>>,
        max_lift: f64,
        resolution: f64,
    ) -> Option<f64> {
        stepped_lift(self, solid, mesh_from_solid, direction, max_lift, resolution)
    }

    /// A box around the mesh, mesh frame; `None` where none is known.
    fn bounds(&self) -> Option<Aabb> {
        None
    }

    /// How deep the surface is in the undilated core, which it meets in `met`, to 1e-6 mm, and
    /// where: for [`penetration`](crate::query::depth::penetration).
    fn core_depth(&self, solid: &Solid, mesh_from_solid: &Isometry3<f64>, met: Separation) -> (f64, Separation) {
        stepped_depth(self, solid, mesh_from_solid, met)
    }
}
