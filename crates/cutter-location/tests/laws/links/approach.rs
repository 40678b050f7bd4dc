use std::f64::consts::{FRAC_PI_2, FRAC_PI_3};

use facemill_cl_data::{CcPoint, ClPoint};
use facemill_cutter_location::links::approach::{
    Approach, ApproachSettings, ApproachShape, PassEnd, PassEndPose, approach, arc_poses,
};
use facemill_cutter_location::{Hints, Infeasible, Obstacle, PoseTest, Workcell};
use facemill_interference::MeshTree;
use facemill_tool_model::{ToolAssembly, cl_from_cc};
use nalgebra::{Point3, Unit, Vector3};

use crate::kit::{
    Ball, Random, cc_on_plane, distance_to_balls, machine, obstacle, plane, posture_deg, smallest_distance, stand,
    tool, workcell,
};

const ENDS: [PassEnd; 2] = [PassEnd::Entry, PassEnd::Exit];

fn shapes(radius: f64, angle: f64) -> [ApproachShape; 2] {
    [ApproachShape::TangentialArc { radius, angle }, ApproachShape::RollIn { radius, angle }]
}

fn random_cc(random: &mut Random) -> (CcPoint, ClPoint) {
    let cc = CcPoint::new(Point3::from(random.vector(1.0) * 100.0), random.vector(1.0), random.vector(1.0)).unwrap();
    let axis = Unit::new_normalize(cc.normal.into_inner() + 0.3 * random.vector(1.0));
    (cc, ClPoint { tip: cc.position, axis })
}

#[test]
fn arcs_leave_the_pass_along_its_feed() {
    let mut random = Random(1);
    for _ in 0..50 {
        let (cc, cl) = random_cc(&mut random);
        for shape in shapes(40.0, FRAC_PI_3) {
            for end in ENDS {
                let sign = if end == PassEnd::Entry { -1.0 } else { 1.0 };
                for step in [1.0, 0.1, 0.01] {
                    let first = arc_poses(shape, end, &cc, &cl, true, step)[0];
                    let direction = (first.tip - cl.tip).normalize();
                    // A chord of an arc leaves the tangent by half its angle.
                    let off = (direction - cc.feed.into_inner() * sign).norm();
                    assert!(off < 0.51 * step / 40.0 * 1.01, "{shape:?} {end:?} {step}: {off}");
                }
            }
        }
    }
}

#[test]
fn arcs_keep_axis_radius_angle_and_step() {
    let mut random = Random(2);
    for _ in 0..50 {
        let (cc, cl) = random_cc(&mut random);
        let (radius, angle) = (random.between(5.0, 80.0), random.between(0.2, FRAC_PI_2));
        let step = random.between(0.3, 5.0);
        for shape in shapes(radius, angle) {
            for end in ENDS {
                let poses = arc_poses(shape, end, &cc, &cl, random.between(0.0, 1.0) < 0.5, step);
                let mut before = cl;
                for pose in &poses {
                    assert_eq!(pose.axis, cl.axis);
                    assert!((pose.tip - before.tip).norm() <= step + 1e-9, "{shape:?}, step {step}");
                    before = *pose;
                }
                let along = (before.tip - cl.tip).dot(&cc.feed).abs();
                assert!((along - radius * angle.sin()).abs() < 1e-9);
                let aside = (before.tip - cl.tip) - cc.feed.into_inner() * (before.tip - cl.tip).dot(&cc.feed);
                let bent = radius * (1.0 - angle.cos());
                match shape {
                    ApproachShape::TangentialArc { .. }
                    | ApproachShape::Ramp { .. }
                    | ApproachShape::Shortest { .. } => {
                        assert!((aside - cc.normal.into_inner() * bent).norm() < 1e-9);
                    }
                    ApproachShape::RollIn { .. } => {
                        assert!((aside.dot(&cc.left()).abs() - bent).abs() < 1e-9);
                    }
                    other => panic!("{other:?} has no law here"),
                }
            }
        }
    }
}

