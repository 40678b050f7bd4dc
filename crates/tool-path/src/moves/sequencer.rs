//! Sequence of moves with axis values, from pieces and links.

use facemill_cl_data::ClPoint;
use facemill_cutter_location::links::link::{LinkBlocked, Linker, Waypoint, between};
use facemill_cutter_location::{Configuration, Hints, Infeasible, PoseTest, rewound_axis};
use facemill_inverse_kinematics::{AxisValues, BlockLaw};

use crate::linearity::{Linearity, endless_near};
use crate::moves::reached::Reached;
use crate::moves::turn::{Turn, TurnTo};
use crate::moves::{
    LinkInstead, Move, MoveKind, MoveSettings, OperationMoves, PieceMoves, TurnState, blocked_way, configuration_of,
};
use crate::path_error::PathError;
use crate::segments::Cut;
use crate::winding::unwound;

/// Gives axis values to poses as they were tested and inserts poses where the control would deviate
/// between two.
pub(crate) struct Sequencer<'t, 'a> {
    test: &'t PoseTest<'a>,
    settings: &'t MoveSettings,
    /// Present position of the machine; `None` before the first pose.
    at: Option<Waypoint>,
    worst: f64,
    /// Axis values that endless axes stay near to on a link in place of a turn; else near to where
    /// they are, or turned back toward home.
    toward: Option<AxisValues>,
    hints: Hints,
}

/// Way out of a piece.
struct PieceExit {
    /// Its last cut.
    cut: Cut,
    /// Poses from next to the piece outward.
    outward: Vec<ClPoint>,
    /// Place where rapids begin.
    end: Waypoint,
}

/// Returns whether axis values are the same but for rounding.
fn are_same(a: &Waypoint, b: &Waypoint) -> bool {
    let (a, b) = (&a.configuration.axes, &b.configuration.axes);
    (0..a.len()).all(|k| (a[k] - b[k]).abs() <= SAME_AXES)
}

/// Difference of axis values, mm or rad, that is rounding.
const SAME_AXES: f64 = 1e-9;

fn waypoint(cut: &Cut) -> Waypoint {
    Waypoint { cl: cut.pose.cl, configuration: cut.pose.configuration }
}

/// Halvings of a block: 2^10 blocks for one mean that the machine is near a singular pose, where
/// more would not help.
const MAX_HALVINGS: u32 = 10;

/// Fraction of the rapid clearance that is left where a block deviates from the tested way by half
/// of it.
const RAPID_SHARE: f64 = 0.25;

impl<'t, 'a> Sequencer<'t, 'a> {
    /// Starts at the end of the operation before.
    pub(crate) fn new(test: &'t PoseTest<'a>, settings: &'t MoveSettings, from: Option<Move>) -> Self {
        let at = from.map(|m| Waypoint { cl: m.cl, configuration: configuration_of(test, &m.axes) });
        Self { test, settings, at, worst: 0.0, toward: None, hints: Hints::default() }
    }

    /// `before` is the way to the first piece, where there is one; `links` are the ways from each
    /// piece to the next, also where `turns` has a turn to it.
    pub(crate) fn sequence(
        mut self,
        pieces: Vec<Reached>,
        turns: Vec<TurnTo>,
        before: Option<Vec<Waypoint>>,
        links: Vec<Vec<Waypoint>>,
    ) -> Result<OperationMoves, PathError> {
        let mut done: Vec<PieceMoves> = Vec::with_capacity(pieces.len());
        let mut ways = std::iter::once(before).chain(links.into_iter().map(Some));
        let mut last: Option<PieceExit> = None;
        for (reached, turn) in pieces.into_iter().zip(turns) {
            let way = match ways.next().flatten() {
                Some(way) => way,
                // The program starts above the first pass.
                None => {
                    let mut way = self.out(&reached.start())?;
                    way.reverse();
                    way
                }
            };
            let (by_turn, state) = match (turn, &last) {
                (Some(Ok(turn)), Some(exit)) => self.turned(&turn, exit, &way, &reached)?,
                (Some(Err(why)), _) => (None, TurnState::Refused(why)),
                _ => (None, TurnState::NotSought),
            };
            let mut moves = match (by_turn, &last) {
                (Some(moves), _) => moves,
                (None, exit) => {
                    if let (Some(exit), Some(before)) = (exit, done.last_mut()) {
                        self.exit(exit, &mut before.moves)?;
                    }
                    let mut moves = Vec::new();
                    self.lead(&way, &reached, &mut moves)?;
                    moves
                }
            };
            let end = reached.end();
            let Reached { piece, exit, .. } = reached;
            for cut in piece.cuts.iter().skip(1) {
                self.go(MoveKind::Cut, &waypoint(cut), &mut moves)?;
            }
            last = piece.cuts.last().map(|cut| PieceExit { cut: *cut, outward: exit.outward, end });
            done.push(PieceMoves { piece, moves, turn: state });
        }
        let mut retract = Vec::new();
        if let (Some(exit), Some(before)) = (&last, done.last_mut()) {
            self.exit(exit, &mut before.moves)?;
            for pose in self.out(&exit.end)? {
                self.go(MoveKind::Rapid, &pose, &mut retract)?;
            }
        }
        Ok(OperationMoves { pieces: done, retract, linearisation: self.worst, order: None })
    }

