//! Time of passes beyond the programmed feed, by cause, and remedies.

use std::collections::BTreeMap;

use facemill_inverse_kinematics::AxisKind;
use facemill_job::format::job_file::OperationFile;
use facemill_job::format::report::lost_time::{LostTimeCause, LostTimeReport};
use facemill_job::load::job::Job;
use facemill_tool_path::moves::{Move, MoveKind};

use crate::passes::pole_detours::BESIDE_POLE;
use crate::program::timed::Timed;

/// Least fraction of an operation's time in passes that is reported.
const LEAST_SHARE: f64 = 0.1;

/// Least fraction of a block's time at which an axis counts as at its largest velocity.
const AT_VELOCITY: f64 = 0.95;

/// Block along a pass that is slower than programmed.
struct SlowBlock {
    cause: LostTimeCause,
    axis: Option<usize>,
    /// Time lost, s.
    lost: f64,
    line: u32,
}

/// Losses of an operation by cause.
#[derive(Default)]
struct OfOperation<'n> {
    name: &'n str,
    /// Time in passes, s.
    total: f64,
    causes: BTreeMap<(LostTimeCause, Option<usize>), CauseLoss>,
}

/// Loss of an operation by one cause.
#[derive(Default)]
struct CauseLoss {
    sum: f64,
    /// Largest loss in a block, s, and its line.
    worst: (f64, u32),
}

/// Returns the causes that take more than a tenth of the time in passes of their operation, the
/// largest first.
///
/// Times are those of the written text by the motion law, if there is one, else those at constant
/// speeds.
pub(crate) fn lost_times(job: &Job, timed: &Timed, driven: &[Driven<'_>]) -> Vec<LostTimeReport> {
    let mut all: Vec<OfOperation<'_>> = Vec::new();
    let cuts = timed.moves.iter().zip(driven).filter(|(m, _)| m.kind == MoveKind::Cut);
    for (at, (m, of_move)) in cuts.enumerate() {
        let time = timed.cut_times.get(&of_move.line).copied().unwrap_or(m.time);
        let name = of_move.operation.name.as_str();
        let known = all.iter().position(|operation| operation.name == name).unwrap_or_else(|| {
            all.push(OfOperation { name, ..OfOperation::default() });
            all.len() - 1
        });
        let own = &mut all[known];
        own.total += time;
        // A change of the feed for chips is no loss.
        let feed = timed.cut_feeds.get(at).map_or(of_move.operation.feeds.cutting_mm_min, |f| f.programmed.mm_min);
        let Some(block) = slow_block(job, of_move, time, feed / 60.0) else { continue };
        let lost = own.causes.entry((block.cause, block.axis)).or_default();
        lost.sum += block.lost;
        if block.lost > lost.worst.0 {
            lost.worst = (block.lost, block.line);
        }
    }
    let mut reports: Vec<LostTimeReport> = Vec::new();
    for OfOperation { name, total, causes } in all {
        let large = causes.into_iter().filter(|(_, lost)| lost.sum > LEAST_SHARE * total);
        reports.extend(large.map(|((cause, axis), lost)| LostTimeReport {
            operation: name.to_owned(),
            cause,
            axis: axis.map(|k| job.machine.axes()[k].letter.to_string()),
            lost_s: lost.sum,
            share: lost.sum / total,
            line: lost.worst.1,
            remedy: remedy(cause).to_owned(),
        }));
    }
    reports.sort_by(|a, b| b.lost_s.total_cmp(&a.lost_s));
    reports
}

/// Returns a block along a pass that takes more time than its feed, mm/s, requires, with the cause.
fn slow_block(job: &Job, driven: &Driven<'_>, time: f64, feed: f64) -> Option<SlowBlock> {
    let machine = &job.machine;
    let from = driven.from.as_ref()?;
    let lost = time - (driven.to.cl.tip - from.cl.tip).norm() / feed;
    if lost <= 0.0 {
        return None;
    }
    let needed = |k: &usize| (driven.to.axes[*k] - from.axes[*k]).abs() / machine.axes()[*k].max_velocity;
    let of = |kind: AxisKind| (0..machine.axes().len()).filter(move |&k| machine.axes()[k].kind == kind);
    let slowest = |kind: AxisKind| of(kind).max_by(|a, b| needed(a).total_cmp(&needed(b)));
    let length = job.tool.gauge_length();
    let angle = |axes| machine.angle_to_singular(&machine.cl_point(axes, length));
    let is_near = [&from.axes, &driven.to.axes].into_iter().any(|q| angle(q).is_some_and(|a| a < BESIDE_POLE));
    let rotary = slowest(AxisKind::Rotary).filter(|k| needed(k) > 0.0);
    let at_velocity = |k: &usize| needed(k) > AT_VELOCITY * time;
    let (cause, axis) = match (rotary, slowest(AxisKind::Linear)) {
        (Some(k), _) if is_near => (LostTimeCause::NearPole, Some(k)),
        (Some(k), _) if at_velocity(&k) => (LostTimeCause::RotaryVelocity, Some(k)),
        (_, Some(k)) if at_velocity(&k) => (LostTimeCause::LinearVelocity, Some(k)),
        _ => (LostTimeCause::Acceleration, None),
    };
    Some(SlowBlock { cause, axis, lost, line: driven.line })
}

pub(crate) fn remedy(cause: LostTimeCause) -> &'static str {
    match cause {
        LostTimeCause::NearPole => {
            "mount the part so that its surface does not face along that axis (table_from_work), or let postures keep farther \
             from the pole (search.singular_cone_deg, with a larger search.tilt_deg[1])"
        }
        LostTimeCause::RotaryVelocity => {
            "let the tool turn less along the pass (a smaller search.max_turn_deg_per_mm, wider search.tilt_deg), or mount the \
             part so that another rotary axis follows it (table_from_work)"
        }
        LostTimeCause::LinearVelocity => {
            "mount the part nearer to the rotary axes (table_from_work), so that their turns need shorter moves"
        }
        LostTimeCause::Acceleration => {
            "let the tool turn more evenly (a smaller search.max_turn_deg_per_mm), or give the control more room at corners \
             where the part allows it (motion.control_tolerance of the machine file, and shorter blocks: \
             tolerances.max_step_mm)"
        }
    }
}

/// Move of the program.
#[derive(Clone, Copy)]
pub(crate) struct Driven<'p> {
    pub(crate) operation: &'p OperationFile,
    /// Whether it belongs to a piece that continues after a reversal of an axis that ended the
    /// piece before.
    pub(crate) goes_on: bool,
    /// Position of the machine before; `None` at the first.
    pub(crate) from: Option<Move>,
    pub(crate) to: Move,
    pub(crate) line: u32,
}
