//! Turns of both heads at once between runs, in place of exit, link and entry.

use facemill_cl_data::Monitor;
use facemill_inverse_kinematics::AxisValues;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::OperationFile;
use facemill_tool_path::links::clock::LinkClock;
use facemill_tool_path::moves::pair_turn::{PairTurnEnd, PairTurnSearch};
use facemill_tool_path::moves::turn::TurnSettings;
use facemill_tool_path::moves::{LinkInstead, Move, MoveKind, PieceMoves, TurnState};
use facemill_virtual_machine::program_time::tolerance::MachineView;
use rayon::prelude::*;

use crate::dual::moves::{DualMove, DualMover};
use crate::dual::parts::{Section, SectionTurn, TwoHeadContext};
use crate::dual::runs::PairRun;
use crate::passes::move_settings::turn_settings;

/// Turn to a run, or the reason why there is none.
pub(crate) type TurnToRun = Result<Vec<DualMove>, String>;

/// Search for turns between the runs of a pair.
pub(crate) struct PairTurns<'m, 'r, 'a> {
    mover: &'m DualMover<'r, 'a>,
    settings: [TurnSettings; 2],
    views: [MachineView<'m>; 2],
}

/// Largest difference of axis values behind a turn and behind the link in its place, mm or rad:
/// rounding.
const SAME_AXES: f64 = 1e-9;

impl<'m, 'r, 'a> PairTurns<'m, 'r, 'a> {
    /// Returns the search; `None` unless the passes of both operations go back and forth, and the
    /// job wants turns.
    pub(crate) fn new(
        context: &'m TwoHeadContext<'_>,
        mover: &'m DualMover<'r, 'a>,
        files: [&OperationFile; 2],
    ) -> Option<Self> {
        let of = |h: usize| turn_settings(context.scenes[h].job, context.scenes[h].setup, files[h]);
        let views = context.scenes.each_ref().map(|scene| (scene.machine, scene.tool_length()));
        Some(Self { mover, settings: [of(0)?, of(1)?], views })
    }

    /// Joins consecutive runs by turns. `sections` has three of each run in this order: link and
    /// entry, cuts, exit.
    ///
    /// # Errors
    /// If the monitor cancels.
    pub(crate) fn join(
        &self,
        runs: &[&PairRun],
        sections: &mut [Section],
        monitor: &dyn Monitor,
    ) -> Result<(), Failure> {
        let joined: &[Section] = sections;
        let found: Vec<TurnToRun> = (1..runs.len())
            .into_par_iter()
            .map(|k| {
                monitor.checkpoint()?;
                let of_runs = &joined[3 * (k - 1)..3 * (k + 1)];
                let turn = self.turn([runs[k - 1], runs[k]], of_runs);
                monitor.advance(1);
                Ok(turn)
            })
            .collect::<Result<_, Failure>>()?;
        for (k, turn) in (1..).zip(found) {
            let (before, of_run) = sections.split_at_mut(3 * k);
            let (Some(up), [lead, cuts, ..]) = (before.last_mut(), of_run) else { continue };
            match turn {
                Ok(moves) => {
                    let exit = std::mem::take(&mut up.moves);
                    let link = std::mem::replace(&mut lead.moves, moves);
                    lead.turn = SectionTurn::Made { exit, lead: link };
                    cuts.moves.iter_mut().take(1).for_each(|m| m.kind = MoveKind::Turn);
                }
                Err(why) => lead.turn = SectionTurn::Refused(why),
            }
        }
        Ok(())
    }

