use facemill_cl_data::Solid;
use nalgebra::{Isometry3, Translation3, Unit, Vector3};

use crate::query::Interference;

/// Steps by distance before bisection takes over: seating on a nearly parallel surface takes 2 to 5.
const MAX_STEPS: usize = 24;

/// Least lift (mm, from 0 to `max_lift`) of a solid along a direction that frees it; `None` where none is found.
///
/// The returned lift is itself verified free, and the lift `resolution` below it is a hit or negative. While the core
/// is clear of the surface, the lift advances by what the separation lacks to the rounding: no lift in between can be
/// free, because a distance changes by at most the lift. So on a surface that the direction leaves, the answer is the
/// *first* free lift. Where that is too slow (a core in the surface, a body inside, a direction along the surface) the
/// rest is bisected between a hit and `max_lift`, which then must be free; a free window in between may be passed over,
/// and a hit at `max_lift` gives `None`.
///
/// `direction` is in the mesh frame. A `resolution` of 0 or less counts as 1e-9 mm, the accuracy of a verdict.
pub fn lift_to_free(
    mesh: &(impl Interference + ?Sized),
    solid: &Solid,
    mesh_from_solid: &Isometry3<f64>,
    direction: Unit<Vector3<f64>>,
    max_lift: f64,
    resolution: f64,
) -> Option<f64> {
    let resolution = if resolution > 1e-9 { resolution } else { 1e-9 };
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

/// A free lift at most `resolution` above a hit, between the hit at `low` and `high`, if that is free.
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
