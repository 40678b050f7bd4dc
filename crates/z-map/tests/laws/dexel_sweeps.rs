//! Sweeps against stamps: never less than dense stamps, never more than stamps dilated by what they leave out.

use facemill_z_map::{Sweep, SweepError};
use nalgebra::Vector3;

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

#[test]
fn a_turning_sweep_is_within_its_tolerance_of_stamps() {
    let mut random = Random(21);
    for (k, cutter) in CUTTERS.into_iter().enumerate() {
        let body = body(cutter[0], cutter[1], cutter[2]);
        let axis = Vector3::from(direction(&mut random)).normalize();
        let turned = axis + random.vector([0.3, 0.05, 0.01][k % 3]);
        let from = random.vector(5.0);
        let step = random.vector(2.0);
        let sweep =
            Sweep { body: &body, from: pose(from.into(), axis.into()), to: pose((from + step).into(), turned.into()) };
        let n = 40;
        let tolerance = 0.1;
        // Between two stamps no point moves farther than by the step and the turn.
        let moved = step.norm() + axis.angle(&turned) * cutter[0].hypot(cutter[2]);
        compare(cutter, &sweep, n, tolerance + moved / (2.0 * f64::from(n)) + 1e-9, tolerance, tolerance);
    }
}

#[test]
fn faulty_motions_are_refused_and_leave_the_map_alone() {
    let body = body(5.0, 1.0, 8.0);
    let (up, down) = (pose([0.0; 3], [0.0, 0.0, 1.0]), pose([0.0; 3], [0.0, 0.0, -1.0]));
    let good = Sweep { body: &body, from: up, to: up };
    let mut map = block([-5.0; 3], [5.0; 3], 1.0);
    let whole = map.clone();
    let mut refused = |from, to, tolerance| {
        let error = map.remove_all(&[good, Sweep { body: &body, from, to }], tolerance).unwrap_err();
        assert_eq!(map, whole);
        error
    };
    assert!(matches!(refused(up, down, 0.1), SweepError::HalfTurn { index: 1, .. }));
    let tilted = pose([0.0; 3], [0.0, 1.0, 1.0]);
    for tolerance in [0.0, -1.0, f64::NAN, 1e-9] {
        assert!(matches!(refused(up, tilted, tolerance), SweepError::Tolerance { index: 1, .. }));
    }
    assert!(matches!(refused(up, pose([f64::NAN; 3], [0.0, 0.0, 1.0]), 0.1), SweepError::NotFinite { index: 1 }));
}
