//! Removed volumes against closed forms, and laws of cutting.

use std::f64::consts::{PI, TAU};

use facemill_cl_data::ClPoint;
use facemill_z_map::{DexelMap, Sweep, TriDexel};
use nalgebra::{Isometry3, Vector3};

use crate::dexel_kit::{block, body, cut, cut_all, direction, pose, upright};
use crate::kit::Random;

const CELLS: [f64; 3] = [0.4, 0.2, 0.1];

/// Each error is below `slope` × cell, and the finest below 0.6 of the coarsest: they fall at least
/// as said.
fn assert_falls(what: &str, exact: f64, slope: f64, volume: impl Fn(f64) -> f64) {
    let errors = CELLS.map(|cell| (volume(cell) - exact).abs());
    for (error, cell) in errors.iter().zip(CELLS) {
        assert!(*error <= slope * cell, "{what}: errors {errors:?} of {exact}, allowed {} at {cell}", slope * cell);
    }
    assert!(errors[2] <= 0.6 * errors[0].max(slope * CELLS[2] * 0.1), "{what}: {errors:?} of {exact} do not fall");
}

#[test]
fn a_straight_slot_has_its_volume() {
    let flat = body(4.0, 0.0, 30.0);
    // Wrong by half a cell along the outline at most.
    assert_falls("slot", 3.0 * (20.02 * 8.0 + PI * 16.0), 3.0 * (2.0 * 20.02 + 8.0 * PI) / 2.0, |cell| {
        let mut map = block([0.0; 3], [40.0, 20.0, 10.0], cell);
        cut(&mut map, &flat, upright([10.03, 10.02, 7.0]), upright([30.05, 10.02, 7.0]), 0.01).volume
    });
}

#[test]
fn a_drilled_hole_has_its_volume() {
    let drill = body(3.0, 0.0, 40.0);
    assert_falls("hole", 10.0 * PI * 9.0, 10.0 * PI * 3.0, |cell| {
        let mut map = block([0.0; 3], [12.0, 12.0, 10.0], cell);
        cut(&mut map, &drill, upright([6.01, 6.02, 15.0]), upright([6.01, 6.02, -1.0]), 0.01).volume
    });
}

#[test]
fn a_tilted_plunge_has_its_volume() {
    // A cylinder through a plate at an angle: area of the ellipse times the thickness.
    let drill = body(3.0, 1.0, 60.0);
    let axis = Vector3::new(0.3, 0.2, 1.0);
    assert_falls("tilted plunge", 6.0 * PI * 9.0 * axis.norm(), 12.0 * PI * 3.0, |cell| {
        let mut map = block([0.0; 3], [24.0, 24.0, 6.0], cell);
        let at = |along: f64| pose([12.01 + 0.3 * along, 12.02 + 0.2 * along, 3.0 + along], axis.into());
        cut(&mut map, &drill, at(20.0), at(-12.0), 0.01).volume
    });
}

#[test]
fn a_ball_along_a_circle_leaves_half_a_torus() {
    let ball = body(2.0, 2.0, 20.0);
    let n = 200;
    // Chords instead of arcs move the centroid of the section inward.
    let chord = (PI / f64::from(n)).tan() / (PI / f64::from(n)) * (PI / f64::from(n)).cos();
    assert_falls("circle", TAU * 8.0 * chord * PI * 2.0, TAU * 8.0 * 2.0, |cell| {
        let mut map = block([-12.0, -12.0, -4.0], [12.0, 12.0, 0.0], cell);
        let at = |k: u32| {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(n)).sin_cos();
            upright([8.0 * cos, 8.0 * sin, -2.0])
        };
        let sweeps: Vec<Sweep> = (0..n).map(|k| Sweep { body: &ball, from: at(k), to: at(k + 1) }).collect();
        cut_all(&mut map, &sweeps, 0.01).iter().map(|c| c.volume).sum()
    });
}

