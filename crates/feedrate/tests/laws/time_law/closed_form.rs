//! Least times in closed form.

use facemill_feedrate::AxisBounds;

/// Least time from rest to rest over `distance` of one axis: the law of up to seven phases of
/// constant jerk.
pub(crate) fn rest_to_rest(distance: f64, bounds: &AxisBounds) -> f64 {
    let AxisBounds { velocity: v, acceleration: a, jerk: j } = *bounds;
    // Time and distance of the change between rest and a speed.
    let change = |v: f64| if v * j <= a * a { 2.0 * (v / j).sqrt() } else { v / a + a / j };
    let way = |v: f64| 0.5 * v * change(v);
    if 2.0 * way(v) <= distance {
        return 2.0 * change(v) + (distance - 2.0 * way(v)) / v;
    }
    // The speed that is reached.
    let (mut low, mut high) = (0.0, v);
    for _ in 0..200 {
        let mid = 0.5 * (low + high);
        if 2.0 * way(mid) <= distance { low = mid } else { high = mid }
    }
    2.0 * change(low)
}
