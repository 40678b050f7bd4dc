//! Linearised ways at and beside poles, at limits, and refusals.

use crate::common::*;
use crate::meant::*;
use facemill_cl_data::{ClPoint, CuttingLaw};
use facemill_inverse_kinematics::machine_file::Sense;
use facemill_inverse_kinematics::motion::{Linearisation, LineariseError, MotionTolerance, PoseFraction, linearise};
use facemill_inverse_kinematics::*;
use nalgebra::{Point3, Unit, Vector3};

const TOOL: f64 = 140.0;
const RADIUS: f64 = 40.0;

fn settings(law: CuttingLaw, tip: f64, axis: f64, rim: f64) -> Linearisation {
    Linearisation::new(law, TOOL, MotionTolerance { tip, axis, rim, radius: RADIUS })
}

/// A tool axis that leans by an angle against z, in a direction counted from x.
fn leaning(lean_deg: f64, toward_deg: f64) -> Unit<Vector3<f64>> {
    let ((sb, cb), (sc, cc)) = (lean_deg.to_radians().sin_cos(), toward_deg.to_radians().sin_cos());
    Unit::new_normalize(Vector3::new(sb * cc, sb * sc, cb))
}

fn at(x: f64, axis: Unit<Vector3<f64>>) -> ClPoint {
    ClPoint { tip: Point3::new(x, 200.0, 400.0), axis }
}

/// Axes of the head-B, table-C machine.
const B: usize = 3;
const C: usize = 4;

#[test]
fn a_turn_through_the_pole_changes_the_branch_and_turns_nothing_else() {
    let machine = Machine::head_b_table_c().unwrap();
    let settings = settings(CuttingLaw::AxesLinear, 0.01, 0.001, 0.02);
    for poses in [
        vec![at(0.0, leaning(6.0, 35.0)), at(30.0, leaning(-4.0, 35.0))],
        // With a pose at the pole itself.
        vec![at(0.0, leaning(6.0, 35.0)), at(10.0, leaning(0.0, 0.0)), at(30.0, leaning(-4.0, 35.0))],
    ] {
        for branch in [BranchPreference::Positive, BranchPreference::Negative] {
            let start = machine.nearest_inverse(&poses[0], TOOL, None, branch).unwrap();
            let way = linearise(&machine, &poses, &start, &settings).unwrap();
            check_places(&machine, TOOL, &poses, &way);
            assert_eq!(way.positions[0], start);
            let last = way.positions.last().unwrap();
            assert!(start[B] * last[B] < 0.0, "{start:?} {last:?}");
            assert!(way.positions.iter().all(|q| (q[C] - start[C]).abs() < 1e-9));
        }
    }
}

#[test]
fn a_turn_close_beside_the_pole_is_followed_and_holds() {
    let machine = Machine::head_b_table_c().unwrap();
    // 0.4°, 0.04° beside the pole, and closer than the tolerance of the axis.
    for (beside, follows) in [(5.0_f64, true), (0.5, true), (1e-3, false)] {
        let poses = [at(0.0, leaning(5.0, 180.0 - beside)), at(1.0, leaning(5.0, beside))];
        let settings = settings(CuttingLaw::AxesLinear, 0.01, 1e-4, 0.02);
        let start = machine.nearest_inverse(&poses[0], TOOL, None, BranchPreference::Positive).unwrap();
        let way = linearise(&machine, &poses, &start, &settings).unwrap();
        check_places(&machine, TOOL, &poses, &way);
        for pair in way.positions.windows(2) {
            let [tip, axis, rim] = sampled(&machine, TOOL, RADIUS, [&pair[0], &pair[1]], 40);
            assert!(tip <= 0.01 + 1e-9 && axis <= 1e-4 + 1e-10 && rim <= 0.02 + 1e-8);
        }
        let turned = (way.positions.last().unwrap()[C] - start[C]).abs().to_degrees();
        assert!(!follows || (turned - (180.0 - 2.0 * beside)).abs() < 1e-6, "{turned} at {beside}");
    }
}

#[test]
fn a_way_that_starts_at_the_pole_has_its_free_axis_where_the_first_turn_needs_it() {
    let machine = Machine::head_b_table_c().unwrap();
    let upright = leaning(0.0, 0.0);
    let poses = [at(0.0, upright), at(50.0, upright), at(60.0, leaning(4.0, 77.0)), at(70.0, leaning(6.0, 80.0))];
    let settings = settings(CuttingLaw::AxesLinear, 0.01, 0.001, 0.02);
    let way = linearise(&machine, &poses, &machine.home(), &settings).unwrap();
    check_places(&machine, TOOL, &poses, &way);
    let leaves = way.source.iter().position(|s| s.pose == 2).unwrap();
    assert!(way.positions[..=leaves].iter().all(|q| (q[C] - way.positions[0][C]).abs() < 1e-9));
    // Where no pose leans there is no reason to turn.
    let way = linearise(&machine, &poses[..2], &machine.home(), &settings).unwrap();
    assert!(way.positions.iter().all(|q| q[C] == machine.home()[C]));
}

#[test]
fn full_turns_are_kept() {
    let machine = Machine::head_b_table_c().unwrap();
    let pose = |turn: f64| {
        let (sin, cos) = turn.to_radians().sin_cos();
        ClPoint { tip: Point3::new(300.0 * cos, 300.0 * sin, 400.0), axis: leaning(20.0, turn) }
    };
    let poses: Vec<ClPoint> = (0..60).map(|k| pose(20.0 * f64::from(k))).collect();
    let settings = settings(CuttingLaw::AxesLinear, 0.02, 0.01, 0.05);
    let way = linearise(&machine, &poses, &machine.home(), &settings).unwrap();
    check_places(&machine, TOOL, &poses, &way);
    let whole = (way.positions.last().unwrap()[C] - way.positions[0][C]).abs();
    assert!((whole.to_degrees() - 59.0 * 20.0).abs() < 1e-6, "{}", whole.to_degrees());
}

