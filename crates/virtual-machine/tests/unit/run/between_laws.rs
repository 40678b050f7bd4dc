//! Motion followed between positions against thousands of positions of the same motion.

use facemill_cl_data::{CuttingLaw, RapidLaw};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::BlockLaw;
use facemill_test_kit::Random;
use nalgebra::Vector3;

use super::*;
use crate::kit;

/// Times of a motion at which distances are taken, and by how much they may be too large, mm: half
/// of what a point of the tool goes from one to the next.
const TIMES: u32 = 3000;

const BETWEEN_TIMES: f64 = 0.15;

fn random_move(shop: &kit::Shop, law: BlockLaw, rng: &mut Random) -> Move {
    let mut pose = |axis: [f64; 2]| {
        let tip = [rng.between(-150.0, 150.0), rng.between(-150.0, 150.0), rng.between(0.0, 150.0)];
        shop.axes_at(tip, [axis[0] + rng.between(0.0, 0.2), axis[1] + rng.between(-0.1, 0.1), 1.0])
    };
    let (start, end) = (pose([0.3, 0.1]), pose([0.4, -0.1]));
    let is_rapid = matches!(law, BlockLaw::Rapid(_));
    Move { block: 0, section: 0, law, is_rapid, start, end, feed: None, moves_tool: true }
}

fn pose_of(scene: &RunScene<'_>, mount: Mount, axes: &AxisValues) -> Isometry3<f64> {
    let machine = scene.setup.machine;
    scene.work_from_table
        * match mount {
            Mount::Tool(tool_from_solid) => machine.forward(axes, scene.tool_length) * tool_from_solid,
            Mount::Machine(k) => machine.body_poses(axes).nth(k).unwrap().table_from_solid,
        }
}

/// A small post beside the way of a body: at a random time, and a random distance from where the
/// body is then.
fn post(shop: &kit::Shop, m: &Move, rng: &mut Random) -> MeshTree {
    let (machine, length) = (&shop.machine, shop.tool.gauge_length());
    let motion = Motion::new(machine, m.law, &m.start, &m.end, length).unwrap();
    let work_from_tool =
        shop.table_from_work.inverse() * machine.forward(&motion.at(rng.between(0.1, 0.9)).unwrap(), length);
    let angle = rng.between(0.0, std::f64::consts::TAU);
    // The holder has a radius of 40, the cutter's body one of 22.
    let (radius, height) = if rng.between(0.0, 1.0) < 0.5 { (40.0, 90.0) } else { (22.0, 35.0) };
    let at = work_from_tool
        * Point3::from(
            Vector3::new(angle.cos(), angle.sin(), 0.0) * (radius + rng.between(1.0, 14.0)) + Vector3::z() * height,
        );
    let half = rng.between(0.05, 0.5);
    MeshTree::new(&kit::box_mesh((at - Vector3::repeat(half)).into(), (at + Vector3::repeat(half)).into()))
}

/// Whether each body was reported, and its smallest distance over all times beyond the limit of
/// findings.
fn reported_and_true(shop: &kit::Shop, m: &Move) -> Vec<(bool, f64)> {
    let mut setup = shop.setup();
    setup.obstacles.remove(0);
    let settings = VerifySettings::default();
    let scene = RunScene::new(&setup, &settings).unwrap();
    let mut result = ChunkResult::default();
    BodyFollower::new(&scene).run(0, m, &mut result);
    assert!(result.open.is_empty(), "{m:?}");
    let motion = Motion::new(&shop.machine, m.law, &m.start, &m.end, scene.tool_length).unwrap();
    let all = scene.bodies.iter().enumerate().filter(|(_, body)| body.meets[0]).map(|(index, body)| {
        let mesh = scene.obstacles[0].mesh();
        let distance = |k: u32| {
            let axes = motion.at(f64::from(k) / f64::from(TIMES)).unwrap();
            let pose = pose_of(&scene, body.mount, &axes);
            mesh.core_distance(&body.shape.core, &pose, f64::INFINITY, None).unwrap().distance - body.rounding
        };
        let nearest = (0..=TIMES).map(distance).fold(f64::INFINITY, f64::min);
        let key = Key::of_body(body.kind, index, 0);
        let reports = result.episodes.all.iter().any(|e| e.worst.key == key);
        (reports, nearest - scene.hit_distance(body, &scene.obstacles[0]))
    });
    all.collect()
}

#[test]
fn bodies_that_come_too_near_at_any_time_are_reported_and_others_are_not() {
    use CuttingLaw::{AxesLinear, TipAndRotariesLinear};
    let laws = [
        BlockLaw::Cutting(AxesLinear),
        BlockLaw::Cutting(TipAndRotariesLinear),
        BlockLaw::Rapid(RapidLaw::Linear),
        BlockLaw::Rapid(RapidLaw::PerAxis),
    ];
    let (mut rng, between) = (Random(3), VerifySettings::default().between);
    let mut counts = [0; 2];
    for law in laws {
        for _ in 0..12 {
            let mut shop = kit::Shop::new();
            let m = random_move(&shop, law, &mut rng);
            shop.wall = post(&shop, &m, &mut rng);
            for (reports, slack) in reported_and_true(&shop, &m) {
                assert!(reports || slack >= -between, "{slack} mm and not reported: {m:?}");
                assert!(!reports || slack <= BETWEEN_TIMES, "{slack} mm and reported: {m:?}");
                counts[usize::from(reports)] += usize::from(slack.abs() < 8.0);
            }
        }
    }
    assert!(counts.iter().all(|n| *n >= 15), "{counts:?}");
}

#[test]
fn a_sharp_edge_needs_nearer_positions_than_a_round_one_and_the_tolerance_is_kept() {
    let settings = VerifySettings::default();
    let reports = |corner: f64| {
        let cutter = Cutter::new(25.0, corner, 12.0).unwrap();
        (cutter_step(&cutter, &settings), cutter_between(&cutter, &settings))
    };
    let mut before = 0.0;
    for corner in [0.0, 0.01, 0.2, 0.8, 4.0, 12.0] {
        let (step, depth) = reports(corner);
        assert!(step >= before && step <= settings.max_step, "{corner}: {step}");
        assert!(depth <= settings.between + 1e-3, "{corner}: {depth}");
        before = step;
        // A point that goes straight through the edge between two positions, in the plane of the
        // tool axis: by all ways there are.
        let mut deepest = 0.0_f64;
        for k in 0..200 {
            let (sin, cos) = (std::f64::consts::FRAC_PI_2 * f64::from(k) / 199.0).sin_cos();
            let deep = |x: f64, z: f64| {
                // Of the corner at the origin, material at x < 0 and z > 0.
                let (side, down) = (corner + x, corner - z);
                if side > 0.0 && down > 0.0 { corner - side.hypot(down) } else { (-x).min(z) }
            };
            for shift in 0..100 {
                // Starts on the border, and comes back to it a step farther.
                let start = -f64::from(shift) / 99.0 * (step + 2.0 * corner);
                let from = |t: f64| deep(start + t * cos, t * sin);
                let ends = [0.0, step].map(from);
                let middle = (0..=50).map(|n| from(step * f64::from(n) / 50.0)).fold(0.0, f64::max);
                deepest = deepest.max(middle - ends[0].max(ends[1]).max(0.0));
            }
        }
        assert!(deepest <= depth, "{corner}: {deepest} mm, {depth} reported");
    }
}
