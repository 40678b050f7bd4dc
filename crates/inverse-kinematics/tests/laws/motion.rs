//! Laws of the motion between two positions and of the bound for its deviation.

use crate::common::*;
use facemill_cl_data::{CuttingLaw, RapidLaw};
use facemill_inverse_kinematics::motion::{Deviation, deviation_bound};
use facemill_inverse_kinematics::*;
use nalgebra::Vector3;

const TOOL: f64 = 120.0;
const CUTTING: [CuttingLaw; 3] =
    [CuttingLaw::AxesLinear, CuttingLaw::TipAndRotariesLinear, CuttingLaw::TipLinearVectorTurned];

/// A block of this length as a fraction of the axes' ranges.
fn block(machine: &Machine, r: &mut Random, size: f64) -> (AxisValues, AxisValues) {
    let (a, b) = (random_values(r, machine), random_values(r, machine));
    (a, a.lerp(&b, size))
}

#[test]
fn every_law_meets_both_ends_exactly() {
    let mut r = Random(21);
    for machine in families() {
        let (a, b) = block(&machine, &mut r, 0.1);
        let laws = CUTTING
            .map(BlockLaw::Cutting)
            .into_iter()
            .chain([RapidLaw::Linear, RapidLaw::PerAxis].map(BlockLaw::Rapid));
        for law in laws {
            let motion = Motion::new(&machine, law, &a, &b, TOOL).unwrap();
            assert_eq!((motion.at(0.0), motion.at(1.0)), (Ok(a), Ok(b)));
            assert_eq!((motion.at(-3.0), motion.at(7.0)), (Ok(a), Ok(b)));
            assert_eq!(motion.at(f64::NAN), Ok(a));
        }
    }
}

#[test]
fn axes_linear_moves_all_axes_together() {
    let machine = Machine::head_b_table_c().unwrap();
    let (a, b) = (AxisValues::from([0.0, 10.0, 500.0, -0.2, 0.0]), AxisValues::from([8.0, 10.0, 300.0, 0.6, 6.0]));
    let motion = Motion::new(&machine, BlockLaw::Cutting(CuttingLaw::AxesLinear), &a, &b, TOOL).unwrap();
    let q = motion.at(0.25).unwrap();
    let expected = AxisValues::from([2.0, 10.0, 450.0, 0.0, 1.5]);
    assert!((0..5).all(|k| (q[k] - expected[k]).abs() < 1e-12) && q[1] == 10.0, "{q:?}");
}

#[test]
fn rtcp_moves_the_tip_on_the_straight_line() {
    let mut r = Random(22);
    for machine in families() {
        for _ in 0..10 {
            let (a, b) = block(&machine, &mut r, 0.05);
            let [p0, p1] = [&a, &b].map(|q| machine.cl_point(q, TOOL));
            for law in [CuttingLaw::TipAndRotariesLinear, CuttingLaw::TipLinearVectorTurned] {
                let motion = Motion::new(&machine, BlockLaw::Cutting(law), &a, &b, TOOL).unwrap();
                for t in [0.1, 0.5, 0.77] {
                    let Ok(q) = motion.at(t) else {
                        // Only general machines have poses that a turning vector cannot pass.
                        assert_ne!(machine.to_file().workpiece_chain.rows.len(), 1);
                        continue;
                    };
                    let cl = machine.cl_point(&q, TOOL);
                    assert!((cl.tip - (p0.tip + (p1.tip - p0.tip) * t)).norm() < 1e-8);
                    if law == CuttingLaw::TipAndRotariesLinear {
                        for k in (0..5).filter(|&k| machine.axes()[k].kind == AxisKind::Rotary) {
                            assert!((q[k] - (a[k] + (b[k] - a[k]) * t)).abs() < 1e-12);
                        }
                    } else {
                        let whole = p0.axis.angle(&p1.axis);
                        let plane = p0.axis.cross(&p1.axis);
                        assert!((p0.axis.angle(&cl.axis) - t * whole).abs() < 1e-7);
                        assert!(cl.axis.dot(&plane).abs() < 1e-9);
                    }
                }
            }
        }
    }
}

#[test]
fn a_turned_vector_stays_on_the_branch_of_its_ends() {
    let machine = Machine::head_b_table_c().unwrap();
    // Past the pole at 0.6°: C sweeps through nearly half a turn and B stays positive.
    let a = AxisValues::from([500.0, 0.0, 900.0, 0.2, 0.05]);
    let b = AxisValues::from([500.0, 0.0, 900.0, 0.2, 3.05]);
    let motion = Motion::new(&machine, BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned), &a, &b, TOOL).unwrap();
    let mut before = a;
    for k in 1..=20_000 {
        let q = motion.at(f64::from(k) / 20_000.0).unwrap();
        assert!(q[3] > 0.0 && (q[4] - before[4]).abs() < 0.02, "from {before:?} to {q:?}");
        before = q;
    }
    assert!((before[4] - 3.05).abs() < 1e-12);
}

