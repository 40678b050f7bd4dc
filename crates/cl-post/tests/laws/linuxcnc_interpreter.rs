//! The interpreter of LinuxCNC (program `rs274` of the Debian package `linuxcnc-uspace`) goes
//! where the file says.
//!
//! Skipped, with a message, where neither the environment variable `FACEMILL_RS274` nor the search
//! path has it.

use std::path::Path;

use facemill_cl_data::ClPoint;
use facemill_cl_file::{AptPointKind, read_apt};
use facemill_cl_post::PostOptions;
use facemill_inverse_kinematics::{AxisKind, AxisValues};
use facemill_nc_program::Dialect;
use facemill_test_kit::{Random, SHARED_NC, linuxcnc_interpreter, run_linuxcnc};

use nalgebra::Isometry3;

use crate::kit::*;
use crate::shared_files::{frame_of, middle_of, tool_numbers};

/// Ends of all straight moves that the interpreter makes of a program: X, Y, Z, A, B, C.
fn interpreted(rs274: &Path, text: &str, (name, tools): (&str, &[u32])) -> Vec<[f64; 6]> {
    let table: String = tools.iter().map(|n| format!("T{n} P{n} Z{LENGTH} D20 ;mill\n")).collect();
    let (is_taken, printed) = run_linuxcnc(rs274, text, &table, &format!("post-{name}"));
    assert!(is_taken && printed.contains("PROGRAM_END"), "{printed}");
    let ends = printed.lines().filter_map(|line| {
        let rest = line.split_once("STRAIGHT_TRAVERSE(").or_else(|| line.split_once("STRAIGHT_FEED("))?.1;
        let values: Vec<f64> = rest.trim_end_matches(')').split(',').filter_map(|v| v.trim().parse().ok()).collect();
        values.get(..6)?.try_into().ok()
    });
    ends.collect()
}

#[test]
fn its_interpreter_brings_the_tool_to_every_pose_on_three_machines() {
    let Some(rs274) = linuxcnc_interpreter() else { return };
    for (k, name) in MACHINES.iter().enumerate() {
        let stage = Stage::control(name, Dialect::LinuxCnc, None);
        let poses = random_walk(&mut Random(800 + k as u64), 300);
        let posted = stage.post(&file_of(&poses, ("MM", 1.0)));
        assert!(posted.report.is_clean(), "{name}: {:?}", posted.report.faults);
        let cls = poses_of(&stage, &interpreted(&rs274, &posted.text, (name, &[7])));
        let mut at = 0;
        for (k, pose) in poses.iter().enumerate() {
            let is_it = |cl: &ClPoint| (cl.tip - pose.cl.tip).norm() < 0.02 && angle(&cl.axis, &pose.cl.axis) < 5e-5;
            let found = cls[at..].iter().position(is_it);
            at += found.unwrap_or_else(|| panic!("{name}: pose {k} is not reached behind move {at}"));
        }
    }
}

/// Tip and axis at each end, in the frame of the file.
fn poses_of(stage: &Stage, ends: &[[f64; 6]]) -> Vec<ClPoint> {
    let along = stage.machine.length_compensation_travel().unwrap();
    let axes = stage.machine.axes();
    let pose = |end: &[f64; 6]| {
        let q = AxisValues::from_fn(axes.len(), |k| {
            let value = end["XYZABC".find(axes[k].letter.as_str()).unwrap()];
            match axes[k].kind {
                AxisKind::Linear => value + along[k] * LENGTH,
                AxisKind::Rotary => value.to_radians(),
            }
        });
        stage.machine.cl_point(&q, LENGTH).transformed(&stage.table_from_work.inverse())
    };
    ends.iter().map(pose).collect()
}

/// Files of a CAM system, one of them with fourteen tool calls and frames: on three machines the
/// interpreter takes all changes, and tip and axis come to every point but those of cycles.
#[test]
fn its_interpreter_takes_published_files_on_three_machines() {
    let Some(rs274) = linuxcnc_interpreter() else { return };
    for name in ["aamorim_Interface-glue.apt", "aamorim_basemach.apt", "aamorim_manufacture3-top.apt"] {
        let path = std::path::Path::new(SHARED_NC).join(name);
        let Ok(text) = std::fs::read_to_string(&path) else {
            eprintln!("SKIPPED: {} is not there", path.display());
            continue;
        };
        let file = read_apt(&text).unwrap();
        let numbers = tool_numbers(&file);
        for machine in ["bridge-head-head-a-b", "head-b-table-c", "head-head-c-a"] {
            let mut stage = Stage::control(machine, Dialect::LinuxCnc, None);
            stage.tools = numbers.iter().map(|number| tool(*number, LENGTH)).collect();
            stage.table_from_work *= Isometry3::from(-middle_of(&file));
            let options = PostOptions { retract: Some(5.0), law_feeds: false, ..PostOptions::new("several") };
            let posted = stage.post_with(&text, &options).unwrap_or_else(|e| panic!("{name} on {machine}: {e}"));
            let cls = poses_of(&stage, &interpreted(&rs274, &posted.text, ("several", &numbers)));
            let mut at = 0;
            for point in file.points.iter().filter(|p| p.kind != AptPointKind::Cycle) {
                let frame = frame_of(&file, point.frame);
                let tip = frame.transform_point(&point.cl.tip);
                let axis = frame.transform_vector(&point.cl.axis);
                let is_it = |cl: &ClPoint| (cl.tip - tip).norm() < 0.02 && (*cl.axis - axis).norm() < 1e-4;
                let found = cls[at..].iter().position(is_it);
                at += found.unwrap_or_else(|| panic!("{name} on {machine}: line {} is not reached", point.line));
            }
        }
    }
}
