//! Programmed speed of the tool tip: the user's, modified for chips.

use facemill_tool_path::chips::Chip;
use facemill_tool_path::moves::MoveKind;

use crate::format::job_file::FeedsFile;

/// Origin of the tip feed of a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FeedLaw {
    /// The job's feed.
    Given,
    /// The cut is in air.
    Air,
    /// The removal rate, or its smallest feed.
    RemovalRate,
    /// The chip thickness.
    ChipThickness,
}

/// Tip feed and its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipFeed {
    /// Speed of the tip, mm/min.
    pub mm_min: f64,
    /// Its origin.
    pub law: FeedLaw,
}

/// cm³ in mm³.
pub const CM3: f64 = 1000.0;

/// Returns the programmed speed of the tool tip: in cuts as chips allow; on entries and exits in
/// the stock the approach feed, and on turns the feed of turns, but at most that of their cut; on
/// entries and exits outside the stock the approach feed, or that of air if it is higher.
pub fn programmed_feed(feeds: &FeedsFile, teeth: u32, kind: MoveKind, chip: Option<&Chip>) -> TipFeed {
    let approach = TipFeed { mm_min: feeds.approach_mm_min, law: FeedLaw::Given };
    match kind {
        MoveKind::Cut => cutting_feed(feeds, teeth, chip),
        MoveKind::Engage => at_most_cutting(feeds, teeth, chip, approach),
        MoveKind::Turn => {
            let mm_min = feeds.turn_mm_min.unwrap_or(feeds.approach_mm_min);
            at_most_cutting(feeds, teeth, chip, TipFeed { mm_min, law: FeedLaw::Given })
        }
        MoveKind::Approach => match feeds.air_mm_min {
            Some(mm_min) if mm_min > approach.mm_min => TipFeed { mm_min, law: FeedLaw::Air },
            _ => approach,
        },
        MoveKind::Rapid => approach,
    }
}

/// Returns a feed in the stock outside passes: at most that of a cut with this chip.
fn at_most_cutting(feeds: &FeedsFile, teeth: u32, chip: Option<&Chip>, feed: TipFeed) -> TipFeed {
    let cut = cutting_feed(feeds, teeth, chip);
    let cut = if cut.law == FeedLaw::Air { given(feeds) } else { cut };
    if cut.mm_min < feed.mm_min { cut } else { feed }
}

fn given(feeds: &FeedsFile) -> TipFeed {
    TipFeed { mm_min: feeds.cutting_mm_min, law: FeedLaw::Given }
}

/// Returns the speed of the tool tip in a cut with this chip: the job's, lowered to the target of
/// the removal rate, but not below its smallest feed, then to the chip thickness, even below that
/// feed; in air the feed of air.
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

/// Returns the number of teeth that pass a place per minute: the tip feed divided by it is the feed
/// per tooth, mm.
pub fn teeth_per_minute(feeds: &FeedsFile, teeth: u32) -> f64 {
    feeds.spindle_rpm * f64::from(teeth)
}

/// Returns whether an operation's feeds depend on chips.
pub fn depends_on_chips(feeds: &FeedsFile) -> bool {
    feeds.removal_rate.is_some() || feeds.chip_thickness.is_some() || feeds.air_mm_min.is_some()
}

/// Tip feed of a cutting move, and the speed at the job's own feed.
#[derive(Clone, Copy, Debug)]
pub struct CutFeed {
    /// Programmed feed.
    pub programmed: TipFeed,
    /// Speed of the tip at the job's cutting feed, mm/min: by the motion law if there is one.
    pub before: f64,
    /// Time of the move less its time at the job's cutting feed, s; both by the motion law if there
    /// is one.
    pub added_time: f64,
}

#[cfg(test)]
#[path = "../../tests/unit/validate/tip_feed.rs"]
mod tests;
