//! Kind of a machine, directions of its axes, and directions that its tool axis can take.

use crate::common::*;
use facemill_inverse_kinematics::import::JointLine;
use facemill_inverse_kinematics::machine_file::{DhRow, Joint, RevoluteRange, Sense};
use facemill_inverse_kinematics::*;
use nalgebra::{Isometry3, Translation3, UnitQuaternion};

/// Returns the motion about or along a joint's line, written out.
fn motion(line: &JointLine, value: f64) -> Isometry3<f64> {
    match line.kind {
        AxisKind::Linear => Translation3::from(line.direction.into_inner() * value).into(),
        AxisKind::Rotary => {
            let turn = UnitQuaternion::from_axis_angle(&line.direction, value);
            Translation3::from(line.point.coords) * turn * Translation3::from(-line.point.coords)
        }
    }
}

#[test]
fn joint_lines_move_the_tool_as_the_machine_does() {
    let mut r = Random(17);
    for machine in families() {
        let lines = machine.joint_lines();
        let zero = machine.forward(&AxisValues::zeros(5), 150.0);
        assert_eq!(lines.len(), 5);
        for _ in 0..20 {
            let q = random_values(&mut r, &machine);
            let pose = lines.iter().fold(Isometry3::identity(), |m, l| m * motion(l, q[l.axis])) * zero;
            let expected = forward_by_matrices(&machine, &q, 150.0);
            assert!((pose.to_homogeneous() - expected).abs().max() < 1e-8, "{machine:?}");
        }
        assert!(lines.iter().all(|l| machine.axes()[l.axis].carried_by == l.carrier));
    }
}

#[test]
fn families_are_called_what_shops_call_them() {
    let head = |rows: Vec<DhRow>| machine(Vec::new(), rows);
    let mut nutating_fork = head_yxz();
    nutating_fork.push(rotary("C", Sense::Positive, None, row(0.0, 0.0, 0.0, 0.0)));
    nutating_fork.push(rotary("B", Sense::Positive, None, row(0.0, -40.0, 300.0, 0.0)));
    nutating_fork.push(row(0.0, 40.0, -200.0, 0.0));
    for (machine, name) in [
        (Machine::head_b_table_c().unwrap(), "head B, table C"),
        (trunnion_ac(Sense::Negative, [0.0; 3], 0.0, 50.0, None), "table-table A-C"),
        (nutating_head(), "head B (nutating, 45° toward +y), table C"),
        (head_ca(), "head-head C-A"),
        (head(nutating_fork), "head-head C-B (B nutating, 40° toward +y)"),
    ] {
        let family = machine.family();
        assert_eq!(family.to_string(), name);
        assert!(family.linear_table.is_empty());
        assert_eq!(family.linear_head.iter().map(AxisLetter::as_str).collect::<Vec<_>>().len(), 3);
    }
}

#[test]
fn reach_of_known_machines_is_the_closed_form() {
    let deg = f64::to_radians;
    let cap = |tilt: f64| 0.5 * (1.0 - deg(tilt).cos());
    let mut slot = head_ca().to_file();
    for row in &mut slot.tool_chains[0].rows {
        match &mut row.joint {
            Some(Joint::Revolute(j)) if j.axis == "C" => {
                j.range = RevoluteRange::Limited { min_deg: -30.0, max_deg: 30.0 }
            }
            Some(Joint::Revolute(j)) => j.range = RevoluteRange::Limited { min_deg: 0.0, max_deg: 60.0 },
            _ => {}
        }
    }
    let one_sided = trunnion_ac(Sense::Negative, [0.0; 3], 0.0, 50.0, Some((-120.0, 30.0)));
    for (machine, share, largest, cone) in [
        (Machine::head_b_table_c().unwrap(), cap(110.0), 110.0, 110.0),
        (one_sided, cap(120.0), 120.0, 120.0),
        (nutating_head(), cap(90.0), 90.0, 90.0),
        (Machine::from_file(slot).unwrap(), cap(60.0) / 6.0, 60.0, 0.0),
    ] {
        let reach = machine.axis_reach().unwrap();
        assert!((reach.share - share).abs() < 0.003, "{reach:?} for {share}");
        assert!(reach.smallest_tilt < 1e-6, "{reach:?}");
        assert!((reach.largest_tilt - deg(largest)).abs() < 1e-6, "{reach:?} for {largest}");
        assert!((reach.full_cone - deg(cone)).abs() < 1e-6, "{reach:?} for {cone}");
    }
}

