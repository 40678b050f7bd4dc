//! All windings of the rotary axes within their limits.

use std::f64::consts::TAU;

use crate::common::*;
use facemill_inverse_kinematics::machine_file::{Joint, RevoluteRange};
use facemill_inverse_kinematics::*;

/// Head C and A, C wound up to `turns` and a little to both sides.
fn machine_with(turns: f64) -> Machine {
    let mut file = head_ca().to_file();
    for row in &mut file.tool_chains[0].rows {
        if let Some(Joint::Revolute(joint)) = row.joint.as_mut()
            && joint.axis == "C"
        {
            joint.range = RevoluteRange::Limited { min_deg: -360.0 * turns - 10.0, max_deg: 360.0 * turns + 10.0 };
        }
    }
    Machine::from_file(file).unwrap()
}

#[test]
fn windings_are_all_turns_within_the_limits_and_leave_the_tool_where_it_is() {
    let mut random = Random(5);
    for turns in [0.0, 0.3, 1.0, 2.0] {
        let machine = machine_with(turns);
        let c = machine.axis_index("C").unwrap();
        let (min, max) = (machine.axes()[c].min, machine.axes()[c].max);
        for _ in 0..200 {
            let q = random_values(&mut random, &machine);
            let found = machine.windings(&q);
            let expected: Vec<f64> =
                (-9..=9).map(|n| q[c] + TAU * f64::from(n)).filter(|v| (min..=max).contains(v)).collect();
            assert_eq!(found.len(), expected.len(), "{turns} {}", q[c]);
            for (w, value) in found.iter().zip(expected) {
                assert!((w[c] - value).abs() < 1e-12);
                let (here, there) = (machine.cl_point(&q, 100.0), machine.cl_point(w, 100.0));
                assert!((here.tip - there.tip).norm() < 1e-9 && (*here.axis - *there.axis).norm() < 1e-12);
                assert_eq!(machine.first_beyond_limit(w), None);
            }
        }
    }
    // Of very many, the five nearest to home.
    let machine = machine_with(40.0);
    let c = machine.axis_index("C").unwrap();
    let mut q = machine.home();
    q[c] = 20.0 * TAU + 1.0;
    let found: Vec<f64> = machine.windings(&q).iter().map(|w| w[c]).collect();
    assert_eq!(found.len(), 5);
    for (value, turn) in found.iter().zip([-2.0, -1.0, 0.0, 1.0, 2.0]) {
        assert!((value - (1.0 + TAU * turn)).abs() < 1e-9, "{found:?}");
    }
}

#[test]
fn an_endless_axis_has_one_winding() {
    let machine = Machine::head_b_table_c().unwrap();
    let mut random = Random(6);
    for _ in 0..50 {
        let q = random_values(&mut random, &machine);
        assert_eq!(machine.windings(&q), [q]);
    }
}

/// Every rotary axis of a machine with these limits in degrees.
fn with_limits(machine: &Machine, min_deg: f64, max_deg: f64) -> Machine {
    let mut file = machine.to_file();
    let rows = file.workpiece_chain.rows.iter_mut().chain(&mut file.tool_chains[0].rows);
    for joint in rows.filter_map(|row| row.joint.as_mut()) {
        if let Joint::Revolute(joint) = joint {
            joint.range = RevoluteRange::Limited { min_deg, max_deg };
        }
    }
    Machine::from_file(file).unwrap()
}

#[test]
fn all_solutions_are_all_branches_at_all_turns_within_the_limits_and_reach_the_pose() {
    let mut random = Random(7);
    let mut n_wound = 0;
    for machine in families().iter().chain(&families_of_three_rotaries()) {
        let machine = with_limits(machine, -300.0, 430.0);
        let rotary: Vec<usize> = (0..5).filter(|&k| machine.axes()[k].kind == AxisKind::Rotary).collect();
        for _ in 0..20 {
            let q = random_values(&mut random, &machine);
            let cl = cl_by_matrices(&machine, &q, 90.0);
            let all = machine.all_solutions(&cl, 90.0).unwrap();
            for s in &all {
                let reached = cl_by_matrices(&machine, &s.values, 90.0);
                assert!((reached.tip - cl.tip).norm() < 1.01e-9 && (*reached.axis - *cl.axis).norm() < 1.01e-12);
                assert_eq!(machine.first_beyond_limit(&s.values), None);
                assert_eq!(machine.branch_of(&s.values), s.branch);
            }
            // The position itself is among them, and each other whole number of turns within the
            // limits is too.
            let same = |a: &AxisValues, b: &AxisValues| (0..5).all(|k| (a[k] - b[k]).abs() < 1e-3);
            assert!(all.iter().any(|s| same(&s.values, &q)), "{q:?}");
            for s in &all {
                for &k in &rotary {
                    for turn in [-TAU, TAU] {
                        let mut wound = s.values;
                        wound[k] += turn;
                        let inside = machine.axes()[k].holds(wound[k]);
                        assert_eq!(all.iter().filter(|t| same(&t.values, &wound)).count(), usize::from(inside));
                        n_wound += usize::from(inside);
                    }
                }
            }
        }
    }
    assert!(n_wound > 10_000, "{n_wound}");
}
