//! Motion law for an existing program: collects its moves in one reading, and gives its feeds in
//! the next.

use facemill_cl_data::ControlTolerance;
use facemill_feedrate::BlockFeed;
use facemill_inverse_kinematics::{AxisValues, BlockLaw, FeedRange, Machine};
use facemill_nc_program::dialect::ControlMotion;
use facemill_virtual_machine::motion::axis_motion::StraightCut;
use facemill_virtual_machine::program_time::program_moves::MoveRuns;
use facemill_virtual_machine::program_time::reachable;
use facemill_virtual_machine::program_time::run::{MotionRun, Timer, missing_limits};
use facemill_virtual_machine::program_time::tolerance::MachineView;
use nalgebra::Isometry3;
use rayon::prelude::*;
use serde::Serialize;

/// Options of timing a program with new feeds.
#[derive(Clone, Copy, Debug, Default)]
pub struct FeedLaw {
    /// Largest deviation of the tip from the program's lines at corners, mm; 0 stops at every
    /// corner. `None`: as the machine file says.
    pub blend_tolerance: Option<f64>,
}

/// Times of a program with new feeds within velocity, acceleration and jerk of every axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct FeedLawTimes {
    /// Straight cutting blocks, s.
    pub cutting_time_s: f64,
    /// The same with the feeds of the original program; of blocks without a feed with the new ones.
    pub cutting_time_before_s: f64,
    /// Rapids, s.
    pub rapid_time_s: f64,
    /// Cutting blocks whose F was lowered to the speed that the axes reach in them.
    pub lowered_blocks: usize,
    /// Whether the axes stop at every corner of the cuts, because the blending tolerance is missing
    /// or too small.
    pub stops_at_corners: bool,
}

/// State of the motion law while a program is read.
#[non_exhaustive]
pub enum Law {
    /// The law is not requested.
    Off,
    /// Moves are collected.
    Collecting(MoveRuns),
    /// The time of each cutting move at its largest speed, in their order, and the number of those
    /// used.
    Known(Vec<f64>, usize),
}

impl Law {
    /// Records a stop of the axes.
    pub fn stop(&mut self) {
        if let Self::Collecting(moves) = self {
            moves.stop();
        }
    }

    /// Records a rapid.
    pub fn rapid(&mut self, view: MachineView<'_>, law: BlockLaw, ends: [&AxisValues; 2]) {
        if let Self::Collecting(moves) = self {
            moves.rapid(view, law, ends);
        }
    }

    /// Records a cutting move with an F without meaning: as fast as the axes are.
    pub fn free(&mut self, cut: &StraightCut) {
        match self {
            Self::Off => {}
            Self::Collecting(moves) => {
                moves.cut(cut, 0.0);
                moves.before.push(0.0);
            }
            Self::Known(_, used) => *used += 1,
        }
    }

    /// Processes a cutting move with its feed at constant speed; lowers the feed to the speed that
    /// the axes reach, and returns whether it did.
    ///
    /// Its recorded time is that at its original feed.
    pub fn cut(&mut self, cut: &StraightCut, fed: &mut BlockFeed, range: &FeedRange) -> bool {
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

/// Smallest and largest tolerance of corners, mm. Smaller ones are below the resolution of a
/// control's scales; with larger ones the motion is that of another program.
pub const BLEND_TOLERANCES: [f64; 2] = [1e-6, 10.0];

/// Returns the tolerance for blending a program's corners.
///
/// # Errors
/// If the machine lacks a limit, or the tolerance is invalid.
pub fn blending(machine: &Machine, law: &FeedLaw) -> Result<ControlTolerance, String> {
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
            // If the machine file has no tolerance for the tool's direction, only the tip counts.
            let orientation = if own.orientation > 0.0 { own.orientation } else { std::f64::consts::PI };
            Ok(ControlTolerance { path, orientation })
        }
        Some(_) => {
            let [least, most] = BLEND_TOLERANCES;
            Err(format!("--blend-tolerance-mm: must be {least} to {most} mm, or 0: a stop at every corner"))
        }
    }
}

/// Times all moves, and returns the time of each cutting move at its largest speed.
///
/// # Errors
/// With the fault of the moves.
pub fn timed(
    machine: &Machine,
    tool_length: f64,
    (tolerance, control): (ControlTolerance, &ControlMotion),
    table_from_words: Option<Isometry3<f64>>,
    mut moves: MoveRuns,
) -> Result<(Vec<f64>, FeedLawTimes), String> {
    let views = [(machine, tool_length)];
    let timer = Timer::new(&views, tolerance).map_err(|e| e.to_string())?.without_limits().on_control(control);
    let timer = timer.with_rounded_vectors(moves.vector_rounding(table_from_words));
    let laws: Result<Vec<_>, String> = moves.runs.par_iter().map(|run| Ok((run.is_rapid, timer.time(run)?))).collect();
    let laws = laws?;
    let mut of_cuts = laws.iter().filter(|(is_rapid, _)| !is_rapid);
    let stops_at_corners = of_cuts.clone().next().is_some() && of_cuts.all(|(_, law)| law.stops_at_corners);
    let mut times = FeedLawTimes { stops_at_corners, ..FeedLawTimes::default() };
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
    // Repeats at the original feeds, if these give another motion.
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
    let sum = |(mut run, before): (MotionRun, &[f64])| {
        run.blocks.iter_mut().zip(before).for_each(|(block, before)| block.tip_time = *before);
        Ok(timer.time(&run)?.times.iter().sum())
    };
    let sums: Result<Vec<f64>, String> = again.into_par_iter().map(sum).collect();
    times.cutting_time_before_s += sums?.iter().sum::<f64>();
    Ok((peak_times, times))
}

/// Returns whether a run timed with the least times of its blocks has the same motion with these
/// others: its motion keeps them, and no block that they would permit to be quicker was limited by
/// its least time.
fn is_same_motion(run: &MotionRun, peak_times: &[f64], others: &[f64]) -> bool {
    run.blocks.iter().zip(peak_times).zip(others).all(|((block, &peak), &other)| {
        let was_free = peak > FREE * block.tip_time;
        other == block.tip_time || (other <= peak && (other >= block.tip_time || was_free))
    })
}

/// Least ratio of a block's least time at its largest speed to its least time at which the latter
/// did not limit it.
const FREE: f64 = 1.05;
