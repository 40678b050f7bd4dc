//! Efficiency of passes: their length over the least length that the strip widths of their postures
//! permit.

use facemill_cc_path::{RegionSample, RequestedRegion};
use facemill_cl_data::CcPoint;
use facemill_cutter_location::cusp::cut_point::CutPoint;
use facemill_cutter_location::cusp::strips::{LengthFloors, NearestCuts, StripWidths};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::OperationFile;
use facemill_job::format::report::efficiency::EfficiencyReport;
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::cell::budget;
use facemill_nc_program::ReadProgram;
use facemill_virtual_machine::VirtualSetup;
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

use crate::operation_region::OperationRegion;
use crate::text_passes::{TouchedSurface, passes_of_text};

/// Smallest and largest number of samples of an operation's region: widths vary little between
/// neighbouring places, and a thousandth of the floor is enough.
const SAMPLES: [f64; 2] = [4_000.0, 8_000.0];

/// Largest distance of a sample from its foot on the surface, mm: rounding.
const SAME_SURFACE: f64 = 1e-3;

/// Cuts of an operation.
#[derive(Clone, Debug, Default)]
pub struct OperationCuts {
    /// Passes in each place of the pattern, CC points on the surface to be left.
    pub places: Vec<Vec<Vec<CutPoint>>>,
    /// Length of the tip's path in entries and exits, mm, where it is known.
    pub approach_length: Option<f64>,
}

impl OperationCuts {
    /// Returns the length of the passes over the surface, mm.
    fn passes_length(&self) -> f64 {
        let length = |pass: &Vec<CutPoint>| -> f64 {
            pass.windows(2).map(|w| (w[1].cc.position - w[0].cc.position).norm()).sum()
        };
        self.places.iter().flatten().map(length).sum()
    }
}

/// Returns the efficiency of an operation's passes (docs/method.md#efficiency); `None` where it has
/// no passes, or its region has no samples.
///
/// `job` is the job as the head of the operation sees it.
///
/// # Errors
/// If the region is wrong.
pub fn efficiency(
    job: &Job,
    setup: &Setup<'_>,
    operation: &OperationFile,
    mut cuts: OperationCuts,
) -> Result<Option<EfficiencyReport>, Failure> {
    let requested = OperationRegion::of(job, setup, operation)?;
    if requested.has_nothing_left() {
        return Ok(None);
    }
    let region = requested.region(job, setup)?;
    let samples = requested.samples(job, &region, SAMPLES)?;
    if operation.region().extend_mm > 0.0 {
        // Passes beyond the border are none of the region's.
        let reach = ON_REGION + setup.drive_allowance.abs();
        for (place, passes) in requested.places.iter().zip(&mut cuts.places) {
            *passes = within(passes, (&region, reach), place);
        }
    }
    let passes_length = cuts.passes_length();
    let cutting_length = cuts.approach_length.map(|approach| passes_length + approach);
    let mut floors = LengthFloors::default();
    let mut n_samples = 0;
    for (place, passes) in requested.places.iter().zip(cuts.places) {
        let nearest = NearestCuts::new(passes);
        let widths = |sample: &RegionSample| widths_at(job, setup, operation, (place, &nearest), sample);
        let found: Vec<Option<(f64, StripWidths)>> = samples.par_iter().map(widths).collect();
        found.iter().flatten().for_each(|(area, widths)| floors.add(*area, widths));
        n_samples += found.iter().flatten().count();
    }
    if n_samples == 0 {
        return Ok(None);
    }
    let LengthFloors { area, as_cut, least } = floors;
    Ok(Some(EfficiencyReport {
        operation: operation.name.clone(),
        area_mm2: area,
        samples: n_samples,
        passes_length_mm: passes_length,
        cutting_length_mm: cutting_length,
        floor_mm: as_cut,
        least_floor_mm: least,
        efficiency: passes_length / as_cut,
        with_entries: cutting_length.map(|length| length / as_cut),
        over_least_floor: passes_length / least,
    }))
}