#[test]
fn a_sphere_in_a_block_is_a_hollow_with_material_above() {
    let sphere = facemill_z_map::TurnedBody::ball(4.0).unwrap();
    let volume = 4.0 / 3.0 * PI * 64.0;
    // Its surface is nowhere steep over more than a ring: the midpoint rule is better than a cell.
    assert_falls("sphere", volume, 4.0, |cell| {
        let mut map = block([0.0; 3], [10.0; 3], cell);
        let at = pose([5.01, 5.02, 1.0], [0.0, 0.0, 1.0]);
        let lost = cut(&mut map, &sphere, at, at, 0.01).volume;
        let [i, j] = [0, 1].map(|k| map.grid().n_lines()[k] / 2);
        assert_eq!(map.intervals(i, j).count(), 2);
        lost
    });
}

#[test]
fn an_undercut_leaves_an_overhang_that_stays() {
    // A disc cutter on a thin neck goes in from the side.
    let disc = body(5.0, 0.5, 2.0);
    let mut map = block([0.0; 3], [20.0, 20.0, 10.0], 0.25);
    let lost = cut(&mut map, &disc, upright([-6.0, 10.0, 4.0]), upright([1.0, 10.0, 4.0]), 0.01).volume;
    assert!(lost > 0.0);
    let (i, j) = (8, 40);
    let after: Vec<_> = map.intervals(i, j).map(|i| [i.bottom, i.top]).collect();
    assert_eq!(after, [[0.0, 4.0], [6.0, 10.0]]);
    // Above the overhang and inside the hollow nothing more is lost, by any number of cuts.
    for _ in 0..2 {
        let again = cut(&mut map, &disc, upright([-6.0, 10.0, 4.0]), upright([1.0, 10.0, 4.0]), 0.01);
        assert!(again.volume < 1e-7, "{again:?}");
        cut(&mut map, &disc, upright([3.0, 10.0, 10.0]), upright([9.0, 10.0, 10.0]), 0.01);
    }
    assert_eq!(map.intervals(i, j).map(|i| [i.bottom, i.top]).collect::<Vec<_>>(), after);
}

fn random_motions(seed: u64, n: u32) -> Vec<[ClPoint; 2]> {
    let mut random = Random(seed);
    let mut motion = || {
        let (tip, axis) = (random.vector(9.0), Vector3::from(direction(&mut random)));
        let (step, turn) = (random.vector(3.0), random.vector(0.1));
        [pose(tip.into(), axis.into()), pose((tip + step).into(), (axis + turn * axis.norm()).into())]
    };
    (0..n).map(|_| motion()).collect()
}

#[test]
fn the_order_of_cuts_does_not_matter() {
    let bodies = [body(4.0, 1.0, 6.0), body(3.0, 0.0, 5.0), body(2.0, 2.0, 7.0)];
    let motions = random_motions(5, 24);
    let sweep = |k: usize| Sweep { body: &bodies[k % 3], from: motions[k][0], to: motions[k][1] };
    let new = || block([-10.0; 3], [10.0; 3], 0.5);
    let (mut forward, mut backward, mut at_once) = (new(), new(), new());
    for k in 0..motions.len() {
        cut_all(&mut forward, &[sweep(k)], 0.05);
        cut_all(&mut backward, &[sweep(motions.len() - 1 - k)], 0.05);
    }
    cut_all(&mut at_once, &(0..motions.len()).map(sweep).collect::<Vec<_>>(), 0.05);
    assert!(forward.volume() < 0.9 * new().volume());
    let ends = |map: &DexelMap| {
        let [nx, ny] = map.grid().n_lines();
        let lines = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j)));
        lines.map(|(i, j)| map.intervals(i, j).map(|i| [i.bottom, i.top]).collect::<Vec<_>>()).collect::<Vec<_>>()
    };
    // Heights come from bounds that depend on what is still there, and agree up to rounding.
    let [a, b, c] = [ends(&forward), ends(&backward), ends(&at_once)];
    assert!(a == c, "one after the other and at once differ");
    let long = |line: &Vec<[f64; 2]>| line.iter().copied().filter(|i| i[1] - i[0] > 1e-8).collect::<Vec<_>>();
    for (a, b) in a.iter().zip(&b) {
        let (a, b) = (long(a), long(b));
        assert_eq!(a.len(), b.len(), "{a:?} {b:?}");
        assert!(a.as_flattened().iter().zip(b.as_flattened()).all(|(a, b)| (a - b).abs() < 1e-8), "{a:?} {b:?}");
    }
}

