//! Material that a program leaves on the surface that its operations are to cut, measured on its
//! text.

use facemill_cc_path::{Region, RegionSample, RequestedRegion, Strategy};
use facemill_cl_data::{CcPoint, Silent};
use facemill_cutter_location::cusp::expected_strip_width;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::{OperationFile, PathFile};
use facemill_job::format::report::remaining::{RemainingOnRegion, RemainingPlace, RemainingReport};
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::cell::{largest_left, search_curve};
use facemill_job::setup::pattern::places;
use facemill_job::stages::{MATERIAL, Stages};
use facemill_nc_program::ReadProgram;
use facemill_virtual_machine::{VerifySettings, VirtualSetup, swept_by_cuts};
use facemill_z_map::{LeftHeight, SurfacePlace, SweptCutter, left_heights};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::named_results::not_verified;

/// Largest error of a point of the cutter in the measurement of heights, mm: a tenth of the finest
/// cusps that face mills leave. Smaller: more parts of motions to examine.
const MOTION_TOLERANCE: f64 = 0.002;

/// Largest error of a height, mm.
pub const ACCURACY: f64 = MOTION_TOLERANCE + SweptCutter::ACCURACY;

/// Largest number of samples of an operation's region, without its border: 100,000 take a second of
/// processor time on the sample job.
const MAX_SAMPLES: f64 = 100_000.0;

/// Smallest number of samples.
const MIN_SAMPLES: f64 = 10_000.0;

/// Least number of samples across the step that the cusp permits, if [`MAX_SAMPLES`] permits it.
const SAMPLES_ACROSS: f64 = 6.0;

/// Number of refinements of samples if box or levels leave a small part of the facets: each by up
/// to a hundred times.
const ROUNDS: usize = 4;

/// Number of samples around which the largest height is sought.
const LARGEST_PLACES: usize = 32;

/// Factor of refinement there.
const FINER: f64 = 4.0;

/// Samples of the whole drive surface for the part of it that no operation is to cut.
const DRIVE_SAMPLES: f64 = 10_000.0;

/// Largest distance of a copy of a place from the surface it is on, mm.
const SAME_SURFACE: f64 = 0.01;

/// A head of the machine that runs the program.
pub struct RunningHead<'a> {
    /// Machine with everything on it, as the head sees it.
    pub at: &'a VirtualSetup<'a>,
    /// Settings of its runs.
    pub settings: &'a VerifySettings,
}

/// Measures the material that a program leaves on the regions of a setup's operations; `None` if no
/// operation of the setup is known.
///
/// Every cut of the program counts, regardless of its operation. The region is the surface that the
/// job states: groups, cone, box and levels of the strategy, in all places of the pattern,
/// regardless of the generated passes.
///
/// # Errors
/// If a region is wrong, or the stages are cancelled.
pub fn remaining(
    job: &Job,
    setup: &Setup<'_>,
    program: &ReadProgram,
    heads: &[RunningHead<'_>],
    stages: &dyn Stages,
) -> Result<Option<RemainingReport>, Failure> {
    let requested: Vec<OperationRegion<'_>> = job
        .operations_of(setup.file)
        .map(|(_, operation)| OperationRegion::of(job, setup, operation))
        .collect::<Result<_, _>>()?;
    if requested.is_empty() {
        return Ok(None);
    }
    let sweep = |h: &RunningHead<'_>| swept_by_cuts(program, h.at, h.settings, MOTION_TOLERANCE, &Silent);
    let sweeps: Vec<SweptCutter> = heads.iter().map(sweep).collect::<Result<_, _>>().map_err(not_verified)?;
    let reach = heads.iter().map(|h| h.at.tool.cutter().radius()).fold(0.0, f64::max);
    let mut operations = Vec::new();
    for requested in &requested {
        operations.push(requested.measured((job, setup), &sweeps, reach, stages)?);
    }
    Ok(Some(RemainingReport { accuracy_mm: ACCURACY, outside_fraction: outside(setup, &requested)?, operations }))
}

/// Region that an operation is to cut.
struct OperationRegion<'a> {
    operation: &'a OperationFile,
    region: Region,
    strategy: Option<Strategy>,
    places: Vec<Isometry3<f64>>,
    limit: f64,
}

