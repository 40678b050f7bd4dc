//! Cusps along the passes of an operation: whether the limit is kept, the measures taken for it,
//! and reasons if it is not.

use facemill_job::format::job_file::{OperationFile, PathFile};
use facemill_job::format::report::cusps::{CuspReasonReport, CuspsKeptReport};
use facemill_job::frames::places;
use facemill_tool_model::Cusp;
use nalgebra::{Isometry3, Point3};

use crate::passes::extra_passes::ExtraPasses;
use crate::passes::operation::PlannedOperation;

/// Compares the cusps of a planned operation with its limit.
pub(crate) fn cusps_kept(planned: &PlannedOperation<'_>) -> CuspsKeptReport {
    let PlannedOperation { operation, extra, along, .. } = planned;
    let mut reasons: Vec<CuspReasonReport> = Vec::new();
    let places = places(operation.pattern.as_ref());
    for (piece, along) in planned.moves.pieces.iter().zip(along) {
        for at in along.iter().filter(|a| a.is_point) {
            let Some(ridge) = at.ridge.filter(|r| !r.cusp.is_within(operation.tolerances.cusp_mm)) else { continue };
            let place = piece.piece.cuts[at.cut].cc.position;
            let in_first =
                places.get(piece.piece.copy as usize).map_or(place, |p: &Isometry3<f64>| p.inverse() * place);
            let height = match ridge.cusp {
                Cusp::Height(height) => Some(height),
                Cusp::Uncut => None,
            };
            let found = CuspReasonReport {
                reason: reason(operation, extra, &in_first, ridge.step_over),
                points: 1,
                cusp_mm: height,
                place_mm: place.into(),
                step_over_mm: ridge.step_over,
            };
            match reasons.iter_mut().find(|r| r.reason == found.reason) {
                Some(same) => same.take(found),
                None => reasons.push(found),
            }
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
