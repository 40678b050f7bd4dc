//! Workcells as a user of the library makes them, and reasons as text.

use std::sync::Arc;

use facemill_cutter_location::{Body, Hints, Infeasible, Obstacle, PoseTest, Workcell};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::{Machine, preset, preset_names};
use nalgebra::{Isometry3, Point3};

use crate::kit::{cc_on_plane, machine, plane, posture_deg, tool};

#[test]
fn a_new_workcell_tests_the_table() {
    let tree = MeshTree::new(&plane(100.0));
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let outcome = |height: f64| {
        let mut cell = Workcell::new(&machine, &tool, Isometry3::translation(0.0, 0.0, height));
        cell.obstacles.push(Obstacle::part("part", &tree));
        let test = PoseTest::new(&cell);
        let tried = test.try_posture(&cc_on_plane(0.0, 0.0), posture_deg(5.0, 0.0), None, &mut Hints::default());
        tried.map(|_| ()).map_err(|why| (test.describe(&why), why))
    };
    assert_eq!(outcome(500.0), Ok(()));
    // The part lies in the table.
    let (text, why) = outcome(-20.0).expect_err("the table is in the way");
    assert_eq!(text, "cutter gouges table");
    assert!(matches!(why, Infeasible::Gouge { obstacle: 0, .. }), "{why:?}");
}

#[test]
fn a_new_workcell_has_every_body_that_rests_against_the_workpiece() {
    let tool = tool(16.0, 2.0, 12.0);
    for name in preset_names() {
        for machine in Machine::heads_from_json(preset(name).unwrap().as_bytes()).unwrap() {
            let cell = Workcell::new(&machine, &tool, Isometry3::translation(0.0, 0.0, 500.0));
            let test = PoseTest::new(&cell);
            let still = machine.bodies().iter().enumerate().filter(|(_, b)| b.joints_from_table() == 0);
            let still: Vec<Option<usize>> = still.map(|(k, _)| Some(k)).collect();
            assert!(!still.is_empty(), "{name}: a table");
            assert_eq!(cell.obstacles.iter().map(|o| o.machine_body).collect::<Vec<_>>(), still, "{name}");
            drop(test);
        }
    }
}

#[test]
fn a_shared_mesh_answers_as_a_borrowed_one() {
    let tree = Arc::new(MeshTree::new(&plane(100.0)));
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let tried = |part: Obstacle<'_>| {
        let mut cell = Workcell::new(&machine, &tool, Isometry3::translation(0.0, 0.0, 500.0));
        cell.obstacles.push(part);
        let test = PoseTest::new(&cell);
        test.try_posture(&cc_on_plane(3.0, -4.0), posture_deg(3.0, 0.0), None, &mut Hints::default())
    };
    // In its finished shape, and with material to leave on it, which is in the way.
    for gouge_allowance in [Some(0.0), Some(0.5)] {
        let borrowed = tried(Obstacle { gouge_allowance, ..Obstacle::part("part", &*tree) });
        assert_eq!(borrowed, tried(Obstacle { gouge_allowance, ..Obstacle::part("part", Arc::clone(&tree)) }));
        assert_eq!(borrowed.is_ok(), gouge_allowance == Some(0.0), "{borrowed:?}");
    }
}

#[test]
fn reasons_are_errors_with_one_line_of_text() {
    let place = Point3::new(1.0, 2.5, -3.0);
    let reasons = [
        Infeasible::OutsideCone { excess: 0.1 },
        Infeasible::Singular { within: 0.1 },
        Infeasible::FromBelow,
        Infeasible::TooLong,
        Infeasible::Rewind { axis: 4 },
        Infeasible::Ramp { angle: 0.1 },
        Infeasible::Gouge { obstacle: 2, place },
        Infeasible::Collision { body: Body::Tool(1), obstacle: 0, place },
    ];
    let texts: Vec<String> = reasons.iter().map(|why| (why as &dyn std::error::Error).to_string()).collect();
    assert!(texts.iter().all(|text| !text.is_empty() && !text.contains('\n')), "{texts:#?}");
    assert_eq!(texts[6], "cutter gouges obstacle 2 at (1.000, 2.500, -3.000) mm");
    assert_eq!(texts[7], "tool body 1 hits obstacle 0 at (1.000, 2.500, -3.000) mm");
}
