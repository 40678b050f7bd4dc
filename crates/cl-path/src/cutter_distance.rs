//! Signed distance of points from a cutter, and the least one of a surface.

use facemill_cl_data::{Aabb, ClPoint};
use facemill_surface_model::{Surface, SurfacePoint};
use facemill_tool_model::Cutter;
use nalgebra::{Point3, Unit, Vector3};

/// A place of a surface and its distance from a cutter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestPlace {
    /// The place.
    pub at: SurfacePoint,
    /// Distance from the cutter, mm; negative inside of it.
    pub distance: f64,
}

/// Returns the distance of a point from a cutter at a pose, mm: positive outside, negative inside,
/// where it is the way to the nearest place of its border. The cutter reaches up to its flute
/// length. A convex function of the point.
pub fn cutter_distance(cutter: &Cutter, cl: &ClPoint, p: &Point3<f64>) -> f64 {
    distance_and_slope(cutter, cl, p).0
}

/// Returns the distance of a point, and a subgradient there.
fn distance_and_slope(cutter: &Cutter, cl: &ClPoint, p: &Point3<f64>) -> (f64, Vector3<f64>) {
    let (rim, corner) = (cutter.rim_radius(), cutter.corner_radius());
    let top = (cutter.flute_length() - corner).max(corner);
    let from_tip = p - cl.tip;
    let height = from_tip.dot(&cl.axis);
    let across = from_tip - cl.axis.into_inner() * height;
    let radius = across.norm();
    let outward = if radius > 0.0 { across / radius } else { Vector3::zeros() };
    // The cutter is a cylinder dilated by its corner.
    let (side, upward) = (radius - rim, if corner - height > height - top { -1.0 } else { 1.0 });
    let end = (corner - height).max(height - top);
    let axial = cl.axis.into_inner() * upward;
    if side <= 0.0 && end <= 0.0 {
        return if side > end { (side - corner, outward) } else { (end - corner, axial) };
    }
    let (out, beyond) = (side.max(0.0), end.max(0.0));
    let from_core = out.hypot(beyond);
    (from_core - corner, (outward * out + axial * beyond) / from_core)
}

/// Returns the place of a surface, among the facets for which `keep` holds, that is deepest in a
/// cutter or nearest to it, at most `limit` mm away; `None` if there is none.
///
/// The distance is convex on each facet, so that nested searches find its least value, to 1e-6 of
/// the facet's size. Of places equally near, any.
pub fn nearest_to_cutter(
    surface: &Surface,
    cutter: &Cutter,
    cl: &ClPoint,
    limit: f64,
    keep: impl Fn(u32) -> bool,
) -> Option<NearestPlace> {
    let bound = |b: &Aabb| {
        let middle = nalgebra::center(&b.min, &b.max);
        let half = (b.max - b.min) * 0.5;
        let (distance, slope) = distance_and_slope(cutter, cl, &middle);
        distance - slope.abs().dot(&half)
    };
    let mut best: Option<NearestPlace> = None;
    let _ = surface.tree().nearest(limit, bound, |t, least| {
        if !keep(t) {
            return None;
        }
        let corners = surface.mesh().corners(t as usize);
        let middle = Point3::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
        let (distance, slope) = distance_and_slope(cutter, cl, &middle);
        let below = corners.iter().map(|c| slope.dot(&(c - middle))).fold(f64::INFINITY, f64::min);
        if distance + below > least {
            return None;
        }
        let (weights, distance) = least_on_facet(cutter, cl, &corners);
        if distance <= least && best.is_none_or(|b| distance < b.distance) {
            best = Some(NearestPlace { at: surface.point(t, weights), distance });
        }
        Some(distance)
    });
    best
}

/// Returns whether a facet faces a tool axis: it can be cut from there.
pub(crate) fn faces(surface: &Surface, triangle: u32, axis: &Unit<Vector3<f64>>) -> bool {
    surface.facet_normal(triangle).is_some_and(|normal| normal.dot(axis) > LEAST_FACING)
}

/// Least cosine of the angle of a facet's normal to the tool axis, that of 89°: the largest tilt
/// that an operation may have.
const LEAST_FACING: f64 = 0.01745;

/// Steps of the search for the least value on a line: 0.618^32 is 2e-7.
const SECTIONS: usize = 32;

/// Returns the weights of a facet's corners where the distance is least, and that distance.
fn least_on_facet(cutter: &Cutter, cl: &ClPoint, corners: &[Point3<f64>; 3]) -> ([f64; 3], f64) {
    let edges = [corners[1] - corners[0], corners[2] - corners[0]];
    let at = |u: f64, v: f64| cutter_distance(cutter, cl, &(corners[0] + edges[0] * u + edges[1] * v));
    let along = |u: f64| least_on_line(&|v| at(u, v), 1.0 - u);
    let (u, distance) = least_on_line(&|u| along(u).1, 1.0);
    let v = along(u).0;
    ([1.0 - u - v, u, v], distance)
}

/// Returns where a convex function is least from 0 to `end`, and its value there (golden section).
fn least_on_line(of: &dyn Fn(f64) -> f64, end: f64) -> (f64, f64) {
    const SHARE: f64 = 0.618_033_988_749_894_9;
    let (mut low, mut high) = (0.0, end);
    let mut inner = [high - SHARE * (high - low), low + SHARE * (high - low)];
    let mut values = inner.map(of);
    for _ in 0..SECTIONS {
        if values[0] <= values[1] {
            high = inner[1];
            inner = [high - SHARE * (high - low), inner[0]];
            values = [of(inner[0]), values[0]];
        } else {
            low = inner[0];
            inner = [inner[1], low + SHARE * (high - low)];
            values = [values[1], of(inner[1])];
        }
    }
    let middle = 0.5 * (low + high);
    // Borders and corners of facets are where distances often are least.
    let least = |a: (f64, f64), b: (f64, f64)| if b.1 < a.1 { b } else { a };
    [0.0, end].into_iter().map(|x| (x, of(x))).fold((middle, of(middle)), least)
}
