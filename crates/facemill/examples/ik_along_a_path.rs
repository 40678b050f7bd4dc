//! Axis positions of a five-axis machine along a path of tool poses: one branch and winding for the
//! whole path, and as many positions between the poses as keep the tool near the path.
//!
//! `cargo run -p facemill --example ik_along_a_path`

use std::error::Error;

use facemill::cl_data::ClPoint;
use facemill::inverse_kinematics::motion::{Linearisation, MotionTolerance, linearise};
use facemill::inverse_kinematics::path::{PathSettings, SegmentKind, choose_along};
use facemill::inverse_kinematics::{Machine, preset};
use nalgebra::{Point3, Unit, Vector3};

/// Distance from the gauge line to the tip, mm.
const TOOL_LENGTH: f64 = 120.0;

fn main() -> Result<(), Box<dyn Error>> {
    let machine = Machine::from_json(preset("table-table-a-c").ok_or("no such preset")?.as_bytes())?;

    // One and a half turns around a cone above the table: the tool leans outward by 20 degrees.
    let pose = |k: u32| {
        let (sin, cos) = (3.0 * std::f64::consts::PI * f64::from(k) / 60.0).sin_cos();
        let tip = Point3::new(60.0 * cos, 60.0 * sin, 80.0 + 0.2 * f64::from(k));
        let lean = 20.0_f64.to_radians();
        let axis = Vector3::new(lean.sin() * cos, lean.sin() * sin, lean.cos());
        ClPoint { tip, axis: Unit::new_normalize(axis) }
    };
    let poses: Vec<ClPoint> = (0..=60).map(pose).collect();
    let cuts = vec![SegmentKind::Cut; poses.len() - 1];

    // 1. Of all solutions of all poses the sequence with the fewest flips and rewinds, then the
    //    fastest one.
    let choice = choose_along(&machine, &poses, &cuts, None, TOOL_LENGTH, &PathSettings::new(&machine))?;
    assert!(choice.breaks.is_empty(), "no axis meets a limit within this path");
    for (k, axis) in machine.axes().iter().enumerate() {
        let values = choice.values.iter().map(|q| axis.in_word_unit(q[k]));
        let (least, greatest) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        println!("{}  {least:9.3} to {greatest:9.3}", axis.letter);
    }
    // Every position puts the tool where it is to be.
    for (q, pose) in choice.values.iter().zip(&poses) {
        let reached = machine.cl_point(q, TOOL_LENGTH);
        assert!((reached.tip - pose.tip).norm() < 1e-9);
        assert!((*reached.axis - *pose.axis).norm() < 1e-12);
    }

    // 2. Between two positions the control moves all axes evenly, and the tip leaves the straight
    //    line. Positions in between keep tip and rim of a 50 mm cutter within 0.01 mm.
    let law = machine.motion_law().cutting;
    let tolerance = MotionTolerance::of_cutter(0.01, 25.0);
    let fine = linearise(&machine, &poses, &choice.values[0], &Linearisation::new(law, TOOL_LENGTH, tolerance))?;
    println!(
        "{} poses need {} positions; deviation of the tip at most {:.4} mm, of the rim {:.4} mm",
        poses.len(),
        fine.positions.len(),
        fine.bound.tip,
        fine.rim
    );
    assert!(fine.positions.len() > poses.len());
    assert!(fine.bound.tip <= 0.01 && fine.rim <= 0.01);
    Ok(())
}