#[test]
fn a_ramp_continues_its_arc_along_the_tangent_up_to_its_height() {
    let mut random = Random(7);
    for _ in 0..100 {
        let (cc, cl) = random_cc(&mut random);
        let radius = if random.between(0.0, 1.0) < 0.3 { 0.0 } else { random.between(1.0, 80.0) };
        let (angle, height) = (random.between(0.01, 0.6), random.between(0.1, 5.0));
        let step = random.between(0.3, 5.0);
        let rise_of_arc = radius * (1.0 - angle.cos());
        for end in ENDS {
            let out = cc.feed.into_inner() * if end == PassEnd::Entry { -1.0 } else { 1.0 };
            let poses = arc_poses(ApproachShape::Ramp { radius, angle, height }, end, &cc, &cl, true, step);
            let mut before = cl;
            for pose in &poses {
                let leg = pose.tip - before.tip;
                assert!(leg.norm() <= step + 1e-9 && pose.axis == cl.axis);
                let slope = leg.dot(&cc.normal).atan2(leg.dot(&out));
                assert!(leg.norm() > 0.0 && (-1e-9..=angle + 1e-9).contains(&slope), "{slope} {angle}");
                if (before.tip - cl.tip).dot(&cc.normal) > rise_of_arc + 1e-9 {
                    assert!((slope - angle).abs() < 1e-9);
                }
                before = *pose;
            }
            let way = before.tip - cl.tip;
            assert!((way.dot(&cc.normal) - height.max(rise_of_arc)).abs() < 1e-9);
            assert!(way.dot(&cc.left()).abs() < 1e-9);
        }
    }
}

#[test]
fn a_roll_in_comes_from_the_finished_side_and_from_above() {
    let mut random = Random(3);
    for _ in 0..50 {
        let (cc, cl) = random_cc(&mut random);
        for (uncut_left, side) in [(true, -1.0), (false, 1.0)] {
            for end in ENDS {
                let shape = ApproachShape::RollIn { radius: 30.0, angle: FRAC_PI_3 };
                let mut height = 0.0;
                for pose in arc_poses(shape, end, &cc, &cl, uncut_left, 1.0) {
                    let way = pose.tip - cl.tip;
                    assert!(side * way.dot(&cc.left()) > 0.0);
                    assert!(way.dot(&cc.normal) > height);
                    height = way.dot(&cc.normal);
                }
            }
        }
    }
}

/// Returns the lowest height of the cutter over z = 0: that of the lower rim of the circle of
/// corner centres, minus r.
fn height_over_plane(tool: &ToolAssembly, cl: &ClPoint) -> f64 {
    let cutter = tool.cutter();
    let r = cutter.corner_radius();
    let sin = (1.0 - cl.axis.z * cl.axis.z).max(0.0).sqrt();
    cl.tip.z + r * cl.axis.z - (cutter.radius() - r) * sin - r
}

/// The plane with stock of a thickness on it.
fn with_stock<'a>(mesh: &'a MeshTree, thickness: f64) -> Obstacle<'a> {
    Obstacle { collision_allowance: thickness, ..obstacle("part", mesh) }
}

fn settings(shape: ApproachShape) -> ApproachSettings {
    ApproachSettings {
        shape,
        straight: 0.0,
        bend: 0.0,
        step: 1.0,
        line_step: 1.0,
        test_step: 1.0,
        rapid_clearance: 5.0,
        max_retract: 200.0,
        still_across: None,
    }
}

fn approach_from(
    cell: &Workcell<'_>,
    shape: ApproachShape,
    end: PassEnd,
    cc: &CcPoint,
    cl: &ClPoint,
) -> Result<Approach, Infeasible> {
    let configuration = stand(cell, cl).configuration;
    let at = PassEndPose { end, cc, cl, configuration: &configuration, uncut_left: true };
    approach(&PoseTest::new(cell), &settings(shape), &at, &mut Hints::default())
}

