//! Points, ways between them, units and feeds.

use facemill_cl_data::ClPoint;
use facemill_cl_post::PostOptions;
use facemill_inverse_kinematics::{AxisKind, AxisValues};
use facemill_test_kit::Random;
use nalgebra::Isometry3;

use crate::kit::*;

/// Distance of a tip from the straight way between two.
fn from_segment(p: &ClPoint, a: &ClPoint, b: &ClPoint) -> f64 {
    let way = b.tip - a.tip;
    let length = way.norm_squared();
    let t = if length > 0.0 { ((p.tip - a.tip).dot(&way) / length).clamp(0.0, 1.0) } else { 0.0 };
    (p.tip - (a.tip + way * t)).norm()
}

/// Indices of the positions at which each pose is reached in turn.
fn found_at(reached: &[Reached], poses: &[FilePose], tip: f64, axis: f64) -> Vec<usize> {
    let mut at = 0;
    let each = poses.iter().enumerate().map(|(k, pose)| {
        let is_it = |r: &Reached| (r.cl.tip - pose.cl.tip).norm() <= tip && angle(&r.cl.axis, &pose.cl.axis) <= axis;
        let found = reached[at..].iter().position(is_it);
        at += found.unwrap_or_else(|| panic!("pose {k} of {} is not reached behind position {at}", poses.len()));
        at
    });
    each.collect()
}

#[test]
fn every_pose_is_reached_in_order_on_three_machines() {
    for (k, name) in MACHINES.iter().enumerate() {
        let stage = Stage::fanuc(name, 4);
        let poses = random_walk(&mut Random(100 + k as u64), 600);
        let posted = stage.post(&file_of(&poses, ("MM", 1.0)));
        assert!(posted.is_as_meant && posted.report.is_clean(), "{name}: {:?}", posted.report.faults);
        let reached = stage.reached(&posted.text);
        // Half a unit of three linear words and two rotary ones at the end of some 700 mm.
        let at = found_at(&reached, &poses, 5e-5 * 3f64.sqrt() + 2.0 * 5e-5f64.to_radians() * 700.0, 3e-6);
        assert_eq!(at.first(), Some(&0), "{name}");
        assert_eq!(at.last(), Some(&(reached.len() - 1)), "{name}");
        // Rapids are rapids, and cuts are cuts.
        for (pair, pose) in at.windows(2).zip(&poses[1..]) {
            let way = &reached[pair[0] + 1..=pair[1]];
            assert!(way.iter().all(|r| r.is_rapid == pose.is_rapid), "{name}");
        }
        let d = &posted.report.deviation;
        let worst = poses.iter().zip(&at).map(|(pose, k)| (reached[*k].cl.tip - pose.cl.tip).norm());
        let worst = worst.fold(0.0, f64::max);
        assert!(d.tip_mm >= worst - 1e-9 && d.tip_mm < 1.5 * worst + 1e-4, "{name}: {} and {worst}", d.tip_mm);
    }
}

/// Samples the straight motion of the axes, which the report bounds.
#[test]
fn between_poses_the_control_keeps_the_tolerance() {
    for (k, name) in MACHINES.iter().enumerate() {
        let stage = Stage::fanuc(name, 5);
        let poses = random_walk(&mut Random(200 + k as u64), 250);
        for (tolerance, rapid_tolerance) in [(0.01, 0.5), (0.002, 0.05)] {
            let options = PostOptions { tolerance, rapid_tolerance: Some(rapid_tolerance), ..PostOptions::new("test") };
            let posted = stage.post_with(&file_of(&poses, ("MM", 1.0)), &options).unwrap();
            let reached = stage.reached(&posted.text);
            let at = found_at(&reached, &poses, 0.001, 1e-5);
            let mut worst = [0.0_f64; 2];
            for (pair, ends) in at.windows(2).zip(poses.windows(2)) {
                for way in reached[pair[0]..=pair[1]].windows(2) {
                    for step in 0..=24 {
                        let q = way[0].axes.lerp(&way[1].axes, f64::from(step) / 24.0);
                        let cl = stage.machine.cl_point(&q, LENGTH).transformed(&stage.table_from_work.inverse());
                        let off = from_segment(&cl, &ends[0].cl, &ends[1].cl);
                        let of = &mut worst[usize::from(ends[1].is_rapid)];
                        *of = of.max(off);
                    }
                }
            }
            assert!(worst[0] <= tolerance, "{name}: {} in cuts", worst[0]);
            assert!(worst[1] <= rapid_tolerance, "{name}: {} in rapids", worst[1]);
            assert!(posted.report.deviation.between_mm >= worst[0] - 1e-4, "{name}");
        }
    }
}

