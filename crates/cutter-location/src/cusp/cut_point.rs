//! Points of a pass as a cutter touches them, and the surface there.

use facemill_cl_data::{CcPoint, Posture};
use facemill_surface_model::CurvatureTensor;
use facemill_tool_model::FeedCurvature;
use nalgebra::Vector3;

/// A CC point with the posture it is cut in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutPoint {
    /// Position.
    pub cc: CcPoint,
    /// Posture.
    pub posture: Posture,
}

/// The surface between a CC point and the neighbouring pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strip {
    /// Arc length to the neighbouring pass across the feed, mm.
    pub step_over: f64,
    /// Curvature of the surface: across the feed that of the circle through both CC points with
    /// their normals, along it and of the twist that along the neighbouring pass.
    pub curvature: FeedCurvature,
}

impl Strip {
    /// Returns a strip of this width (mm) on a plane.
    pub const fn on_plane(step_over: f64) -> Self {
        Self { step_over, curvature: FeedCurvature::straight(0.0) }
    }
}

/// Returns the curvature of a surface in the frame of a CC point's feed; that of a plane without
/// one.
pub fn feed_curvature(curvature: Option<&CurvatureTensor>, cc: &CcPoint) -> FeedCurvature {
    let Some(curvature) = curvature else { return FeedCurvature::default() };
    // The tensor's normal may differ from that of the CC point by what the mesh is coarse.
    let on_surface = |v: &Vector3<f64>| {
        let tangent = v - curvature.normal.into_inner() * curvature.normal.dot(v);
        tangent.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector3::zeros)
    };
    let left = cc.left();
    let normal_curvature = |along: &Vector3<f64>| curvature.normal_curvature(along).unwrap_or(0.0);
    FeedCurvature {
        along: normal_curvature(&cc.feed),
        twist: on_surface(&cc.feed).dot(&(curvature.tensor * on_surface(&left))),
        across: normal_curvature(&left),
    }
}
