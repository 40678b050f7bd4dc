//! Passes that end shortly before the plane across a feed, or begin shortly behind it.

use facemill_cl_data::CcPoint;
use nalgebra::Vector3;

use crate::cusp::cut_point::CutPoint;
use crate::cusp::neighbours::{LEAST_ALONG, Neighbour};

/// A pass that ends beside a point.
pub(super) struct BesideEnd {
    /// The pass continued from its end to the plane.
    pub(super) neighbour: Neighbour,
    /// Straight distance to the place where it would cross the plane, mm.
    pub(super) aside: f64,
    /// Distance of its end from the plane, mm.
    pub(super) gap: f64,
    /// Whether, on the side where that pass is missing, the end of the point's own pass is nearer
    /// than that pass.
    pub(super) is_at_own_end: bool,
}

/// Newton steps to the plane along a parabola that hardly bends on the way: after two, the rest is
/// below rounding.
const PLANE_STEPS: usize = 3;

/// Returns where a pass would cross the plane through `cc` across its feed if it continued beyond
/// its end with its curvature before the end; `None` where it would not reach the plane. The end is
/// the first of `points` with `is_first`, else the last.
pub(super) fn continued(cc: &CcPoint, points: &[CutPoint], is_first: bool) -> Option<CutPoint> {
    let inward = |k: usize| &points[if is_first { k } else { points.len() - 1 - k }];
    let outward = |p: &CutPoint| if is_first { -p.cc.feed.into_inner() } else { p.cc.feed.into_inner() };
    let (end, going) = (inward(0), outward(inward(0)));
    let (ahead, speed) = (cc.feed.dot(&(end.cc.position - cc.position)), cc.feed.dot(&going));
    if speed.abs() < LEAST_ALONG || ahead * speed > 0.0 {
        return None;
    }
    let mut way = -ahead / speed;
    // Over as much of the pass as is missing: over less, rounding would decide the curvature.
    let away = |k: &usize| (inward(*k).cc.position - end.cc.position).norm();
    let base = (1..points.len()).find(|k| away(k) >= way).unwrap_or(points.len() - 1);
    let length = away(&base);
    let per_way = |at_end: Vector3<f64>, at_base: Vector3<f64>| {
        if length >= 0.5 * way && length > 0.0 { (at_end - at_base) / length } else { Vector3::zeros() }
    };
    let bend = per_way(going, outward(inward(base)));
    let turn = per_way(end.cc.normal.into_inner(), inward(base).cc.normal.into_inner());
    for _ in 0..PLANE_STEPS {
        let (reached, slope) =
            (ahead + speed * way + 0.5 * cc.feed.dot(&bend) * way * way, speed + cc.feed.dot(&bend) * way);
        if slope.abs() < 0.5 * speed.abs() {
            return None;
        }
        way -= reached / slope;
    }
    let position = end.cc.position + going * way + bend * (0.5 * way * way);
    let there = going + bend * way;
    let feed = if is_first { -there } else { there };
    let cc = CcPoint::new(position, end.cc.normal.into_inner() + turn * way, feed).ok()?;
    Some(CutPoint { cc, posture: end.posture })
}