/// A head that swivels by A, then B, both up to 40°: the corners are farther out than the sides.
#[test]
fn corners_of_the_reach_are_found() {
    let mut tool = head_yxz();
    tool.push(row(0.0, 0.0, 0.0, 90.0));
    tool.push(rotary("A", Sense::Positive, Some((-40.0, 40.0)), row(0.0, 90.0, 0.0, 90.0)));
    tool.push(rotary("B", Sense::Positive, Some((-40.0, 40.0)), row(0.0, 90.0, 0.0, 90.0)));
    tool.push(row(0.0, 90.0, -200.0, 0.0));
    let reach = machine(Vec::new(), tool).axis_reach().unwrap();
    let cos = 40_f64.to_radians().cos();
    assert!((reach.largest_tilt - (cos * cos).acos()).abs() < 1e-9, "{reach:?}");
    assert!((reach.full_cone - 40_f64.to_radians()).abs() < 1e-4, "{reach:?}");
}

/// For any values of the rotary axes, the tool axis is inside the reported reach.
#[test]
fn no_pose_is_outside_the_reach() {
    let mut r = Random(23);
    for machine in families().into_iter().take(8) {
        let reach = machine.axis_reach().unwrap();
        // Fields of equal area that some pose points into.
        let mut hit = vec![false; 40 * 80];
        for _ in 0..100_000 {
            let axis = machine.cl_point(&random_values(&mut r, &machine), 0.0).axis;
            let tilt = axis.xy().norm().atan2(axis.z);
            assert!(tilt <= reach.largest_tilt + 0.03 && tilt >= reach.smallest_tilt - 0.03, "{tilt}: {reach:?}");
            let field = |share: f64, n: f64| (share * n).min(n - 1.0) as usize;
            let azimuth = (axis.y.atan2(axis.x) / std::f64::consts::TAU).rem_euclid(1.0);
            hit[field(0.5 * (1.0 - axis.z), 40.0) * 80 + field(azimuth, 80.0)] = true;
        }
        let share = hit.iter().filter(|h| **h).count() as f64 / 3200.0;
        assert!((share - reach.share).abs() < 0.05, "{share} against {reach:?}");
        assert_eq!(reach.singular.len(), 2);
    }
}

#[test]
fn singular_direction_is_the_first_rotary_axis() {
    let reach = Machine::head_b_table_c().unwrap().axis_reach().unwrap();
    let reports: Vec<_> =
        reach.singular.iter().map(|s| (s.axis.as_str().to_owned(), s.direction.z, s.is_reached)).collect();
    assert_eq!(reports, [("C".to_owned(), 1.0, true), ("C".to_owned(), -1.0, false)]);
}

/// With two linear axes the reach is that for the reported tip.
#[test]
fn reach_with_two_linear_axes_is_reported_for_its_tip() {
    let machine = dual_mill_head();
    let reach = machine.axis_reach().unwrap();
    let tip = reach.tip.unwrap();
    assert!(reach.share > 0.0 && reach.share < 1.0 && reach.singular.is_empty(), "{reach:?}");
    let mut r = Random(5);
    let (n, mut reached) = (2000, 0);
    for _ in 0..n {
        let axis = r.direction();
        let tilt = axis.xy().norm().atan2(axis.z);
        let is_reached = machine.inverse(&facemill_cl_data::ClPoint { tip, axis }, 0.0).is_ok();
        reached += usize::from(is_reached);
        assert!(
            !is_reached || (reach.smallest_tilt - 0.06..reach.largest_tilt + 0.06).contains(&tilt),
            "{tilt} {reach:?}"
        );
        assert!(is_reached || tilt > reach.full_cone - 0.06, "{tilt} {reach:?}");
    }
    // Four standard deviations of the count, and the error of the grid.
    assert!((reached as f64 / n as f64 - reach.share).abs() < 0.045 + 0.02, "{reached} {reach:?}");
    assert!(Machine::head_b_table_c().unwrap().axis_reach().unwrap().tip.is_none());
}
