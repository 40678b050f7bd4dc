//! Blocks with their times.

use std::collections::BTreeMap;

use facemill_feedrate::FeedLimit;
use facemill_inverse_kinematics::AxisValues;
use facemill_job::format::report::TimeLawReport;
use facemill_job::validate::tip_feed::CutFeed;
use facemill_nc_program::NcProgram;
use facemill_tool_path::moves::MoveKind;

/// Program before it has a dialect, with its times.
#[derive(Default)]
pub(crate) struct Timed {
    /// Blocks.
    pub program: NcProgram,
    /// Time in passes, s.
    pub passes_time: f64,
    /// Time of the passes at their programmed feeds, whatever the axes reach, s.
    pub passes_feed_time: f64,
    /// Time in entries and exits, s.
    pub approach_time: f64,
    /// Time in rapids, s.
    pub rapid_time: f64,
    /// Length of the tip's path in passes, mm.
    pub passes_length: f64,
    /// Length of the tip's path in entries and exits, mm.
    pub approach_length: f64,
    /// Motion blocks.
    pub n_blocks: usize,
    /// Tip feed reached at every cutting move, mm/min, in program order.
    pub tip_feeds: Vec<f64>,
    /// Origin of it, for every cutting move.
    pub cut_feeds: Vec<CutFeed>,
    /// Index among the program's blocks of the first one of each operation.
    pub operation_starts: Vec<usize>,
    /// Blocks along passes.
    pub cut_blocks: Vec<CutBlock>,
    /// Index among the program's blocks of every move.
    pub move_blocks: Vec<usize>,
    /// Every move with its time at constant speeds.
    pub moves: Vec<TimedMove>,
    /// Times by the motion law, if the machine has one.
    pub time_law: Option<TimeLawReport>,
    /// Whether the effect of chips on feeds is reported by the law.
    pub chips_by_law: bool,
    /// Time of cutting blocks by the law, s, by their lines in the text; empty if there is no law.
    pub cut_times: BTreeMap<u32, f64>,
    /// Time of every motion of the text, in its order; by the law if there is one.
    pub line_times: Vec<LineTime>,
    /// Missing limits of the law.
    pub no_time_law: Vec<String>,
}

impl Timed {
    /// Lengthens the times of moves at constant speeds by these factors, and slows tip feeds
    /// accordingly.
    pub(crate) fn slow_down(&mut self, factors: &[f64]) {
        let mut tip_feeds = self.tip_feeds.iter_mut();
        for (m, factor) in self.moves.iter_mut().zip(factors) {
            let longer = m.time * (factor - 1.0);
            m.time += longer;
            match m.kind {
                MoveKind::Cut => {
                    self.passes_time += longer;
                    tip_feeds.by_ref().take(1).for_each(|feed| *feed /= factor);
                }
                MoveKind::Approach | MoveKind::Engage | MoveKind::Turn => self.approach_time += longer,
                MoveKind::Rapid => self.rapid_time += longer,
            }
        }
    }
}

/// Time of a motion of the text.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LineTime {
    /// Line, from 1.
    pub line: u32,
    /// Kind of the move.
    pub kind: MoveKind,
    /// Time, s.
    pub time: f64,
}

/// Motion block with its time at constant speeds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TimedMove {
    /// Its index among the program's blocks.
    pub block: usize,
    /// Axis values at its end, as planned.
    pub axes: AxisValues,
    /// Kind of the move.
    pub kind: MoveKind,
    /// Time, s.
    pub time: f64,
    /// Time at the job's own feeds, regardless of chips, s.
    pub given_time: f64,
    /// Origin of the feed; `None` for rapids.
    pub limit: Option<FeedLimit>,
}

/// Block of the program that ends at a cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct CutBlock {
    /// Index of the operation.
    pub operation: usize,
    /// Index of its piece.
    pub piece: usize,
    /// Index of the piece's cut that the block ends at; at least 1.
    pub cut: usize,
    /// Index of the piece's move.
    pub at: usize,
    /// Index among the program's blocks.
    pub block: usize,
}
