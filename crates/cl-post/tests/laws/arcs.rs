//! Arcs as chords.

use std::f64::consts::{PI, TAU};

use facemill_cl_post::PostOptions;
use facemill_test_kit::Random;
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

use crate::kit::*;

/// A file with one arc behind a cut to its start, and another cut.
fn file(start: &Point3<f64>, arc: &str, end: &Point3<f64>) -> String {
    format!(
        "{HEAD}GOTO/{},{},{},0.1,0.05,1\n{arc}\nGOTO/{},{},{}\nFINI",
        start.x, start.y, start.z, end.x, end.y, end.z
    )
}

/// Tips behind the cut to the start.
fn tips(stage: &Stage, text: &str, tolerance: f64) -> Vec<Point3<f64>> {
    let options = PostOptions { tolerance, retract: Some(30.0), ..PostOptions::new("test") };
    let posted = stage.post_with(text, &options).unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert!(posted.report.is_clean(), "{:?}", posted.report.faults);
    assert_eq!(posted.report.tools[0].arcs, 1);
    let reached = stage.reached(&posted.text);
    let cuts = reached.iter().filter(|r| !r.is_rapid);
    cuts.map(|r| r.cl.tip).collect()
}

/// Turns about any axis in both senses: the way stays at the radius, in its plane but for a helix,
/// and goes round in the sense of the right hand.
#[test]
fn arcs_are_followed_in_their_sense_within_the_tolerance() {
    let mut random = Random(31);
    let stage = Stage::fanuc("head-b-table-c", 5);
    for round in 0..24 {
        let axis = if round % 3 == 0 { Vector3::z_axis() } else { random.direction() };
        let axis = if round % 2 == 0 { axis } else { -axis };
        let center = Point3::from(random.vector(20.0)) + Vector3::new(0.0, 0.0, 30.0);
        let radius = random.between(2.0, 25.0);
        let side = Unit::new_normalize(axis.cross(&Vector3::new(0.31, 0.52, 0.4))).into_inner() * radius;
        let turn = random.between(0.2, TAU - 0.2);
        let rise = if round % 4 == 0 { 3.0 } else { 0.0 };
        let on = |angle: f64| {
            center + UnitQuaternion::from_axis_angle(&axis, angle) * side + axis.into_inner() * (rise * angle / turn)
        };
        let (start, end) = (on(0.0), on(turn));
        let numbers = format!("{},{},{},{},{},{},{radius}", center.x, center.y, center.z, axis.x, axis.y, axis.z);
        let degrees = turn.to_degrees();
        let arcs = [format!("CIRCLE/{numbers}"), format!("MOVARC/{numbers},ANGLE,{degrees}")];
        let text = file(&start, &arcs[round % 2], &end);
        let tolerance = 0.02;
        let tips = tips(&stage, &text, tolerance);
        assert!((tips[tips.len() - 1] - end).norm() < 1e-4);
        let at_start = tips.iter().position(|p| (p - start).norm() < 1e-4).expect("the start");
        let mut angle_before = 0.0;
        for pair in tips[at_start..].windows(2) {
            for step in 0..=8 {
                let p = pair[0] + (pair[1] - pair[0]) * (f64::from(step) / 8.0);
                let height = (p - center).dot(&axis);
                let out = p - center - axis.into_inner() * height;
                assert!((out.norm() - radius).abs() <= tolerance, "{round}: {} of {radius}", out.norm());
                let angle = axis.dot(&side.cross(&out)).atan2(side.dot(&out)).rem_euclid(TAU);
                let angle = if angle > TAU - 1e-3 { 0.0 } else { angle };
                assert!((height - rise * angle / turn).abs() <= tolerance, "{round}: height {height}");
                assert!(angle >= angle_before - 1e-6, "{round}: goes back from {angle_before} to {angle}");
                angle_before = angle;
            }
        }
        assert!((angle_before - turn).abs() < 1e-3, "{round}: {angle_before} of {turn}");
    }
}

