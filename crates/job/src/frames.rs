//! Poses and directions of files.

use facemill_cl_data::Aabb;
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::format::job_file::PoseFile;

/// Pose of the file as a transform.
pub fn pose(file: &PoseFile) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_axis_angle(&direction(&file.rotation_axis), file.rotation_deg.to_radians());
    Isometry3::from_parts(Translation3::from(file.translation_mm), rotation)
}

/// A direction that has been validated as one.
pub fn direction(v: &[f64; 3]) -> Unit<Vector3<f64>> {
    Unit::try_new(Vector3::from(*v), 0.0).unwrap_or_else(Vector3::z_axis)
}

/// Size of a box's diagonal, mm; 0 for an empty one.
pub fn diagonal(b: &Aabb) -> f64 {
    if b.is_empty() { 0.0 } else { (b.max - b.min).norm() }
}
