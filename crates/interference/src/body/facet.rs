//! Least distance of a body over a triangle.
//!
//! The least distance over a triangle lies at a corner, within an edge, or inside. Inside, either
//! the body's support point against the facet's normal projects onto the triangle (where the body's
//! support is a whole face that overlaps the triangle without any edge being as near, that face
//! projects wholly inside, so that any of its points will do), or the body passes through the
//! triangle without meeting an edge, and then every point of its section by the plane is inside.
//! Both are closed forms; only the edges iterate.

use nalgebra::{Point3, Vector3};

use crate::body::Body;
use crate::body::edge::{GAP, Goal, Sample, least_within_edge};

/// A point of the triangle whose distance from `body` is the least on it to within [`GAP`], or at
/// most `goal.enough`. `None` where the least distance is proven larger than `goal.beyond`.
///
/// With `enough == beyond` this is the verdict: `None` says proven farther.
#[inline(always)]
pub(crate) fn nearest_on_triangle(body: &impl Body, corners: &[Point3<f64>; 3], goal: Goal) -> Option<Sample> {
    let center = Point3::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
    let center = Sample::at(body, center);
    if center.distance <= goal.enough {
        return Some(center);
    }
    if lower_bound(&center, corners) > goal.beyond {
        return None;
    }
    let ends = corners.map(|p| Sample::at(body, p));
    let mut best = center;
    for end in &ends {
        if end.distance <= goal.enough {
            return Some(*end);
        }
        if lower_bound(end, corners) > goal.beyond {
            return None;
        }
        best = nearer(best, *end);
    }
    match nearest_inside(body, corners, goal) {
        Inside::Beyond => return None,
        Inside::Least(sample) => return Some(sample),
        Inside::Candidate(sample) => best = nearer(best, sample),
        Inside::None => {}
    }
    let mut goal = goal;
    for (a, b) in [(0, 1), (1, 2), (2, 0)] {
        goal.beyond = goal.beyond.min(best.distance.max(goal.enough));
        if let Some(sample) = least_within_edge(body, &ends[a], &ends[b], goal) {
            best = nearer(best, sample);
            if best.distance <= goal.enough + GAP {
                return Some(best);
            }
        }
    }
    // A distance that is not a number is not proven to be larger than anything.
    if best.distance > goal.beyond { None } else { Some(best) }
}

#[inline(always)]
fn nearer(a: Sample, b: Sample) -> Sample {
    if b.distance < a.distance { b } else { a }
}

/// Returns a lower bound of the distance on the triangle, by its slope at a point.
#[inline(always)]
pub(crate) fn lower_bound(sample: &Sample, corners: &[Point3<f64>; 3]) -> f64 {
    let slope = |p: &Point3<f64>| sample.gradient.dot(&(p - sample.point));
    sample.distance + slope(&corners[0]).min(slope(&corners[1])).min(slope(&corners[2]))
}

/// Knowledge of the least distance inside a triangle.
enum Inside {
    /// The whole triangle is farther than wanted.
    Beyond,
    /// The least distance on the whole triangle.
    Least(Sample),
    /// A point of the triangle that may be nearest.
    Candidate(Sample),
    /// The nearest point is on the border.
    None,
}

/// The point of the triangle opposite the body's support point, or where the body passes through.
#[inline(always)]
fn nearest_inside(body: &impl Body, corners: &[Point3<f64>; 3], goal: Goal) -> Inside {
    let (u, v) = (corners[1] - corners[0], corners[2] - corners[0]);
    let scaled = u.cross(&v);
    let area = scaled.norm();
    // A triangle without area has no inside: its edges are all of it.
    if area == 0.0 {
        return Inside::None;
    }
    let normal = scaled / area;
    let (below, above) = (body.support(&-normal), body.support(&normal));
    let (low, high) = (normal.dot(&(below - corners[0])), normal.dot(&(above - corners[0])));
    // Any direction separates soundly, whatever its rounding, as long as it is measured against all
    // three corners.
    if separation(&normal, &below, corners).max(separation(&-normal, &above, corners)) > goal.beyond {
        return Inside::Beyond;
    }
    let foot = if low > 0.0 {
        below
    } else if high < 0.0 {
        above
    } else if low < high {
        below + (above - below) * (low / (low - high)).clamp(0.0, 1.0)
    } else {
        // A disc in the triangle's plane.
        below
    };
    let Some(point) = projected(&(foot - corners[0]), &u, &v, &scaled) else { return Inside::None };
    let sample = Sample::at(body, corners[0] + point);
    if sample.distance <= goal.enough || lower_bound(&sample, corners) >= sample.distance - GAP {
        return Inside::Least(sample);
    }
    Inside::Candidate(sample)
}

/// Width of the slab across `along` between the corners (below) and the body, whose support point
/// is `support`.
#[inline(always)]
fn separation(along: &Vector3<f64>, support: &Point3<f64>, corners: &[Point3<f64>; 3]) -> f64 {
    let reach = |p: &Point3<f64>| along.dot(&(support - p));
    reach(&corners[0]).min(reach(&corners[1])).min(reach(&corners[2]))
}

/// Projection of a vector from corner 0 onto the triangle spanned by `u` and `v`; `None` where it
/// falls outside.
#[inline(always)]
fn projected(w: &Vector3<f64>, u: &Vector3<f64>, v: &Vector3<f64>, scaled: &Vector3<f64>) -> Option<Vector3<f64>> {
    let area_sq = scaled.norm_squared();
    let beta = w.cross(v).dot(scaled) / area_sq;
    let gamma = u.cross(w).dot(scaled) / area_sq;
    (beta >= 0.0 && gamma >= 0.0 && beta + gamma <= 1.0).then(|| u * beta + v * gamma)
}

#[cfg(test)]
#[path = "../../tests/unit/body/facet.rs"]
mod tests;
