//! Tests whether a pass crosses another.

use facemill_cl_data::{Aabb, CcPoint};
use nalgebra::Point3;

use crate::cusp::neighbours::Neighbours;

/// Sine of the largest slope, seen from the place, between two passes that meet on one surface;
/// beyond it one is above the other.
const LARGEST_SLOPE: f64 = 0.5;

impl Neighbours {
    /// Returns whether a pass with these points crosses any of the passes on the same surface, seen
    /// along its normals.
    pub fn is_crossed_by(&self, pass: &[CcPoint]) -> bool {
        pass.windows(2).any(|pair| self.is_crossed_between([&pair[0], &pair[1]]))
    }

    fn is_crossed_between(&self, ends: [&CcPoint; 2]) -> bool {
        let own = ends.map(|cc| cc.position);
        let around = Aabb::of_points([&own[0], &own[1]]).dilated((own[1] - own[0]).norm());
        let near = |b: &Aabb| (0..3).all(|k| b.min[k] <= around.max[k] && b.max[k] >= around.min[k]);
        let crossed = |k: u32| {
            let [pass, segment] = self.segments[k as usize].map(|n| n as usize);
            let other = &self.passes[pass].points[segment..segment + 2];
            let is_same_side = ends[0].normal.dot(&other[0].cc.normal) > 0.0;
            (is_same_side && cross(ends[0], own, [other[0].cc.position, other[1].cc.position])).then_some(())
        };
        self.tree.find_in_boxes(near, crossed).is_some()
    }
}

/// Whether two segments cross, seen along the normal of a point, and are at about the same height
/// there.
fn cross(seen: &CcPoint, [a, b]: [Point3<f64>; 2], [c, d]: [Point3<f64>; 2]) -> bool {
    let normal = seen.normal.into_inner();
    let (own, other, between) = (b - a, d - c, c - a);
    let turn = normal.dot(&own.cross(&other));
    if turn.abs() <= f64::EPSILON * own.norm() * other.norm() {
        return false;
    }
    let on_own = normal.dot(&between.cross(&other)) / turn;
    let on_other = normal.dot(&between.cross(&own)) / turn;
    let inside = |share: f64| (0.0..=1.0).contains(&share);
    let apart = (between + other * on_other - own * on_own).norm();
    inside(on_own) && inside(on_other) && apart <= LARGEST_SLOPE * own.norm().max(other.norm())
}
