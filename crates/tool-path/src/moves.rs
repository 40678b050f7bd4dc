//! From pieces to the sequence of moves of an operation: entries, cuts, exits, links, with axis
//! values.

pub mod lead;
pub mod order;
pub mod pair_turn;
pub mod reached;
pub(crate) mod sequencer;
pub mod turn;
pub(crate) mod turn_curve;

use facemill_cl_data::{ClPoint, Monitor};
use facemill_cutter_location::links::approach::{Approach, ApproachSettings, PassEnd, PassEndPose, approach};
use facemill_cutter_location::links::link::{LinkBlocked, LinkSettings, Linker, Waypoint};
use facemill_cutter_location::{Configuration, Hints, Infeasible, PoseTest, rewound_axis};
use facemill_inverse_kinematics::AxisValues;
use rayon::prelude::*;

use crate::chips::Chip;
use crate::linearity::Linearity;
use crate::links::LinkTime;
use crate::moves::lead::{CutRegion, leads};
use crate::moves::order::{PassOrderReport, ordered};
use crate::moves::reached::{Reached, outer};
use crate::moves::sequencer::Sequencer;
use crate::moves::turn::{TurnChain, TurnSearch, TurnSettings, TurnTo};
use crate::path_error::PathError;
use crate::segments::{Cut, LeftOut, PassSegment};

/// Purpose of a move.
///
/// Exhaustive, so that a new one is handled everywhere: each has its own feed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MoveKind {
    /// Between passes, at rapid rate.
    Rapid,
    /// Entry or exit outside the stock, at approach feed.
    Approach,
    /// Entry or exit with the cutter in the stock somewhere: at approach feed, but not faster than
    /// along the pass.
    Engage,
    /// From one pass to the next with the tool down: at the feed of turns, but not faster than
    /// along the passes.
    Turn,
    /// Along a pass.
    Cut,
}

/// A move to a pose.
#[derive(Clone, Copy, Debug)]
pub struct Move {
    /// Purpose.
    pub kind: MoveKind,
    /// Its end, workpiece frame.
    pub cl: ClPoint,
    /// Axis values at its end.
    pub axes: AxisValues,
    /// Largest chip on it; `None` outside the stock, and until it is known.
    pub chip: Option<Chip>,
}

/// The moves of one piece: the link to it, its entry, its cuts and its exit.
#[derive(Clone, Debug)]
pub struct PieceMoves {
    /// The piece, as far as entry and exit left it.
    pub piece: PassSegment,
    /// In order.
    pub moves: Vec<Move>,
    /// How the tool comes from the piece before.
    pub turn: TurnState,
}

/// Turn with the tool down from the piece before, in place of exit, link and entry.
#[derive(Clone, Debug, Default)]
pub enum TurnState {
    /// None was sought.
    #[default]
    NotSought,
    /// There is none, for this reason.
    Refused(String),
    /// The moves before the first cut, and that to it, are a turn.
    Made(LinkInstead),
}

/// Moves that a turn replaces; none where its caller has them.
#[derive(Clone, Debug, Default)]
pub struct LinkInstead {
    /// Exit from the piece before.
    exit: Vec<Move>,
    /// Link and entry, to the first cut.
    lead: Vec<Move>,
}

impl LinkInstead {
    /// Returns the exit from the piece before, and link and entry up to the first cut.
    pub fn moves(&self) -> [&[Move]; 2] {
        [&self.exit, &self.lead]
    }

    /// Records the chips of exit and entry in the moves in the stock.
    pub fn give_chips(&mut self, [exit, entry]: [Chip; 2]) {
        for (moves, chip) in [(&mut self.exit, exit), (&mut self.lead, entry)] {
            moves.iter_mut().filter(|m| m.kind == MoveKind::Engage).for_each(|m| m.chip = Some(chip));
        }
    }
}

impl PieceMoves {
    /// Returns the moves of the turn from the piece before; none where there is a link.
    pub fn turn_moves(&self) -> &[Move] {
        let turned = self.moves.iter().take_while(|m| m.kind == MoveKind::Turn).count();
        &self.moves[..turned]
    }
}

