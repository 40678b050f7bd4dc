//! Bodies of bed and table that move against the workpiece, tested against tool and head.

use facemill_cl_data::{ClPoint, RapidLaw, Solid};
use facemill_cutter_location::links::link::{ClearanceSurface, LinkSettings, Linker};
use facemill_cutter_location::{Body, Hints, Infeasible, PoseTest};
use facemill_inverse_kinematics::machine_file::{BodyFile, ShapeFile};
use facemill_inverse_kinematics::{AxisValues, Carrier, Machine};
use facemill_tool_model::ToolAssembly;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::kit::{MOUNT, Random, machine, stand, tool, workcell};

/// The preset with a post on its bed 180 mm beside the workpiece's origin, `top` above
/// it.
pub(crate) fn with_post(top: f64) -> Machine {
    let mut file = machine().to_file();
    // Bed and table frame agree while C is at 0.
    file.bed_bodies = vec![BodyFile {
        name: "post".to_owned(),
        shape: ShapeFile::Cylinder { radius_mm: 60.0, height_mm: 600.0 },
        position_mm: [0.0, 180.0, MOUNT + top - 600.0],
        rotation_xyz_deg: [0.0; 3],
        clearance_mm: 5.0,
    }];
    Machine::from_file(file).unwrap()
}

/// Points all over a solid's surface and inside, its own frame.
fn points_of(solid: &Solid, random: &mut Random) -> Vec<Point3<f64>> {
    let bounds = solid.aabb();
    let mut points = Vec::new();
    while points.len() < 1500 {
        let mut at = |k: usize| random.between(bounds.min[k], bounds.max[k]);
        let p = Point3::new(at(0), at(1), at(2));
        if solid.core_distance(&p) <= solid.rounding() {
            points.push(p);
        }
    }
    points
}

/// Deepest that sampled points of tool and head are in the post, both dilated: an estimate from
/// outside the tests.
fn deepest(machine: &Machine, tool: &ToolAssembly, axes: &AxisValues, random: &mut Random) -> f64 {
    let length = tool.gauge_length();
    let table_from_tool = machine.forward(axes, length);
    let poses: Vec<_> = machine.body_poses(axes).collect();
    let post = poses.iter().find(|p| p.body.name() == "post").unwrap();
    let of_tool = tool.collision_bodies().into_iter().map(|b| (b.solid, table_from_tool * b.frame_from_solid));
    let of_head = poses.iter().filter(|p| p.body.carrier() == Some(Carrier::Head));
    let of_head = of_head.map(|p| (p.body.body.solid.clone(), p.table_from_solid));
    let bodies: Vec<(Solid, Isometry3<f64>)> = of_tool.chain(of_head).collect();
    let post_solid = &post.body.body.solid;
    let mut deepest = f64::NEG_INFINITY;
    for (solid, pose) in bodies {
        for p in points_of(&solid, random) {
            let in_post = post.table_from_solid.inverse_transform_point(&(pose * p));
            deepest = deepest.max(post_solid.rounding() - post_solid.core_distance(&in_post));
        }
    }
    deepest
}

#[test]
fn a_pose_that_a_post_on_the_bed_blocks_is_refused_wherever_the_table_is() {
    let (machine, tool) = (with_post(700.0), tool(16.0, 2.0, 20.0));
    let cell = workcell(&machine, &tool, vec![]);
    let test = PoseTest::new(&cell);
    let mut random = Random(41);
    let (mut free, mut hit) = (0, 0);
    for _ in 0..150 {
        let axis = [random.between(-0.7, 0.7), random.between(-0.7, 0.7), 1.0];
        let tip =
            Point3::new(random.between(-400.0, 400.0), random.between(-400.0, 400.0), random.between(150.0, 600.0));
        let cl = ClPoint { tip, axis: Unit::new_normalize(Vector3::from(axis)) };
        let here = stand(&cell, &cl).configuration;
        let deep = deepest(&machine, &tool, &here.axes, &mut random);
        match test.collision(&here.axes, &mut Hints::default()) {
            // Sampled points miss touches of less than their spacing, never the other way round.
            None => assert!(deep <= 1e-9, "{deep} mm deep: {cl:?}"),
            Some(why) => {
                assert!(matches!(why, Infeasible::Collision { obstacle: 0, .. }), "{why:?}");
                assert!(test.describe(&why).ends_with(" hits post"), "{}", test.describe(&why));
                hit += usize::from(deep > 0.0);
            }
        }
        free += usize::from(deep < -40.0);
        if deep < -40.0 {
            assert!(test.try_pose(&cl, &here, &mut Hints::default()).is_ok(), "{deep}");
        }
    }
    assert!(free > 20 && hit > 20, "{free} free, {hit} hit");
}

