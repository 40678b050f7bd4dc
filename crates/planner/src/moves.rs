//! From pieces to the sequence of moves of an operation: entries, cuts, exits, links, with axis values.

use facemill_cl_data::{CcPoint, ClPoint, CuttingLaw, Monitor};
use facemill_cutter_location::approach::{Approach, ApproachSettings, ApproachShape, PassEnd, approach};
use facemill_cutter_location::link::{LinkSettings, between, link, way_out};
use facemill_cutter_location::{Hints, PoseTest};
use facemill_inverse_kinematics::{AxisKind, AxisValues, Branch, BranchPreference, InverseSolution, deviation_bound};
use facemill_nc_program::RoundingBound;
use facemill_tool_model::cl_from_cc;
use rayon::prelude::*;

use crate::Failure;
use crate::job_file::{ApproachFile, ArcFile};
use crate::pieces::{Cut, LeftOut, Piece};

/// What a move is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MoveKind {
    /// Between passes, at rapid rate.
    Rapid,
    /// Entry or exit, at approach feed.
    Approach,
    /// Along a pass.
    Cut,
}

/// A move to a pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Move {
    /// What it is for.
    pub kind: MoveKind,
    /// Its end, workpiece frame.
    pub cl: ClPoint,
    /// Axis values at its end.
    pub axes: AxisValues,
}

/// The moves of one piece: the link to it, its entry, its cuts and its exit.
#[derive(Clone, Debug)]
pub(crate) struct PieceMoves {
    /// The piece, as far as entry and exit left it.
    pub piece: Piece,
    /// In order.
    pub moves: Vec<Move>,
}

/// An operation's moves.
#[derive(Clone, Debug, Default)]
pub(crate) struct OperationMoves {
    /// Piece by piece.
    pub pieces: Vec<PieceMoves>,
    /// From the last piece back to the clearance surface.
    pub retract: Vec<Move>,
    /// Largest deviation of the cutter between two blocks from the straight way, words rounded, mm.
    pub linearisation: f64,
}

impl OperationMoves {
    /// Where the operation ends.
    pub(crate) fn last(&self) -> Option<Move> {
        self.retract.last().or_else(|| self.pieces.last()?.moves.last()).copied()
    }
}

/// How moves are made.
pub(crate) struct MoveSettings {
    /// Entry of every pass.
    pub entry: ApproachSettings,
    /// Exit of every pass.
    pub exit: ApproachSettings,
    /// Links between passes.
    pub link: LinkSettings,
    /// Largest deviation between blocks in cuts, entries and exits, rounding of the words included, mm.
    pub linearisation: f64,
    /// The same in rapids.
    pub rapid_linearisation: f64,
    /// Rounding of the words.
    pub rounding: RoundingBound,
}

/// Poses of an entry's or exit's arc per radius of way: chords leave the arc by 2e-5 of its radius, and are no more than
/// 0.4° steeper than it.
const ARC_STEPS: f64 = 80.0;

/// Settings of an entry or exit.
pub(crate) fn approach_settings(file: &ApproachFile, rapid_clearance: f64, max_retract: f64) -> ApproachSettings {
    let arc = |a: &ArcFile| (a.radius_mm, a.angle_deg.to_radians());
    let shape = match file {
        ApproachFile::TangentialArc(a) => {
            let (radius, angle) = arc(a);
            ApproachShape::TangentialArc { radius, angle }
        }
        ApproachFile::RollIn(a) => {
            let (radius, angle) = arc(a);
            ApproachShape::RollIn { radius, angle }
        }
    };
    let (ApproachShape::TangentialArc { radius, .. } | ApproachShape::RollIn { radius, .. }) = shape;
    ApproachSettings { shape, step: radius / ARC_STEPS, rapid_clearance, max_retract }
}

/// A piece with its ways in and out.
struct Reached {
    piece: Piece,
    entry: Approach,
    exit: Approach,
}

