use super::*;
use crate::program::timed::LineTime;

fn section(name: &str, first_line: u32) -> GougeSection {
    GougeSection { name: name.to_owned(), first_line, gouge_limit: 0.1 }
}

fn program() -> (Vec<GougeSection>, Timed, Vec<BlockRemoval>) {
    use MoveKind::{Approach, Cut, Engage, Rapid, Turn};
    let kinds = [(3, Rapid), (9, Rapid), (10, Approach), (11, Engage), (12, Cut), (13, Cut), (14, Rapid)];
    let more = [(21, Rapid), (22, Approach), (23, Cut), (24, Turn), (25, Cut), (30, Rapid)];
    let time = |(k, (line, kind)): (usize, (u32, MoveKind))| LineTime { line, kind, time: 1.0 + k as f64 };
    let line_times = kinds.into_iter().chain(more).enumerate().map(time).collect();
    let removals =
        [(10, 0.0, true), (11, 2.0, false), (12, 0.0, true), (13, 3.0, false), (23, 5.0, false), (25, 7.0, false)];
    let removals = removals.map(|(line, removed_mm3, is_in_air)| BlockRemoval { line, removed_mm3, is_in_air });
    let sections = vec![section("first", 8), section("second", 20)];
    (sections, Timed { line_times, ..Timed::default() }, removals.to_vec())
}

#[test]
fn every_motion_counts_for_one_operation_and_those_before_the_first_for_it() {
    let (sections, timed, removals) = program();
    let [first, second] = operation_times(&sections, &timed, Some(&removals)).try_into().unwrap();
    let all: f64 = timed.line_times.iter().map(|block| block.time).sum();
    assert_eq!(first.time_s() + second.time_s(), all);
    assert_eq!(
        [first.rapid_time_s, first.approach_time_s, first.passes_time_s],
        [1.0 + 2.0 + 7.0, 3.0 + 4.0, 5.0 + 6.0]
    );
    assert_eq!(
        [second.rapid_time_s, second.approach_time_s, second.passes_time_s],
        [8.0 + 13.0, 9.0 + 11.0, 10.0 + 12.0]
    );
    assert_eq!([first.first_line, second.first_line], [8, 20]);
}

#[test]
fn the_share_in_air_is_that_of_the_passes_alone() {
    let (sections, timed, removals) = program();
    let [first, second] = operation_times(&sections, &timed, Some(&removals)).try_into().unwrap();
    assert_eq!([first.air_share, second.air_share], [Some(5.0 / 11.0), Some(0.0)]);
    assert_eq!([first.removed_mm3, second.removed_mm3], [Some(5.0), Some(12.0)]);
    let unknown = operation_times(&sections, &timed, None);
    assert!(unknown.iter().all(|o| o.air_share.is_none() && o.removed_mm3.is_none()), "{unknown:?}");
}
