//! High places that lie in no strip between two passes: corners of a region, and ends of passes.

use facemill::new_job::NewJob;
use facemill_tests::jobs::JobFolder;
use serde_json::json;

const CUSP: f64 = 0.05;

/// Planes across both diagonals of a patch end at its corners.
#[test]
fn corners_of_a_patch_get_passes_of_their_own_until_the_cusp_is_kept() {
    let job = JobFolder::new(&NewJob::Patch { size_mm: 80.0 });
    job.set(
        "job.json",
        &[
            ("/operations/0/path/strategy/strategy", json!({ "parallel_planes": { "normal": [1, 1, 0] } })),
            ("/operations/0/path/strategy/width_rounds", json!(2)),
            ("/operations/0/tolerances/cusp_mm", json!(CUSP)),
            ("/operations/0/tolerances/max_step_mm", json!(4.0)),
        ],
    );
    let planned = job.try_plan().unwrap_or_else(|e| panic!("{e}"));
    let rounds = &planned.report.cusps[0].width_rounds;
    assert!(rounds[0].largest_mm > 1.2 * CUSP, "the case is easy: {rounds:?}");
    let best = rounds.iter().find(|round| round.is_cut).expect("a round");
    assert!(best.passes == rounds[0].passes && best.passes_added > rounds[0].passes_added, "{rounds:?}");
    let left = &planned.report.remaining.as_ref().expect("a verified plan").operations[0];
    let largest = left.largest.expect("samples").height_mm;
    assert!(largest <= CUSP && largest <= best.largest_mm + 1e-9, "{left:?}");
}
