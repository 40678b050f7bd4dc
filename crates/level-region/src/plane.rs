//! Planes of levels.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// Plane of a level, across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelPlane {
    /// Pose of the level's frame: z along the axis, origin on the plane.
    work_from_level: Isometry3<f64>,
    height: f64,
}

impl LevelPlane {
    /// Returns the plane across an axis at a height: the coordinate along the axis, mm.
    pub fn new(axis: Unit<Vector3<f64>>, height: f64) -> Self {
        let half_turn = || UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
        let turn = UnitQuaternion::rotation_between_axis(&Vector3::z_axis(), &axis).unwrap_or_else(half_turn);
        let origin = Translation3::from(axis.into_inner() * height);
        Self { work_from_level: Isometry3::from_parts(origin, turn), height }
    }

    /// Returns the axis, to which the tool's is parallel.
    pub fn axis(&self) -> Unit<Vector3<f64>> {
        self.work_from_level.rotation * Vector3::z_axis()
    }

    /// Returns the height: the coordinate along the axis, mm.
    pub fn height(&self) -> f64 {
        self.height
    }

    /// Returns the point of the plane at coordinates of the level's frame, workpiece frame.
    pub fn at(&self, x: f64, y: f64) -> Point3<f64> {
        self.work_from_level * Point3::new(x, y, 0.0)
    }

    /// Returns a point in the level's frame: z is its height above the plane.
    pub fn seen_from(&self, point: &Point3<f64>) -> Point3<f64> {
        self.work_from_level.inverse_transform_point(point)
    }

    /// Returns the pose of an upright tool with its tip at a point, workpiece frame.
    pub(crate) fn upright_at(&self, tip: &Point3<f64>) -> Isometry3<f64> {
        Isometry3::from_parts(Translation3::from(tip.coords), self.work_from_level.rotation)
    }
}
