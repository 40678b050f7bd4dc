use facemill_cutter_location::cusp::neighbours::{Neighbours, OwnPlace};
use facemill_job::format::report::lost_time::LostTimeCause;
use facemill_job::load::job::Setup;
use facemill_job::setup::cell::{pass_settings, workcell, z_map};
use facemill_job::setup::path::lay;
use facemill_job::stages::SilentStages;
use serde_json::{Value, json};

use crate::passes::engagement::neighbour_reach;
use crate::passes::extra_passes::laws::{job, planned};
use crate::passes::extra_passes::{as_laid, pass_tasks};
use crate::passes::operation::settle_branch;
use crate::passes::pole_detours::*;
use crate::planned::Planned;

/// Returns a ridge of 24 mm radius along y: cut across, the normals pass the pole at its top.
fn ridge(x: f64) -> f64 {
    (576.0 - x * x).sqrt() - 24.0
}

/// Returns a slope of 30°, its normals far from the pole.
fn slope(x: f64) -> f64 {
    -x * 30f64.to_radians().tan()
}

/// Returns a sheet of which half is a slope, and half a ridge that continues it: passes along y are
/// far from the pole on one, beside it on the other.
fn slope_and_ridge(x: f64) -> f64 {
    let start = 24.0 * 30f64.to_radians().sin();
    if x < 0.0 { ridge(start) - slope(x) } else { ridge((start - 2.0 * x).max(0.0)) }
}

fn values(normal: [f64; 3], max_turn_deg_per_mm: f64) -> Vec<(&'static str, Value)> {
    let path = json!({ "strategy": {
        "strategy": { "parallel_planes": { "normal": normal, "from_mm": -1.0, "to_mm": 1.0 } },
        "region": { "box": { "min_mm": [-9, -9, -90], "max_mm": [9, 9, 90] } },
    } });
    vec![
        ("/path", path),
        ("/search/max_turn_deg_per_mm", json!(max_turn_deg_per_mm)),
        ("/tolerances/cusp_mm", json!(0.05)),
        ("/tolerances/max_step_mm", json!(0.5)),
    ]
}

/// Returns the passes of a job as planned first, and with other plans past the pole, on so many
/// threads.
fn both(z: fn(f64) -> f64, values: &[(&str, Value)], threads: usize) -> [Vec<PlannedPass>; 2] {
    let folder = tempfile::tempdir().unwrap();
    let job = job(&folder, z, values);
    let setup = Setup::read(&job, 0).unwrap();
    let map = z_map(&setup).unwrap();
    let operation = job.operations_of(setup.file).next().unwrap().1;
    let mut cell = workcell(&job, &setup, operation, &map);
    let laid = lay(&job, &setup, 0, operation).unwrap();
    settle_branch(&mut cell, &laid.tasks);
    let test = PoseTest::new(&cell);
    let choosing = PoseTest::new(&cell).avoiding_pole(operation.search.singular_cone_deg.to_radians());
    let tests = Tests { choosing: &choosing, plain: &test };
    let settings = pass_settings(operation);
    let reach = neighbour_reach(cell.tool.cutter(), operation);
    let neighbours = Neighbours::new(laid.tasks.iter().map(as_laid).collect(), reach);
    let tasks = pass_tasks(&laid.tasks, |pass, point| neighbours.of(OwnPlace { pass, point }).strip());
    let detours = Detours {
        tests: &tests,
        settings: &settings,
        control: &job.post.rules().control_motion,
        feed: operation.feeds.cutting_mm_min / 60.0,
        cusp: operation.tolerances.cusp_mm,
        adds_passes: true,
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let first = plan_passes(&choosing, &tasks, &settings, &facemill_cl_data::Silent).unwrap();
        let mut taken = first.clone();
        detours.take(&tasks, &mut taken, &SilentStages).unwrap();
        [first, taken]
    })
}

/// Returns the smallest angle of a pass's poses to the table's axis, rad: B on this machine.
fn nearest_to_pole(pass: &PlannedPass) -> f64 {
    let poses = pass.outcomes.points.iter().flatten();
    poses.map(|pose| pose.cl.axis.z.acos()).fold(f64::INFINITY, f64::min)
}

fn cutting_time(planned: &Planned) -> f64 {
    planned.report.time_law.as_ref().unwrap().passes_time_s
}

