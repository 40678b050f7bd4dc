//! Bodies of the machine that get in the way of tool, head and work, and twins that do not.

use crate::kit::{HEAD, Shop, Text, box_mesh, only};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::machine_file::{
    BodyFile, DhRow, Joint, RevoluteJoint, RevoluteRange, Sense, ShapeFile,
};
use facemill_inverse_kinematics::*;
use facemill_virtual_machine::{Finding, FindingKind, Measure, Verification};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

fn body(name: &str, shape: ShapeFile, position_mm: [f64; 3], clearance_mm: f64) -> BodyFile {
    BodyFile { name: name.to_owned(), shape, position_mm, rotation_xyz_deg: [0.0; 3], clearance_mm }
}

/// The one fault; near misses on its way are none.
fn only_fault(v: &Verification) -> &Finding {
    let faults: Vec<_> = v.faults().collect();
    assert_eq!(faults.len(), 1, "{faults:#?}");
    faults[0]
}

/// The preset with a post on its bed, 180 mm beside the middle of the plate, `top` above the plate.
fn with_post(top: f64) -> Shop {
    let foot = Shop::new().table_from_work * Point3::new(0.0, 180.0, 0.0);
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    let shape = ShapeFile::Cylinder { radius_mm: 60.0, height_mm: 600.0 };
    // Bed and table frame agree while C is at 0.
    file.bed_bodies = vec![body("post", shape, [foot.x, foot.y, foot.z + top - 600.0], 5.0)];
    Shop::with_machine(Machine::from_file(file).unwrap())
}

/// Past the post at tip height 300: the head's lower side, 370 mm above the tip, passes over the
/// post's top.
fn past_the_post(shop: &Shop) -> Verification {
    // Without the plate and the wall: the post is in the way of the head alone.
    let mut setup = shop.setup();
    setup.obstacles.clear();
    Text::new(shop).rapid([-400.0, 0.0, 300.0]).cut([400.0, 0.0, 300.0]).verify_in(&setup)
}

#[test]
fn post_on_the_bed_in_the_way_of_the_head_is_found_and_a_lower_one_is_not() {
    let v = past_the_post(&with_post(700.0));
    let f = only_fault(&v);
    assert_eq!((f.kind, f.worst_line), (FindingKind::Collision, HEAD + 2), "{f}");
    assert_eq!((f.body.as_deref(), f.obstacle.as_deref()), (Some("head"), Some("post")));
    assert_eq!(f.measure, Some(Measure::DistanceMm(0.0)));
    assert_eq!(past_the_post(&with_post(600.0)).findings, []);
}

#[test]
fn clearances_of_both_bodies_are_kept() {
    // The head keeps 10 mm, the post 5.
    let v = past_the_post(&with_post(670.0 - 14.5));
    let f = only_fault(&v);
    assert_eq!((f.kind, f.body.as_deref()), (FindingKind::Collision, Some("head")));
    assert!(matches!(f.measure, Some(Measure::DistanceMm(d)) if (d - 14.5).abs() < 1e-3), "{f}");
    let near = past_the_post(&with_post(670.0 - 14.95));
    assert_eq!((only(&near).kind, near.faults().count()), (FindingKind::NearMiss, 0));
    assert_eq!(past_the_post(&with_post(670.0 - 15.1)).findings, []);
}

#[test]
fn cutter_and_holder_in_a_body_of_the_bed_are_found_in_feed_and_rapid() {
    let shop = with_post(700.0);
    let mut setup = shop.setup();
    setup.obstacles.clear();
    let seen = |v: &Verification| -> Vec<(FindingKind, String)> {
        v.findings.iter().map(|f: &Finding| (f.kind, f.body.clone().unwrap_or_default())).collect()
    };
    let over = || Text::new(&shop).rapid([0.0, 180.0, 1000.0]);
    let feed = seen(&over().cut([0.0, 180.0, 690.0]).verify_in(&setup));
    assert!(feed.contains(&(FindingKind::Collision, "cutter".to_owned())), "{feed:?}");
    let rapid = over().rapid([0.0, 180.0, 690.0]).verify_in(&setup);
    assert!(seen(&rapid).contains(&(FindingKind::RapidCollision, "cutter".to_owned())), "{rapid:?}");
    let deeper = seen(&over().cut([0.0, 180.0, 600.0]).verify_in(&setup));
    assert!(deeper.contains(&(FindingKind::HolderCollision, "holder section 1".to_owned())), "{deeper:?}");
    assert_eq!(seen(&over().cut([0.0, 180.0, 705.2]).verify_in(&setup)), []);
    // The clearance of the body is kept by the cutter, too.
    let near = over().cut([0.0, 180.0, 704.0]).verify_in(&setup);
    assert!(matches!(only(&near).measure, Some(Measure::DepthMm(d)) if (d - 1.0).abs() < 1e-3), "{near:?}");
}

