use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::machine_file::line_chain::pose;
use crate::machine_file::{BodyFile, DhRow, Joint};

/// Joint given by the line it moves along or turns about, with all axes at 0. The frame is the
/// bed's.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisLine {
    /// Address, limits and speeds. Its sense counts against `direction`: a table axis whose
    /// direction is that of its ISO letter is negative, because the table moves against the tool.
    pub joint: Joint,
    /// Direction of the row's z axis.
    pub direction: Unit<Vector3<f64>>,
    /// A point on a revolute joint's axis, mm; ignored for a prismatic one.
    pub point: Point3<f64>,
    /// Bodies that move with the joint, their poses given in the bed's frame.
    pub bodies: Vec<BodyFile>,
}

/// Sine below which two directions are taken as parallel: rounding of unit vectors.
const PARALLEL: f64 = 1e-14;

/// Sine below which the foot of a common normal is so far away (more than 100 times the distance of
/// the lines) that its place costs digits: the turn and the offset then get a row each.
const NEARLY_PARALLEL: f64 = 1e-2;

/// Distance below which two parallel lines count as one, mm.
const SAME_LINE: f64 = 1e-12;

/// Returns the rows of a chain from the bed whose joints lie on these lines and which ends in this
/// frame.
///
/// Craig's rows turn and shift about the previous x axis, so every frame gets its x along the
/// common normal to the next line. Rows without a joint appear only where necessary: before the
/// first joint, between two nearly parallel lines, and at the end. The rows reproduce lines and end
/// frame to rounding (1e-9 mm for machines of metres).
pub fn rows_from_axes(axes: &[AxisLine], bed_from_end: &Isometry3<f64>) -> Vec<DhRow> {
    let mut chain = Chain { rows: Vec::new(), open: fixed(), frame: Isometry3::identity() };
    for axis in axes {
        let point = match axis.joint {
            Joint::Prismatic(_) => None,
            Joint::Revolute(_) => Some(axis.point),
        };
        chain.go_to(&axis.direction, point);
        chain.open.joint = Some(axis.joint.clone());
        chain.placed_bodies(&axis.bodies);
    }
    chain.finish(bed_from_end)
}

impl DhRow {
    /// Returns RotX(alpha) · TransX(a) · RotZ(theta) · TransZ(d): the pose of the row's frame in
    /// the one before it, its joint at 0.
    pub fn transform(&self) -> Isometry3<f64> {
        let about = |axis, deg: f64| UnitQuaternion::from_axis_angle(&axis, deg.to_radians());
        Isometry3::from_parts(Translation3::identity(), about(Vector3::x_axis(), self.alpha_deg))
            * Translation3::new(self.a_mm, 0.0, 0.0)
            * about(Vector3::z_axis(), self.theta_deg)
            * Translation3::new(0.0, 0.0, self.d_mm)
    }
}

/// Rows up to the last but one, and the last one, whose theta and d are still open.
struct Chain {
    rows: Vec<DhRow>,
    open: DhRow,
    /// Frame of the open row, theta and d at 0.
    frame: Isometry3<f64>,
}

/// Position of a line behind the open row.
struct Normal {
    /// Turn and shift that bring the open row's frame to the common normal.
    theta: f64,
    d: f64,
    /// Angle from there to the line.
    alpha: f64,
    a: f64,
}

fn fixed() -> DhRow {
    DhRow { a_mm: 0.0, alpha_deg: 0.0, d_mm: 0.0, theta_deg: 0.0, joint: None, bodies: Vec::new() }
}

impl Chain {
    fn z(&self) -> Vector3<f64> {
        self.frame.rotation * Vector3::z()
    }

    /// Closes the open row with alpha and a that reach the line, and opens that line's row.
    fn go_to(&mut self, direction: &Unit<Vector3<f64>>, point: Option<Point3<f64>>) {
        let sine = self.z().cross(direction).norm();
        if point.is_some() && (PARALLEL..NEARLY_PARALLEL).contains(&sine) {
            let turn = self.normal(direction, None);
            self.next(&turn);
        }
        let normal = self.normal(direction, point);
        self.next(&normal);
    }