    /// Leaves a piece.
    fn exit(&mut self, exit: &PieceExit, moves: &mut Vec<Move>) -> Result<(), PathError> {
        exit.outward.iter().try_for_each(|cl| self.approach(cl, &exit.cut, moves))
    }

    /// Moves on a link to a piece, and into it up to its first cut.
    fn lead(&mut self, way: &[Waypoint], reached: &Reached, moves: &mut Vec<Move>) -> Result<(), PathError> {
        for pose in way.iter().chain([&reached.start()]) {
            self.go(MoveKind::Rapid, pose, moves)?;
        }
        let Some(first) = reached.piece.cuts.first() else { return Ok(()) };
        for cl in reached.entry.outward.iter().rev().skip(1) {
            self.approach(cl, first, moves)?;
        }
        // The first cut ends the entry.
        self.go(MoveKind::Engage, &waypoint(first), moves)
    }

    /// Returns the moves of a turn, and the moves that it replaces; no moves where both do not end
    /// at the same axis values.
    fn turned(
        &mut self,
        turn: &Turn,
        exit: &PieceExit,
        way: &[Waypoint],
        reached: &Reached,
    ) -> Result<(Option<Vec<Move>>, TurnState), PathError> {
        let (before, worst) = (self.at, self.worst);
        let first = reached.piece.cuts.first().map(waypoint);
        let mut moves = Vec::new();
        let by_turn: Result<(), PathError> =
            turn.poses.iter().chain(&first).try_for_each(|pose| self.go(MoveKind::Turn, pose, &mut moves));
        let turned = std::mem::replace(&mut self.at, before);
        let mut instead = LinkInstead { exit: Vec::new(), lead: Vec::new() };
        let by_link = self.exit(exit, &mut instead.exit).and_then(|()| {
            self.toward = turned.map(|at| at.configuration.axes);
            self.lead(way, reached, &mut instead.lead)
        });
        self.toward = None;
        let by_link = by_link.map(|()| std::mem::replace(&mut self.at, turned));
        let is_same = match (by_link, &by_turn, self.at) {
            (Ok(Some(by_link)), Ok(()), Some(at)) => are_same(&by_link, &at),
            _ => false,
        };
        if is_same {
            return Ok((Some(moves), TurnState::Made(instead)));
        }
        (self.at, self.worst) = (before, worst);
        let why = "the rotary axes would end a full turn away from where the link leaves them";
        Ok((None, TurnState::Refused(why.to_owned())))
    }

    /// Returns a free way from a pose to the clearance surface.
    fn out(&self, from: &Waypoint) -> Result<Vec<Waypoint>, PathError> {
        Linker::new(self.test, &self.settings.link)
            .way_out(from)
            .map_err(|blocked| blocked_way(self.test, "no way to the clearance surface", &blocked))
    }

