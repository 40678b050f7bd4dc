//! Limits checked from positions alone.

use facemill_feedrate::{MotionBounds, MotionLimit};
use facemill_inverse_kinematics::AxisValues;

/// Returns the largest share of any limit in motion `position(t)` from 0 to `time`, by differences
/// of positions over steps of `time`/`n`. A difference of order d over steps of h is hᵈ times an
/// average of the d-th derivative, so in a motion within its limits no share is above 1 except for
/// rounding, wherever the derivatives jump.
pub(crate) fn worst_share(
    bounds: &MotionBounds,
    time: f64,
    n: usize,
    position: impl Fn(f64) -> AxisValues,
) -> (MotionLimit, f64, f64) {
    let h = time / n as f64;
    // Rest before and after the motion belongs to it.
    let q: Vec<AxisValues> = (0..n + 7).map(|k| position((k as f64 - 3.0) * h)).collect();
    let mut worst = (MotionLimit::TipFeed, 0.0, 0.0);
    for (k, w) in q.windows(4).enumerate() {
        for (axis, b) in bounds.axes.iter().enumerate() {
            let [a, b1, c, d] = [0, 1, 2, 3].map(|i| w[i][axis]);
            let shares = [
                (MotionLimit::Velocity(axis), (b1 - a) / (h * b.velocity)),
                (MotionLimit::Acceleration(axis), ((c - b1) - (b1 - a)) / (h * h * b.acceleration)),
                (MotionLimit::Jerk(axis), ((d - c) - 2.0 * (c - b1) + (b1 - a)) / (h * h * h * b.jerk)),
            ];
            for (limit, share) in shares {
                if share.abs() > worst.1 {
                    worst = (limit, share.abs(), k as f64 * h);
                }
            }
        }
    }
    worst
}
