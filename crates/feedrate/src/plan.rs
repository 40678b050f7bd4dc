//! Feeds of a sequence of blocks.

use facemill_cl_data::RapidLaw;
use facemill_inverse_kinematics::{AxisValues, BlockLaw, Machine, Motion};

use crate::block_feed::{BlockFeed, FeedError, feed_for_block, g94_length};

/// A cutting block to be timed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedBlock {
    /// Axis values at its end; it starts where the one before it ends.
    pub end: AxisValues,
    /// Programmed speed of the tip, mm/min.
    pub tip_feed: f64,
}

/// The block of a sequence that has no feed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("block {block}: {source}")]
pub struct PlanFeedsError {
    /// Index of the block, from 0.
    pub block: usize,
    /// Fault.
    pub source: FeedError,
}

/// Returns feed and time of every block of a sequence of cutting moves that starts at `start`; tip
/// distances come from the forward kinematics of the machine (FEED (3)).
///
/// # Errors
/// For the first block without a feed; see [`feed_for_block`].
pub fn plan_feeds(
    machine: &Machine,
    tool_length: f64,
    start: &AxisValues,
    blocks: &[FeedBlock],
) -> Result<Vec<BlockFeed>, PlanFeedsError> {
    let range = machine.feed_range();
    let mut at = *start;
    let mut tip = machine.cl_point(&at, tool_length).tip;
    let mut feeds = Vec::with_capacity(blocks.len());
    for (block, b) in blocks.iter().enumerate() {
        let next_tip = machine.cl_point(&b.end, tool_length).tip;
        let distance = (next_tip - tip).norm();
        let feed = feed_for_block(machine.axes(), &at, &b.end, distance, b.tip_feed, &range)
            .map_err(|source| PlanFeedsError { block, source })?;
        feeds.push(feed);
        (at, tip) = (b.end, next_tip);
    }
    Ok(feeds)
}

/// Returns the time of a rapid under a law, s: every axis at its largest speed, and, unless each
/// axis moves by itself, no faster than the control's rapid feed. Where the tip moves straight and
/// the axes unevenly, the slowest axis at its fastest part sets the time. Acceleration is ignored,
/// so the time is a lower bound.
pub fn rapid_time(
    machine: &Machine,
    law: impl Into<BlockLaw>,
    start: &AxisValues,
    end: &AxisValues,
    tool_length: f64,
) -> f64 {
    let law = law.into();
    let by_axes = match law {
        BlockLaw::Rapid(_) => machine.travel_time(start, end),
        BlockLaw::Cutting(_) => following_time(machine, law, start, end, tool_length),
    };
    match machine.feed_range().rapid.filter(|_| law != BlockLaw::Rapid(RapidLaw::PerAxis)) {
        Some(feed) => by_axes.max(60.0 * g94_length(machine.axes(), start, end) / feed),
        None => by_axes,
    }
}

/// Number of parts of a way over which the speeds of axes that follow the tip are evaluated: an
/// axis that turns evenly by 180° has its peak speed within 0.2 % of the value of a part.
const PARTS: u32 = 32;

/// Returns the time of a block whose parts all take equally long.
fn following_time(machine: &Machine, law: BlockLaw, start: &AxisValues, end: &AxisValues, tool_length: f64) -> f64 {
    let whole = machine.travel_time(start, end);
    let Ok(motion) = Motion::new(machine, law, start, end, tool_length) else { return whole };
    let at = |k: u32| motion.at(f64::from(k) / f64::from(PARTS)).ok();
    let of_part = |k: u32| Some(f64::from(PARTS) * machine.travel_time(&at(k)?, &at(k + 1)?));
    (0..PARTS).filter_map(of_part).fold(whole, f64::max)
}
