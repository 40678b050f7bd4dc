//! Cusps along the passes of an operation: whether the limit is kept, the measures taken for it,
//! and reasons if it is not.

use facemill_cl_data::Aabb;
use facemill_job::format::job_file::{OperationFile, PathFile};
use facemill_job::format::report::Report;
use facemill_job::format::report::cusps::{CuspReasonReport, CuspsKeptReport};
use facemill_job::frames::places;
use facemill_surface_model::Tree;
use facemill_tool_model::Cusp;
use facemill_verification::remaining::{LeftPlace, Remaining};
use nalgebra::{Isometry3, Point3};

use crate::passes::extra_passes::ExtraPasses;
use crate::passes::operation::PlannedOperation;

/// Compares the cusps of a planned operation with its limit.
pub(crate) fn cusps_kept(planned: &PlannedOperation<'_>) -> CuspsKeptReport {
    let PlannedOperation { operation, extra, .. } = planned;
    let mut reasons: Vec<CuspReasonReport> = Vec::new();
    for beyond in points_beyond(planned) {
        let found = CuspReasonReport {
            reason: reason(operation, extra, &beyond.in_first, beyond.step_over),
            points: 1,
            cusp_mm: beyond.height,
            place_mm: beyond.place.into(),
            step_over_mm: beyond.step_over,
        };
        match reasons.iter_mut().find(|r| r.reason == found.reason) {
            Some(same) => same.take(found),
            None => reasons.push(found),
        }
    }
    reasons.sort_by_key(|r| std::cmp::Reverse(r.points));
    CuspsKeptReport {
        operation: operation.name.clone(),
        moved_passes: extra.moved,
        passes_between: extra.between + extra.over,
        points_beyond: reasons.iter().map(|r| r.points).sum(),
        kept_by_text: false,
        reasons,
        width_rounds: planned.width_rounds.clone(),
    }
}

/// A point with a higher ridge than permitted toward a pass cut before.
struct PointBeyond {
    place: Point3<f64>,
    /// The same in the first place of the pattern.
    in_first: Point3<f64>,
    step_over: f64,
    /// Predicted height, mm; `None` where the strip stays uncut.
    height: Option<f64>,
}

fn points_beyond(planned: &PlannedOperation<'_>) -> Vec<PointBeyond> {
    let operation = planned.operation;
    let places = places(operation.pattern.as_ref());
    let mut found = Vec::new();
    for (piece, along) in planned.moves.pieces.iter().zip(&planned.along) {
        for at in along.iter().filter(|a| a.is_point) {
            let Some(ridge) = at.ridge.filter(|r| !r.cusp.is_within(operation.tolerances.cusp_mm)) else { continue };
            let place = piece.piece.cuts[at.cut].cc.position;
            let in_first =
                places.get(piece.piece.copy as usize).map_or(place, |p: &Isometry3<f64>| p.inverse() * place);
            let height = match ridge.cusp {
                Cusp::Height(height) => Some(height),
                Cusp::Uncut => None,
            };
            found.push(PointBeyond { place, in_first, step_over: ridge.step_over, height });
        }
    }
    found
}

/// Least width of a strip whose measurement counts, as a multiple of the distance of its places.
const STRIP_PER_SPACING: f64 = 2.0;

/// Marks predicted cusps as kept where the text is measured to leave no more than the permitted
/// ones. `allowance` is the height of the passes above the drive surface, mm.
pub(crate) fn settle_cusps(
    report: &mut Report,
    operations: &[PlannedOperation<'_>],
    remaining: &Remaining,
    allowance: f64,
) {
    for (planned, cusps) in operations.iter().zip(&mut report.cusps).filter(|(_, cusps)| cusps.points_beyond > 0) {
        let measured = remaining.report.operations.iter().zip(&remaining.places);
        let mut own = measured.filter(|(of_region, _)| of_region.operation == cusps.operation);
        // Which of two operations of one name was measured is not known.
        let (Some((of_region, left)), None) = (own.next(), own.next()) else { continue };
        let limits = KeptLimits {
            least_strip: STRIP_PER_SPACING * of_region.spacing_mm,
            cusp: planned.operation.tolerances.cusp_mm,
            allowance,
            // Passes of files may leave the region.
            is_all_on_region: matches!(planned.operation.path, PathFile::Strategy(_)),
        };
        cusps.kept_by_text = is_kept(&points_beyond(planned), left, &limits);
    }
    if report.cusps.iter().any(|c| c.kept_by_text) {
        report.worst.cusp_exceeded = report.cusps.iter().any(|c| c.points_beyond > 0 && !c.kept_by_text);
    }
}

/// Settings of [`is_kept`].
struct KeptLimits {
    /// Narrowest strip whose measurement counts, mm.
    least_strip: f64,
    /// Permitted cusp, mm.
    cusp: f64,
    /// Height of the passes above the drive surface, mm.
    allowance: f64,
    /// Whether all passes are on the region.
    is_all_on_region: bool,
}

/// Returns whether all places measured on the region, if all passes are on it, or all within the
/// step-over of each of the points, are at most as high as the cusp. A point with too narrow a
/// strip, which places may miss, keeps its prediction.
fn is_kept(beyond: &[PointBeyond], left: &[LeftPlace], limits: &KeptLimits) -> bool {
    let is_low = |place: &LeftPlace| place.height <= limits.cusp;
    let is_low_everywhere = limits.is_all_on_region && !left.is_empty() && left.iter().all(is_low);
    let on_pass = |place: &LeftPlace| place.position + place.normal.into_inner() * limits.allowance;
    let boxes: Vec<Aabb> = left.iter().map(|place| Aabb::of_points([&on_pass(place)])).collect();
    let tree = Tree::build(&boxes);
    let is_low_beside = |point: &PointBeyond| {
        let (mut any, mut low) = (false, true);
        let near = |b: &Aabb| b.distance_sq(&point.in_first) <= point.step_over * point.step_over;
        tree.visit_boxes(near, |k| (any, low) = (true, low && is_low(&left[k as usize])));
        any && low
    };
    beyond.iter().all(|point| point.step_over >= limits.least_strip && (is_low_everywhere || is_low_beside(point)))
}

/// Returns the reason why there is no pass between: the refusal nearest to the place within the
/// strip, if there was one.
fn reason(operation: &OperationFile, extra: &ExtraPasses, place: &Point3<f64>, step_over: f64) -> String {
    if matches!(operation.path, PathFile::File(_) | PathFile::Cl(_)) {
        return "passes of a file are cut unchanged: put them closer".to_owned();
    }
    let near = extra.refused.iter().map(|(at, why)| ((at - place).norm(), why));
    let nearest = near.filter(|(d, _)| *d <= step_over).min_by(|a, b| a.0.total_cmp(&b.0));
    match nearest {
        Some((_, why)) => format!("no pass fits between: {why}"),
        None => "the postures there leave more, and no pass was inserted".to_owned(),
    }
}

#[cfg(test)]
#[path = "../../tests/unit/report/cusps_kept.rs"]
mod tests;
