//! Intervals of motions against the motions themselves.

use facemill_cl_data::RoundFrustum;
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::{AxisKind, Machine};
use facemill_test_kit::Random;
use nalgebra::Vector3;

use super::*;
use crate::kit;
use crate::motion::setup::VerifySettings;
use crate::rates_laws::common;

/// Largest departure of points of a rod along the tool axis from what the interval tells, over its
/// deviation.
fn farthest(law: BlockLaw, rng: &mut Random) -> Vec<f64> {
    let shop = kit::Shop::with_machine(Machine::head_b_table_c().unwrap());
    let (setup, settings) = (shop.setup(), VerifySettings::default());
    let scene = RunScene::new(&setup, &settings).unwrap();
    let rod =
        Solid::Frustum(RoundFrustum { z_low: -30.0, z_high: 200.0, radius_low: 1.0, radius_high: 1.0, rounding: 0.0 });
    let mut shares = Vec::new();
    for _ in 0..60 {
        let mut place = || [rng.between(-300.0, 300.0), rng.between(-300.0, 300.0), rng.between(0.0, 200.0)];
        let (from_tip, to_tip) = (place(), place());
        let axis = [rng.between(0.2, 0.6), rng.between(-0.3, 0.3), 1.0];
        let start = shop.axes_at(from_tip, axis);
        let end = shop.axes_at(to_tip, [axis[0] + rng.between(-0.2, 0.2), axis[1] + rng.between(-0.2, 0.2), 1.0]);
        let m = Move { block: 0, section: 0, law, is_rapid: false, start, end, feed: None, moves_tool: true };
        let prover = Prover::new(&scene, &m).unwrap();
        let tool = Mount::Tool(Isometry3::identity());
        let pair = Pair { mount: tool, frame: Frame::Work, solid: &rod, obstacle: 0, is_charged: false };
        let from = rng.between(0.0, 0.7);
        let to = from + rng.between(0.05, 0.3);
        let Some(reported) = prover.interval(&pair, from, to) else { continue };
        let mut largest = 0.0_f64;
        for k in 0..=20 {
            let (time, height) = (f64::from(k) / 20.0, rng.between(-30.0, 200.0));
            let axes = prover.motion.at(from + (to - from) * time).unwrap();
            let point = Point3::new(0.0, 0.0, height);
            let truth = prover.pose(tool, Frame::Work, &axes) * point;
            let arm: Vector3<f64> = reported.mesh_from_solid * Vector3::new(0.0, 0.0, height);
            let moved = reported.velocity + reported.spin.cross(&arm);
            let expected = reported.mesh_from_solid * point + moved * (time - 0.5);
            let off = (truth - expected).norm();
            assert!(off <= reported.deviation, "{law:?}: {off} mm off, {} reported", reported.deviation);
            largest = largest.max(off / reported.deviation);
        }
        shares.push(largest);
    }
    shares
}

#[test]
fn no_point_of_the_tool_departs_farther_from_its_interval_than_stated() {
    let cutting = [CuttingLaw::AxesLinear, CuttingLaw::TipAndRotariesLinear, CuttingLaw::TipLinearVectorTurned];
    for (law, tight) in cutting.into_iter().zip([0.02, 0.1, 0.5]) {
        let mut shares = farthest(BlockLaw::Cutting(law), &mut Random(8));
        shares.sort_by(f64::total_cmp);
        assert!(
            shares.len() > 30 && shares[shares.len() / 2] >= tight,
            "{law:?}: {} reported, {shares:?}",
            shares.len()
        );
    }
}

/// Whether the cutter, 25 mm wide, is proven to stay above 0 at a ledge from `edge` mm beside its
/// axis on, between 11.5 and 13 mm above the tip; its flute ends at 12 mm with a sharp rim.
fn stays_off_the_ledge(edge: f64) -> bool {
    let shop = kit::Shop::new();
    let ledge = MeshTree::new(&kit::box_mesh([edge, -2.0, 11.5], [edge + 10.0, 2.0, 13.0]));
    let part = crate::motion::setup::VirtualObstacle {
        name: "ledge".into(),
        mesh: &ledge,
        kind: crate::motion::setup::ObstacleKind::Part,
        allowance: 0.0,
        stock: 0.0,
    };
    let setup = crate::motion::setup::VirtualSetup { obstacles: vec![part], ..shop.setup() };
    let settings = VerifySettings::default();
    let scene = RunScene::new(&setup, &settings).unwrap();
    let [start, end] = [-0.5, 0.5].map(|y| shop.axes_at([0.0, y, 0.0], [0.0, 0.0, 1.0]));
    let law = BlockLaw::Cutting(CuttingLaw::AxesLinear);
    let m = Move { block: 0, section: 0, law, is_rapid: false, start, end, feed: None, moves_tool: true };
    let mut prover = Prover::new(&scene, &m).unwrap();
    let cutter = CutterBody { obstacle: 0, thickness: 0.0, is_charged: false };
    prover.cutter_stays_above(&cutter, 0.0, [0.0, 1.0])
}

