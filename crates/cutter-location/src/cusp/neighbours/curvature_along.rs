//! Curvature of a surface along a pass over it, from the normals of the pass.

use facemill_cl_data::CcPoint;
use facemill_tool_model::FeedCurvature;

use crate::cusp::cut_point::CutPoint;

/// Distance before and after a segment over which normals are compared, mm: normals of a mesh are
/// smooth to 1e-4 rad or so, which makes 3e-5/mm.
const WINDOW: f64 = 2.0;

/// Returns the curvature of the surface along each segment of a pass, and its twist; 0 across. Of
/// segments without length it is that of a plane.
pub(super) fn curvatures_along(points: &[CutPoint]) -> impl Iterator<Item = FeedCurvature> {
    let segments = points.len().saturating_sub(1);
    (0..segments).map(move |k| {
        let near = |from: usize, to: usize| (points[to].cc.position - points[from].cc.position).norm() < WINDOW;
        let before = (0..k).rev().find(|&b| !near(b, k)).unwrap_or(0);
        let after = (k + 2..points.len()).find(|&a| !near(k + 1, a)).unwrap_or(segments);
        between(&points[before].cc, &points[after].cc).unwrap_or_default()
    })
}

/// Returns the curvature on the way from one point of a pass to a later one, by the turn of the
/// normal; `None` where they are the same, or opposite each other.
fn between(from: &CcPoint, to: &CcPoint) -> Option<FeedCurvature> {
    let way = to.position - from.position;
    let normal = (from.normal.into_inner() + to.normal.into_inner()).try_normalize(f64::MIN_POSITIVE)?;
    let length = way.norm();
    let feed = (way - normal * normal.dot(&way)).try_normalize(f64::MIN_POSITIVE)?;
    let turn = (to.normal.into_inner() - from.normal.into_inner()) / length;
    Some(FeedCurvature { along: turn.dot(&feed), twist: turn.dot(&normal.cross(&feed)), across: 0.0 })
}
