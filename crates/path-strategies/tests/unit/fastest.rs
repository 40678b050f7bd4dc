use facemill_job::examples::new_job::{NewJob, new_job};
use facemill_job::format::job_settings::JobSetting;
use facemill_planner::PlanSettings;

use super::*;
use crate::strategies::NamedStrategy;

/// Returns a job, and a comparison of it with two other strategies.
fn request() -> (Job, CompareRequest) {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in new_job(&NewJob::Patch { size_mm: 80.0 }).unwrap() {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let job = Job::read(&folder.path().join("job.json")).unwrap();
    let named = |name: &str, setting: &str| {
        let mut value = serde_json::to_value(&job.file).unwrap();
        setting.parse::<JobSetting>().unwrap().put_in(&mut value).unwrap();
        NamedStrategy { name: name.to_owned(), file: serde_json::from_value(value).unwrap() }
    };
    let strategies = vec![
        NamedStrategy { name: "as it is".to_owned(), file: job.file.clone() },
        named("fine", "operations[0].tolerances.cusp_mm=0.05"),
        named("coarse", "operations[0].tolerances.cusp_mm=0.2"),
    ];
    let settings = PlanSettings { verify: true, certificates: false };
    (job, CompareRequest { strategies, mounting_angles_deg: vec![0.0, 30.0], settings, stock_cell: None })
}

fn planned(total_time_s: f64) -> PlannedPasses {
    PlannedPasses {
        setup: "top".to_owned(),
        passes: 10,
        planned_fraction: 0.995,
        passes_length_mm: 1000.0,
        floor_mm: None,
        efficiency: None,
        over_least_floor: None,
        by_time_law: true,
        passes_time_s: total_time_s,
        time_over_feed: Some(1.5),
        approach_time_s: 0.0,
        link_time_s: 0.0,
        total_time_s,
        cusp_p99_mm: None,
        cusp_largest_mm: Some(0.09),
        never_cut_fraction: Some(0.01),
        region_area_mm2: Some(6400.0),
        region_length_mm: Some(0.0),
        rotary_reversals: 0,
        posture_jumps: 0,
        faults: 0,
    }
}

/// Returns rows of the comparison with these setups, each with an outcome.
fn rows(setups: [(Outcome, PlannedPasses); 3]) -> Vec<ComparedStrategy> {
    let row = |(k, (outcome, setup)): (usize, (Outcome, PlannedPasses))| ComparedStrategy {
        strategy: ["as it is", "fine", "coarse"][k].to_owned(),
        mounting_angle_deg: 0.0,
        failed: None,
        outcome: Some(outcome),
        setups: vec![setup],
    };
    setups.into_iter().enumerate().map(row).collect()
}

#[test]
fn the_least_time_is_taken_and_of_equal_ones_the_first() {
    let (job, request) = request();
    let rows_of = |times: [f64; 3]| rows(times.map(|t| (Outcome::Done, planned(t))));
    let found = fastest(&job, &request, &rows_of([100.0, 60.0, 80.0])).unwrap();
    assert_eq!((found.index, found.total_time_s, found.job_time_s), (1, 60.0, Some(100.0)));
    assert!(found.passed_over.is_empty());
    let same = fastest(&job, &request, &rows_of([60.0, 60.0, 80.0])).unwrap();
    assert_eq!(same.index, 0);
}

#[test]
fn a_faster_plan_is_passed_over_where_it_is_less_complete_than_the_jobs_own() {
    let (job, request) = request();
    let own = || (Outcome::Done, planned(100.0));
    let reason = |other: (Outcome, PlannedPasses)| {
        let found = fastest(&job, &request, &rows([own(), own(), other])).unwrap();
        assert_eq!(found.index, if found.passed_over.is_empty() { 2 } else { 0 });
        found.passed_over.first().map(|p| p.reason.clone())
    };
    let faster = || planned(50.0);
    assert_eq!(reason((Outcome::Done, faster())), None);
    let is = |found: Option<String>, says: &str| assert!(found.as_ref().is_some_and(|f| f.contains(says)), "{found:?}");
    is(reason((Outcome::Faulty, faster())), "faults");
    is(reason((Outcome::Done, PlannedPasses { faults: 1, ..faster() })), "faults");
    is(reason((Outcome::Done, PlannedPasses { planned_fraction: 0.99, ..faster() })), "99.00 %");
    is(reason((Outcome::Done, PlannedPasses { cusp_largest_mm: Some(0.11), ..faster() })), "0.110 mm");
    is(reason((Outcome::Done, PlannedPasses { cusp_largest_mm: None, ..faster() })), "unknown");
    is(reason((Outcome::Incomplete, faster())), "more than the job permits");
    is(reason((Outcome::Done, PlannedPasses { region_area_mm2: Some(6200.0), ..faster() })), "62.0 cm²");
    is(reason((Outcome::Done, PlannedPasses { region_area_mm2: Some(7000.0), ..faster() })), "another region");
    is(reason((Outcome::Done, PlannedPasses { region_length_mm: Some(80.0), ..faster() })), "lines of 80.0 mm");
    // Sampling measures the same region a little differently.
    assert_eq!(reason((Outcome::Done, PlannedPasses { region_area_mm2: Some(6390.0), ..faster() })), None);
    // Within the tolerance of 0.1 mm more may be left than the job's own plan leaves.
    assert_eq!(reason((Outcome::Done, PlannedPasses { cusp_largest_mm: Some(0.1), ..faster() })), None);
}

#[test]
fn a_plan_may_leave_as_much_as_the_jobs_own_even_above_the_tolerance() {
    let (job, request) = request();
    let leaves = |time: f64, height: f64, never_cut: f64| {
        let setup = planned(time);
        let setup = PlannedPasses { cusp_largest_mm: Some(height), never_cut_fraction: Some(never_cut), ..setup };
        (Outcome::Incomplete, setup)
    };
    let all = rows([leaves(100.0, 0.3, 0.02), leaves(60.0, 0.3, 0.02), leaves(50.0, 0.3, 0.03)]);
    let found = fastest(&job, &request, &all).unwrap();
    assert_eq!(found.index, 1);
    assert!(found.passed_over[0].reason.contains("never cuts 3.00 %"), "{found:?}");
}

#[test]
fn a_job_with_a_fault_or_with_material_left_lowers_no_bar() {
    let (job, request) = request();
    let little = PlannedPasses { planned_fraction: 0.41, ..planned(10.0) };
    let own = PlannedPasses { planned_fraction: 0.4, faults: 1, ..planned(100.0) };
    let all = [(Outcome::Faulty, own), (Outcome::Incomplete, little.clone()), (Outcome::Done, planned(50.0))];
    let found = fastest(&job, &request, &rows(all)).unwrap();
    assert_eq!((found.index, found.job_time_s), (2, None), "{found:?}");
    let own = PlannedPasses { planned_fraction: 0.4, ..planned(100.0) };
    let all = [(Outcome::Incomplete, own), (Outcome::Incomplete, little), (Outcome::Done, planned(50.0))];
    assert_eq!(fastest(&job, &request, &rows(all)).unwrap().index, 2);
}

#[test]
fn without_the_jobs_own_plan_the_most_complete_one_counts_and_without_any_there_is_none() {
    let (job, request) = request();
    let less = PlannedPasses { planned_fraction: 0.9, ..planned(50.0) };
    let mut all = rows([(Outcome::Done, planned(10.0)), (Outcome::Done, planned(100.0)), (Outcome::Done, less)]);
    all[0].failed = Some("no pass".to_owned());
    all[0].setups.clear();
    let found = fastest(&job, &request, &all).unwrap();
    assert_eq!((found.index, found.job_time_s, found.passed_over.len()), (1, None, 1));
    let faulty = rows([1.0, 2.0, 3.0].map(|t| (Outcome::Faulty, PlannedPasses { faults: 2, ..planned(t) })));
    assert_eq!(fastest(&job, &request, &faulty), None);
}

#[test]
fn rows_are_the_strategies_in_one_mounting_after_the_other() {
    let (_, request) = request();
    let cusp = |row: usize| request.job_of(row).map(|job| job.operations[0].tolerances.cusp_mm);
    assert_eq!([0, 1, 2, 3, 4, 5].map(cusp), [0.1, 0.05, 0.2, 0.1, 0.05, 0.2].map(Some));
    assert_eq!(cusp(6), None);
    let turn = |row: usize| request.job_of(row).unwrap().setups[0].table_from_work.rotation_deg;
    assert!(turn(2) == 0.0 && (turn(3) - 30.0).abs() < 1e-9);
}
