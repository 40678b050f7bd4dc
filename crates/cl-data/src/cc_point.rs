//! Cutter-contact points.

use nalgebra::{Isometry3, Point3, Rotation3, Unit, Vector3};

/// Contact of the cutter with the part: position on the surface, outward unit normal N, unit feed
/// direction Et.
///
/// The feed direction is tangent to the surface; [`CcPoint::new`] projects it. Workpiece frame, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CcPoint {
    /// Contact point on the part (Pcc).
    pub position: Point3<f64>,
    /// Unit normal out of the material (N).
    pub normal: Unit<Vector3<f64>>,
    /// Unit feed direction in the tangent plane (Et).
    pub feed: Unit<Vector3<f64>>,
}

/// Reason why three vectors are not a CC point.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CcPointError {
    /// A coordinate is NaN or infinite.
    #[error("CC point has a coordinate that is not finite")]
    NotFinite,
    /// The normal has no direction.
    #[error("CC point has a normal of length zero")]
    NoNormal,
    /// The feed direction is parallel to the normal, so it gives no direction in the tangent plane.
    #[error("CC point has a feed direction parallel to its normal")]
    FeedAlongNormal,
}

impl CcPoint {
    /// Normalises `normal` and the part of `feed` that is tangent to the surface.
    ///
    /// # Errors
    /// When a coordinate is not finite, the normal is zero, or the feed direction has no tangential
    /// part (below 1e-9 of its length: closer to the normal its direction is rounding noise).
    pub fn new(position: Point3<f64>, normal: Vector3<f64>, feed: Vector3<f64>) -> Result<Self, CcPointError> {
        let finite = position.coords.iter().chain(normal.iter()).chain(feed.iter()).all(|v| v.is_finite());
        if !finite {
            return Err(CcPointError::NotFinite);
        }
        let normal = Unit::try_new(normal, 0.0).ok_or(CcPointError::NoNormal)?;
        let tangent = feed - normal.into_inner() * normal.dot(&feed);
        let feed = Unit::try_new(tangent, 1e-9 * feed.norm()).ok_or(CcPointError::FeedAlongNormal)?;
        Ok(Self { position, normal, feed })
    }

    /// Returns the tilt direction Et′: the feed direction turned about N by `rotate`, right-handed
    /// (CLOPT, before (1)).
    pub fn tilt_direction(&self, rotate: f64) -> Unit<Vector3<f64>> {
        Rotation3::from_axis_angle(&self.normal, rotate) * self.feed
    }

    /// Returns the tool axis of a posture, from tip to spindle (CLOPT (1), Ncl), in the form
    /// `cos α·N + sin α·Et′`, which is the printed quotient without its pole at 90°.
    pub fn tool_axis(&self, posture: Posture) -> Unit<Vector3<f64>> {
        let (sin, cos) = posture.tilt.sin_cos();
        let axis = self.normal.into_inner() * cos + self.tilt_direction(posture.rotate).into_inner() * sin;
        Unit::new_normalize(axis)
    }

    /// Returns the posture with this tool axis: the inverse of [`CcPoint::tool_axis`]. Tilt is in
    /// 0..=π, rotate in −π..=π, and 0 where the axis lies along the normal.
    pub fn posture_of(&self, axis: &Unit<Vector3<f64>>) -> Posture {
        let (along, left, up) = (self.feed.dot(axis), self.left().dot(axis), self.normal.dot(axis));
        let across = along.hypot(left);
        let rotate = if across == 0.0 { 0.0 } else { left.atan2(along) };
        Posture { tilt: across.atan2(up), rotate }
    }

    /// Returns the direction across the feed in the tangent plane, to the left of the feed seen
    /// from outside: N × Et.
    pub fn left(&self) -> Unit<Vector3<f64>> {
        Unit::new_normalize(self.normal.cross(&self.feed))
    }

    /// Returns the same point of the part after the part has moved by `to_from`.
    #[must_use]
    pub fn transformed(&self, to_from: &Isometry3<f64>) -> Self {
        Self {
            position: to_from * self.position,
            normal: to_from.rotation * self.normal,
            feed: to_from.rotation * self.feed,
        }
    }
}

/// Tool pose: APT `GOTO/x,y,z,i,j,k`. Workpiece frame, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClPoint {
    /// Tool tip: centre of the cutter's bottom, on the axis (Pcl).
    pub tip: Point3<f64>,
    /// Unit tool axis from tip to spindle (Ncl).
    pub axis: Unit<Vector3<f64>>,
}

impl ClPoint {
    /// Returns the same tool pose after part and tool have moved by `to_from`.
    #[must_use]
    pub fn transformed(&self, to_from: &Isometry3<f64>) -> Self {
        Self { tip: to_from * self.tip, axis: to_from.rotation * self.axis }
    }

    /// Returns the pose moved by `by`, with the same axis.
    #[must_use]
    pub fn translated(&self, by: Vector3<f64>) -> Self {
        Self { tip: self.tip + by, axis: self.axis }
    }
}

/// Tilt α and rotate β of CLOPT (1), in rad.
///
/// `tilt` ≥ 0 is the angle between the cutter's bottom plane and the tangent plane; `rotate` turns
/// the tilt direction about the normal from the feed direction, right-handed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Posture {
    /// α, rad.
    pub tilt: f64,
    /// β, rad.
    pub rotate: f64,
}

impl Posture {
    /// Returns the lead: the lean of the axis along the feed, `tan(lead) = tan α · cos β`.
    pub fn lead(&self) -> f64 {
        (self.tilt.sin() * self.rotate.cos()).atan2(self.tilt.cos())
    }

    /// Returns the lean of the axis to the left of the feed, `tan(lean) = tan α · sin β`.
    pub fn lean(&self) -> f64 {
        (self.tilt.sin() * self.rotate.sin()).atan2(self.tilt.cos())
    }

    /// Returns the posture with this lead and lean, each in (−π/2, π/2). Rotate is 0 where both are
    /// 0.
    pub fn from_lead_lean(lead: f64, lean: f64) -> Self {
        let (along, across) = (lead.tan(), lean.tan());
        Self {
            tilt: along.hypot(across).atan(),
            rotate: if along == 0.0 && across == 0.0 { 0.0 } else { across.atan2(along) },
        }
    }
}

#[cfg(test)]
#[path = "../tests/unit/cc_point.rs"]
mod tests;