#[test]
fn per_axis_rapids_bend_and_linear_ones_do_not() {
    let machine = Machine::head_b_table_c().unwrap();
    let (a, b) = (AxisValues::from([0.0, 0.0, 0.0, 0.0, 0.0]), AxisValues::from([100.0, -50.0, 0.0, 0.0, 0.0]));
    let bent = Motion::new(&machine, BlockLaw::Rapid(RapidLaw::PerAxis), &a, &b, TOOL).unwrap();
    let q = bent.at(0.4).unwrap();
    assert!((q[0] - 40.0).abs() < 1e-9 && (q[1] + 40.0).abs() < 1e-9);
    assert_eq!(bent.at(0.6).unwrap()[1], -50.0);
    let straight = Motion::new(&machine, BlockLaw::Rapid(RapidLaw::Linear), &a, &b, TOOL).unwrap();
    assert!((straight.at(0.4).unwrap()[1] + 20.0).abs() < 1e-12);
    assert!((machine.travel_time(&a, &b) - 100.0 / 250.0).abs() < 1e-12);
}

#[test]
fn blocks_without_a_motion_are_refused() {
    let machine = Machine::head_b_table_c().unwrap();
    let law = BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned);
    let level = AxisValues::from([0.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2, 0.0]);
    let turned = AxisValues::from([0.0, 0.0, 0.0, -std::f64::consts::FRAC_PI_2, 0.0]);
    assert_eq!(Motion::new(&machine, law, &level, &turned, TOOL).unwrap_err(), MotionError::OppositeAxes);
    let nan = AxisValues::from([0.0, 0.0, 0.0, f64::NAN, 0.0]);
    let bad = MotionError::BadValues { n_axes: 5 };
    assert_eq!(Motion::new(&machine, law, &level, &nan, TOOL).unwrap_err(), bad);
    assert_eq!(Motion::new(&machine, law, &level, &AxisValues::from([0.0; 4]), TOOL).unwrap_err(), bad);
}

/// Returns the largest deviation at points of a dense sampling, which the bound must never be
/// below.
fn sampled(machine: &Machine, law: CuttingLaw, a: &AxisValues, b: &AxisValues) -> Deviation {
    let motion = Motion::new(machine, BlockLaw::Cutting(law), a, b, TOOL).unwrap();
    let mut worst = Deviation::default();
    let [p0, p1] = [a, b].map(|q| cl_by_matrices(machine, q, TOOL));
    let (u, v) = (p0.axis.into_inner(), p1.axis.into_inner());
    let whole = u.cross(&v).norm().atan2(u.dot(&v));
    for k in 1..200 {
        let t = f64::from(k) / 200.0;
        let Ok(q) = motion.at(t) else { continue };
        let cl = cl_by_matrices(machine, &q, TOOL);
        worst.tip = worst.tip.max((cl.tip - (p0.tip + (p1.tip - p0.tip) * t)).norm());
        let meant: Vector3<f64> =
            if whole < 1e-9 { u } else { (u * ((1.0 - t) * whole).sin() + v * (t * whole).sin()) / whole.sin() };
        worst.axis = worst.axis.max(cl.axis.cross(&meant).norm().atan2(cl.axis.dot(&meant)));
    }
    worst
}

#[test]
fn deviation_bound_is_never_below_dense_sampling() {
    let mut r = Random(23);
    for machine in families() {
        for size in [1e-4, 1e-3, 0.01, 0.05, 0.2, 0.7] {
            for _ in 0..4 {
                let (a, b) = block(&machine, &mut r, size);
                for law in CUTTING {
                    let (bound, found) = (deviation_bound(&machine, law, &a, &b, TOOL), sampled(&machine, law, &a, &b));
                    let rounding = 1e-9;
                    assert!(found.tip <= bound.tip + rounding, "{law:?}: {found:?} above {bound:?}");
                    assert!(found.axis <= bound.axis + rounding, "{law:?}: {found:?} above {bound:?}");
                }
            }
        }
    }
}

#[test]
fn deviation_bound_exceeds_the_deviation_in_third_order_only() {
    // About 2°, 0.2° and 0.02° in both rotary axes, and the excess of the median block. Where the
    // second derivative happens to vanish in the middle of a block only the third order remains, so
    // this is not a law for every block.
    for (size, excess) in [(1e-2, 0.15), (1e-3, 0.015), (1e-4, 0.0015)] {
        let mut r = Random(24);
        let mut ratios = Vec::new();
        for machine in families() {
            for _ in 0..20 {
                let (a, b) = block(&machine, &mut r, size);
                let bound = deviation_bound(&machine, CuttingLaw::AxesLinear, &a, &b, TOOL);
                let found = sampled(&machine, CuttingLaw::AxesLinear, &a, &b);
                ratios.push((bound.tip / found.tip).max(bound.axis / found.axis));
            }
        }
        ratios.sort_by(f64::total_cmp);
        let median = ratios[ratios.len() / 2];
        assert!(median < 1.0 + excess, "{median} at {size}");
    }
}

#[test]
fn nothing_deviates_without_rotary_motion() {
    let machine = Machine::head_b_table_c().unwrap();
    let (a, b) = (AxisValues::from([0.0, 0.0, 100.0, 0.5, 1.0]), AxisValues::from([300.0, 0.0, 0.0, 0.5, 1.0]));
    let bound = deviation_bound(&machine, CuttingLaw::AxesLinear, &a, &b, TOOL);
    assert_eq!(bound.rim(80.0), 0.0);
}