    /// Moves to a pose of an entry or exit, with rotary axes as at its cut.
    fn approach(&mut self, cl: &ClPoint, cut: &Cut, moves: &mut Vec<Move>) -> Result<(), PathError> {
        let (test, step) = (self.test, self.settings.entry.test_step);
        let is_in_stock = |cl: &ClPoint, hints: &mut Hints| test.cutter_in_stock(cl, hints);
        let in_stock = is_in_stock(cl, &mut self.hints)
            || self.at.is_some_and(|at| {
                is_in_stock(&at.cl, &mut self.hints) || test.meets_stock_between(&at.cl, cl, step, &mut self.hints)
            });
        let kind = if in_stock { MoveKind::Engage } else { MoveKind::Approach };
        self.go(kind, &Waypoint { cl: *cl, configuration: cut.pose.configuration }, moves)
    }

    /// Moves to a pose on the branch and at the winding with which it was tested, and, at the pole,
    /// with the tested rotary values.
    fn go(&mut self, kind: MoveKind, tested: &Waypoint, moves: &mut Vec<Move>) -> Result<(), PathError> {
        let at = self.at.map(|at| at.configuration.axes);
        let near = self.toward.or(at).unwrap_or(tested.configuration.axes);
        let axes = endless_near(self.test, &tested.configuration.axes, &near);
        let reference = Configuration { axes, ..tested.configuration };
        let configuration = self.stand(&tested.cl, &reference)?;
        let to = Waypoint { cl: tested.cl, configuration };
        if let Some(to) =
            self.at.filter(|_| kind == MoveKind::Rapid && self.toward.is_none()).and_then(|at| self.unwound(&at, &to))
        {
            moves.push(Move { kind, cl: to.cl, axes: to.configuration.axes, chip: None });
            self.at = Some(to);
            return Ok(());
        }
        let rewound = |at: &Waypoint| rewound_axis(self.test.cell.machine, &at.configuration.axes, &configuration.axes);
        match self.at {
            Some(at) if at.configuration.branch != configuration.branch => {
                self.swing(&at, &to, kind, Infeasible::OtherBranch(at.configuration.branch), moves)
            }
            Some(at) => match rewound(&at) {
                Some(axis) => self.swing(&at, &to, kind, Infeasible::Rewind { axis }, moves),
                None => self.reach(kind, to, moves),
            },
            None => self.reach(kind, to, moves),
        }
    }

    /// Returns the same pose with an endless axis a turn nearer to home, where a free rapid takes
    /// no longer for it.
    fn unwound(&self, at: &Waypoint, to: &Waypoint) -> Option<Waypoint> {
        let same_branch = at.configuration.branch == to.configuration.branch;
        let is_of_axes = same_branch && matches!(self.settings.link.rapid_law, BlockLaw::Rapid(_));
        let machine = self.test.cell.machine;
        let axes = unwound(machine, &at.configuration.axes, &to.configuration.axes).filter(|_| is_of_axes)?;
        let turned = Waypoint { configuration: Configuration { axes, ..to.configuration }, ..*to };
        self.driven(at, &[turned]).is_ok().then_some(turned)
    }

    fn stand(&self, cl: &ClPoint, near: &Configuration) -> Result<Configuration, PathError> {
        self.test.configuration_like(cl, near).map_err(|why| self.lost(&why))
    }

    /// Returns the error of a tested pose that cannot be reached, which happens only if tests and
    /// motion disagree by rounding at a limit.
    fn lost(&self, why: &Infeasible) -> PathError {
        PathError::Blocked(format!("a link, entry or inserted pose cannot be reached: {}", self.test.describe(why)))
    }

    /// Changes to the other branch or another winding with all axes together, where links do that:
    /// clear of everything. Where it is not allowed, the error reports `why` it is needed.
    fn swing(
        &mut self,
        at: &Waypoint,
        to: &Waypoint,
        kind: MoveKind,
        why: Infeasible,
        moves: &mut Vec<Move>,
    ) -> Result<(), PathError> {
        if kind != MoveKind::Rapid {
            return Err(self.lost(&why));
        }
        let direct = vec![*to];
        let way = match self.driven(at, &direct) {
            Ok(()) => direct,
            Err(blocked) => self.lifted_swing(at, to).ok_or_else(|| {
                let what = "the rotary axes cannot turn over on a link, not even 400 mm farther out (a clearance surface \
                            farther away gives more room)";
                blocked_way(self.test, what, &blocked)
            })?,
        };
        moves.extend(way.iter().map(|w| Move { kind, cl: w.cl, axes: w.configuration.axes, chip: None }));
        self.at = Some(*to);
        Ok(())
    }

