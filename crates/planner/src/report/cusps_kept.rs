//! Cusps along the passes of an operation: whether the limit is kept, the measures taken for it,
//! and reasons if it is not.

use facemill_cl_data::Aabb;
use facemill_job::format::job_file::{OperationFile, PathFile};
use facemill_job::format::report::cusps::{CuspReasonReport, CuspsKeptReport};
use facemill_job::format::report::remaining::RemainingReport;
use facemill_job::frames::places;
use facemill_surface_model::Tree;
use facemill_tool_model::Cusp;
use facemill_verification::remaining::LeftPlace;
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

/// Returns for each operation whether the text keeps its cusp beside all points with higher
/// predicted ridges: every place of its region within the step-over of such a point is measured to
/// be at most as high. Strips that places of the measurement may miss keep their prediction.
pub(crate) fn kept_by_text(
    operations: &[PlannedOperation<'_>],
    remaining: &RemainingReport,
    left: impl Fn(&str) -> Option<Vec<LeftPlace>>,
) -> Vec<bool> {
    let of = |planned: &PlannedOperation<'_>| {
        let (beyond, cusp) = (points_beyond(planned), planned.operation.tolerances.cusp_mm);
        let measured = remaining.operations.iter().find(|r| r.operation == planned.operation.name);
        let Some((measured, left)) = measured.zip(left(&planned.operation.name)).filter(|_| !beyond.is_empty()) else {
            return false;
        };
        let boxes: Vec<Aabb> = left.iter().map(|place| Aabb::of_points([&place.position])).collect();
        let tree = Tree::build(&boxes);
        beyond.iter().all(|point| {
            let mut highest: Option<f64> = None;
            let near = |b: &Aabb| b.distance_sq(&point.in_first) <= point.step_over * point.step_over;
            tree.visit_boxes(near, |k| {
                let height = left[k as usize].height;
                highest = Some(highest.map_or(height, |h| h.max(height)));
            });
            point.step_over >= STRIP_PER_SPACING * measured.spacing_mm && highest.is_some_and(|h| h <= cusp)
        })
    };
    operations.iter().map(of).collect()
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
