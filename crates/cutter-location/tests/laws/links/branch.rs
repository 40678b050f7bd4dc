//! Every tested position is on the branch on which it is to be driven.

use facemill_cl_data::{ClPoint, RapidLaw};
use facemill_cutter_location::links::approach::{ApproachSettings, ApproachShape, PassEnd, PassEndPose, approach};
use facemill_cutter_location::links::link::{ClearanceSurface, LinkSettings, Linker, Waypoint};
use facemill_cutter_location::{Configuration, Hints, Infeasible, PoseTest};
use facemill_interference::{Interference, MeshTree};
use facemill_inverse_kinematics::machine_file::{Joint, RevoluteRange};
use facemill_inverse_kinematics::{Branch, Machine};
use facemill_tool_model::cl_from_cc;
use nalgebra::{Point3, Unit, Vector3};

use crate::kit::{
    Ball, Random, cc_on_plane, distance_at, machine, obstacle, plane, posture_deg, stand_on, tool, workcell,
};

const BRANCHES: [Branch; 2] = [Branch::Positive, Branch::Negative];
const CLEARANCE: f64 = 10.0;
/// Largest lack between two tested positions, mm.
const HALF_STEP: f64 = 0.5;

/// The preset with its ram beside the tool, so that the two branches hold it over different sides
/// of the part.
fn lopsided() -> Machine {
    let mut file = machine().to_file();
    let ram = &mut file.tool_chains[0].rows[2].bodies[0];
    assert_eq!(ram.name, "ram");
    ram.position_mm[0] = 400.0;
    Machine::from_file(file).unwrap()
}

/// The preset with the B axis limited.
fn with_b_limits(min: f64, max: f64) -> Machine {
    let mut file = machine().to_file();
    for row in &mut file.tool_chains[0].rows {
        if let Some(Joint::Revolute(b)) = &mut row.joint {
            b.range = RevoluteRange::Limited { min_deg: min, max_deg: max };
        }
    }
    Machine::from_file(file).unwrap()
}

fn pose(x: f64, y: f64, z: f64, axis: [f64; 3]) -> ClPoint {
    ClPoint { tip: Point3::new(x, y, z), axis: Unit::new_normalize(Vector3::from(axis)) }
}

fn trees(balls: &[Ball]) -> Vec<MeshTree> {
    balls.iter().map(|b| MeshTree::new(&b.mesh())).collect()
}

fn plane_settings(height: f64) -> LinkSettings {
    let clearance = ClearanceSurface::Plane { origin: Point3::new(0.0, 0.0, height), normal: Vector3::z_axis() };
    LinkSettings { clearance, rapid_clearance: CLEARANCE, rapid_law: RapidLaw::Linear.into() }
}

/// Poses of a whole link, ends included.
fn whole(from: Waypoint, way: &[Waypoint], to: Waypoint) -> Vec<Waypoint> {
    [&[from], way, &[to]].concat()
}

/// Returns the smallest distance over the straight moves of a link, each position on the branch of
/// the move's ends, and over its swings, all axes in proportion (the preset's rapid law).
fn smallest(test: &PoseTest<'_>, way: &[Waypoint], balls: &[Ball]) -> f64 {
    const N: usize = 600;
    let mut smallest = f64::INFINITY;
    for leg in way.windows(2) {
        let [a, b] = [leg[0], leg[1]];
        for k in 0..=N {
            let t = k as f64 / N as f64;
            let axes = if a.configuration.branch == b.configuration.branch {
                let tip = a.cl.tip + (b.cl.tip - a.cl.tip) * t;
                let cl = ClPoint { tip, axis: a.cl.axis.slerp(&b.cl.axis, t) };
                test.configuration_like(&cl, &a.configuration).unwrap().axes
            } else {
                a.configuration.axes.lerp(&b.configuration.axes, t)
            };
            smallest = smallest.min(distance_at(test.cell, &axes, balls));
        }
    }
    smallest
}