fn approach_on_plane(
    cell: &Workcell<'_>,
    shape: ApproachShape,
    end: PassEnd,
    tilt_deg: f64,
) -> Result<Approach, Infeasible> {
    let cc = cc_on_plane(0.0, 0.0);
    let cl = cl_from_cc(cell.tool.cutter(), &cc, posture_deg(tilt_deg, 0.0));
    approach_from(cell, shape, end, &cc, &cl)
}

#[test]
fn both_ends_of_a_pass_are_clear_by_the_rapid_clearance() {
    let tree = MeshTree::new(&plane(600.0));
    let machine = machine();
    for (radius, corner) in [(25.0, 2.0), (16.0, 16.0), (40.0, 0.0)] {
        let tool = tool(radius, corner, 20.0);
        for stock in [0.0, 0.1] {
            let cell = workcell(&machine, &tool, vec![with_stock(&tree, stock)]);
            for shape in shapes(30.0, 0.4) {
                for end in ENDS {
                    let outward = approach_on_plane(&cell, shape, end, 5.0).unwrap().outward;
                    let clear = height_over_plane(&tool, outward.last().unwrap()) - stock;
                    let enough = 5.0 - 1e-6;
                    // At most one step farther than needed.
                    assert!((enough..enough + 1.01).contains(&clear), "{shape:?} {end:?}: {clear}");
                    for pose in &outward {
                        assert!(height_over_plane(&tool, pose) > 0.0);
                    }
                    let arc = arc_poses(shape, end, &cc_on_plane(0.0, 0.0), &outward[0], true, 1.0).len();
                    assert!(outward.len() <= arc + 1, "of the retract only the end is kept");
                }
            }
        }
    }
}

/// Returns how steeply a leg descends against the bottom of the cutter.
fn ramp(from: &ClPoint, to: &ClPoint) -> f64 {
    let way = to.tip - from.tip;
    (-way.dot(&to.axis) / way.norm()).asin()
}

#[test]
fn an_entry_goes_into_stock_no_more_steeply_than_the_tool_may() {
    let tree = MeshTree::new(&plane(600.0));
    let machine = machine();
    let tool = tool(25.0, 2.0, 20.0);
    let cc = cc_on_plane(0.0, 0.0);
    let cl = cl_from_cc(tool.cutter(), &cc, posture_deg(2.0, 0.0));
    // An arc of radius 16 rises by 1 mm where it is steep by 20.4°, and by 8 mm in all: through
    // thin stock it goes as an arc, through thicker stock as a ramp, and not through more than 8
    // mm.
    let arc = ApproachShape::TangentialArc { radius: 16.0, angle: FRAC_PI_3 };
    let (mut refused, mut taken) = (0, 0);
    for fifths in 0..60 {
        let stock = 0.2 * f64::from(fifths);
        let cell = workcell(&machine, &tool, vec![with_stock(&tree, stock)]);
        match approach_on_plane(&cell, arc, PassEnd::Entry, 2.0) {
            Ok(approach) => {
                let mut inner = cl;
                for outer in &approach.outward {
                    if height_over_plane(&tool, &inner) < stock {
                        let steep = ramp(outer, &inner);
                        assert!(steep <= tool.max_ramp_angle() + 1.1e-3, "{} deg", steep.to_degrees());
                    }
                    inner = *outer;
                }
                taken += 1;
            }
            Err(why) => {
                let Infeasible::Ramp { angle } = why else { panic!("{why:?}") };
                assert!(angle > tool.max_ramp_angle());
                let text = PoseTest::new(&cell).describe(&why);
                assert_eq!(text, format!("ramp of {:.2} deg into stock", angle.to_degrees()));
                refused += 1;
                // The same way out is no ramp.
                assert!(approach_on_plane(&cell, arc, PassEnd::Exit, 2.0).is_ok());
            }
        }
    }
    assert!(refused > 10 && taken > 30, "{refused} refused, {taken} taken");
}

