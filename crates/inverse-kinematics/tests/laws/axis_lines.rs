//! Rows made from lines: forward kinematics by screws and by Craig's matrices agree.

use crate::common::*;
use facemill_inverse_kinematics::import::{AxisLine, rows_from_axes};
use facemill_inverse_kinematics::machine_file::{BodyFile, Joint, PrismaticJoint, Sense, ShapeFile};
use facemill_inverse_kinematics::*;
use nalgebra::{Isometry3, Matrix4, Point3, Translation3, Unit, UnitQuaternion, Vector3};

fn joint_of(axis: &str, kind: AxisKind, sense: Sense) -> Joint {
    let joint = match kind {
        AxisKind::Linear => linear(axis, row(0.0, 0.0, 0.0, 0.0)).joint,
        AxisKind::Rotary => rotary(axis, sense, None, row(0.0, 0.0, 0.0, 0.0)).joint,
    };
    match joint.unwrap() {
        Joint::Prismatic(j) => Joint::Prismatic(PrismaticJoint { sense, ..j }),
        revolute => revolute,
    }
}

/// Directions along axes, in general, parallel, opposite and nearly parallel to the one before;
/// points near and equal.
fn random_lines(r: &mut Random) -> Vec<AxisLine> {
    let mut lines: Vec<AxisLine> = Vec::new();
    for axis in ["X", "Y", "Z", "A", "B", "C"].into_iter().take(r.below(7)) {
        let last = lines.last().map_or(Vector3::z_axis(), |l: &AxisLine| l.direction);
        let direction = match r.below(6) {
            0 => [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()][r.below(3)],
            1 => last,
            2 => -last,
            3 => {
                Unit::new_normalize(last.into_inner() + r.direction().into_inner() * 10_f64.powf(r.between(-15.0, 0.0)))
            }
            _ => r.direction(),
        };
        let point = match (r.below(3), lines.last()) {
            (0, Some(l)) => l.point + l.direction.into_inner() * r.between(-100.0, 100.0),
            (1, _) => Point3::origin(),
            _ => Point3::from(Vector3::from_fn(|_, _| r.between(-1500.0, 1500.0))),
        };
        let kind = if r.below(2) == 0 { AxisKind::Linear } else { AxisKind::Rotary };
        let sense = if r.below(2) == 0 { Sense::Positive } else { Sense::Negative };
        lines.push(AxisLine { joint: joint_of(axis, kind, sense), direction, point, bodies: Vec::new() });
    }
    lines
}

/// Returns the motion of one joint, written as a rotation about a line.
fn screw(line: &AxisLine, value: f64) -> Isometry3<f64> {
    match &line.joint {
        Joint::Prismatic(j) => {
            let value = if j.sense == Sense::Negative { -value } else { value };
            Isometry3::from(Translation3::from(line.direction.into_inner() * value))
        }
        Joint::Revolute(j) => {
            let value = if j.sense == Sense::Negative { -value } else { value };
            let turn = UnitQuaternion::from_axis_angle(&line.direction, value);
            Translation3::from(line.point.coords) * turn * Translation3::from(-line.point.coords)
        }
    }
}

fn random_end(r: &mut Random, lines: &[AxisLine]) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&r.direction(), r.between(-3.0, 3.0));
    let general = Translation3::from(Vector3::from_fn(|_, _| r.between(-500.0, 500.0))) * turn;
    let along = |d: &Unit<Vector3<f64>>| UnitQuaternion::rotation_between(&Vector3::z(), d).unwrap_or(turn);
    match (r.below(4), lines.last()) {
        (0, _) => Isometry3::identity(),
        (1, Some(l)) => Translation3::from(l.point.coords) * along(&l.direction),
        (2, Some(l)) => general.translation * along(&l.direction),
        _ => general,
    }
}

#[test]
fn product_of_screws_is_product_of_rows() {
    let mut r = Random(41);
    for round in 0..4000 {
        let lines = random_lines(&mut r);
        let end = random_end(&mut r, &lines);
        let rows = rows_from_axes(&lines, &end);
        let joints: Vec<&Joint> = rows.iter().filter_map(|row| row.joint.as_ref()).collect();
        assert_eq!(joints, lines.iter().map(|l| &l.joint).collect::<Vec<_>>());
        for _ in 0..3 {
            let values: Vec<f64> = lines.iter().map(|_| r.between(-3.0, 3.0)).collect();
            let by_screws = lines.iter().zip(&values).fold(Isometry3::identity(), |m, (l, v)| m * screw(l, *v)) * end;
            let value = |axis: &str| values[lines.iter().position(|l| l.joint.axis() == axis).unwrap()];
            let by_rows = rows.iter().fold(Matrix4::<f64>::identity(), |m, row| m * craig(row, &value));
            let difference: Matrix4<f64> = by_rows - by_screws.to_homogeneous();
            let turn = difference.fixed_view::<3, 3>(0, 0).abs().max();
            let shift = difference.column(3).abs().max();
            // Lines within rounding of parallel are set parallel, which turns a line by 1e-14.
            assert!(
                turn < 1e-12 && shift < 1e-9,
                "round {round}: {turn:e}, {shift:e} mm: {lines:?}\n{end:?}\n{rows:?}"
            );
        }
    }
}

