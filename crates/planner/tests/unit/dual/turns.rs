use std::f64::consts::FRAC_1_SQRT_2;
use std::fmt::Write;

use facemill_job::examples::new_job::{NewJob, new_job};
use facemill_job::load::HEADS_APART;
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::cell::z_map;
use facemill_job::stages::SilentStages;
use facemill_virtual_machine::{Finding, FindingKind};
use nalgebra::{Point3, Vector3};
use serde_json::{Value, json};

use super::*;
use crate::dual::two_heads::TwoHeads;
use crate::program::heads::{Heads, RoundTasks};
use crate::stage_clock::Clock;

/// Plate of 60 by 60 by 12 mm beside the turned axis, its faces at 45° to it: `top` for head 1 and
/// `bottom` for head 2.
fn plate() -> String {
    let mut text = String::new();
    for [across, along, over] in (0..8).map(|k| [k & 1, k >> 1 & 1, k >> 2].map(|high| f64::from(2 * high - 1))) {
        let (v, n) = (30.0 * along, 6.0 * over);
        let (y, z) = ((v - n) * FRAC_1_SQRT_2, (v + n) * FRAC_1_SQRT_2);
        let _ = writeln!(text, "v {} {y:.9} {z:.9}", 380.0 + 30.0 * across);
    }
    let faces = [
        ("top", [5, 6, 8, 7]),
        ("bottom", [1, 3, 4, 2]),
        ("side", [1, 2, 6, 5]),
        ("side", [3, 7, 8, 4]),
        ("side", [1, 5, 7, 3]),
        ("side", [2, 4, 8, 6]),
    ];
    for (group, [a, b, c, d]) in faces {
        let _ = writeln!(text, "g {group}\nf {a} {b} {c}\nf {a} {c} {d}");
    }
    text
}

/// Returns a job of passes back and forth on both sides of a plate, in a pair or each side by its
/// head alone.
fn job(folder: &std::path::Path, is_pair: bool) -> Job {
    for (name, bytes) in new_job(&NewJob::DualPropeller { diameter_mm: 1000.0 }).unwrap() {
        let bytes = if name == "job.json" { on_plate(&bytes, is_pair) } else { bytes };
        std::fs::write(folder.join(name), bytes).unwrap();
    }
    std::fs::write(folder.join("plate.obj"), plate()).unwrap();
    Job::read(&folder.join("job.json")).unwrap()
}

fn on_plate(job: &[u8], is_pair: bool) -> Vec<u8> {
    let mut job: Value = serde_json::from_slice(job).unwrap();
    let mesh = |groups: &[&str], role: &str| json!({ "file": "plate.obj", "groups": groups, "role": role, "unit": "millimetre", "up_axis": "z" });
    job["setups"][0]["meshes"] = json!([mesh(&["top", "bottom"], "drive"), mesh(&["*"], "part")]);
    for (operation, group) in job["operations"].as_array_mut().unwrap().iter_mut().zip(["top", "bottom"]) {
        let strategy = &mut operation["path"]["strategy"];
        strategy["region"] = json!({ "groups": [group] });
        strategy["min_pass_length_mm"] = json!(5.0);
        strategy["linking"] = json!("zigzag");
        let planes = json!({ "normal": [1.0, 0.0, 0.0], "from_mm": 365.0, "to_mm": 395.0 });
        strategy["strategy"] = json!({ "parallel_planes": planes });
        operation["direction"] = json!("either");
        operation["pattern"] = Value::Null;
        // Entries so slow that every turn is faster.
        operation["feeds"]["approach_mm_min"] = json!(100.0);
        operation["feeds"]["turn_mm_min"] = operation["feeds"]["cutting_mm_min"].clone();
    }
    if !is_pair {
        job.as_object_mut().unwrap().remove("pairs");
    }
    serde_json::to_vec(&job).unwrap()
}