#[test]
fn an_exit_follows_the_surface_down_into_stock_no_more_steeply_than_the_tool_may() {
    let machine = machine();
    let tool = tool(16.0, 16.0, 20.0);
    let ball = Ball { center: Point3::origin(), radius: 100.0 };
    let tree = MeshTree::new(&ball.mesh());
    let cc = CcPoint::new(Point3::new(0.0, 0.0, 100.0), Vector3::z(), Vector3::x()).unwrap();
    let cl = ClPoint { tip: cc.position, axis: cc.normal };
    // Beyond the end the line turns by 10/116 rad with the ball: 4.9°, of which 3° are permitted.
    let shape = ApproachShape::Shortest { radius: 60.0, angle: 0.4 };
    let settings = ApproachSettings { straight: 10.0, bend: 1.0 / 116.0, ..settings(shape) };
    let steepest = |stock: f64| {
        let cell = workcell(&machine, &tool, vec![with_stock(&tree, stock)]);
        let configuration = stand(&cell, &cl).configuration;
        let at = PassEndPose { end: PassEnd::Exit, cc: &cc, cl: &cl, configuration: &configuration, uncut_left: true };
        let found = approach(&PoseTest::new(&cell), &settings, &at, &mut Hints::default()).unwrap();
        let line = [&[cl], &found.outward[..found.on_line]].concat();
        line.windows(2).map(|w| ramp(&w[0], &w[1])).fold(0.0, f64::max)
    };
    let (free, in_stock) = (steepest(0.0), steepest(5.0));
    assert!(free > 0.075, "nothing to hold back: {free}");
    // Half as bent: it still follows.
    assert!((0.03..=tool.max_ramp_angle() + 1.1e-3).contains(&in_stock), "{in_stock}");
}

#[test]
fn a_smaller_arc_of_the_same_angle_is_taken_where_something_is_behind() {
    let tree = MeshTree::new(&plane(600.0));
    let machine = machine();
    let tool = tool(25.0, 2.0, 20.0);
    let arc = ApproachShape::TangentialArc { radius: 80.0, angle: 0.5 };
    let cc = cc_on_plane(0.0, 0.0);
    let cl = cl_from_cc(tool.cutter(), &cc, posture_deg(5.0, 0.0));
    let mut reaches = vec![];
    for behind in [300.0, 100.0, 80.0, 71.0, 60.0] {
        let post = Ball { center: Point3::new(-behind, 0.0, 10.0), radius: 10.0 };
        let post_tree = MeshTree::new(&post.mesh());
        let cell = workcell(&machine, &tool, vec![obstacle("part", &tree), obstacle("post", &post_tree)]);
        match approach_on_plane(&cell, arc, PassEnd::Entry, 5.0) {
            Ok(found) => {
                // The end of the arc is as far back as its radius times the sine of its angle.
                let reach = found.outward.iter().map(|p| cl.tip.x - p.tip.x).fold(0.0, f64::max);
                let share = reach / (80.0 * 0.5f64.sin());
                assert!([1.0, 0.5, 0.25, 0.125].iter().any(|s| (share - s).abs() < 1e-9), "{share}");
                let touching = found.outward.iter().map(|p| distance_to_balls(&cell, p, &[post]));
                assert!(touching.fold(f64::INFINITY, f64::min) > -cell.gouge_tolerance - post.chord_error());
                let end = distance_to_balls(&cell, found.outward.last().unwrap(), &[post]);
                assert!(end >= 5.0 - 1e-6 - post.chord_error());
                reaches.push(share);
            }
            Err(why) => {
                assert!(matches!(why, Infeasible::Gouge { obstacle: 1, .. }), "{why:?}");
                reaches.push(0.0);
            }
        }
    }
    assert!(reaches.is_sorted_by(|a, b| a >= b), "{reaches:?}");
    assert!(reaches[0] == reaches[0].max(0.999) && reaches.iter().any(|s| *s < 0.6), "{reaches:?}");
}

