//! Times of a program by its text.

use std::collections::BTreeMap;
use std::ops::Range;

use facemill_feedrate::{FeedLimit, rapid_time};
use facemill_inverse_kinematics::Machine;
use facemill_job::format::program_times::{NoLawReason, ProgramTimes};
use facemill_nc_program::Dialect;
use facemill_nc_program::dialect::{ControlMotion, RtcpRapids};
use facemill_nc_program::read::{MotionKind, ProgramReader};
use facemill_tool_path::moves::MoveKind;
use facemill_virtual_machine::motion::axis_motion::{AxisMotion, MotionContext, MotionReader, legs};
use facemill_virtual_machine::program_time::program_moves::{MoveRuns, is_standstill};
use facemill_virtual_machine::program_time::run::{RunLaw, Timer, missing_limits};
use facemill_virtual_machine::program_time::tolerance::MachineView;
use nalgebra::Isometry3;
use rayon::prelude::*;

/// Text of a program and its dialect and control.
pub struct TimedText<'a> {
    /// Text.
    pub text: &'a [u8],
    /// Dialect that it is read by.
    pub dialect: Dialect,
    /// How the control runs its blocks.
    pub control: &'a ControlMotion,
    /// Motion of the control at rapid rate under RTCP.
    pub rapids: RtcpRapids,
    /// Line of the text of every block of the program.
    pub block_lines: &'a [u32],
    /// Lines that are timed; all others are only followed.
    pub lines: Range<u32>,
}

/// All lines of a text.
pub const ALL_LINES: Range<u32> = 0..u32::MAX;

/// Meaning of a motion of the text: its kind, and the origin of its feed.
#[derive(Clone, Copy)]
pub struct Meant {
    /// Line of the text.
    pub line: u32,
    /// Kind of the move.
    pub kind: MoveKind,
    /// Origin of its feed; `None` for rapids.
    pub limit: Option<FeedLimit>,
}

/// Returns the times of a text from any source, at `constant` speeds ([cuts, rapids] in s) and by
/// the motion law: the same for every reader.
pub fn times_of_text(
    views: &[MachineView<'_>],
    at: MotionContext<'_>,
    written: &TimedText<'_>,
    constant: [f64; 2],
) -> ProgramTimes {
    let machine = at.machine;
    let missing = missing_limits(machine);
    if !missing.is_empty() {
        let missing = missing.iter().map(|limit| NoLawReason::Text(limit.to_string()));
        return ProgramTimes::constant(constant, missing.collect());
    }
    let text = |why: String| NoLawReason::Text(format!("unknown within acceleration: {why}"));
    let laws = motions(at, written, &BTreeMap::new()).map_err(text).and_then(|motions| match motions.not_followed {
        Some(why) => Err(why),
        None => Ok((motions.laws(views, machine, written.control).map_err(text)?, motions.meant)),
    });
    let (laws, meant) = match laws {
        Ok(known) => known,
        Err(why) => return ProgramTimes::constant(constant, vec![why]),
    };
    let mut sums = [0.0; 2];
    for (time, meant) in laws.iter().flat_map(|law| &law.times).zip(&meant) {
        sums[usize::from(meant.kind == MoveKind::Rapid)] += time;
    }
    ProgramTimes::by_law(constant, sums)
}

/// Motions of a text.
#[derive(Default)]
pub struct Motions {
    /// Motions in runs between stops.
    pub moves: MoveRuns,
    /// Meaning of each motion.
    pub meant: Vec<Meant>,
    /// Time of each at its feed, or at the axes' largest velocities, without acceleration, s.
    pub constant_times: Vec<f64>,
    /// Time of all rapids at the axes' largest velocities, s.
    pub rapid_time: f64,
    /// The first motion of unknown path or feed.
    pub not_followed: Option<NoLawReason>,
    /// Frame of coordinates under RTCP.
    pub frame: Option<Isometry3<f64>>,
}

impl Motions {
    /// Returns the times of each run.
    pub fn laws(
        &self,
        views: &[MachineView<'_>],
        machine: &Machine,
        control: &ControlMotion,
    ) -> Result<Vec<RunLaw>, String> {
        let timer = Timer::new(views, machine.motion_law().control_tolerance).map_err(|e| e.to_string())?;
        let timer = timer.on_control(control).with_rounded_vectors(self.moves.vector_rounding(self.frame));
        self.moves.runs().par_iter().map(|run| timer.time(run)).collect()
    }
}

/// Returns the motions of the text in runs between stops, and the meaning of each.
pub fn motions(
    at: MotionContext<'_>,
    written: &TimedText<'_>,
    planned: &BTreeMap<u32, Meant>,
) -> Result<Motions, String> {
    let view = (at.machine, at.tool_length);
    let mut all = Motions { frame: at.frame, ..Motions::default() };
    let unknown = |line: u32, why: &str| NoLawReason::Line { file: None, line, why: why.to_owned() };
    let mut follower = MotionReader::new(at, written.dialect, written.rapids);
    let mut reader = ProgramReader::new(written.dialect);
    for line in written.text.split_inclusive(|byte| *byte == b'\n') {
        // Text that is not understood is a finding of the run.
        let Ok(Some(block)) = reader.read_line(line) else { continue };
        if !written.lines.contains(&block.line) {
            if follower.block(&block).is_err() {
                follower.forget();
            }
            continue;
        }
        let stops = is_standstill(&block);
        if stops {
            all.moves.stop();
        }
        match follower.block(&block) {
            Ok(AxisMotion::Rapid { positions, law }) => {
                for [from, to] in legs(&positions) {
                    let time = rapid_time(view.0, law, from, to, view.1);
                    all.rapid_time += time;
                    all.constant_times.push(time);
                    all.moves.rapid(view, law, [from, to]);
                    all.meant.push(Meant { line: block.line, kind: MoveKind::Rapid, limit: None });
                }
                if block.motion.as_ref().is_some_and(|m| m.kind == MotionKind::ReferenceReturn) {
                    all.moves.stop();
                }
            }
            Ok(AxisMotion::Cut(cut)) => {
                if cut.time.is_none() && !cut.is_free() {
                    all.not_followed.get_or_insert_with(|| unknown(block.line, " cuts without a feed"));
                }
                all.moves.cut(&cut, cut.time.unwrap_or(0.0));
                all.constant_times.push(cut.time.unwrap_or(0.0));
                let meant = Meant { line: block.line, kind: MoveKind::Approach, limit: None };
                all.meant.push(planned.get(&block.line).copied().unwrap_or(meant));
            }
            Ok(AxisMotion::None) => {}
            Ok(AxisMotion::Other(_)) => {
                all.moves.stop();
                let why = " is not a straight move between known positions";
                all.not_followed.get_or_insert_with(|| unknown(block.line, why));
            }
            Err(why) => {
                follower.forget();
                all.moves.stop();
                all.not_followed.get_or_insert_with(|| unknown(block.line, &format!(": {why}")));
            }
        }
        if stops {
            all.moves.stop();
        }
    }
    Ok(all)
}

#[cfg(test)]
#[path = "../tests/unit/text_times.rs"]
mod tests;