#[test]
fn the_sharp_upper_rim_is_part_of_what_stays_above() {
    // The rounded test body ends √(3² + 3.5²) = 4.6 mm from the middle of its 4 mm rounding, short
    // of the ledge's edge.
    assert!(!stays_off_the_ledge(24.0));
    assert!(stays_off_the_ledge(25.1));
}

#[test]
fn no_interval_is_proven_where_the_axes_lose_a_turned_vector_on_the_way() {
    let mut r = common::Random(41);
    let law = BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned);
    let rod =
        Solid::Frustum(RoundFrustum { z_low: 0.0, z_high: 90.0, radius_low: 1.0, radius_high: 1.0, rounding: 0.0 });
    let (mut reported, mut hidden) = (0, 0);
    let random = std::iter::repeat_with(|| common::random_machine(&mut r)).take(16).collect::<Vec<_>>();
    for machine in random {
        let shop = kit::Shop::with_machine(machine);
        let (setup, settings) = (shop.setup(), VerifySettings::default());
        let scene = RunScene::new(&setup, &settings).unwrap();
        for _ in 0..250 {
            let start = AxisValues::from_fn(5, |k| match shop.machine.axes()[k].kind {
                AxisKind::Linear => r.between(-300.0, 300.0),
                AxisKind::Rotary => r.between(-2.5, 2.5),
            });
            let end = AxisValues::from_fn(5, |k| start[k] + r.between(-1.2, 1.2));
            let m = Move { block: 0, section: 0, law, is_rapid: false, start, end, feed: None, moves_tool: true };
            let Some(prover) = Prover::new(&scene, &m) else { continue };
            let tool = Mount::Tool(Isometry3::identity());
            let pair = Pair { mount: tool, frame: Frame::Work, solid: &rod, obstacle: 0, is_charged: false };
            for k in 0..4 {
                let (from, to) = (0.25 * f64::from(k), 0.25 * f64::from(k + 1));
                let is_at = |share: f64| prover.motion.at(from + (to - from) * share).is_ok();
                let is_lost = (0..=24).any(|n| !is_at(f64::from(n) / 24.0));
                let is_reported = prover.interval(&pair, from, to).is_some();
                assert!(!(is_lost && is_reported), "{}: {start:?} to {end:?} from {from}", shop.machine.name());
                reported += u32::from(is_reported);
                hidden += u32::from(is_lost && [0.0, 0.5, 1.0].into_iter().all(is_at));
            }
        }
    }
    assert!(reported > 500 && hidden > 0, "{reported} reported, {hidden} lost between places that are reached");
}

#[test]
fn a_move_is_proven_exactly_if_its_depth_and_all_its_bodies_are() {
    let mut rng = Random(12);
    let shop = kit::Shop::with_machine(Machine::head_b_table_c().unwrap());
    let block = MeshTree::new(&kit::box_mesh([-60.0, -60.0, -40.0], [60.0, 60.0, 0.0]));
    let part = crate::motion::setup::VirtualObstacle {
        name: "block".into(),
        mesh: &block,
        kind: crate::motion::setup::ObstacleKind::Part,
        allowance: 0.0,
        stock: 3.0,
    };
    let setup = crate::motion::setup::VirtualSetup { obstacles: vec![part], ..shop.setup() };
    let settings = VerifySettings::default();
    let scene = RunScene::new(&setup, &settings).unwrap();
    let mut counts = [0; 2];
    for k in 0..120 {
        let mut position = || {
            let tip = [rng.between(-110.0, 110.0), rng.between(-110.0, 110.0), rng.between(-6.0, 60.0)];
            shop.axes_at(tip, [rng.between(-0.5, 0.5), rng.between(-0.5, 0.5), 1.0])
        };
        let (start, end) = (position(), position());
        let law = [CuttingLaw::AxesLinear, CuttingLaw::TipAndRotariesLinear][k % 2];
        let law = BlockLaw::Cutting(law);
        let m = Move { block: 0, section: 0, law, is_rapid: true, start, end, feed: None, moves_tool: true };
        let measured = Prover::new(&scene, &m).unwrap().prove();
        let expected = measured.depth.is_some() && measured.bodies_clear;
        let mut prover = Prover::new(&scene, &m).unwrap();
        assert_eq!(prover.is_proven(), expected, "{start:?} to {end:?}");
        assert!(prover.intervals <= measured.intervals);
        counts[usize::from(expected)] += 1;
    }
    assert!(counts.iter().all(|n| *n >= 15), "{counts:?}");
}
