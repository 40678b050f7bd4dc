//! From pieces to the sequence of moves of an operation: entries, cuts, exits, links, with axis
//! values.

pub(crate) mod lead;
pub mod order;
pub(crate) mod sequencer;

use facemill_cl_data::{ClPoint, Monitor};
use facemill_cutter_location::links::approach::{Approach, ApproachSettings, PassEnd, PassEndPose, approach};
use facemill_cutter_location::links::link::{LinkBlocked, LinkSettings, Linker, Waypoint};
use facemill_cutter_location::{Configuration, Hints, Infeasible, PoseTest, rewound_axis};
use facemill_inverse_kinematics::AxisValues;
use rayon::prelude::*;

use crate::chips::Chip;
use crate::linearity::Linearity;
use crate::moves::lead::leads;
use crate::moves::order::{PassOrderReport, ordered};
use crate::moves::sequencer::Sequencer;
use crate::path_error::PathError;
use crate::segments::{Cut, LeftOut, PassSegment};

/// Purpose of a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MoveKind {
    /// Between passes, at rapid rate.
    Rapid,
    /// Entry or exit outside the stock, at approach feed.
    Approach,
    /// Entry or exit with the cutter in the stock at one end at least: at approach feed, but not
    /// faster than along the pass.
    Engage,
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
}

/// Settings of moves.
pub struct MoveSettings {
    /// Entry of every pass.
    pub entry: ApproachSettings,
    /// Exit of every pass.
    pub exit: ApproachSettings,
    /// Links between passes.
    pub link: LinkSettings,
    /// Whether pieces may be cut in another order than laid, with shorter links.
    pub shortest_order: bool,
    /// Allowed deviation of the control between blocks in cuts, entries and exits.
    pub linearity: Linearity,
    /// The same in rapids.
    pub rapid_linearity: Linearity,
}

/// A piece with its ways in and out.
pub struct Reached {
    /// The piece.
    pub piece: PassSegment,
    /// Into it.
    pub entry: Approach,
    /// Out of it.
    pub exit: Approach,
}

impl Reached {
    /// Returns the place where rapids end before it.
    pub fn start(&self) -> Waypoint {
        outer(&self.entry)
    }

    /// Returns the place where rapids begin behind it.
    pub fn end(&self) -> Waypoint {
        outer(&self.exit)
    }
}

fn outer(approach: &Approach) -> Waypoint {
    let cl = *approach.outward.last().expect("an approach has at least the poses of its arc");
    Waypoint { cl, configuration: approach.outer }
}

/// Returns the moves of an operation, in the order of its pieces or the one with the shortest
/// links; `from` is the end of the operation before it, linked to the first piece.
///
/// Points at the ends of a piece from which no entry or exit is possible are left out, as is a
/// piece that would keep fewer than two points.
///
/// # Errors
/// When the monitor cancels, or two pieces cannot be linked.
pub fn operation_moves(
    test: &PoseTest<'_>,
    settings: &MoveSettings,
    pieces: Vec<PassSegment>,
    from: Option<Move>,
    left_out: &mut Vec<LeftOut>,
    monitor: &dyn Monitor,
) -> Result<OperationMoves, PathError> {
    let leads = leads(&pieces, [&settings.entry, &settings.exit], test.cell.tool.cutter().radius());
    let reached: Vec<(Option<Reached>, Vec<LeftOut>)> = pieces
        .into_par_iter()
        .zip(leads)
        .map(|(piece, [entry, exit])| {
            monitor.checkpoint()?;
            let settings = EndSettings { entry, exit };
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
    let mut order = None;
    if settings.shortest_order {
        let home = test.cell.machine.home();
        let start = from.map_or(home, |m| m.axes);
        let (sorted, report) = ordered(test.cell.machine, test.cell.tool, &start, pieces, monitor)?;
        (pieces, order) = (sorted, Some(report));
    }
    let before = from
        .map(|m| Waypoint { cl: m.cl, configuration: configuration_of(test, &m.axes) })
        .zip(pieces.first().map(Reached::start))
        .map(|(from, to)| linked(test, settings, &from, &to, "the operation before it"))
        .transpose()?;
    let links: Vec<Vec<Waypoint>> = pieces
        .par_windows(2)
        .map(|w| {
            monitor.checkpoint().map_err(PathError::from)?;
            let ends = format!("pass {} to pass {}", w[0].piece.pass + 1, w[1].piece.pass + 1);
            let way = linked(test, settings, &w[0].end(), &w[1].start(), &ends)?;
            monitor.advance(1);
            Ok(way)
        })
        .collect::<Result<_, PathError>>()?;
    let moves = Sequencer::new(test, settings, from).sequence(pieces, before, links)?;
    Ok(OperationMoves { order, ..moves })
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
}

/// Returns entry and exit of a piece, shortened until both exist.
pub fn reach(test: &PoseTest<'_>, settings: &MoveSettings, piece: PassSegment) -> (Option<Reached>, Vec<LeftOut>) {
    reach_by(test, &EndSettings { entry: settings.entry, exit: settings.exit }, piece)
}

fn reach_by(test: &PoseTest<'_>, settings: &EndSettings, mut piece: PassSegment) -> (Option<Reached>, Vec<LeftOut>) {
    let mut hints = Hints::default();
    let mut lost = Vec::new();
    let mut at_end = |piece: &PassSegment, end: PassEnd| {
        let (settings, cut) = match end {
            PassEnd::Entry => (&settings.entry, piece.cuts.first()),
            PassEnd::Exit => (&settings.exit, piece.cuts.last()),
        };
        cut.map(|cut| {
            let FeasibleEnd { cl, configuration } = FeasibleEnd::of(cut);
            let at = PassEndPose { end, cc: &cut.cc, cl, configuration, uncut_left: piece.uncut_left };
            let way = approach(test, settings, &at, &mut hints)?;
            on_winding(test, cut, &way).map(|()| way)
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
                        lose(cut, end, test.describe(&why), &mut lost);
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
    (Some(Reached { piece, entry, exit }), lost)
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