/// Calls a test with the planned heads of a job.
fn with_heads(is_pair: bool, test: impl FnOnce(&TwoHeads<'_>)) {
    let folder = tempfile::tempdir().unwrap();
    let job = job(folder.path(), is_pair);
    let planned_by = [job.seen_by(0, HEADS_APART), job.seen_by(1, HEADS_APART)];
    let run_by = [job.seen_by(0, 0.0), job.seen_by(1, 0.0)];
    let jobs = [&planned_by[0], &planned_by[1]];
    let setups = [Setup::read(jobs[0], 0).unwrap(), Setup::read(jobs[1], 0).unwrap()];
    let maps = [z_map(&setups[0]).unwrap(), z_map(&setups[1]).unwrap()];
    let shared = (0..job.machine.axes().len()).find(|k| job.machine.is_shared(*k)).unwrap();
    let machines = [&run_by[0].machine, &run_by[1].machine];
    let scenes = Scene::of_heads(jobs, [&setups[0], &setups[1]], machines, 0).unwrap();
    test(&TwoHeads { context: TwoHeadContext { scenes: &scenes, maps: [&maps[0], &maps[1]], shared } });
}

/// Places of the turns that are made.
fn made(parts: &[ProgramPart<'_>]) -> Vec<[usize; 2]> {
    let of_part = |(k, part): (usize, &ProgramPart<'_>)| -> Vec<[usize; 2]> {
        let is_made = |s: &crate::dual::parts::Section| matches!(s.turn, SectionTurn::Made { .. });
        part.sections.iter().enumerate().filter(|(_, s)| is_made(s)).map(|(section, _)| [k, section]).collect()
    };
    parts.iter().enumerate().flat_map(of_part).collect()
}

/// A finding on a turn makes it the link that it replaced, in moves, text and report, and no other
/// turn; both heads stay where they were at the first cut behind it.
fn a_doubted_turn_becomes_its_link(heads: &TwoHeads<'_>) {
    let (mut planned, _) = heads.plan(&RoundTasks::default(), &SilentStages, &mut Clock::new()).unwrap();
    let texts = heads.write(&planned, true).unwrap();
    let before = made(&planned.parts);
    assert!(before.len() >= 2, "{:?}", turns_report(&planned.parts, &texts, &heads.context));
    assert!(doubted_turns(&planned.parts, &texts, (&[], &[]), true).is_empty());

    let [part, section] = before[1];
    let line = texts.lines_of(&[BlockPlace { part, section, at: 1 }]).unwrap()[0];
    let first_cut = |parts: &[ProgramPart<'_>]| {
        let sections = &parts[part].sections;
        let cut = |s: &crate::dual::parts::Section| s.moves.iter().find(|m| m.kind == MoveKind::Cut).map(|m| m.axes);
        cut(&sections[section]).or_else(|| cut(&sections[section + 1]))
    };
    let cut_before = first_cut(&planned.parts);
    let finding = Finding::of_line(FindingKind::Gouge, line, None, "", String::new());
    assert!(heads.take_back(None, &mut planned, &texts, (&[finding], &[]), false));
    let mut expected = before.clone();
    expected.remove(1);
    assert_eq!(made(&planned.parts), expected);
    assert!(
        matches!(&planned.parts[part].sections[section].turn, SectionTurn::Refused(why) if why.contains("finding"))
    );
    assert_eq!(first_cut(&planned.parts), cut_before);
    let rapids = |texts: &DualTexts| texts.timed.moves.iter().filter(|m| m.kind == MoveKind::Rapid).count();
    let again = heads.write(&planned, true).unwrap();
    assert!(rapids(&again) > rapids(&texts));
    let report = turns_report(&planned.parts, &again, &heads.context).unwrap();
    assert_eq!(report.turns_on_surface, before.len() - 1);

    // An open certificate counts as well, and in the end all turns go.
    let [part, section] = before[0];
    let open = again.lines_of(&[BlockPlace { part, section, at: 0 }]).unwrap()[0];
    assert!(heads.take_back(None, &mut planned, &again, (&[], &[open]), true));
    assert!(made(&planned.parts).is_empty());
    let kinds = planned.parts.iter().flat_map(|p| &p.sections).flat_map(|s| &s.moves).map(|m| m.kind);
    assert!(kinds.into_iter().all(|kind| kind != MoveKind::Turn));
}

#[test]
fn turns_of_a_head_alone_are_taken_back_one_by_one() {
    with_heads(false, a_doubted_turn_becomes_its_link);
}

#[test]
fn turns_of_both_heads_are_taken_back_one_by_one() {
    with_heads(true, a_doubted_turn_becomes_its_link);
}

/// Height of the lowest point of a cutter over a face of the plate, mm, by its closed form: a ring
/// of balls at the rim.
fn height(scene: &Scene<'_>, axes: &AxisValues, normal: &Vector3<f64>) -> f64 {
    let table_from_work = scene.setup.table_from_work;
    let cl = scene.job.machine.cl_point(axes, scene.job.tool.gauge_length()).transformed(&table_from_work.inverse());
    let cutter = scene.job.tool.cutter();
    let (corner, axis) = (cutter.corner_radius(), cl.axis.into_inner());
    let ring = cl.tip + axis * corner;
    let fall = (1.0 - normal.dot(&axis).powi(2)).max(0.0).sqrt() * (cutter.radius() - corner);
    let center = Point3::new(380.0, 0.0, 0.0) + normal * 6.0;
    normal.dot(&(ring - center)) - fall - corner
}

/// Between all places of turns of both heads, as the axes move, neither cutter is deeper in its
/// side of the plate than the job's tolerances, and C moves evenly with both.
#[test]
fn turns_of_both_heads_stay_off_both_sides_as_the_axes_move() {
    with_heads(true, |heads| {
        let (planned, _) = heads.plan(&RoundTasks::default(), &SilentStages, &mut Clock::new()).unwrap();
        let top = Vector3::new(0.0, -FRAC_1_SQRT_2, FRAC_1_SQRT_2);
        let (mut deepest, mut n_blocks) = ([f64::INFINITY; 2], 0);
        for [part, section] in made(&planned.parts) {
            let sections = &planned.parts[part].sections;
            if sections[section].moves[0].working != [true; 2] {
                continue;
            }
            let before = sections[..section].iter().rev().find_map(|s| s.moves.last()).unwrap();
            let turn: Vec<AxisValues> = [before]
                .into_iter()
                .chain(&sections[section].moves)
                .chain(&sections[section + 1].moves[..1])
                .map(|m| m.axes)
                .collect();
            for w in turn.windows(2) {
                n_blocks += 1;
                for k in 0..=8 {
                    let axes = w[0].lerp(&w[1], f64::from(k) / 8.0);
                    for (h, normal) in [top, -top].iter().enumerate() {
                        deepest[h] = deepest[h].min(height(&heads.context.scenes[h], &axes, normal));
                    }
                }
            }
        }
        assert!(n_blocks > 100, "{n_blocks} blocks");
        assert!(deepest.iter().all(|height| (-0.03..0.5).contains(height)), "{deepest:?}");
    });
}