/// Moves of an operation.
#[derive(Clone, Debug, Default)]
pub struct OperationMoves {
    /// Piece by piece.
    pub pieces: Vec<PieceMoves>,
    /// From the last piece back to the clearance surface.
    pub retract: Vec<Move>,
    /// Largest deviation of the cutter between two blocks from the straight way, with words
    /// rounded, mm.
    pub linearisation: f64,
    /// The order of the pieces, where the job leaves it open.
    pub order: Option<PassOrderReport>,
}

impl OperationMoves {
    /// Returns the last move of the operation.
    pub fn last(&self) -> Option<Move> {
        self.retract.last().or_else(|| self.pieces.last()?.moves.last()).copied()
    }

    /// Replaces the turn to a piece by exit, link and entry, for a reason.
    pub fn take_back_turn(&mut self, piece: usize, why: String) {
        let Some(turned) = self.pieces.get_mut(piece) else { return };
        let moves = turned.turn_moves().len();
        let state = std::mem::replace(&mut turned.turn, TurnState::Refused(why));
        match state {
            TurnState::Made(LinkInstead { exit, lead }) => {
                turned.moves.splice(..moves, lead);
                if let Some(before) = piece.checked_sub(1) {
                    self.pieces[before].moves.extend(exit);
                }
            }
            other => turned.turn = other,
        }
    }
}

/// Settings of moves.
pub struct MoveSettings {
    /// Entry of every pass.
    pub entry: ApproachSettings,
    /// Exit of every pass.
    pub exit: ApproachSettings,
    /// Links between passes.
    pub link: LinkSettings,
    /// Turns with the tool down in place of links; `None` without them.
    pub turns: Option<TurnSettings>,
    /// Whether pieces may be cut in another order than laid, with shorter links.
    pub shortest_order: bool,
    /// Allowed deviation of the control between blocks in cuts, entries and exits.
    pub linearity: Linearity,
    /// The same in rapids.
    pub rapid_linearity: Linearity,
}

/// Returns the moves of an operation, in the order of its pieces or the one with the shortest
/// links; `from` is the end of the operation before it, linked to the first piece. Pieces that are
/// joined by turns as laid stay together.
///
/// Points at the ends of a piece from which no entry or exit is possible are left out, as is a
/// piece that would keep fewer than two points. Where two pieces cannot be linked, or the first or
/// last piece cannot be left, points are left out up to the first from which a way leads to the
/// clearance surface.
///
/// # Errors
/// When the monitor cancels, or two pieces cannot be linked although a way leads from both to the
/// clearance surface.
pub fn operation_moves(
    test: &PoseTest<'_>,
    settings: &MoveSettings,
    pieces: Vec<PassSegment>,
    from: Option<Move>,
    left_out: &mut Vec<LeftOut>,
    monitor: &dyn Monitor,
) -> Result<OperationMoves, PathError> {
    region_moves(test, settings, &MoveContext::default(), pieces, from, left_out, monitor)
}

/// Region and links of an operation's moves.
#[derive(Clone, Copy, Default)]
pub struct MoveContext<'c> {
    /// Region that the operation is to cut: entries and exits lead over its border, as far as it
    /// goes on in the half strips beside their way.
    pub region: Option<&'c dyn CutRegion>,
    /// Times of links, for the shortest order; `None` for those of their slowest axes.
    pub link_time: Option<&'c LinkTime<'c>>,
}

/// Returns the moves of an operation, as [`operation_moves`] does, with its region and the times of
/// its links.
///
/// # Errors
/// As [`operation_moves`].
pub fn region_moves(
    test: &PoseTest<'_>,
    settings: &MoveSettings,
    context: &MoveContext<'_>,
    pieces: Vec<PassSegment>,
    from: Option<Move>,
    left_out: &mut Vec<LeftOut>,
    monitor: &dyn Monitor,
) -> Result<OperationMoves, PathError> {
    let all_leads = leads(&pieces, [&settings.entry, &settings.exit], context.region, test.cell.tool.cutter().radius());
    let reached: Vec<(Option<Reached>, Vec<LeftOut>)> = pieces
        .into_par_iter()
        .zip(all_leads)
        .map(|(piece, [entry, exit])| {
            monitor.checkpoint()?;
            let settings = EndSettings { entry, exit, way_out: None };
            let result = reach_by(test, &settings, piece);
            monitor.advance(1);
            Ok(result)
        })
        .collect::<Result<_, facemill_cl_data::Cancelled>>()?;
    let mut pieces = Vec::new();
    for (piece, lost) in reached {
        left_out.extend(lost);
        pieces.extend(piece);
    }
    let (turned, order, links) = loop {
        pieces.iter_mut().enumerate().for_each(|(k, piece)| piece.laid = k);
        let turns = turns(test, settings, &pieces, monitor)?;
        let timed = (settings, context.link_time);
        let (turned, order) = in_order(test, timed, from.as_ref(), chains(pieces, turns), monitor)?;
        let links = Links::find(test, settings, from.as_ref(), &turned, monitor)?;
        let stuck = links.stuck_ends(test, settings, &turned);
        if stuck.iter().all(|ends| *ends == [false; 2]) {
            break (turned, order, links);
        }
        pieces = freed(test, settings, turned, stuck, left_out, monitor)?;
    };
    let (pieces, turns) = turned.into_iter().unzip();
    let Links { before, between } = links;
    let (before, between) = (before.transpose()?, between.into_iter().collect::<Result<_, _>>()?);
    let moves = Sequencer::new(test, settings, from).sequence(pieces, turns, before, between)?;
    Ok(OperationMoves { order, ..moves })
}

