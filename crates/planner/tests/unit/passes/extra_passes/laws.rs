use facemill_job::examples::new_job::{NewJob, new_job};
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::cell::z_map;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::SilentStages;
use facemill_surface_model::{NamedNode, TriMesh, write_obj};
use nalgebra::{Isometry3, Point3};
use serde_json::{Value, json};

use crate::passes::extra_passes::AddedPasses;
use crate::passes::operation::{OperationTask, PlannedOperation};
use crate::passes::setup_context::SetupContext;
use crate::plan::plan_setup;
use crate::plan_settings::PlanSettings;
use crate::planned::Planned;
use crate::stage_clock::Clock;

/// Returns a plan of a job on a surface of heights `z(x)`, with values of the operation.
pub(crate) fn planned(z: fn(f64) -> f64, values: &[(&str, Value)]) -> Planned {
    let folder = tempfile::tempdir().unwrap();
    plan_setup(&job(&folder, z, values), 0, PlanSettings { verify: false, certificates: false }, &SilentStages).unwrap()
}

pub(crate) fn job(folder: &tempfile::TempDir, z: fn(f64) -> f64, values: &[(&str, Value)]) -> Job {
    for (name, bytes) in new_job(&NewJob::Patch { size_mm: 80.0 }).unwrap() {
        let bytes = match name.as_str() {
            "patch.obj" => {
                let node = NamedNode { name: "patch", mesh: 0, transform: Isometry3::identity() };
                write_obj(&[&sheet(z)], &[node]).unwrap()
            }
            "job.json" => changed(&bytes, values),
            // Entries may descend steeply: these tests do not concern them.
            "tool.json" => {
                let mut tool: Value = serde_json::from_slice(&bytes).unwrap();
                (tool["max_ramp_angle_deg"], tool["dead_core_radius_mm"]) = (json!(60.0), json!(0.0));
                serde_json::to_vec(&tool).unwrap()
            }
            _ => bytes,
        };
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    Job::read(&folder.path().join("job.json")).unwrap()
}

fn changed(bytes: &[u8], values: &[(&str, Value)]) -> Vec<u8> {
    let mut job: Value = serde_json::from_slice(bytes).unwrap();
    job["setups"][0]["clearance"]["plane"]["origin_mm"][2] = json!(40.0);
    let operation = &mut job["operations"][0];
    operation["infeasible"] = json!({ "trim": { "max_trimmed_fraction": 0.6 } });
    operation["tolerances"]["max_step_mm"] = json!(2.0);
    for (pointer, value) in values {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        operation.pointer_mut(parent).unwrap()[key] = value.clone();
    }
    serde_json::to_vec(&job).unwrap()
}

/// Returns a sheet of 20 mm by 20 mm.
fn sheet(z: fn(f64) -> f64) -> TriMesh {
    let [n, m] = [160, 4];
    let at = |k: u32, n: u32| 20.0 * f64::from(k) / f64::from(n) - 10.0;
    let (vertices, triangles) =
        facemill_test_kit::grid_by_rows([n, m], |i, j| Point3::new(at(i, n), at(j, m), z(at(i, n))));
    TriMesh::new(vertices, triangles).unwrap()
}

/// Returns a surface that is flat to x = 0, then a fillet of 3 mm into a slope of 60°.
pub(crate) fn toward_wall(x: f64) -> f64 {
    let (sin, cos) = 60f64.to_radians().sin_cos();
    match x {
        x if x < 0.0 => 0.0,
        x if x < 3.0 * sin => 3.0 - (9.0 - x * x).sqrt(),
        x => 3.0 * (1.0 - cos) + (x - 3.0 * sin) * sin / cos,
    }
}

pub(crate) fn planes(from: f64, to: f64) -> Value {
    // Fronts would leave no strips to be laid narrower.
    json!({ "strategy": {
        "edge_fill": false,
        "strategy": { "parallel_planes": { "normal": [1, 0, 0], "from_mm": from, "to_mm": to } },
        "region": { "box": { "min_mm": [-10, -2, -9], "max_mm": [10, 2, 30] } },
    } })
}

#[test]
fn a_cusp_that_postures_beside_a_wall_raise_is_kept_by_passes_between() {
    // In the flat the surface permits the least tilt, and strips are generated as wide; beside the
    // wall the head prevents it.
    let values = [
        ("/path", planes(-7.0, -1.0)),
        ("/search/tilt_deg", json!([2.0, 45.0])),
        ("/tolerances/cusp_mm", json!(0.0047)),
    ];
    let planned = planned(toward_wall, &values);
    let cusps = &planned.report.cusps[0];
    assert!(cusps.passes_between > 0, "{cusps:?}");
    assert!(cusps.points_beyond == 0 && cusps.reasons.is_empty(), "{cusps:?}");
    assert!(planned.report.worst.cusp_mm.unwrap() <= 0.0047 && planned.is_clean());
}

/// Returns the plan of passes toward the wall with rounds.
fn in_rounds(rounds: u32, cusp: f64) -> crate::planned::Planned {
    let mut path = planes(-7.0, -1.0);
    path["strategy"]["width_rounds"] = json!(rounds);
    let values = [("/path", path), ("/search/tilt_deg", json!([2.0, 45.0])), ("/tolerances/cusp_mm", json!(cusp))];
    planned(toward_wall, &values)
}

#[test]
fn where_the_text_leaves_too_much_at_few_places_passes_are_put_in() {
    let once = in_rounds(0, 0.01);
    assert!(once.report.cusps[0].width_rounds.is_empty());
    let largest = |planned: &crate::planned::Planned| {
        planned.report.remaining.as_ref().unwrap().operations[0].largest.as_ref().unwrap().height_mm
    };
    assert!(largest(&once) > 0.01, "nothing to do");
    let again = in_rounds(3, 0.01);
    let rounds = &again.report.cusps[0].width_rounds;
    assert_eq!(rounds.iter().map(|r| r.is_cut).collect::<Vec<_>>(), [false, true], "{rounds:?}");
    // Both measures are of the same text but for links.
    assert!(
        (rounds[0].largest_mm - largest(&once)).abs() < 1e-9 && (rounds[1].largest_mm - largest(&again)).abs() < 1e-9
    );
    assert!(rounds[1].largest_mm <= 0.01 && rounds[1].points_without_posture == 0, "{rounds:?}");
    // The passes as laid stay.
    assert!(rounds[1].passes == rounds[0].passes && rounds[1].passes_added > rounds[0].passes_added, "{rounds:?}");
}

#[test]
fn where_the_text_leaves_too_much_on_much_of_the_region_strips_are_laid_narrower() {
    let again = in_rounds(2, 0.0047);
    let rounds = &again.report.cusps[0].width_rounds;
    assert_eq!(rounds.len(), 3, "{rounds:?}");
    // Expected ridges put passes in only where no text is measured.
    assert!(in_rounds(0, 0.0047).report.cusps[0].passes_between > 0 && rounds[0].passes_added == 0, "{rounds:?}");
    assert!(rounds[0].above_fraction > 0.1 && rounds[1].passes > rounds[0].passes, "{rounds:?}");
    // Beyond the cusp, the round that leaves it on the least area is cut.
    let cut = rounds.iter().find(|r| r.is_cut).unwrap();
    assert!(rounds.iter().all(|r| r.largest_mm > 0.0047 && cut.above_fraction <= r.above_fraction), "{rounds:?}");
    assert!(cut.above_fraction < 0.2 * rounds[0].above_fraction, "{rounds:?}");
    assert_eq!(rounds.iter().filter(|r| r.is_cut).count(), 1);
}

#[test]
fn a_cusp_that_no_pass_can_keep_is_reported_with_the_reason_and_is_no_clean_plan() {
    let values = [("/path", planes(-2.0, 3.0)), ("/search/tilt_deg", json!([2.0, 45.0]))];
    let planned = planned(toward_wall, &values);
    let cusps = &planned.report.cusps[0];
    assert!(cusps.points_beyond > 0 && !planned.is_clean(), "{cusps:?}");
    assert!(cusps.reasons[0].reason.contains("cutter gouges part"), "{cusps:?}");
    assert!(crate::report::summary::summary(&planned.report).contains("cusp not kept"));
}

/// Returns a groove of 3 mm radius and 5 mm width, sharp at its edges.
fn groove(x: f64) -> f64 {
    if x.abs() < 2.5 { (9.0f64 - 6.25).sqrt() - (9.0 - x * x).sqrt() } else { 0.0 }
}

#[test]
fn a_trimmed_pass_is_moved_as_near_as_there_are_postures() {
    // The bottom is too narrow for the disc: from some place on no posture is feasible.
    let nearest_to_bottom = |step: f64| {
        let folder = tempfile::tempdir().unwrap();
        let values = [("/path", planes(-4.0, 4.0)), ("/tolerances/max_step_over_mm", json!(step))];
        let job = job(&folder, groove, &values);
        let setup = Setup::read(&job, 0).unwrap();
        let map = z_map(&setup).unwrap();
        let scene = Scene::new(&job, &setup, 0).unwrap();
        let context = SetupContext { scene: &scene, map: &map, added: AddedPasses::All };
        let operation = job.operations_of(setup.file).next().unwrap();
        let (planned, _) =
            PlannedOperation::plan(&context, OperationTask::alone(operation), &SilentStages, &mut Clock::new())
                .unwrap();
        let cuts = planned.moves.pieces.iter().flat_map(|p| &p.piece.cuts);
        let nearest = [-1.0, 1.0].map(|side| {
            let of_side = cuts.clone().map(|c| side * c.cc.position.x).filter(|x| *x > 0.0);
            of_side.fold(f64::INFINITY, f64::min)
        });
        (planned.extra.moved, nearest)
    };
    let (moved, own) = nearest_to_bottom(1.0);
    assert!(moved > 0);
    // As near as many passes come that find the border by themselves: but for an eighth of the
    // step, and on a side where a pass would come next to the one beside, a quarter.
    let (_, best) = nearest_to_bottom(0.2);
    for side in 0..2 {
        assert!(own[side] < best[side] + 0.27 && own[side] > best[side] - 0.22, "{own:?} {best:?}");
    }
}

#[test]
fn a_long_gap_is_divided_into_parts_of_half_the_longest_one() {
    let parts = |gap: f64| crate::passes::extra_passes::shares_within(gap, 10.0).collect::<Vec<f64>>();
    assert!(parts(0.1).is_empty() && parts(10.0).is_empty());
    for gap in [10.001, 24.76, 30.0, 1234.5] {
        let all = [vec![0.0], parts(gap), vec![1.0]].concat();
        let steps: Vec<f64> = all.windows(2).map(|pair| (pair[1] - pair[0]) * gap).collect();
        assert!(steps.iter().all(|step| (2.5..=5.0 + 1e-9).contains(step)), "{gap}: {steps:?}");
    }
}
