//! Region that an operation is to cut, in all places of its pattern, for entries and exits.

use facemill_cc_path::RequestedRegion;
use facemill_job::format::job_file::OperationFile;
use facemill_job::frames::places;
use facemill_job::load::job::Setup;
use facemill_tool_path::moves::lead::CutRegion;
use nalgebra::{Isometry3, Point3};

/// Region of an operation.
pub(crate) struct PlannedRegion<'a> {
    region: &'a RequestedRegion<'a>,
    work_from_places: Vec<Isometry3<f64>>,
    half_strip: f64,
    /// Farthest foot of a point, mm.
    within: f64,
}

/// Part of the way from a point to its foot that may lie along the facet there, as a share of the
/// way: more than on creases that a point beside a border does not have.
const ALONG: f64 = 0.5;

impl<'a> PlannedRegion<'a> {
    pub(crate) fn new(region: &'a RequestedRegion<'a>, setup: &Setup<'_>, operation: &OperationFile) -> Self {
        let half_strip = 0.5 * operation.tolerances.max_step_over_mm;
        let within = 2.0 * half_strip + setup.drive_allowance.abs();
        Self { region, work_from_places: places(operation.pattern.as_ref()), half_strip, within }
    }
}

impl CutRegion for PlannedRegion<'_> {
    fn holds(&self, copy: u32, point: &Point3<f64>) -> bool {
        let place = self.work_from_places.get(copy as usize).copied().unwrap_or_default();
        self.region.holds_foot(&place.inverse_transform_point(point), self.within, ALONG)
    }

    fn half_strip(&self) -> f64 {
        self.half_strip
    }
}
