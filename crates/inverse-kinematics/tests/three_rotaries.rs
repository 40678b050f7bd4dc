//! Laws of the inverse solution with two linear and three rotary joints.

mod common;

use common::*;
use facemill_inverse_kinematics::*;

const TOOL: f64 = 137.0;

#[test]
fn every_solution_reaches_the_pose_and_one_is_the_pose_it_came_from() {
    let mut r = Random(2);
    let mut counts = [0_usize; MAX_SOLUTIONS + 1];
    for machine in families_of_three_rotaries() {
        for _ in 0..300 {
            let q = r.values(&machine);
            let cl = cl_by_matrices(&machine, &q, TOOL);
            let solutions = machine.inverse(&cl, TOOL).unwrap_or_else(|e| panic!("{e} {q:?} {machine:?}"));
            for s in solutions.iter() {
                let reached = cl_by_matrices(&machine, &s.values, TOOL);
                let (tip, axis) = ((reached.tip - cl.tip).norm(), (*reached.axis - *cl.axis).norm());
                assert!(tip < 1.01e-9 && axis < 1.01e-12, "tip {tip:e}, axis {axis:e}");
                assert_eq!(machine.first_beyond_limit(&s.values), None);
                assert_eq!(machine.branch_of(&s.values), s.branch);
            }
            let found = solutions.iter().any(|s| {
                let (mm, rad) = difference(&machine, &s.values, &q);
                mm < 1e-3 && rad < 1e-5
            });
            assert!(found, "{q:?} is not among {solutions:?} {machine:?}");
            counts[solutions.len()] += 1;
        }
    }
    // Poses with many solutions are among them.
    assert!(counts[4..].iter().sum::<usize>() > 500 && counts[5..].iter().sum::<usize>() > 20, "{counts:?}");
}
