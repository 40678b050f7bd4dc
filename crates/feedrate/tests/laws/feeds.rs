//! Laws of feeds and times on the propeller mill.

use facemill_cl_data::{CuttingLaw, RapidLaw};
use facemill_feedrate::*;
use facemill_inverse_kinematics::*;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

const WIDE: FeedRange = FeedRange { min: 1e-9, max: 1e12, rapid: None };

fn mill() -> Machine {
    Machine::head_b_table_c().unwrap()
}

/// Runs a law on seeded blocks: start, travel of every axis (mm, rad), distance of the tip,
/// programmed feed.
fn for_blocks(law: impl Fn(AxisValues, AxisValues, f64, f64) -> Result<(), TestCaseError>) {
    let travel = |most: f64| prop_oneof![1 => Just(0.0), 6 => -most..most, 1 => -1e-7..1e-7];
    let travels = (travel(20.0), travel(20.0), travel(20.0), travel(0.2), travel(0.4));
    let distance = prop_oneof![1 => Just(0.0), 1 => 0.0..1e-9, 6 => 0.0..30.0];
    let strategy = (travels, distance, 1.0..20_000.0_f64);
    let config = Config { cases: 2000, failure_persistence: None, ..Config::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]));
    runner
        .run(&strategy, |((x, y, z, b, c), distance, tip_feed)| {
            let start = AxisValues::from([100.0, -50.0, 700.0, 0.3, 5.0]);
            let end = AxisValues::from([100.0 + x, -50.0 + y, 700.0 + z, 0.3 + b, 5.0 + c]);
            law(start, end, distance, tip_feed)
        })
        .unwrap();
}

/// Returns the speed of every axis in mm/min and deg/min, as FEED writes it.
fn axis_feeds(machine: &Machine, start: &AxisValues, end: &AxisValues, time: f64) -> Vec<f64> {
    let unit = |k: usize| if k < 3 { 1.0 } else { 180.0 / std::f64::consts::PI };
    (0..machine.axes().len()).map(|k| (end[k] - start[k]).abs() * unit(k) * 60.0 / time).collect()
}

#[test]
fn no_axis_exceeds_its_speed_and_the_feed_is_the_papers() {
    let machine = mill();
    let most = [15000.0, 15000.0, 15000.0, 3600.0, 3600.0];
    for_blocks(|start, end, distance, tip_feed| {
        let feed = feed_for_block(machine.axes(), &start, &end, distance, tip_feed, &WIDE).unwrap();
        if feed.limit == FeedLimit::NoMotion {
            prop_assert_eq!(start, end);
            return Ok(());
        }
        let speeds = axis_feeds(&machine, &start, &end, feed.time);
        for (speed, most) in speeds.iter().zip(most) {
            prop_assert!(*speed <= most * (1.0 + 1e-9), "{:?} {:?}", speeds, feed);
        }
        // FEED (6): Fn is the norm of the axes' speeds.
        let norm = speeds.iter().map(|f| f * f).sum::<f64>().sqrt();
        prop_assert!((feed.f_word - norm).abs() <= 1e-9 * norm, "{:?} against {}", feed, norm);
        match feed.limit {
            // FEED (4).
            FeedLimit::TipFeed => prop_assert!((feed.tip_feed - tip_feed).abs() <= 1e-9 * tip_feed),
            // FEED (7), (8): the limiting axis moves at its largest speed, the tip below the
            // programmed one.
            FeedLimit::Axis(k) => {
                prop_assert!((speeds[k] - most[k]).abs() <= 1e-9 * most[k]);
                prop_assert!(feed.tip_feed <= tip_feed * (1.0 + 1e-9));
                if distance > 1e-6 {
                    let fa = axis_feeds(&machine, &start, &end, 60.0 * distance / tip_feed);
                    let fr = fa.iter().zip(most).map(|(f, m)| f / m).fold(0.0, f64::max);
                    let fa = fa.iter().map(|f| (f / fr) * (f / fr)).sum::<f64>().sqrt();
                    prop_assert!(fr >= 1.0 - 1e-9 && (feed.f_word - fa).abs() <= 1e-9 * fa);
                }
            }
            other => prop_assert!(false, "{:?} in a wide range", other),
        }
        Ok(())
    });
}

