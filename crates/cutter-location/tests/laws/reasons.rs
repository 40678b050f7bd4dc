//! Every reason why a posture is infeasible, provoked, with its place and its sentence.

use facemill_cutter_location::{
    AxisCone, Body, Hints, Infeasible, PoseTest, SearchOrder, SearchSettings, Workcell, search,
};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::{AxisKind, AxisLetter, Branch, Unreachable};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::kit::{Ball, cc_on_plane, curve_deg, machine, obstacle, plane, posture_deg, tool, workcell};

#[test]
fn an_axis_limit_is_named_with_axis_value_and_limits() {
    let tree = MeshTree::new(&plane(400.0));
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    // The table is 4 m wide, X reaches 2.6 m: with C free to turn, a part at 3 m is out of reach
    // for every C.
    let table_from_work = Isometry3::translation(3000.0, 0.0, 900.0);
    let cell = Workcell { table_from_work, ..workcell(&machine, &tool, vec![obstacle("part", &tree)]) };
    let test = PoseTest::new(&cell);
    // Leaning outward along the radius: the preferred branch turns C so that the part lies on the X
    // axis.
    let why = test.try_posture(&cc_on_plane(0.0, 0.0), posture_deg(10.0, 0.0), None, &mut Hints::default());
    let Err(why @ Infeasible::Unreachable(Unreachable::AxisLimit { axis, kind, value, min, max, .. })) = why else {
        panic!("{why:?}")
    };
    assert_eq!((kind, min, max), (AxisKind::Linear, -2600.0, 2600.0));
    assert!(!(min..=max).contains(&value));
    let text = test.describe(&why);
    assert!(text.contains(&format!("axis {axis} ")) && text.contains("2600.0000"), "{text}");
    // 600 mm nearer it is in reach.
    let nearer = Workcell { table_from_work: Isometry3::translation(2400.0, 0.0, 900.0), ..cell };
    let pose =
        PoseTest::new(&nearer).try_posture(&cc_on_plane(0.0, 0.0), posture_deg(10.0, 0.0), None, &mut Hints::default());
    assert!(pose.is_ok(), "{pose:?}");
}

#[test]
fn leaving_the_cone_is_reported_with_the_angle_outside() {
    let tree = MeshTree::new(&plane(400.0));
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let cone = AxisCone { axis: Vector3::z_axis(), half_angle: 5f64.to_radians() };
    let cell = Workcell { axis_cone: Some(cone), ..workcell(&machine, &tool, vec![obstacle("part", &tree)]) };
    let test = PoseTest::new(&cell);
    for rotate in [0.0, -40.0, 170.0] {
        let at =
            |tilt| test.try_posture(&cc_on_plane(0.0, 0.0), posture_deg(tilt, rotate), None, &mut Hints::default());
        assert!(at(4.999).is_ok());
        let Err(why @ Infeasible::OutsideCone { excess }) = at(7.0) else { panic!() };
        assert!((excess.to_degrees() - 2.0).abs() < 1e-9);
        assert_eq!(test.describe(&why), "tool axis 2.000 deg outside the job's cone");
    }
}

#[test]
fn a_gouge_names_the_obstacle_and_a_place_in_the_cutter() {
    let part = MeshTree::new(&plane(400.0));
    // A knob on the plane under the trailing part of the cutter: a tilt of 30° clears it, one of 5°
    // does not.
    let knob = Ball { center: Point3::new(-40.0, 0.0, 0.0), radius: 8.0 };
    let knob_tree = MeshTree::new(&knob.mesh());
    let (machine, tool) = (machine(), tool(25.0, 2.0, 12.0));
    let cell = workcell(&machine, &tool, vec![obstacle("part", &part), obstacle("knob", &knob_tree)]);
    let test = PoseTest::new(&cell);
    let at = |tilt| test.try_posture(&cc_on_plane(0.0, 0.0), posture_deg(tilt, 0.0), None, &mut Hints::default());
    let Err(why @ Infeasible::Gouge { obstacle: 1, place }) = at(5.0) else { panic!("{:?}", at(5.0)) };
    assert_eq!(test.describe(&why), "cutter gouges knob");
    assert!(((place - knob.center).norm() - knob.radius).abs() <= knob.chord_error() + 1e-9, "{place}");
    let axis = cc_on_plane(0.0, 0.0).tool_axis(posture_deg(5.0, 0.0));
    // Within the cutter: less than R from its axis, whose foot is R − r behind the contact.
    let from_axis = (place - Point3::new(-23.0, 0.0, 0.0)).cross(&axis).norm();
    assert!(from_axis < 25.5, "{from_axis}");
    assert!(at(30.0).is_ok(), "{:?}", at(30.0));
}

