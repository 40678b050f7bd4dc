//! Speed of the tool tip that a move is programmed with: the user's, and what chips make of it.

use facemill_tool_path::chips::Chip;
use facemill_tool_path::moves::MoveKind;

use crate::format::job_file::FeedsFile;

/// What set the tip feed of a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeedLaw {
    /// The job's feed.
    Given,
    /// There is nothing to cut.
    Air,
    /// The removal rate, or the smallest feed that it may lead to.
    RemovalRate,
    /// The chip thickness.
    ChipThickness,
}

/// A tip feed and what set it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipFeed {
    /// Speed of the tip, mm/min.
    pub mm_min: f64,
    /// What has set it.
    pub law: FeedLaw,
}

/// cm³ in mm³.
pub const CM3: f64 = 1000.0;

/// Speed of the tool tip that a move is programmed with: in cuts as chips allow; on entries and exits in the
/// stock the approach feed, but not faster than the cut that they belong to; outside the approach feed.
pub fn programmed_feed(feeds: &FeedsFile, teeth: u32, kind: MoveKind, chip: Option<&Chip>) -> TipFeed {
    let approach = TipFeed { mm_min: feeds.approach_mm_min, law: FeedLaw::Given };
    match kind {
        MoveKind::Cut => cutting_feed(feeds, teeth, chip),
        MoveKind::Engage => {
            let cut = cutting_feed(feeds, teeth, chip);
            let cut = if cut.law == FeedLaw::Air { given(feeds) } else { cut };
            if cut.mm_min < approach.mm_min { cut } else { approach }
        }
        MoveKind::Approach | MoveKind::Rapid => approach,
    }
}

fn given(feeds: &FeedsFile) -> TipFeed {
    TipFeed { mm_min: feeds.cutting_mm_min, law: FeedLaw::Given }
}

/// Speed of the tool tip in a cut that takes this chip: the job's, lowered to the target of the removal rate, but not
/// below its smallest feed, then to the chip thickness, below that feed, too; in air the feed of air.
fn cutting_feed(feeds: &FeedsFile, teeth: u32, chip: Option<&Chip>) -> TipFeed {
    let Some(chip) = chip else { return given(feeds) };
    if let (true, Some(mm_min)) = (chip.is_air, feeds.air_mm_min) {
        return TipFeed { mm_min, law: FeedLaw::Air };
    }
    let mut feed = given(feeds);
    if let Some(removal) = &feeds.removal_rate {
        let mm_min = (CM3 * removal.target_cm3_min / chip.area).max(removal.min_mm_min);
        if mm_min < feed.mm_min {
            feed = TipFeed { mm_min, law: FeedLaw::RemovalRate };
        }
    }
    if let Some(thickness) = &feeds.chip_thickness {
        let mm_min = thickness.max_mm / chip.thickness * teeth_per_minute(feeds, teeth);
        if mm_min < feed.mm_min {
            feed = TipFeed { mm_min, law: FeedLaw::ChipThickness };
        }
    }
    feed
}

/// Teeth that come to the same place per minute: the tip feed over it is the feed per tooth, mm.
pub fn teeth_per_minute(feeds: &FeedsFile, teeth: u32) -> f64 {
    feeds.spindle_rpm * f64::from(teeth)
}

/// Whether an operation's feeds depend on chips.
pub fn depends_on_chips(feeds: &FeedsFile) -> bool {
    feeds.removal_rate.is_some() || feeds.chip_thickness.is_some() || feeds.air_mm_min.is_some()
}

/// Tip feed of a cutting move and what it would be by the job's feed alone.
#[derive(Clone, Copy, Debug)]
pub struct CutFeed {
    /// What it was programmed with.
    pub asked: TipFeed,
    /// Speed that the tip would reach at the job's cutting feed, mm/min: by the law where there is one.
    pub before: f64,
    /// Time of the move less the time that it would take at the job's cutting feed, s; both by the law where there is one.
    pub added_time: f64,
}

#[cfg(test)]
mod tests {
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
    fn air_has_its_own_feed_and_entries_have_not() {
        let feeds = feeds(&json!({ "air_mm_min": 4000.0, "approach_mm_min": 5000.0 }));
        let of = |kind, area: f64| programmed_feed(&feeds, 4, kind, Some(&chip(area))).mm_min;
        assert_eq!([of(MoveKind::Cut, 0.0), of(MoveKind::Cut, 1e-9)], [4000.0, 1000.0]);
        assert_eq!(of(MoveKind::Engage, 0.0), 1000.0);
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
        // 500 turns with 4 teeth: at 200 mm/min a feed of 0.1 mm per tooth, half of which is the thickness.
        assert_eq!(of(0.5, 10.0), TipFeed { mm_min: 200.0, law: FeedLaw::ChipThickness });
        assert_eq!(of(0.125, 10.0), TipFeed { mm_min: 800.0, law: FeedLaw::ChipThickness });
        assert_eq!(of(0.125, 40.0), TipFeed { mm_min: 500.0, law: FeedLaw::RemovalRate });
        assert_eq!(of(0.0, 10.0), TipFeed { mm_min: 1000.0, law: FeedLaw::Given });
    }
}
