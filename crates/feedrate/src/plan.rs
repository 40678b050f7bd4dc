use facemill_cl_data::RapidLaw;
use facemill_inverse_kinematics::{AxisValues, Machine};

use crate::{BlockFeed, FeedError, feed_for_block, g94_length};

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
    /// What is wrong with it.
    pub source: FeedError,
}

/// Feed and time of every block of a sequence of cutting moves that starts at `start`; tip distances come from the
/// forward kinematics of the machine (FEED (3)).
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

/// Time of a rapid, s: every axis at its largest speed, and under the linear law no faster than the control's rapid feed.
/// Acceleration is not counted, so it is a lower bound.
pub fn rapid_time(machine: &Machine, start: &AxisValues, end: &AxisValues) -> f64 {
    let by_axes = machine.travel_time(start, end);
    match (machine.motion_law().rapid, machine.feed_range().rapid) {
        (RapidLaw::Linear, Some(feed)) => by_axes.max(60.0 * g94_length(machine.axes(), start, end) / feed),
        _ => by_axes,
    }
}