/// An entry or exit on the plane with a straight line before its arc.
fn with_line(cell: &Workcell<'_>, line: &ApproachSettings, end: PassEnd) -> Result<Approach, Infeasible> {
    let cc = cc_on_plane(0.0, 0.0);
    let cl = cl_from_cc(cell.tool.cutter(), &cc, posture_deg(5.0, 0.0));
    let configuration = stand(cell, &cl).configuration;
    let at = PassEndPose { end, cc: &cc, cl: &cl, configuration: &configuration, uncut_left: true };
    approach(&PoseTest::new(cell), line, &at, &mut Hints::default())
}

#[test]
fn an_arc_begins_at_the_end_of_the_straight_line_along_the_feed() {
    let tree = MeshTree::new(&plane(600.0));
    let machine = machine();
    let tool = tool(25.0, 2.0, 20.0);
    let cell = workcell(&machine, &tool, vec![with_stock(&tree, 0.0)]);
    for shape in shapes(30.0, 0.4) {
        for end in ENDS {
            let usual = settings(shape);
            let alone = with_line(&cell, &usual, end).unwrap().outward;
            for straight in [0.3, 7.0, 12.5] {
                let found = with_line(&cell, &ApproachSettings { straight, ..usual }, end).unwrap().outward;
                let n = straight.ceil() as usize;
                let cl = cl_from_cc(tool.cutter(), &cc_on_plane(0.0, 0.0), posture_deg(5.0, 0.0));
                let along = cc_on_plane(0.0, 0.0).feed.into_inner() * if end == PassEnd::Entry { -1.0 } else { 1.0 };
                for (k, pose) in found[..n].iter().enumerate() {
                    let way = along * (straight * (k + 1) as f64 / n as f64);
                    assert!((pose.tip - cl.tip - way).norm() < 1e-9 && pose.axis == cl.axis);
                }
                assert_eq!(found.len(), n + alone.len());
                for (pose, of_arc) in found[n..].iter().zip(&alone) {
                    assert!((pose.tip - of_arc.tip - along * straight).norm() < 1e-9);
                }
            }
        }
    }
}

#[test]
fn the_straight_line_is_shortened_or_left_out_where_it_gouges_and_the_arc_does_not() {
    let machine = machine();
    let tool = tool(25.0, 2.0, 20.0);
    let tree = MeshTree::new(&plane(600.0));
    let usual = settings(ApproachShape::TangentialArc { radius: 60.0, angle: 0.6 });
    let line = ApproachSettings { straight: 40.0, ..usual };
    let (mut without, mut shorter) = (0, 0);
    for ahead in [9.0, 14.0, 20.0, 40.0, 60.0] {
        for height in [0.2, 0.5, 1.0, 2.0, 4.0] {
            // A bump that the line runs into.
            let post = Ball { center: Point3::new(ahead, 0.0, height - 10.0), radius: 10.0 };
            let post_tree = MeshTree::new(&post.mesh());
            let cell = workcell(&machine, &tool, vec![obstacle("part", &tree), obstacle("post", &post_tree)]);
            let of_arc = with_line(&cell, &usual, PassEnd::Exit);
            let of_line = with_line(&cell, &line, PassEnd::Exit);
            assert!(of_line.is_ok() || of_arc.is_err(), "{ahead} {height}");
            let Ok(found) = &of_line else { continue };
            for pose in &found.outward {
                let distance = distance_to_balls(&cell, pose, &[post]);
                assert!(distance > -cell.gouge_tolerance - post.chord_error(), "{ahead} {height}: {distance}");
            }
            without += usize::from(of_line == of_arc);
            shorter += usize::from(of_line != of_arc && found.outward[39].tip.z > found.outward[0].tip.z + 1.0);
        }
    }
    assert!(without > 2 && shorter > 2, "{without} {shorter}");
}