#[test]
fn bodies_that_one_joint_joins_are_left_out_and_others_are_not() {
    let run = |row: usize| {
        let mut file = Machine::head_b_table_c().unwrap().to_file();
        let block = ShapeFile::Box { size_mm: [100.0, 100.0, 100.0] };
        // Rows 0 and 1 are the Y and the X slide; at home both frames' origins are the bed's, the
        // boxes lie in each other.
        file.bed_bodies = vec![body("guide", block, [0.0, 0.0, -3000.0], 0.0)];
        let machine = Machine::from_file(file.clone()).unwrap();
        let probe = BodyFile { name: "slide".to_owned(), ..file.bed_bodies[0].clone() };
        // Where that place of the bed is in the row's frame, from where a body at its origin is.
        let mut at_origin = file.clone();
        at_origin.tool_chains[0].rows[row].bodies = vec![BodyFile { position_mm: [0.0; 3], ..probe.clone() }];
        let at_origin = Machine::from_file(at_origin).unwrap();
        let home = machine.home();
        let pose = at_origin.body_poses(&home).find(|b| b.body.name() == "slide").unwrap().table_from_solid;
        let place = pose.inverse_transform_point(&Point3::new(0.0, 0.0, -3000.0));
        file.tool_chains[0].rows[row].bodies = vec![BodyFile { position_mm: place.coords.into(), ..probe }];
        let shop = Shop::with_machine(Machine::from_file(file).unwrap());
        Text::new(&shop).rapid([0.0, 0.0, 300.0]).rapid([10.0, 10.0, 300.0]).verify()
    };
    assert_eq!(run(0).findings, [], "guide and Y slide are joined by Y");
    let v = run(1);
    let f = only_fault(&v);
    assert_eq!(
        (f.kind, f.body.as_deref(), f.obstacle.as_deref()),
        (FindingKind::Collision, Some("slide"), Some("guide"))
    );
}

/// Table that turns about C in a cradle that tilts about A, with a cheek at y from 200 to 240, 100
/// mm above the table.
fn trunnion() -> Machine {
    let row = |alpha_deg: f64, theta_deg: f64| DhRow {
        a_mm: 0.0,
        alpha_deg,
        d_mm: 0.0,
        theta_deg,
        joint: None,
        bodies: Vec::new(),
    };
    let rotary = |axis: &str, range: RevoluteRange, row: DhRow| DhRow {
        joint: Some(Joint::Revolute(RevoluteJoint {
            axis: axis.to_owned(),
            sense: Sense::Negative,
            range,
            rollover: None,
            max_wind_up_turns: None,
            home_deg: 0.0,
            max_velocity_deg_min: 5000.0,
            max_acceleration_deg_s2: None,
            max_jerk_deg_s3: None,
        })),
        ..row
    };
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    let tilt = RevoluteRange::Limited { min_deg: -110.0, max_deg: 110.0 };
    let mut rows =
        vec![row(0.0, 90.0), rotary("A", tilt, row(90.0, 0.0)), rotary("C", RevoluteRange::Endless, row(-90.0, -90.0))];
    // The cradle's x, y, z are y, z, x of the bed at A 0.
    let cheek = ShapeFile::Box { size_mm: [40.0, 200.0, 100.0] };
    rows[1].bodies = vec![body("cheek", cheek, [220.0, 0.0, 0.0], 3.0)];
    let table = ShapeFile::Cylinder { radius_mm: 150.0, height_mm: 60.0 };
    rows[2].bodies = vec![body("table", table, [0.0, 0.0, -140.0], 0.0)];
    file.workpiece_chain.rows = rows;
    // The head has no rotary axis left: nothing behind Z but the nose.
    let head = &mut file.tool_chains[0].rows;
    head.retain(|r| !matches!(&r.joint, Some(Joint::Revolute(_))));
    head.last_mut().unwrap().alpha_deg = 0.0;
    Machine::from_file(file).unwrap()
}

