//! Poles, limits of rotary axes, and turns with the tool lifted.

use facemill_cl_data::ClPoint;
use facemill_cl_post::PostOptions;
use nalgebra::{Point3, Unit, Vector3};

use crate::kit::*;

/// Cuts around a cone: more turns than a limited axis has.
fn spiral(turns: f64, n: u32) -> Vec<FilePose> {
    let pose = |k: u32| {
        let angle = std::f64::consts::TAU * turns * f64::from(k) / f64::from(n);
        let (sin, cos) = angle.sin_cos();
        let axis = Vector3::new(0.4 * cos, 0.4 * sin, 1.0);
        let tip = Point3::new(30.0 * cos, 30.0 * sin, 20.0 - 0.02 * f64::from(k));
        FilePose { cl: ClPoint { tip, axis: Unit::new_normalize(axis) }, is_rapid: k == 0 }
    };
    (0..=n).map(pose).collect()
}

/// Lifted from a pose at rapid rate.
fn up(pose: &FilePose) -> FilePose {
    FilePose { cl: pose.cl.translated(Vector3::z() * 40.0), is_rapid: true }
}

#[test]
fn an_endless_axis_winds_on() {
    let stage = Stage::fanuc("table-table-a-c", 4);
    let mut poses = spiral(4.0, 240);
    poses.push(up(&poses[240]));
    let posted = stage.post(&file_of(&poses, ("MM", 1.0)));
    assert!(posted.report.is_clean());
    let turns: Vec<f64> = motions(&posted.text).iter().map(|m| m.words["C"]).collect();
    assert!((turns[turns.len() - 1] - turns[0]).abs() > 1400.0, "{turns:?}");
    assert!(turns.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 10.0));
}

/// Where a limited axis ends within a cut, the tool goes up along its axis, the tip is held while
/// the axis turns back, and it comes down to the same point at the feed of the cut.
#[test]
fn a_limited_axis_turns_back_with_the_tool_lifted() {
    let stage = Stage::fanuc("head-head-c-a", 4);
    let poses = spiral(4.0, 240);
    let text = file_of(&poses, ("MM", 1.0));
    let why = stage.refused(&text);
    assert!(why.starts_with("line ") && why.contains("--retract-mm"), "{why}");
    let options = PostOptions { retract: Some(40.0), ..PostOptions::new("test") };
    let posted = stage.post_with(&text, &options).unwrap();
    assert!(posted.report.is_clean(), "{:?}", posted.report.faults);
    let lifts = posted.report.notes.iter().filter(|n| n.text.contains("the tool is lifted by 40 mm")).count();
    assert!(lifts >= 1, "{:?}", posted.report.notes);
    let reached = stage.reached(&posted.text);
    let c = stage.machine.axis_index("C").unwrap();
    let limit = 370f64.to_radians();
    assert!(reached.iter().all(|r| r.axes[c].abs() <= limit + 1e-6));
    let cone = |p: &Point3<f64>| p.coords.xy().norm();
    let mut turned_back = 0.0;
    for pair in reached.windows(2) {
        let turn = (pair[1].axes[c] - pair[0].axes[c]).abs();
        let is_up = pair.iter().all(|r| r.cl.tip.z > 45.0);
        if is_up {
            turned_back += turn;
            assert!((pair[0].cl.tip - pair[1].cl.tip).norm() < 1.0, "the tip is held");
        } else {
            // On the part the axis turns with the path alone.
            assert!(turn < 0.3, "{turn} at {}", pair[1].cl.tip);
        }
        // Nothing comes down at rapid rate.
        assert!(!pair[1].is_rapid || pair[1].cl.tip.z >= pair[0].cl.tip.z - 1e-3, "{}", pair[1].cl.tip);
    }
    assert!(turned_back > 3.0, "{turned_back}");
    assert!(reached.iter().filter(|r| r.cl.tip.z < 30.0).all(|r| (cone(&r.cl.tip) - 30.0).abs() < 0.05));
}

/// Two spirals with a way of rapids between them, on which a limited axis has to turn back.
fn two_spirals(between: usize) -> Vec<FilePose> {
    let mut poses = spiral(1.6, 120);
    let again = poses.clone();
    let (from, to) = (up(&poses[poses.len() - 1]).cl, up(&again[0]).cl);
    for k in 0..=between {
        let t = k as f64 / between as f64;
        let tip = from.tip + (to.tip - from.tip) * t;
        let axis = from.axis.slerp(&to.axis, t);
        poses.push(FilePose { cl: ClPoint { tip, axis }, is_rapid: true });
    }
    poses.extend(again.iter().map(|pose| FilePose { is_rapid: false, ..*pose }));
    poses.push(up(&again[again.len() - 1]));
    poses
}