#[test]
fn a_lid_over_the_pass_blocks_the_retract_and_is_named() {
    let tree = MeshTree::new(&plane(600.0));
    let machine = machine();
    let tool = tool(25.0, 2.0, 20.0);
    // Above the cutter's rim, beside its body: the pass is free, the way up is not.
    let lid = Ball { center: Point3::new(-23.0, 22.5, 30.0), radius: 1.5 };
    let lid_tree = MeshTree::new(&lid.mesh());
    let cell = workcell(&machine, &tool, vec![with_stock(&tree, 0.0), obstacle("lid", &lid_tree)]);
    let test = PoseTest::new(&cell);
    let cc = cc_on_plane(0.0, 0.0);
    assert!(test.try_posture(&cc, posture_deg(0.0, 0.0), None, &mut Hints::default()).is_ok());
    let cl = cl_from_cc(tool.cutter(), &cc, posture_deg(0.0, 0.0));
    let arc = ApproachShape::TangentialArc { radius: 1.0, angle: 0.1 };
    let found = approach_from(&cell, arc, PassEnd::Exit, &cc, &cl);
    let why = found.unwrap_err();
    assert_eq!(test.describe(&why), "cutter gouges lid");
    let Infeasible::Gouge { place, .. } = why else { panic!() };
    assert!((place - lid.center).norm() <= lid.radius + 1e-9 && Vector3::z().dot(&(place - lid.center)) < 0.5);
}

#[test]
fn obstacles_between_the_poses_of_an_arc_are_seen() {
    let tree = MeshTree::new(&plane(900.0));
    let machine = machine();
    let tool = tool(25.0, 2.0, 20.0);
    let cc = cc_on_plane(0.0, 0.0);
    let cl = cl_from_cc(tool.cutter(), &cc, posture_deg(1.0, 0.0));
    let shape = ApproachShape::TangentialArc { radius: 1000.0, angle: 0.2 };
    // Poses farther apart than the cutter is wide.
    let settings = ApproachSettings { step: 80.0, ..settings(shape) };
    let poses = arc_poses(shape, PassEnd::Exit, &cc, &cl, true, settings.step);
    assert_eq!(poses.len(), 3);
    let middle = 0.5 * (poses[0].tip.x + poses[1].tip.x);
    let mut changed = 0;
    for y in [0.0, 15.0, -22.0] {
        let pin = Ball { center: Point3::new(middle, y, 8.0), radius: 3.0 };
        let pin_tree = MeshTree::new(&pin.mesh());
        let cell = workcell(&machine, &tool, vec![obstacle("part", &tree), obstacle("pin", &pin_tree)]);
        assert!(poses.iter().all(|p| distance_to_balls(&cell, p, &[pin]) > 0.0), "the poses themselves are free");
        let configuration = stand(&cell, &cl).configuration;
        let at = PassEndPose { end: PassEnd::Exit, cc: &cc, cl: &cl, configuration: &configuration, uncut_left: true };
        let found = approach(&PoseTest::new(&cell), &settings, &at, &mut Hints::default()).unwrap();
        let whole: Vec<ClPoint> = std::iter::once(cl).chain(found.outward.iter().copied()).collect();
        let smallest = smallest_distance(&cell, &whole, 400, &[pin]);
        assert!(smallest > -cell.gouge_tolerance - pin.chord_error(), "{smallest}");
        changed += usize::from(found.outward[0] != poses[0]);
    }
    assert_eq!(changed, 3, "a smaller arc is taken");
}