    /// Tests rapid blocks through poses as the control drives them.
    fn driven(&self, from: &Waypoint, way: &[Waypoint]) -> Result<(), LinkBlocked> {
        let mut linker = Linker::new(self.test, &self.settings.link);
        let mut at = from;
        way.iter().try_for_each(|next| {
            let (here, there) = (&at.configuration.axes, &next.configuration.axes);
            at = next;
            linker.rapid_block(here, there, self.settings.link.rapid_clearance)
        })
    }

    /// Does the same over poses farther out along the tool axes at both ends: the first heights
    /// that are free.
    fn lifted_swing(&self, at: &Waypoint, to: &Waypoint) -> Option<Vec<Waypoint>> {
        LIFTS.iter().find_map(|lift| {
            let raised = |w: &Waypoint| {
                let cl = self.settings.link.clearance.retract(&w.cl, self.test.clearance_margin() + lift);
                let configuration = self.test.configuration_like(&cl, &w.configuration).ok()?;
                Some(Waypoint { cl, configuration })
            };
            let way = vec![raised(at)?, raised(to)?, *to];
            self.driven(at, &way).is_ok().then_some(way)
        })
    }

    /// Appends the move to `to`, with poses in between where the control would deviate too far: tip
    /// straight, axis turned evenly, as links and approaches were tested. Cuts are close enough
    /// already. Rapid blocks are tested once more as the control drives them.
    fn reach(&mut self, kind: MoveKind, to: Waypoint, moves: &mut Vec<Move>) -> Result<(), PathError> {
        let push = |moves: &mut Vec<Move>, w: &Waypoint| {
            moves.push(Move { kind, cl: w.cl, axes: w.configuration.axes, chip: None })
        };
        let Some(from) = self.at else {
            self.at = Some(to);
            push(moves, &to);
            return Ok(());
        };
        let linearity: &Linearity = match kind {
            MoveKind::Rapid => &self.settings.rapid_linearity,
            MoveKind::Approach | MoveKind::Engage | MoveKind::Turn | MoveKind::Cut => &self.settings.linearity,
        };
        let mut linker = Linker::new(self.test, &self.settings.link);
        let least_clearance = RAPID_SHARE * self.settings.link.rapid_clearance;
        // Open intervals of the way, the nearest last: (end as fraction, place there, halvings).
        let mut open = vec![(1.0, to, 0u32)];
        let (mut t, mut at) = (0.0, from);
        while let Some(&(end, target, halvings)) = open.last() {
            let [here, there] = [at, target].map(|w| w.configuration.axes);
            let (deviation, mut too_long) = linearity.judge(self.test, &here, &there);
            let mut blocked = None;
            if kind == MoveKind::Rapid && (!too_long || halvings == MAX_HALVINGS) {
                blocked = linker.rapid_block(&here, &there, least_clearance).err();
                too_long = blocked.is_some();
            }
            if too_long && halvings < MAX_HALVINGS && kind != MoveKind::Cut {
                let middle = 0.5 * (t + end);
                let cl = between(&from.cl, &to.cl, middle);
                let axes = at.configuration.axes.lerp(&target.configuration.axes, 0.5);
                let configuration = self.stand(&cl, &Configuration { axes, ..target.configuration })?;
                open.pop();
                open.push((end, target, halvings + 1));
                open.push((middle, Waypoint { cl, configuration }, halvings + 1));
                continue;
            }
            if let Some(blocked) = blocked {
                return Err(blocked_way(self.test, "no way that the control keeps to in rapid", &blocked));
            }
            if kind != MoveKind::Rapid {
                self.worst = self.worst.max(deviation);
            }
            open.pop();
            push(moves, &target);
            (t, at) = (end, target);
        }
        self.at = Some(to);
        Ok(())
    }
}

/// Distances outside the clearance surface at which the rotary axes turn over where they cannot on
/// it, mm.
const LIFTS: [f64; 3] = [50.0, 150.0, 400.0];