/// Returns the tip in a configuration.
fn tip_at(test: &PoseTest<'_>, w: &Waypoint) -> Point3<f64> {
    let cl = test.cell.machine.cl_point(&w.configuration.axes, test.cell.tool.gauge_length());
    cl.transformed(test.work_from_table()).tip
}

#[test]
fn a_pose_is_judged_on_the_requested_branch() {
    let (machine, tool) = (lopsided(), tool(16.0, 2.0, 20.0));
    let mut random = Random(31);
    let (mut free, mut differ) = (0, 0);
    for _ in 0..150 {
        let center = Point3::new(random.between(-600.0, 600.0), random.between(-600.0, 600.0), 0.0);
        let balls = [Ball { center: center + Vector3::z() * random.between(700.0, 1800.0), radius: 120.0 }];
        let trees = trees(&balls);
        let cell = workcell(&machine, &tool, vec![obstacle("ball", &trees[0] as &dyn Interference)]);
        let test = PoseTest::new(&cell);
        let cl = pose(0.0, 0.0, 0.0, [random.between(-0.5, 0.5), random.between(-0.5, 0.5), 1.0]);
        let verdicts = BRANCHES.map(|branch| {
            let axes = stand_on(&cell, &cl, branch).configuration.axes;
            assert_eq!(machine.branch_of(&axes), branch);
            let distance = distance_at(&cell, &axes, &balls);
            let near = Configuration { axes: machine.home(), branch };
            let found = test.try_pose(&cl, &near, &mut Hints::default());
            if distance.abs() > balls[0].chord_error() {
                assert_eq!(found.is_ok(), distance > 0.0, "{branch:?}: {distance}, {found:?}");
            }
            if let Ok(configuration) = found {
                assert_eq!(configuration.branch, branch);
                assert!((tip_at(&test, &Waypoint { cl, configuration }) - cl.tip).norm() < 1e-8);
                free += 1;
            }
            found.is_ok()
        });
        differ += usize::from(verdicts[0] != verdicts[1]);
    }
    assert!(free > 50 && differ > 20, "{free} free, {differ} differ");
}

#[test]
fn a_branch_beyond_the_limits_is_a_reason_and_never_exchanged_for_the_other() {
    let tool = tool(16.0, 2.0, 20.0);
    let leaning = pose(100.0, 50.0, 30.0, [0.3, 0.1, 1.0]);
    for (limits, missing) in [((0.0, 110.0), Branch::Negative), ((-110.0, 0.0), Branch::Positive)] {
        let machine = with_b_limits(limits.0, limits.1);
        let cell = workcell(&machine, &tool, vec![]);
        let test = PoseTest::new(&cell);
        let near = |branch| Configuration { axes: machine.home(), branch };
        let found = test.try_pose(&leaning, &near(missing), &mut Hints::default());
        assert_eq!(found, Err(Infeasible::OtherBranch(missing)));
        // The upright tool is at the border and belongs to both.
        let upright = pose(100.0, 50.0, 30.0, [0.0, 0.0, 1.0]);
        for branch in BRANCHES {
            assert!(test.try_pose(&upright, &near(branch), &mut Hints::default()).is_ok());
        }
    }
}

