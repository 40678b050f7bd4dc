//! Turns of both heads at once between runs, in place of exit, link and entry.

use facemill_cl_data::Monitor;
use facemill_inverse_kinematics::AxisValues;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::OperationFile;
use facemill_tool_path::links::clock::LinkClock;
use facemill_tool_path::moves::pair_turn::{PairTurn, PairTurnEnd, PairTurnSearch};
use facemill_tool_path::moves::turn::TurnSettings;
use facemill_tool_path::moves::{LinkInstead, Move, MoveKind, PieceMoves, TurnState};
use facemill_virtual_machine::program_time::tolerance::MachineView;
use rayon::prelude::*;

use crate::dual::moves::{DualMove, DualMover};
use crate::dual::parts::{Section, SectionTurn, TwoHeadContext};
use crate::dual::runs::PairRun;
use crate::passes::move_settings::turn_settings;

/// Moves of a turn to a run, and its largest deviation between blocks, mm; or the reason why there
/// is none.
type TurnToRun = Result<(Vec<DualMove>, f64), String>;

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

    /// Joins consecutive runs by turns; each run has its place in the pattern. `sections` has three
    /// of each run in this order: link and entry, cuts, exit. Returns the largest deviation between
    /// blocks of turns, mm.
    ///
    /// # Errors
    /// If the monitor cancels.
    pub(crate) fn join(
        &self,
        runs: &[(&PairRun, u32)],
        sections: &mut [Section],
        monitor: &dyn Monitor,
    ) -> Result<f64, Failure> {
        let joined: &[Section] = sections;
        let found: Vec<TurnToRun> = (1..runs.len())
            .into_par_iter()
            .map(|k| {
                monitor.checkpoint()?;
                let of_runs = &joined[3 * (k - 1)..3 * (k + 1)];
                let [(before, place), (run, next)] = [runs[k - 1], runs[k]];
                let turn = if place == next {
                    self.turn([before, run], of_runs)
                } else {
                    Err("the next pass is in another place of the pattern".to_owned())
                };
                monitor.advance(1);
                Ok(turn)
            })
            .collect::<Result<_, Failure>>()?;
        let mut worst = 0.0f64;
        for (k, turn) in (1..).zip(found) {
            let (before, of_run) = sections.split_at_mut(3 * k);
            let (Some(up), [lead, cuts, ..]) = (before.last_mut(), of_run) else { continue };
            match turn {
                Ok((moves, linearisation)) => {
                    worst = worst.max(linearisation);
                    let exit = std::mem::take(&mut up.moves);
                    let link = std::mem::replace(&mut lead.moves, moves);
                    lead.turn = SectionTurn::Made { exit, lead: link };
                    cuts.moves.iter_mut().take(1).for_each(|m| m.kind = MoveKind::Turn);
                }
                Err(why) => lead.turn = SectionTurn::Refused(why),
            }
        }
        Ok(worst)
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
        let linearity = settings.map(|s| s.linearity);
        let search = PairTurnSearch { test: self.mover.test, test_step, linearity };
        let entry = DualMove { kind: MoveKind::Engage, ..*first };
        let link: Vec<DualMove> = up.moves.iter().chain(&lead.moves).copied().chain([entry]).collect();
        let by_link = self.time(&last.axes, &link);
        let moves_of = |turn: &PairTurn| -> Vec<DualMove> {
            let mut at = last.axes;
            let places = turn.places.iter().chain([&to.pose.axes]);
            let turn_to = |axes: &AxisValues| {
                at = self.mover.turned(axes, &at);
                DualMove { kind: MoveKind::Turn, axes: at, working: [true; 2], chips: [None; 2] }
            };
            places.map(turn_to).collect()
        };
        let is_slower = |turn: &PairTurn| match (self.time(&last.axes, &moves_of(turn)), by_link) {
            (Some(by_turn), Some(by_link)) => by_turn >= by_link,
            _ => true,
        };
        let turn = search.find(&ends[0], &ends[1], &is_slower)?;
        let mut moves = moves_of(&turn);
        let end = moves.pop().map_or(last.axes, |m| m.axes);
        if (0..end.len()).any(|k| (end[k] - first.axes[k]).abs() > SAME_AXES) {
            return Err("the rotary axes would end a full turn away from where the link leaves them".to_owned());
        }
        Ok((moves, turn.linearisation))
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
