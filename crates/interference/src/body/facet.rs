//! Least distance of a body over a triangle.
//!
//! The least distance over a triangle lies at a corner, within an edge, or inside. Inside, either the body's support
//! point against the facet's normal projects onto the triangle (where the body's support is a whole face that overlaps
//! the triangle without any edge being as near, that face projects wholly inside, so that any of its points will do),
//! or the body passes through the triangle without meeting an edge, and then every point of its section by the plane is
//! inside. Both are closed forms; only the edges iterate.

use nalgebra::{Point3, Vector3};

use crate::body::Body;
use crate::body::edge::{GAP, Goal, Sample, least_within_edge};

/// A point of the triangle whose distance from `body` is the least on it to within [`GAP`], or at most `goal.enough`.
/// `None` where the least distance is proven larger than `goal.beyond`.
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

/// What the distance on the triangle cannot fall below, by its slope at a point.
#[inline(always)]
pub(crate) fn lower_bound(sample: &Sample, corners: &[Point3<f64>; 3]) -> f64 {
    let slope = |p: &Point3<f64>| sample.gradient.dot(&(p - sample.point));
    sample.distance + slope(&corners[0]).min(slope(&corners[1])).min(slope(&corners[2]))
}

/// What is known of the least distance inside a triangle.
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
    // Any direction separates soundly, whatever its rounding, as long as it is measured against all three corners.
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

/// Width of the slab across `along` between the corners (below) and the body, whose support point is `support`.
#[inline(always)]
fn separation(along: &Vector3<f64>, support: &Point3<f64>, corners: &[Point3<f64>; 3]) -> f64 {
    let reach = |p: &Point3<f64>| along.dot(&(support - p));
    reach(&corners[0]).min(reach(&corners[1])).min(reach(&corners[2]))
}

/// Projection of a vector from corner 0 onto the triangle spanned by `u` and `v`; `None` where it falls outside.
#[inline(always)]
fn projected(w: &Vector3<f64>, u: &Vector3<f64>, v: &Vector3<f64>, scaled: &Vector3<f64>) -> Option<Vector3<f64>> {
    let area_sq = scaled.norm_squared();
    let beta = w.cross(v).dot(scaled) / area_sq;
    let gamma = u.cross(w).dot(scaled) / area_sq;
    (beta >= 0.0 && gamma >= 0.0 && beta + gamma <= 1.0).then(|| u * beta + v * gamma)
}

#[cfg(test)]
mod tests {
    use crate::body::facet::*;
    use crate::body::{Placed, for_body};
    use crate::test_kit::{Lcg, brute_triangle_distance, odd_triangle, sample_solids};
    use facemill_cl_data::Solid;
    use nalgebra::Isometry3;

    fn nearest(solid: &Solid, pose: &Isometry3<f64>, corners: &[Point3<f64>; 3], goal: Goal) -> Option<Sample> {
        for_body!(Placed::new(solid, pose), |b| nearest_on_triangle(&b, corners, goal))
    }

    const ALL: Goal = Goal { enough: 0.0, beyond: f64::INFINITY };

    fn assert_exact(solid: &Solid, pose: &Isometry3<f64>, corners: &[Point3<f64>; 3]) {
        let brute = brute_triangle_distance(solid, pose, corners);
        let found = nearest(solid, pose, corners, ALL).unwrap();
        assert!((found.distance - brute).abs() < 1e-9, "{solid:?} {pose} {corners:?}: {} for {brute}", found.distance);
        // The point named is of the triangle and has that distance.
        let there = solid.core_distance(&pose.inverse_transform_point(&found.point));
        assert!((there - found.distance).abs() < 1e-9);
        for (offset, free) in [(-1e-8, true), (1e-8, false)] {
            let rounding = brute + offset;
            if rounding < 0.0 {
                continue;
            }
            let verdict = nearest(solid, pose, corners, Goal { enough: rounding, beyond: rounding });
            assert_eq!(verdict.is_none(), free, "{solid:?} {pose} {corners:?} at {rounding} of {brute}");
        }
    }

    #[test]
    fn distance_and_verdict_are_those_of_golden_sections() {
        let mut lcg = Lcg::new(31);
        for solid in sample_solids() {
            for k in 0..640 {
                assert_exact(&solid, &lcg.pose(25.0), &odd_triangle(&mut lcg, k));
            }
        }
    }

    #[test]
    fn parallel_and_coplanar_triangles_are_exact() {
        let mut lcg = Lcg::new(32);
        for solid in sample_solids() {
            let aabb = solid.dilated(-solid.rounding()).aabb();
            for k in 0..200 {
                // Level with an end, just beyond it, or through the middle, from tiny to larger than the body.
                let level = [aabb.min.z, aabb.max.z, aabb.min.z - 1e-7, aabb.max.z + 0.3, aabb.center().z][k % 5];
                let reach = [0.5, 5.0, 60.0][k % 3];
                let corner = |lcg: &mut Lcg| Point3::new(lcg.range(-reach, reach), lcg.range(-reach, reach), level);
                let corners = [corner(&mut lcg), corner(&mut lcg), corner(&mut lcg)];
                assert_exact(&solid, &Isometry3::identity(), &corners);
                let pose = lcg.pose(25.0);
                assert_exact(&solid, &pose, &corners.map(|p| pose * p));
            }
        }
    }

    #[test]
    fn needles_through_the_body_meet_it() {
        let mut lcg = Lcg::new(33);
        for solid in sample_solids() {
            for _ in 0..40 {
                let pose = lcg.pose(20.0);
                let inside = pose * solid.interior_point();
                let (u, v) = (lcg.unit() * 80.0, lcg.unit() * 1e-6);
                let found = nearest(&solid, &pose, &[inside - u, inside + u + v, inside + u - v], ALL).unwrap();
                assert!(found.distance <= 1e-6, "{solid:?}: {}", found.distance);
            }
        }
    }
}