#[test]
fn a_corner_at_the_pole_is_refused_with_its_place() {
    let machine = Machine::head_b_table_c().unwrap();
    let [a, pole, b] = [leaning(5.0, 0.0), leaning(0.0, 0.0), leaning(5.0, 90.0)];
    let poses = [at(0.0, a), at(10.0, pole), at(20.0, b)];
    // With RTCP and rotary axes linear the table may turn at the pole: the tip does not move, the
    // axis is within its tolerance.
    for law in [CuttingLaw::AxesLinear, CuttingLaw::TipLinearVectorTurned] {
        let e = linearise(&machine, &poses, &machine.home(), &settings(law, 0.01, 1e-4, 0.02)).unwrap_err();
        let LineariseError::Singular { place, axis, from } = e else { panic!("{e}") };
        assert!(place.pose == 1 && place.fraction < 1e-4 && axis == "C" && from < 1e-4, "{e:?}");
        let text = e.to_string();
        assert!(text.contains("pose 1") && text.contains("axis C") && text.contains("tilt the tool away"), "{text}");
    }
}

#[test]
fn ends_of_reach_and_limits_are_reported_with_their_place() {
    let cutting = settings(CuttingLaw::AxesLinear, 0.01, 0.001, 0.02);
    let mill = Machine::head_b_table_c().unwrap();
    let far = ClPoint { tip: Point3::new(1e5, 0.0, 0.0), axis: leaning(3.0, 0.0) };
    let e = linearise(&mill, &[at(0.0, leaning(3.0, 0.0)), far], &mill.home(), &cutting).unwrap_err();
    assert!(matches!(e, LineariseError::Unreachable { place: PoseFraction { pose: 1, fraction: 0.0 }, .. }), "{e}");
    assert!(e.to_string().starts_with("pose 1: axis "), "{e}");

    // The table turns only up to ±100°: beyond that the branch ends, and the other one is half a
    // turn away.
    let mut head = head_yxz();
    head.push(rotary("B", Sense::Positive, Some((-90.0, 90.0)), row(0.0, 90.0, 0.0, 0.0)));
    head.push(row(0.0, -90.0, -100.0, 0.0));
    let limited = machine(vec![rotary("C", Sense::Positive, Some((-100.0, 100.0)), row(0.0, 0.0, 0.0, 0.0))], head);
    let [b, c] = ["B", "C"].map(|letter| limited.axis_index(letter).unwrap());
    let mut start = limited.home();
    (start[b], start[c]) = (0.4, 1.6);
    let pose = |turn: f64| {
        let mut q = start;
        q[c] = turn;
        cl_by_matrices(&limited, &q, TOOL)
    };
    let e = linearise(&limited, &[1.6, 1.7, 1.8].map(pose), &start, &cutting).unwrap_err();
    let LineariseError::Jump { place, axis, by } = e else { panic!("{e}") };
    let turn_there = 1.6 + 0.1 * (place.pose as f64 + place.fraction);
    assert!(axis == "C" && by > 3.0 && (turn_there - 100f64.to_radians()).abs() < 2e-3, "{e:?}");
}

#[test]
fn what_cannot_be_meant_is_refused_by_name() {
    let machine = Machine::head_b_table_c().unwrap();
    let good = settings(CuttingLaw::AxesLinear, 0.01, 0.001, 0.02);
    let poses = [at(0.0, leaning(10.0, 0.0)), at(200.0, leaning(50.0, 60.0))];
    let run = |settings: Linearisation| linearise(&machine, &poses, &machine.home(), &settings);
    let t = good.tolerance;
    for bad in [0.0, -1.0, f64::NAN, 1e-12] {
        for (field, tolerance) in [
            ("tip", MotionTolerance { tip: bad, ..t }),
            ("axis", MotionTolerance { axis: bad, ..t }),
            ("rim", MotionTolerance { rim: bad, ..t }),
        ] {
            assert_eq!(run(Linearisation { tolerance, ..good }), Err(LineariseError::BadTolerance { field }));
        }
    }
    for radius in [-1.0, f64::NAN, f64::INFINITY] {
        let tolerance = MotionTolerance { radius, ..t };
        assert_eq!(run(Linearisation { tolerance, ..good }), Err(LineariseError::BadTolerance { field: "radius" }));
    }
    let bad_start = Err(LineariseError::BadStart { n_axes: 5 });
    assert_eq!(linearise(&machine, &poses, &AxisValues::zeros(4), &good), bad_start);
    assert_eq!(linearise(&machine, &poses, &AxisValues::from([f64::NAN; 5]), &good), bad_start);
    assert_eq!(run(Linearisation { tool_length: f64::NAN, ..good }), bad_start);

    let level = [at(0.0, leaning(90.0, 0.0)), at(1.0, leaning(-90.0, 0.0))];
    let e = linearise(&machine, &level, &machine.home(), &good).unwrap_err();
    assert_eq!(e, LineariseError::Reverses { place: PoseFraction { pose: 0, fraction: 0.0 } });

    let e = run(Linearisation { max_between: 20, ..good }).unwrap_err();
    assert!(matches!(e, LineariseError::TooMany { limit: 20, .. }), "{e}");
    let max_between = run(good).unwrap().positions.len() - 2;
    assert!(run(Linearisation { max_between, ..good }).is_ok());

    assert!(linearise(&machine, &[], &machine.home(), &good).unwrap().positions.is_empty());
    assert_eq!(linearise(&machine, &poses[..1], &machine.home(), &good).unwrap().positions.len(), 1);
}
