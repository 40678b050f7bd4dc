use std::ops::Range;

use nalgebra::{Isometry3, Matrix3, Point3, SMatrix, SVector, Translation3, Unit, UnitQuaternion, Vector3};

use crate::axes::axis::AxisKind;
use crate::axes::axis_values::AxisValues;

/// Length that counts as much as 1 rad where both are in one matrix, mm.
pub(crate) const METRE: f64 = 1000.0;

/// A joint as a screw in the table frame at the zero pose (all axis values 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Screw {
    /// Index of its axis.
    pub(crate) axis: usize,
    pub(crate) kind: AxisKind,
    /// Direction in which, or about which (right-handed), a positive value moves the tool relative
    /// to the table.
    pub(crate) direction: Unit<Vector3<f64>>,
    /// A point on the axis of a rotary joint.
    pub(crate) point: Vector3<f64>,
    /// Constant parts of the turn of a rotary joint.
    turn: TurnParts,
}

/// Rodrigues' formula: the turn is `along + cos·across + sin·cross`, and moves the table frame's
/// origin by `(1 − cos)·arm − sin·cross_arm`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TurnParts {
    along: Matrix3<f64>,
    across: Matrix3<f64>,
    cross: Matrix3<f64>,
    arm: Vector3<f64>,
    cross_arm: Vector3<f64>,
}

impl Screw {
    pub(crate) fn new(axis: usize, kind: AxisKind, direction: Unit<Vector3<f64>>, point: Vector3<f64>) -> Self {
        let w = direction.into_inner();
        let along = w * w.transpose();
        let (across, cross) = (Matrix3::identity() - along, w.cross_matrix());
        let turn = TurnParts { along, across, cross, arm: across * point, cross_arm: cross * point };
        Self { axis, kind, direction, point, turn }
    }

    /// Returns rotation and translation of everything behind a rotary joint, given cosine and sine
    /// of its value.
    fn turned(&self, [cos, sin]: [f64; 2]) -> (Matrix3<f64>, Vector3<f64>) {
        let turn = &self.turn;
        (turn.along + turn.across * cos + turn.cross * sin, turn.arm * (1.0 - cos) - turn.cross_arm * sin)
    }

    /// Returns the motion of everything behind the joint when its axis moves from 0 to `value`.
    pub(crate) fn motion(&self, value: f64) -> Isometry3<f64> {
        match self.kind {
            AxisKind::Linear => Isometry3::from_parts(
                Translation3::from(self.direction.into_inner() * value),
                UnitQuaternion::identity(),
            ),
            AxisKind::Rotary => {
                let turn = UnitQuaternion::from_axis_angle(&self.direction, value);
                Isometry3::from_parts(Translation3::from(self.point - turn * self.point), turn)
            }
        }
    }
}

/// The loop table → bed → tool as one open chain: table joints from the table inward, then head
/// joints outward.
///
/// The pose of a link is the product of the motions of all joints between it and the table, times
/// its pose at the zero pose (product of exponentials; the DH rows are only needed to set it up).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ScrewChain {
    pub(crate) screws: Vec<Screw>,
    /// Spindle nose in the table frame at the zero pose.
    pub(crate) table_from_nose: Isometry3<f64>,
}

/// Tool tip as a function of the linear axes while the rotary axes do not move:
/// `tip = offset + directions · linears`.
pub(crate) struct LinearMap {
    pub(crate) offset: Vector3<f64>,
    /// Columns in the order of the linear joints in the chain.
    pub(crate) directions: Matrix3<f64>,
    /// Tool axis, which depends only on the rotary axes.
    pub(crate) tool_axis: Vector3<f64>,
}

impl ScrewChain {
    /// Returns the motion of a link that `n_joints` joints separate from the table.
    pub(crate) fn motion_behind(&self, n_joints: usize, q: &AxisValues) -> Isometry3<f64> {
        self.motion_on(Isometry3::identity(), 0..n_joints, q)
    }

    /// Returns the motion of a link behind these joints, from that of the link in front of them.
    pub(crate) fn motion_on(&self, front: Isometry3<f64>, joints: Range<usize>, q: &AxisValues) -> Isometry3<f64> {
        self.screws[joints].iter().fold(front, |m, s| m * s.motion(q.get_or_zero(s.axis)))
    }

    /// Returns the tool pose, whose tip lies `tool_length` in front of the nose.
    pub(crate) fn forward(&self, q: &AxisValues, tool_length: f64) -> Isometry3<f64> {
        self.motion_behind(self.screws.len(), q) * self.table_from_tool_at_zero(tool_length)
    }

    pub(crate) fn table_from_tool_at_zero(&self, tool_length: f64) -> Isometry3<f64> {
        self.table_from_nose * Translation3::new(0.0, 0.0, -tool_length)
    }

    /// Returns the tool axis at the zero pose.
    pub(crate) fn spindle_at_zero(&self) -> Unit<Vector3<f64>> {
        self.table_from_nose.rotation * Vector3::z_axis()
    }

