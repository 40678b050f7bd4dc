//! Material that a program leaves on the surface that its operations are to cut, measured on its
//! text.

mod left_islands;
pub mod open_regions;

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use facemill_cc_path::strategies::Region;
use facemill_cc_path::{RegionSample, RequestedRegion};
use facemill_cl_data::{CcPoint, Silent};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::OperationFile;
use facemill_job::format::report::remaining::{
    LevelAreas, RemainingOnDrive, RemainingOnRegion, RemainingOnSlope, RemainingReport,
};
use facemill_job::load::job::{Job, Setup, SetupLevel};
use facemill_job::setup::left_stock::swept_before;
use facemill_job::stages::{MATERIAL, Stages};
use facemill_nc_program::ReadProgram;
use facemill_virtual_machine::{VerifySettings, VirtualSetup, swept_by_cuts};
use facemill_z_map::{LeftHeight, SurfacePlace, SweptCutter, left_heights};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::material_left::{ACCURACY, MOTION_TOLERANCE, MaterialLeft, Sampled, quantiles};
use crate::named_results::not_verified;
use crate::operation_region::OperationRegion;
use crate::remaining::left_islands::left_islands;
use crate::remaining::open_regions::{OpenCusps, OpenRegion};

/// Largest number of samples of an operation's region, without its border: 100,000 take a second of
/// processor time on the sample job.
const MAX_SAMPLES: f64 = 100_000.0;

/// Smallest number of samples.
const MIN_SAMPLES: f64 = 10_000.0;

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

/// Heights that are left beside the blocks of a program.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LeftByLine {
    /// Largest distance between the places that are measured, mm.
    pub spacing_mm: f64,
    /// Greatest height of the places that the block of a line cuts lower than all others, mm. Lines
    /// without such a place are missing: they may leave less, or something between the places.
    pub heights_mm: BTreeMap<u32, f64>,
}

impl LeftByLine {
    fn add(&mut self, measured: &MaterialLeft) {
        self.spacing_mm = self.spacing_mm.max(measured.spacing());
        for (line, height) in measured.left.iter().filter_map(|left| Some((left.cut_by?, left.height))) {
            let known = self.heights_mm.entry(line).or_insert(height);
            *known = known.max(height);
        }
    }
}

/// Material that a program leaves, by operations and by lines.
pub struct Remaining {
    /// Figures of the operations.
    pub report: RemainingReport,
    /// Heights beside the blocks.
    pub by_line: LeftByLine,
    /// Places that were measured, of each operation of the report.
    pub places: Vec<Vec<LeftPlace>>,
    sweeps: Sweeps,
}

/// Everything that the program of a setup cuts, by all heads.
#[derive(Clone)]
pub struct ProgramSweeps(Arc<Vec<SweptCutter>>);

impl fmt::Debug for ProgramSweeps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let motions: Vec<usize> = self.0.iter().map(SweptCutter::n_motions).collect();
        f.debug_tuple("ProgramSweeps").field(&motions).finish()
    }
}

impl ProgramSweeps {
    /// Returns the heights that the program leaves on places of its workpiece frame.
    ///
    /// # Errors
    /// If the measurement is cancelled.
    pub fn heights(&self, on: &[SurfacePlace]) -> Result<Vec<LeftHeight>, Failure> {
        left_heights(&self.0[..], on, &Silent).map_err(|_| Failure::Interrupted)
    }
}

/// A point near a surface whose height is wanted.
#[derive(Clone, Copy, Debug)]
pub struct NearSurface {
    /// Place of the pattern, by its index.
    pub copy: usize,
    /// The point, in the first place of the pattern, mm.
    pub point: Point3<f64>,
    /// Largest distance of the place on the surface from it, mm.
    pub reach: f64,
}

impl Remaining {
    /// Returns the regions on which the program does not keep its operations' limits, for later
    /// programs; `cusps` are those that stay open, by places in the report's list of operations.
    #[must_use]
    pub fn open_regions(&self, mut cusps: BTreeMap<usize, OpenCusps>) -> Vec<OpenRegion> {
        let measured = self.report.operations.iter().zip(&self.places).enumerate();
        measured.filter_map(|(k, (left, places))| OpenRegion::of(left, places, cusps.remove(&k))).collect()
    }