#[test]
fn passes_between_cost_their_way_and_an_entry_exit_and_link_each() {
    assert_eq!(time_between(&[0.0, 0.0, 0.0], &[3.0, 3.0]), 0.0);
    // Two passes over the first step and, where a third begins, three over the last two: a path of
    // 2 · 1 + 3 · (2 + 4) s.
    assert_eq!(time_between(&[2.0, 2.0, 3.0, 0.0], &[1.0, 2.0, 4.0]), 20.0 + 3.0 * BETWEEN_PASSES);
    // One that ends and one that begins are two.
    assert_eq!(time_between(&[1.0, 0.0, 0.0, 1.0], &[1.0, 1.0, 1.0]), 2.0 + 2.0 * BETWEEN_PASSES);
}

#[test]
fn a_pass_over_the_pole_is_as_fast_as_where_the_job_asks_for_calm() {
    let [own, calm] = [1.0, 0.25].map(|turn| planned(ridge, &values([0.0, 1.0, 0.0], turn)));
    let [own_time, calm_time] = [&own, &calm].map(cutting_time);
    assert!(own_time < 1.1 * calm_time, "{own_time} s, {calm_time} s");
}

#[test]
fn other_ways_past_the_pole_lose_no_point_and_are_the_same_on_any_number_of_threads() {
    let values = values([0.3, 1.0, 0.0], 1.0);
    let [first, taken] = both(ridge, &values, 1);
    assert!(first != taken, "no other way is taken");
    for (own, other) in first.iter().zip(&taken) {
        assert_eq!(own.outcomes.points.len(), other.outcomes.points.len());
        let lost = own.outcomes.points.iter().zip(&other.outcomes.points).filter(|(a, b)| a.is_ok() && b.is_err());
        assert_eq!(lost.count(), 0);
    }
    assert!([first, taken] == both(ridge, &values, 3));
}

#[test]
fn a_pass_away_from_the_pole_stays_as_it_is() {
    let mut values = values([1.0, 0.0, 0.0], 1.0);
    values[0].1["strategy"]["region"]["box"]["min_mm"][1] = json!(-4);
    values[0].1["strategy"]["region"]["box"]["max_mm"][1] = json!(4);
    values[0].1["strategy"]["strategy"] =
        json!({ "parallel_planes": { "normal": [1, 0, 0], "from_mm": -8, "to_mm": 8 } });
    let [first, taken] = both(slope_and_ridge, &values, 2);
    let far: Vec<bool> = first.iter().map(|pass| nearest_to_pole(pass) > BESIDE_POLE).collect();
    assert!(far.contains(&true) && far.contains(&false));
    for ((own, other), _) in first.iter().zip(&taken).zip(&far).filter(|(_, far)| **far) {
        assert!(own == other);
    }
    let [first, taken] = both(slope, &values, 2);
    assert!(first == taken);
}

#[test]
fn lost_time_is_reported_with_a_remedy_and_not_where_the_feed_is_kept() {
    let level: fn(f64) -> f64 = |_| 0.0;
    let kept = planned(level, &values([0.0, 1.0, 0.0], 1.0));
    assert_eq!(kept.report.lost_times, []);
    assert!(!crate::report::summary::summary(&kept.report).contains("below the feed"));
    // The inclination leaves no detour: beside the pole the table must turn by half a turn within a
    // few blocks.
    let mut narrow = values([0.0, 1.0, 0.0], 1.0);
    narrow.push(("/search/tilt_deg", json!([2.0, 2.0])));
    let lost = planned(ridge, &narrow);
    let [first, ..] = lost.report.lost_times.as_slice() else { panic!("no time lost") };
    assert_eq!((first.cause, first.axis.as_deref()), (LostTimeCause::NearPole, Some("C")));
    let law = lost.report.time_law.as_ref().unwrap();
    let lost_s: f64 = lost.report.lost_times.iter().map(|l| l.lost_s).sum();
    // The loss is the time in passes less that of their length at the feed of 1200 mm/min; causes
    // below a tenth are left out.
    let all = law.passes_time_s - lost.report.totals.passes_length_mm / 20.0;
    assert!(lost_s <= all + 0.1 && lost_s > 0.7 * all, "{lost_s} of {all} s");
    assert!((first.share - first.lost_s / law.passes_time_s).abs() < 1e-6);
    assert!(first.remedy.contains("table_from_work") && first.remedy.contains("singular_cone_deg"));
    assert!(crate::report::summary::summary(&lost.report).contains("below the feed"));
}
