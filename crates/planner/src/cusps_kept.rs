//! Whether the allowed cusp is kept along the passes of an operation, what was done for it, and why not where it is not.

use facemill_tool_model::Cusp;
use nalgebra::{Isometry3, Point3};
use schemars::JsonSchema;
use serde::Serialize;

use crate::extra_passes::ExtraPasses;
use crate::job_file::{OperationFile, PathFile};
use crate::operation::PlannedOperation;
use crate::pieces::places;

/// Cusps of an operation as its passes leave them, by the postures planned.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CuspsKeptReport {
    /// Name of the operation.
    pub operation: String,
    /// Passes put beside trimmed ones, as near to them as there are postures, in one place of the pattern.
    pub moved_passes: usize,
    /// Passes put between others where the postures taken leave more than the allowed cusp, in one place of the pattern.
    pub passes_between: usize,
    /// Points with a higher ridge than allowed toward a pass before, or with a strip that stays uncut.
    pub points_beyond: usize,
    /// Why no pass was put where they are.
    pub reasons: Vec<CuspReasonReport>,
}

/// Why the allowed cusp is not kept at some points.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CuspReasonReport {
    /// Why.
    pub reason: String,
    /// Points of this reason.
    pub points: usize,
    /// Highest ridge among them; `null` where strips stay uncut at all of them.
    pub cusp_mm: Option<f64>,
    /// Where the ridge is highest, or the first strip that stays uncut.
    pub place_mm: [f64; 3],
    /// Step-over there.
    pub step_over_mm: f64,
}

/// Cusps of a planned operation against what it allows.
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
        passes_between: extra.between,
        points_beyond: reasons.iter().map(|r| r.points).sum(),
        reasons,
    }
}

impl CuspReasonReport {
    fn take(&mut self, other: Self) {
        self.points += other.points;
        // A strip that stays uncut is worse than any ridge.
        let is_worse = match (self.cusp_mm, other.cusp_mm) {
            (Some(own), Some(other)) => other > own,
            (own, other) => own.is_some() && other.is_none(),
        };
        if is_worse {
            (self.place_mm, self.step_over_mm) = (other.place_mm, other.step_over_mm);
        }
        self.cusp_mm = match (self.cusp_mm, other.cusp_mm) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (a, b) => a.or(b),
        };
    }
}

/// Why there is no pass between: the refusal nearest to the place within the strip, where there was one.
fn reason(operation: &OperationFile, extra: &ExtraPasses, place: &Point3<f64>, step_over: f64) -> String {
    if matches!(operation.path, PathFile::File(_)) {
        return "passes of a path file are cut as they lie: lay them closer".to_owned();
    }
    let near = extra.refused.iter().map(|(at, why)| ((at - place).norm(), why));
    let nearest = near.filter(|(d, _)| *d <= step_over).min_by(|a, b| a.0.total_cmp(&b.0));
    match nearest {
        Some((_, why)) => format!("no pass fits between: {why}"),
        None => "the postures there leave more, and no pass was put between".to_owned(),
    }
}