    /// Returns what the program cuts, without what those before it have cut.
    #[must_use]
    pub fn into_sweeps(self) -> ProgramSweeps {
        ProgramSweeps(Arc::new(self.sweeps.sweeps))
    }

    /// Measures the height at the place of an operation's region that is nearest to each point;
    /// `None` where it is outside the region or farther than the point's reach. `operation` is an
    /// index of the report's operations.
    ///
    /// # Errors
    /// If a region is wrong, or there is no such operation.
    pub fn left_near(
        &self,
        (job, setup): (&Job, &Setup<'_>),
        operation: usize,
        points: &[NearSurface],
    ) -> Result<Vec<Option<LeftPlace>>, Failure> {
        let measured = requested_regions(job, setup)?.into_iter().filter(|region| !region.has_nothing_left());
        let no_operation = || Failure::Internal(format!("no operation {operation} was measured"));
        let requested = measured.into_iter().nth(operation).ok_or_else(no_operation)?;
        let region = requested.region(job, setup)?;
        let sampled = |near: &NearSurface| {
            let sample = region.sample_at(&near.point, near.reach)?;
            Some(sampled_in(setup, (near.copy, requested.places.get(near.copy)?), sample, self.sweeps.reach))
        };
        let sampled: Vec<Option<Sampled>> = points.iter().map(sampled).collect();
        let mut found: Vec<Sampled> = sampled.iter().flatten().copied().collect();
        cut_before(&self.sweeps.before, &mut found)?;
        let on: Vec<SurfacePlace> = found.iter().map(|s| s.on).collect();
        let heights = left_heights(&self.sweeps.sweeps, &on, &Silent).map_err(|_| Failure::Interrupted)?;
        let mut left = left_on(&found, &MaterialLeft::new(&found, &heights)).into_iter();
        Ok(sampled.iter().map(|s| s.and_then(|_| left.next())).collect())
    }
}

/// Measures the material that a program leaves on the regions of a setup's operations; `None` if no
/// operation of the setup is known, or their regions are limited to what is left and nothing is.
///
/// Every cut of the program counts, regardless of its operation, and every one of the programs
/// before it as far as these are known ([`swept_before`]); without them the stock of the setup is
/// there. The region is the surface that the job states: groups, cone, box and levels of the
/// strategy, in all places of the pattern, regardless of the generated passes.
///
/// # Errors
/// If a region is wrong, or the stages are cancelled.
pub fn remaining(
    job: &Job,
    setup: &Setup<'_>,
    program: &ReadProgram,
    heads: &[RunningHead<'_>],
    stages: &dyn Stages,
) -> Result<Option<Remaining>, Failure> {
    let mut requested = requested_regions(job, setup)?;
    requested.retain(|region| !region.has_nothing_left());
    if requested.is_empty() {
        return Ok(None);
    }
    let sweeps = Sweeps::of((job, setup), program, heads)?;
    let up = setup.table_from_work.inverse_transform_vector(&Vector3::z());
    let regions = requested.iter().map(|r| r.region(job, setup)).collect::<Result<Vec<_>, _>>()?;
    let (mut operations, mut places, mut by_line) = (Vec::new(), Vec::new(), LeftByLine::default());
    for (requested, region) in requested.iter().zip(&regions) {
        let (measured, samples) = measured((requested, region), (job, setup), &sweeps, stages)?;
        let mut on_region = remaining_on_region(requested.operation, requested.limit, &measured, &up);
        if let Some(areas) = level_areas(setup, &sweeps, &on_region)? {
            count_level(&mut on_region, areas);
        }
        operations.push(on_region);
        by_line.add(&measured);
        places.push(left_on(&samples, &measured));
    }
    let drive = remaining_on_drive(setup, (&requested, &regions), &sweeps)?;
    let report = RemainingReport { accuracy_mm: ACCURACY, drive, operations };
    Ok(Some(Remaining { report, by_line, places, sweeps }))
}

/// A place of an operation's region.
#[derive(Clone, Copy, Debug)]
pub struct LeftPlace {
    /// Position on the drive surface, in the first place of the pattern.
    pub position: Point3<f64>,
    /// Normal of the surface there.
    pub normal: Unit<Vector3<f64>>,
    /// Area that it represents, mm², on a region that is a line its length, mm; 0 on borders and
    /// around the highest ones.
    pub weight: f64,
    /// Height left on it, mm.
    pub height: f64,
    /// Whether any cut reaches the stock above it.
    pub is_cut: bool,
    /// Whether no cut reaches it and material is left on it that the operation is to cut.
    pub is_never_cut: bool,
    /// The place on the surface to be left, in its place of the pattern, with the height left as
    /// its stock.
    pub left: SurfacePlace,
}

/// Measures the heights that a program leaves on places spread over the region of each operation of
/// a setup, as [`remaining`] does; none where a region is limited to what is left and nothing is.
///
/// # Errors
/// If a region is wrong, or the stages are cancelled.
pub fn left_places(
    job: &Job,
    setup: &Setup<'_>,
    program: &ReadProgram,
    heads: &[RunningHead<'_>],
    stages: &dyn Stages,
) -> Result<Vec<Vec<LeftPlace>>, Failure> {
    let sweeps = Sweeps::of((job, setup), program, heads)?;
    let of_region = |requested: OperationRegion<'_>| {
        if requested.has_nothing_left() {
            return Ok(Vec::new());
        }
        let region = requested.region(job, setup)?;
        let (measured, samples) = measured((&requested, &region), (job, setup), &sweeps, stages)?;
        Ok(left_on(&samples, &measured))
    };
    requested_regions(job, setup)?.into_iter().map(of_region).collect()
}

/// Returns the heights on samples as places.
fn left_on(samples: &[Sampled], measured: &MaterialLeft) -> Vec<LeftPlace> {
    let place = |(k, (s, left)): (usize, (&Sampled, &LeftHeight))| LeftPlace {
        position: s.sample.position,
        normal: s.sample.normal,
        weight: s.sample.weight(),
        height: left.height,
        is_cut: left.cut_by.is_some() || s.was_cut || s.on.stock <= ACCURACY,
        is_never_cut: measured.is_never_cut(k),
        left: SurfacePlace { stock: left.height, ..s.on },
    };
    samples.iter().zip(&measured.left).enumerate().map(place).collect()
}

/// Returns the regions of a setup's operations.
fn requested_regions<'a>(job: &'a Job, setup: &Setup<'a>) -> Result<Vec<OperationRegion<'a>>, Failure> {
    job.operations_of(setup.file).map(|(_, operation)| OperationRegion::of(job, setup, operation)).collect()
}

/// Everything that the heads of a machine sweep.
struct Sweeps {
    sweeps: Vec<SweptCutter>,
    /// Those of the programs before.
    before: Arc<Vec<Arc<SweptCutter>>>,
    /// Radius of the largest cutter, mm.
    reach: f64,
}

impl Sweeps {
    fn of((job, setup): (&Job, &Setup<'_>), program: &ReadProgram, heads: &[RunningHead<'_>]) -> Result<Self, Failure> {
        let before = swept_before(job, setup)?;
        let radii = heads.iter().map(|h| h.at.tool.cutter().radius()).chain(before.iter().map(|sweep| sweep.radius()));
        let reach = radii.fold(0.0, f64::max);
        let sweep = |h: &RunningHead<'_>| swept_by_cuts(program, h.at, h.settings, MOTION_TOLERANCE, &Silent);
        let sweeps = heads.iter().map(sweep).collect::<Result<_, _>>().map_err(not_verified)?;
        Ok(Self { sweeps, before, reach })
    }
}

/// Returns the heights left on an operation's region, with the samples that they are left on.
fn measured(
    (requested, region): (&OperationRegion<'_>, &RequestedRegion<'_>),
    (job, setup): (&Job, &Setup<'_>),
    Sweeps { sweeps, before, reach }: &Sweeps,
    stages: &dyn Stages,
) -> Result<(MaterialLeft, Vec<Sampled>), Failure> {
    let samples = requested.samples(job, region, [MIN_SAMPLES, MAX_SAMPLES])?;
    let on = |(place, sample)| sampled_in(setup, (place, &requested.places[place]), sample, *reach);
    let mut all: Vec<Sampled> =
        (0..requested.places.len()).flat_map(|k| samples.iter().map(move |s| (k, *s))).map(on).collect();
    let monitor = stages.start(MATERIAL, all.len());
    cut_before(before, &mut all)?;
    let heights = |of: &[Sampled]| {
        let on: Vec<SurfacePlace> = of.iter().map(|s| s.on).collect();
        left_heights(sweeps, &on, &*monitor).map_err(|_| Failure::Interrupted)
    };
    let mut measured = MaterialLeft::new(&all, &heights(&all)?);
    measured.uncut_up_to = requested.operation.region().left_above.as_ref().map_or(0.0, |left| left.height_mm);
    let spacing = measured.spacing();
    let near = |k: &usize| {
        let Sampled { place, sample, .. } = all[*k];
        region.around(&sample, spacing / FINER).into_iter().map(move |s| (place, s)).map(on)
    };
    let mut finer: Vec<Sampled> = measured.highest(LARGEST_PLACES).iter().flat_map(near).collect();
    cut_before(before, &mut finer)?;
    measured.add(&finer, &heights(&finer)?);
    all.extend(finer);
    Ok((measured, all))
}

/// Returns a sample in a place of the pattern, given by its index and its pose.
fn sampled_in(setup: &Setup<'_>, (place, pose): (usize, &Isometry3<f64>), sample: RegionSample, reach: f64) -> Sampled {
    Sampled { place, sample, on: surface_place(setup, pose, &sample, reach), was_cut: false }
}

/// Lowers the stock on samples to what the programs before leave of it.
fn cut_before(before: &[Arc<SweptCutter>], of: &mut [Sampled]) -> Result<(), Failure> {
    if before.is_empty() {
        return Ok(());
    }
    let on: Vec<SurfacePlace> = of.iter().map(|s| s.on).collect();
    let left = left_heights(before, &on, &Silent).map_err(|_| Failure::Interrupted)?;
    of.iter_mut().zip(left).for_each(|(s, left)| {
        (s.on.stock, s.was_cut) = (left.height, left.cut_by.is_some());
    });
    Ok(())
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

/// Returns the areas of a setup's level, from what its program leaves on the part of it that the
/// tool reaches; `None` of a setup without a level.
fn level_areas(setup: &Setup<'_>, sweeps: &Sweeps, left: &RemainingOnRegion) -> Result<Option<LevelAreas>, Failure> {
    let Some(SetupLevel { level, depth, is_later, .. }) = &setup.level else { return Ok(None) };
    let (depth, is_later) = (*depth, *is_later);
    let plane = level.plane();
    let (normal, feed) = (plane.axis(), plane.at(1.0, 0.0) - plane.at(0.0, 0.0));
    let on = |(position, _): (Point3<f64>, bool)| {
        let above = CcPoint::new(position, normal.into_inner(), feed).map_or(0.0, |cc| setup.stock_above(&cc));
        SurfacePlace { position, normal, stock: above.min(MAX_HEIGHT) }
    };
    let mut places: Vec<SurfacePlace> = level.reach().middles().map(on).collect();
    if !sweeps.before.is_empty() {
        let heights = left_heights(sweeps.before.as_slice(), &places, &Silent).map_err(|_| Failure::Interrupted)?;
        places.iter_mut().zip(heights).for_each(|(place, left)| place.stock = left.height);
    }
    let (reach, limit) = (level.reach(), left.limit_mm);
    let may_be_swept = setup.level_rooms().map_or_else(Vec::new, |[room, _]| reach.may_be_swept(&room));
    let is_stock: Vec<bool> = places.iter().map(|place| place.stock > limit).collect();
    let is_open = |k: usize| is_stock[k] && !reach.is_swept(k) && may_be_swept[k];
    let open: Vec<SurfacePlace> = (0..places.len()).filter(|&k| is_open(k)).map(|k| places[k]).collect();
    let is_thick = |k: usize| is_later && reach.is_swept(k) && places[k].stock > depth + limit;
    let thick: Vec<SurfacePlace> = (0..places.len()).filter(|&k| is_thick(k)).map(|k| places[k]).collect();
    let area_left = |of: &[SurfacePlace]| -> Result<f64, Failure> {
        let heights = left_heights(&sweeps.sweeps, of, &Silent).map_err(|_| Failure::Interrupted)?;
        let n = heights.iter().filter(|left| left.height > limit).count();
        Ok(n as f64 * reach.cell() * reach.cell())
    };
    Ok(Some(LevelAreas {
        height_mm: plane.height(),
        before_mm2: reach.area(|k| is_stock[k]),
        part_mm2: reach.area(|k| is_stock[k] && !reach.is_swept(k) && !may_be_swept[k]),
        uncertain_mm2: area_left(&open)?,
        missed_mm2: left.above_fraction * left.area_mm2,
        uncut_above_mm2: area_left(&thick)?,
    }))
}

/// Counts what is uncertain on a level as left above the limit, and a level of which nothing is
/// reached as unfinished where there is material.
fn count_level(left: &mut RemainingOnRegion, areas: LevelAreas) {
    let all = left.area_mm2 + areas.uncertain_mm2;
    left.above_fraction = (areas.missed_mm2 + areas.uncertain_mm2) / all.max(f64::MIN_POSITIVE);
    left.exceeded |= left.above_fraction > left.allowed.max_above_fraction;
    left.exceeded |= left.samples == 0 && areas.before_mm2 > 0.0;
    left.level = Some(areas);
}

/// Returns what is left on all of the drive surface, in the first place of the pattern, also where
/// no operation is to cut.
fn remaining_on_drive(
    setup: &Setup<'_>,
    (requested, regions): (&[OperationRegion<'_>], &[RequestedRegion<'_>]),
    Sweeps { sweeps, before, reach }: &Sweeps,
) -> Result<RemainingOnDrive, Failure> {
    let whole = Region { groups: Some(setup.drive_groups.clone()), ..Region::default() };
    let surface = &setup.around_drive;
    let drive = RequestedRegion::new(surface, &whole, None).map_err(|e| Failure::Internal(e.to_string()))?;
    let is_requested = |triangle: u32, p: &Point3<f64>| {
        requested.iter().zip(regions).any(|(a, region)| {
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
    let on = |sample| sampled_in(setup, (0, &Isometry3::identity()), sample, *reach);
    let mut all: Vec<Sampled> =
        drive.samples(drive.facet_area() / DRIVE_SAMPLES).into_iter().filter(|s| s.area > 0.0).map(on).collect();
    cut_before(before, &mut all)?;
    let places: Vec<SurfacePlace> = all.iter().map(|s| s.on).collect();
    let left = left_heights(sweeps, &places, &Silent).map_err(|_| Failure::Interrupted)?;
    let limit_mm = requested.iter().map(|r| r.limit).fold(f64::INFINITY, f64::min);
    let area_where = |is: &dyn Fn(&Sampled, &LeftHeight) -> bool| {
        all.iter().zip(&left).filter(|(s, l)| is(s, l)).fold(0.0, |sum, (s, _)| sum + s.sample.area)
    };
    let area = area_where(&|_, _| true);
    let fraction = |is: &dyn Fn(&Sampled, &LeftHeight) -> bool| area_where(is) / area.max(f64::MIN_POSITIVE);
    Ok(RemainingOnDrive {
        area_mm2: drive.facet_area(),
        outside_fraction: fraction(&|s, _| !is_requested(s.sample.triangle, &s.sample.position)),
        limit_mm,
        above_fraction: fraction(&|_, l| l.height > limit_mm),
        never_cut_fraction: fraction(&|s, l| l.cut_by.is_none() && !s.was_cut && s.on.stock > ACCURACY),
    })
}

/// Bounds of the bands of slope, deg.
const SLOPES: [f64; 8] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0, 180.0];

/// Some samples of a region.
struct SomeSamples<'m> {
    of: &'m MaterialLeft,
    chosen: Vec<usize>,
}

impl SomeSamples<'_> {
    fn weight_where(&self, is: impl Fn(usize) -> bool) -> f64 {
        self.chosen.iter().filter(|&&k| is(k)).map(|&k| self.of.weights[k]).fold(0.0, |sum, w| sum + w)
    }

    /// Returns the area of all of them, mm², or the length, mm.
    fn weight(&self) -> f64 {
        self.weight_where(|_| true)
    }

    fn share(&self, is: impl Fn(usize) -> bool) -> f64 {
        self.weight_where(is) / self.weight().max(f64::MIN_POSITIVE)
    }

    fn above(&self, limit_mm: f64) -> f64 {
        self.share(|k| self.of.left[k].height > limit_mm)
    }

    /// Returns the share without a cut. Stock unchanged by the cut is not finished, however thin.
    fn never_cut(&self) -> f64 {
        self.share(|k| self.of.is_never_cut(k))
    }

    /// Returns the highest one, of equal ones the first.
    fn highest(&self) -> Option<usize> {
        let height = |k: usize| self.of.left[k].height;
        self.chosen.iter().copied().reduce(|a, b| if height(b) > height(a) { b } else { a })
    }

    fn quantiles<const N: usize>(&self, shares: [f64; N]) -> [f64; N] {
        let weights: Vec<f64> = self.chosen.iter().map(|&k| self.of.weights[k]).collect();
        let left: Vec<LeftHeight> = self.chosen.iter().map(|&k| self.of.left[k]).collect();
        quantiles(&weights, &left, shares)
    }
}

/// Returns the figures of the material left on samples; `up` is z of the table.
pub fn remaining_on_region(
    operation: &OperationFile,
    limit_mm: f64,
    measured: &MaterialLeft,
    up: &Vector3<f64>,
) -> RemainingOnRegion {
    let all = SomeSamples { of: measured, chosen: (0..measured.left.len()).collect() };
    let largest = all.highest().map(|k| measured.place(k));
    let islands = left_islands(measured, limit_mm);
    let [p50_mm, p90_mm, p99_mm] = all.quantiles([0.5, 0.9, 0.99]);
    let (above_fraction, never_cut_fraction) = (all.above(limit_mm), all.never_cut());
    let bands = SLOPES.windows(2).filter(|_| !measured.is_line);
    let slopes = bands.filter_map(|band| on_slope(measured, [band[0], band[1]], limit_mm, up));
    let (allowed, samples) = (operation.finish, measured.n_weighted());
    // Stock that is left beyond the border of an extended region alone is on none of it.
    let may_lie_beyond = operation.region().extend_mm > 0.0 && operation.region().left_above.is_some();
    RemainingOnRegion {
        operation: operation.name.clone(),
        area_mm2: if measured.is_line { 0.0 } else { all.weight() },
        length_mm: measured.is_line.then(|| all.weight()),
        samples,
        spacing_mm: measured.spacing(),
        p50_mm,
        p90_mm,
        p99_mm,
        largest,
        limit_mm,
        above_fraction,
        never_cut_fraction,
        islands: islands.n,
        largest_islands: islands.largest,
        slopes: slopes.collect(),
        level: None,
        allowed,
        exceeded: (samples == 0 && !may_lie_beyond)
            || above_fraction > allowed.max_above_fraction
            || never_cut_fraction > allowed.max_never_cut_fraction,
    }
}

/// Returns the figures of a band of slope; `None` where it has no area.
fn on_slope(
    measured: &MaterialLeft,
    [from_deg, to_deg]: [f64; 2],
    limit_mm: f64,
    up: &Vector3<f64>,
) -> Option<RemainingOnSlope> {
    let is_in = |k: &usize| {
        let slope = measured.on[*k].normal.angle(up).to_degrees();
        slope >= from_deg && (slope < to_deg || to_deg >= 180.0)
    };
    let band = SomeSamples { of: measured, chosen: (0..measured.left.len()).filter(is_in).collect() };
    let area_mm2 = band.weight();
    let highest = band.highest().filter(|_| area_mm2 > 0.0)?;
    let [p90_mm, p99_mm] = band.quantiles([0.9, 0.99]);
    Some(RemainingOnSlope {
        from_deg,
        to_deg,
        area_mm2,
        p90_mm,
        p99_mm,
        largest_mm: measured.left[highest].height,
        above_fraction: band.above(limit_mm),
        never_cut_fraction: band.never_cut(),
    })
}