#[test]
fn a_rapid_without_tolerance_is_one_block() {
    let stage = Stage::fanuc("table-table-a-c", 3);
    let head = HEAD.replace("GOTO/0,0,60", "GOTO/-60,0,60,0.3,0.2,1");
    let text = format!("{head}RAPID\nGOTO/60,0,60,-0.3,0.4,1\nGOTO/60,0,50\nRAPID\nGOTO/60,0,60\nFINI");
    let rapids = |rapid_tolerance| {
        let options = PostOptions { rapid_tolerance, ..PostOptions::new("test") };
        let posted = stage.post_with(&text, &options).unwrap();
        (motions(&posted.text).iter().filter(|m| m.is_rapid).count(), posted.report.deviation.between_rapid_mm)
    };
    let (one, off) = rapids(None);
    assert!(one == 3 && off > 1.0, "{one} {off}");
    let (many, kept) = rapids(Some(0.5));
    assert!(many > 6 && kept <= 0.5, "{many} {kept}");
}

/// The axis values from which a file was made are those of its program: the path decides branch
/// and winding.
#[test]
fn axis_values_come_back_to_a_millionth() {
    for (k, name) in MACHINES.iter().enumerate() {
        let stage = Stage::fanuc(name, 6);
        let mut random = Random(300 + k as u64);
        let axes = stage.machine.axes();
        let mut q = AxisValues::from_fn(axes.len(), |k| match axes[k].kind {
            AxisKind::Linear => 0.5 * (axes[k].min + axes[k].max),
            // The first one next to home, away from the pole.
            AxisKind::Rotary => 0.3,
        });
        let mut values = Vec::new();
        let mut poses = Vec::new();
        for step in 0..400 {
            for k in 0..axes.len() {
                let by = random.between(-1.0, 1.0);
                match axes[k].kind {
                    AxisKind::Linear => q[k] += 2.0 * by,
                    AxisKind::Rotary => q[k] = (q[k] + 0.01 * by).clamp(0.1, 0.8),
                }
            }
            let cl = stage.machine.cl_point(&q, LENGTH).transformed(&stage.table_from_work.inverse());
            values.push(q);
            poses.push(FilePose { cl, is_rapid: step == 0 || step == 399 });
        }
        let branch = match stage.machine.branch_of(&values[0]) {
            facemill_inverse_kinematics::Branch::Positive => facemill_inverse_kinematics::BranchPreference::Positive,
            facemill_inverse_kinematics::Branch::Negative => facemill_inverse_kinematics::BranchPreference::Negative,
        };
        let options = PostOptions { tolerance: 0.5, branch, ..PostOptions::new("test") };
        let posted = stage.post_with(&file_of(&poses, ("MM", 1.0)), &options).unwrap();
        let reached = stage.reached(&posted.text);
        assert_eq!(reached.len(), values.len(), "{name}: none inserted");
        for (r, q) in reached.iter().zip(&values) {
            for k in 0..q.len() {
                // A millionth of a degree and of a millimetre, rounded.
                let bound = if axes[k].kind == AxisKind::Rotary { 0.5e-6_f64.to_radians() } else { 0.5e-6 };
                let off = (r.axes[k] - q[k]).abs();
                assert!(off <= bound * 1.01 + 1e-9, "{name}: axis {} is off by {off}", axes[k].letter);
            }
        }
    }
}

