//! Order of the pieces of an operation's passes.

use facemill_cl_data::Monitor;
use facemill_inverse_kinematics::{AxisValues, Machine};
use facemill_tool_model::{Cutter, ToolAssembly};
use nalgebra::Point3;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::links::clock::LinkClock;
use crate::links::tour::{TourCosts, shortest_tour};
use crate::moves::reached::Reached;
use crate::moves::turn::{TurnChain, TurnTo};
use crate::path_error::PathError;

/// The order of an operation's pieces where the job leaves it open.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PassOrderReport {
    /// Name of the operation.
    pub operation: String,
    /// Pieces of passes, in all places of the pattern; those joined by turns count as one.
    pub pieces: usize,
    /// Pairs of pieces that keep their order, because one place can be in the reach of both cuts.
    pub kept_pairs: usize,
    /// Time of the slowest axis of all links in the order as laid, with nothing in the way, s.
    pub as_laid_s: f64,
    /// The same in the order that they are cut in, s.
    pub ordered_s: f64,
    /// No order that keeps these pairs takes less, s.
    pub lower_bound_s: f64,
    /// Whether no order takes less than this one.
    pub is_exact: bool,
}

/// Returns chains of pieces that turns join in the order with the shortest links, from the position
/// of the tool before them.
///
/// Chains that can touch each other keep their order: the flutes cannot reach any common place on
/// two chains that change places, including their entries and exits with all paths through stock.
/// So every cut removes the same stock as in the order as laid.
///
/// Links cost only the time of their slowest axis: an estimate, which affects no guarantee.
///
/// # Errors
/// Returns an error if the monitor cancels.
pub(crate) fn ordered(
    machine: &Machine,
    tool: &ToolAssembly,
    from: &AxisValues,
    chains: Vec<TurnChain>,
    monitor: &dyn Monitor,
) -> Result<(Vec<TurnChain>, PassOrderReport), PathError> {
    let paths: Vec<CutPath> = chains.iter().filter_map(|chain| path_of(chain)).collect();
    let views = [(machine, tool.gauge_length())];
    let clock = LinkClock::new(&views);
    let link_time = |a: &AxisValues, b: &AxisValues| clock.least_time(a, b);
    let (order, report) = shortest_order(&paths, from, farthest_touch(tool.cutter()), &link_time, monitor)?;
    let mut chains: Vec<Option<TurnChain>> = chains.into_iter().map(Some).collect();
    Ok((order.iter().filter_map(|&k| chains[k].take()).collect(), report))
}

/// Returns the path of pieces that turns join.
fn path_of(chain: &[(Reached, TurnTo)]) -> Option<CutPath> {
    let (first, last) = (&chain.first()?.0, &chain.last()?.0);
    let of_turn = |turn: &TurnTo| -> Vec<Point3<f64>> {
        turn.iter().flatten().flat_map(|turn| turn.poses.iter().map(|w| w.cl.tip)).collect()
    };
    let tips = chain.iter().flat_map(|(piece, turn)| of_turn(turn).into_iter().chain(tips(piece))).collect();
    Some(CutPath { ends: [first.start().configuration.axes, last.end().configuration.axes], tips: vec![tips] })
}

/// Path of one piece, or of several that different heads cut at the same time, from the end of the
/// link to it to the beginning of the link after it.
pub struct CutPath {
    /// Positions at both ends.
    pub ends: [AxisValues; 2],
    /// Tips of each tool along it, in one frame that is fixed to the workpiece.
    pub tips: Vec<Vec<Point3<f64>>>,
}

