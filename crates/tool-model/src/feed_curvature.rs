//! Curvature of a surface seen along the feed.

/// Curvature of a surface at a CC point, its second fundamental form in the frame of the feed: a
/// step x along the feed and y to its left ends ½·(along·x² + 2·twist·x·y + across·y²) below the
/// tangent plane. All 1/mm; a plane is the default.
///
/// The opposite feed has the same curvature.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeedCurvature {
    /// Normal curvature along the feed, positive where the part is convex.
    pub along: f64,
    /// Turn of the normal to the left per step along the feed.
    pub twist: f64,
    /// Normal curvature across the feed, positive where the part is convex.
    pub across: f64,
}

impl FeedCurvature {
    /// Returns the curvature of a cylinder along which the feed is straight.
    pub const fn straight(across: f64) -> Self {
        Self { along: 0.0, twist: 0.0, across }
    }
}
