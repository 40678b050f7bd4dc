//! Foundations of the elimination of rotary values.

use facemill_test_kit::Random;
use nalgebra::{Isometry3, Point3};

use crate::axes::axis::AxisKind;
use crate::axes::axis_values::AxisValues;
use crate::solver::rotary_triples::Target;
use crate::solver::screw_chain::{Screw, ScrewChain};
use crate::solver::three_rotaries::ThreeRotaries;
use crate::solver::tip_condition::{TipCondition, functions, value_and_gradient};

/// Joints of these kinds in general position.
fn chain(kinds: [AxisKind; 5], r: &mut Random) -> ScrewChain {
    let screws = (0..5).map(|k| Screw::new(k, kinds[k], r.direction(), r.vector(1.0) * 300.0)).collect();
    let nose = Isometry3::new(r.vector(1.0) * 300.0, r.vector(1.0) * 3.0);
    ScrewChain { screws, table_from_nose: nose }
}

#[test]
fn the_tip_condition_is_of_degree_one_in_each_rotary_value_in_every_order_of_joints() {
    let mut r = Random(3);
    for first in 0..5 {
        for second in 0..first {
            let kinds =
                std::array::from_fn(|k| if k == first || k == second { AxisKind::Linear } else { AxisKind::Rotary });
            let chain = chain(kinds, &mut r);
            let rotary: Vec<usize> = (0..5).filter(|&k| kinds[k] == AxisKind::Rotary).collect();
            let condition = TipCondition::new(&chain, [rotary[0], rotary[1], rotary[2]], [0.0; 3]);
            for _ in 0..30 {
                let q = AxisValues::from_fn(5, |_| 3.0 * r.between(-1.0, 1.0));
                let (tip, length) = (Point3::from(r.vector(1.0) * 1000.0), 200.0 * r.between(-1.0, 1.0));
                let map = chain.linear_map(&q, length);
                let meant = map.directions.column(0).cross(&map.directions.column(1)).dot(&(tip.coords - map.offset));
                let e = [0, 1, 2].map(|k| functions(q[rotary[k]]));
                let (value, gradient) = value_and_gradient(&condition.at(&tip, length), &e);
                assert!((value - meant).abs() < 1e-9, "{value} {meant}");
                for k in 0..3 {
                    let mut moved = e;
                    moved[k] = functions(q[rotary[k]] + 1e-6);
                    let slope = (value_and_gradient(&condition.at(&tip, length), &moved).0 - value) / 1e-6;
                    assert!((slope - gradient[k]).abs() < 2e-2, "{slope} {gradient}");
                }
            }
        }
    }
}

/// Random machines: the polynomials have no harmonic above the sixth, and mostly have the sixth.
fn has_degree_six(polynomial: impl Fn(&ThreeRotaries, &Target<'_>, f64) -> f64) {
    const N: usize = 64;
    let mut r = Random(4);
    let mut n_full = 0;
    use AxisKind::{Linear, Rotary};
    let condition = TipCondition::new(&chain([Linear, Rotary, Rotary, Rotary, Linear], &mut r), [1, 2, 3], [0.0; 3]);
    for _ in 0..200 {
        let three = ThreeRotaries::new([r.direction(), r.direction(), r.direction()], &r.direction());
        // The proof needs only degree one in each value, so any coefficients will do.
        let t = std::array::from_fn(|_| r.between(-1.0, 1.0));
        let target = Target { condition: &condition, tool_axis: r.direction().into_inner(), t, scale: 1.0 };
        let angle = |k: usize| std::f64::consts::TAU * (k as f64 + 0.5) / N as f64;
        let samples: Vec<f64> = (0..N).map(|k| polynomial(&three, &target, angle(k))).collect();
        let largest = samples.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let harmonic = |m: usize| {
            let sum = |f: fn(f64) -> f64| (0..N).map(|k| samples[k] * f(m as f64 * angle(k))).sum::<f64>();
            sum(f64::cos).hypot(sum(f64::sin)) / N as f64
        };
        for m in 7..N / 2 {
            assert!(harmonic(m) < 1e-9 * largest, "{m}: {:e} of {largest}", harmonic(m));
        }
        n_full += usize::from(harmonic(6) > 1e-4 * largest);
    }
    assert!(n_full > 100, "{n_full}");
}

#[test]
fn the_polynomial_of_the_first_rotary_value_has_degree_six() {
    has_degree_six(|three, target, phi| three.polynomial(target, phi));
}

#[test]
fn the_polynomial_of_the_middle_rotary_value_has_degree_six() {
    has_degree_six(|three, target, second| three.middle(target).polynomial(second));
}