/// The first point has the solution nearest to home, or the one on the side that is wanted, and the
/// path goes on from there.
#[test]
fn the_branch_of_the_first_point_is_the_one_that_is_wanted() {
    use facemill_inverse_kinematics::{Branch, BranchPreference};
    for name in ["table-table-b-c", "head-b-table-c", "head-head-c-a"] {
        let stage = Stage::fanuc(name, 4);
        let mut sides = Vec::new();
        for branch in [BranchPreference::Nearest, BranchPreference::Positive, BranchPreference::Negative] {
            // Sides are those of the second rotary axis, which leans by 12 degrees.
            let pose = |x: f64, is_rapid: bool| {
                let axis = nalgebra::Unit::new_normalize(nalgebra::Vector3::new(-0.2, -0.04, 0.978));
                FilePose { cl: ClPoint { tip: nalgebra::Point3::new(x, 0.0, 20.0), axis }, is_rapid }
            };
            let poses = [pose(0.0, true), pose(5.0, false), pose(10.0, false), pose(12.0, true)];
            let options = PostOptions { branch, ..PostOptions::new("test") };
            let posted = stage.post_with(&file_of(&poses, ("MM", 1.0)), &options).unwrap();
            let reached = stage.reached(&posted.text);
            let branches: Vec<Branch> = reached.iter().map(|r| stage.machine.branch_of(&r.axes)).collect();
            assert!(branches.iter().all(|b| *b == branches[0]), "{name}: {branches:?}");
            let cl = poses[0].cl.transformed(&stage.table_from_work);
            let nearest = stage.machine.nearest_inverse(&cl, LENGTH, None, branch).unwrap();
            let off = (0..nearest.len()).map(|k| (reached[0].axes[k] - nearest[k]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-3, "{name}: {branch:?}: off by {off}");
            sides.push(branches[0]);
        }
        assert_eq!(sides[1..], [Branch::Positive, Branch::Negative], "{name}");
    }
}

/// With C at ±200 degrees a whole turn from C0 leaves the range, and one from the other solution,
/// C-180, does not: the path begins there, unless the side of C0 is requested.
#[test]
fn a_path_begins_with_another_solution_where_the_nearest_one_turns_anew() {
    use facemill_inverse_kinematics::machine_file::{Joint, RevoluteRange};
    use facemill_inverse_kinematics::{Branch, BranchPreference, Machine};
    let mut stage = Stage::fanuc("head-b-table-c", 4);
    let mut file = stage.machine.to_file();
    for row in &mut file.workpiece_chain.rows {
        if let Some(Joint::Revolute(joint)) = &mut row.joint {
            joint.range = RevoluteRange::Limited { min_deg: -200.0, max_deg: 200.0 };
        }
    }
    stage.machine = Machine::from_file(file).unwrap();
    let pose = |k: usize| {
        let (sin, cos) = (std::f64::consts::PI + std::f64::consts::TAU * k.min(72) as f64 / 72.0).sin_cos();
        let axis = nalgebra::Unit::new_normalize(nalgebra::Vector3::new(0.35 * cos, 0.35 * sin, 0.94));
        FilePose {
            cl: ClPoint { tip: nalgebra::Point3::new(50.0 * cos, 50.0 * sin, 20.0), axis },
            is_rapid: k == 0 || k == 73,
        }
    };
    let text = file_of(&(0..=73).map(pose).collect::<Vec<_>>(), ("MM", 1.0));
    let near = stage.machine.nearest_inverse(
        &pose(0).cl.transformed(&stage.table_from_work),
        LENGTH,
        None,
        BranchPreference::Nearest,
    );
    let near = near.unwrap();
    let c = stage.machine.axis_index("C").unwrap();
    assert!(near[c].abs() < 1e-6, "{}", near[c]);
    let with = |branch| PostOptions { branch, retract: None, ..PostOptions::new("test") };
    let why = |branch| stage.post_with(&text, &with(branch)).err().map(|why| why.to_string()).unwrap_or_default();
    let requested = match stage.machine.branch_of(&near) {
        Branch::Positive => BranchPreference::Positive,
        Branch::Negative => BranchPreference::Negative,
    };
    assert!(why(requested).contains("within the cut: the tool has to be lifted there"), "{}", why(requested));
    assert_eq!(why(BranchPreference::Nearest), "");
}

#[test]
fn the_unit_of_a_file_does_not_matter() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let poses = random_walk(&mut Random(400), 150);
    let mm = motions(&stage.post(&file_of(&poses, ("MM", 1.0))).text);
    for unit in [("INCHES", 25.4), ("CM", 10.0)] {
        let other = motions(&stage.post(&file_of(&poses, unit)).text);
        assert_eq!(other.len(), mm.len());
        for (a, b) in mm.iter().zip(&other) {
            assert!((a.feed - b.feed).abs() <= 0.1 + 1e-9, "{} {}", a.feed, b.feed);
            assert!(a.words.iter().all(|(axis, value)| (value - b.words[axis]).abs() <= 0.001 + 1e-9));
        }
    }
}

