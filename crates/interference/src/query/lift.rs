use facemill_cl_data::Solid;
use nalgebra::{Isometry3, Point3, Translation3, Unit, Vector3};

use crate::body::Body;
use crate::body::edge::{Goal, Sample};
use crate::body::facet::nearest_on_triangle;
use crate::query::Interference;

/// Steps by distance before bisection takes over: seating on a nearly parallel surface takes 2
/// to 5.
const MAX_STEPS: usize = 24;

/// Finest resolution, mm: the accuracy of a verdict.
const FINEST: f64 = 1e-9;

/// Least lift (mm, from 0 to `max_lift`) of a solid along a direction that frees it; `None` where
/// none is found.
///
/// The returned lift is itself verified free, and the lift `resolution` below it is a hit or
/// negative. `direction` is in the mesh frame. A `resolution` of 0 or less counts as 1e-9 mm, the
/// accuracy of a verdict.
///
/// Of a [`crate::mesh_tree::MeshTree`] it is the *first* free lift but for free windows narrower
/// than the resolution: the lifts at which a convex body touches a triangle are an interval, and
/// from each triangle that is met the lift goes to the end of its interval; inside a closed
/// component it goes to where the component ends. Of other meshes it is found by steps and
/// bisection, which may pass over windows.
pub fn lift_to_free(
    mesh: &(impl Interference + ?Sized),
    solid: &Solid,
    mesh_from_solid: &Isometry3<f64>,
    direction: Unit<Vector3<f64>>,
    max_lift: f64,
    resolution: f64,
) -> Option<f64> {
    let resolution = if resolution > FINEST { resolution } else { FINEST };
    mesh.least_lift(solid, mesh_from_solid, direction, max_lift, resolution)
}

/// [`lift_to_free`] by verdicts and distances alone, for any mesh.
///
/// While the core is clear of the surface, the lift advances by what the separation lacks to the
/// rounding: no lift in between can be free, because a distance changes by at most the lift. So on
/// a surface that the direction leaves, the answer is the *first* free lift. Where that is too slow
/// (a core in the surface, a body inside, a direction along the surface) the rest is bisected
/// between a hit and `max_lift`, which then must be free; a free window in between may be passed
/// over, and a hit at `max_lift` gives `None`.
pub(crate) fn stepped_lift(
    mesh: &(impl Interference + ?Sized),
    solid: &Solid,
    mesh_from_solid: &Isometry3<f64>,
    direction: Unit<Vector3<f64>>,
    max_lift: f64,
    resolution: f64,
) -> Option<f64> {
    let pose_at = |lift: f64| Translation3::from(direction.into_inner() * lift) * mesh_from_solid;
    let mut hint = None;
    let is_free = |lift: f64, hint: &mut Option<u32>| {
        let verdict = mesh.verdict(solid, &pose_at(lift), *hint);
        *hint = verdict.triangle().or(*hint);
        verdict.is_free()
    };
    let (mut lift, mut hit) = (0.0, 0.0);
    for _ in 0..MAX_STEPS {
        if is_free(lift, &mut hint) {
            return Some(lift);
        }
        hit = lift;
        let near = mesh.core_distance(solid, &pose_at(lift), solid.rounding(), hint);
        let lacking = near.map_or(0.0, |s| solid.rounding() - s.distance);
        if near.is_none_or(|s| s.distance <= 0.0) && lacking < resolution {
            break;
        }
        lift += lacking.max(resolution);
        if lift > max_lift || max_lift.is_nan() {
            return None;
        }
    }
    bisected(hit, max_lift, resolution, |lift| is_free(lift, &mut hint))
}

