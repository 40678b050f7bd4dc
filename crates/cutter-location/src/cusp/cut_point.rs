//! Points of a pass as a cutter touches them.

use facemill_cl_data::{CcPoint, Posture};

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
    /// Curvature of the surface across the feed between the two, 1/mm, positive where the part is
    /// convex.
    pub curvature: f64,
}
