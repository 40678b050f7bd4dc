//! Material that a program leaves on the surface that its operations are asked to cut, measured on its text.

use facemill_cc_path::{AskedRegion, Region, RegionSample, Strategy};
use facemill_cl_data::{CcPoint, Silent};
use facemill_nc_program::ReadProgram;
use facemill_virtual_machine::{VerifySettings, VirtualSetup, swept_by_cuts};
use facemill_z_map::{LeftHeight, SurfacePlace, SweptCutter, left_heights};
use nalgebra::{Isometry3, Point3};

use crate::cell::budget;
use crate::job_file::{OperationFile, PathFile};
use crate::load::{Job, Setup};
use crate::output::not_verified;
use crate::pieces::places;
use crate::plan_stages::MATERIAL;
use crate::remaining_report::{RemainingOnRegion, RemainingReport};
use crate::{Failure, Stages};

/// By how much a point of the cutter may be beside its place where heights are measured, mm: a tenth of the finest cusps that face
/// mills leave. Smaller: more parts of motions to look at.
const MOTION_TOLERANCE: f64 = 0.002;

/// Samples of an operation's region, at most: 100,000 take a second of processor time on the sample job.
const MAX_SAMPLES: f64 = 100_000.0;

/// Samples across the largest step-over, at least, where [`MAX_SAMPLES`] allows it.
const SAMPLES_ACROSS: f64 = 6.0;

/// Samples of the whole drive surface for the part of it that no operation is asked to cut.
const DRIVE_SAMPLES: f64 = 10_000.0;

/// How far a copy of a place may be from the surface and still be on it, mm.
const SAME_SURFACE: f64 = 0.01;

/// A head of the machine, as the program is run on it.
pub(crate) struct RunningHead<'a> {
    pub at: &'a VirtualSetup<'a>,
    pub settings: &'a VerifySettings,
}

/// Measures what a program leaves on the regions of a setup's operations; `None` where no operation of the setup is known.
///
/// Every cut of the program counts, whichever operation it belongs to. The region is the surface that the job states: groups, cone,
/// box and levels of the strategy, in all places of the pattern, whatever passes have been laid on it.
///
/// # Errors
/// When a region is wrong, or the stages are cancelled.
pub(crate) fn remaining(
    job: &Job,
    setup: &Setup<'_>,
    program: &ReadProgram,
    heads: &[RunningHead<'_>],
    stages: &dyn Stages,
) -> Result<Option<RemainingReport>, Failure> {
    let asked: Vec<Asked<'_>> = job
        .operations_of(setup.file)
        .map(|(_, operation)| Asked::of(job, setup, operation))
        .collect::<Result<_, _>>()?;
    if asked.is_empty() {
        return Ok(None);
    }
    let sweep = |h: &RunningHead<'_>| swept_by_cuts(program, h.at, h.settings, MOTION_TOLERANCE, &Silent);
    let sweeps: Vec<SweptCutter> = heads.iter().map(sweep).collect::<Result<_, _>>().map_err(not_verified)?;
    let reach = heads.iter().map(|h| h.at.tool.cutter().radius()).fold(0.0, f64::max);
    let mut operations = Vec::new();
    for asked in &asked {
        operations.push(asked.measured(setup, &sweeps, reach, stages)?);
    }
    let accuracy_mm = MOTION_TOLERANCE + SweptCutter::ACCURACY;
    Ok(Some(RemainingReport { accuracy_mm, outside_fraction: outside(setup, &asked)?, operations }))
}

/// What an operation is asked to cut.
struct Asked<'a> {
    operation: &'a OperationFile,
    region: Region,
    strategy: Option<Strategy>,
    places: Vec<Isometry3<f64>>,
    limit: f64,
}

impl<'a> Asked<'a> {
    fn of(job: &Job, setup: &Setup<'_>, operation: &'a OperationFile) -> Result<Self, Failure> {
        let wrong = |e: facemill_cc_path::PathError| job.wrong(format!("operation \"{}\": {e}", operation.name));
        let (file, strategy) = match &operation.path {
            PathFile::Strategy(s) => (s.region.clone(), Some(s.strategy.to_strategy().map_err(wrong)?)),
            PathFile::File(f) => (f.region.clone(), None),
        };
        let mut region = file.to_region().map_err(wrong)?;
        region.groups = region.groups.or_else(|| Some(setup.drive_groups.clone()));
        let limit = operation.tolerances.cusp_mm + budget(job, operation).simulated();
        Ok(Self { operation, region, strategy, places: places(operation.pattern.as_ref()), limit })
    }

