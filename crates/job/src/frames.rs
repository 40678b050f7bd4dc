//! Poses, directions and places of patterns of files.

use facemill_cl_data::Aabb;
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::format::job_file::{PatternFile, PoseFile};

/// Returns a pose of a file as a transform.
pub fn pose(file: &PoseFile) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_axis_angle(&direction(&file.rotation_axis), file.rotation_deg.to_radians());
    Isometry3::from_parts(Translation3::from(file.translation_mm), rotation)
}

/// Returns a direction of a file that has passed validation.
pub fn direction(v: &[f64; 3]) -> Unit<Vector3<f64>> {
    Unit::try_new(Vector3::from(*v), 0.0).unwrap_or_else(Vector3::z_axis)
}

/// Returns the diagonal of a box, mm; 0 for an empty one.
pub fn diagonal(b: &Aabb) -> f64 {
    if b.is_empty() { 0.0 } else { (b.max - b.min).norm() }
}

/// Returns the pose of each place of a pattern relative to the first, the first included.
pub fn places(pattern: Option<&PatternFile>) -> Vec<Isometry3<f64>> {
    let Some(p) = pattern else { return vec![Isometry3::identity()] };
    let origin = Translation3::from(p.origin_mm);
    (0..p.copies)
        .map(|k| {
            let angle = (p.index_angle_deg * f64::from(k)).to_radians();
            origin * UnitQuaternion::from_axis_angle(&direction(&p.axis), angle) * origin.inverse()
        })
        .collect()
}