#[test]
fn a_chain_has_no_more_rows_than_it_needs() {
    let line = |axis: &str, kind, direction, point: [f64; 3]| AxisLine {
        joint: joint_of(axis, kind, Sense::Positive),
        direction,
        point: Point3::from(point),
        bodies: Vec::new(),
    };
    let c = line("C", AxisKind::Rotary, Vector3::z_axis(), [0.0; 3]);
    let rows = rows_from_axes(&[c], &Isometry3::identity());
    assert_eq!(rows, [rotary("C", Sense::Positive, None, row(0.0, 0.0, 0.0, 0.0))]);
    assert!(rows_from_axes(&[], &Isometry3::identity()).is_empty());
    // A trunnion: A above the table's top, C through the origin.
    let a = line("A", AxisKind::Rotary, Vector3::x_axis(), [300.0, 0.0, 110.0]);
    let c = line("C", AxisKind::Rotary, Vector3::z_axis(), [0.0; 3]);
    let rows = rows_from_axes(&[a, c], &Isometry3::identity());
    assert!(rows.len() <= 4, "{rows:?}");
}

/// Asserts that a body on a line of an axis, put at a pose of the bed's frame, is there in its row.
fn assert_stays(mut lines: Vec<AxisLine>, k: usize, pose: &Isometry3<f64>) {
    let (x, y, z) = pose.rotation.euler_angles();
    let body = BodyFile {
        name: "probe".to_owned(),
        shape: ShapeFile::Box { size_mm: [1.0, 2.0, 3.0] },
        position_mm: pose.translation.vector.into(),
        rotation_xyz_deg: [x, y, z].map(f64::to_degrees),
        clearance_mm: 0.0,
    };
    lines[k].bodies.push(body);
    let rows = rows_from_axes(&lines, &Isometry3::identity());
    let holder = rows.iter().position(|row| !row.bodies.is_empty()).unwrap();
    assert_eq!(rows[holder].joint.as_ref(), Some(&lines[k].joint));
    let [position, turns] = [rows[holder].bodies[0].position_mm, rows[holder].bodies[0].rotation_xyz_deg];
    let [x, y, z] = turns.map(f64::to_radians);
    let in_row = Isometry3::from_parts(position.into(), UnitQuaternion::from_euler_angles(x, y, z));
    let frame = rows[..=holder].iter().fold(Matrix4::<f64>::identity(), |m, row| m * craig(row, &|_| 0.0));
    let difference: Matrix4<f64> = frame * in_row.to_homogeneous() - pose.to_homogeneous();
    assert!(difference.abs().max() < 1e-9, "{difference}");
}

#[test]
fn bodies_stay_where_they_were_put() {
    let mut r = Random(7);
    for _ in 0..50 {
        let lines = loop {
            let lines = random_lines(&mut r);
            if !lines.is_empty() {
                break lines;
            }
        };
        let pose = random_end(&mut r, &[]);
        let k = r.below(lines.len());
        assert_stays(lines, k, &pose);
    }
}

/// The angle about y is then next to 90°, where its arc sine has lost half of the digits.
#[test]
fn bodies_on_an_axis_that_is_nearly_level_stay_where_they_were_put() {
    for exponent in 1..17 {
        let off = 10_f64.powi(-exponent);
        for direction in [Vector3::new(1.0, 0.3 * off, off), Vector3::new(off, 1.0, off), Vector3::new(-1.0, off, 0.0)]
        {
            let line = AxisLine {
                joint: joint_of("B", AxisKind::Rotary, Sense::Positive),
                direction: Unit::new_normalize(direction),
                point: Point3::new(300.0, 0.0, 110.0),
                bodies: Vec::new(),
            };
            assert_stays(vec![line], 0, &Isometry3::translation(10.0, 20.0, 30.0));
        }
    }
}
