use crate::validate::tip_feed::*;
use serde_json::json;

fn feeds(more: &serde_json::Value) -> FeedsFile {
    let mut file = json!({ "cutting_mm_min": 1000.0, "approach_mm_min": 600.0, "spindle_rpm": 500.0 });
    let (Some(file), Some(more)) = (file.as_object_mut(), more.as_object()) else { panic!() };
    file.extend(more.clone());
    serde_json::from_value(json!(file)).unwrap()
}

fn chip(area: f64) -> Chip {
    Chip { area, thickness: 0.5, is_known: true, is_air: area == 0.0 }
}

#[test]
fn feeds_without_laws_are_the_given_ones() {
    let feeds = feeds(&json!({}));
    for area in [0.0, 1.0, 1e6] {
        for chip in [None, Some(chip(area))] {
            let of = |kind| programmed_feed(&feeds, 4, kind, chip.as_ref());
            assert_eq!(of(MoveKind::Cut), TipFeed { mm_min: 1000.0, law: FeedLaw::Given });
            for kind in [MoveKind::Engage, MoveKind::Approach, MoveKind::Rapid] {
                assert_eq!(of(kind), TipFeed { mm_min: 600.0, law: FeedLaw::Given });
            }
        }
    }
}

#[test]
fn removal_rate_is_the_target_between_the_bounds() {
    let feeds = feeds(&json!({ "removal_rate": { "target_cm3_min": 20.0, "min_mm_min": 250.0 } }));
    let of = |area: f64| programmed_feed(&feeds, 4, MoveKind::Cut, Some(&chip(area)));
    assert_eq!(of(0.0), TipFeed { mm_min: 1000.0, law: FeedLaw::Given });
    assert_eq!(of(20.0).mm_min, 1000.0);
    // 40 mm² at 500 mm/min are 20 cm³/min.
    assert_eq!(of(40.0), TipFeed { mm_min: 500.0, law: FeedLaw::RemovalRate });
    assert_eq!(of(80.0), TipFeed { mm_min: 250.0, law: FeedLaw::RemovalRate });
    assert_eq!(of(500.0), TipFeed { mm_min: 250.0, law: FeedLaw::RemovalRate });
    // An entry is as slow as the cut behind it, and not faster than entries are.
    let entry = |area: f64| programmed_feed(&feeds, 4, MoveKind::Engage, Some(&chip(area))).mm_min;
    assert_eq!([entry(10.0), entry(40.0), entry(500.0)], [600.0, 500.0, 250.0]);
}

#[test]
fn air_has_its_own_feed_and_entries_have_it_outside_the_stock_alone() {
    let feeds = feeds(&json!({ "air_mm_min": 4000.0, "approach_mm_min": 5000.0 }));
    let of = |kind, area: f64| programmed_feed(&feeds, 4, kind, Some(&chip(area))).mm_min;
    assert_eq!([of(MoveKind::Cut, 0.0), of(MoveKind::Cut, 1e-9)], [4000.0, 1000.0]);
    assert_eq!(of(MoveKind::Engage, 0.0), 1000.0);
    let outside = |air: f64, approach: f64| {
        let feeds = self::feeds(&json!({ "air_mm_min": air, "approach_mm_min": approach }));
        programmed_feed(&feeds, 4, MoveKind::Approach, None)
    };
    assert_eq!(outside(4000.0, 5000.0), TipFeed { mm_min: 5000.0, law: FeedLaw::Given });
    assert_eq!(outside(4000.0, 2000.0), TipFeed { mm_min: 4000.0, law: FeedLaw::Air });
}

#[test]
fn chip_thickness_lowers_below_the_smallest_feed_of_the_removal_rate() {
    let thick = json!({ "max_mm": 0.05 });
    let rate = json!({ "target_cm3_min": 20.0, "min_mm_min": 250.0 });
    let feeds = feeds(&json!({ "chip_thickness": thick, "removal_rate": rate }));
    let of = |thickness: f64, area: f64| {
        let chip = Chip { area, thickness, is_known: true, is_air: false };
        programmed_feed(&feeds, 4, MoveKind::Cut, Some(&chip))
    };
    // 500 turns with 4 teeth: at 200 mm/min a feed of 0.1 mm per tooth, half of which is the
    // thickness.
    assert_eq!(of(0.5, 10.0), TipFeed { mm_min: 200.0, law: FeedLaw::ChipThickness });
    assert_eq!(of(0.125, 10.0), TipFeed { mm_min: 800.0, law: FeedLaw::ChipThickness });
    assert_eq!(of(0.125, 40.0), TipFeed { mm_min: 500.0, law: FeedLaw::RemovalRate });
    assert_eq!(of(0.0, 10.0), TipFeed { mm_min: 1000.0, law: FeedLaw::Given });
}