/// Returns the indices of pieces in the order with the shortest links; pieces that can touch each
/// other keep their order. `reach` is the largest distance of the flutes from the tip over all
/// tools, mm, and `link_time` the time of a link between two positions.
///
/// # Errors
/// Returns an error if the monitor cancels.
pub fn shortest_order(
    paths: &[CutPath],
    from: &AxisValues,
    reach: f64,
    link_time: &(dyn Fn(&AxisValues, &AxisValues) -> f64 + Sync),
    monitor: &dyn Monitor,
) -> Result<(Vec<usize>, PassOrderReport), PathError> {
    let links = paths.par_iter().flat_map_iter(|a| paths.iter().map(|b| link_time(&a.ends[1], &b.ends[0]))).collect();
    let first = paths.iter().map(|path| link_time(from, &path.ends[0])).collect();
    let pairs = touching(paths, reach);
    monitor.checkpoint()?;
    let kept_pairs = pairs.len();
    let costs = TourCosts::new(links, first, vec![0.0; paths.len()]).and_then(|costs| costs.keeping(pairs));
    let costs = costs.map_err(|e| PathError::Fault(e.to_string()))?;
    let tour = shortest_tour(&costs);
    monitor.checkpoint()?;
    let report = PassOrderReport {
        operation: String::new(),
        pieces: paths.len(),
        kept_pairs,
        as_laid_s: costs.of(&(0..paths.len()).collect::<Vec<_>>()),
        ordered_s: tour.cost,
        lower_bound_s: tour.lower_bound,
        is_exact: tour.is_exact,
    };
    Ok((tour.order, report))
}

/// Returns the largest distance of the cutter's flutes from the tip, mm: that of the far end of
/// their edge.
pub fn farthest_touch(cutter: &Cutter) -> f64 {
    cutter.radius().hypot(cutter.flute_length())
}

/// Returns pairs of pieces, as laid, with poses from which the flutes may reach a common place:
/// their tips are less than twice the reach apart.
fn touching(paths: &[CutPath], reach: f64) -> Vec<(usize, usize)> {
    let beads: Vec<Vec<Bead>> =
        paths.iter().map(|path| path.tips.iter().flat_map(|tips| beads(tips, reach)).collect()).collect();
    let touch = |a: &[Bead], b: &[Bead]| {
        a.iter().any(|a| b.iter().any(|b| (a.center - b.center).norm() <= a.radius + b.radius + 2.0 * reach))
    };
    let of = |b: usize| (0..b).filter(|&a| touch(&beads[a], &beads[b])).map(|a| (a, b)).collect::<Vec<_>>();
    (0..paths.len()).into_par_iter().flat_map_iter(of).collect()
}

/// Returns the path of the tip from the end of the rapids before a piece to the beginning of those
/// after it.
fn tips(piece: &Reached) -> Vec<Point3<f64>> {
    let entry = piece.entry.outward.iter().rev().map(|cl| cl.tip);
    let cuts = piece.piece.cuts.iter().map(|cut| cut.pose.cl.tip);
    entry.chain(cuts).chain(piece.exit.outward.iter().map(|cl| cl.tip)).collect()
}

/// Ball around some neighbouring positions of a path and the straight lines between them.
struct Bead {
    center: Point3<f64>,
    radius: f64,
}

/// Largest deviation of the tip from the straight line between two positions, as a fraction of
/// their distance: blocks are almost straight, and an axis that turns about the workpiece moves
/// along the circle over its chord.
const BEYOND_CHORD: f64 = 0.5;

/// Returns balls around a path, each of at most a quarter of the reach unless two positions are
/// farther from each other.
fn beads(way: &[Point3<f64>], reach: f64) -> Vec<Bead> {
    let mut all: Vec<Bead> = Vec::new();
    let mut first = 0;
    while first + 1 < way.len() {
        let near = way[first + 1..].iter().take_while(|p| (**p - way[first]).norm() <= 0.25 * reach).count();
        let last = first + near.max(1);
        let farthest = way[first..=last].iter().map(|p| (p - way[first]).norm()).fold(0.0, f64::max);
        all.push(Bead { center: way[first], radius: (1.0 + BEYOND_CHORD) * farthest });
        first = last;
    }
    all
}