#[test]
fn clearances_of_head_and_post_are_both_kept_and_the_cutter_keeps_the_posts() {
    let tool = tool(16.0, 2.0, 20.0);
    // The head's lower side is the gauge length and the pivot's face above the tip; found by
    // lifting until it is free.
    let blocked = |top: f64, tip: Point3<f64>| {
        let machine = with_post(top);
        let cell = workcell(&machine, &tool, vec![]);
        let test = PoseTest::new(&cell);
        let here = stand(&cell, &ClPoint { tip, axis: Vector3::z_axis() }).configuration;
        match test.collision(&here.axes, &mut Hints::default()) {
            Some(Infeasible::Collision { body, .. }) => Some(body),
            _ => None,
        }
    };
    // The cutter right over the post: 5 mm is what the post keeps.
    let over = |gap: f64| Point3::new(0.0, 180.0, 400.0 + gap);
    assert_eq!(blocked(400.0, over(4.9)), Some(Body::Cutter));
    assert_eq!(blocked(400.0, over(5.1)), None);
    // The head beside the tool: the lowest top that blocks it, against its own lower side and both
    // clearances.
    let machine = machine();
    let tip = Point3::new(0.0, 0.0, 300.0);
    let cell = workcell(&machine, &tool, vec![]);
    let axes = stand(&cell, &ClPoint { tip, axis: Vector3::z_axis() }).configuration.axes;
    let lower = machine
        .body_poses(&axes)
        .filter(|p| p.body.carrier() == Some(Carrier::Head))
        .filter_map(|p| {
            let bounds = p.body.body.solid.aabb();
            let corners = (0..8).map(|k| {
                let pick = |i: usize| if k >> i & 1 == 0 { bounds.min[i] } else { bounds.max[i] };
                p.table_from_solid * Point3::new(pick(0), pick(1), pick(2))
            });
            let corners: Vec<_> = corners.collect();
            let reaches = corners.iter().any(|c| c.y > 125.0);
            reaches.then(|| corners.iter().map(|c| c.z - MOUNT).fold(f64::INFINITY, f64::min))
        })
        .fold(f64::INFINITY, f64::min);
    // `lower` is of the body dilated by its own clearance already.
    assert!(matches!(blocked(lower - 4.9, tip), Some(Body::Machine(_))));
    assert_eq!(blocked(lower - 5.1, tip), None);
}

#[test]
fn links_go_round_a_post_on_the_bed_and_keep_the_rapid_clearance() {
    let (machine, tool) = (with_post(500.0), tool(16.0, 2.0, 20.0));
    let cell = workcell(&machine, &tool, vec![]);
    let test = PoseTest::new(&cell);
    let clearance = ClearanceSurface::Plane { origin: Point3::new(0.0, 0.0, 700.0), normal: Vector3::z_axis() };
    let settings = LinkSettings { clearance, rapid_clearance: 10.0, rapid_law: RapidLaw::Linear.into() };
    let mut random = Random(42);
    let mut judged = 0;
    for _ in 0..40 {
        let mut end = |x: f64| {
            let axis = [random.between(-0.5, 0.5), random.between(-0.5, 0.5), 1.0];
            let tip = Point3::new(x, random.between(100.0, 300.0), 200.0);
            stand(&cell, &ClPoint { tip, axis: Unit::new_normalize(Vector3::from(axis)) })
        };
        let (from, to) = (end(-300.0), end(300.0));
        let Ok(way) = Linker::new(&test, &settings).link(&from, &to) else { continue };
        judged += 1;
        let all = [&[from], way.as_slice(), &[to]].concat();
        for leg in all.windows(2) {
            for k in 0..=300 {
                let t = f64::from(k) / 300.0;
                let pose = ClPoint {
                    tip: leg[0].cl.tip + (leg[1].cl.tip - leg[0].cl.tip) * t,
                    axis: leg[0].cl.axis.slerp(&leg[1].cl.axis, t),
                };
                let axes = test.configuration_like(&pose, &leg[0].configuration).unwrap().axes;
                let (distance, nearest) = test.rapid_distance(&axes, 100.0, &mut Hints::default());
                assert!(distance >= settings.rapid_clearance - 0.5, "{distance} {nearest:?}");
            }
        }
    }
    assert!(judged > 10, "{judged}");
}
