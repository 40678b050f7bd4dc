use facemill_inverse_kinematics::AxisValues;

use super::ProgramBlock;
use super::blocks::length;
use crate::time_law::AxisBounds;

/// Raises the least times of blocks where a control that looks ahead over `n` blocks, including the
/// present one, could not stop within them: an estimate, which takes the blocks ahead as straight
/// and their accelerations and jerks at their means.
///
/// Blocks in which nothing moves count as one each. Programs of no more than `n` blocks stay as
/// they are.
#[must_use]
pub fn within_look_ahead(start: &AxisValues, blocks: &[ProgramBlock], axes: &[AxisBounds], n: usize) -> Vec<f64> {
    let mut out: Vec<f64> = blocks.iter().map(|block| block.tip_time).collect();
    if blocks.len() <= n || axes.is_empty() {
        return out;
    }
    // Sums of length, and of acceleration and jerk along the path times length, up to each block.
    let mut sums = Vec::with_capacity(blocks.len() + 1);
    let mut sum = [0.0; 3];
    sums.push(sum);
    let mut at = *start;
    for block in blocks {
        let length = length(&at, &block.end, axes);
        let most = |limit: fn(&AxisBounds) -> f64| {
            let of_axis = axes.iter().enumerate().map(|(k, b)| limit(b) * length / (block.end[k] - at[k]).abs());
            of_axis.fold(f64::INFINITY, f64::min)
        };
        if length > 0.0 {
            sum = [sum[0] + length, sum[1] + length * most(|b| b.acceleration), sum[2] + length * most(|b| b.jerk)];
        }
        sums.push(sum);
        at = block.end;
    }
    for (k, time) in out.iter_mut().enumerate() {
        let last = (k + n).min(blocks.len());
        // From the end of the block, where it may still be at its speed.
        let [way, acceleration, jerk] = [0, 1, 2].map(|i| sums[last][i] - sums[k + 1][i]);
        let own = sums[k + 1][0] - sums[k][0];
        if last == blocks.len() || own <= 0.0 {
            continue;
        }
        let (way, acceleration, jerk) = if way > 0.0 {
            (way, acceleration / way, jerk / way)
        } else {
            (own, (sums[k + 1][1] - sums[k][1]) / own, (sums[k + 1][2] - sums[k][2]) / own)
        };
        *time = time.max(own / stoppable(way, acceleration, jerk));
    }
    out
}

/// Returns the largest speed from which the axes stop on a straight way with these limits.
fn stoppable(way: f64, acceleration: f64, jerk: f64) -> f64 {
    let build_up = 0.5 * acceleration / jerk;
    acceleration * (build_up.hypot((2.0 * way / acceleration).sqrt()) - build_up)
}