/// Returns the pieces as laid; those with stuck ends from the first points at which a way leads to
/// the clearance surface.
///
/// # Errors
/// When the monitor cancels.
fn freed(
    test: &PoseTest<'_>,
    settings: &MoveSettings,
    pieces: TurnChain,
    stuck: Vec<[bool; 2]>,
    left_out: &mut Vec<LeftOut>,
    monitor: &dyn Monitor,
) -> Result<Vec<Reached>, PathError> {
    let mut pieces: Vec<(Reached, [bool; 2])> = pieces.into_iter().map(|(piece, _)| piece).zip(stuck).collect();
    pieces.sort_by_key(|(piece, _)| piece.laid);
    let freed: Vec<(Option<Reached>, Vec<LeftOut>)> = pieces
        .into_par_iter()
        .map(|(reached, of)| {
            monitor.checkpoint()?;
            if of == [false; 2] {
                return Ok((Some(reached), Vec::new()));
            }
            let [entry, exit] = reached.shapes;
            let ends = EndSettings { entry, exit, way_out: Some(WayOut { of, link: settings.link }) };
            Ok(reach_by(test, &ends, reached.piece))
        })
        .collect::<Result<_, facemill_cl_data::Cancelled>>()?;
    let mut kept = Vec::with_capacity(freed.len());
    for (piece, lost) in freed {
        left_out.extend(lost);
        kept.extend(piece);
    }
    Ok(kept)
}