#[test]
fn halving_a_block_keeps_the_feed_and_halves_the_time() {
    let machine = mill();
    for_blocks(|start, end, distance, tip_feed| {
        let whole = feed_for_block(machine.axes(), &start, &end, distance, tip_feed, &WIDE).unwrap();
        let middle = start.lerp(&end, 0.5);
        let half = feed_for_block(machine.axes(), &start, &middle, 0.5 * distance, tip_feed, &WIDE).unwrap();
        if g94_length(machine.axes(), &start, &end) > 1e-3 {
            prop_assert!((half.f_word - whole.f_word).abs() <= 1e-8 * whole.f_word, "{:?} {:?}", half, whole);
            prop_assert!((2.0 * half.time - whole.time).abs() <= 1e-8 * whole.time);
        }
        Ok(())
    });
}

#[test]
fn twice_the_feed_takes_half_the_time_until_an_axis_limits() {
    let machine = mill();
    for_blocks(|start, end, distance, tip_feed| {
        let once = feed_for_block(machine.axes(), &start, &end, distance, tip_feed, &WIDE).unwrap();
        let twice = feed_for_block(machine.axes(), &start, &end, distance, 2.0 * tip_feed, &WIDE).unwrap();
        match (once.limit, twice.limit) {
            (FeedLimit::TipFeed, FeedLimit::TipFeed) => {
                prop_assert!((once.time - 2.0 * twice.time).abs() <= 1e-9 * once.time);
            }
            (FeedLimit::Axis(a), FeedLimit::Axis(b)) => prop_assert_eq!((a, once.time), (b, twice.time)),
            (FeedLimit::TipFeed, FeedLimit::Axis(_)) => {
                prop_assert!(twice.time <= once.time && 2.0 * twice.time >= once.time * (1.0 - 1e-9));
            }
            (FeedLimit::NoMotion, FeedLimit::NoMotion) => {}
            other => prop_assert!(false, "{:?}", other),
        }
        Ok(())
    });
}

#[test]
fn f_words_stay_in_the_controls_range() {
    let machine = mill();
    let range = FeedRange { min: 300.0, max: 6000.0, rapid: None };
    for_blocks(|start, end, distance, tip_feed| {
        let free = feed_for_block(machine.axes(), &start, &end, distance, tip_feed, &WIDE).unwrap();
        match feed_for_block(machine.axes(), &start, &end, distance, tip_feed, &range) {
            Ok(feed) => {
                prop_assert!((300.0..=6000.0).contains(&feed.f_word));
                match feed.limit {
                    FeedLimit::ControlMax => prop_assert!(feed.time > free.time && free.f_word > 6000.0),
                    FeedLimit::ControlMin => prop_assert!(feed.time < free.time && free.f_word < 300.0),
                    FeedLimit::NoMotion => prop_assert_eq!(start, end),
                    _ => prop_assert_eq!(feed, free),
                }
            }
            Err(e) => prop_assert!(false, "{}", e),
        }
        Ok(())
    });
}

#[test]
fn a_smallest_f_that_overloads_an_axis_is_refused() {
    let machine = mill();
    let start = AxisValues::from([0.0, 0.0, 500.0, 0.0, 0.0]);
    let end = AxisValues::from([0.0, 0.0, 500.0, 0.2, 0.0]);
    let range = FeedRange { min: 5000.0, max: 24000.0, rapid: None };
    match feed_for_block(machine.axes(), &start, &end, 10.0, 20_000.0, &range).unwrap_err() {
        FeedError::MinimumExceedsAxis { axis, f_word, min } => {
            assert_eq!((axis, min), (3, 5000.0));
            assert!((f_word - 3600.0).abs() < 1e-9);
        }
        e => panic!("{e}"),
    }
}

#[test]
fn a_swing_about_the_tip_is_timed_by_its_axes() {
    let machine = mill();
    let start = AxisValues::from([0.0, 0.0, 500.0, 0.0, 0.0]);
    let swung = AxisValues::from([0.0, 0.0, 500.0, 0.0, 1.0]);
    for distance in [0.0, 1e-300, 1e-12] {
        let feed = feed_for_block(machine.axes(), &start, &swung, distance, 1000.0, &WIDE).unwrap();
        assert_eq!(feed.limit, FeedLimit::Axis(4));
        assert!((feed.time - 1f64.to_degrees() / 60.0).abs() < 1e-12 && (feed.f_word - 3600.0).abs() < 1e-9);
        assert!((feed.inverse_time().unwrap() * feed.time - 60.0).abs() < 1e-9);
    }
    let still = feed_for_block(machine.axes(), &start, &start, 0.0, 0.5, &machine.feed_range()).unwrap();
    assert_eq!((still.limit, still.time, still.f_word), (FeedLimit::NoMotion, 0.0, 1.0));
    assert_eq!(still.inverse_time(), None);
}

