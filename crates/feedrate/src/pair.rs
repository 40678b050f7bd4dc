//! Feeds of blocks in which two heads move.

use facemill_inverse_kinematics::{Axis, AxisValues, FeedRange};

use crate::block_feed::{FeedError, FeedLimit, TimedFeed, timed, tip_time};

/// Feed and time of one block in which two heads move at once.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct PairFeed {
    /// F word in G94: mm/min as the norm over all axes of both heads, 1 deg counted as 1 mm. Within
    /// the control's range.
    pub f_word: f64,
    /// Time of the block, s, one for both heads.
    pub time: f64,
    /// Speeds that the two tips reach, mm/min: chord of the tip over time, also for a head that
    /// does not cut.
    pub tip_feeds: [f64; 2],
    /// Limit that sets the time.
    pub limit: PairLimit,
}

/// Limit that sets the time of a block of two heads.
///
/// Exhaustive, so that a new one is handled everywhere: reports name each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PairLimit {
    /// The tip of this head (0 or 1) moves at its programmed speed, the other one at most at its
    /// own.
    TipFeed(usize),
    /// Another [`FeedLimit`], never [`FeedLimit::TipFeed`]; axes are counted over both heads.
    Other(FeedLimit),
}

impl PairFeed {
    /// Returns the F word in G93 (inverse time): blocks per minute. `None` for a block without
    /// motion.
    #[must_use]
    pub fn inverse_time(&self) -> Option<f64> {
        (self.time > 0.0).then(|| 60.0 / self.time)
    }
}

/// Returns the feed of a block in which two heads move: the shortest time in which neither tip
/// exceeds its speed (`tip_feeds`, mm/min) and no axis of the two its largest one. One of these
/// limits is reached.
///
/// `axes` are those of the whole machine, `tip_distances` the distances of each tip's two positions
/// in the workpiece frame, mm. The F word is then limited to the control's range as in
/// [`feed_for_block`](crate::block_feed::feed_for_block), to which this is equal where one head
/// does not move. Only the control's smallest F can make a tip faster than programmed
/// ([`FeedLimit::ControlMin`]).
///
/// # Errors
/// When a programmed speed is not above 0, an input is not finite, or the control's smallest F
/// would overload an axis.
pub fn feed_for_pair(
    axes: &[Axis],
    start: &AxisValues,
    end: &AxisValues,
    tip_distances: [f64; 2],
    tip_feeds: [Option<f64>; 2],
    range: &FeedRange,
) -> Result<PairFeed, FeedError> {
    let mut times = [0.0; 2];
    for head in 0..2 {
        // Without a programmed speed only the distance is checked.
        let time = tip_time(tip_distances[head], tip_feeds[head].unwrap_or(1.0))?;
        times[head] = if tip_feeds[head].is_some() { time } else { 0.0 };
    }
    let slower = usize::from(times[1] > times[0]);
    let Some(TimedFeed { f_word, time, limit }) = timed(axes, start, end, times[slower], range)? else {
        let slowest = tip_feeds.into_iter().flatten().reduce(f64::min).unwrap_or(range.min);
        let (f_word, limit) = (slowest.max(range.min).min(range.max), PairLimit::Other(FeedLimit::NoMotion));
        return Ok(PairFeed { f_word, time: 0.0, tip_feeds: [0.0; 2], limit });
    };
    let limit = if limit == FeedLimit::TipFeed { PairLimit::TipFeed(slower) } else { PairLimit::Other(limit) };
    Ok(PairFeed { f_word, time, tip_feeds: tip_distances.map(|d| 60.0 * d / time), limit })
}