impl<'a> OperationRegion<'a> {
    fn of(job: &Job, setup: &Setup<'_>, operation: &'a OperationFile) -> Result<Self, Failure> {
        let wrong = |e: facemill_cc_path::PathError| job.wrong(format!("operation \"{}\": {e}", operation.name));
        let (file, strategy) = match &operation.path {
            PathFile::Strategy(s) => (s.region.clone(), Some(s.strategy.to_strategy().map_err(wrong)?)),
            PathFile::File(f) => (f.region.clone(), None),
        };
        let mut region = file.to_region().map_err(wrong)?;
        region.groups = region.groups.or_else(|| Some(setup.drive_groups.clone()));
        let limit = largest_left(job, operation);
        Ok(Self { operation, region, strategy, places: places(operation.pattern.as_ref()), limit })
    }

    fn region<'s>(&'s self, setup: &'s Setup<'_>) -> Result<RequestedRegion<'s>, Failure> {
        RequestedRegion::new(&setup.around_drive, &self.region, self.strategy.as_ref())
            .map_err(|e| Failure::Internal(format!("operation \"{}\": {e}", self.operation.name)))
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

    /// Returns samples of the region in one place of the pattern.
    fn samples(&self, job: &Job, region: &RequestedRegion<'_>) -> Result<Vec<RegionSample>, Failure> {
        let (spacing, places) = (self.step_over(job)? / SAMPLES_ACROSS, self.places.len() as f64);
        let area = region.facet_area() * places;
        let mut area_each = (spacing * spacing).clamp(area / MAX_SAMPLES, area / MIN_SAMPLES);
        let mut samples = Vec::new();
        for _ in 0..ROUNDS {
            samples = region.samples(area_each);
            let n = samples.iter().filter(|s| s.area > 0.0).count() as f64 * places;
            if n >= 0.9 * MIN_SAMPLES {
                break;
            }
            area_each *= (n / MIN_SAMPLES).clamp(0.01, 1.0);
        }
        Ok(samples)
    }

    fn measured(
        &self,
        (job, setup): (&Job, &Setup<'_>),
        sweeps: &[SweptCutter],
        reach: f64,
        stages: &dyn Stages,
    ) -> Result<RemainingOnRegion, Failure> {
        let region = self.region(setup)?;
        let samples = self.samples(job, &region)?;
        let on = |(place, sample): (usize, RegionSample)| Sampled {
            place,
            sample,
            on: surface_place(setup, &self.places[place], &sample, reach),
        };
        let all: Vec<Sampled> =
            (0..self.places.len()).flat_map(|k| samples.iter().map(move |s| (k, *s))).map(on).collect();
        let monitor = stages.start(MATERIAL, all.len());
        let heights = |of: &[Sampled]| {
            let on: Vec<SurfacePlace> = of.iter().map(|s| s.on).collect();
            left_heights(sweeps, &on, &*monitor).map_err(|_| Failure::Interrupted)
        };
        let mut measured = MaterialLeft::new(&all, &heights(&all)?);
        let spacing = measured.spacing();
        let near = |k: &usize| {
            let Sampled { place, sample, .. } = all[*k];
            region.around(&sample, spacing / FINER).into_iter().map(move |s| (place, s)).map(on)
        };
        let finer: Vec<Sampled> = measured.highest(LARGEST_PLACES).iter().flat_map(near).collect();
        measured.add(&finer, &heights(&finer)?);
        drop(monitor);
        Ok(remaining_on_region(self.operation, self.limit, &measured))
    }
}

/// Sample in a place of the pattern.
#[derive(Clone, Copy)]
struct Sampled {
    place: usize,
    sample: RegionSample,
    on: SurfacePlace,
}

/// Material left on samples.
#[derive(Default)]
pub struct MaterialLeft {
    /// Area of each sample, mm²; zero for borders and for those around the largest.
    pub areas: Vec<f64>,
    /// Samples.
    pub on: Vec<SurfacePlace>,
    /// Heights left on them.
    pub left: Vec<LeftHeight>,
}

impl MaterialLeft {
    fn new(of: &[Sampled], left: &[LeftHeight]) -> Self {
        let mut measured = Self::default();
        measured.add(of, left);
        measured
    }

    fn add(&mut self, of: &[Sampled], left: &[LeftHeight]) {
        self.areas.extend(of.iter().map(|s| s.sample.area));
        self.on.extend(of.iter().map(|s| s.on));
        self.left.extend(left);
    }

    /// Returns the number of samples with an area.
    pub fn n_of_area(&self) -> usize {
        self.areas.iter().filter(|&&a| a > 0.0).count()
    }

    /// Returns the approximate distance between samples, mm.
    pub fn spacing(&self) -> f64 {
        (self.areas.iter().sum::<f64>() / self.n_of_area().max(1) as f64).sqrt()
    }