/// Returns area and strip widths of a sample in a place of the pattern, with feed and posture of
/// the nearest pass; `None` for samples without area, and without passes.
fn widths_at(
    job: &Job,
    setup: &Setup<'_>,
    operation: &OperationFile,
    (place, nearest): (&Isometry3<f64>, &NearestCuts),
    sample: &RegionSample,
) -> Option<(f64, StripWidths)> {
    if sample.area <= 0.0 {
        return None;
    }
    let surface = &setup.around_drive;
    let foot = surface.closest_point(&sample.position, SAME_SURFACE)?;
    let (normal, curvature) = (surface.normal_at(&foot), surface.curvature_at(&foot));
    let to_be_left: Point3<f64> = sample.position + normal.into_inner() * setup.drive_allowance;
    let cut = nearest.nearest(&(place * to_be_left), &(place * normal))?;
    let cc = cut.cc.transformed(&place.inverse());
    // A feed along the normal of the sample has no direction there: at a crease.
    let cc = CcPoint::new(to_be_left, normal.into_inner(), cc.feed.into_inner()).unwrap_or(cc);
    let at = CutPoint { cc, posture: cut.posture };
    let tolerances = &operation.tolerances;
    let largest = tolerances.max_step_over_mm;
    let widths = StripWidths::at(job.tool.cutter(), &at, curvature.as_ref(), (tolerances.cusp_mm, largest));
    Some((sample.area, widths))
}

/// Distance from the region within which a cut counts for it, mm: more than rounding of the text,
/// less than any step.
const ON_REGION: f64 = 0.01;

/// Returns the efficiency of the passes that a text cuts, for each operation with a pass in its
/// region. A pass in the regions of several operations counts for each.
///
/// `heads` are the job and the machine as each head sees them.
///
/// # Errors
/// If a region is wrong.
pub fn efficiencies_of_text(
    heads: &[(&Job, &VirtualSetup<'_>)],
    setup: &Setup<'_>,
    program: &ReadProgram,
) -> Result<Vec<EfficiencyReport>, Failure> {
    let mut found = Vec::new();
    for (h, (job, at)) in heads.iter().enumerate() {
        let own: Vec<&OperationFile> =
            job.operations_of(setup.file).map(|(_, o)| o).filter(|o| o.head as usize == h + 1).collect();
        // Within the depths that the budget permits; entries and exits are farther, but for their
        // last millimetres.
        let Some(tolerance) = own.iter().map(|o| budget(job, o).simulated()).reduce(f64::max) else { continue };
        let allowances = vec![setup.drive_allowance; setup.around_drive.mesh().triangles().len()];
        let touched = TouchedSurface { surface: &setup.around_drive, allowances: &allowances, tolerance };
        let passes = passes_of_text(program, at, &touched);
        for operation in own {
            let requested = OperationRegion::of(job, setup, operation)?;
            if requested.has_nothing_left() {
                continue;
            }
            let region = requested.region(job, setup)?;
            let places = requested.places.iter().map(|place| within(&passes, (&region, ON_REGION), place)).collect();
            found.extend(efficiency(job, setup, operation, OperationCuts { places, approach_length: None })?);
        }
    }
    Ok(found)
}

/// Returns the stretches of passes within a reach (mm) of a region in a place of its pattern.
fn within(
    passes: &[Vec<CutPoint>],
    (region, reach): (&RequestedRegion<'_>, f64),
    place: &Isometry3<f64>,
) -> Vec<Vec<CutPoint>> {
    let is_on = |point: &CutPoint| region.is_near(&place.inverse_transform_point(&point.cc.position), reach);
    let stretches = |pass: &Vec<CutPoint>| -> Vec<Vec<CutPoint>> {
        let on: Vec<(CutPoint, bool)> = pass.iter().map(|p| (*p, is_on(p))).collect();
        let runs = on.chunk_by(|a, b| a.1 == b.1).filter(|run| run[0].1 && run.len() > 1);
        runs.map(|run| run.iter().map(|(p, _)| *p).collect()).collect()
    };
    let of_passes: Vec<Vec<Vec<CutPoint>>> = passes.par_iter().map(stretches).collect();
    of_passes.concat()
}
