//! Laws of the forward and inverse solution on machines of every family and in general position.

use crate::common::*;
use facemill_cl_data::ClPoint;
use facemill_inverse_kinematics::machine_file::{Joint, Sense};
use facemill_inverse_kinematics::*;
use nalgebra::{Point3, Unit, Vector3};

const TOOL: f64 = 137.0;

fn assert_reaches(machine: &Machine, q: &AxisValues, cl: &ClPoint, tool_length: f64) {
    let reached = cl_by_matrices(machine, q, tool_length);
    let tip = (reached.tip - cl.tip).norm();
    let axis = (*reached.axis - *cl.axis).norm();
    // 1e-12 mm and 1e-15 rad of rounding in the matrices themselves add to the guarantee.
    assert!(tip < 1.01e-9 && axis < 1.01e-12, "{}: tip {tip:e}, axis {axis:e} at {q:?}", machine.name());
}

#[test]
fn forward_is_the_product_of_craigs_matrices() {
    let mut r = Random(1);
    for machine in families() {
        for _ in 0..50 {
            let q = random_values(&mut r, &machine);
            let expected = forward_by_matrices(&machine, &q, TOOL);
            let pose = machine.forward(&q, TOOL).to_homogeneous();
            assert!((pose - expected).abs().max() < 1e-10, "{q:?}");
            let cl = machine.cl_point(&q, TOOL);
            assert!((cl.tip.coords - expected.column(3).xyz()).norm() < 1e-10);
            assert!((*cl.axis - expected.column(2).xyz()).norm() < 1e-13);
        }
    }
}

#[test]
fn every_branch_reaches_the_pose_and_one_is_the_pose_it_came_from() {
    let mut r = Random(2);
    for machine in families() {
        for _ in 0..400 {
            let q = random_values(&mut r, &machine);
            let cl = cl_by_matrices(&machine, &q, TOOL);
            let solutions = machine.inverse(&cl, TOOL).unwrap();
            let mut found = false;
            for s in solutions.iter() {
                assert_reaches(&machine, &s.values, &cl, TOOL);
                assert_eq!(machine.first_beyond_limit(&s.values), None);
                let (mm, rad) = difference(&machine, &s.values, &q);
                // Near the edges of the reach the rotaries are known only to the root of the
                // rounding.
                found |= mm < 1e-4 && rad < 1e-6;
            }
            assert!(found, "{q:?} is not among {solutions:?}");
        }
    }
}

#[test]
fn branches_are_on_the_two_sides_of_the_last_rotary_axis() {
    let machine = Machine::head_b_table_c().unwrap();
    let b = machine.axis_index("B").unwrap();
    let mut r = Random(3);
    for _ in 0..500 {
        let q = random_values(&mut r, &machine);
        let cl = machine.cl_point(&q, TOOL);
        let solutions = machine.inverse(&cl, TOOL).unwrap();
        let side = if q[b] > 0.0 { Branch::Positive } else { Branch::Negative };
        let s = solutions.on_branch(side).unwrap();
        let (mm, rad) = difference(&machine, &s.values, &q);
        assert!(mm < 1e-7 && rad < 1e-9);
        for s in solutions.iter() {
            assert_eq!(s.branch == Branch::Positive, s.values[b] > 0.0);
        }
    }
}