#[test]
fn a_circle_to_its_start_is_a_full_one() {
    let stage = Stage::fanuc("table-table-a-c", 4);
    let start = Point3::new(10.0, 0.0, 20.0);
    let tips = tips(&stage, &file(&start, "CIRCLE/0,0,20,0,0,-1,10", &start), 0.01);
    let at = tips.iter().position(|p| (p - start).norm() < 1e-3).expect("the start");
    let way: f64 = tips[at..].windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    assert!((way - TAU * 10.0).abs() < 0.1, "{way}");
    // Clockwise: first toward −y.
    assert!(tips[at + 1].y < 0.0, "{}", tips[at + 1]);
}

/// Systems that write the axis of a clockwise arc upward say the turn by ANGLE.
#[test]
fn an_angle_of_the_other_way_round_turns_the_sense() {
    let stage = Stage::fanuc("table-table-a-c", 4);
    let (start, end) = (Point3::new(10.0, 0.0, 20.0), Point3::new(0.0, 10.0, 20.0));
    let length = |angle: f64| -> f64 {
        let tips = tips(&stage, &file(&start, &format!("MOVARC/0,0,20,0,0,1,10,ANGLE,{angle}"), &end), 0.01);
        let at = tips.iter().position(|p| (p - start).norm() < 1e-3).unwrap();
        tips[at..].windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    };
    assert!((length(90.0) - 5.0 * PI).abs() < 0.05);
    assert!((length(270.0) - 15.0 * PI).abs() < 0.1);
    assert_eq!(
        stage.refused(&file(&start, "MOVARC/0,0,20,0,0,1,10,ANGLE,100", &end)),
        "line 10: the arc's ANGLE is 100.000 deg, and its ends are 90.000 deg apart about its axis"
    );
}

#[test]
fn arcs_that_are_none_are_refused() {
    let stage = Stage::fanuc("table-table-a-c", 4);
    let start = Point3::new(10.0, 0.0, 20.0);
    for (arc, end, expected) in [
        ("CIRCLE/0,0,20,0,0,1", Point3::new(0.0, 11.0, 20.0), "begins 10.0000 mm from its axis and ends 11.0000 mm"),
        ("CIRCLE/0,0,20,0,0,1,12", Point3::new(0.0, 10.0, 20.0), "its radius is given as 12.0000 mm"),
        ("CIRCLE/10,0,20,0,0,1", Point3::new(10.0, 0.0, 20.0), "begins 0.0000 mm from its axis"),
        ("CIRCLE/1,2", Point3::new(10.0, 0.0, 20.0), "needs a point before it, and its centre and axis"),
        ("CIRCLE/C1", Point3::new(10.0, 0.0, 20.0), "needs a point before it, and its centre and axis"),
    ] {
        let why = stage.refused(&file(&start, arc, &end));
        assert!(why.starts_with("line ") && why.contains(expected), "{arc}: {why}");
    }
}

/// Ends some ten thousandths apart may be rounding of a full circle, or a short arc.
#[test]
fn an_arc_whose_ends_are_hardly_apart_needs_its_angle() {
    let stage = Stage::fanuc("table-table-a-c", 5);
    let start = Point3::new(10.0, 0.0, 20.0);
    for side in [5e-4, -5e-4] {
        let end = Point3::new(10.0, side, 20.0);
        let why = stage.refused(&file(&start, "CIRCLE/0,0,20,0,0,1,10", &end));
        assert!(why.starts_with("line 10: the ends of the arc are 0.0005") && why.contains("ANGLE"), "{why}");
        let way = |arc: &str, end: &Point3<f64>| -> f64 {
            let tips = tips(&stage, &file(&start, arc, end), 0.01);
            let at = tips.iter().position(|p| (p - start).norm() < 1e-4).expect("the start");
            tips[at..].windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
        };
        let full = way("MOVARC/0,0,20,0,0,1,10,ANGLE,360", &end);
        assert!((full - TAU * 10.0).abs() < 0.1, "{full}");
        let short = way("MOVARC/0,0,20,0,0,1,10,ANGLE,0.003", &end);
        assert!(short < 1e-3, "{short}");
    }
    // Two thousandths are a short arc.
    let tips = tips(&stage, &file(&start, "CIRCLE/0,0,20,0,0,1,10", &Point3::new(10.0, 0.002, 20.0)), 0.01);
    let at = tips.iter().position(|p| (p - start).norm() < 1e-4).expect("the start");
    assert!((tips[tips.len() - 1].y - 0.002).abs() < 1e-4 && tips.len() - at < 4, "{tips:?}");
}
