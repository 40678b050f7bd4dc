//! Behaviour of rotary axes along the program besides following the tool: reversals, changes of
//! branch, fast turns at the pole.

use facemill_cutter_location::rewound_axis;
use facemill_inverse_kinematics::{AxisKind, Branch};
use facemill_job::format::report::lost_time::LostTimeReport;
use facemill_job::format::report::{RewindReport, RewindsReport, SingularBlocks};
use facemill_job::load::job::Job;
use facemill_tool_path::moves::{Move, MoveKind};

use crate::passes::operation::PlannedOperation;
use crate::program::output::Texts;
use crate::report::lost_time::{Driven, lost_times};

/// Largest angle to the pole at which an axis that cannot follow the feed counts as turning fast
/// because of it, rad: farther away it turns less than eleven times as fast as the tool axis.
const WIDE_CONE: f64 = 5.0 * std::f64::consts::PI / 180.0;

/// Reports on turning axes.
#[derive(Default)]
pub(crate) struct RotaryReversals {
    pub(crate) rewinds: RewindsReport,
    pub(crate) singular_blocks: Vec<SingularBlocks>,
    /// Causes that take more than a tenth of the time in passes; for programs of one head.
    pub(crate) lost_times: Vec<LostTimeReport>,
}

impl RotaryReversals {
    /// Returns the reports on a program of one head.
    pub(crate) fn of(job: &Job, operations: &[PlannedOperation<'_>], texts: &Texts) -> Self {
        let driven = driven(operations, texts);
        let rewinds = rewinds_report(job, &driven, branch_changes(operations));
        let lost_times = lost_times(job, &texts.timed, &driven);
        Self { rewinds, singular_blocks: singular_blocks(job, &driven), lost_times }
    }

    /// Adds the reports on another head in the same program; a turn of an axis that both share
    /// counts once.
    pub(crate) fn join(&mut self, other: Self) {
        let known = |r: &RewindReport| self.rewinds.rewinds.iter().any(|own| own.line == r.line && own.axis == r.axis);
        let more: Vec<RewindReport> = other.rewinds.rewinds.into_iter().filter(|r| !known(r)).collect();
        self.rewinds.rewinds.extend(more);
        self.rewinds.rewinds.sort_by_key(|r| r.line);
        self.rewinds.count = self.rewinds.rewinds.len();
        self.rewinds.inserted = self.rewinds.rewinds.iter().filter(|r| r.inserted).count();
        self.rewinds.branch_changes += other.rewinds.branch_changes;
        self.singular_blocks.extend(other.singular_blocks);
        self.singular_blocks.sort_by_key(|b| b.first_line);
    }
}

/// Returns all moves in program order.
fn driven<'p>(operations: &'p [PlannedOperation<'p>], texts: &'p Texts) -> Vec<Driven<'p>> {
    let lines = texts.timed.move_blocks.iter().map(|&block| texts.block_lines[block]);
    let moves = operations.iter().flat_map(|operation| {
        let pieces = operation.moves.pieces.iter().flat_map(move |piece| {
            let goes_on = piece.piece.part.is_some_and(|part| part > 0);
            piece.moves.iter().map(move |m| (operation.operation, goes_on, *m))
        });
        pieces.chain(operation.moves.retract.iter().map(move |m| (operation.operation, false, *m)))
    });
    let mut from = None;
    moves
        .zip(lines)
        .map(|((operation, goes_on, to), line)| Driven { operation, goes_on, from: from.replace(to), to, line })
        .collect()
}

/// Returns the reversals of limited rotary axes; `branch_changes` is the number of changes to the
/// machine's other branch.
pub(crate) fn rewinds_report(job: &Job, driven: &[Driven<'_>], branch_changes: usize) -> RewindsReport {
    let machine = &job.machine;
    let rewinds: Vec<RewindReport> = driven
        .iter()
        .filter_map(|m| {
            let (from, to) = (m.from?.axes, m.to.axes);
            // A change of branch may take any turns.
            let axis =
                rewound_axis(machine, &from, &to).filter(|_| machine.branch_of(&from) == machine.branch_of(&to))?;
            Some(RewindReport {
                operation: m.operation.name.clone(),
                line: m.line,
                axis: machine.axes()[axis].letter.to_string(),
                from_deg: from[axis].to_degrees(),
                to_deg: to[axis].to_degrees(),
                inserted: m.goes_on,
            })
        })
        .collect();
    RewindsReport {
        count: rewinds.len(),
        inserted: rewinds.iter().filter(|r| r.inserted).count(),
        branch_changes,
        rewinds,
    }
}

/// Returns the number of changes to the machine's other branch between pieces.
fn branch_changes(operations: &[PlannedOperation<'_>]) -> usize {
    let ends = operations.iter().flat_map(|o| &o.moves.pieces).filter_map(|p| {
        let branch = |cut: &facemill_tool_path::segments::Cut| cut.pose.configuration.branch;
        Some([p.piece.cuts.first().map(branch)?, p.piece.cuts.last().map(branch)?])
    });
    let ends: Vec<[Branch; 2]> = ends.collect();
    ends.windows(2).filter(|w| w[0][1] != w[1][0]).count()
}

/// Returns the blocks along passes near the pole of the rotary axes, or where an axis cannot follow
/// the feed because of it.
pub(crate) fn singular_blocks(job: &Job, driven: &[Driven<'_>]) -> Vec<SingularBlocks> {
    let mut all: Vec<SingularBlocks> = Vec::new();
    let mut last = None;
    for (index, m) in driven.iter().enumerate() {
        let Some(found) = m.from.and_then(|from| singular_block(job, m, &from)) else { continue };
        let follows = last.replace(index).is_some_and(|last| last + 1 == index);
        match all.last_mut().filter(|run| follows && run.operation == found.operation) {
            Some(run) => run.join(&found),
            None => all.push(found),
        }
    }
    all
}

fn singular_block(job: &Job, m: &Driven<'_>, from: &Move) -> Option<SingularBlocks> {
    let machine = &job.machine;
    if m.to.kind != MoveKind::Cut {
        return None;
    }
    let operation = m.operation;
    let length = job.tool.gauge_length();
    let angle_at = |m: &Move| machine.angle_to_singular(&machine.cl_point(&m.axes, length));
    let angle = angle_at(from)?.min(angle_at(&m.to)?);
    if angle > WIDE_CONE {
        return None;
    }
    let way = (m.to.cl.tip - from.cl.tip).norm();
    let rotary = machine.axes().iter().enumerate().filter(|(_, a)| a.kind == AxisKind::Rotary);
    // Fraction of the axis' capacity in the time at the programmed feed.
    let time = way / (operation.feeds.cutting_mm_min / 60.0);
    let steps = rotary.map(|(k, a)| {
        let turn = (m.to.axes[k] - from.axes[k]).abs();
        (k, turn, turn / a.max_velocity)
    });
    let (axis, turn, least_time) = steps.reduce(|a, b| if b.2 > a.2 { b } else { a })?;
    let within = angle.to_degrees() <= operation.search.singular_cone_deg;
    (within || least_time > time).then(|| SingularBlocks {
        operation: operation.name.clone(),
        first_line: m.line,
        last_line: m.line,
        blocks: 1,
        smallest_angle_deg: angle.to_degrees(),
        axis: machine.axes()[axis].letter.to_string(),
        largest_step_deg_per_mm: (way > 0.0).then(|| turn.to_degrees() / way),
    })
}