/// Solves the B-head, C-table machine by hand: B is the angle to z, C the azimuth, then the pivot
/// is turned back by C.
#[test]
fn head_b_table_c_agrees_with_its_closed_form() {
    let machine = Machine::head_b_table_c().unwrap();
    let pivot = 350.0;
    let mut r = Random(4);
    for _ in 0..500 {
        let axis = Unit::new_normalize(Vector3::new(r.between(-1.0, 1.0), r.between(-1.0, 1.0), r.between(0.05, 1.0)));
        let cl = ClPoint {
            tip: Point3::new(r.between(-900.0, 900.0), r.between(-900.0, 900.0), r.between(0.0, 900.0)),
            axis,
        };
        let l = r.between(50.0, 500.0);
        let solutions = machine.inverse(&cl, l).unwrap();
        assert_eq!(solutions.len(), 2);
        for s in solutions.iter() {
            let sign = if s.branch == Branch::Positive { 1.0 } else { -1.0 };
            let b = sign * axis.x.hypot(axis.y).atan2(axis.z);
            let c = (sign * axis.y).atan2(sign * axis.x);
            let p = cl.tip + axis.into_inner() * (pivot + l);
            let x = c.cos() * p.x + c.sin() * p.y;
            let y = -c.sin() * p.x + c.cos() * p.y;
            let expected = AxisValues::from([x, y, p.z - pivot, b, c]);
            let (mm, rad) = difference(&machine, &s.values, &expected);
            assert!(mm < 1e-9 && rad < 1e-12, "{:?} against {expected:?}", s.values);
        }
    }
}

#[test]
fn at_the_pole_the_free_axis_keeps_its_value() {
    let machine = Machine::head_b_table_c().unwrap();
    let cl = ClPoint { tip: Point3::new(500.0, -200.0, 100.0), axis: Vector3::z_axis() };
    let c = machine.axis_index("C").unwrap();
    let solutions = machine.inverse(&cl, TOOL).unwrap();
    assert_eq!((solutions.len(), solutions.iter().next().unwrap().free_axis), (1, Some(c)));
    let previous = AxisValues::from([0.0, 0.0, 0.0, 0.3, 12.5]);
    let q = machine.nearest_inverse(&cl, TOOL, Some(&previous), BranchPreference::Nearest).unwrap();
    assert_eq!((q[3], q[4]), (0.0, 12.5));
    assert_reaches(&machine, &q, &cl, TOOL);
}

#[test]
fn near_the_poles_no_accuracy_is_lost() {
    let mut r = Random(5);
    for machine in families() {
        // The tool axis is along the rotary axis nearest to the workpiece: found by turning the
        // other one.
        for exponent in 0..=16 {
            for _ in 0..5 {
                let off = 10f64.powi(-exponent);
                let axis = Unit::new_normalize(Vector3::new(r.between(-off, off), r.between(-off, off), 1.0));
                let cl = ClPoint { tip: Point3::new(40.0, -30.0, 20.0), axis };
                let previous = random_values(&mut r, &machine);
                match machine.nearest_inverse(&cl, TOOL, Some(&previous), BranchPreference::Nearest) {
                    Ok(q) => assert_reaches(&machine, &q, &cl, TOOL),
                    Err(Unreachable::AxisLimit { .. } | Unreachable::Direction { .. }) => {}
                    Err(e) => panic!("{e}"),
                }
            }
        }
    }
    // On machines whose pole is z it is always reached.
    for machine in &families()[..3] {
        for exponent in 0..=17 {
            let off = 10f64.powi(-exponent);
            for (x, y) in [(off, 0.0), (0.0, -off), (-off, off)] {
                let axis = Unit::new_normalize(Vector3::new(x, y, 1.0));
                let cl = ClPoint { tip: Point3::new(40.0, -30.0, 20.0), axis };
                for s in machine.inverse(&cl, TOOL).unwrap().iter() {
                    assert_reaches(machine, &s.values, &cl, TOOL);
                }
            }
        }
    }
}

#[test]
fn continuity_goes_through_the_pole_without_a_flip() {
    let machine = Machine::head_b_table_c().unwrap();
    let mut previous = None;
    for k in -50..=50 {
        let lean = 0.01 * f64::from(k);
        let axis = Unit::new_normalize(Vector3::new(lean.sin(), 0.0, lean.cos()));
        let cl = ClPoint { tip: Point3::new(500.0, 100.0, 50.0), axis };
        let q = machine.nearest_inverse(&cl, TOOL, previous.as_ref(), BranchPreference::Negative).unwrap();
        assert!((q[3] - lean).abs() < 1e-12 && q[4].abs() < 1e-12, "at {lean}: {q:?}");
        previous = Some(q);
    }
}

