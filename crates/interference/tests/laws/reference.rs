//! References of the tree besides the kit: distances and verdicts alone.

use facemill_cl_data::Solid;
use facemill_interference::{Interference, MeshTree, Separation, Verdict};
use nalgebra::{Isometry3, Translation3};

use crate::kit::frustum;

/// A mesh of which verdicts and distances are known and nothing else: lifts and depths are found in
/// steps.
pub(crate) struct Stepped<'a>(pub(crate) &'a MeshTree);

impl Interference for Stepped<'_> {
    fn verdict(&self, solid: &Solid, mesh_from_solid: &Isometry3<f64>, hint: Option<u32>) -> Verdict {
        self.0.verdict(solid, mesh_from_solid, hint)
    }

    fn core_distance(
        &self,
        solid: &Solid,
        mesh_from_solid: &Isometry3<f64>,
        at_most: f64,
        hint: Option<u32>,
    ) -> Option<Separation> {
        self.0.core_distance(solid, mesh_from_solid, at_most, hint)
    }
}

/// Whether a body that touches nothing of the surface is inside a closed component: a point of it
/// is.
pub(crate) fn closed_contains(tree: &MeshTree, solid: &Solid, pose: &Isometry3<f64>) -> bool {
    let point = Translation3::from((pose * solid.interior_point()).coords);
    !tree.verdict(&frustum([0.0, 0.0], [0.0, 0.0], 0.0), &point.into(), None).is_free()
}
