//! Contact of cutter and surface: CC to CL points.

use facemill_cl_data::{CcPoint, ClPoint, Posture};

use crate::cutter::Cutter;

/// The tool pose in which the cutter touches the surface at a CC point (CLOPT (1), (2), torus
/// form).
///
/// `Pcl = Pcc + r·N + (R − r)·d − r·a` with `d = (a×N×a)/|a×N|`, which is `−(cos α·Et′ − sin α·N)`
/// for α > 0. The second form is the one used: it divides by nothing, and at α = 0 it is the limit,
/// in which the bottom lies flat on the tangent plane with the CC point on its rim, ahead in the
/// direction Et′. r = 0 gives the printed (2), r = R a ball. A negative tilt is the positive one
/// with rotate turned by half a turn, as in (1).
pub fn cl_from_cc(cutter: &Cutter, cc: &CcPoint, posture: Posture) -> ClPoint {
    let posture = canonical(posture);
    let axis = cc.tool_axis(posture);
    let (sin, cos) = posture.tilt.sin_cos();
    let (normal, ahead) = (cc.normal.into_inner(), cc.tilt_direction(posture.rotate).into_inner());
    let d = normal * sin - ahead * cos;
    let tip = cc.position + (normal - axis.into_inner()) * cutter.corner_radius() + d * cutter.rim_radius();
    ClPoint { tip, axis }
}

/// The same posture with tilt ≥ 0.
pub(crate) fn canonical(posture: Posture) -> Posture {
    if posture.tilt < 0.0 {
        return Posture { tilt: -posture.tilt, rotate: posture.rotate + std::f64::consts::PI };
    }
    posture
}

#[cfg(test)]
#[path = "../tests/unit/contact.rs"]
mod tests;