#[test]
fn endless_axis_winds_on_and_a_limited_one_stays() {
    let machine = Machine::head_b_table_c().unwrap();
    let mut previous: Option<AxisValues> = None;
    for k in 0..=400 {
        let turn = 0.05 * f64::from(k);
        let axis = Unit::new_normalize(Vector3::new(turn.cos(), turn.sin(), 1.0));
        let cl = ClPoint { tip: Point3::new(500.0 * turn.cos(), 500.0 * turn.sin(), 50.0), axis };
        let q = machine.nearest_inverse(&cl, TOOL, previous.as_ref(), BranchPreference::Positive).unwrap();
        assert!((q[4] - turn).abs() < 1e-9, "{q:?} at {turn}");
        previous = Some(q);
    }
    let limited = trunnion_ac(Sense::Negative, [0.0; 3], 0.0, 0.0, Some((0.0, 110.0)));
    for s in limited.inverse(&ClPoint { tip: Point3::origin(), axis: Vector3::y_axis() }, 0.0).unwrap().iter() {
        assert!(limited.axes()[3].holds(s.values[3]));
    }
}

#[test]
fn turns_beyond_180_degrees_are_used_where_the_limits_ask_for_them() {
    let table = vec![rotary("C", Sense::Negative, Some((100.0, 700.0)), row(0.0, 0.0, 0.0, 0.0))];
    let mut rows = table.clone();
    if let Some(Joint::Revolute(j)) = rows[0].joint.as_mut() {
        j.home_deg = 100.0;
    }
    let mut tool = head_yxz();
    tool.push(rotary("B", Sense::Positive, Some((0.0, 90.0)), row(0.0, -90.0, 0.0, 0.0)));
    tool.push(row(0.0, 90.0, -100.0, 0.0));
    let machine = machine(rows, tool);
    for (azimuth, previous, expected) in [
        (50.0, 100.0, 410.0),
        (50.0, 690.0, 410.0),
        (120.0, 100.0, 120.0),
        (120.0, 690.0, 480.0),
        (-10.0, 690.0, 710.0 - 360.0),
    ] {
        let (sin, cos) = f64::to_radians(azimuth).sin_cos();
        let cl = ClPoint { tip: Point3::origin(), axis: Unit::new_normalize(Vector3::new(cos, sin, 1.0)) };
        let at = AxisValues::from([0.0, 0.0, 0.0, 0.7, f64::to_radians(previous)]);
        let q = machine.nearest_inverse(&cl, 0.0, Some(&at), BranchPreference::Nearest).unwrap();
        assert!((q[4].to_degrees() - expected).abs() < 1e-9, "{azimuth} from {previous}: {}", q[4].to_degrees());
    }
}

#[test]
fn limits_are_reported_with_axis_and_value_and_their_ends_are_reached() {
    let machine = Machine::head_b_table_c().unwrap();
    let lean = 120f64.to_radians();
    let cl = ClPoint {
        tip: Point3::new(0.0, 0.0, 1000.0),
        axis: Unit::new_normalize(Vector3::new(lean.sin(), 0.0, lean.cos())),
    };
    match machine.inverse(&cl, TOOL).unwrap_err() {
        Unreachable::AxisLimit { axis, value, max, .. } => {
            assert_eq!(axis, "B");
            assert!((value.abs() - lean).abs() < 1e-12 && (max.to_degrees() - 110.0).abs() < 1e-12);
        }
        e => panic!("{e}"),
    }
    let high = ClPoint { tip: Point3::new(0.0, 0.0, 4000.0), axis: Vector3::z_axis() };
    let message = machine.inverse(&high, 100.0).unwrap_err().to_string();
    assert_eq!(message, "axis Z would have to be at 4100.0000 mm, its limits are -350.0000 to 3250.0000");
    for machine in families() {
        for ends in [0, 1, 2] {
            let q = AxisValues::from_fn(5, |k| {
                let a = &machine.axes()[k];
                match (a.endless, (k + ends) % 2) {
                    (true, _) => 0.4,
                    (_, 0) => a.min,
                    _ => a.max,
                }
            });
            let cl = machine.cl_point(&q, TOOL);
            let solutions = machine.inverse_near(&cl, TOOL, &q).unwrap();
            for s in solutions.iter() {
                assert_reaches(&machine, &s.values, &cl, TOOL);
                assert_eq!(machine.first_beyond_limit(&s.values), None);
            }
        }
    }
}

