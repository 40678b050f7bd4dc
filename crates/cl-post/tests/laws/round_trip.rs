//! Poses through APT text.

use facemill_cl_data::ClPoint;
use facemill_cl_file::{AptCutter, AptMove, AptSpec, read_apt, write_apt};
use facemill_inverse_kinematics::{AxisKind, AxisValues, BranchPreference, Machine, preset, preset_names};
use facemill_nc_program::{Coolant, SpindleSpec};
use facemill_test_kit::Random;
use nalgebra::{Point3, Unit, Vector3};

/// Farthest tip from the origin of the table, mm.
const REACH: f64 = 1000.0;

/// Nearest pose to the pole, where the rotary axis nearest to the workpiece turns as many times as
/// far as the tool.
const STEEPEST: f64 = 950.0;

/// Poses through the text of an APT file.
fn written(poses: &[ClPoint]) -> Vec<ClPoint> {
    let spec = AptSpec {
        part_name: "POSES".to_owned(),
        tool_number: 1,
        cutter: AptCutter { radius: 10.0, corner_radius: 1.0, height: 20.0 },
        spindle: SpindleSpec { rpm: 1000.0, clockwise: true },
        coolant: Coolant::Off,
        moves: poses.iter().map(|cl| AptMove::Rapid(*cl)).collect(),
    };
    let text = write_apt(&spec).expect("a file");
    assert!(text.lines().all(|line| line.len() <= 72));
    read_apt(&text).expect("a file").points.iter().map(|point| point.cl).collect()
}

/// Largest turn of a rotary axis for a small turn of the tool at a pose, as a ratio.
fn turn_of_axes(machine: &Machine, length: f64, at: &AxisValues, cl: &ClPoint) -> Option<f64> {
    const SMALL: f64 = 1e-7;
    let mut worst = 0.0_f64;
    for side in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let axis = Unit::new_normalize(*cl.axis + side * SMALL);
        let turned = cl.axis.angle(&axis);
        let turned_to = machine.nearest_inverse(&ClPoint { axis, ..*cl }, length, Some(at), BranchPreference::Positive);
        let turned_to = turned_to.ok()?;
        for (k, _) in machine.axes().iter().enumerate().filter(|(_, axis)| axis.kind == AxisKind::Rotary) {
            worst = worst.max((turned_to[k] - at[k]).abs() / turned.max(0.1 * SMALL));
        }
    }
    Some(worst)
}

/// Axis values from a written pose are those from the pose itself to 1e-6 mm and degrees, before
/// they are rounded to words: on machines of every kind with two rotary axes, with the tip up to
/// 1 m from the origin of the table, and as near to the pole as 0.06°.
#[test]
fn poses_through_apt_text_have_their_axis_values() {
    let mut random = Random(41);
    let (mut n_all, mut worst) = (0, [0.0_f64; 2]);
    for name in preset_names() {
        let heads = Machine::heads_from_json(preset(name).expect("a preset").as_bytes()).expect("a machine");
        let [machine] = &heads[..] else { continue };
        if machine.axes().iter().filter(|axis| axis.kind == AxisKind::Rotary).count() != 2 {
            continue;
        }
        let length = 150.0;
        let mut known: Vec<(AxisValues, ClPoint)> = Vec::new();
        for _ in 0..4000 {
            let q = AxisValues::from_fn(machine.axes().len(), |k| {
                let axis = &machine.axes()[k];
                match axis.kind {
                    AxisKind::Linear => 0.0,
                    // Small angles are as frequent as large ones: the pole is among them.
                    AxisKind::Rotary => {
                        let angle = 10_f64.powf(random.between(-1.3, 2.0)).to_radians();
                        // Off the limits: a pose on one may be beyond it by its rounding.
                        (if random.one_in(2.0) { angle } else { -angle }).clamp(0.999 * axis.min, 0.999 * axis.max)
                    }
                }
            });
            let tip = Point3::from(random.vector(REACH / 3_f64.sqrt()));
            let cl = ClPoint { tip, ..machine.cl_point(&q, length) };
            let Ok(at) = machine.nearest_inverse(&cl, length, Some(&q), BranchPreference::Positive) else { continue };
            if turn_of_axes(machine, length, &at, &cl).is_some_and(|turn| turn < STEEPEST) {
                known.push((at, cl));
            }
        }
        assert!(known.len() > 100, "{name}: {}", known.len());
        n_all += known.len();
        let poses: Vec<ClPoint> = known.iter().map(|(_, cl)| *cl).collect();
        for ((at, _), cl) in known.iter().zip(written(&poses)) {
            let again = machine.nearest_inverse(&cl, length, Some(at), BranchPreference::Positive);
            let again = again.unwrap_or_else(|why| panic!("{name}: {why:?} of {cl:?}"));
            for (k, axis) in machine.axes().iter().enumerate() {
                let apart = axis.in_word_unit(again[k] - at[k]).abs();
                assert!(apart < 1e-6, "{name} {}: {apart:e} at {at:?}", axis.letter);
                let of_kind = &mut worst[usize::from(axis.kind == AxisKind::Rotary)];
                *of_kind = of_kind.max(apart);
            }
        }
    }
    println!("{n_all} poses: at most {:.1e} mm and {:.1e} degrees apart", worst[0], worst[1]);
    // Less would show that no pose is near the pole.
    assert!(n_all > 5000 && worst[0] > 1e-8, "{n_all}, {worst:?}");
}
