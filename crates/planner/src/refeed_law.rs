//! The law of motion of a program that exists: its moves from one reading, its feeds for the next.

use facemill_cl_data::ControlTolerance;
use facemill_feedrate::{BlockFeed, ProgramBlock, rapid_time};
use facemill_inverse_kinematics::{AxisValues, BlockLaw, FeedRange, Machine};
use facemill_nc_program::{ControlMotion, MacroKind, ReadBlock, ReadCommand};
use nalgebra::Isometry3;
use rayon::prelude::*;
use serde::Serialize;

use crate::follow::FollowedCut;
use crate::timing::{Run, Timer, VectorDecimals, VectorRounding, View, missing_limits, reachable};

/// How a program is timed with new feeds.
#[derive(Clone, Copy, Debug, Default)]
pub struct RefeedLaw {
    /// How far the control may take the tip off the program's lines, mm; 0 stops at every corner. `None`: as the machine file
    /// says.
    pub blend_tolerance: Option<f64>,
}

/// Times of a program with new feeds within velocity, acceleration and jerk of every axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RefeedLawTimes {
    /// Straight cutting blocks, s.
    pub cutting_time_s: f64,
    /// The same with the feeds of the program as it was; of blocks without a feed with the new ones.
    pub cutting_time_before_s: f64,
    /// Rapids, s.
    pub rapid_time_s: f64,
    /// Cutting blocks whose F was lowered to what the axes reach in them.
    pub lowered_blocks: usize,
    /// Whether the axes stop at every corner of the cuts, because there is no tolerance to blend them within, or too little.
    pub stops_at_corners: bool,
}

/// What is known of the law while a program is read.
pub(crate) enum Law {
    /// It is not asked for.
    Off,
    /// Moves are collected.
    Collecting(Moves),
    /// The time of each cutting move at its largest speed, in their order; how many have been used.
    Known(Vec<f64>, usize),
}

/// Moves of a program in runs between stops.
#[derive(Default)]
pub(crate) struct Moves {
    runs: Vec<Run>,
    is_open: bool,
    /// Time of each cutting move at the feed that it had, s.
    before: Vec<f64>,
    decimals: VectorDecimals,
}

impl Moves {
    /// The runs, in their order.
    pub(crate) fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// What the text leaves open of its tool vectors, which are told in the frame of its words.
    pub(crate) fn vector_rounding(&self, table_from_words: Option<Isometry3<f64>>) -> Option<VectorRounding> {
        let half = self.decimals.half();
        table_from_words.map(|table_from_words| VectorRounding { table_from_words, half })
    }

    /// The axes stand.
    pub(crate) fn stop(&mut self) {
        self.is_open = false;
    }

    /// A rapid. By the axes' speeds the law knows better; a rapid feed of the control caps as a tip feed does, and so does
    /// the slowest axis where the tip goes straight.
    pub(crate) fn rapid(&mut self, (machine, length): View<'_>, law: BlockLaw, [from, to]: [&AxisValues; 2]) {
        let is_capped = machine.feed_range().rapid.is_some() || matches!(law, BlockLaw::Cutting(_));
        let time = if is_capped { rapid_time(machine, law, from, to, length) } else { 0.0 };
        self.push([from, to], None, time, true);
    }

    /// A cut that takes so long at constant speed.
    pub(crate) fn cut(&mut self, cut: &FollowedCut, time: f64) {
        if let Some(vector) = &cut.vector {
            self.decimals.read(vector);
        }
        self.push([&cut.from, &cut.to], cut.vector, time, false);
    }