#[test]
fn nutating_head_tilts_by_its_closed_form_and_no_farther() {
    let machine = nutating_head();
    let mut r = Random(6);
    for _ in 0..200 {
        let b = r.between(0.05, 3.1);
        let tilt = ((1.0 + b.cos()) / 2.0).acos();
        let azimuth = r.between(-3.0, 3.0);
        let axis = Vector3::new(tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), tilt.cos());
        let cl = ClPoint { tip: Point3::new(10.0, 20.0, 30.0), axis: Unit::new_normalize(axis) };
        let solutions = machine.inverse(&cl, TOOL).unwrap();
        assert_eq!(solutions.len(), 2);
        for s in solutions.iter() {
            assert!((s.values[3].abs() - b).abs() < 1e-9);
            assert_reaches(&machine, &s.values, &cl, TOOL);
        }
    }
    for below in [1e-3, 0.1, 0.7] {
        let axis = Unit::new_normalize(Vector3::new(f64::cos(below), 0.0, -f64::sin(below)));
        let cl = ClPoint { tip: Point3::origin(), axis };
        match machine.inverse(&cl, TOOL).unwrap_err() {
            Unreachable::Direction { by, .. } => assert!((by - below).abs() < 1e-12),
            e => panic!("{e}"),
        }
    }
    // At the edge both branches coincide.
    let edge = ClPoint { tip: Point3::origin(), axis: Vector3::x_axis() };
    let s = machine.inverse(&edge, TOOL).unwrap();
    assert_eq!(s.len(), 1);
    assert_reaches(&machine, &s.iter().next().unwrap().values, &edge, TOOL);
}

/// A quill behind a tilting head: with the quill level the three linear axes lie in one plane.
#[test]
fn dependent_linear_axes_are_a_typed_result() {
    let mut tool = vec![linear("Y", row(0.0, -90.0, 0.0, 90.0)), linear("X", row(0.0, 90.0, 0.0, 90.0))];
    tool.push(row(0.0, -90.0, 0.0, 0.0));
    tool.push(rotary("A", Sense::Positive, Some((-120.0, 120.0)), row(0.0, 90.0, 0.0, 0.0)));
    tool.push(linear("W", row(0.0, -90.0, 0.0, 0.0)));
    let machine = machine(vec![rotary("C", Sense::Negative, None, row(0.0, 0.0, 0.0, 0.0))], tool);
    for (tilt, reached) in [(0.3, true), (1.5, true), (std::f64::consts::FRAC_PI_2, false), (1.7, true)] {
        let axis = Unit::new_normalize(Vector3::new(f64::sin(tilt), 0.0, f64::cos(tilt)));
        let cl = ClPoint { tip: Point3::new(10.0, 20.0, 30.0), axis };
        match machine.inverse(&cl, TOOL) {
            Ok(solutions) => {
                assert!(reached);
                for s in solutions.iter() {
                    assert_reaches(&machine, &s.values, &cl, TOOL);
                }
            }
            Err(e) => assert_eq!((e, reached), (Unreachable::Singular, false)),
        }
    }
}

