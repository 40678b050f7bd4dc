//! Laws of the bound for the deviation between two positions: it holds, and it is sharp.

use crate::common::*;
use crate::meant::*;
use facemill_cl_data::{ClPoint, CuttingLaw, RapidLaw};
use facemill_inverse_kinematics::motion::{Deviation, deviation_bound};
use facemill_inverse_kinematics::*;
use nalgebra::{Unit, Vector3};
use std::f64::consts::PI;

const TOOL: f64 = 140.0;
const RADIUS: f64 = 40.0;

/// Bound over real deviation for tip, axis and rim; for the axis where it is above 1e-6 rad.
fn ratios(machine: &Machine, ends: [&AxisValues; 2]) -> [f64; 3] {
    let found = sampled(machine, TOOL, RADIUS, ends, 400);
    let bound = deviation_bound(machine, CuttingLaw::AxesLinear, ends[0], ends[1], TOOL);
    let axis = if found[1] > 1e-6 { bound.axis / found[1] } else { 1.0 };
    [bound.tip / found[0], axis, bound.rim(RADIUS) / found[2]]
}

#[test]
fn the_bound_is_never_below_dense_sampling_for_all_axes_linear() {
    let mut r = Random(31);
    for machine in families() {
        for size in [1e-5, 1e-3, 0.02, 0.1, 0.4, 1.0] {
            for _ in 0..6 {
                let (a, end) = (random_values(&mut r, &machine), random_values(&mut r, &machine));
                let b = a.lerp(&end, size);
                let [tip, axis, _] = sampled(&machine, TOOL, RADIUS, [&a, &b], 300);
                for law in [BlockLaw::from(CuttingLaw::AxesLinear), RapidLaw::Linear.into()] {
                    let bound = deviation_bound(&machine, law, &a, &b, TOOL);
                    assert!(bound.tip >= tip - 1e-9 && bound.axis >= axis - 1e-9, "{bound:?} below {tip}, {axis}");
                }
                let rtcp = deviation_bound(&machine, CuttingLaw::TipAndRotariesLinear, &a, &b, TOOL);
                assert!(rtcp.tip == 0.0 && rtcp.axis >= axis - 1e-9, "{rtcp:?} below {axis}");
                let turned = deviation_bound(&machine, CuttingLaw::TipLinearVectorTurned, &a, &b, TOOL);
                assert_eq!(turned, Deviation::default());
            }
        }
    }
}

#[test]
fn the_bound_is_within_a_tenth_of_the_deviation_for_blocks_of_programs() {
    let mut r = Random(32);
    let mut n_blocks = 0;
    for machine in families() {
        for _ in 0..300 {
            let (a, end) = (random_values(&mut r, &machine), random_values(&mut r, &machine));
            // Rotary axes turn by 0.02° to 20°.
            let b = a.lerp(&end, 10f64.powf(r.between(-4.0, -1.0)));
            if (0.001..0.05).contains(&sampled(&machine, TOOL, RADIUS, [&a, &b], 8)[0]) {
                let ratios = ratios(&machine, [&a, &b]);
                assert!(ratios.iter().all(|r| (1.0 - 1e-6..1.1).contains(r)), "{ratios:?} from {a:?} to {b:?}");
                n_blocks += 1;
            }
        }
    }
    assert!(n_blocks > 500, "{n_blocks}");
}

#[test]
fn the_bound_of_large_blocks_is_sharp_too() {
    let mut r = Random(33);
    for machine in families() {
        for _ in 0..20 {
            let (a, end) = (random_values(&mut r, &machine), random_values(&mut r, &machine));
            // Up to a third of a turn.
            let b = a.lerp(&end, 0.3);
            let ratios = ratios(&machine, [&a, &b]);
            assert!(ratios.iter().all(|r| (1.0 - 1e-4..1.1).contains(r)), "{ratios:?} from {a:?} to {b:?}");
        }
    }
}

/// A pass as on a blade: on a cylinder about the table's axis, the tool leaning over a surface that
/// turns.
fn blade_pass(n: u32) -> Vec<ClPoint> {
    let at = |k| f64::from(k) / f64::from(n - 1);
    (0..n)
        .map(|k| {
            let (turn, lean) = (1.2 * at(k), 0.35 + 0.25 * (3.0 * at(k)).sin());
            let (sin, cos) = turn.sin_cos();
            let tip = nalgebra::Point3::new(900.0 * cos, 900.0 * sin, 300.0 + 150.0 * (2.0 * at(k)).sin());
            let outward = Vector3::new(cos, sin, 0.0) * (0.15 * (5.0 * at(k)).cos());
            ClPoint {
                tip,
                axis: Unit::new_normalize(Vector3::new(-sin, cos, 0.0) * lean.tan() + outward + Vector3::z()),
            }
        })
        .collect()
}

#[test]
fn the_bound_is_within_a_tenth_along_a_pass_of_the_head_b_table_c_machine() {
    let machine = Machine::head_b_table_c().unwrap();
    for n in [30, 150, 900] {
        let mut q = machine.home();
        let axes: Vec<AxisValues> = blade_pass(n)
            .iter()
            .map(|cl| {
                q = machine.nearest_inverse(cl, TOOL, Some(&q), BranchPreference::Nearest).unwrap();
                q
            })
            .collect();
        for pair in axes.windows(2) {
            let ratios = ratios(&machine, [&pair[0], &pair[1]]);
            assert!(ratios.iter().all(|r| (1.0 - 1e-6..1.1).contains(r)), "{ratios:?} between {pair:?}");
        }
    }
}