/// A free lift at most `resolution` above a hit, between the hit at `low` and `high`, if that is
/// free.
fn bisected(mut low: f64, mut high: f64, resolution: f64, mut is_free: impl FnMut(f64) -> bool) -> Option<f64> {
    if !(low <= high && is_free(high)) {
        return None;
    }
    while high - low > resolution {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if is_free(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(high)
}

/// A body on its way along a direction.
pub(crate) struct LiftSearch<'a, B> {
    /// Where it starts.
    pub(crate) body: &'a B,
    /// Unit vector.
    pub(crate) direction: Vector3<f64>,
    /// Distance from the body at which it touches, mm.
    pub(crate) reach: f64,
    /// Largest error of an exit, mm.
    pub(crate) accuracy: f64,
}

/// Bound on the steps to an exit.
const MAX_EXIT_STEPS: usize = 200;

/// Steps after which every second one halves the bracket: Newton's take 2 to 6.
const NEWTON_STEPS: usize = 8;

impl<B: Body> LiftSearch<'_, B> {
    /// The body at a lift.
    #[inline(always)]
    pub(crate) fn at(&self, lift: f64) -> B {
        self.body.moved(&(self.direction * lift))
    }

    /// The end of the interval of lifts at which the body touches a triangle that it touches at
    /// `low`: not before the end, and beyond it by at most the accuracy.
    #[inline(always)]
    pub(crate) fn exit(&self, corners: &[Point3<f64>; 3], low: f64) -> f64 {
        let top = corners.iter().map(|p| self.direction.dot(&p.coords)).fold(f64::NEG_INFINITY, f64::max);
        let bottom = self.direction.dot(&self.body.support(&-self.direction).coords);
        // Above this the body is over the triangle's highest point.
        let high = (top - bottom + self.reach + 2.0 * FINEST).max(low + self.accuracy);
        self.exit_between(corners, low, high, high)
    }

    /// The same below a lift at which the triangle is not touched, with its nearest point there.
    #[inline(always)]
    pub(crate) fn exit_below(&self, corners: &[Point3<f64>; 3], low: f64, above: f64, nearest: &Sample) -> f64 {
        let next = above - (nearest.distance - self.reach) / -nearest.gradient.dot(&self.direction);
        self.exit_between(corners, low, above, next)
    }

    /// The same by steps from `next` on.
    ///
    /// The distance is a convex function of the lift, so that beyond the end Newton's steps come
    /// closer from above.
    #[inline(always)]
    fn exit_between(&self, corners: &[Point3<f64>; 3], mut low: f64, mut high: f64, mut next: f64) -> f64 {
        for step in 0..MAX_EXIT_STEPS {
            if !(low < next && next <= high) {
                next = 0.5 * (low + high);
            }
            match self.beyond(corners, next) {
                None => low = next,
                Some((excess, slope)) => {
                    high = next;
                    next = high - excess / slope;
                }
            }
            if high - low <= self.accuracy {
                break;
            }
            // As near as Newton comes: half an accuracy farther the body should touch.
            if next > high - 0.5 * self.accuracy {
                next = high - 0.9 * self.accuracy;
            }
            if step >= NEWTON_STEPS && step % 2 == 0 {
                next = 0.5 * (low + high);
            }
            let middle = 0.5 * (low + high);
            if !(low < middle && middle < high) {
                break;
            }
        }
        high
    }

    /// Whether the body touches a triangle at a lift.
    #[inline(always)]
    pub(crate) fn touches(&self, corners: &[Point3<f64>; 3], lift: f64) -> bool {
        let goal = Goal { enough: self.reach, beyond: self.reach };
        nearest_on_triangle(&self.at(lift), corners, goal).is_some()
    }

    /// Returns the excess of the distance at a lift over the reach, and its slope there; `None` if
    /// the triangle is touched.
    #[inline(always)]
    fn beyond(&self, corners: &[Point3<f64>; 3], lift: f64) -> Option<(f64, f64)> {
        let goal = Goal { enough: 0.0, beyond: f64::INFINITY };
        let Sample { distance, gradient, .. } = nearest_on_triangle(&self.at(lift), corners, goal)?;
        (distance > self.reach).then_some((distance - self.reach, -gradient.dot(&self.direction)))
    }
}