    /// Returns the velocities that the first five joints, in chain order, give the tool at `q`: of
    /// the tool axis along two directions across it (the two vectors), and of the tip per metre;
    /// linear joints per metre too.
    pub(crate) fn tool_velocities(&self, q: &AxisValues, tool_length: f64) -> (SMatrix<f64, 5, 5>, [Vector3<f64>; 2]) {
        let end = self.forward(q, tool_length);
        let (tip, tool_axis) = (Point3::from(end.translation.vector), end.rotation * Vector3::z());
        let across = tool_axis.cross(&Vector3::ith(tool_axis.iamin(), 1.0)).normalize();
        let across = [across, tool_axis.cross(&across)];
        let mut velocities = SMatrix::<f64, 5, 5>::zeros();
        let mut motion = Isometry3::identity();
        for (k, screw) in self.screws.iter().take(5).enumerate() {
            let direction = motion.rotation * screw.direction.into_inner();
            let (of_axis, of_tip) = match screw.kind {
                AxisKind::Linear => (Vector3::zeros(), direction),
                AxisKind::Rotary => {
                    let arm = tip - motion * Point3::from(screw.point);
                    (direction.cross(&tool_axis), direction.cross(&arm) / METRE)
                }
            };
            let turn = across.map(|t| t.dot(&of_axis));
            velocities.set_column(k, &SVector::from([turn[0], turn[1], of_tip.x, of_tip.y, of_tip.z]));
            motion *= screw.motion(q.get_or_zero(screw.axis));
        }
        (velocities, across)
    }

    /// Returns tip and tool axis for the rotary values in `q` as a function of the linear values.
    /// Linear joints beyond three are 0.
    pub(crate) fn linear_map(&self, q: &AxisValues, tool_length: f64) -> LinearMap {
        let mut rotation = Matrix3::identity();
        let mut offset = Vector3::zeros();
        let mut directions = Matrix3::zeros();
        let (mut n_linear, mut is_first) = (0, true);
        for screw in &self.screws {
            match screw.kind {
                AxisKind::Linear if n_linear < 3 => {
                    directions.set_column(n_linear, &(rotation * screw.direction.into_inner()));
                    n_linear += 1;
                }
                AxisKind::Linear => {}
                AxisKind::Rotary => {
                    let (sin, cos) = q.get_or_zero(screw.axis).sin_cos();
                    let (turn, shift) = screw.turned([cos, sin]);
                    (offset, rotation) =
                        if is_first { (shift, turn) } else { (offset + rotation * shift, rotation * turn) };
                    is_first = false;
                }
            }
        }
        let spindle = self.spindle_at_zero();
        let tip = self.table_from_nose.translation.vector - spindle.into_inner() * tool_length;
        LinearMap { offset: offset + rotation * tip, directions, tool_axis: rotation * spindle.into_inner() }
    }
}

impl LinearMap {
    /// Smallest |determinant| of the three unit directions at which the tip can be placed. At 1e-9
    /// an error of 1e-15 in a direction already moves an axis by 1e-6 of the distance; smaller is
    /// worse, larger refuses usable poses.
    pub(crate) const MIN_DETERMINANT: f64 = 1e-9;

    /// Returns the linear values that bring the tip to `tip`; `None` when the three directions lie
    /// in a plane.
    pub(crate) fn solve(&self, tip: &Point3<f64>) -> Option<Vector3<f64>> {
        let (rows, determinant) = self.cofactors();
        if determinant.abs() < Self::MIN_DETERMINANT || determinant.is_nan() {
            return None;
        }
        let cramer =
            |rhs: Vector3<f64>| Vector3::new(rhs.dot(&rows[0]), rhs.dot(&rows[1]), rhs.dot(&rows[2])) / determinant;
        let values = cramer(tip.coords - self.offset);
        // One refinement step brings oblique directions to the accuracy of orthogonal ones.
        Some(values + cramer(tip.coords - self.tip(&values)))
    }

    /// Returns the rows of the adjugate of the directions, and their determinant.
    pub(crate) fn cofactors(&self) -> ([Vector3<f64>; 3], f64) {
        let [x, y, z] = [0, 1, 2].map(|k| self.directions.column(k).into_owned());
        let rows = [y.cross(&z), z.cross(&x), x.cross(&y)];
        (rows, x.dot(&rows[0]))
    }

    /// Returns the first two linear values that bring the tip nearest to `tip`; `None` when the two
    /// directions are parallel.
    pub(crate) fn solve_two(&self, tip: &Point3<f64>) -> Option<Vector3<f64>> {
        let [x, y] = [0, 1].map(|k| self.directions.column(k).into_owned());
        let normal = x.cross(&y);
        let square = normal.norm_squared();
        if square.sqrt() < Self::MIN_DETERMINANT || square.is_nan() {
            return None;
        }
        let (yn, nx) = (y.cross(&normal), normal.cross(&x));
        let cramer = |rhs: Vector3<f64>| Vector3::new(rhs.dot(&yn), rhs.dot(&nx), 0.0) / square;
        let values = cramer(tip.coords - self.offset);
        Some(values + cramer(tip.coords - self.tip(&values)))
    }

    /// Returns the tip at these linear values.
    pub(crate) fn tip(&self, linears: &Vector3<f64>) -> Vector3<f64> {
        self.offset + self.directions * linears
    }
}
