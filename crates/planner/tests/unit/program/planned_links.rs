use facemill_virtual_machine::{FindingKind, HeldAsCut};

use crate::passes::extra_passes::AddedPasses;
use crate::passes::operation::OperationTask;
use crate::passes::setup_context::SetupContext;
use crate::program::output::{gouge_sections, write_draft};
use crate::program::planned_links::*;
use crate::stage_clock::Clock;
use facemill_job::examples::new_job::{NewJob, new_job};
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::cell::z_map;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::{SilentStages, Stages};
use facemill_job::stock::map::{StockMeshes, StockRegion};

/// Returns a patch job of few passes, cut twice.
fn job(folder: &std::path::Path) -> Job {
    for (name, bytes) in new_job(&NewJob::Patch { size_mm: 80.0 }).unwrap() {
        let bytes = if name == "job.json" { cut_twice(&bytes) } else { bytes };
        std::fs::write(folder.join(name), bytes).unwrap();
    }
    Job::read(&folder.join("job.json")).unwrap()
}

fn cut_twice(job: &[u8]) -> Vec<u8> {
    let mut job: serde_json::Value = serde_json::from_slice(job).unwrap();
    let operation = &mut job["operations"][0];
    let planes = operation.pointer_mut("/path/strategy/strategy/parallel_planes").unwrap();
    (planes["from_mm"], planes["to_mm"]) = ((-2.2).into(), 2.2.into());
    operation["tolerances"]["max_step_mm"] = 6.0.into();
    let mut again = operation.clone();
    again["name"] = "again".into();
    job["operations"].as_array_mut().unwrap().push(again);
    serde_json::to_vec(&job).unwrap()
}

/// Returns the positions of all moves, bit for bit.
fn places(operations: &[PlannedOperation<'_>]) -> Vec<Vec<(MoveKind, AxisValues)>> {
    let of = |moves: &[Move]| moves.iter().map(|m| (m.kind, m.axes)).collect();
    let of_operation = |o: &PlannedOperation<'_>| -> Vec<Vec<_>> {
        o.moves.pieces.iter().map(|p| of(&p.moves)).chain([of(&o.moves.retract)]).collect()
    };
    operations.iter().flat_map(of_operation).collect()
}

#[test]
fn links_that_are_taken_back_are_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    let job = job(folder.path());
    let setup = Setup::read(&job, 0).unwrap();
    let map = z_map(&setup).unwrap();
    let scene = Scene::new(&job, &setup, 0).unwrap();
    let context = SetupContext { scene: &scene, map: &map, added: AddedPasses::All };
    let stages: &dyn Stages = &SilentStages;
    let mut operations: Vec<PlannedOperation<'_>> = Vec::new();
    for operation in job.operations_of(setup.file) {
        let from = operations.last().and_then(|o| o.moves.last());
        let task = OperationTask { from, ..OperationTask::alone(operation) };
        let planned = PlannedOperation::plan(&context, task, stages, &mut Clock::new());
        operations.push(planned.unwrap().0);
    }
    let texts = write_draft(&scene, &operations).unwrap();
    let stock = StockMeshes::of(&setup).map(&job, &setup, 1.0, StockRegion::Whole).unwrap();
    let sections = [gouge_sections(&scene, &operations, &texts)];
    let program = RunProgram { scenes: [&scene], nc: &texts.nc, sections, as_cut: HeldAsCut::NOTHING };
    let mut links = PlannedLinks::find(&program, (&operations, &texts), Some((stock, 0.05)), stages).unwrap();
    let before = places(&operations);
    links.put_in(&scene, &mut operations);
    let after = places(&operations);
    let n = links.searched.links.len();
    assert!(n >= 5 && links.searched.links.iter().all(|l| l.faster.is_some()), "{n} links");
    let passes = operations[0].moves.pieces.len();
    // The exit from the first operation and the approach to the second are one link.
    assert!(n == 2 * passes - 1 && after[passes].is_empty() && !before[passes].is_empty());

    // A finding restores the link in whose blocks it is, here the one between the operations; none
    // of the others.
    let texts = write_draft(&scene, &operations).unwrap();
    assert!(!links.take_back(&mut operations, &texts, (&[], &[]), false) && places(&operations) == after);
    let line = links.report(&operations, &texts).links[passes - 1].lines[0];
    let finding_at = |line| Finding::of_line(FindingKind::RapidCollision, line, None, "", String::new());
    assert!(links.take_back(&mut operations, &texts, (&[finding_at(line)], &[]), false));
    let now = places(&operations);
    let same: Vec<usize> = (0..now.len()).filter(|&k| now[k] == before[k]).collect();
    assert!(same.contains(&passes) && same.contains(&(passes + 1)), "{same:?}");
    let others = (0..now.len()).filter(|k| ![passes, passes + 1].contains(k));
    assert!(others.clone().all(|k| now[k] == after[k]));
    let reported = links.report(&operations, &write_draft(&scene, &operations).unwrap());
    assert!(reported.changed == n - 1 && reported.links[passes - 1].kept_because.is_some(), "{reported:?}");

    // In the end it restores all of them; restored links cannot be restored again.
    let texts = write_draft(&scene, &operations).unwrap();
    assert!(!links.take_back(&mut operations, &texts, (&[finding_at(1)], &[]), true));
    let line = links.report(&operations, &texts).links[0].lines[0];
    assert!(
        links.take_back(&mut operations, &texts, (&[finding_at(line)], &[]), true) && places(&operations) == before
    );
    assert!(!links.take_back(&mut operations, &texts, (&[finding_at(line)], &[]), true));
}