#[test]
fn links_stay_on_the_branch_of_their_ends_and_keep_the_clearance_there() {
    let (machine, tool) = (lopsided(), tool(16.0, 2.0, 20.0));
    let mut random = Random(32);
    let (mut judged, mut around) = (0, 0);
    for _ in 0..200 {
        let balls: Vec<Ball> = (0..3)
            .map(|k| {
                // One between the ends, the others as high as holder, head and ram.
                let (wide, low, high) = if k == 0 { (100.0, 0.0, 60.0) } else { (500.0, 600.0, 1300.0) };
                let mut random = |low, high| random.between(low, high);
                let center = Point3::new(random(-wide, wide), random(-wide, wide), random(low, high));
                Ball { center, radius: random(40.0, if k == 0 { 60.0 } else { 120.0 }) }
            })
            .collect();
        let trees = trees(&balls);
        let cell = workcell(&machine, &tool, trees.iter().map(|t| obstacle("ball", t as &dyn Interference)).collect());
        let test = PoseTest::new(&cell);
        let mut end = || {
            let axis = [random.between(0.1, 0.6), random.between(-0.3, 0.3), 1.0];
            pose(random.between(-250.0, 250.0), random.between(-250.0, 250.0), 40.0, axis)
        };
        let poses = [end(), end()];
        for branch in BRANCHES {
            let [from, to] = poses.map(|cl| stand_on(&cell, &cl, branch));
            if [from, to].iter().any(|w| distance_at(&cell, &w.configuration.axes, &balls) < CLEARANCE + 0.5) {
                continue;
            }
            let settings = plane_settings(700.0);
            let Ok(way) = Linker::new(&test, &settings).link(&from, &to) else { continue };
            assert!(way.iter().all(|w| w.configuration.branch == branch));
            assert!(way.iter().all(|w| machine.branch_of(&w.configuration.axes) == branch));
            let smallest = smallest(&test, &whole(from, &way, to), &balls);
            assert!(smallest >= CLEARANCE - HALF_STEP, "{branch:?}: {smallest}");
            judged += 1;
            around += usize::from(!way.is_empty());
        }
    }
    assert!(judged > 40 && around > 5, "{judged} judged, {around} not direct");
}

/// Two columns that the ram passes when the table turns half around under the tool, but not before
/// and after.
fn columns() -> Vec<Ball> {
    let column = |y: f64| (0..14).map(move |k| Point3::new(100.0, y, 900.0 + 150.0 * f64::from(k)));
    column(470.0).chain(column(-470.0)).map(|center| Ball { center, radius: 140.0 }).collect()
}

#[test]
fn a_link_to_the_other_branch_changes_over_above_the_clearance_surface() {
    let (machine, tool) = (lopsided(), tool(16.0, 2.0, 20.0));
    let low = [Ball { center: Point3::new(0.0, 0.0, -200.0), radius: 150.0 }];
    let trees = trees(&low);
    let cell = workcell(&machine, &tool, trees.iter().map(|t| obstacle("ball", t as &dyn Interference)).collect());
    let test = PoseTest::new(&cell);
    let (from, to) = (pose(-100.0, 0.0, 0.0, [0.3, 0.1, 1.0]), pose(150.0, 20.0, 10.0, [0.2, -0.1, 1.0]));
    let settings = plane_settings(150.0);
    for [first, second] in [BRANCHES, [Branch::Negative, Branch::Positive]] {
        let (from, to) = (stand_on(&cell, &from, first), stand_on(&cell, &to, second));
        let mut linker = Linker::new(&test, &settings);
        let all = whole(from, &linker.link(&from, &to).unwrap(), to);
        let branch = |k: usize| all[k].configuration.branch;
        let swings: Vec<usize> = (1..all.len()).filter(|&k| branch(k) != branch(k - 1)).collect();
        let [swing] = swings[..] else { panic!("{swings:?}") };
        for (k, w) in all.iter().enumerate() {
            let wanted = if k < swing { first } else { second };
            assert_eq!(machine.branch_of(&w.configuration.axes), wanted, "pose {k}, swing {swing}");
            assert!((tip_at(&test, w) - w.cl.tip).norm() < 1e-8);
        }
        assert_eq!(all[swing - 1].cl, all[swing].cl, "the tool stays where it is");
        assert!(settings.clearance.height(&all[swing].cl.tip) >= test.clearance_margin() - 1e-6);
        let [before, behind] = [swing - 1, swing].map(|k| all[k].configuration.axes);
        linker.rapid_block(&before, &behind, CLEARANCE).unwrap();
        let smallest = smallest(&test, &all, &low);
        assert!(smallest >= CLEARANCE - HALF_STEP, "{smallest}");
    }
}

