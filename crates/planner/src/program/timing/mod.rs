//! Planned program in time: within velocity, acceleration and jerk of every axis, with feeds that
//! require no more.

pub(crate) mod text;

use std::collections::BTreeMap;

use facemill_cl_data::ClPoint;
use facemill_feedrate::{FeedLimit, MotionLimit, ProgramBlock};
use facemill_inverse_kinematics::{AxisValues, Machine};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::FeedsWithin;
use facemill_job::format::report::{HeldBackReport, TimeLawReport, VectorTimeReport};
use facemill_job::load::job::Job;
use facemill_job::validate::tip_feed::FeedLaw;
use facemill_nc_program::{AxisWords, Block, FeedMode, WordMap};
use facemill_tool_path::moves::MoveKind;
use facemill_virtual_machine::Assumption;
use facemill_virtual_machine::program_time::reachable;
use facemill_virtual_machine::program_time::run::{MotionRun, RunLaw, Timer, missing_limits};
use facemill_virtual_machine::program_time::tolerance::{MachineView, stops_at_corners};
use facemill_virtual_machine::program_time::vectors::{VectorDecimals, VectorRounding};
use nalgebra::{Isometry3, Unit, Vector3};
use rayon::prelude::*;

use crate::program::timed::{Timed, TimedMove};

/// Returns the assumption of times by the law for a control that nobody has compared.
pub(crate) fn control_assumption(job: &Job, timed: &Timed) -> Option<Assumption> {
    let text = timed.time_law.as_ref().and_then(|_| job.post.rules().control_motion.assumption())?;
    Some(Assumption { line: None, text })
}

/// Turn of the tool in the text of a block.
#[derive(Clone, Copy, PartialEq)]
enum Turn {
    /// By rotary words.
    Words,
    /// By this vector, frame of the words.
    Vector([f64; 3]),
    /// None: its vector is that of the block before, and is not repeated.
    Stays,
}

/// Conversion of axis values to written words.
pub(crate) struct WrittenWords<'a> {
    pub job: &'a Job,
    pub words: &'a WordMap,
    pub table_from_rtcp_words: Isometry3<f64>,
}

impl WrittenWords<'_> {
    /// Returns the axis values of the rounded words, reached by the control from `before`. If the
    /// block has a tool vector, the control finds the rotary axes by it.
    fn values(&self, before: &AxisValues, axes: &AxisValues, turn: Turn) -> Option<AxisValues> {
        let (machine, length) = (&self.job.machine, self.job.tool.gauge_length());
        if self.job.post.feed_mode() != FeedMode::Rtcp {
            let words = self.rounded(&self.words.words(axes.as_slice()).ok()?)?;
            return AxisValues::from_slice(&self.words.joints(&words).ok()?);
        }
        let tip = self.table_from_rtcp_words.inverse_transform_point(&machine.cl_point(axes, length).tip);
        let words = self.rounded(&self.words.rtcp_words(&tip, axes.as_slice()).ok()?)?;
        let mut tip = tip;
        for word in words.iter() {
            if let Some(k) = "XYZ".find(word.letter.letter()) {
                tip[k] = word.value;
            }
        }
        let tip = self.table_from_rtcp_words * tip;
        match turn {
            Turn::Words => {
                let turned = AxisValues::from_slice(&self.words.joints(&words).ok()?)?;
                machine.with_tip_at(&turned, &tip, length)
            }
            Turn::Stays => machine.with_tip_at(before, &tip, length),
            Turn::Vector(vector) => {
                let axis = self.table_from_rtcp_words * Unit::new_normalize(Vector3::from(vector));
                machine.control_choice(before, &ClPoint { tip, axis }, length).ok()
            }
        }
    }

    /// Returns the turn of a block behind one that states, or keeps, the vector `said`; records its
    /// own.
    fn turn(&self, block: &Block, said: &mut Option<[f64; 3]>) -> Turn {
        let (Block::LinearVectors { vectors, .. }, Some(rule)) = (block, self.job.post.vector_rule()) else {
            *said = None;
            return Turn::Words;
        };
        let vector = self.job.post.vector_in_text(&vectors.tool_axis).into();
        let is_same = said.replace(vector) == Some(vector);
        if is_same && !rule.complete { Turn::Stays } else { Turn::Vector(vector) }
    }

    fn rounded(&self, words: &AxisWords) -> Option<AxisWords> {
        let decimals = self.job.post.decimals();
        let mut out = AxisWords::new();
        for word in words.iter() {
            let scale = 10f64.powi(decimals.of(word.letter.kind()).into());
            out.set(word.letter, (word.value * scale).round() / scale).ok()?;
        }
        Some(out)
    }
}

