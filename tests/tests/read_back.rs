//! The written program, run by an interpreter, kinematics and distances that share nothing with the planner.

use facemill::nc_program::read_apt;
use facemill_tests::interpreter::{self, Motion};
use facemill_tests::jobs::{JobFolder, small_patch, small_propeller, text_of};
use facemill_tests::read_back::{Ground, ReadBack};

/// `strides`: of how many motions one is looked at, for the cutter and for the bodies.
fn check_program(job: &JobFolder, strides: (usize, usize)) {
    let planned = job.plan();
    let report = &planned.report;
    assert!(planned.is_clean(), "{:?} {:?}", report.findings, report.infeasible);
    assert_eq!(report.totals.trimmed_points, 0, "{:?}", report.infeasible);
    let nc = text_of(&planned, "program.nc");
    let motions = interpreter::run(&nc);
    let back = ReadBack::of(job, 0);
    let budget = report.budgets[0].against_mesh_mm;
    let n_cuts = motions.iter().filter(|m| !m.rapid).count();
    assert!(
        n_cuts >= report.totals.planned_points,
        "{n_cuts} cutting motions for {} points",
        report.totals.planned_points
    );

    let (depth, line) = back.deepest(&motions, strides.0);
    assert!(depth <= budget, "line {line}: {depth} mm deep, budget {budget}");
    // A cutter that never touches would pass, too: it is to cut.
    assert!(depth > 0.0, "the cutter touches nothing");
    let told = report.worst.gouge_mm.unwrap_or(0.0);
    assert!(told >= depth - 1e-3 && told <= budget, "report {told}, by brute force {depth} in line {line}");
    // The report's own place of its deepest gouge, looked at closely.
    if let Some(line) = report.worst.gouge_line {
        let there: Vec<Motion> = motions.iter().filter(|m| m.line == line as usize).copied().collect();
        let (depth, _) = back.deepest(&there, 1);
        assert!((depth - told).abs() < 0.1 * told + 1e-3, "report {told} in line {line}, by brute force {depth}");
    }
    check_bodies(&back, &motions, strides.1, report.worst.clearance_mm.expect("a clearance"));
    check_apt(&back, &motions, &text_of(&planned, "program.apt"));
}

/// No body comes nearer than its clearance allows (0.1 mm of slack between planned points), nor than the report says.
fn check_bodies(back: &ReadBack, motions: &[Motion], stride: usize, told: f64) {
    let mut nearest = f64::INFINITY;
    for m in motions.iter().step_by(stride) {
        let place = back.end(m);
        assert!(back.room(&place, 0.0) >= -0.1, "line {}: {:?}", m.line, back.room(&place, 0.0));
        for body in &back.bodies {
            let at_most = body.clearance + 5.0;
            let from = |g: &Ground| g.bins.distance(&body.shape, &place.0, &place.1, at_most);
            let d = back.grounds.iter().map(from).fold(at_most, f64::min);
            if d < at_most {
                nearest = nearest.min(d);
            }
        }
    }
    assert!(told <= nearest + 1e-6, "report {told}, by brute force {nearest}");
}

/// The APT file's points are the program's positions, up to the rounding of words at the end of the tool.
fn check_apt(back: &ReadBack, motions: &[Motion], apt: &str) {
    let apt = read_apt(apt).unwrap();
    assert_eq!(motions.len(), apt.points.len(), "motions and APT points");
    let rounding = 5e-4 * 3f64.sqrt() + 2.0 * 5e-5f64.to_radians() * (back.pivot_length + 500.0) + 1e-4;
    for (m, p) in motions.iter().zip(&apt.points) {
        let (tip, axis) = back.end(m);
        assert!((tip - p.cl.tip).norm() < rounding, "line {}: {tip} and APT line {} {}", m.line, p.line, p.cl.tip);
        assert!((axis.into_inner() - p.cl.axis.into_inner()).norm() < 1e-5, "line {}", m.line);
        assert_eq!(m.rapid, p.kind == facemill::nc_program::AptPointKind::Rapid, "line {}", m.line);
    }
}

#[test]
fn patch_program_read_back_stays_within_its_budget() {
    check_program(&small_patch(), (1, 7));
}

#[test]
fn propeller_program_read_back_stays_within_its_budget() {
    check_program(&small_propeller(), (5, 61));
}