/// Moves of an operation, in the order of its pieces; `from` is where the operation before it ended, linked to the first
/// piece.
///
/// Points at the ends of a piece from where no entry or exit is possible are left out; so is a piece that would keep fewer
/// than two.
///
/// # Errors
/// When the monitor cancels, or two pieces cannot be linked.
pub(crate) fn operation_moves(
    test: &PoseTest<'_>,
    settings: &MoveSettings,
    pieces: Vec<Piece>,
    from: Option<Move>,
    left_out: &mut Vec<LeftOut>,
    monitor: &dyn Monitor,
) -> Result<OperationMoves, Failure> {
    let reached: Vec<(Option<Reached>, Vec<LeftOut>)> = pieces
        .into_par_iter()
        .map(|piece| {
            monitor.checkpoint()?;
            let result = reach(test, settings, piece);
            monitor.advance(1);
            Ok(result)
        })
        .collect::<Result<_, facemill_cl_data::Cancelled>>()?;
    let mut pieces = Vec::new();
    for (piece, lost) in reached {
        left_out.extend(lost);
        pieces.extend(piece);
    }
    let first = pieces.first().map(|p| outer(&p.entry));
    let before = from
        .zip(first)
        .map(|(from, to)| linked(test, settings, &from.cl, &to, "the operation before it"))
        .transpose()?;
    let links: Vec<Vec<ClPoint>> = pieces
        .par_windows(2)
        .map(|w| {
            monitor.checkpoint().map_err(Failure::from)?;
            let ends = format!("pass {} to pass {}", w[0].piece.pass + 1, w[1].piece.pass + 1);
            let way = linked(test, settings, &outer(&w[0].exit), &outer(&w[1].entry), &ends)?;
            monitor.advance(1);
            Ok(way)
        })
        .collect::<Result<_, Failure>>()?;
    Sequencer::new(test, settings, from).sequence(pieces, before, links)
}

/// The link between two poses; `ends` names them for the error.
fn linked(
    test: &PoseTest<'_>,
    settings: &MoveSettings,
    from: &ClPoint,
    to: &ClPoint,
    ends: &str,
) -> Result<Vec<ClPoint>, Failure> {
    link(test, &settings.link, from, to, &mut Hints::default()).map_err(|blocked| {
        let p = blocked.pose.tip;
        Failure::Infeasible(format!(
            "no way from {ends}: at ({:.1}, {:.1}, {:.1}) even over the clearance surface {}",
            p.x,
            p.y,
            p.z,
            test.describe(&blocked.why)
        ))
    })
}

fn outer(approach: &Approach) -> ClPoint {
    *approach.outward.last().expect("an approach has at least the poses of its arc")
}

/// Entry and exit of a piece, shortened until both exist.
fn reach(test: &PoseTest<'_>, settings: &MoveSettings, mut piece: Piece) -> (Option<Reached>, Vec<LeftOut>) {
    let mut hints = Hints::default();
    let mut lost = Vec::new();
    let mut at_end = |piece: &Piece, end: PassEnd| {
        let (settings, cut) = match end {
            PassEnd::Entry => (&settings.entry, piece.cuts.first()),
            PassEnd::Exit => (&settings.exit, piece.cuts.last()),
        };
        cut.map(|cut| approach(test, settings, end, &cut.cc, &cut.pose.cl, piece.uncut_left, &mut hints))
    };
    let lose = |cut: Cut, end: PassEnd, why: String, lost: &mut Vec<LeftOut>| {
        let what = if end == PassEnd::Entry { "entry" } else { "exit" };
        lost.push(LeftOut { place: cut.cc.position, reason: format!("no {what}: {why}") });
    };
    let mut ways = [None, None];
    for (k, end) in [PassEnd::Entry, PassEnd::Exit].into_iter().enumerate() {
        while ways[k].is_none() {
            match at_end(&piece, end) {
                Some(Ok(way)) => ways[k] = Some(way),
                Some(Err(why)) => {
                    let cut = if end == PassEnd::Entry { Some(piece.cuts.remove(0)) } else { piece.cuts.pop() };
                    if let Some(cut) = cut {
                        lose(cut, end, test.describe(&why), &mut lost);
                    }
                }
                None => return (None, lost),
            }
        }
    }
    let [Some(entry), Some(exit)] = ways else { return (None, lost) };
    if piece.cuts.len() < 2 {
        for cut in piece.cuts {
            lose(cut, PassEnd::Entry, "alone between an entry and an exit".to_owned(), &mut lost);
        }
        return (None, lost);
    }
    (Some(Reached { piece, entry, exit }), lost)
}

