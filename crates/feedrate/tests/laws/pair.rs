//! Laws of the feed of two heads in one block.

use facemill_feedrate::*;
use facemill_inverse_kinematics::*;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

const WIDE: FeedRange = FeedRange { min: 1e-9, max: 1e12, rapid: None };

fn mill() -> Machine {
    Machine::head_b_table_c().unwrap()
}

/// A block: travel of every axis, distances and speeds of the tips.
#[derive(Clone, Copy, Debug)]
struct Case {
    start: AxisValues,
    end: AxisValues,
    distances: [f64; 2],
    feeds: [Option<f64>; 2],
}

impl Case {
    fn pair(&self, range: &FeedRange) -> Result<PairFeed, FeedError> {
        feed_for_pair(mill().axes(), &self.start, &self.end, self.distances, self.feeds, range)
    }

    fn single(&self, head: usize, range: &FeedRange) -> Result<BlockFeed, FeedError> {
        let feed = self.feeds[head].unwrap();
        feed_for_block(mill().axes(), &self.start, &self.end, self.distances[head], feed, range)
    }
}

fn for_cases(law: impl Fn(Case) -> Result<(), TestCaseError>) {
    let travel = |most: f64| prop_oneof![1 => Just(0.0), 6 => -most..most, 1 => -1e-7..1e-7];
    let travels = (travel(20.0), travel(20.0), travel(20.0), travel(0.2), travel(0.4));
    let distance = || prop_oneof![1 => Just(0.0), 1 => 0.0..1e-9, 6 => 0.0..30.0];
    let feed = || prop_oneof![1 => Just(None), 5 => (1.0..20_000.0_f64).prop_map(Some)];
    let strategy = (travels, [distance(), distance()], [feed(), feed()]);
    let config = Config { cases: 2000, failure_persistence: None, ..Config::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &[9; 32]));
    runner
        .run(&strategy, |((x, y, z, b, c), distances, feeds)| {
            let start = AxisValues::from([100.0, -50.0, 700.0, 0.3, 5.0]);
            let end = AxisValues::from([100.0 + x, -50.0 + y, 700.0 + z, 0.3 + b, 5.0 + c]);
            law(Case { start, end, distances, feeds })
        })
        .unwrap();
}

/// Speed over largest speed of every axis.
fn loads(case: &Case, time: f64) -> Vec<f64> {
    let largest = [250.0, 250.0, 250.0, 60.0_f64.to_radians(), 60.0_f64.to_radians()];
    (0..5).map(|k| (case.end[k] - case.start[k]).abs() / time / largest[k]).collect()
}

#[test]
fn no_limit_is_exceeded_and_one_is_met() {
    for_cases(|case| {
        let feed = case.pair(&WIDE).unwrap();
        if feed.time == 0.0 {
            prop_assert_eq!(feed.limit, PairLimit::Other(FeedLimit::NoMotion));
            prop_assert_eq!(case.start, case.end);
            prop_assert!(feed.inverse_time().is_none() && feed.f_word.is_finite() && feed.tip_feeds == [0.0; 2]);
            return Ok(());
        }
        let mut largest = 0.0_f64;
        for head in 0..2 {
            prop_assert!((feed.tip_feeds[head] * feed.time / 60.0 - case.distances[head]).abs() < 1e-9);
            if let Some(requested) = case.feeds[head] {
                largest = largest.max(feed.tip_feeds[head] / requested);
            }
        }
        largest = loads(&case, feed.time).into_iter().fold(largest, f64::max);
        prop_assert!((largest - 1.0).abs() < 1e-9, "{:?}: {}", feed, largest);
        prop_assert!((feed.inverse_time().unwrap() * feed.time - 60.0).abs() < 1e-9);
        // FEED (1): F is the norm of all axes' speeds, 1 deg as 1 mm.
        let norm = (0..5).map(|k| {
            let way = case.end[k] - case.start[k];
            (if k < 3 { way } else { way.to_degrees() }).powi(2)
        });
        let norm = 60.0 * norm.sum::<f64>().sqrt() / feed.time;
        prop_assert!((feed.f_word - norm).abs() <= 1e-9 * norm);
        Ok(())
    });
}

#[test]
fn a_head_that_rests_or_does_not_cut_changes_nothing() {
    let range = FeedRange { min: 300.0, max: 6000.0, rapid: None };
    for_cases(|mut case| {
        for head in 0..2 {
            let other = 1 - head;
            case.feeds = [Some(800.0); 2];
            let single = case.single(head, &range);
            let distances = case.distances;
            let stands = Case { distances: [0, 1].map(|h| if h == head { distances[h] } else { 0.0 }), ..case };
            let idle = Case { feeds: [0, 1].map(|h| (h == head).then_some(800.0)), ..case };
            for (case, alone) in [(stands, true), (idle, false)] {
                match (case.pair(&range), &single) {
                    (Ok(pair), Ok(single)) => {
                        prop_assert_eq!((pair.f_word, pair.time), (single.f_word, single.time));
                        prop_assert_eq!(pair.tip_feeds[head], single.tip_feed);
                        prop_assert!(!alone || pair.tip_feeds[other] == 0.0);
                    }
                    (pair, single) => prop_assert_eq!(pair.err(), (*single).err()),
                }
            }
        }
        Ok(())
    });
}

/// With both heads cutting the block takes as long as the slower one alone.
#[test]
fn the_time_is_the_longer_of_the_two_single_times() {
    for_cases(|case| {
        if let [Some(_), Some(_)] = case.feeds {
            let single = [0, 1].map(|head| case.single(head, &WIDE).unwrap().time);
            prop_assert_eq!(case.pair(&WIDE).unwrap().time, single[0].max(single[1]));
        }
        Ok(())
    });
}
