use facemill_cl_data::{CcPoint, ClPoint, Posture, Silent};
use facemill_cutter_location::{FeasiblePose, Hints, Obstacle, PoseTest};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::Machine;
use facemill_surface_model::TriMesh;
use facemill_test_kit::box_mesh;
use nalgebra::{Point3, Vector3};

use super::*;
use crate::move_laws::{Random, cell, curve, plane_with_bump, tool};

/// Half of the width of the stock along x, and its top, mm.
const HALF: f64 = 60.0;
const TOP: f64 = 0.0;

/// Returns an upright cut at a tip: with the pose of a tool upright on the plane z = 0, moved.
fn cut(on_plane: &FeasiblePose, tip: Point3<f64>) -> Cut {
    let cc = CcPoint::new(tip, Vector3::z(), Vector3::x()).unwrap();
    let mut pose = *on_plane;
    pose.cl = ClPoint { tip, axis: Vector3::z_axis() };
    Cut { cc, pose, inserted: false }
}

fn upright(test: &PoseTest<'_>) -> FeasiblePose {
    let cc = CcPoint::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    test.try_posture(&cc, Posture { tilt: 0.0, rotate: 0.0 }, None, &mut Hints::default()).unwrap()
}

fn segment(cuts: Vec<Cut>) -> PassSegment {
    PassSegment { copy: 1, pass: 3, cuts, uncut_left: true, curve: curve(), part: None }
}

/// Tips of cuts through and beside the stock, up and down.
fn tips(random: &mut Random) -> Vec<Point3<f64>> {
    let mut tip = Point3::new(-130.0, 0.0, random.between(-12.0, 6.0));
    let mut tips = vec![tip];
    while tip.x < 130.0 {
        let slope: f64 = if random.between(0.0, 1.0) < 0.6 { 0.0 } else { random.between(-0.6, 0.6) };
        let way = random.between(0.5, 8.0);
        tip += Vector3::new(way, 0.0, (slope * way).clamp(-12.0 - tip.z, 6.0 - tip.z));
        tips.push(tip);
    }
    tips
}

/// An upright cutter with its bottom below the top of a block is in it where it reaches over its
/// side.
#[test]
fn no_cut_goes_down_into_stock_more_steeply_than_the_tool_may() {
    let (machine, tool) = (Machine::head_b_table_c().unwrap(), tool());
    let part = MeshTree::new(&plane_with_bump(Point3::new(0.0, 400.0, 0.0), 0.0));
    let (corners, faces) = box_mesh([-HALF, -50.0, -40.0], [HALF, 50.0, TOP]);
    let stock = MeshTree::new(&TriMesh::new(corners, faces).unwrap());
    let mut cell = cell(&machine, &tool, &part);
    let of_stock = Obstacle {
        name: "stock".to_owned(),
        mesh: (&stock).into(),
        gouge_allowance: None,
        ..cell.obstacles[0].clone()
    };
    let on_plane = upright(&PoseTest::new(&cell));
    cell.obstacles = vec![of_stock];
    let test = PoseTest::new(&cell);
    let radius = tool.cutter().radius();
    let limit = tool.max_ramp_angle();
    let mut random = Random(22);
    let (mut divided, mut lost, mut whole) = (0, 0, 0);
    for _ in 0..60 {
        let tips = tips(&mut random);
        let slope = |w: &[Point3<f64>]| (w[0].z - w[1].z).atan2(w[1].x - w[0].x);
        // Surely in the stock somewhere on the block, and surely not.
        let is_in = |w: &[Point3<f64>]| w[1].z < TOP - 2.5 && w[1].x.abs() < HALF + radius - 2.5;
        let is_out = |w: &[Point3<f64>]| {
            w[1].z > TOP || w[0].x.min(w[1].x) > HALF + radius || w[0].x.max(w[1].x) < -HALF - radius
        };
        let piece = segment(tips.iter().map(|tip| cut(&on_plane, *tip)).collect());
        let mut left_out = Vec::new();
        let kept = without_steep_cuts(&test, vec![piece], &mut left_out, &Silent).unwrap();
        let kept_tips: Vec<Vec<Point3<f64>>> =
            kept.iter().map(|p| p.cuts.iter().map(|c| c.pose.cl.tip).collect()).collect();
        for blocks in &kept_tips {
            for w in blocks.windows(2) {
                assert!(slope(w) <= limit + 2.0 * RAMP_SLACK || !is_in(w), "{w:?}");
            }
        }
        // In order, each point once, in a piece or left out.
        let mut places: Vec<Point3<f64>> = kept_tips.concat();
        places.extend(left_out.iter().map(|l| l.place));
        places.sort_by(|a, b| a.x.total_cmp(&b.x));
        assert_eq!(places, tips);
        assert!(left_out.iter().all(|l| l.reason.starts_with("ramp of ") && l.reason.ends_with(" deg into stock")));
        // A piece ends only where it has to.
        let starts: Vec<Point3<f64>> = kept_tips.iter().skip(1).map(|p| p[0]).collect();
        for w in tips.windows(2).filter(|w| starts.contains(&w[1])) {
            assert!(slope(w) > limit && !is_out(w), "{w:?}");
        }
        assert!(kept.iter().all(|p| (p.copy, p.pass) == (1, 3) && p.cuts.len() >= 2));
        divided += kept.len().saturating_sub(1);
        lost += left_out.len();
        whole += usize::from(kept.len() == 1 && left_out.is_empty());
    }
    assert!(divided > 60 && lost > 20, "{divided} divided, {lost} left out, {whole} whole");
}

/// Where no stock is left, the tool follows the surface down as steeply as it is.
#[test]
fn cuts_on_a_finished_part_stay() {
    let (machine, tool) = (Machine::head_b_table_c().unwrap(), tool());
    let part = MeshTree::new(&plane_with_bump(Point3::new(0.0, 400.0, 0.0), 0.0));
    let cell = cell(&machine, &tool, &part);
    let on_plane = upright(&PoseTest::new(&cell));
    let tips = (0..10).map(|k| Point3::new(4.0 * f64::from(k), 0.0, -2.0 * f64::from(k)));
    let piece = segment(tips.map(|tip| cut(&on_plane, tip)).collect());
    let mut left_out = Vec::new();
    let kept = without_steep_cuts(&PoseTest::new(&cell), vec![piece], &mut left_out, &Silent).unwrap();
    assert!(left_out.is_empty() && kept.len() == 1 && kept[0].cuts.len() == 10);
}
