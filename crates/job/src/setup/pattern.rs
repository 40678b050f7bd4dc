//! Places of a pattern, in which passes are cut again.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use crate::format::job_file::PatternFile;
use crate::frames::direction;

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