/// Times all moves of a program by the law, and lowers the feeds of cutting blocks to those that
/// the machine reaches in them, if the job says so. If the machine file lacks a limit, records only
/// that. The reported times are those of the text, by [`time_text`](text::time_text).
///
/// `views` are the machine as each head sees it, with the lengths of its tool. Returns the growth
/// of each move's time at the new feeds, as a factor.
///
/// # Errors
/// Only an internal fault.
pub(crate) fn time_program(
    views: &[MachineView<'_>],
    written: &WrittenWords<'_>,
    timed: &mut Timed,
) -> Result<Vec<f64>, Failure> {
    let job = written.job;
    let mut slower = vec![1.0; timed.moves.len()];
    let Some((machine, _)) = views.first() else { return Ok(slower) };
    let tolerance = machine.motion_law().control_tolerance;
    let control = &job.post.rules().control_motion;
    let Ok(timer) = Timer::new(views, tolerance).map(|t| t.without_limits().on_control(control)) else {
        timed.no_time_law = missing_limits(machine).iter().map(ToString::to_string).collect();
        return Ok(slower);
    };
    let runs = runs(machine, written, timed);
    let timer = timer.with_rounded_vectors(vector_rounding(written, &runs));
    let laws: Result<Vec<RunLaw>, String> = runs.par_iter().map(|run| timer.time(run)).collect();
    let laws = laws.map_err(|e| Failure::Internal(format!("time law: {e}")))?;
    let mut report = TimeLawReport { stops_at_corners: stops_at_corners(tolerance), ..TimeLawReport::default() };
    let flat = laws.iter().flat_map(|law| (0..law.times.len()).map(move |k| (law, k)));
    for (at, (law, k)) in (0..timed.moves.len()).zip(flat) {
        let m = timed.moves[at];
        if job.file.feeds_within == FeedsWithin::Acceleration && m.limit.is_some() {
            slower[at] = reachable(m.time, law.peak_times[k]).map_or(1.0, |time| lowered(job, timed, &m, time));
            report.lowered_blocks += usize::from(slower[at] > 1.0);
        }
    }
    report.tool_vectors = tool_vectors(&timer, job, &runs, &laws, &timed.moves)
        .map_err(|e| Failure::Internal(format!("time law: {e}")))?;
    timed.time_law = Some(report);
    without_chips(&timer, job, runs, &laws, timed).map_err(|e| Failure::Internal(format!("time law: {e}")))?;
    Ok(slower)
}

/// Returns the cost of rounding tool vectors: the times of the runs that have some, compared with
/// those through the planned positions; `None` without vectors.
fn tool_vectors(
    timer: &Timer<'_>,
    job: &Job,
    runs: &[MotionRun],
    laws: &[RunLaw],
    moves: &[TimedMove],
) -> Result<Option<VectorTimeReport>, String> {
    let mut before = moves.first().map(|m| m.axes);
    let mut moves = moves.iter();
    let mut exact: Vec<(MotionRun, f64)> = Vec::new();
    for (run, law) in runs.iter().zip(laws) {
        let start = before.unwrap_or(run.start);
        let planned = run.blocks.iter().zip(&mut moves);
        let blocks: Vec<_> = planned.map(|(block, m)| ProgramBlock { end: m.axes, ..*block }).collect();
        before = blocks.last().map(|block| block.end).or(before);
        if run.vectors.iter().any(Option::is_some) {
            let run = MotionRun { start, blocks, is_rapid: run.is_rapid, vectors: Vec::new() };
            exact.push((run, law.times.iter().sum()));
        }
    }
    if exact.is_empty() {
        return Ok(None);
    }
    let added = |(run, time): &(MotionRun, f64)| Ok(time - timer.time(run)?.times.iter().sum::<f64>());
    let added: Result<Vec<f64>, String> = exact.par_iter().map(added).collect();
    Ok(Some(VectorTimeReport {
        decimals: job.post.rules().numbers.vector_decimals,
        turn_deg: job.post.rounding_bound().vector.to_degrees(),
        added_time_s: added?.iter().sum::<f64>().max(0.0),
    }))
}

/// Computes, for feeds changed by chips, the speed that the job's own feeds would have reached by
/// the law, and the time.
fn without_chips(
    timer: &Timer<'_>,
    job: &Job,
    mut runs: Vec<MotionRun>,
    laws: &[RunLaw],
    timed: &mut Timed,
) -> Result<(), String> {
    let is_cut: Vec<bool> = timed.moves.iter().map(|m| m.kind == MoveKind::Cut).collect();
    let n_cuts = is_cut.iter().filter(|cut| **cut).count();
    // With two heads each has its own feeds, which are reported at constant speeds.
    timed.chips_by_law = n_cuts == timed.cut_feeds.len();
    if !timed.chips_by_law || timed.cut_feeds.iter().all(|c| c.programmed.law == FeedLaw::Given) {
        return Ok(());
    }
    let blocks = runs.iter_mut().flat_map(|run| &mut run.blocks).zip(&timed.moves);
    for (block, m) in blocks.filter(|(_, m)| m.kind != MoveKind::Rapid) {
        block.tip_time = m.given_time;
    }
    let given: Result<Vec<RunLaw>, String> = runs.par_iter().map(|run| timer.time(run)).collect();
    let given = given?;
    let flat = |laws: &[RunLaw]| -> Vec<(f64, f64)> {
        let all = laws.iter().flat_map(|law| law.times.iter().copied().zip(law.peak_times.iter().copied()));
        all.zip(&is_cut).filter(|(_, cut)| **cut).map(|(times, _)| times).collect()
    };
    let moves = timed.moves.iter().filter(|m| m.kind == MoveKind::Cut);
    let times = flat(laws).into_iter().zip(flat(&given));
    for ((cut, m), ((time, _), (given_time, given_peak))) in timed.cut_feeds.iter_mut().zip(moves).zip(times) {
        if job.file.feeds_within == FeedsWithin::Acceleration
            && let Some(reached) = reachable(m.given_time, given_peak)
        {
            cut.before *= m.given_time / reached;
        }
        cut.added_time = time - given_time;
    }
    Ok(())
}

/// Returns the rounding of tool vectors in the text of these runs.
fn vector_rounding(written: &WrittenWords<'_>, runs: &[MotionRun]) -> Option<VectorRounding> {
    let mut decimals = VectorDecimals::default();
    let mut vectors = runs.iter().flat_map(|run| run.vectors.iter().flatten()).peekable();
    vectors.peek()?;
    vectors.for_each(|vector| decimals.read(vector));
    Some(VectorRounding { table_from_words: written.table_from_rtcp_words, half: decimals.half() })
}

/// Returns the runs of a program: moves of one kind without a stop of the axes between them. The
/// first move of the program is in the first run, without a path: its start is unknown.
fn runs(machine: &Machine, written: &WrittenWords<'_>, timed: &Timed) -> Vec<MotionRun> {
    let mut runs: Vec<MotionRun> = Vec::new();
    let mut before: Option<(usize, AxisValues)> = None;
    let mut said = None;
    for m in &timed.moves {
        let turn = written.turn(&timed.program.blocks[m.block], &mut said);
        let at = before.map_or(m.axes, |(_, at)| at);
        let end = written.values(&at, &m.axes, turn).unwrap_or(m.axes);
        let (from, start) = before.map_or((m.block, end), |(block, at)| (block + 1, at));
        let stops = timed.program.blocks[from..m.block].iter().any(|b| !matches!(b, Block::Comment(_)));
        let is_rapid = m.kind == MoveKind::Rapid;
        if stops || runs.last().is_none_or(|run| run.is_rapid != is_rapid) {
            runs.push(MotionRun { start, blocks: Vec::new(), is_rapid, vectors: Vec::new() });
        }
        // The law knows the limits of axis speeds better; a rapid feed of the control caps like a
        // tip feed.
        let capped = !is_rapid || machine.feed_range().rapid.is_some();
        let tip_time = if capped { m.time } else { 0.0 };
        if let Some(run) = runs.last_mut() {
            run.blocks.push(ProgramBlock { end, tip_time, exact_stop: false });
            run.vectors.push(if let Turn::Vector(vector) = turn { Some(vector) } else { None });
        }
        before = Some((m.block, end));
    }
    runs
}

/// Lowers the feed of a block to the one at which it takes this long; returns the factor by which
/// its time has grown.
fn lowered(job: &Job, timed: &mut Timed, m: &TimedMove, time: f64) -> f64 {
    let (Block::Linear { feed, .. } | Block::LinearVectors { feed, .. }) = &mut timed.program.blocks[m.block] else {
        return 1.0;
    };
    let least = match job.post.feed_mode() {
        FeedMode::G94 | FeedMode::Rtcp => job.machine.feed_range().min,
        // Smallest value that a word can express.
        FeedMode::G93 => 10f64.powi(-i32::from(job.post.decimals().inverse_time)),
    };
    if m.time <= 0.0 {
        return 1.0;
    }
    let new = (*feed * m.time / time).max(least);
    if new >= *feed {
        return 1.0;
    }
    let factor = *feed / new;
    *feed = new;
    factor
}

/// Sums of a program's times.
#[derive(Default)]
struct Tally {
    report: TimeLawReport,
    held_back: BTreeMap<String, f64>,
}

impl Tally {
    fn count(
        &mut self,
        machine: &Machine,
        kind: MoveKind,
        feed: Option<FeedLimit>,
        time: f64,
        limit: Option<MotionLimit>,
    ) {
        let sum = match kind {
            MoveKind::Cut => &mut self.report.passes_time_s,
            MoveKind::Approach | MoveKind::Engage | MoveKind::Turn => &mut self.report.approach_time_s,
            MoveKind::Rapid => &mut self.report.rapid_time_s,
        };
        *sum += time;
        if let (MoveKind::Cut, Some(limit)) = (kind, limit) {
            *self.held_back.entry(limit_name(machine, limit, feed)).or_default() += time;
        }
    }

    fn finish(mut self) -> TimeLawReport {
        let all = self.report.passes_time_s.max(f64::MIN_POSITIVE);
        let held_back = self.held_back.into_iter();
        self.report.held_back_by = held_back.map(|(limit, time)| HeldBackReport { limit, share: time / all }).collect();
        self.report.held_back_by.sort_by(|a, b| b.share.total_cmp(&a.share).then_with(|| a.limit.cmp(&b.limit)));
        self.report.total_time_s = self.report.passes_time_s + self.report.approach_time_s + self.report.rapid_time_s;
        self.report
    }
}

/// Returns a limit in words. The tip feed's cap in the law may be that of FEED by an axis or by the
/// control.
pub(crate) fn limit_name(machine: &Machine, limit: MotionLimit, feed: Option<FeedLimit>) -> String {
    let axis = |what: &str, k: usize| format!("{what} of axis {}", machine.axes()[k].letter);
    match (limit, feed) {
        (MotionLimit::Velocity(k), _) | (MotionLimit::TipFeed, Some(FeedLimit::Axis(k))) => axis("velocity", k),
        (MotionLimit::Acceleration(k), _) => axis("acceleration", k),
        (MotionLimit::Jerk(k), _) => axis("jerk", k),
        (MotionLimit::TipFeed, Some(FeedLimit::ControlMax | FeedLimit::ControlMin)) => "range of F".to_owned(),
        (MotionLimit::TipFeed, _) => "tip feed".to_owned(),
    }
}