#[test]
fn every_pose_of_a_bent_rapid_is_near_one_pose_of_the_straight_way() {
    let mut r = Random(34);
    for machine in families() {
        for size in [1e-3, 0.03, 0.3, 1.0] {
            let (a, end) = (random_values(&mut r, &machine), random_values(&mut r, &machine));
            let b = a.lerp(&end, size);
            let [p0, p1] = [&a, &b].map(|q| cl_by_matrices(&machine, q, TOOL));
            let straight: Vec<ClPoint> = (0..=4000).map(|k| meant(&p0, &p1, f64::from(k) / 4000.0)).collect();
            // Between two of these poses the ideal motion is at most half a step from one of them.
            let step = apart(&straight[0], &straight[1]);
            let bound = deviation_bound(&machine, RapidLaw::PerAxis, &a, &b, TOOL);
            let (tip, axis) = (bound.tip + 0.51 * step.tip + 1e-9, bound.axis + 0.51 * step.axis + 1e-9);
            let time = machine.travel_time(&a, &b);
            for k in 0..=60 {
                let cl = cl_by_matrices(&machine, &own_speeds(&machine, &a, &b, time * f64::from(k) / 60.0), TOOL);
                let near = |d: Deviation| d.tip <= tip && d.axis <= axis;
                assert!(straight.iter().any(|s| near(apart(s, &cl))), "{bound:?}, {k}/60 from {a:?} to {b:?}");
            }
        }
    }
}

#[test]
fn a_rapid_bends_by_the_distance_of_its_corner_from_the_straight_line() {
    let machine = Machine::head_b_table_c().unwrap();
    let a = AxisValues::from([100.0, 0.0, 300.0, 0.3, 0.0]);
    let b = AxisValues::from([200.0, 50.0, 300.0, 0.3, 0.0]);
    assert_eq!(machine.axes()[0].max_velocity, machine.axes()[1].max_velocity);
    // X and Y run at 45° until Y arrives: 50 mm each, against a line that rises 1 in 2.
    let corner = (50.0 * 100.0 - 50.0 * 50.0) / 100f64.hypot(50.0);
    let bound = deviation_bound(&machine, RapidLaw::PerAxis, &a, &b, TOOL);
    assert!((bound.tip - corner).abs() < 1e-9 && bound.axis < 1e-12, "{bound:?}");
    // A straight path at another speed is straight.
    let along = AxisValues::from([200.0, 0.0, 300.0, 0.3, 0.0]);
    assert!(deviation_bound(&machine, RapidLaw::PerAxis, &a, &along, TOOL).tip < 1e-9);
    assert_eq!(deviation_bound(&machine, RapidLaw::PerAxis, &a, &a, TOOL), Deviation::default());
}

#[test]
fn the_bound_of_a_bent_rapid_is_within_a_tenth_of_the_distance_from_the_path() {
    // Nearest by tip only: no other choice of the ideal pose brings the tip nearer.
    let machine = Machine::head_b_table_c().unwrap();
    let mut r = Random(35);
    for _ in 0..100 {
        let a = random_values(&mut r, &machine);
        let b = AxisValues::from_fn(5, |k| {
            a[k] + if machine.axes()[k].kind == AxisKind::Linear {
                r.between(-90.0, 90.0)
            } else {
                r.between(-0.02, 0.02)
            }
        });
        let [p0, p1] = [&a, &b].map(|q| cl_by_matrices(&machine, q, TOOL));
        let way = p1.tip - p0.tip;
        let time = machine.travel_time(&a, &b);
        let distance = |k: u32| {
            let d = cl_by_matrices(&machine, &own_speeds(&machine, &a, &b, time * f64::from(k) / 2000.0), TOOL).tip
                - p0.tip;
            (d - way * (d.dot(&way) / way.norm_squared()).clamp(0.0, 1.0)).norm()
        };
        let found = (0..=2000).map(distance).fold(0.0, f64::max);
        let bound = deviation_bound(&machine, RapidLaw::PerAxis, &a, &b, TOOL).tip;
        assert!((1.0 - 1e-9..1.1).contains(&(bound / found)), "{bound} for {found}");
    }
}

#[test]
fn what_has_no_bound_says_so() {
    let machine = Machine::head_b_table_c().unwrap();
    let level = AxisValues::from([0.0, 0.0, 0.0, 0.5 * PI, 0.0]);
    let reversed = AxisValues::from([0.0, 0.0, 0.0, -0.5 * PI, 0.0]);
    let turned = deviation_bound(&machine, CuttingLaw::TipLinearVectorTurned, &level, &reversed, TOOL);
    assert_eq!(turned, Deviation { tip: 0.0, axis: PI });
    let bad = AxisValues::from([0.0, f64::NAN, 0.0, 0.1, 0.2]);
    let none = Deviation { tip: f64::INFINITY, axis: f64::INFINITY };
    let laws =
        [CuttingLaw::AxesLinear.into(), CuttingLaw::TipLinearVectorTurned.into(), BlockLaw::Rapid(RapidLaw::PerAxis)];
    for law in laws {
        assert_eq!(deviation_bound(&machine, law, &level, &bad, TOOL), none);
        assert_eq!(deviation_bound(&machine, law, &bad, &level, TOOL), none);
        assert_eq!(deviation_bound(&machine, law, &level, &level, f64::INFINITY), none);
    }
}
