//! Stock that an operation found left, and the part of it that its passes reach.

use std::sync::PoisonError;

use facemill_cc_path::{LeftIsland, LeftRegion, StripPoint};
use facemill_cl_data::CcPoint;
use facemill_cutter_location::SearchCurve;
use facemill_cutter_location::cusp::expected_strip_width;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::PathFile;
use facemill_job::format::report::left_above::{LeftAboveReport, NotReachedReport};
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::pass_surface::{extended_region, surface_of};
use facemill_surface_model::Surface;
use facemill_tool_path::segments::PassSegment;
use nalgebra::Point3;

use crate::passes::operation::PlannedOperation;

/// Largest number of parts that are listed.
const LISTED: usize = 16;

/// Share by which half a strip may be exceeded: strips of passes laid with chords on facets.
const SLACK: f64 = 0.02;

/// Returns the report of an operation whose region is limited to what is left; `None` for others,
/// and for a level, whose passes also cut behind their CC points: what is left of it is measured
/// alone.
pub(crate) fn left_above(job: &Job, setup: &Setup<'_>, planned: &PlannedOperation<'_>) -> Option<LeftAboveReport> {
    let operation = planned.operation;
    let file = operation.region().left_above.as_ref().filter(|_| setup.level.is_none())?;
    let left = setup.left_regions.lock().ok()?.get(&operation.name)?.clone();
    let extended = extended_region(job, setup, operation).ok()?;
    let surface = surface_of(setup, extended.as_deref());
    let passes: Vec<Vec<StripPoint>> = planned
        .moves
        .pieces
        .iter()
        .filter(|p| p.piece.copy == 0)
        .map(|p| strip_points((job, setup, surface), planned, &p.piece))
        .collect();
    let mut parts = left.not_reached(&passes);
    parts.sort_by(|a, b| b.area.total_cmp(&a.area));
    let not_reached: f64 = parts.iter().fold(0.0, |sum, part| sum + part.area);
    let listed = parts.iter().take(LISTED).map(|part| NotReachedReport {
        area_mm2: part.area,
        place_mm: part.highest.into(),
        reason: reason(planned, &left, part),
    });
    Some(LeftAboveReport {
        operation: operation.name.clone(),
        height_mm: file.height_mm,
        overlap_mm: file.overlap_mm,
        measured_places: left.n_measured(),
        area_mm2: left.area(),
        islands: left.islands().len(),
        reached_mm2: left.area() - not_reached,
        islands_not_reached: parts.len(),
        not_reached: listed.collect(),
    })
}

/// Refuses to write a program without any pass.
///
/// # Errors
/// [`Failure::NothingToCut`] if nothing is left on the regions of all operations,
/// [`Failure::Infeasible`] if passes on what is left are all too short.
pub(crate) fn something_to_cut(setup: &Setup<'_>, operations: &[PlannedOperation<'_>]) -> Result<(), Failure> {
    if operations.iter().any(|o| !o.moves.pieces.is_empty()) {
        return Ok(());
    }
    let known = setup.left_regions.lock().unwrap_or_else(PoisonError::into_inner);
    let heights: Vec<String> = known.values().map(|left| left.above().to_string()).collect();
    let (name, heights) = (&setup.file.name, heights.join(" and "));
    if known.values().all(|left| left.is_empty()) {
        return Err(Failure::NothingToCut(format!(
            "setup \"{name}\": nothing is left above {heights} mm, so there is nothing to cut and no program"
        )));
    }
    Err(Failure::Infeasible(format!(
        "setup \"{name}\": passes on what is left above {heights} mm are all shorter than min_pass_length_mm with their margins"
    )))
}

/// Returns the points of a pass on its surface, with the strips that passes are laid by.
fn strip_points(
    (job, setup, surface): (&Job, &Setup<'_>, &Surface),
    planned: &PlannedOperation<'_>,
    piece: &PassSegment,
) -> Vec<StripPoint> {
    let point = |cc: &CcPoint| {
        let position = cc.position - cc.normal.into_inner() * setup.drive_allowance;
        let width = strip_width((job, surface), planned, (&position, cc, &piece.curve));
        StripPoint { position, normal: cc.normal, half_width: 0.5 * (1.0 + SLACK) * width }
    };
    piece.cuts.iter().map(|cut| point(&cut.cc)).collect()
}

fn strip_width(
    (job, surface): (&Job, &Surface),
    planned: &PlannedOperation<'_>,
    (position, cc, curve): (&Point3<f64>, &CcPoint, &SearchCurve),
) -> f64 {
    let tolerances = &planned.operation.tolerances;
    let most = tolerances.max_step_over_mm;
    let curvature = surface.closest_point(position, most).and_then(|p| surface.curvature_at(&p));
    expected_strip_width(job.tool.cutter(), cc, curvature.as_ref(), curve, tolerances.cusp_mm, most)
}

/// Returns the reason why no pass reaches a part of what is left.
fn reason(planned: &PlannedOperation<'_>, left: &LeftRegion, part: &LeftIsland) -> String {
    let operation = planned.operation;
    let near = left.overlap() + operation.tolerances.max_step_over_mm;
    let is_near = |p: &Point3<f64>| part.places.iter().any(|&k| (left.places()[k].position - p).norm() <= near);
    if let Some(left_out) = planned.left_out.iter().find(|l| is_near(&l.place)) {
        return format!("points of passes there are left out: {}", left_out.reason);
    }
    let PathFile::Strategy(strategy) = &operation.path else {
        return "the path file has no pass there".to_owned();
    };
    if planned.dropped_pieces > 0 {
        let least = strategy.min_pass_length_mm;
        return format!("passes there are shorter than min_pass_length_mm ({least}) with their margins");
    }
    "passes end before it: levels or edge_margin_mm bound them".to_owned()
}
