//! In which order the pieces of an operation's passes are cut.

use facemill_cl_data::Monitor;
use facemill_inverse_kinematics::{AxisValues, Machine};
use facemill_tool_model::{Cutter, ToolAssembly};
use nalgebra::Point3;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::links::clock::LinkClock;
use crate::links::tour::{TourCosts, shortest_tour};
use crate::moves::Reached;
use crate::path_error::PathError;

/// The order of an operation's pieces where the job leaves it open.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PassOrderReport {
    /// Name of the operation.
    pub operation: String,
    /// Pieces of passes, in all places of the pattern.
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

/// Pieces in the order with the shortest links, from where the tool comes from, in which all that
/// can touch each other keep the order that they have: no place is in reach of the flutes on two
/// pieces that change places, their entries and exits with all ways through stock among them, so
/// that every cut takes the stock that it takes in the order as laid.
///
/// Links cost the time of their slowest axis by itself: a guess of what they take, which changes no
/// claim.
///
/// # Errors
/// When the monitor cancels.
pub fn ordered(
    machine: &Machine,
    tool: &ToolAssembly,
    from: &AxisValues,
    pieces: Vec<Reached>,
    monitor: &dyn Monitor,
) -> Result<(Vec<Reached>, PassOrderReport), PathError> {
    let views = [(machine, tool.gauge_length())];
    let clock = LinkClock::new(&views);
    let ends: Vec<[AxisValues; 2]> =
        pieces.iter().map(|p| [p.start().configuration.axes, p.end().configuration.axes]).collect();
    let links =
        ends.par_iter().flat_map_iter(|[_, end]| ends.iter().map(|[start, _]| clock.least_time(end, start))).collect();
    let first = ends.iter().map(|[start, _]| clock.least_time(from, start)).collect();
    let pairs = touching(&pieces, farthest_touch(tool.cutter()));
    monitor.checkpoint()?;
    let kept_pairs = pairs.len();
    let costs = TourCosts::new(links, first, vec![0.0; pieces.len()]).and_then(|costs| costs.keeping(pairs));
    let costs = costs.map_err(|e| PathError::Fault(e.to_string()))?;
    let tour = shortest_tour(&costs);
    monitor.checkpoint()?;
    let report = PassOrderReport {
        operation: String::new(),
        pieces: pieces.len(),
        kept_pairs,
        as_laid_s: costs.of(&(0..pieces.len()).collect::<Vec<_>>()),
        ordered_s: tour.cost,
        lower_bound_s: tour.lower_bound,
        is_exact: tour.is_exact,
    };
    let mut pieces: Vec<Option<Reached>> = pieces.into_iter().map(Some).collect();
    Ok((tour.order.iter().filter_map(|&k| pieces[k].take()).collect(), report))
}

/// How far from the tip the cutter's flutes reach, mm: to the far end of their edge.
fn farthest_touch(cutter: &Cutter) -> f64 {
    cutter.radius().hypot(cutter.flute_length())
}

/// Pairs of pieces, as they are laid, with poses from which the flutes may reach one place: with
/// tips less than twice so far apart.
fn touching(pieces: &[Reached], reach: f64) -> Vec<(usize, usize)> {
    let beads: Vec<Vec<Bead>> = pieces.iter().map(|p| beads(&tips(p), reach)).collect();
    let touch = |a: &[Bead], b: &[Bead]| {
        a.iter().any(|a| b.iter().any(|b| (a.center - b.center).norm() <= a.radius + b.radius + 2.0 * reach))
    };
    let of = |b: usize| (0..b).filter(|&a| touch(&beads[a], &beads[b])).map(|a| (a, b)).collect::<Vec<_>>();
    (0..pieces.len()).into_par_iter().flat_map_iter(of).collect()
}

/// Where the tip goes from where rapids end before a piece to where they begin behind it.
fn tips(piece: &Reached) -> Vec<Point3<f64>> {
    let entry = piece.entry.outward.iter().rev().map(|cl| cl.tip);
    let cuts = piece.piece.cuts.iter().map(|cut| cut.pose.cl.tip);
    entry.chain(cuts).chain(piece.exit.outward.iter().map(|cl| cl.tip)).collect()
}

/// A ball around some neighbouring places of a way and the straight lines between them.
struct Bead {
    center: Point3<f64>,
    radius: f64,
}

/// By how much the tip may leave the straight line between two places, as part of their distance:
/// blocks are near straight, and an axis that turns about the workpiece goes along its chord's
/// circle.
const BEYOND_CHORD: f64 = 0.5;

/// Balls around a way, each of at most a quarter of the reach but for places that are farther from
/// each other.
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