/// Gives axis values to poses one after the other and inserts poses where the control would stray between two.
struct Sequencer<'a> {
    test: &'a PoseTest<'a>,
    settings: &'a MoveSettings,
    law: CuttingLaw,
    /// Where the machine is; `None` before the first pose.
    at: Option<Move>,
    worst: f64,
}

/// Halvings of a block: 2^10 blocks for one say that the machine is near a singular pose, where more would not help.
const MAX_HALVINGS: u32 = 10;

impl<'a> Sequencer<'a> {
    fn new(test: &'a PoseTest<'a>, settings: &'a MoveSettings, at: Option<Move>) -> Self {
        Self { test, settings, law: test.cell.machine.motion_law().cutting, at, worst: 0.0 }
    }

    /// `before` is the way to the first piece, where there is one; `links` are the ways from each piece to the next.
    fn sequence(
        mut self,
        pieces: Vec<Reached>,
        before: Option<Vec<ClPoint>>,
        links: Vec<Vec<ClPoint>>,
    ) -> Result<OperationMoves, Failure> {
        let mut done = Vec::with_capacity(pieces.len());
        let mut before = std::iter::once(before).chain(links.into_iter().map(Some));
        let mut last = None;
        for Reached { piece, entry, exit } in pieces {
            let mut moves = Vec::new();
            let branch = Some(self.branch_of(&piece.cuts[0])?);
            let start = outer(&entry);
            let way = match before.next().flatten() {
                Some(way) => way,
                // The program starts above the first pass.
                None => {
                    let mut way = self.out(&start)?;
                    way.reverse();
                    way
                }
            };
            for cl in way {
                self.go(MoveKind::Rapid, cl, branch, &mut moves)?;
            }
            self.go(MoveKind::Rapid, start, branch, &mut moves)?;
            for cl in entry.outward.iter().rev().skip(1) {
                self.go(MoveKind::Approach, *cl, branch, &mut moves)?;
            }
            let mut previous: Option<Cut> = None;
            for cut in &piece.cuts {
                self.cut(previous.as_ref(), cut, &mut moves)?;
                previous = Some(*cut);
            }
            let branch = self.at.map(|m| self.test.cell.machine.branch_of(&m.axes));
            for cl in &exit.outward {
                self.go(MoveKind::Approach, *cl, branch, &mut moves)?;
            }
            last = Some(outer(&exit));
            done.push(PieceMoves { piece, moves });
        }
        let mut retract = Vec::new();
        if let Some(cl) = last {
            for cl in self.out(&cl)? {
                self.go(MoveKind::Rapid, cl, None, &mut retract)?;
            }
        }
        Ok(OperationMoves { pieces: done, retract, linearisation: self.worst })
    }

    /// A free way from a pose to the clearance surface.
    fn out(&self, from: &ClPoint) -> Result<Vec<ClPoint>, Failure> {
        way_out(self.test, &self.settings.link, from, &mut Hints::default()).map_err(|blocked| {
            let p = blocked.pose.tip;
            Failure::Infeasible(format!(
                "no way to the clearance surface: at ({:.1}, {:.1}, {:.1}) {}",
                p.x,
                p.y,
                p.z,
                self.test.describe(&blocked.why)
            ))
        })
    }

    /// The branch that a cut was tested on.
    fn branch_of(&self, cut: &Cut) -> Result<Branch, Failure> {
        self.same_rotaries(cut).map(|s| s.branch)
    }

