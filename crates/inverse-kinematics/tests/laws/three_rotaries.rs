//! Laws of the inverse solution with two linear and three rotary joints.

use crate::common::*;
use facemill_inverse_kinematics::machine_file::{DhRow, Sense};
use facemill_inverse_kinematics::*;

const TOOL: f64 = 137.0;

#[test]
fn every_solution_reaches_the_pose_and_one_is_the_pose_it_came_from() {
    let mut r = Random(2);
    let mut counts = [0_usize; MAX_SOLUTIONS + 1];
    for machine in families_of_three_rotaries() {
        for _ in 0..300 {
            let q = random_values(&mut r, &machine);
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

/// Returns values with the tool along the first rotary axis where two of them are parallel: it does
/// not move while that axis turns, or while another turns and the third follows. `None` where the
/// machine has none of this kind.
fn along_first(machine: &Machine, r: &mut Random) -> Option<AxisValues> {
    let rotary: Vec<usize> = (0..5).filter(|&k| machine.axes()[k].kind == AxisKind::Rotary).collect();
    let tool_axis = |q: &AxisValues| *machine.cl_point(q, TOOL).axis;
    // Other values on the curve of solutions have to be within the limits of the linear axes too.
    let mut q = random_values(r, machine).lerp(&machine.home(), 0.5);
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let [free, other, follows] = order.map(|k| rotary[k]);
        for (eighth, sign) in (0..8).flat_map(|k| [(k, 0.0), (k, 1.0), (k, -1.0)]) {
            let at = |first: f64, second: f64| {
                let mut q = q;
                let third = f64::from(eighth) * std::f64::consts::FRAC_PI_4 + sign * second;
                q[free] = first;
                q[other] = second;
                q[follows] = third - std::f64::consts::TAU * (third / std::f64::consts::TAU).round();
                q
            };
            let here = tool_axis(&at(0.0, 0.0));
            let stays = [(1.0, 0.0), (0.0, 1.0), (2.0, -2.0)]
                .iter()
                .all(|&(a, b)| (tool_axis(&at(a, b)) - here).norm() < 1e-14);
            if stays {
                q = at(q[free], q[other]);
                return Some(q);
            }
        }
    }
    None
}

#[test]
fn with_the_tool_along_the_first_of_parallel_rotaries_a_pose_is_reached_from_any_reference() {
    let mut r = Random(5);
    let mut machines = families_of_three_rotaries();
    let eighths = |r: &mut Random| [-90.0, 0.0, 90.0, 180.0, 45.0, -45.0][r.below(6)];
    machines.extend((0..40).map(|_| random_machine_of(&mut r, ["X", "Y", "A", "B", "C"], eighths)));
    let (mut n_machines, mut far) = (0, 0);
    for machine in machines {
        let mut is_one = false;
        for _ in 0..60 {
            let Some(q) = along_first(&machine, &mut r) else { break };
            is_one = true;
            let cl = machine.cl_point(&q, TOOL);
            let reference = random_values(&mut r, &machine);
            let solutions = match machine.inverse_near(&cl, TOOL, &reference) {
                Ok(all) => all,
                Err(e) => panic!("{e} at {q:?} from {reference:?} of {:?}", machine.to_file()),
            };
            for s in solutions.iter() {
                let reached = cl_by_matrices(&machine, &s.values, TOOL);
                let (tip, axis) = ((reached.tip - cl.tip).norm(), (*reached.axis - *cl.axis).norm());
                assert!(tip < 1.01e-9 && axis < 1.01e-12, "tip {tip:e}, axis {axis:e}");
                assert_eq!(machine.first_beyond_limit(&s.values), None);
            }
            let own = machine.inverse_near(&cl, TOOL, &q).unwrap();
            let is_own = |s: InverseSolution| {
                let (mm, rad) = difference(&machine, &s.values, &q);
                mm < 1e-3 && rad < 1e-5
            };
            assert!(own.iter().any(is_own), "{q:?} is not among {own:?}");
            let kept = |k: usize| solutions.iter().any(|s| (s.values[k] - reference[k]).abs() < 1e-12);
            far += usize::from(!(0..5).any(|k| machine.axes()[k].kind == AxisKind::Rotary && kept(k)));
        }
        n_machines += usize::from(is_one);
    }
    // Poses that neither free joint reaches from its present value are among them.
    assert!(n_machines >= 6 && far > 20, "{n_machines} machines, {far} far");
}

/// A table that turns about its z, and a head with Y and X level at a right angle to each other, B
/// and A.
fn with_head(rotaries: Vec<DhRow>) -> Result<Machine, MachineError> {
    let table = vec![rotary("C", Sense::Positive, None, row(0.0, 0.0, 0.0, 0.0))];
    let mut tool = head_yxz();
    tool[2].joint = None;
    tool.extend(rotaries);
    Machine::from_file(file(table, tool))
}

#[test]
fn a_machine_that_has_four_degrees_of_freedom_in_every_pose_is_refused_with_the_axes() {
    let side = |axis, alpha| rotary(axis, Sense::Positive, None, row(30.0, alpha, 50.0, 20.0));
    let end = |alpha| row(10.0, alpha, -80.0, 15.0);
    // Axes in general directions.
    let good = with_head(vec![side("B", 70.0), side("A", 50.0), end(-40.0)]);
    assert!(good.is_ok(), "{good:?}");
    // B and C upright: X and Y compensate the turns of both, for every tool pose.
    let bad = with_head(vec![side("B", 0.0), side("A", 90.0), end(-40.0)]);
    match bad {
        Err(MachineError::DependentAxes { axes }) => {
            let letters: Vec<_> = axes.iter().map(AxisLetter::as_str).collect();
            assert_eq!(letters, ["X", "Y", "B", "C"]);
        }
        other => panic!("{other:?}"),
    }
}
