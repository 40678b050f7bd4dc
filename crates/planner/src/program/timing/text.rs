//! Times of a program according to its text: all of it, with the moves to the part and home.

use std::collections::BTreeMap;

use facemill_job::failure::Failure;
use facemill_tool_path::moves::MoveKind;
use facemill_verification::text_times::{Meant, TimedText, motions};
use facemill_virtual_machine::motion::axis_motion::MotionContext;
use facemill_virtual_machine::program_time::tolerance::MachineView;

use crate::program::timed::{LineTime, Timed, TimedMove};
use crate::program::timing::Tally;

/// Replaces the time of rapids and the times by the law by those of the text as read back: the same
/// as for every reader. The position of the axes at the start, home, is known.
///
/// # Errors
/// Only an internal fault.
pub(crate) fn time_text(
    views: &[MachineView<'_>],
    at: MotionContext<'_>,
    written: &TimedText<'_>,
    timed: &mut Timed,
) -> Result<(), Failure> {
    let machine = at.machine;
    let planned = planned_blocks(written, timed);
    let internal = |e: String| Failure::Internal(format!("times: {e}"));
    let motions = motions(at, written, &planned).map_err(internal)?;
    timed.rapid_time = motions.rapid_time;
    let at = |(meant, time): (&Meant, f64)| LineTime { line: meant.line, kind: meant.kind, time };
    let Some(report) = timed.time_law.take() else {
        timed.line_times = motions.meant.iter().zip(motions.constant_times.iter().copied()).map(at).collect();
        return Ok(());
    };
    let laws = motions.laws(views, machine, written.control).map_err(internal)?;
    let meant = motions.meant;
    timed.line_times = meant.iter().zip(laws.iter().flat_map(|law| &law.times).copied()).map(at).collect();
    let mut tally = Tally { report, ..Tally::default() };
    let each = laws.iter().flat_map(|law| (0..law.times.len()).map(move |k| (law, k)));
    for ((law, k), meant) in each.zip(&meant) {
        let limit = law.limits.get(k).copied().flatten();
        tally.count(machine, meant.kind, meant.limit, law.times[k], limit);
        if meant.kind == MoveKind::Cut {
            *timed.cut_times.entry(meant.line).or_default() += law.times[k];
        }
    }
    timed.time_law = Some(tally.finish());
    Ok(())
}

/// Returns the meaning of the blocks of a planned program, by the lines of its text.
fn planned_blocks(written: &TimedText<'_>, timed: &Timed) -> BTreeMap<u32, Meant> {
    let of = |m: &TimedMove| {
        let line = *written.block_lines.get(m.block)?;
        Some((line, Meant { line, kind: m.kind, limit: m.limit }))
    };
    timed.moves.iter().filter_map(of).collect()
}