    fn normal(&self, direction: &Unit<Vector3<f64>>, point: Option<Point3<f64>>) -> Normal {
        let z = self.z();
        let x = self.frame.rotation * Vector3::x();
        let to_point = point.map_or_else(Vector3::zeros, |p| p.coords - self.frame.translation.vector);
        let cross = z.cross(direction);
        let (sine, cosine) = (cross.norm(), z.dot(direction));
        // Either end of the normal can be x: take the one that turns less.
        let turn = |n: &Vector3<f64>| z.dot(&x.cross(n)).atan2(x.dot(n));
        if sine < NEARLY_PARALLEL && (sine < PARALLEL || point.is_some()) {
            let across = to_point - z * z.dot(&to_point);
            let a = across.norm();
            let theta = if a < SAME_LINE { 0.0 } else { turn(&across) };
            let alpha = if cosine > 0.0 { 0.0 } else { std::f64::consts::PI };
            return Normal { theta, d: 0.0, alpha, a: if a < SAME_LINE { 0.0 } else { a } };
        }
        let unit = cross / sine;
        let (n, side) = if x.dot(&unit) < -1e-12 { (-unit, -1.0) } else { (unit, 1.0) };
        let d = to_point.cross(direction).dot(&cross) / (sine * sine);
        Normal { theta: turn(&n), d, alpha: side * sine.atan2(cosine), a: n.dot(&to_point) }
    }

    fn next(&mut self, normal: &Normal) {
        self.open.theta_deg += normal.theta.to_degrees();
        self.open.d_mm += normal.d;
        let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), normal.theta);
        let tilted = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), normal.alpha);
        let shifted = Translation3::new(normal.a, 0.0, normal.d);
        self.frame *= Isometry3::from_parts(Translation3::identity(), turned) * shifted * tilted;
        let next = DhRow { a_mm: normal.a, alpha_deg: normal.alpha.to_degrees(), ..fixed() };
        let closed = std::mem::replace(&mut self.open, next);
        self.close(closed);
    }

    /// Bodies are kept in the bed's frame until their row's frame is known.
    fn placed_bodies(&mut self, bodies: &[BodyFile]) {
        self.open.bodies = bodies.to_vec();
    }

    /// Adds a row, its bodies moved to its frame; one without effect is left out.
    fn close(&mut self, mut row: DhRow) {
        for value in [&mut row.a_mm, &mut row.alpha_deg, &mut row.d_mm, &mut row.theta_deg] {
            *value = clean(*value);
        }
        if row == fixed() {
            return;
        }
        let bed_from_before = self.rows.iter().fold(Isometry3::identity(), |m, row| m * row.transform());
        let frame_from_bed = (bed_from_before * row.transform()).inverse();
        for body in &mut row.bodies {
            move_body(body, &frame_from_bed);
        }
        self.rows.push(row);
    }

    fn finish(mut self, bed_from_end: &Isometry3<f64>) -> Vec<DhRow> {
        let z = bed_from_end.rotation * Vector3::z_axis();
        let normal = self.normal(&z, Some(Point3::from(bed_from_end.translation.vector)));
        let tilted = self.z().cross(&z).norm() > PARALLEL || self.z().dot(&z) < 0.0;
        if tilted || normal.a != 0.0 {
            self.go_to(&z, Some(Point3::from(bed_from_end.translation.vector)));
        }
        let rest = self.frame.inverse() * bed_from_end;
        let x = rest.rotation * Vector3::x();
        self.open.theta_deg += x.y.atan2(x.x).to_degrees();
        self.open.d_mm += rest.translation.vector.z;
        let last = std::mem::replace(&mut self.open, fixed());
        self.close(last);
        self.rows
    }
}

/// Removes rounding from a number that was meant to be shorter, and the sign from 0.
pub(crate) fn clean(value: f64) -> f64 {
    let short = (value * 1e9).round() / 1e9;
    if (value - short).abs() < 1e-12 { short + 0.0 } else { value }
}

/// Gives a body's pose in another frame.
pub(crate) fn move_body(body: &mut BodyFile, to_from: &Isometry3<f64>) {
    let pose = to_from * pose(body.position_mm, body.rotation_xyz_deg);
    body.position_mm = pose.translation.vector.map(clean).into();
    body.rotation_xyz_deg = angles_xyz(&pose.rotation).map(|angle| clean(angle.to_degrees()));
}

/// Angles about the fixed axes x, y and z, one after the other, that make a rotation.
///
/// Near ±90° about y, where x and z turn about one line, the angle about x takes what the rounded
/// one about z leaves, so that the product keeps all digits; an arc sine would lose half of them.
pub(crate) fn angles_xyz(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let m = rotation.to_rotation_matrix();
    let level = m[(0, 0)].hypot(m[(1, 0)]);
    // Below, its direction is rounding alone. Larger: the rotation is off by as much. Smaller:
    // bodies along an axis get odd angles.
    let z = if level < 1e-12 { 0.0 } else { m[(1, 0)].atan2(m[(0, 0)]) };
    let y = (-m[(2, 0)]).atan2(level);
    let (sin, cos) = z.sin_cos();
    let x = (sin * m[(0, 2)] - cos * m[(1, 2)]).atan2(cos * m[(1, 1)] - sin * m[(0, 1)]);
    [x, y, z]
}
