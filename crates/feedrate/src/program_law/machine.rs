use facemill_inverse_kinematics::{AxisLetter, AxisValues, Machine};

use super::ProgramBlock;
use crate::block_feed::tip_time;
use crate::plan::{FeedBlock, PlanFeedsError};
use crate::time_law::AxisBounds;

/// An axis whose machine file lacks an acceleration or jerk.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the machine gives no {what} for axis {letter}: add it to the machine file to time programs")]
pub struct MissingLimit {
    /// The axis.
    pub letter: AxisLetter,
    /// `acceleration` or `jerk`.
    pub what: &'static str,
}

/// Returns the limits of all axes of a machine, in axis order.
///
/// # Errors
/// The first axis without a largest acceleration or jerk.
pub fn machine_bounds(machine: &Machine) -> Result<Vec<AxisBounds>, MissingLimit> {
    let bounds = |axis| {
        AxisBounds::of_axis(axis).ok_or(MissingLimit {
            letter: axis.letter,
            what: if axis.max_acceleration.is_none() { "acceleration" } else { "jerk" },
        })
    };
    machine.axes().iter().map(bounds).collect()
}

/// Returns the blocks of [`plan_feeds`](crate::plan::plan_feeds) for
/// [`program_law`](crate::program_law): each with the least time that its tip feed requires, Dc/Fc
/// of FEED (4), where Dc is the distance of the tip's two positions. None stops.
///
/// Together they time a sequence of moves on a machine without any NC text:
///
/// ```
/// use facemill_feedrate::{FeedBlock, ProgramSettings, machine_bounds, program_blocks, program_law};
/// use facemill_inverse_kinematics::{AxisValues, Machine};
///
/// let machine = Machine::head_b_table_c()?;
/// let start = AxisValues::from([800.0, 0.0, 600.0, 0.0, 0.0]);
/// let end = AxisValues::from([900.0, 0.0, 600.0, 0.0, 0.0]);
/// let blocks = program_blocks(&machine, 250.0, &start, &[FeedBlock { end, tip_feed: 6000.0 }])?;
/// let law = program_law(&start, &blocks, &machine_bounds(&machine)?, &ProgramSettings::stopping())?;
/// assert!(law.total_time() > 1.0, "100 mm at 100 mm/s, from rest to rest");
/// assert_eq!(law.block_ends(), [law.total_time()], "for a program of many blocks: when each is done");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// For the first block whose tip feed is not above 0 or whose positions are not finite.
pub fn program_blocks(
    machine: &Machine,
    tool_length: f64,
    start: &AxisValues,
    blocks: &[FeedBlock],
) -> Result<Vec<ProgramBlock>, PlanFeedsError> {
    let mut tip = machine.cl_point(start, tool_length).tip;
    let mut out = Vec::with_capacity(blocks.len());
    for (block, b) in blocks.iter().enumerate() {
        let next = machine.cl_point(&b.end, tool_length).tip;
        let tip_time = tip_time((next - tip).norm(), b.tip_feed).map_err(|source| PlanFeedsError { block, source })?;
        out.push(ProgramBlock { end: b.end, tip_time, exact_stop: false });
        tip = next;
    }
    Ok(out)
}