    /// Returns the indices of the highest samples, the highest first; of equal ones the first.
    fn highest(&self, n: usize) -> Vec<usize> {
        let mut all: Vec<usize> = (0..self.left.len()).collect();
        all.sort_by(|&a, &b| self.left[b].height.total_cmp(&self.left[a].height));
        all.truncate(n);
        all
    }
}

/// Returns a sample in a place of the pattern, on the surface to be left, with the stock above it.
/// If the job states no stock, assumes material up to the cutter's reach, so that a place that no
/// cut approaches does not count as finished.
fn surface_place(setup: &Setup<'_>, place: &Isometry3<f64>, sample: &RegionSample, reach: f64) -> SurfacePlace {
    let normal = place * sample.normal;
    let position = place * sample.position + normal.into_inner() * setup.drive_allowance;
    let feed = normal.into_inner().cross(&if normal.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() });
    let above = CcPoint::new(position, normal.into_inner(), feed).map_or(0.0, |cc| setup.stock_above(&cc));
    let stock = if above > 0.0 || setup.stock_solid.is_some() { above.min(MAX_HEIGHT) } else { reach };
    SurfacePlace { position, normal, stock }
}

/// Greatest measured height, mm.
const MAX_HEIGHT: f64 = 1000.0;

/// Returns the fraction of the drive surface that no operation is to cut, in any place of its
/// pattern.
fn outside(setup: &Setup<'_>, requested: &[OperationRegion<'_>]) -> Result<f64, Failure> {
    let whole = Region { groups: Some(setup.drive_groups.clone()), ..Region::default() };
    let surface = &setup.around_drive;
    let drive = RequestedRegion::new(surface, &whole, None).map_err(|e| Failure::Internal(e.to_string()))?;
    let regions = requested.iter().map(|a| a.region(setup)).collect::<Result<Vec<_>, _>>()?;
    let is_requested = |triangle: u32, p: &Point3<f64>| {
        requested.iter().zip(&regions).any(|(a, region)| {
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
    let area = |all: &[RegionSample]| all.iter().fold(0.0, |sum, s| sum + s.area);
    let outside: Vec<RegionSample> =
        samples.iter().filter(|s| !is_requested(s.triangle, &s.position)).copied().collect();
    Ok(area(&outside) / area(&samples).max(f64::MIN_POSITIVE))
}

/// Returns the heights that fractions of the area do not exceed; 0 if there is no area.
pub fn quantiles<const N: usize>(areas: &[f64], left: &[LeftHeight], shares: [f64; N]) -> [f64; N] {
    let mut sorted: Vec<(f64, f64)> = left.iter().map(|l| l.height).zip(areas.iter().copied()).collect();
    sorted.retain(|(_, area)| *area > 0.0);
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let area: f64 = sorted.iter().map(|(_, area)| area).sum();
    shares.map(|share| {
        let mut below = 0.0;
        let reached = sorted.iter().find(|(_, each)| {
            below += each;
            below >= share * area
        });
        reached.or(sorted.last()).map_or(0.0, |(height, _)| *height)
    })
}

/// Returns the figures of the material left on samples.
pub fn remaining_on_region(operation: &OperationFile, limit_mm: f64, measured: &MaterialLeft) -> RemainingOnRegion {
    let MaterialLeft { areas, on, left } = measured;
    let area: f64 = areas.iter().sum();
    let share = |is: &dyn Fn(usize) -> bool| {
        (0..left.len()).filter(|&k| is(k)).map(|k| areas[k]).fold(0.0, |sum, a| sum + a) / area.max(f64::MIN_POSITIVE)
    };
    let above_fraction = share(&|k| left[k].height > limit_mm);
    // Stock unchanged by the cut is not finished, however thin.
    let never_cut_fraction = share(&|k| left[k].cut_by.is_none() && on[k].stock > ACCURACY);
    let higher = |a: usize, b: usize| if left[b].height > left[a].height { b } else { a };
    let largest = (0..left.len()).reduce(higher).map(|k| RemainingPlace {
        height_mm: left[k].height,
        at_mm: on[k].position.into(),
        line: left[k].cut_by,
    });
    let [p50_mm, p90_mm, p99_mm] = quantiles(areas, left, [0.5, 0.9, 0.99]);
    let (allowed, samples) = (operation.finish, measured.n_of_area());
    RemainingOnRegion {
        operation: operation.name.clone(),
        area_mm2: area,
        samples,
        spacing_mm: measured.spacing(),
        p50_mm,
        p90_mm,
        p99_mm,
        largest,
        limit_mm,
        above_fraction,
        never_cut_fraction,
        allowed,
        exceeded: samples == 0
            || above_fraction > allowed.max_above_fraction
            || never_cut_fraction > allowed.max_never_cut_fraction,
    }
}