#[test]
fn a_collision_names_the_body_and_the_obstacle() {
    let part = MeshTree::new(&plane(400.0));
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    // Beside the upright tool, at this distance from its axis, with a ball of radius 5: within the
    // body of radius 12 from 12 to 52 mm, the holder of radius 30 from 52 to 152 mm, the nose of
    // radius 90, the head of half width 150.
    for (name, height, outer) in [
        ("cutter body section 1", 30.0, 12.0),
        ("holder section 1", 100.0, 30.0),
        ("spindle nose", 250.0, 90.0),
        ("head", 600.0, 150.0),
    ] {
        let at_distance = |x: f64| Ball { center: Point3::new(-14.0, x, height), radius: 5.0 };
        for (x, hits) in [(outer + 3.0, true), (outer + 20.0, false)] {
            let ball = MeshTree::new(&at_distance(x).mesh());
            let cell = workcell(&machine, &tool, vec![obstacle("part", &part), obstacle("post", &ball)]);
            let test = PoseTest::new(&cell);
            let found = test.try_posture(&cc_on_plane(0.0, 0.0), posture_deg(0.0, 0.0), None, &mut Hints::default());
            if !hits {
                assert!(found.is_ok(), "{name}: {found:?}");
                continue;
            }
            let Err(why @ Infeasible::Collision { body, obstacle: 1, place }) = found else {
                panic!("{name} {found:?}")
            };
            assert_eq!(test.body_name(body), name);
            assert_eq!(test.describe(&why), format!("{name} hits post"));
            assert!((place - at_distance(x).center).norm() <= 5.0 + 1e-9);
            assert_eq!(matches!(body, Body::Tool(_)), height < 160.0);
        }
    }
}

#[test]
fn search_tells_what_blocked_most_of_the_curve() {
    let part = MeshTree::new(&plane(400.0));
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let curve = curve_deg([2.0, 0.0], [22.0, 0.0], SearchOrder::TiltFirst, 1.0);
    // A pillar that reaches into the cutter's place blocks all postures that the cone allows.
    let knob = MeshTree::new(&Ball { center: Point3::new(-14.0, 0.0, 10.0), radius: 9.0 }.mesh());
    for (half_angle_deg, expected) in [(4.0, "outside the job's cone"), (21.0, "cutter gouges knob")] {
        let cone = AxisCone { axis: Unit::new_normalize(Vector3::z()), half_angle: f64::to_radians(half_angle_deg) };
        let obstacles = vec![obstacle("part", &part), obstacle("knob", &knob)];
        let cell = Workcell { axis_cone: Some(cone), ..workcell(&machine, &tool, obstacles) };
        let test = PoseTest::new(&cell);
        let settings = SearchSettings::default();
        let found = search(&test, &cc_on_plane(0.0, 0.0), &curve, &settings, 0.0, None, &mut Hints::default());
        let text = test.describe(&found.unwrap_err());
        assert!(text.contains(expected), "{text}");
    }
}

/// Reasons without a test at hand, as an error in a library user's log shows them.
#[test]
fn every_reason_is_words_with_figures_and_no_code() {
    let place = Point3::new(1.5, -20.25, 300.0);
    let letter = |text: &str| AxisLetter::parse(text).unwrap();
    let limit =
        Unreachable::AxisLimit { axis: letter("B"), index: 3, kind: AxisKind::Rotary, value: 2.0, min: -1.0, max: 1.5 };
    let direction = Unreachable::Direction { first: letter("B"), second: letter("C"), by: 0.1 };
    let tip = Unreachable::Tip { first: letter("X"), second: letter("Z"), by: 12.5 };
    let by_the_cutter = Infeasible::Collision { body: Body::Cutter, obstacle: 2, place };
    for (why, figures) in [
        (Infeasible::OutsideCone { excess: 0.05 }, &["2.865 deg", "cone"][..]),
        (Infeasible::Singular { within: 0.01 }, &["0.573 deg", "pole"]),
        (Infeasible::FromBelow, &["surface"]),
        (Infeasible::Unreachable(limit), &["axis B", "114.5916 deg", "-57.2958 to 85.9437"]),
        (Infeasible::Unreachable(direction), &["5.7296 deg", "B and C"]),
        (Infeasible::Unreachable(tip), &["12.5000 mm", "X and Z"]),
        (Infeasible::Unreachable(Unreachable::Singular), &["linear axes"]),
        (Infeasible::Unreachable(Unreachable::Inaccurate), &["1e-9 mm"]),
        (Infeasible::Unreachable(Unreachable::NotFinite), &["not finite"]),
        (Infeasible::OtherBranch(Branch::Positive), &["other side"]),
        (Infeasible::Gouge { obstacle: 7, place }, &["obstacle 7", "(1.500, -20.250, 300.000) mm"]),
        (Infeasible::TooLong, &["too long"]),
        (Infeasible::Rewind { axis: 4 }, &["axis 4"]),
        (Infeasible::Ramp { angle: 0.2 }, &["11.46 deg"]),
        (by_the_cutter, &["cutter hits obstacle 2", "(1.500, -20.250, 300.000) mm"]),
        (Infeasible::Collision { body: Body::Tool(1), obstacle: 0, place }, &["tool body 1 hits obstacle 0"]),
        (Infeasible::Collision { body: Body::Machine(5), obstacle: 0, place }, &["machine body 5 hits obstacle 0"]),
    ] {
        let text = why.to_string();
        assert!(figures.iter().all(|f| text.contains(f)), "{text}: {figures:?}");
        // Neither braces and names of types and fields, nor the end of a sentence.
        assert!(!text.contains(['{', '}', '_', '"']) && !text.contains("::") && !text.ends_with('.'), "{text}");
        let name = format!("{why:?}");
        let name = name.split([' ', '(', '{']).next().unwrap();
        assert!(!text.contains(name), "{text} shows {name}");
        let source: &dyn std::error::Error = &why;
        assert_eq!(source.to_string(), text);
    }
}