/// In a rapid from or to a cut the tool has to be lifted, and is with a retract.
#[test]
fn a_limited_axis_turns_back_in_a_rapid_with_the_tool_lifted() {
    let stage = Stage::fanuc("head-head-c-a", 4);
    for between in [1, 3] {
        let text = file_of(&two_spirals(between), ("MM", 1.0));
        let options = PostOptions { retract: Some(25.0), ..PostOptions::new("test") };
        let posted = stage.post_with(&text, &options).unwrap();
        assert!(posted.report.is_clean(), "{:?}", posted.report.faults);
        let lifts = posted.report.notes.iter().filter(|n| n.text.contains("is lifted by 25 mm")).count();
        assert_eq!(lifts, 1, "{:?}", posted.report.notes);
        let c = stage.machine.axis_index("C").unwrap();
        let reached = stage.reached(&posted.text);
        for pair in reached.windows(2) {
            let turn = (pair[1].axes[c] - pair[0].axes[c]).abs();
            // Turns without motion are above the end of the first spiral.
            assert!(turn < 0.7 || pair.iter().all(|r| r.cl.tip.z > 17.0 + 20.0), "{turn} at {}", pair[1].cl.tip);
        }
    }
}

/// Without a retract such a rapid is refused next to a cut, and a fault elsewhere.
#[test]
fn a_turn_in_a_rapid_without_a_lift_is_refused_or_a_fault() {
    let stage = Stage::fanuc("head-head-c-a", 4);
    let (mut refused, mut faults) = (0, 0);
    for between in [1, 2, 3, 5] {
        let text = file_of(&two_spirals(between), ("MM", 1.0));
        match stage.post_with(&text, &PostOptions::new("test")) {
            Err(why) => {
                let why = why.to_string();
                assert!(why.contains("in a rapid from or to a cut") && why.contains("--retract-mm"), "{why}");
                refused += 1;
            }
            Ok(posted) => {
                assert!(posted.is_as_meant && posted.report.faults.len() == 1, "{:?}", posted.report.faults);
                let fault = &posted.report.faults[0];
                assert!(fault.line.is_some() && fault.text.contains("without a lift"), "{fault:?}");
                let reached = stage.reached(&posted.text);
                assert!(reached.iter().all(|r| r.cl.tip.z > 14.0 && r.cl.tip.coords.xy().norm() < 30.6));
                // A report without a run proves nothing.
                let mut again = posted.clone();
                again.take_proof();
                assert!(!again.report.is_clean());
                faults += 1;
            }
        }
    }
    println!("{refused} {faults}");
    assert!(refused > 0 && faults > 0, "{refused} {faults}");
}

/// Through the pole the tool turns about itself; every pose is reached and nothing jumps.
#[test]
fn a_path_through_the_pole_is_followed() {
    for name in MACHINES {
        let stage = Stage::fanuc(name, 4);
        let lean = |k: i32| f64::from(k) * 0.02;
        let pose = |k: i32, x: f64, y: f64| FilePose {
            cl: ClPoint { tip: Point3::new(x, y, 30.0), axis: Unit::new_normalize(Vector3::new(lean(k), 0.0, 1.0)) },
            is_rapid: false,
        };
        let mut poses: Vec<FilePose> = (-10..=10).map(|k| pose(k, f64::from(k), 0.0)).collect();
        // Then upright on the way, and out across it.
        poses.extend((0..5).map(|k| pose(0, 10.0, f64::from(k))));
        let across = |k: i32| FilePose {
            cl: ClPoint {
                tip: Point3::new(10.0, 5.0 + f64::from(k), 30.0),
                axis: Unit::new_normalize(Vector3::new(0.0, lean(k), 1.0)),
            },
            is_rapid: false,
        };
        poses.extend((1..8).map(across));
        poses[0].is_rapid = true;
        poses.push(up(&poses[poses.len() - 1]));
        let posted = stage.post(&file_of(&poses, ("MM", 1.0)));
        assert!(posted.report.is_clean(), "{name}: {:?}", posted.report.faults);
        let reached = stage.reached(&posted.text);
        for pair in reached.windows(2) {
            let turns = pair[0].axes.iter().zip(pair[1].axes.iter()).skip(3).map(|(a, b)| (a - b).abs());
            let largest = turns.fold(0.0, f64::max);
            let way = (pair[1].cl.tip - pair[0].cl.tip).norm();
            assert!(largest < 0.7 || way < 1e-3, "{name}: {largest} rad over {way} mm");
        }
    }
}
