//! Sweeps against stamps: never less than dense stamps, never more than stamps dilated by what they
//! leave out.

use facemill_z_map::{Sweep, SweepError};
use nalgebra::Vector3;

use crate::dexel_kit::{block, body, cut, direction, longest_outside, lost, pose, stamps};
use crate::kit::Random;

const CUTTERS: [[f64; 3]; 6] =
    [[5.0, 1.0, 8.0], [5.0, 0.0, 8.0], [4.0, 4.0, 4.0], [4.0, 4.0, 9.0], [5.0, 2.5, 2.5], [6.0, 0.3, 3.0]];

/// Cuts a block that is higher than the tool, and one that ends within it, and compares every line
/// with stamps: those dilated by `within` must have lost all, those dilated by `beyond` must have
/// lost all that is lost.
fn compare(cutter: [f64; 3], sweep: &Sweep, n: u32, within: f64, beyond: f64, tolerance: f64) {
    let (half, low) = (13.5, -40.0);
    for top in [40.0, sweep.from.tip.z + 1.3] {
        let mut map = block([-half, -half, low], [half, half, top], 2.25);
        cut(&mut map, sweep.body, sweep.from, sweep.to, tolerance);
        let grid = *map.grid();
        for (i, j) in (0..grid.n_lines()[1]).flat_map(|j| (0..grid.n_lines()[0]).map(move |i| (i, j))) {
            let at = [grid.x(i), grid.y(j)];
            let lost = lost(map.intervals(i, j), low, top);
            let mut least = stamps(cutter, within, sweep, n, at);
            least.retain_mut(|part| {
                part[1] = part[1].min(top);
                part[0] < part[1]
            });
            let most = stamps(cutter, beyond, sweep, n, at);
            let (missed, extra) = (longest_outside(&least, &lost), longest_outside(&lost, &most));
            assert!(missed < 1e-8, "{cutter:?} {sweep:?} at {at:?}: {missed} mm of {least:?} left, lost {lost:?}");
            assert!(extra < 1e-8, "{cutter:?} {sweep:?} at {at:?}: {extra} mm of {lost:?} beyond {most:?}");
        }
    }
}

/// Compares a motion without a turn.
fn compare_straight(cutter: [f64; 3], from: Vector3<f64>, step: Vector3<f64>, axis: Vector3<f64>) {
    let body = body(cutter[0], cutter[1], cutter[2]);
    let sweep =
        Sweep { body: &body, from: pose(from.into(), axis.into()), to: pose((from + step).into(), axis.into()) };
    let n = 12;
    // Between two stamps no point is farther than half their distance from one.
    let beyond = step.norm() / (2.0 * f64::from(n)) + 1e-9;
    compare(cutter, &sweep, n, -1e-9, beyond, 1.0);
}

#[test]
fn a_straight_sweep_is_what_stamps_tend_to() {
    let mut random = Random(11);
    for cutter in CUTTERS {
        for size in [6.0, 1.0, 0.05] {
            let axis = Vector3::from(direction(&mut random));
            compare_straight(cutter, random.vector(6.0), random.vector(size), axis);
        }
    }
}

#[test]
fn upright_level_and_plunging_sweeps_are_what_stamps_tend_to() {
    let mut random = Random(12);
    let z = Vector3::z();
    for cutter in CUTTERS {
        let leaning = z + 0.2 * Vector3::x();
        // Level, ramping, plunging; across the tilt, in the plane of the bottom, along the axis.
        let cases = [
            (z, Vector3::new(3.0, 1.0, 0.0)),
            (z, Vector3::new(3.0, 1.0, -0.5)),
            (z, -2.0 * z),
            (leaning, Vector3::new(0.0, 3.0, 0.0)),
            (leaning, leaning.cross(&Vector3::y())),
            (leaning, -0.5 * leaning),
            (-leaning, Vector3::new(0.5, 0.3, 0.1)),
            (Vector3::x(), Vector3::new(0.0, 2.0, 0.0)),
        ];
        for (axis, step) in cases {
            compare_straight(cutter, random.vector(3.0), step, axis);
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
        let n = 24;
        let tolerance = 0.1;
        // Between two stamps no point moves farther than by the step and the turn.
        let moved = step.norm() + axis.angle(&turned) * cutter[0].hypot(cutter[2]);
        let beyond = tolerance + moved / (2.0 * f64::from(n)) + 1e-9;
        compare(cutter, &sweep, n, -tolerance, beyond, tolerance);
    }
}

/// Face mills are far wider than high: their turning motions are cut at once, and here not as
/// straight pieces.
#[test]
fn a_turning_sweep_of_a_face_mill_is_within_its_tolerance_of_stamps() {
    let mut random = Random(22);
    let tolerance = 0.05;
    for cutter in [[12.0, 0.5, 1.5], [12.0, 1.2, 1.2], [11.0, 0.0, 2.0]] {
        let body = body(cutter[0], cutter[1], cutter[2]);
        for (lean, turn) in [(0.1, 0.02), (0.4, 0.06), (1.5, 0.02), (0.1, 0.2)] {
            let axis = Vector3::z() + random.vector(lean);
            let turned = axis + random.vector(turn);
            // Rims reach into the block, which the whole cutter does not fit into.
            let from = random.vector(8.0);
            let step = random.vector(1.5);
            let to = pose((from + step).into(), turned.into());
            let sweep = Sweep { body: &body, from: pose(from.into(), axis.into()), to };
            let n = 24;
            let moved = step.norm() + axis.angle(&turned) * cutter[0].hypot(cutter[2]);
            let beyond = tolerance + moved / (2.0 * f64::from(n)) + 1e-9;
            compare(cutter, &sweep, n, -tolerance, beyond, tolerance);
        }
    }
}

/// A query that looks coarsely first has the answer of a fine one.
#[test]
fn meeting_a_turning_body_tells_the_depth_that_cutting_it_takes() {
    let mut random = Random(23);
    let (body, tolerance) = (body(9.0, 2.0, 14.0), 0.01);
    let (mut met, mut missed) = (0, 0);
    for _ in 0..40 {
        let axis = Vector3::z() + random.vector(0.4);
        let tip = Vector3::new(0.0, 0.0, 2.2) + random.vector(1.4);
        let to = pose((tip + random.vector(1.0)).into(), (axis + random.vector(0.15)).into());
        let sweep = Sweep { body: &body, from: pose(tip.into(), axis.into()), to };
        let map = block([-14.0, -14.0, -9.0], [14.0, 14.0, 0.0], 1.0);
        let mut after = map.clone();
        cut(&mut after, sweep.body, sweep.from, sweep.to, tolerance);
        let [nx, ny] = map.grid().n_lines();
        let lost_at = |i: usize, j: usize| longest_outside(&lost(after.intervals(i, j), -9.0, 0.0), &[]);
        let deepest =
            (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))).map(|(i, j)| lost_at(i, j)).fold(0.0, f64::max);
        let requested = map.meets(&sweep, tolerance).unwrap().map_or(0.0, |contact| contact.depth);
        // Of a piece no line loses more than of all of them, and walls are as steep as the cutter's
        // side leans.
        assert!(requested <= deepest + 20.0 * tolerance, "{sweep:?}: {requested} met, {deepest} lost");
        assert!(deepest < 0.2 || requested > 0.0, "{sweep:?}: {deepest} lost and not met");
        met += u32::from(requested > 0.0);
        missed += u32::from(requested == 0.0);
    }
    assert!(met > 5 && missed > 5, "{met} met, {missed} not");
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