    fn push(&mut self, [from, end]: [&AxisValues; 2], vector: Option<[f64; 3]>, tip_time: f64, is_rapid: bool) {
        if !self.is_open || self.runs.last().is_none_or(|run| run.is_rapid != is_rapid) {
            self.runs.push(Run { start: *from, blocks: Vec::new(), is_rapid, vectors: Vec::new() });
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

/// Whether the axes stand for something that a block says. A tool vector is no such thing: it says where a motion ends.
pub(crate) fn stands(block: &ReadBlock) -> bool {
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

impl Law {
    /// The axes stand.
    pub(crate) fn stop(&mut self) {
        if let Self::Collecting(moves) = self {
            moves.stop();
        }
    }

    pub(crate) fn rapid(&mut self, view: View<'_>, law: BlockLaw, ends: [&AxisValues; 2]) {
        if let Self::Collecting(moves) = self {
            moves.rapid(view, law, ends);
        }
    }

    /// A cutting move of which F says nothing: as fast as the axes are.
    pub(crate) fn free(&mut self, cut: &FollowedCut) {
        match self {
            Self::Off => {}
            Self::Collecting(moves) => {
                moves.cut(cut, 0.0);
                moves.before.push(0.0);
            }
            Self::Known(_, used) => *used += 1,
        }
    }

    /// A cutting move with its feed at constant speed; lowers that to what the axes reach, and says whether.
    ///
    /// Its own time is that at the feed that it had.
    pub(crate) fn cut(&mut self, cut: &FollowedCut, fed: &mut BlockFeed, range: &FeedRange) -> bool {
        match self {
            Self::Off => false,
            Self::Collecting(moves) => {
                moves.cut(cut, fed.time);
                moves.before.push(cut.time.unwrap_or(fed.time));
                false
            }
            Self::Known(peak_times, used) => {
                let peak_time = peak_times.get(*used).copied().unwrap_or(0.0);
                *used += 1;
                let Some(time) = reachable(fed.time, peak_time) else { return false };
                let f_word = (fed.f_word * fed.time / time).max(range.min);
                if f_word >= fed.f_word {
                    return false;
                }
                let factor = fed.f_word / f_word;
                *fed = BlockFeed { f_word, time: fed.time * factor, tip_feed: fed.tip_feed / factor, ..*fed };
                true
            }
        }
    }
}

/// Tolerances of corners from the least to the most, mm. Smaller ones are below what a control's scales show; with larger ones
/// the motion is that of another program.
pub const BLEND_TOLERANCES: [f64; 2] = [1e-6, 10.0];

/// The tolerance that a program's corners are blended with.
///
/// # Errors
/// When the machine lacks a limit, or the tolerance is none.
pub(crate) fn blending(machine: &Machine, law: &RefeedLaw) -> Result<ControlTolerance, String> {
    let missing: Vec<String> =
        missing_limits(machine).iter().map(|m| format!("{} for axis {}", m.what, m.letter)).collect();
    if !missing.is_empty() {
        return Err(format!(
            "--time-law: the machine \"{}\" gives no {}: add it to the machine file to time programs",
            machine.name(),
            missing.join(", ")
        ));
    }
    let own = machine.motion_law().control_tolerance;
    match law.blend_tolerance {
        None => Ok(own),
        Some(path) if path == 0.0 || (BLEND_TOLERANCES[0]..=BLEND_TOLERANCES[1]).contains(&path) => {
            // Where the machine file says nothing of the tool's direction the tip alone counts.
            let orientation = if own.orientation > 0.0 { own.orientation } else { std::f64::consts::PI };
            Ok(ControlTolerance { path, orientation })
        }
        Some(_) => {
            let [least, most] = BLEND_TOLERANCES;
            Err(format!("--blend-tolerance-mm: must be {least} to {most} mm, or 0: a stop at every corner"))
        }
    }
}

/// Times all moves, and says how long each cutting move takes at its largest speed.
///
/// # Errors
/// What is wrong with them.
pub(crate) fn timed(
    machine: &Machine,
    tool_length: f64,
    (tolerance, control): (ControlTolerance, &ControlMotion),
    table_from_words: Option<Isometry3<f64>>,
    mut moves: Moves,
) -> Result<(Vec<f64>, RefeedLawTimes), String> {
    let views = [(machine, tool_length)];
    let timer = Timer::new(&views, tolerance).map_err(|e| e.to_string())?.without_limits().on_control(control);
    let timer = timer.with_rounded_vectors(moves.vector_rounding(table_from_words));
    let laws: Result<Vec<_>, String> = moves.runs.par_iter().map(|run| Ok((run.is_rapid, timer.time(run)?))).collect();
    let laws = laws?;
    let mut of_cuts = laws.iter().filter(|(is_rapid, _)| !is_rapid);
    let stops_at_corners = of_cuts.clone().next().is_some() && of_cuts.all(|(_, law)| law.stops_at_corners);
    let mut times = RefeedLawTimes { stops_at_corners, ..RefeedLawTimes::default() };
    let mut peak_times = Vec::new();
    let mut cutting_times = Vec::new();
    for (is_rapid, law) in laws {
        let sum: f64 = law.times.iter().sum();
        if is_rapid {
            times.rapid_time_s += sum;
        } else {
            times.cutting_time_s += sum;
            cutting_times.push(sum);
            peak_times.extend(law.peak_times);
        }
    }
    // Once more at the feeds that there were, where these make another motion.
    let (mut before, mut peaks) = (moves.before.as_slice(), peak_times.as_slice());
    moves.runs.retain(|run| !run.is_rapid);
    let mut again = Vec::new();
    for (run, time) in moves.runs.into_iter().zip(cutting_times) {
        let (now, of_run) = (before.split_at(run.blocks.len()), peaks.split_at(run.blocks.len()));
        (before, peaks) = (now.1, of_run.1);
        if is_same_motion(&run, of_run.0, now.0) {
            times.cutting_time_before_s += time;
        } else {
            again.push((run, now.0));
        }
    }
    let sum = |(mut run, before): (Run, &[f64])| {
        run.blocks.iter_mut().zip(before).for_each(|(block, before)| block.tip_time = *before);
        Ok(timer.time(&run)?.times.iter().sum())
    };
    let sums: Result<Vec<f64>, String> = again.into_par_iter().map(sum).collect();
    times.cutting_time_before_s += sums?.iter().sum::<f64>();
    Ok((peak_times, times))
}

/// Whether a run that was timed with the least times of its blocks would be run alike with these others: its motion keeps them, and no
/// block that they would let be quicker was held back by its least time.
fn is_same_motion(run: &Run, peak_times: &[f64], others: &[f64]) -> bool {
    run.blocks.iter().zip(peak_times).zip(others).all(|((block, &peak), &other)| {
        let was_free = peak > FREE * block.tip_time;
        other == block.tip_time || (other <= peak && (other >= block.tip_time || was_free))
    })
}

/// A block whose least time at its largest speed is so many times its least time was not held back by that.
const FREE: f64 = 1.05;