#[test]
fn moving_file_and_mounting_together_changes_nothing() {
    let mut stage = Stage::fanuc("table-table-a-c", 4);
    let poses = random_walk(&mut Random(500), 150);
    let here = motions(&stage.post(&file_of(&poses, ("MM", 1.0))).text);
    let by = Isometry3::new([12.0, -7.0, 5.0].into(), [0.02, -0.03, 0.8].into());
    let moved: Vec<FilePose> = poses.iter().map(|pose| FilePose { cl: pose.cl.transformed(&by), ..*pose }).collect();
    stage.table_from_work *= by.inverse();
    let there = motions(&stage.post(&file_of(&moved, ("MM", 1.0))).text);
    assert_eq!(here.len(), there.len());
    for (a, b) in here.iter().zip(&there) {
        assert!(a.words.iter().all(|(axis, value)| (value - b.words[axis]).abs() <= 0.0001 + 1e-9));
    }
}

/// F is the norm over all axes, with 1 deg as 1 mm; the tip moves at FEDRAT unless an axis cannot.
#[test]
fn the_tip_moves_at_the_feed_of_the_file_or_an_axis_at_its_limit() {
    let stage = Stage::fanuc("head-head-c-a", 6);
    let poses = random_walk(&mut Random(600), 300);
    let options = PostOptions { law_feeds: false, ..PostOptions::new("test") };
    let posted = stage.post_with(&file_of(&poses, ("MM", 1.0)), &options).unwrap();
    let reached = stage.reached(&posted.text);
    let axes = stage.machine.axes();
    let mut at_feed = 0;
    for pair in reached.windows(2).filter(|pair| !pair[1].is_rapid) {
        let [from, to] = [&pair[0], &pair[1]];
        let way = |k: usize| (to.axes[k] - from.axes[k]).abs();
        let norm = (0..axes.len()).map(|k| axes[k].in_word_unit(way(k)).powi(2)).sum::<f64>().sqrt();
        let time = norm / to.feed;
        let speed = (to.cl.tip - from.cl.tip).norm() / time;
        assert!(speed <= 900.0 * 1.001 + 0.2, "the tip at {speed} mm/min");
        let slowest = (0..axes.len()).map(|k| way(k) / (axes[k].max_velocity * time * 60.0)).fold(0.0, f64::max);
        assert!(slowest <= 1.001, "an axis at {slowest} of its speed");
        let is_at_feed = speed >= 899.0;
        at_feed += usize::from(is_at_feed);
        let is_limited = slowest >= 0.99 || to.feed >= stage.machine.feed_range().max;
        assert!(
            is_at_feed || is_limited || norm < 0.05,
            "the tip at {speed} mm/min, axes at {slowest}, F{} over {norm}",
            to.feed
        );
    }
    assert!(at_feed > 100, "{at_feed}");
}

#[test]
fn the_same_file_gives_the_same_bytes() {
    let stage = Stage::fanuc("head-b-table-c", 3);
    let text = file_of(&random_walk(&mut Random(700), 100), ("MM", 1.0));
    let [one, two] = [stage.post(&text), stage.post(&text)];
    assert_eq!(one.text, two.text);
    assert_eq!(one.report.summary(), two.report.summary());
}

/// Where each axis goes at its own speed at rapid rate, a rapid that would leave its line is
/// written as a cut at the largest feed; along one axis it stays a rapid.
#[test]
fn rapids_that_would_bend_are_cuts_at_the_largest_feed() {
    let mut stage = Stage::fanuc("table-table-a-c", 3);
    let text = facemill_inverse_kinematics::preset("table-table-a-c").unwrap();
    let bent = text.replace("\"rapid\": \"linear\"", "\"rapid\": \"per_axis\"");
    assert_ne!(bent, text);
    stage.machine = facemill_inverse_kinematics::Machine::from_json(bent.as_bytes()).unwrap();
    let settings = facemill_nc_program::dialect::PostFile::default().settings(None).unwrap();
    stage.post = facemill_cl_post::post_on(&stage.machine, &settings).unwrap();
    let posted = stage.post(&format!("{HEAD}RAPID\nGOTO/100,30,60\nRAPID\nGOTO/100,30,90\nFINI"));
    assert!(posted.report.is_clean(), "{:?}", posted.report.faults);
    let motions = motions(&posted.text);
    let kinds: Vec<bool> = motions.iter().map(|m| m.is_rapid).collect();
    assert_eq!(kinds, [true, false, true]);
    assert!(motions[1].feed > 5000.0, "{}", motions[1].feed);
    // Linear rapids do not bend.
    let straight = Stage::fanuc("table-table-a-c", 3).post(&format!("{HEAD}RAPID\nGOTO/100,30,60\nFINI"));
    assert!(crate::kit::motions(&straight.text).iter().all(|m| m.is_rapid));
}
