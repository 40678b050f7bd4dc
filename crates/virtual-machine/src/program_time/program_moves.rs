//! Moves of a program in runs between stops.

use facemill_feedrate::{ProgramBlock, rapid_time};
use facemill_inverse_kinematics::{AxisValues, BlockLaw};
use facemill_nc_program::read::{MacroKind, ReadBlock, ReadCommand};
use nalgebra::Isometry3;

use crate::motion::axis_motion::StraightCut;
use crate::program_time::run::MotionRun;
use crate::program_time::tolerance::MachineView;
use crate::program_time::vectors::{VectorDecimals, VectorRounding};

/// Moves of a program in runs between stops.
#[derive(Default)]
pub struct MoveRuns {
    /// The runs, in their order.
    pub runs: Vec<MotionRun>,
    is_open: bool,
    /// Time of each cutting move at the feed that it had, s.
    pub before: Vec<f64>,
    decimals: VectorDecimals,
}

impl MoveRuns {
    /// The runs, in their order.
    pub fn runs(&self) -> &[MotionRun] {
        &self.runs
    }

    /// Returns the uncertainty of the text's tool vectors, given in the frame of its words.
    pub fn vector_rounding(&self, table_from_words: Option<Isometry3<f64>>) -> Option<VectorRounding> {
        let half = self.decimals.half();
        table_from_words.map(|table_from_words| VectorRounding { table_from_words, half })
    }

    /// The axes stand.
    pub fn stop(&mut self) {
        self.is_open = false;
    }

    /// A rapid. By the axes' speeds the law knows better; a rapid feed of the control caps as a tip
    /// feed does, and so does the slowest axis where the tip goes straight.
    pub fn rapid(&mut self, (machine, length): MachineView<'_>, law: BlockLaw, [from, to]: [&AxisValues; 2]) {
        let is_capped = machine.feed_range().rapid.is_some() || matches!(law, BlockLaw::Cutting(_));
        let time = if is_capped { rapid_time(machine, law, from, to, length) } else { 0.0 };
        self.push([from, to], None, time, true);
    }

    /// A cut that takes so long at constant speed.
    pub fn cut(&mut self, cut: &StraightCut, time: f64) {
        if let Some(vector) = &cut.vector {
            self.decimals.read(vector);
        }
        self.push([&cut.from, &cut.to], cut.vector, time, false);
    }

    fn push(&mut self, [from, end]: [&AxisValues; 2], vector: Option<[f64; 3]>, tip_time: f64, is_rapid: bool) {
        if !self.is_open || self.runs.last().is_none_or(|run| run.is_rapid != is_rapid) {
            self.runs.push(MotionRun { start: *from, blocks: Vec::new(), is_rapid, vectors: Vec::new() });
            self.is_open = true;
        }
        if let Some(run) = self.runs.last_mut() {
            run.blocks.push(ProgramBlock { end: *end, tip_time, exact_stop: false });
            // Most programs say none.
            if vector.is_some() || !run.vectors.is_empty() {
                run.vectors.resize(run.blocks.len() - 1, None);
                run.vectors.push(vector);
            }
        }
    }
}

/// Whether the axes stand for something that a block says. A tool vector is no such thing: it says
/// where a motion ends.
pub fn is_standstill(block: &ReadBlock) -> bool {
    use ReadCommand::{Call, Coolant, Dwell, End, Function, Macro, SpindleOff, SpindleOn, Stop, ToolChange};
    block.commands.iter().any(|command| match command {
        Macro { kind, .. } => *kind != MacroKind::ToolVector,
        Call(_)
        | Coolant(_)
        | Dwell(_)
        | End
        | Function(_)
        | SpindleOff
        | SpindleOn { .. }
        | Stop { .. }
        | ToolChange => true,
        _ => false,
    })
}