    /// The solution whose rotary values are those of the tested pose up to full turns.
    fn same_rotaries(&self, cut: &Cut) -> Result<InverseSolution, Failure> {
        let cell = self.test.cell;
        let near = self.at.map_or(cut.pose.axes, |m| m.axes);
        let cl = cut.pose.cl.transformed(&cell.table_from_work);
        let all = cell.machine.inverse_near(&cl, cell.tool.gauge_length(), &near).map_err(unreachable_again)?;
        let differs = |s: &InverseSolution| -> f64 {
            let axes = cell.machine.axes().iter().enumerate();
            axes.filter(|(_, a)| a.kind == AxisKind::Rotary)
                .map(|(k, _)| {
                    let d = s.values.get_or_zero(k) - cut.pose.axes.get_or_zero(k);
                    (d - std::f64::consts::TAU * (d / std::f64::consts::TAU).round()).abs()
                })
                .fold(0.0, f64::max)
        };
        let best = all.iter().min_by(|a, b| differs(a).total_cmp(&differs(b)));
        Ok(*best.expect("inverse solutions are never empty"))
    }

    fn cut(&mut self, previous: Option<&Cut>, cut: &Cut, moves: &mut Vec<Move>) -> Result<(), Failure> {
        let axes = self.same_rotaries(cut)?.values;
        let to = Move { kind: MoveKind::Cut, cl: cut.pose.cl, axes };
        match previous {
            // The first cut ends the entry: it is reached at approach feed.
            None => self.reach(Move { kind: MoveKind::Approach, ..to }, moves, &|a, b, t| between(a, b, t)),
            Some(previous) => {
                let cutter = self.test.cell.tool.cutter();
                self.reach(to, moves, &|_, _, t| between_cuts(cutter, previous, cut, t))
            }
        }
    }

    /// Goes to a pose, on a branch where one is wanted.
    fn go(
        &mut self,
        kind: MoveKind,
        cl: ClPoint,
        branch: Option<Branch>,
        moves: &mut Vec<Move>,
    ) -> Result<(), Failure> {
        let axes = self.solve(&cl, branch)?;
        self.reach(Move { kind, cl, axes }, moves, &|a, b, t| between(a, b, t))
    }

    /// Axis values near to where the machine is, on the wanted branch if it has them.
    fn solve(&self, cl: &ClPoint, branch: Option<Branch>) -> Result<AxisValues, Failure> {
        let cell = self.test.cell;
        let cl = cl.transformed(&cell.table_from_work);
        let near = self.at.map(|m| m.axes);
        let reference = near.unwrap_or_else(|| cell.machine.home());
        let length = cell.tool.gauge_length();
        let all = cell.machine.inverse_near(&cl, length, &reference).map_err(unreachable_again)?;
        match branch.and_then(|b| all.on_branch(b)) {
            Some(solution) => Ok(solution.values),
            None => cell
                .machine
                .nearest_inverse(&cl, length, near.as_ref(), BranchPreference::Nearest)
                .map_err(unreachable_again),
        }
    }

    /// Appends the move to `to`, with poses of `way` in between where the control would stray too far.
    fn reach(
        &mut self,
        to: Move,
        moves: &mut Vec<Move>,
        way: &dyn Fn(&ClPoint, &ClPoint, f64) -> ClPoint,
    ) -> Result<(), Failure> {
        let Some(from) = self.at else {
            self.at = Some(to);
            moves.push(to);
            return Ok(());
        };
        let tolerance = match to.kind {
            MoveKind::Rapid => self.settings.rapid_linearisation,
            MoveKind::Approach | MoveKind::Cut => self.settings.linearisation,
        };
        // Open intervals of the way, the nearest last: (end as fraction, move to it, halvings).
        let mut open = vec![(1.0, to, 0u32)];
        let (mut t, mut at) = (0.0, from);
        while let Some(&(end, target, halvings)) = open.last() {
            let deviation = self.deviation(&at.axes, &target.axes);
            if deviation > tolerance && halvings < MAX_HALVINGS {
                let middle = 0.5 * (t + end);
                let cl = way(&from.cl, &to.cl, middle);
                self.at = Some(at);
                let axes = self.solve_like(&cl, &target.axes)?;
                open.pop();
                open.push((end, target, halvings + 1));
                open.push((middle, Move { kind: to.kind, cl, axes }, halvings + 1));
                continue;
            }
            if to.kind != MoveKind::Rapid {
                self.worst = self.worst.max(deviation);
            }
            open.pop();
            moves.push(target);
            (t, at) = (end, target);
        }
        self.at = Some(to);
        Ok(())
    }

