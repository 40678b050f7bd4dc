use facemill_job::load::job::Setup;
use facemill_job::setup::cell::z_map;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::SilentStages;
use facemill_tool_path::moves::{PieceMoves, TurnState};
use facemill_tool_path::segments::PassSegment;
use serde_json::json;

use super::PassesBetween;
use crate::passes::engagement::engagement_of_passes;
use crate::passes::extra_passes::AddedPasses;
use crate::passes::extra_passes::laws::{job, planes, toward_wall};
use crate::passes::operation::{OperationTask, PlannedOperation};
use crate::passes::setup_context::SetupContext;
use crate::stage_clock::Clock;

/// As passes of two heads are, these are planned without any between; those put in behind them take
/// every ridge that is too high, and nothing of the others changes.
#[test]
fn passes_put_in_behind_those_that_are_cut_keep_the_cusp() {
    let folder = tempfile::tempdir().unwrap();
    let values = [
        ("/path", planes(-7.0, -1.0)),
        ("/search/tilt_deg", json!([2.0, 45.0])),
        ("/tolerances/cusp_mm", json!(0.0047)),
    ];
    let job = job(&folder, toward_wall, &values);
    let setup = Setup::read(&job, 0).unwrap();
    let map = z_map(&setup).unwrap();
    let scene = Scene::new(&job, &setup, 0).unwrap();
    let context = SetupContext { scene: &scene, map: &map, added: AddedPasses::BesideTrimmed };
    let (index, operation) = job.operations_of(setup.file).next().unwrap();
    let plan =
        PlannedOperation::plan(&context, OperationTask::alone((index, operation)), &SilentStages, &mut Clock::new())
            .unwrap();
    let mut planned = plan.0;
    let cut: Vec<PassSegment> = planned.moves.pieces.iter().map(|p| p.piece.clone()).collect();
    let too_high = |pieces: &[PassSegment]| {
        let moves =
            |piece: &PassSegment| PieceMoves { piece: piece.clone(), moves: Vec::new(), turn: TurnState::NotSought };
        let mut pieces: Vec<PieceMoves> = pieces.iter().map(moves).collect();
        let along = engagement_of_passes(&job, &setup, operation, &mut pieces, &SilentStages).unwrap();
        let ridges = along.iter().flatten().filter(|a| a.is_point).filter_map(|a| a.ridge);
        ridges.filter(|r| !r.cusp.is_within(operation.tolerances.cusp_mm)).count()
    };
    assert!(planned.extra.between == 0 && too_high(&cut) > 0);

    let found = PassesBetween::find(&context, operation, (&cut, None), &SilentStages).unwrap();
    assert!(found.extra.between > 0 && found.left_out.is_empty() && found.extra.refused.is_empty());
    let all = [cut.as_slice(), &found.pieces].concat();
    assert_eq!(too_high(&all), 0);
    let last = cut.iter().map(|p| p.pass).max().unwrap();
    assert!(found.pieces.iter().all(|p| p.pass > last && p.copy == 0));
    assert_eq!(found.cc_points, found.pieces.iter().map(PassSegment::points).sum::<usize>());

    // Nothing is left to be put in, and all points count.
    let again = PassesBetween::find(&context, operation, (&all, None), &SilentStages).unwrap();
    assert!(again.pieces.is_empty() && again.cc_points == 0 && again.extra.between == 0);
    let (points, between) = (planned.cc_points, found.extra.between);
    let added = found.cc_points;
    found.count(&mut planned);
    assert!(planned.cc_points == points + added && planned.extra.between == between);
}
