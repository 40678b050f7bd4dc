//! Intersections of a pass with a plane.

use facemill_cl_data::CcPoint;
use nalgebra::{Point3, Vector3};

use crate::cusp::cut_point::CutPoint;

/// Bisections of a segment of 5 mm to 5 nm.
const CROSSING_STEPS: u32 = 20;

/// Returns where the segment between two points crosses the plane through `cc` across its feed.
///
/// The segment is the cubic with both feeds at its ends where they point along it, so points far
/// apart on a strong bend do not cut the corner; else it is the chord.
pub(super) fn section_crossing(cc: &CcPoint, [a, b]: [&CutPoint; 2]) -> Option<CutPoint> {
    let ahead = |p: &Point3<f64>| (p - cc.position).dot(&cc.feed);
    let (at_a, at_b) = (ahead(&a.cc.position), ahead(&b.cc.position));
    if (at_a > 0.0) == (at_b > 0.0) {
        return None;
    }
    let chord = b.cc.position - a.cc.position;
    let length = chord.norm();
    let goes_along = |p: &CutPoint| p.cc.feed.dot(&chord) > 0.5 * length;
    let linear = at_a / (at_a - at_b);
    let (t, position) = if goes_along(a) && goes_along(b) {
        let (from, to) = (a.cc.feed.into_inner() * length, b.cc.feed.into_inner() * length);
        let at = |t: f64| {
            let s = 1.0 - t;
            a.cc.position + chord * (t * t * (3.0 - 2.0 * t)) + from * (t * s * s) - to * (t * t * s)
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..CROSSING_STEPS {
            let middle = 0.5 * (low + high);
            if (ahead(&at(middle)) > 0.0) == (at_a > 0.0) { low = middle } else { high = middle }
        }
        let t = 0.5 * (low + high);
        (t, at(t))
    } else {
        (linear, a.cc.position + chord * linear)
    };
    let nearer = if t < 0.5 { a } else { b };
    let blend = |p: &Vector3<f64>, q: &Vector3<f64>| p * (1.0 - t) + q * t;
    let cc = CcPoint::new(position, blend(&a.cc.normal, &b.cc.normal), blend(&a.cc.feed, &b.cc.feed)).ok()?;
    Some(CutPoint { cc, posture: nearer.posture })
}