#[test]
fn a_moved_base_changes_nothing() {
    let mut r = Random(7);
    for machine in families() {
        let mut file = machine.to_file();
        let base = row(120.0, 33.0, -70.0, 61.0);
        file.workpiece_chain.rows.insert(0, base.clone());
        file.tool_chains[0].rows.insert(0, base);
        let moved = Machine::from_file(file).unwrap();
        for _ in 0..50 {
            let q = random_values(&mut r, &machine);
            let (a, b) = (machine.cl_point(&q, TOOL), moved.cl_point(&q, TOOL));
            assert!((a.tip - b.tip).norm() < 1e-9 && (*a.axis - *b.axis).norm() < 1e-12);
            let (s, t) = (machine.inverse(&a, TOOL).unwrap(), moved.inverse(&a, TOOL).unwrap());
            assert_eq!(s.len(), t.len());
            for (s, t) in s.iter().zip(t.iter()) {
                let (mm, rad) = difference(&machine, &s.values, &t.values);
                assert!(mm < 1e-5 && rad < 1e-8, "{s:?} {t:?}");
            }
        }
    }
}

#[test]
fn nothing_panics_and_no_nan_comes_out() {
    let strange = [f64::NAN, f64::INFINITY, -f64::INFINITY, 0.0, -0.0, 1e308, -1e308, 1e-308, 1e17];
    let mut r = Random(9);
    for machine in families() {
        for _ in 0..300 {
            let mut pick = || strange[r.below(strange.len())];
            let cl = ClPoint {
                tip: Point3::new(pick(), pick(), pick()),
                axis: Unit::new_unchecked(Vector3::new(pick(), pick(), pick())),
            };
            let previous = AxisValues::from([pick(), pick(), pick(), pick(), pick()]);
            let length = pick();
            if let Ok(q) = machine.nearest_inverse(&cl, length, Some(&previous), BranchPreference::Nearest) {
                assert!(q.is_finite());
            }
        }
    }
    let machine = Machine::head_b_table_c().unwrap();
    let nan = ClPoint { tip: Point3::new(f64::NAN, 0.0, 0.0), axis: Vector3::z_axis() };
    assert_eq!(machine.inverse(&nan, 0.0).unwrap_err(), Unreachable::NotFinite);
    let far = ClPoint { tip: Point3::new(1e9, 0.0, 0.0), axis: Unit::new_normalize(Vector3::new(0.3, 0.4, 1.0)) };
    assert!(machine.inverse(&far, 0.0).is_err());
}

#[test]
fn length_compensation_keeps_the_tip_in_place() {
    for machine in families() {
        let Some(travel) = machine.length_compensation_travel() else { continue };
        let zero = AxisValues::zeros(5);
        let tip = machine.cl_point(&zero, 0.0).tip;
        let moved = AxisValues::from_fn(5, |k| 80.0 * travel[k]);
        assert!((machine.cl_point(&moved, 80.0).tip - tip).norm() < 1e-9);
    }
    let mill = Machine::head_b_table_c().unwrap();
    let travel = mill.length_compensation_travel().unwrap();
    assert!((travel[2] - 1.0).abs() < 1e-12 && travel[0].abs() < 1e-12 && travel[1].abs() < 1e-12);
}

#[test]
fn unchecked_solutions_are_the_checked_ones_wherever_limits_allow_them() {
    let mut r = Random(10);
    let mut n_regular = 0;
    for machine in families().iter().chain(&families_of_three_rotaries()) {
        for _ in 0..200 {
            let q = random_values(&mut r, machine);
            let cl = cl_by_matrices(machine, &q, TOOL);
            let (all, checked) = (machine.inverse_unchecked(&cl, TOOL).unwrap(), machine.inverse(&cl, TOOL).unwrap());
            for s in checked.iter() {
                let near = |u: InverseSolution| {
                    let (mm, rad) = difference(machine, &s.values, &u.values);
                    mm < 1e-3 && rad < 1e-6 && s.branch == u.branch
                };
                assert!(all.iter().any(near), "{s:?} is not among {all:?}");
            }
            for s in all.iter() {
                let reached = cl_by_matrices(machine, &s.values, TOOL);
                let (tip, axis) = ((reached.tip - cl.tip).norm(), (*reached.axis - *cl.axis).norm());
                assert!(tip < 1e-6 && axis < 1e-10, "tip {tip:e}, axis {axis:e}");
                n_regular += usize::from(tip < 1e-10 && axis < 1e-13);
            }
        }
    }
    assert!(n_regular > 10_000, "{n_regular}");
}