    fn region<'s>(&'s self, setup: &'s Setup<'_>) -> Result<AskedRegion<'s>, Failure> {
        AskedRegion::new(&setup.around_drive, &self.region, self.strategy.as_ref())
            .map_err(|e| Failure::Internal(format!("operation \"{}\": {e}", self.operation.name)))
    }

    /// Area that each sample is taken for, mm².
    fn area_each(&self, region: &AskedRegion<'_>) -> f64 {
        let spacing = self.operation.tolerances.max_step_over_mm / SAMPLES_ACROSS;
        let area = region.facet_area() * self.places.len() as f64;
        (spacing * spacing).max(area / MAX_SAMPLES)
    }

    fn measured(
        &self,
        setup: &Setup<'_>,
        sweeps: &[SweptCutter],
        reach: f64,
        stages: &dyn Stages,
    ) -> Result<RemainingOnRegion, Failure> {
        let region = self.region(setup)?;
        let area_each = self.area_each(&region);
        let samples = region.samples(area_each);
        let on: Vec<SurfacePlace> = self
            .places
            .iter()
            .flat_map(|place| samples.iter().map(move |sample| (place, sample)))
            .map(|(place, sample)| surface_place(setup, place, sample, reach))
            .collect();
        let monitor = stages.start(MATERIAL, on.len());
        let heights: Vec<LeftHeight> = left_heights(sweeps, &on, &*monitor).map_err(|_| Failure::Interrupted)?;
        drop(monitor);
        Ok(RemainingOnRegion::new(self.operation, self.limit, area_each, &on, &heights))
    }
}

/// A sample in a place of the pattern, on the surface that is to be left, with the stock above it. Where the job states none, material is
/// looked for as far as the cutter is wide, so that a place that no cut comes near is not taken for finished.
fn surface_place(setup: &Setup<'_>, place: &Isometry3<f64>, sample: &RegionSample, reach: f64) -> SurfacePlace {
    let normal = place * sample.normal;
    let position = place * sample.position + normal.into_inner() * setup.drive_allowance;
    let feed =
        normal.into_inner().cross(&if normal.x.abs() < 0.9 { nalgebra::Vector3::x() } else { nalgebra::Vector3::y() });
    let above = CcPoint::new(position, normal.into_inner(), feed).map_or(0.0, |cc| setup.stock_above(&cc));
    let stock = if above > 0.0 || setup.stock_solid.is_some() { above.min(MAX_HEIGHT) } else { reach };
    SurfacePlace { position, normal, stock }
}

/// Heights above which material is not measured, mm.
const MAX_HEIGHT: f64 = 1000.0;

/// Part of the drive surface that no operation is asked to cut, in any place of its pattern.
fn outside(setup: &Setup<'_>, asked: &[Asked<'_>]) -> Result<f64, Failure> {
    let whole = Region { groups: Some(setup.drive_groups.clone()), ..Region::default() };
    let surface = &setup.around_drive;
    let drive = AskedRegion::new(surface, &whole, None).map_err(|e| Failure::Internal(e.to_string()))?;
    let regions = asked.iter().map(|a| a.region(setup)).collect::<Result<Vec<_>, _>>()?;
    let is_asked = |triangle: u32, p: &Point3<f64>| {
        asked.iter().zip(&regions).any(|(a, region)| {
            a.places.iter().enumerate().any(|(k, place)| {
                if k == 0 {
                    return region.contains(triangle, p);
                }
                let back = place.inverse_transform_point(p);
                surface
                    .closest_point(&back, SAME_SURFACE)
                    .is_some_and(|foot| region.contains(foot.triangle, &foot.position))
            })
        })
    };
    let samples = drive.samples(drive.facet_area() / DRIVE_SAMPLES);
    let outside = samples.iter().filter(|s| !is_asked(s.triangle, &s.position)).count();
    Ok(outside as f64 / samples.len().max(1) as f64)
}