    /// Returns the moves of the turn from one run to the next, without that to its first stop.
    fn turn(&self, [before, run]: [&PairRun; 2], sections: &[Section]) -> TurnToRun {
        let [_, cuts, up, lead, next, _] = sections else { return Err(String::new()) };
        let (Some(from), Some(to)) = (before.stops.last(), run.stops.first()) else { return Err(String::new()) };
        let (Some(last), Some(first)) = (cuts.moves.last(), next.moves.first()) else { return Err(String::new()) };
        let settings = self.mover.settings;
        let ends = [
            PairTurnEnd { cc: from.cc, pose: from.pose, straight: settings.map(|s| s.exit.straight) },
            PairTurnEnd { cc: to.cc, pose: to.pose, straight: settings.map(|s| s.entry.straight) },
        ];
        let test_step = self.settings[0].test_step.min(self.settings[1].test_step);
        let found = PairTurnSearch { test: self.mover.test, test_step }.find(&ends[0], &ends[1])?;
        let mut at = last.axes;
        let mut turn_to = |axes: &AxisValues| {
            at = self.mover.turned(axes, &at);
            DualMove { kind: MoveKind::Turn, axes: at, working: [true; 2], chips: [None; 2] }
        };
        let moves: Vec<DualMove> = found.iter().map(|place| turn_to(&place.axes)).collect();
        let end = turn_to(&to.pose.axes);
        let is_same = (0..end.axes.len()).all(|k| (end.axes[k] - first.axes[k]).abs() <= SAME_AXES);
        if !is_same {
            return Err("the rotary axes would end a full turn away from where the link leaves them".to_owned());
        }
        let turn: Vec<DualMove> = moves.iter().copied().chain([end]).collect();
        let entry = DualMove { kind: MoveKind::Engage, ..*first };
        let link: Vec<DualMove> = up.moves.iter().chain(&lead.moves).copied().chain([entry]).collect();
        match (self.time(&last.axes, &turn), self.time(&last.axes, &link)) {
            (Some(by_turn), Some(by_link)) if by_turn < by_link => Ok(moves),
            _ => Err("a link is not slower".to_owned()),
        }
    }

    /// Returns the time of moves, rapids and others each from rest to rest, s; `None` if it is
    /// unknown. Rapids count as if nothing were in their way: links are shortened later.
    fn time(&self, from: &AxisValues, moves: &[DualMove]) -> Option<f64> {
        let clock = LinkClock::new(&self.views);
        let (mut at, mut sum) = (*from, 0.0);
        for stretch in moves.chunk_by(|a, b| (a.kind == MoveKind::Rapid) == (b.kind == MoveKind::Rapid)) {
            let end = stretch.last()?.axes;
            sum += if stretch[0].kind == MoveKind::Rapid {
                clock.least_time(&at, &end)
            } else {
                let mut behind = at;
                let block = |m: &DualMove| (m.axes, self.tip_time(&std::mem::replace(&mut behind, m.axes), m));
                let through: Vec<(AxisValues, f64)> = stretch.iter().map(block).collect();
                clock.cut_time(&at, &through).ok()?
            };
            at = end;
        }
        Some(sum)
    }

    /// Returns the time of a move at the feeds of both tips, s.
    fn tip_time(&self, from: &AxisValues, to: &DualMove) -> f64 {
        let of = |h: usize| {
            let feed = if to.kind == MoveKind::Turn { self.settings[h].feed } else { self.settings[h].approach_feed };
            (self.mover.cl(h, &to.axes).tip - self.mover.cl(h, from).tip).norm() / feed
        };
        of(0).max(of(1))
    }
}

/// Adds the moves of the turns in the sections of runs to a head's pieces, which have those of the
/// runs.
pub(crate) fn add_turns(mover: &DualMover<'_, '_>, head: usize, pieces: &mut [PieceMoves], sections: &[Section]) {
    let runs = sections.windows(2).filter(|w| w[1].run.is_some());
    for (piece, of_run) in pieces.iter_mut().zip(runs) {
        if !matches!(of_run[0].turn, SectionTurn::Made { .. }) {
            continue;
        }
        let of_head = |m: &DualMove| Move { kind: m.kind, cl: mover.cl(head, &m.axes), axes: m.axes, chip: None };
        piece.moves.iter_mut().take(1).for_each(|m| m.kind = MoveKind::Turn);
        piece.moves.splice(..0, of_run[0].moves.iter().map(of_head));
        piece.turn = TurnState::Made(LinkInstead::default());
    }
}
