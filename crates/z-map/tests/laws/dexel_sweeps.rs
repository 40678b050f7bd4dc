//! Sweeps against stamps: never less than dense stamps, never more than stamps dilated by what they leave out.

use facemill_z_map::Sweep;

use crate::dexel_kit::{block, body, cut, direction, longest_outside, lost, pose, stamps};
use crate::kit::Random;

const CUTTERS: [[f64; 3]; 6] =
    [[5.0, 1.0, 8.0], [5.0, 0.0, 8.0], [4.0, 4.0, 4.0], [4.0, 4.0, 9.0], [5.0, 2.5, 2.5], [6.0, 0.3, 3.0]];

/// Cuts a deep block and compares every line with stamps. The dilated stamps may be a little wider than said at sharp
/// edges; lines are compared by what lies outside.
fn compare(cutter: [f64; 3], sweep: &Sweep, n: u32, dilation: f64, tolerance: f64, beyond: f64) {
    let half = 13.5;
    let mut map = block([-half, -half, -40.0], [half, half, 40.0], 1.5);
    cut(&mut map, sweep.body, sweep.from, sweep.to, tolerance);
    let grid = *map.grid();
    for j in 0..grid.n_lines()[1] {
        for i in 0..grid.n_lines()[0] {
            let at = [grid.x(i), grid.y(j)];
            let lost = lost(map.intervals(i, j), -40.0, 40.0);
            let least = stamps(cutter, -beyond, sweep, n, at);
            let most = stamps(cutter, dilation, sweep, n, at);
            let (missed, extra) = (longest_outside(&least, &lost), longest_outside(&lost, &most));
            assert!(missed < 1e-8, "{cutter:?} {sweep:?} at {at:?}: {missed} mm of {least:?} left, lost {lost:?}");
            assert!(extra < 1e-8, "{cutter:?} {sweep:?} at {at:?}: {extra} mm of {lost:?} beyond {most:?}");
        }
    }
}

#[test]
fn a_straight_sweep_is_what_stamps_tend_to() {
    let mut random = Random(11);
    for cutter in CUTTERS {
        let body = body(cutter[0], cutter[1], cutter[2]);
        for k in 0..3 {
            let axis = direction(&mut random);
            let from = random.vector(6.0);
            let step = random.vector([6.0, 1.0, 0.05][k]);
            let sweep = Sweep { body: &body, from: pose(from.into(), axis), to: pose((from + step).into(), axis) };
            let n = 24;
            let dilation = step.norm() / (2.0 * f64::from(n)) + 1e-9;
            compare(cutter, &sweep, n, dilation, 1.0, 1e-9);
        }
    }
}