#[test]
fn meaningless_settings_end_in_an_answer() {
    let tree = MeshTree::new(&plane(600.0));
    let machine = machine();
    let tool = tool(25.0, 2.0, 20.0);
    let cell = workcell(&machine, &tool, vec![with_stock(&tree, 0.0)]);
    let cc = cc_on_plane(0.0, 0.0);
    let cl = cl_from_cc(tool.cutter(), &cc, posture_deg(5.0, 0.0));
    let configuration = stand(&cell, &cl).configuration;
    for odd in [0.0, 1e-300, 1e300, f64::INFINITY, f64::NAN, -1.0] {
        let usual = settings(ApproachShape::TangentialArc { radius: 30.0, angle: 0.4 });
        for settings in [
            ApproachSettings { step: odd, ..usual },
            ApproachSettings { straight: odd, ..usual },
            ApproachSettings { test_step: odd, ..usual },
            ApproachSettings { max_retract: odd, ..usual },
            ApproachSettings { rapid_clearance: odd, max_retract: 1e300, ..usual },
            ApproachSettings { shape: ApproachShape::RollIn { radius: odd, angle: 0.4 }, ..usual },
        ] {
            let at =
                PassEndPose { end: PassEnd::Exit, cc: &cc, cl: &cl, configuration: &configuration, uncut_left: true };
            if let Ok(found) = approach(&PoseTest::new(&cell), &settings, &at, &mut Hints::default()) {
                for pose in found.outward {
                    assert!(pose.tip.coords.iter().all(|x| x.abs() < 1e4), "{settings:?}: {pose:?}");
                    assert!(height_over_plane(&tool, &pose) > -cell.gouge_tolerance);
                }
            }
        }
    }
}

