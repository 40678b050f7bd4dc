//! Times of a program as its text says it: the whole of it, with the ways to the part and home.

use std::collections::BTreeMap;

use facemill_feedrate::{FeedLimit, rapid_time};
use facemill_nc_program::{Dialect, MotionKind, ProgramReader, RtcpRapids};
use rayon::prelude::*;

use super::Tally;
use super::run::{Run, RunLaw, Timer};
use super::tolerance::View;
use crate::Failure;
use crate::follow::{Follower, Surroundings, Way, legs};
use crate::moves::MoveKind;
use crate::program::Timed;
use crate::refeed_law::{Moves, stands};

/// A program's text and what it was written from.
pub(crate) struct TimedText<'a> {
    pub text: &'a str,
    pub dialect: Dialect,
    /// What the control does at rapid rate under RTCP.
    pub rapids: RtcpRapids,
    /// Line of the text of every block of the program.
    pub block_lines: &'a [u32],
}

/// What a motion of the text is: its kind, and what sets its feed.
#[derive(Clone, Copy)]
struct Meant {
    kind: MoveKind,
    limit: Option<FeedLimit>,
}

/// Takes the time of rapids and the times by the law from the text as it is read back: the same as anyone finds who reads it.
/// Where the axes are at the start, at home, it is known.
///
/// # Errors
/// None but for a fault in here.
pub(crate) fn time_text(
    views: &[View<'_>],
    at: Surroundings<'_>,
    written: &TimedText<'_>,
    timed: &mut Timed,
) -> Result<(), Failure> {
    let (machine, frame) = (at.machine, at.frame);
    let (moves, meant) = motions(at, written, timed).map_err(|e| Failure::Internal(format!("times: {e}")))?;
    let Some(told) = timed.time_law.take() else { return Ok(()) };
    let tolerance = machine.motion_law().control_tolerance;
    let timer = Timer::new(views, tolerance).map_err(|e| Failure::Internal(format!("time law: {e}")))?;
    let timer = timer.with_rounded_vectors(moves.vector_rounding(frame));
    let time = |run: &Run| timer.time(run);
    let laws: Result<Vec<RunLaw>, String> = moves.runs().par_iter().map(time).collect();
    let laws = laws.map_err(|e| Failure::Internal(format!("time law: {e}")))?;
    let mut tally = Tally { told, ..Tally::default() };
    let each = laws.iter().flat_map(|law| (0..law.times.len()).map(move |k| (law, k)));
    for ((law, k), meant) in each.zip(&meant) {
        let limit = law.limits.get(k).copied().flatten();
        tally.count(machine, meant.kind, meant.limit, law.times[k], limit);
    }
    timed.time_law = Some(tally.finish());
    Ok(())
}

/// The motions of the text in runs between stops, and what each is. Rapids are summed up.
fn motions(at: Surroundings<'_>, written: &TimedText<'_>, timed: &mut Timed) -> Result<(Moves, Vec<Meant>), String> {
    let view = (at.machine, at.tool_length);
    let planned: BTreeMap<u32, Meant> = timed
        .moves
        .iter()
        .filter_map(|m| Some((*written.block_lines.get(m.block)?, Meant { kind: m.kind, limit: m.limit })))
        .collect();
    let mut follower = Follower::new(at, written.dialect, written.rapids)?;
    let mut reader = ProgramReader::new(written.dialect);
    let (mut moves, mut meant) = (Moves::default(), Vec::new());
    timed.rapid_time = 0.0;
    for line in written.text.split_inclusive('\n') {
        // What is not understood is a finding of the run.
        let Ok(Some(block)) = reader.read_line(line.as_bytes()) else { continue };
        let stands = stands(&block);
        if stands {
            moves.stop();
        }
        match follower.block(&block) {
            Ok(Way::Rapid { positions, law }) => {
                for [from, to] in legs(&positions) {
                    timed.rapid_time += rapid_time(view.0, law, from, to, view.1);
                    moves.rapid(view, law, [from, to]);
                    meant.push(Meant { kind: MoveKind::Rapid, limit: None });
                }
                if block.motion.as_ref().is_some_and(|m| m.kind == MotionKind::ReferenceReturn) {
                    moves.stop();
                }
            }
            Ok(Way::Cut(cut)) => {
                moves.cut(&cut, cut.time.unwrap_or(0.0));
                let unknown = Meant { kind: MoveKind::Approach, limit: None };
                meant.push(planned.get(&block.line).copied().unwrap_or(unknown));
            }
            Ok(Way::Stands) => {}
            Ok(Way::Other(_)) => moves.stop(),
            Err(_) => {
                follower.forget();
                moves.stop();
            }
        }
        if stands {
            moves.stop();
        }
    }
    Ok((moves, meant))
}
