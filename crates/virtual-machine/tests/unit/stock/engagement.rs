use crate::stock::engagement::*;

const LIMIT: RemovalLimit = RemovalLimit { largest: 20e3, slowest: 200.0 };

/// 1 mm at a feed in mm/min with a chip of this section, mm².
fn part(feed: f64, section: f64) -> CutShare {
    CutShare { way: 1.0, tip_way: 1.0, volume: section, time: 60.0 / feed }
}

fn ratios(feed: f64, sections: impl Iterator<Item = f64>) -> Vec<Option<f64>> {
    let mut engagement = Engagement::new(LIMIT, 0.1, 25.0, 0.5);
    sections.map(|section| engagement.cut(part(feed, section))).collect()
}

#[test]
fn rates_above_the_limit_are_reported_from_the_first_window_on() {
    // 1000 mm/min times 23 mm² is 1.15 times the limit; 21 mm² are within the slack.
    let found = ratios(1000.0, std::iter::repeat_n(23.0, 30));
    assert_eq!(found.iter().position(Option::is_some), Some(12), "the window is 12.5 mm");
    assert!(found[12..].iter().all(|r| r.is_some_and(|r| (r - 1.15).abs() < 1e-9)));
    assert!(ratios(1000.0, std::iter::repeat_n(21.0, 30)).iter().all(Option::is_none));
}

#[test]
fn a_load_shorter_than_the_window_is_evened_out_and_the_slowest_feed_is_free() {
    let spike = (0..40).map(|k| if k == 20 { 100.0 } else { 10.0 });
    assert!(ratios(1000.0, spike).iter().all(Option::is_none));
    assert!(ratios(200.0, std::iter::repeat_n(500.0, 30)).iter().all(Option::is_none));
    assert!(ratios(210.0, std::iter::repeat_n(500.0, 30)).iter().any(Option::is_some));
}

#[test]
fn runs_begin_anew_behind_a_lift() {
    let mut engagement = Engagement::new(LIMIT, 0.1, 25.0, 0.5);
    for k in 0..60 {
        assert_eq!(engagement.cut(part(1000.0, 50.0)), None);
        if k % 12 == 11 {
            engagement.lift();
        }
    }
}