    /// Axis values of a pose between here and a target, on the target's branch.
    fn solve_like(&self, cl: &ClPoint, target: &AxisValues) -> Result<AxisValues, Failure> {
        let cell = self.test.cell;
        let cl = cl.transformed(&cell.table_from_work);
        let near = self.at.map_or(*target, |m| m.axes.lerp(target, 0.5));
        let length = cell.tool.gauge_length();
        let all = cell.machine.inverse_near(&cl, length, &near).map_err(unreachable_again)?;
        match all.on_branch(cell.machine.branch_of(target)) {
            Some(solution) => Ok(solution.values),
            None => cell
                .machine
                .nearest_inverse(&cl, length, Some(&near), BranchPreference::Nearest)
                .map_err(unreachable_again),
        }
    }

    /// How far the cutter may be from the straight way between two positions, rounding of the words included.
    fn deviation(&self, from: &AxisValues, to: &AxisValues) -> f64 {
        let cell = self.test.cell;
        let length = cell.tool.gauge_length();
        let radius = cell.tool.cutter().radius();
        deviation_bound(cell.machine, self.law, from, to, length).rim(radius) + self.rounding(to)
    }

    /// How far rounding of the words may move the cutter's rim at a position, to first order.
    fn rounding(&self, axes: &AxisValues) -> f64 {
        let cell = self.test.cell;
        let length = cell.tool.gauge_length();
        let radius = cell.tool.cutter().radius();
        let here = cell.machine.cl_point(axes, length);
        let mut sum = self.settings.rounding.linear * 3f64.sqrt();
        for (k, axis) in cell.machine.axes().iter().enumerate() {
            if axis.kind == AxisKind::Rotary {
                let mut moved = *axes;
                moved[k] += self.settings.rounding.rotary;
                let there = cell.machine.cl_point(&moved, length);
                sum += (there.tip - here.tip).norm() + radius * self.settings.rounding.rotary;
            }
        }
        sum
    }
}

fn unreachable_again(e: facemill_inverse_kinematics::Unreachable) -> Failure {
    Failure::Infeasible(format!("a link, entry or inserted pose cannot be reached: {e}"))
}

/// The pose between two cuts that keeps contact: CC point, posture and lift between theirs.
fn between_cuts(cutter: &facemill_tool_model::Cutter, a: &Cut, b: &Cut, t: f64) -> ClPoint {
    let blend = |p: f64, q: f64| p + (q - p) * t;
    let position = a.cc.position + (b.cc.position - a.cc.position) * t;
    let normal = a.cc.normal.lerp(&b.cc.normal, t);
    let feed = a.cc.feed.lerp(&b.cc.feed, t);
    let Ok(cc) = CcPoint::new(position, normal, feed) else {
        return between(&a.pose.cl, &b.pose.cl, t);
    };
    let posture = facemill_cl_data::Posture {
        tilt: blend(a.pose.posture.tilt, b.pose.posture.tilt),
        rotate: blend(a.pose.posture.rotate, b.pose.posture.rotate),
    };
    let lift = blend(a.pose.lift, b.pose.lift);
    cl_from_cc(cutter, &cc, posture).translated(cc.normal.into_inner() * lift)
}
