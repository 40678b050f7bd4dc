//! Surface between the islands of what is left, which passes of an operation are not to cut.

use std::sync::{Arc, PoisonError};

use facemill_cc_path::LeftRegion;
use facemill_cutter_location::cusp::cut_point::CutPoint;
use facemill_cutter_location::cusp::neighbours::Neighbour;
use facemill_job::format::job_file::OperationFile;
use facemill_job::frames::places;
use facemill_job::load::job::Setup;
use nalgebra::{Isometry3, Unit};

/// Gaps in the region of an operation that is limited to what is left: passes on both sides of one
/// leave no ridge between them that is theirs.
pub(crate) struct LeftGaps {
    left: Option<Arc<LeftRegion>>,
    /// First place of the pattern ← each place.
    first_from_place: Vec<Isometry3<f64>>,
}

impl LeftGaps {
    /// Returns the gaps of an operation whose region is measured; none of one without limits.
    pub(crate) fn of(setup: &Setup<'_>, operation: &OperationFile) -> Self {
        let known = setup.left_regions.lock().unwrap_or_else(PoisonError::into_inner);
        let first_from_place = places(operation.pattern.as_ref()).iter().map(Isometry3::inverse).collect();
        Self { left: known.get(&operation.name).cloned(), first_from_place }
    }

    /// Returns whether the middle between a point in a place of the pattern and the pass beside it
    /// is not to be cut.
    pub(crate) fn is_between(&self, copy: usize, own: &CutPoint, beside: &Neighbour) -> bool {
        let (Some(left), Some(first)) = (&self.left, self.first_from_place.get(copy)) else { return false };
        let [a, b] = [&own.cc, &beside.point.cc];
        let middle = first * nalgebra::center(&a.position, &b.position);
        let normal = first * (a.normal.into_inner() + b.normal.into_inner());
        Unit::try_new(normal, 0.1).is_some_and(|normal| !left.is_cut(&middle, &normal))
    }
}

#[cfg(test)]
#[path = "../../tests/unit/passes/left_gaps.rs"]
mod tests;
