//! Efficiency of the operations of a plan.

use facemill_cutter_location::cusp::cut_point::CutPoint;
use facemill_job::failure::Failure;
use facemill_job::format::report::efficiency::EfficiencyReport;
use facemill_job::load::job::{Job, Setup};
use facemill_tool_path::moves::{Move, MoveKind};
use facemill_verification::efficiency::{OperationCuts, efficiency};

use crate::passes::operation::PlannedOperation;

/// Returns the efficiency of each operation; `jobs` are the job as each operation's head sees it.
///
/// # Errors
/// If a region is wrong.
pub(crate) fn efficiencies(
    jobs: &[&Job],
    setup: &Setup<'_>,
    operations: &[PlannedOperation<'_>],
) -> Result<Vec<EfficiencyReport>, Failure> {
    let of = operations.iter().zip(jobs).map(|(o, job)| efficiency(job, setup, o.operation, cuts(o)));
    Ok(of.collect::<Result<Vec<_>, Failure>>()?.into_iter().flatten().collect())
}

/// Returns the cuts of an operation as planned, in all places of its pattern.
fn cuts(operation: &PlannedOperation<'_>) -> OperationCuts {
    let mut cuts = OperationCuts::default();
    let mut approach = 0.0;
    for moves in &operation.moves.pieces {
        let piece = &moves.piece;
        let place = piece.copy as usize;
        cuts.places.resize_with(cuts.places.len().max(place + 1), Vec::new);
        let points = piece.cuts.iter().map(|cut| CutPoint { cc: cut.cc, posture: cut.pose.posture });
        cuts.places[place].push(points.collect());
        approach += approach_length(&moves.moves);
    }
    OperationCuts { approach_length: Some(approach), ..cuts }
}

/// Returns the length of the tip's path in entries and exits.
fn approach_length(moves: &[Move]) -> f64 {
    let is_approach = |m: &Move| matches!(m.kind, MoveKind::Approach | MoveKind::Engage | MoveKind::Turn);
    moves.windows(2).filter(|w| is_approach(&w[1])).map(|w| (w[1].cl.tip - w[0].cl.tip).norm()).sum()
}
