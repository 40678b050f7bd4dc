//! Regions that operations are to cut, and samples spread over them.

use std::sync::Arc;

use facemill_cc_path::strategies::Region;
use facemill_cc_path::{RegionSample, RequestedRegion, RequestedStrategy, Strategy};
use facemill_cl_data::CcPoint;
use facemill_cutter_location::cusp::expected_strip_width;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::{OperationFile, PathFile};
use facemill_job::frames::places;
use facemill_job::load::job::{ExtendedRegion, Job, Setup};
use facemill_job::setup::cell::{corner_on_drive, largest_left, search_curve};
use facemill_job::setup::left_stock::left_region;
use facemill_job::setup::pass_surface::{extended_region, pass_surface, surface_of};
use facemill_surface_model::Surface;
use nalgebra::{Isometry3, Point3, Vector3};

/// Least number of samples across the step that the cusp permits, if the largest number permits it.
const SAMPLES_ACROSS: f64 = 6.0;

/// Number of refinements of samples if box or levels leave a small part of the facets: each by up
/// to a hundred times.
const ROUNDS: usize = 4;

/// Region that an operation is to cut: groups, cone, box and levels of the strategy as the job
/// states them, in all places of the pattern.
pub struct OperationRegion<'a> {
    pub(crate) operation: &'a OperationFile,
    pub(crate) region: Region,
    pub(crate) strategy: Option<Strategy>,
    /// The region with the surface beyond its border, if the job extends it.
    extended: Option<(Arc<ExtendedRegion>, Region)>,
    /// Places of the pattern.
    pub(crate) places: Vec<Isometry3<f64>>,
    /// Largest height of a finished region, mm.
    pub(crate) limit: f64,
}

impl<'a> OperationRegion<'a> {
    /// Reads the region of an operation.
    ///
    /// # Errors
    /// If region or strategy are wrong.
    pub fn of(job: &Job, setup: &Setup<'_>, operation: &'a OperationFile) -> Result<Self, Failure> {
        let wrong = |e: facemill_cc_path::PathError| job.wrong(format!("operation \"{}\": {e}", operation.name));
        let (file, strategy) = match &operation.path {
            PathFile::Strategy(s) => (s.region.clone(), Some(s.strategy.to_strategy().map_err(wrong)?)),
            PathFile::File(f) => (f.region.clone(), None),
            PathFile::Cl(f) => (f.region.clone(), None),
        };
        let mut region = file.to_region().map_err(wrong)?;
        region.groups = region.groups.or_else(|| Some(setup.drive_groups.clone()));
        let extended = extended_region(job, setup, operation)?;
        region.left = left_region(job, setup, operation, &region)?;
        let extended = extended.map(|extended| {
            let (_, region) = pass_surface(setup, Some(&extended), region.clone());
            (extended, region)
        });
        let limit = largest_left(job, operation);
        Ok(Self { operation, region, strategy, extended, places: places(operation.pattern.as_ref()), limit })
    }

    /// Returns whether the region is limited to what is left, and nothing is.
    pub fn has_nothing_left(&self) -> bool {
        self.region.left.as_ref().is_some_and(|left| left.is_empty())
    }

    /// Returns the region on the drive surface, in the first place of the pattern.
    ///
    /// # Errors
    /// If the region holds no facet, or names an unknown group.
    pub fn region<'s>(&'s self, job: &Job, setup: &'s Setup<'_>) -> Result<RequestedRegion<'s>, Failure> {
        self.region_on(job, setup, (&*setup.around_drive, &self.region))
    }

    /// Returns the region that passes lie in: the region on the drive surface, with the surface
    /// beyond its border.
    ///
    /// # Errors
    /// As [`OperationRegion::region`].
    pub fn region_of_passes<'s>(&'s self, job: &Job, setup: &'s Setup<'_>) -> Result<RequestedRegion<'s>, Failure> {
        match &self.extended {
            None => self.region(job, setup),
            Some((extended, region)) => self.region_on(job, setup, (&extended.surface, region)),
        }
    }

    /// Returns the surface that passes lie on.
    pub fn surface_of_passes<'s>(&'s self, setup: &'s Setup<'_>) -> &'s Surface {
        surface_of(setup, self.extended.as_ref().map(|(extended, _)| &**extended))
    }

    fn region_on<'s>(
        &'s self,
        job: &Job,
        setup: &Setup<'_>,
        (surface, region): (&'s Surface, &'s Region),
    ) -> Result<RequestedRegion<'s>, Failure> {
        let corner_radius = corner_on_drive(job, setup);
        let strategy = self.strategy.as_ref().map(|strategy| RequestedStrategy { strategy, corner_radius });
        RequestedRegion::new(surface, region, strategy)
            .map_err(|e| job.wrong(format!("operation \"{}\": {e}", self.operation.name)))
    }

    /// Returns the distance between passes that determines the spacing of samples, mm: the one that
    /// the cusp permits on a plane, at most the job's.
    fn step_over(&self, job: &Job) -> Result<f64, Failure> {
        let tolerances = &self.operation.tolerances;
        let most = tolerances.max_step_over_mm;
        let curve = search_curve(job, self.operation, false)?;
        let on_plane = CcPoint::new(Point3::origin(), Vector3::z(), Vector3::x());
        let width =
            |cc| expected_strip_width(job.tool.cutter(), &cc, None, &curve, tolerances.cusp_mm, most).clamp(0.0, most);
        Ok(on_plane.map_or(most, width))
    }

    /// Returns samples of the region in one place of the pattern, with `least` to `most` in all
    /// places.
    pub(crate) fn samples(
        &self,
        job: &Job,
        region: &RequestedRegion<'_>,
        [least, most]: [f64; 2],
    ) -> Result<Vec<RegionSample>, Failure> {
        let (spacing, places) = (self.step_over(job)? / SAMPLES_ACROSS, self.places.len() as f64);
        let area = region.facet_area() * places;
        let mut area_each = (spacing * spacing).clamp(area / most, area / least);
        let mut samples = Vec::new();
        for _ in 0..ROUNDS {
            samples = region.samples(area_each);
            let n = samples.iter().filter(|s| s.weight() > 0.0).count() as f64 * places;
            if n >= 0.9 * least {
                break;
            }
            area_each *= (n / least).clamp(0.01, 1.0);
        }
        Ok(samples)
    }
}