/// Returns chains of pieces in the order in which they are cut, and a report where the job leaves
/// it open.
fn in_order(
    test: &PoseTest<'_>,
    timed: (&MoveSettings, Option<&LinkTime<'_>>),
    from: Option<&Move>,
    chains: Vec<TurnChain>,
    monitor: &dyn Monitor,
) -> Result<(TurnChain, Option<PassOrderReport>), PathError> {
    if !timed.0.shortest_order {
        return Ok((chains.into_iter().flatten().collect(), None));
    }
    let (sorted, report) = ordered(test, timed, from, chains, monitor)?;
    Ok((sorted.into_iter().flatten().collect(), Some(report)))
}

/// Links between the pieces of an operation.
struct Links {
    /// From the operation before to the first piece; `None` where the program starts.
    before: Option<Result<Vec<Waypoint>, PathError>>,
    /// From each piece to the next.
    between: Vec<Result<Vec<Waypoint>, PathError>>,
}

impl Links {
    /// # Errors
    /// When the monitor cancels.
    fn find(
        test: &PoseTest<'_>,
        settings: &MoveSettings,
        from: Option<&Move>,
        pieces: &[(Reached, TurnTo)],
        monitor: &dyn Monitor,
    ) -> Result<Self, PathError> {
        let before = from
            .map(|m| Waypoint { cl: m.cl, configuration: configuration_of(test, &m.axes) })
            .zip(pieces.first().map(|(first, _)| first.start()))
            .map(|(from, to)| linked(test, settings, &from, &to, "the operation before it"));
        let between = pieces
            .par_windows(2)
            .map(|w| {
                let [(a, _), (b, _)] = w else { unreachable!("windows of two") };
                monitor.checkpoint()?;
                let ends = format!("pass {} to pass {}", a.piece.pass + 1, b.piece.pass + 1);
                let way = linked(test, settings, &a.end(), &b.start(), &ends);
                monitor.advance(1);
                Ok(way)
            })
            .collect::<Result<_, facemill_cl_data::Cancelled>>()?;
        Ok(Self { before, between })
    }

    /// Returns for each piece whether its entry and its exit are where no link leads to, and no way
    /// leads to the clearance surface either: they have to be elsewhere.
    fn stuck_ends(&self, test: &PoseTest<'_>, settings: &MoveSettings, pieces: &[(Reached, TurnTo)]) -> Vec<[bool; 2]> {
        let last = pieces.len().saturating_sub(1);
        let no_link = |to: usize| self.between[to - 1].is_err();
        let no_way = |at: Waypoint| Linker::new(test, &settings.link).way_out(&at).is_err();
        let is_stuck = |(k, (reached, _)): (usize, &(Reached, TurnTo))| {
            let needs_entry = if k == 0 { self.before.as_ref().is_none_or(Result::is_err) } else { no_link(k) };
            let needs_exit = k == last || no_link(k + 1);
            [needs_entry && no_way(reached.start()), needs_exit && no_way(reached.end())]
        };
        pieces.par_iter().enumerate().map(is_stuck).collect()
    }
}

/// Returns the turn to each piece from the one before, or the reason why there is none; `None`
/// where none is sought.
fn turns(
    test: &PoseTest<'_>,
    settings: &MoveSettings,
    pieces: &[Reached],
    monitor: &dyn Monitor,
) -> Result<Vec<TurnTo>, PathError> {
    let Some(turns) = &settings.turns else { return Ok(pieces.iter().map(|_| None).collect()) };
    let search = TurnSearch::new(test, turns);
    let found: Vec<TurnTo> = pieces
        .par_windows(2)
        .map(|w| {
            monitor.checkpoint()?;
            Ok(Some(search.find(&w[0], &w[1]).map_err(|why| why.text(test))))
        })
        .collect::<Result<_, PathError>>()?;
    Ok(pieces.first().map(|_| None).into_iter().chain(found).collect())
}

/// Returns the pieces with the turns to them, in chains that turns join.
fn chains(pieces: Vec<Reached>, turns: Vec<TurnTo>) -> Vec<TurnChain> {
    let mut chains: Vec<TurnChain> = Vec::new();
    for (piece, turn) in pieces.into_iter().zip(turns) {
        match chains.last_mut().filter(|_| matches!(turn, Some(Ok(_)))) {
            Some(chain) => chain.push((piece, turn)),
            None => chains.push(vec![(piece, turn)]),
        }
    }
    chains
}

/// Returns the machine's configuration at axis values.
pub fn configuration_of(test: &PoseTest<'_>, axes: &AxisValues) -> Configuration {
    Configuration { axes: *axes, branch: test.cell.machine.branch_of(axes) }
}

/// Returns the link between two poses; `ends` names them for the error.
fn linked(
    test: &PoseTest<'_>,
    settings: &MoveSettings,
    from: &Waypoint,
    to: &Waypoint,
    ends: &str,
) -> Result<Vec<Waypoint>, PathError> {
    let what = format!("no way from {ends}: even over the clearance surface");
    Linker::new(test, &settings.link).link(from, to).map_err(|blocked| blocked_way(test, &what, &blocked))
}

/// Returns the error of a blocked link.
pub fn blocked_way(test: &PoseTest<'_>, what: &str, blocked: &LinkBlocked) -> PathError {
    let p = blocked.pose.tip;
    let why = test.describe(&blocked.why);
    PathError::Blocked(format!("{what}: at ({:.1}, {:.1}, {:.1}) {why}", p.x, p.y, p.z))
}

/// Entry and exit of one piece.
struct EndSettings {
    entry: ApproachSettings,
    exit: ApproachSettings,
    /// Ends from which a way has to lead to the clearance surface.
    way_out: Option<WayOut>,
}

/// Whether a way has to lead from entry and exit to the clearance surface.
struct WayOut {
    of: [bool; 2],
    link: LinkSettings,
}

impl WayOut {
    /// # Errors
    /// The reason why no way leads from an end to the clearance surface, where one has to.
    fn check(&self, test: &PoseTest<'_>, end: PassEnd, way: &Approach) -> Result<(), String> {
        if !self.of[usize::from(end == PassEnd::Exit)] {
            return Ok(());
        }
        let blocked = Linker::new(test, &self.link).way_out(&outer(way)).err();
        blocked.map_or(Ok(()), |b| Err(format!("no way to the clearance surface: {}", test.describe(&b.why))))
    }
}

/// Returns entry and exit of a piece, shortened until both exist.
pub fn reach(test: &PoseTest<'_>, settings: &MoveSettings, piece: PassSegment) -> (Option<Reached>, Vec<LeftOut>) {
    reach_by(test, &EndSettings { entry: settings.entry, exit: settings.exit, way_out: None }, piece)
}

fn reach_by(test: &PoseTest<'_>, settings: &EndSettings, mut piece: PassSegment) -> (Option<Reached>, Vec<LeftOut>) {
    let mut hints = Hints::default();
    let mut lost = Vec::new();
    let mut at_end = |piece: &PassSegment, end: PassEnd| {
        let (shape, cut) = match end {
            PassEnd::Entry => (&settings.entry, piece.cuts.first()),
            PassEnd::Exit => (&settings.exit, piece.cuts.last()),
        };
        cut.map(|cut| {
            let FeasibleEnd { cl, configuration } = FeasibleEnd::of(cut);
            let at = PassEndPose { end, cc: &cut.cc, cl, configuration, uncut_left: piece.uncut_left };
            let way = approach(test, shape, &at, &mut hints).map_err(|why| test.describe(&why))?;
            on_winding(test, cut, &way).map_err(|why| test.describe(&why))?;
            settings.way_out.as_ref().map_or(Ok(()), |needed| needed.check(test, end, &way))?;
            Ok::<Approach, String>(way)
        })
    };
    let lose = |cut: Cut, end: PassEnd, why: String, lost: &mut Vec<LeftOut>| {
        // Leaving out inserted points loses no requested point.
        if !cut.inserted {
            let what = if end == PassEnd::Entry { "entry" } else { "exit" };
            let reason = format!("no {what}: {why}");
            lost.push(LeftOut { place: cut.cc.position, reason, searched: None });
        }
    };
    let mut ways = [None, None];
    for (k, end) in [PassEnd::Entry, PassEnd::Exit].into_iter().enumerate() {
        while ways[k].is_none() {
            match at_end(&piece, end) {
                Some(Ok(way)) => ways[k] = Some(way),
                Some(Err(why)) => {
                    let cut = if end == PassEnd::Entry { Some(piece.cuts.remove(0)) } else { piece.cuts.pop() };
                    if let Some(cut) = cut {
                        lose(cut, end, why, &mut lost);
                    }
                }
                None => return (None, lost),
            }
        }
    }
    let [Some(entry), Some(exit)] = ways else { return (None, lost) };
    let enough = if piece.part.is_some() { piece.cuts.len() >= 2 } else { piece.points() >= 2 };
    if !enough {
        for cut in piece.cuts {
            lose(cut, PassEnd::Entry, "alone between an entry and an exit".to_owned(), &mut lost);
        }
        return (None, lost);
    }
    (Some(Reached { piece, entry, exit, shapes: [settings.entry, settings.exit], laid: 0 }), lost)
}

/// Checks that no limited axis reaches its end between a cut and the start of rapids: with three
/// rotary axes they turn on there.
fn on_winding(test: &PoseTest<'_>, cut: &Cut, way: &Approach) -> Result<(), Infeasible> {
    let mut at = cut.pose.configuration;
    for cl in &way.outward {
        let next = test.configuration_like(cl, &at)?;
        if let Some(axis) = rewound_axis(test.cell.machine, &at.axes, &next.axes) {
            return Err(Infeasible::Rewind { axis });
        }
        at = next;
    }
    match rewound_axis(test.cell.machine, &at.axes, &way.outer.axes) {
        Some(axis) => Err(Infeasible::Rewind { axis }),
        None => Ok(()),
    }
}

/// Pose of a cut by reference.
struct FeasibleEnd<'c> {
    cl: &'c ClPoint,
    configuration: &'c Configuration,
}

impl<'c> FeasibleEnd<'c> {
    fn of(cut: &'c Cut) -> Self {
        Self { cl: &cut.pose.cl, configuration: &cut.pose.configuration }
    }
}