#[test]
fn one_thread_and_two_make_the_same_bytes() {
    let tool = body(4.0, 1.0, 6.0);
    let motions = random_motions(6, 40);
    let sweeps: Vec<Sweep> = motions.iter().map(|m| Sweep { body: &tool, from: m[0], to: m[1] }).collect();
    let run = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| {
            let mut map = block([-20.0; 3], [20.0; 3], 0.25);
            let cuts = cut_all(&mut map, &sweeps, 0.05);
            (map.to_bytes(), map.volume().to_bits(), cuts)
        })
    };
    assert!(run(1) == run(2));
}

#[test]
fn a_rigid_motion_of_stock_and_tool_changes_nothing() {
    let tool = body(4.0, 1.0, 6.0);
    let mut random = Random(8);
    let motions = random_motions(9, 6);
    let volume = |frame: Isometry3<f64>| {
        let mut map = DexelMap::of_box(&frame, [-10.0; 3], [10.0; 3], 0.5).unwrap();
        let moved: Vec<_> = motions.iter().map(|m| m.map(|pose| pose.transformed(&frame))).collect();
        let sweeps: Vec<Sweep> = moved.iter().map(|m| Sweep { body: &tool, from: m[0], to: m[1] }).collect();
        cut_all(&mut map, &sweeps, 0.05).iter().map(|c| c.volume).sum::<f64>()
    };
    let still = volume(Isometry3::identity());
    for _ in 0..3 {
        assert!((volume(random.pose(50.0)) - still).abs() < 1e-6 * still);
    }
}

#[test]
fn a_meeting_is_what_a_cut_would_take() {
    let tool = body(4.0, 1.0, 6.0);
    let mut map = block([-10.0; 3], [10.0, 10.0, 0.0], 0.5);
    let (from, to) = (upright([-3.0, 0.2, -0.75]), upright([3.0, 0.2, -0.75]));
    let sweep = Sweep { body: &tool, from, to };
    let met = map.meets(&sweep, 0.01).unwrap().unwrap();
    assert!((met.depth - 0.75).abs() < 1e-9 && (met.place.z + 0.375).abs() < 1e-9, "{met:?}");
    assert!(met.place.x.abs() <= 6.0 && (met.place.y - 0.2).abs() <= 3.0, "{met:?}");
    let lost = cut(&mut map, &tool, from, to, 0.01).volume;
    assert!(lost > 0.0);
    assert!(map.meets(&sweep, 0.01).unwrap().is_none_or(|met| met.depth < 1e-9));
    for motion in random_motions(12, 20) {
        let sweep = Sweep { body: &tool, from: motion[0], to: motion[1] };
        let met = map.meets(&sweep, 0.05).unwrap();
        let cut = cut(&mut map, &tool, sweep.from, sweep.to, 0.05);
        assert_eq!(met.is_some(), cut.volume > 0.0, "{met:?} {cut:?}");
    }
}

#[test]
fn three_maps_agree_on_what_a_cut_takes() {
    let tool = body(3.0, 1.0, 8.0);
    let mut stock = TriDexel::of_box([-8.0; 3], [8.0; 3], 0.2).unwrap();
    let motions = random_motions(3, 3);
    let sweeps: Vec<Sweep> = motions.iter().map(|m| Sweep { body: &tool, from: m[0], to: m[1] }).collect();
    let before = stock.volume();
    let cuts = stock.remove_all(&sweeps, 0.05).unwrap();
    stock.check_invariants().unwrap();
    let lost: f64 = cuts.iter().map(|c| c.volume).sum();
    assert!((before - stock.volume() - lost).abs() < 1e-6 && lost > 50.0, "{lost}");
    for map in stock.maps() {
        assert!((map.volume() - stock.volume()).abs() < 0.01 * lost, "{} {}", map.volume(), stock.volume());
    }
}
