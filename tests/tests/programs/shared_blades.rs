//! Both sides of every blade of the shared data get a sound plan with at least 99 % of their CC
//! points.

use facemill::report::outcome::Outcome;
use facemill_tests::tables::blades::{BLADES, BladeOutcome, markdown, sides};

/// Passes far apart: what is planned of each pass is the same as between close ones.
#[test]
#[ignore = "plans both sides of all shared blades with passes far apart: a minute or more"]
fn both_sides_of_the_shared_blades_are_planned() {
    are_planned(BLADES.into_iter().flat_map(|file| sides(file, false, 8.0)).collect());
}

#[test]
#[ignore = "plans both sides of all shared blades as their jobs are written: several minutes"]
fn both_sides_of_the_shared_blades_are_planned_in_full() {
    are_planned(BLADES.into_iter().flat_map(|file| sides(file, false, 1.0)).collect());
}

fn are_planned(outcomes: Vec<BladeOutcome>) {
    if outcomes.is_empty() {
        println!("SKIPPED: the shared blades are not there, nothing is planned");
    }
    println!("{}", markdown(&outcomes));
    for o in &outcomes {
        let name = format!("{}, {}", o.file, o.side);
        let planned = o.result.as_ref().unwrap_or_else(|why| panic!("{name}: {why}"));
        let report = &planned.report;
        assert!(report.verified && planned.outcome() != Outcome::Faulty, "{name}: {:?}", report.findings.first());
        assert!(report.totals.cc_points >= 500, "{name}: only {} CC points", report.totals.cc_points);
        let fraction = report.totals.planned_fraction;
        assert!(fraction >= 0.99, "{name}: {fraction}: {:?}", report.infeasible);
        let deep = report.worst.gouge_mm.expect("a measured depth");
        assert!(deep <= report.budgets[0].against_mesh_mm, "{name}: {deep} mm deep");
    }
}
