//! The written program, run by an interpreter, kinematics and distances that share nothing with the
//! planner.

use facemill::Planned;
use facemill::cl_data::CuttingLaw;
use facemill::cl_file::read_apt;
use facemill::inverse_kinematics::motion::deviation_bound;
use facemill::inverse_kinematics::{AxisValues, Machine};
use facemill_tests::jobs::{JobFolder, small_patch, small_patch_planned, small_propeller, text_of};
use facemill_tests::oracles::interpreter::{self, Motion};
use facemill_tests::oracles::paper_machine::{PIVOT_TO_FACE, tool_on_table};
use facemill_tests::oracles::read_back::{KeepOutMesh, ReadBack};
use nalgebra::{Unit, Vector3};

/// `strides`: of how many motions one is looked at, for the cutter and for the bodies.
fn check_program(job: &JobFolder, planned: &Planned, strides: (usize, usize)) {
    let report = &planned.report;
    assert!(planned.is_clean(), "{:?} {:?}", report.findings, report.infeasible);
    assert_eq!(report.totals.trimmed_points, 0, "{:?}", report.infeasible);
    let nc = text_of(planned, "program.nc");
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
    let reported = report.worst.gouge_mm.unwrap_or(0.0);
    assert!(reported >= depth - 1e-3 && reported <= budget, "report {reported}, by brute force {depth} in line {line}");
    // The report's own place of its deepest gouge, looked at closely.
    if let Some(line) = report.worst.gouge_line {
        let there: Vec<Motion> = motions.iter().filter(|m| m.line == line as usize).copied().collect();
        let (depth, _) = back.deepest(&there, 1);
        assert!(
            (depth - reported).abs() < 0.1 * reported + 1e-3,
            "report {reported} in line {line}, by brute force {depth}"
        );
    }
    check_bodies(&back, &motions, strides.1, report.worst.clearance_mm.expect("a clearance"));
    check_apt(&back, &motions, &text_of(planned, "program.apt"));
    check_deviation_bounds(job, &back, &motions);
}

/// No body comes nearer than its clearance allows (0.1 mm of slack between planned points), nor
/// than the report says.
fn check_bodies(back: &ReadBack, motions: &[Motion], stride: usize, reported: f64) {
    let mut nearest = f64::INFINITY;
    for m in motions.iter().step_by(stride) {
        let place = back.end(m);
        assert!(back.room(&place, 0.0) >= -0.1, "line {}: {:?}", m.line, back.room(&place, 0.0));
        for body in &back.bodies {
            let at_most = body.clearance + 5.0;
            let from = |g: &KeepOutMesh| g.bins.distance(&body.shape, &place.0, &place.1, at_most);
            let d = back.grounds.iter().map(from).fold(at_most, f64::min);
            if d < at_most {
                nearest = nearest.min(d);
            }
        }
    }
    assert!(reported <= nearest + 1e-6, "report {reported}, by brute force {nearest}");
}

/// The APT file's points are the program's positions, up to the rounding of words at the end of the
/// tool.
fn check_apt(back: &ReadBack, motions: &[Motion], apt: &str) {
    let apt = read_apt(apt).unwrap();
    assert_eq!(motions.len(), apt.points.len(), "motions and APT points");
    let rounding = 5e-4 * 3f64.sqrt() + 2.0 * 5e-5f64.to_radians() * (back.pivot_length + 500.0) + 1e-4;
    for (m, p) in motions.iter().zip(&apt.points) {
        let (tip, axis) = back.end(m);
        assert!((tip - p.cl.tip).norm() < rounding, "line {}: {tip} and APT line {} {}", m.line, p.line, p.cl.tip);
        assert!((axis.into_inner() - p.cl.axis.into_inner()).norm() < 1e-5, "line {}", m.line);
        assert_eq!(m.rapid, p.kind == facemill::cl_file::AptPointKind::Rapid, "line {}", m.line);
    }
}

/// Largest distance of the tip (mm) and angle of the tool axis (rad) between a block's motion and
/// what its ends mean: the tip straight, the axis turning evenly from one to the other.
fn deviation_by_sampling(m: &Motion, pivot_length: f64) -> [f64; 2] {
    let angle = |u: &Vector3<f64>, v: &Vector3<f64>| u.cross(v).norm().atan2(u.dot(v));
    let [(a, u), (b, v)] = [&m.from, &m.to].map(|at| tool_on_table(at, pivot_length));
    let turn = angle(&u, &v);
    let n = 60;
    (1..n).map(|k| f64::from(k) / f64::from(n)).fold([0.0_f64; 2], |[most_tip, most_axis], t| {
        let (tip, axis) = tool_on_table(&m.from.lerp(&m.to, t), pivot_length);
        let even = if turn < 1e-9 {
            u.into_inner()
        } else {
            u.into_inner() * ((1.0 - t) * turn).sin() + v.into_inner() * (t * turn).sin()
        };
        let off = (tip - (a + (b - a) * t)).norm();
        [most_tip.max(off), most_axis.max(angle(&axis, &Unit::new_normalize(even)))]
    })
}

/// The bound on what a block bends is never below what dense sampling of it finds, and at most a
/// tenth above.
fn check_deviation_bounds(job: &JobFolder, back: &ReadBack, motions: &[Motion]) {
    let machine = Machine::from_json(&std::fs::read(job.path("machine.json")).unwrap()).unwrap();
    let (mut worst, mut n) = ([0.0_f64; 2], [0; 2]);
    for m in motions {
        let [from, to] =
            [&m.from, &m.to].map(|at| AxisValues::from([at.x, at.y, at.z, at.b.to_radians(), at.c.to_radians()]));
        let length = back.pivot_length - PIVOT_TO_FACE;
        let bound = deviation_bound(&machine, CuttingLaw::AxesLinear, &from, &to, length);
        let found = deviation_by_sampling(m, back.pivot_length);
        // Below a nanometre or 1e-9 rad bounds are not made sharp, and sampling in doubles is
        // rounding.
        for (k, (bound, negligible)) in [(bound.tip, 1e-6), (bound.axis, 1e-9)].into_iter().enumerate() {
            assert!(bound >= found[k] - 1e-9, "line {}: {bound} below {}", m.line, found[k]);
            if found[k] > negligible {
                assert!(bound <= 1.1 * found[k], "line {}: {bound} for {}", m.line, found[k]);
                worst[k] = worst[k].max(bound / found[k]);
                n[k] += 1;
            }
        }
    }
    println!("bounds up to {worst:?} of what is there, {n:?} of {} blocks", motions.len());
    assert!(n.iter().all(|n| 2 * n > motions.len()), "{n:?} of {} blocks bend", motions.len());
}

#[test]
fn patch_program_read_back_stays_within_its_budget() {
    check_program(&small_patch(), small_patch_planned(), (1, 5));
}

#[test]
fn propeller_program_read_back_stays_within_its_budget() {
    let job = small_propeller();
    check_program(&job, &job.plan(), (5, 61));
}