/// Returns the length of a way outward from a pose.
fn way_length(from: &ClPoint, outward: &[ClPoint]) -> f64 {
    let tips: Vec<_> = std::iter::once(from.tip).chain(outward.iter().map(|cl| cl.tip)).collect();
    tips.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

#[test]
fn the_shortest_way_is_never_longer_than_the_arc_and_enters_no_steeper_than_the_tool_may() {
    let tree = MeshTree::new(&plane(600.0));
    let machine = machine();
    let tool = tool(25.0, 2.0, 20.0);
    let cl = cl_from_cc(tool.cutter(), &cc_on_plane(0.0, 0.0), posture_deg(5.0, 0.0));
    let mut shorter = 0;
    for (radius, angle) in [(30.0, 0.4), (120.0, 0.2), (400.0, 0.14)] {
        for stock in [0.0, 0.3, 1.0] {
            let cell = workcell(&machine, &tool, vec![with_stock(&tree, stock)]);
            for end in ENDS {
                let way = |shape| approach_on_plane(&cell, shape, end, 5.0).map(|found| found.outward);
                let arc = way(ApproachShape::TangentialArc { radius, angle });
                let shortest = way(ApproachShape::Shortest { radius, angle });
                assert!(shortest.is_ok() || arc.is_err(), "{radius} {angle} {stock} {end:?}: {shortest:?}");
                let (Ok(arc), Ok(shortest)) = (arc, shortest) else { continue };
                let [of_arc, of_shortest] = [&arc, &shortest].map(|way| way_length(&cl, way));
                // The retract from a low end is longer, by at most the arc's height and a step.
                let height = radius * (1.0 - f64::cos(angle));
                assert!(of_shortest <= of_arc + height + 1.0, "{radius} {angle} {stock} {end:?}");
                shorter += usize::from(of_shortest < 0.7 * of_arc);
                let inward = shortest.iter().rev().chain([&cl]).collect::<Vec<_>>();
                for leg in inward.windows(2).filter(|_| end == PassEnd::Entry && stock > 0.0) {
                    let in_stock = height_over_plane(&tool, leg[1]) < stock - 1e-9;
                    assert!(!in_stock || ramp(leg[0], leg[1]) <= tool.max_ramp_angle() + 2e-3, "{radius} {stock}");
                }
            }
        }
    }
    assert!(shorter >= 9, "{shorter} of 18 are shorter");
}

#[test]
fn a_bent_line_follows_a_circle_through_the_end_of_the_pass_and_the_arc_goes_on_from_it() {
    let tree = MeshTree::new(&plane(600.0));
    let machine = machine();
    let tool = tool(25.0, 2.0, 20.0);
    let cell = workcell(&machine, &tool, vec![with_stock(&tree, 0.0)]);
    let cc = cc_on_plane(0.0, 0.0);
    let cl = cl_from_cc(tool.cutter(), &cc, posture_deg(5.0, 0.0));
    let shape = ApproachShape::TangentialArc { radius: 60.0, angle: 0.3 };
    for end in ENDS {
        // Concave: the plane lies below all of it.
        let bent = ApproachSettings { straight: 20.0, bend: -1.0 / 400.0, line_step: 2.0, ..settings(shape) };
        let found = with_line(&cell, &bent, end).unwrap().outward;
        let center = cl.tip + cc.normal.into_inner() * 400.0;
        for pose in &found[..10] {
            assert!(((pose.tip - center).norm() - 400.0).abs() < 1e-9 && pose.axis == cl.axis);
        }
        let (line, arc) = (found[9].tip - found[8].tip, found[10].tip - found[9].tip);
        assert!(line.angle(&arc) < 0.02, "no corner between line and arc: {}", line.angle(&arc));
    }
}

/// Returns whether the flute above the corner is in a ball at a pose: from the cylinder itself.
fn flute_is_in(tool: &ToolAssembly, cl: &ClPoint, ball: &Ball) -> bool {
    let cutter = tool.cutter();
    let way = ball.center - cl.tip;
    let height = way.dot(&cl.axis);
    let beyond = (way - cl.axis.into_inner() * height).norm() - cutter.radius();
    let above = (height - cutter.flute_length()).max(cutter.corner_radius() - height);
    beyond.max(0.0).hypot(above.max(0.0)) < ball.radius - ball.chord_error()
}

#[test]
fn an_entry_does_not_plunge_through_stock_between_two_free_places() {
    let tree = MeshTree::new(&plane(600.0));
    let machine = machine();
    let tool = tool(25.0, 2.0, 20.0);
    let cc = cc_on_plane(0.0, 0.0);
    let cl = cl_from_cc(tool.cutter(), &cc, posture_deg(0.0, 0.0));
    let mut random = Random(22);
    let (mut plunging, mut taken) = (0, 0);
    for _ in 0..40 {
        // Stock beside the tool's body, above the flute: free below it, and free far above it.
        let (angle, height) = (random.between(0.0, std::f64::consts::TAU), random.between(23.0, 34.0));
        let center = cl.tip + Vector3::new(22.5 * angle.cos(), 22.5 * angle.sin(), height);
        let ball = Ball { center, radius: random.between(0.3, 1.5) };
        let ball_tree = MeshTree::new(&ball.mesh());
        let stock = Obstacle { gouge_allowance: None, ..obstacle("stock", &ball_tree) };
        let cell = workcell(&machine, &tool, vec![with_stock(&tree, 0.0), stock]);
        let [low, high] = [0.0, 80.0].map(|up| cl.translated(Vector3::z() * up));
        assert!([low, high].iter().all(|end| !flute_is_in(&tool, end, &ball)));
        let arc = ApproachShape::TangentialArc { radius: 1.0, angle: 0.1 };
        match approach_from(&cell, arc, PassEnd::Entry, &cc, &cl) {
            Ok(found) => {
                let mut inner = cl;
                for outer in &found.outward {
                    let at = |k: u32| outer.translated((inner.tip - outer.tip) * (f64::from(k) / 1_000.0));
                    let is_cut = (0..=1_000).any(|k| flute_is_in(&tool, &at(k), &ball));
                    assert!(!is_cut || ramp(outer, &inner) <= tool.max_ramp_angle() + 1.1e-3, "{ball:?}");
                    inner = *outer;
                }
                taken += 1;
            }
            Err(Infeasible::Ramp { angle }) => {
                assert!(angle > 89_f64.to_radians(), "{angle}");
                plunging += 1;
            }
            Err(why) => panic!("{why:?}"),
        }
    }
    assert!(plunging >= 10, "{plunging} plunge, {taken} do not");
}
