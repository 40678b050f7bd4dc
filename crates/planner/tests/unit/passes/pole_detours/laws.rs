use facemill_cutter_location::cusp::neighbours::{Neighbours, OwnPlace};
use facemill_cutter_location::{SearchCurve, SearchOrder};
use facemill_job::format::report::lost_time::LostTimeCause;
use facemill_job::load::job::Setup;
use facemill_job::setup::cell::{pass_settings, workcell, z_map};
use facemill_job::setup::path::lay_operation;
use facemill_job::stages::SilentStages;
use nalgebra::Point3;
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
    let laid = lay_operation(&job, &setup, 0, operation).unwrap();
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
        everywhere: true,
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

/// Returns the slope, bent by 6° from end to end.
fn bent_slope(x: f64) -> f64 {
    slope(x) - x * x / 400.0
}

#[test]
fn rotary_axes_that_slow_a_pass_away_from_the_pole_are_held_at_rest_where_one_direction_serves() {
    let mut values = values([0.0, 1.0, 0.0], 1.0);
    values.push(("/feeds/cutting_mm_min", json!(5000.0)));
    let [first, taken] = both(bent_slope, &values, 1);
    let spread = |pass: &PlannedPass| {
        let of = |k: usize| {
            let all = pass.outcomes.points.iter().flatten().map(move |pose| pose.configuration.axes[k]);
            all.clone().fold(f64::NEG_INFINITY, f64::max) - all.fold(f64::INFINITY, f64::min)
        };
        // B and C are the last two of five axes.
        of(3).max(of(4))
    };
    for (own, other) in first.iter().zip(&taken) {
        assert!(nearest_to_pole(own) > BESIDE_POLE, "beside the pole");
        assert!(spread(own) > 0.01 && spread(other) < 1e-9, "{} {}", spread(own), spread(other));
        assert!(other.outcomes.points.iter().all(Result::is_ok));
        for pose in other.outcomes.points.iter().flatten() {
            let (tilt, rotate) = (pose.posture.tilt.to_degrees(), pose.posture.rotate.to_degrees());
            assert!((2.0 - 1e-6..=15.0 + 1e-6).contains(&tilt) && rotate.abs() <= 85.0 + 1e-6, "{tilt} {rotate}");
        }
    }
    assert!([first, taken] == both(bent_slope, &values, 3));
}

#[test]
fn linear_axes_that_slow_a_pass_are_no_reason_to_plan_it_again() {
    // The same feed, with a surface that needs no turn of the tool.
    let mut values = values([0.0, 1.0, 0.0], 1.0);
    values.push(("/feeds/cutting_mm_min", json!(5000.0)));
    let [first, taken] = both(slope, &values, 2);
    assert!(first == taken);
}

#[test]
fn a_direction_serves_only_where_it_is_within_the_ranges_at_every_point() {
    let ranges = |tilt: [f64; 2]| {
        let posture = |tilt: f64, rotate: f64| Posture { tilt: tilt.to_radians(), rotate: f64::to_radians(rotate) };
        let (start, end) = (posture(tilt[0], 0.0), posture(tilt[1], 85.0));
        SearchCurve::new(start, end, SearchOrder::TiltFirst, 1.0).unwrap()
    };
    // An arc of 20 deg in the plane of x and z, cut toward x.
    let point = |deg: i32| {
        let (sin, cos) = f64::from(deg).to_radians().sin_cos();
        let position = Point3::new(100.0 * sin, 0.0, 100.0 * cos);
        CcPoint::new(position, Vector3::new(sin, 0.0, cos), Vector3::new(cos, 0.0, -sin)).unwrap()
    };
    let pass: Vec<CcPoint> = (-10..=10).map(point).collect();
    let task =
        |tilt| PassTask { pass: Pass::new(pass.clone()), curve: ranges(tilt), strips: Vec::new(), given: Vec::new() };
    assert!(direction_within_ranges(&task([2.0, 15.0])).is_none());
    let found = direction_within_ranges(&task([2.0, 42.0])).unwrap();
    // From 10 deg before the middle to 10 deg behind it the tilt changes by 20 deg.
    let tilts = pass.iter().map(|cc| cc.posture_of(&found).tilt.to_degrees());
    let [low, high] = tilts.fold([90.0f64, 0.0f64], |[low, high], t| [low.min(t), high.max(t)]);
    assert!(low >= 2.0 - 1e-6 && high <= 42.0 + 1e-6 && high - low > 10.0, "{low} {high}");
    assert!(direction_within_ranges(&PassTask { pass: Pass::new(Vec::new()), ..task([2.0, 42.0]) }).is_none());
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
