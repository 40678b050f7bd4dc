//! Feed of one block that moves the tip at its programmed speed (FEED).

use facemill_inverse_kinematics::{Axis, AxisValues, FeedRange};

/// Feed and time of one block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockFeed {
    /// F word in G94 (Fn of FEED (6)): mm/min as the norm over all axes, 1 deg counted as 1 mm.
    /// Within the control's range.
    pub f_word: f64,
    /// Time of the block, s.
    pub time: f64,
    /// Speed that the tip reaches, mm/min: chord of the tip over time.
    pub tip_feed: f64,
    /// Limit that sets the time.
    pub limit: FeedLimit,
}

/// Limit that sets the time of a block.
///
/// Exhaustive, so that a new one is handled everywhere: reports count each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeedLimit {
    /// The tip moves at the programmed speed.
    TipFeed,
    /// This axis (by index) moves at its largest speed, and the tip more slowly (FEED (7), (8)).
    Axis(usize),
    /// The control accepts no larger F; the tip moves more slowly.
    ControlMax,
    /// The control accepts no smaller F; the tip moves faster, no axis beyond its largest speed.
    ControlMin,
    /// No axis moves. The time is 0 and the F word the programmed tip feed, brought into the
    /// control's range.
    NoMotion,
}

impl FeedLimit {
    /// Returns the index of the axis that limits the feed, if one does.
    pub fn axis(self) -> Option<usize> {
        match self {
            Self::Axis(index) => Some(index),
            _ => None,
        }
    }
}

impl BlockFeed {
    /// Returns the F word in G93 (inverse time): blocks per minute. `None` for a block without
    /// motion.
    pub fn inverse_time(&self) -> Option<f64> {
        (self.time > 0.0).then(|| 60.0 / self.time)
    }
}

/// Reason why a block has no feed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FeedError {
    /// The programmed speed of the tip is not a positive number.
    #[error("the programmed tip feed is {tip_feed} mm/min, but has to be above 0")]
    BadTipFeed {
        /// Programmed speed, mm/min.
        tip_feed: f64,
    },
    /// A position or distance is not finite, or the distance is negative.
    #[error("the block's positions or its tip distance are not finite")]
    NotFinite,
    /// The axes limit the block to an F below the smallest one of the control, which would move an
    /// axis beyond its speed.
    #[error(
        "the block needs F{f_word:.4}, the control's smallest F is {min} and would take axis {axis} beyond its speed"
    )]
    MinimumExceedsAxis {
        /// Index of the axis.
        axis: usize,
        /// The F that the block needs, mm/min.
        f_word: f64,
        /// Smallest F of the control, mm/min.
        min: f64,
    },
}

/// Returns the length of a block as a control in G94 counts it: the norm over all axes, rotary ones
/// in degrees with 1 deg as 1 mm (FEED (1)).
pub fn g94_length(axes: &[Axis], start: &AxisValues, end: &AxisValues) -> f64 {
    travels(axes, start, end).fold(0.0, f64::hypot)
}

/// Returns the travel of every axis in the unit of NC words.
fn travels<'a>(axes: &'a [Axis], start: &'a AxisValues, end: &'a AxisValues) -> impl Iterator<Item = f64> + 'a {
    axes.iter().enumerate().map(|(k, a)| a.in_word_unit(end.get_or_zero(k) - start.get_or_zero(k)))
}

/// Returns the feed at which the tip moves at `tip_feed` (mm/min), or as fast as axes and control
/// allow (FEED (3)–(8)).
///
/// `tip_distance` is Dc, the distance of the tip's two positions in the workpiece frame, mm. The
/// block's time is the largest of Dc/Fc (4) and the times that the axes need at their largest
/// speeds, which is equivalent to (7) and (8); so the axes time a block in which the tip does not
/// move. The F word is then limited to the control's range.
///
/// # Errors
/// When `tip_feed` is not above 0, an input is not finite, or the control's smallest F would
/// overload an axis.
pub fn feed_for_block(
    axes: &[Axis],
    start: &AxisValues,
    end: &AxisValues,
    tip_distance: f64,
    tip_feed: f64,
    range: &FeedRange,
) -> Result<BlockFeed, FeedError> {
    let tip_time = tip_time(tip_distance, tip_feed)?;
    let TimedFeed { f_word, time, limit } = timed(axes, start, end, tip_time, range)?.unwrap_or(TimedFeed {
        f_word: tip_feed.max(range.min).min(range.max),
        time: 0.0,
        limit: FeedLimit::NoMotion,
    });
    let tip_feed = if time > 0.0 { 60.0 * tip_distance / time } else { 0.0 };
    Ok(BlockFeed { f_word, time, tip_feed, limit })
}

/// Returns the time in which a tip moves this far (mm) at its programmed speed (mm/min), s.
pub(crate) fn tip_time(tip_distance: f64, tip_feed: f64) -> Result<f64, FeedError> {
    let positive = tip_feed > 0.0 && tip_feed.is_finite();
    if !positive {
        return Err(FeedError::BadTipFeed { tip_feed });
    }
    let known = tip_distance.is_finite() && tip_distance >= 0.0;
    if known { Ok(60.0 * tip_distance / tip_feed) } else { Err(FeedError::NotFinite) }
}

/// F word (G94) and time of a block, and the limit that sets the time.
pub(crate) struct TimedFeed {
    pub(crate) f_word: f64,
    pub(crate) time: f64,
    pub(crate) limit: FeedLimit,
}

/// Returns the shortest time of a block that is not below `tip_time` (s) and moves no axis beyond
/// its largest speed, with the F word in the control's range; `None` where no axis moves.
pub(crate) fn timed(
    axes: &[Axis],
    start: &AxisValues,
    end: &AxisValues,
    tip_time: f64,
    range: &FeedRange,
) -> Result<Option<TimedFeed>, FeedError> {
    let length = g94_length(axes, start, end);
    if !length.is_finite() {
        return Err(FeedError::NotFinite);
    }
    let (axis, axis_time) = slowest_axis(axes, start, end);
    let (time, limit) =
        if axis_time > tip_time { (axis_time, FeedLimit::Axis(axis)) } else { (tip_time, FeedLimit::TipFeed) };
    let f_word = 60.0 * length / time;
    // 0/0, and travels that underflow.
    if !f_word.is_finite() || length == 0.0 {
        return Ok(None);
    }
    if f_word > range.max {
        let time = 60.0 * length / range.max;
        return Ok(Some(TimedFeed { f_word: range.max, time, limit: FeedLimit::ControlMax }));
    }
    if f_word >= range.min {
        return Ok(Some(TimedFeed { f_word, time, limit }));
    }
    let time = 60.0 * length / range.min;
    if time < axis_time {
        return Err(FeedError::MinimumExceedsAxis { axis, f_word, min: range.min });
    }
    Ok(Some(TimedFeed { f_word: range.min, time, limit: FeedLimit::ControlMin }))
}

/// Returns the axis that needs the longest at its largest speed, and that time, s. Among equal ones
/// the first.
fn slowest_axis(axes: &[Axis], start: &AxisValues, end: &AxisValues) -> (usize, f64) {
    let times =
        axes.iter().enumerate().map(|(k, a)| (k, (end.get_or_zero(k) - start.get_or_zero(k)).abs() / a.max_velocity));
    times.fold((0, 0.0), |slowest, t| if t.1 > slowest.1 { t } else { slowest })
}
