//! Sequence of moves with axis values, from pieces and links.

use facemill_cl_data::ClPoint;
use facemill_cutter_location::links::link::{LinkBlocked, Linker, Waypoint, between};
use facemill_cutter_location::{Configuration, Hints, Infeasible, PoseTest, rewound_axis};
use facemill_inverse_kinematics::BlockLaw;

use crate::linearity::{Linearity, endless_near};
use crate::moves::{Move, MoveKind, MoveSettings, OperationMoves, PieceMoves, Reached, blocked_way, configuration_of};
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
    hints: Hints,
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
        Self { test, settings, at, worst: 0.0, hints: Hints::default() }
    }

    /// `before` is the way to the first piece, where there is one; `links` are the ways from each
    /// piece to the next.
    pub(crate) fn sequence(
        mut self,
        pieces: Vec<Reached>,
        before: Option<Vec<Waypoint>>,
        links: Vec<Vec<Waypoint>>,
    ) -> Result<OperationMoves, PathError> {
        let mut done = Vec::with_capacity(pieces.len());
        let mut ways = std::iter::once(before).chain(links.into_iter().map(Some));
        let mut last = None;
        for reached in pieces {
            let mut moves = Vec::new();
            let (start, end) = (reached.start(), reached.end());
            let way = match ways.next().flatten() {
                Some(way) => way,
                // The program starts above the first pass.
                None => {
                    let mut way = self.out(&start)?;
                    way.reverse();
                    way
                }
            };
            for pose in way.iter().chain([&start]) {
                self.go(MoveKind::Rapid, pose, &mut moves)?;
            }
            let Reached { piece, entry, exit } = reached;
            if let Some(first) = piece.cuts.first() {
                for cl in entry.outward.iter().rev().skip(1) {
                    self.approach(cl, first, &mut moves)?;
                }
            }
            for (k, cut) in piece.cuts.iter().enumerate() {
                // The first cut ends the entry.
                let kind = if k == 0 { MoveKind::Engage } else { MoveKind::Cut };
                self.go(kind, &Waypoint { cl: cut.pose.cl, configuration: cut.pose.configuration }, &mut moves)?;
            }
            if let Some(last) = piece.cuts.last() {
                for cl in &exit.outward {
                    self.approach(cl, last, &mut moves)?;
                }
            }
            last = Some(end);
            done.push(PieceMoves { piece, moves });
        }
        let mut retract = Vec::new();
        if let Some(end) = last {
            for pose in self.out(&end)? {
                self.go(MoveKind::Rapid, &pose, &mut retract)?;
            }
        }
        Ok(OperationMoves { pieces: done, retract, linearisation: self.worst, order: None })
    }

    /// Returns a free way from a pose to the clearance surface.
    fn out(&self, from: &Waypoint) -> Result<Vec<Waypoint>, PathError> {
        Linker::new(self.test, &self.settings.link)
            .way_out(from)
            .map_err(|blocked| blocked_way(self.test, "no way to the clearance surface", &blocked))
    }

    /// Moves to a pose of an entry or exit, with rotary axes as at its cut.
    fn approach(&mut self, cl: &ClPoint, cut: &Cut, moves: &mut Vec<Move>) -> Result<(), PathError> {
        let comes_from_stock = self.at.is_some_and(|at| self.test.cutter_in_stock(&at.cl, &mut self.hints));
        let in_stock = comes_from_stock || self.test.cutter_in_stock(cl, &mut self.hints);
        let kind = if in_stock { MoveKind::Engage } else { MoveKind::Approach };
        self.go(kind, &Waypoint { cl: *cl, configuration: cut.pose.configuration }, moves)
    }

    /// Moves to a pose on the branch and at the winding with which it was tested, and, at the pole,
    /// with the tested rotary values.
    fn go(&mut self, kind: MoveKind, tested: &Waypoint, moves: &mut Vec<Move>) -> Result<(), PathError> {
        let near = self.at.map_or(tested.configuration.axes, |at| at.configuration.axes);
        let axes = endless_near(self.test, &tested.configuration.axes, &near);
        let reference = Configuration { axes, ..tested.configuration };
        let configuration = self.stand(&tested.cl, &reference)?;
        let to = Waypoint { cl: tested.cl, configuration };
        if let Some(to) = self.at.filter(|_| kind == MoveKind::Rapid).and_then(|at| self.unwound(&at, &to)) {
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
            MoveKind::Approach | MoveKind::Engage | MoveKind::Cut => &self.settings.linearity,
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
