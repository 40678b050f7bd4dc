use facemill_job::examples::new_job::{NewJob, new_job};
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::cell::z_map;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::SilentStages;
use facemill_virtual_machine::FindingKind;

use super::*;
use crate::passes::extra_passes::AddedPasses;
use crate::passes::operation::OperationTask;
use crate::passes::setup_context::SetupContext;
use crate::program::output::write_draft;
use crate::stage_clock::Clock;

/// Returns a patch job of few passes, back and forth.
fn job(folder: &std::path::Path) -> Job {
    for (name, bytes) in new_job(&NewJob::Patch { size_mm: 80.0 }).unwrap() {
        let bytes = if name == "job.json" { zigzag(&bytes) } else { bytes };
        std::fs::write(folder.join(name), bytes).unwrap();
    }
    Job::read(&folder.join("job.json")).unwrap()
}

fn zigzag(job: &[u8]) -> Vec<u8> {
    let mut job: serde_json::Value = serde_json::from_slice(job).unwrap();
    let operation = &mut job["operations"][0];
    let planes = operation.pointer_mut("/path/strategy/strategy/parallel_planes").unwrap();
    (planes["from_mm"], planes["to_mm"]) = ((-4.0).into(), 4.0.into());
    operation["path"]["strategy"]["linking"] = "zigzag".into();
    operation["direction"] = "either".into();
    operation["tolerances"]["max_step_mm"] = 6.0.into();
    serde_json::to_vec(&job).unwrap()
}

/// Returns the number of the first line of a text behind the comment of a pass.
fn first_line(nc: &str, pass: usize) -> u32 {
    let comment = format!("PASS {pass} PLACE 1");
    nc.lines().position(|line| line.contains(&comment)).unwrap() as u32 + 2
}

#[test]
fn a_turn_with_a_doubt_on_its_lines_becomes_the_link_and_no_other_does() {
    let folder = tempfile::tempdir().unwrap();
    let job = job(folder.path());
    let setup = Setup::read(&job, 0).unwrap();
    let map = z_map(&setup).unwrap();
    let scene = Scene::new(&job, &setup, 0).unwrap();
    let context = SetupContext { scene: &scene, map: &map, added: AddedPasses::All };
    let named = job.operations_of(setup.file).next().unwrap();
    let task = OperationTask::alone(named);
    let mut operations = vec![PlannedOperation::plan(&context, task, &SilentStages, &mut Clock::new()).unwrap().0];
    let made = |operations: &[PlannedOperation<'_>]| -> Vec<bool> {
        operations[0].moves.pieces.iter().map(|p| matches!(p.turn, TurnState::Made(_))).collect()
    };
    let before = made(&operations);
    let n = before.len();
    assert!(n >= 4 && before[1..].iter().all(|is_made| *is_made), "{before:?}");

    // A finding on the second block of the turn to the third pass.
    let texts = write_draft(&scene, &operations).unwrap();
    let line = first_line(&texts.nc, 3) + 1;
    let finding = |line: u32| Finding::of_line(FindingKind::Gouge, line, None, "", String::new());
    assert!(doubted_turns(&operations, &texts, (&[], &[]), true).is_empty());
    // The last cut before it belongs to no turn.
    let on_turns = |line: u32| doubted_turns(&operations, &texts, (&[], &[line]), false).len();
    assert_eq!([line - 4, line - 1, line].map(on_turns), [0, 1, 1]);
    let turns = doubted_turns(&operations, &texts, (&[finding(line)], &[]), false);
    assert!(replace_by_links(&mut operations, turns));
    let mut expected = before.clone();
    expected[2] = false;
    assert_eq!(made(&operations), expected);
    assert!(matches!(&operations[0].moves.pieces[2].turn, TurnState::Refused(why) if why.contains("finding")));
    // The link is in the text, and the report has its reason.
    let rapids = |texts: &Texts| texts.timed.moves.iter().filter(|m| m.kind == MoveKind::Rapid).count();
    let n_before = rapids(&texts);
    let texts = write_draft(&scene, &operations).unwrap();
    assert!(rapids(&texts) > n_before);
    let report = turns_report(&operations, &texts.timed).unwrap();
    assert_eq!((report.turns_on_surface, report.links, report.reasons.len()), (n - 2, 1, 1));

    // An open certificate counts as well, and in the end all turns go.
    let open = first_line(&texts.nc, 2);
    let turns = doubted_turns(&operations, &texts, (&[], &[open]), true);
    assert!(replace_by_links(&mut operations, turns));
    assert!(made(&operations).iter().all(|is_made| !is_made));
    let texts = write_draft(&scene, &operations).unwrap();
    assert!(doubted_turns(&operations, &texts, (&[finding(line)], &[open]), true).is_empty());
}