#[test]
fn times_of_a_sequence_add_up_and_faults_name_the_block() {
    let machine = mill();
    let at = |k: usize| {
        let s = k as f64;
        AxisValues::from([800.0 + s, 3.0 * s, 700.0 - s, 0.01 * s, 0.02 * s])
    };
    let blocks: Vec<FeedBlock> = (1..30).map(|k| FeedBlock { end: at(k), tip_feed: 500.0 + 10.0 * k as f64 }).collect();
    let feeds = plan_feeds(&machine, 260.0, &at(0), &blocks).unwrap();
    assert_eq!(feeds.len(), blocks.len());
    let mut by_hand = 0.0;
    for (k, block) in blocks.iter().enumerate() {
        let [p0, p1] = [at(k), block.end].map(|q| machine.forward(&q, 260.0).translation.vector);
        by_hand += 60.0 * (p1 - p0).norm() / block.tip_feed;
        assert_eq!(feeds[k].limit, FeedLimit::TipFeed);
    }
    let total: f64 = feeds.iter().map(|f| f.time).sum();
    assert!((total - by_hand).abs() < 1e-9 * total);
    let mut broken = blocks;
    broken[17].tip_feed = -3.0;
    let e = plan_feeds(&machine, 260.0, &at(0), &broken).unwrap_err();
    assert_eq!(e, PlanFeedsError { block: 17, source: FeedError::BadTipFeed { tip_feed: -3.0 } });
    broken[17] = FeedBlock { end: AxisValues::from([f64::NAN; 5]), tip_feed: 100.0 };
    let e = plan_feeds(&machine, 260.0, &at(0), &broken).unwrap_err();
    assert_eq!(e, PlanFeedsError { block: 17, source: FeedError::NotFinite });
}

#[test]
fn rapids_take_the_time_of_their_slowest_axis_or_of_the_rapid_feed() {
    let machine = mill();
    let start = AxisValues::from([0.0, 0.0, 500.0, 0.0, 0.0]);
    let end = AxisValues::from([300.0, 400.0, 500.0, 0.0, 0.0]);
    assert!((rapid_time(&machine, RapidLaw::Linear, &start, &end, 260.0) - 400.0 / 250.0).abs() < 1e-12);
    let mut file = machine.to_file();
    file.feed.rapid_mm_min = Some(6000.0);
    let slow = Machine::from_file(file).unwrap();
    assert!((rapid_time(&slow, RapidLaw::Linear, &start, &end, 260.0) - 5.0).abs() < 1e-12);
    assert!((rapid_time(&slow, RapidLaw::PerAxis, &start, &end, 260.0) - 1.6).abs() < 1e-12);
}

#[test]
fn a_rapid_that_keeps_its_tip_takes_the_time_of_the_axis_that_has_to_be_fastest_for_it() {
    // The tip does not move beside the table's axis while that turns by 180°: X and Y move round
    // half a circle.
    let machine = mill();
    let length = 260.0;
    let start = AxisValues::from([700.0, 0.0, 700.0, 0.0, 0.0]);
    let tip = machine.cl_point(&start, length).tip;
    let mut turned = start;
    turned[4] = std::f64::consts::PI;
    let radius = 0.5 * (machine.cl_point(&turned, length).tip - tip).norm();
    let end = machine.with_tip_at(&turned, &tip, length).unwrap();
    let way = (end[0] - start[0]).hypot(end[1] - start[1]);
    assert!(radius > 300.0 && (way - 2.0 * radius).abs() < 1e-6, "{way} {radius}");
    // Each is as fast as the tip on the circle somewhere, for any ends.
    let table = std::f64::consts::PI / machine.axes()[4].max_velocity;
    let fastest = machine.axes()[0].max_velocity.min(machine.axes()[1].max_velocity);
    let expected = (radius * std::f64::consts::PI / fastest).max(table);
    let law = CuttingLaw::TipAndRotariesLinear;
    let time = rapid_time(&machine, law, &start, &end, length);
    assert!(time <= expected * (1.0 + 1e-9) && time >= expected * 0.998, "{time} {expected}");
    assert!(rapid_time(&machine, RapidLaw::Linear, &start, &end, length) < 0.7 * expected);
}