/// Words of a tool over the point (0, 100, 30) that leans by `angle` toward the cheek, with C at 0.
fn leaning(shop: &Shop, angle: f64) -> AxisValues {
    let axis = Unit::new_normalize(Vector3::new(0.0, angle.sin(), angle.cos()));
    let cl = facemill_cl_data::ClPoint { tip: Point3::new(0.0, 100.0, 30.0), axis };
    let length = shop.tool.gauge_length();
    let near = |a: f64| AxisValues::from([0.0, 0.0, 0.0, a, 0.0]);
    [angle, -angle]
        .into_iter()
        .filter_map(|a| shop.machine.nearest_inverse(&cl, length, Some(&near(a)), BranchPreference::Positive).ok())
        .find(|q| q[4].abs() < 1e-6)
        .expect("one branch has C at 0")
}

fn trunnion_shop(half: f64) -> Shop {
    let mut shop = Shop::with_machine(trunnion());
    shop.table_from_work = Isometry3::identity();
    shop.plate = MeshTree::new(&box_mesh([-half, -half, -50.0], [half, half, 0.0]));
    shop
}

#[test]
fn cheek_that_swings_into_the_holder_is_found_at_that_angle_only() {
    let shop = trunnion_shop(100.0);
    let mut setup = shop.setup();
    setup.obstacles.truncate(1);
    let run = |angles: &[f64]| {
        let mut text = Text::new(&shop);
        for (k, deg) in angles.iter().enumerate() {
            let q = leaning(&shop, deg.to_radians());
            let words = shop.words.words(q.as_slice()).unwrap();
            let line = words.iter().fold(String::new(), |line, w| format!("{line} {}{:.4}", w.letter, w.value));
            text = text.line(&if k == 0 { format!("G0 G43{line} H7") } else { format!("G1{line} F500.") });
        }
        text.verify_in(&setup)
    };
    assert_eq!(run(&[5.0, 10.0, 20.0]).findings, []);
    let v = run(&[5.0, 20.0, 60.0, 20.0]);
    let f = v.findings.iter().find(|f| f.kind == FindingKind::HolderCollision).unwrap_or_else(|| panic!("{v:?}"));
    assert_eq!((f.body.as_deref(), f.obstacle.as_deref()), (Some("holder section 1"), Some("cheek")));
    assert_eq!((f.first_line, f.last_line), (HEAD + 3, HEAD + 4), "on the way to 60 degrees and back: {f}");
    // The place is on the cheek's inner side, in the workpiece frame; C is at 0.
    let place = f.place_work_mm.unwrap();
    assert!((199.0..241.0).contains(&place[1]) && place[2] < 101.0, "{place:?}");
}

#[test]
fn work_that_turns_into_the_cheek_is_found() {
    // A corner of the plate is 212 mm from the axis of C, its side 150.
    let run = |half: f64| {
        let shop = trunnion_shop(half);
        let mut setup = shop.setup();
        setup.obstacles.truncate(1);
        let text = Text::new(&shop).line("G0 G90 X0. Y0. Z1000. A0. C0.").line("G0 X100. C90.");
        text.verify_in(&setup)
    };
    let v = run(150.0);
    let f = only_fault(&v);
    assert_eq!(
        (f.kind, f.body.as_deref(), f.obstacle.as_deref()),
        (FindingKind::Collision, Some("cheek"), Some("plate"))
    );
    assert_eq!(f.worst_line, HEAD + 2);
    assert_eq!(run(130.0).findings, []);
}
