//! Both sides of every blade of the shared data get a sound plan with at least 99 % of their CC
//! points: by the ignored tests from edge to edge, each day by a band of each blade.

use facemill::report::outcome::Outcome;
use facemill_tests::tables::blades::{BLADES, BladeOutcome, ChosenPasses, chosen_passes, markdown, sides};

/// A few passes from root to tip in the middle of one side of each blade. The ignored tests plan
/// both sides from edge to edge.
#[test]
fn one_side_of_each_shared_blade_is_planned() {
    let one = |(side, file): (usize, &'static str)| {
        chosen_passes(file, false, &ChosenPasses { sides: side..side + 1, spread: 8.0, band_mm: Some(4.0) })
    };
    are_planned(BLADES.into_iter().enumerate().flat_map(one).collect(), 100);
}

/// Passes far apart: what is planned of each pass is the same as between close ones.
#[test]
#[ignore = "plans both sides of all shared blades with passes far apart: a minute or more"]
fn both_sides_of_the_shared_blades_are_planned() {
    are_planned(BLADES.into_iter().flat_map(|file| sides(file, false, 8.0)).collect(), 500);
}

#[test]
#[ignore = "plans both sides of all shared blades as their jobs are written: several minutes"]
fn both_sides_of_the_shared_blades_are_planned_in_full() {
    let both = |file| [false, true].into_iter().flat_map(move |hub| sides(file, hub, 1.0));
    are_planned(BLADES.into_iter().flat_map(both).collect(), 500);
}

fn are_planned(outcomes: Vec<BladeOutcome>, least_points: usize) {
    if outcomes.is_empty() {
        println!("SKIPPED: the shared blades are not there, nothing is planned");
    }
    println!("{}", markdown(&outcomes));
    for o in &outcomes {
        let name = format!("{}, {}", o.file, o.side);
        let planned = o.result.as_ref().unwrap_or_else(|why| panic!("{name}: {why}"));
        let report = &planned.report;
        assert!(report.verified && planned.outcome() != Outcome::Faulty, "{name}: {:?}", report.findings.first());
        assert!(report.totals.cc_points >= least_points, "{name}: only {} CC points", report.totals.cc_points);
        let fraction = report.totals.planned_fraction;
        assert!(fraction >= 0.99, "{name}: {fraction}: {:?}", report.infeasible);
        let deep = report.worst.gouge_mm.expect("a measured depth");
        assert!(deep <= report.budgets[0].against_mesh_mm, "{name}: {deep} mm deep");
    }
}