#[test]
fn a_change_of_branch_that_is_blocked_is_reported_as_one() {
    let (machine, tool) = (lopsided(), tool(16.0, 2.0, 20.0));
    let balls = columns();
    let trees = trees(&balls);
    let cl = pose(0.0, 0.0, 0.0, [0.2, 0.0, 1.0]);
    let settings = plane_settings(100.0);
    let link = |obstacles| {
        let cell = workcell(&machine, &tool, obstacles);
        let test = PoseTest::new(&cell);
        let [from, to] = BRANCHES.map(|branch| stand_on(&cell, &cl, branch));
        let mut linker = Linker::new(&test, &settings);
        for end in [from, to] {
            // Both branches get out to the clearance surface.
            assert!(linker.way_out(&end).is_ok());
        }
        let way = whole(from, &linker.link(&from, &to).unwrap(), to);
        let changes = |w: &&[Waypoint]| w[0].configuration.branch != w[1].configuration.branch;
        let [a, b] = way.windows(2).find(changes).unwrap() else { panic!() };
        let swung = linker.rapid_block(&a.configuration.axes, &b.configuration.axes, CLEARANCE);
        swung.map_err(|blocked| test.describe(&blocked.why))
    };
    let blocked = link(trees.iter().map(|t| obstacle("column", t as &dyn Interference)).collect());
    assert_eq!(blocked.unwrap_err(), "ram hits column");
    assert!(link(vec![]).is_ok(), "without the columns it is free");
}

#[test]
fn entries_and_exits_are_on_the_branch_of_their_cut() {
    let part = MeshTree::new(&plane(600.0));
    let (machine, tool) = (lopsided(), tool(25.0, 2.0, 20.0));
    let cc = cc_on_plane(0.0, 0.0);
    let cl = cl_from_cc(tool.cutter(), &cc, posture_deg(8.0, 0.0));
    let arc = ApproachShape::TangentialArc { radius: 60.0, angle: 0.4 };
    let settings = ApproachSettings {
        shape: arc,
        step: 1.0,
        line_step: 1.0,
        bend: 0.0,
        test_step: 1.0,
        rapid_clearance: 5.0,
        max_retract: 200.0,
        straight: 0.0,
        still_across: None,
    };
    // Where the ram of one branch passes on the way out.
    let mut blocked_on = vec![];
    for beside in [[-400.0, 0.0], [400.0, 0.0]] {
        let ball = Ball { center: Point3::new(beside[0] - 30.0, beside[1], 1000.0), radius: 100.0 };
        let ball_tree = MeshTree::new(&ball.mesh());
        let cell = workcell(&machine, &tool, vec![obstacle("part", &part), obstacle("ball", &ball_tree)]);
        let test = PoseTest::new(&cell);
        for end in [PassEnd::Entry, PassEnd::Exit] {
            for branch in BRANCHES {
                let here = stand_on(&cell, &cl, branch);
                let at = PassEndPose { end, cc: &cc, cl: &cl, configuration: &here.configuration, uncut_left: true };
                match approach(&test, &settings, &at, &mut Hints::default()) {
                    Ok(found) => {
                        assert_eq!(found.outer.branch, branch);
                        for pose in &found.outward {
                            let axes = test.configuration_like(pose, &here.configuration).unwrap().axes;
                            assert_eq!(machine.branch_of(&axes), branch);
                            assert!(distance_at(&cell, &axes, &[ball]) > 0.0);
                        }
                    }
                    Err(why) => {
                        assert_eq!(test.describe(&why), "ram hits ball");
                        blocked_on.push(branch);
                    }
                }
            }
        }
    }
    assert!(BRANCHES.iter().all(|b| blocked_on.contains(b)) && blocked_on.len() == 4, "{blocked_on:?}");
}
