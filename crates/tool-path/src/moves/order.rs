//! Order of the pieces of an operation's passes.

use facemill_cl_data::Monitor;
use facemill_cutter_location::PoseTest;
use facemill_cutter_location::links::link::{Linker, Waypoint};
use facemill_inverse_kinematics::AxisValues;
use facemill_tool_model::Cutter;
use nalgebra::Point3;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::linearity::endless_near;
use crate::links::LinkTime;
use crate::links::clock::LinkClock;
use crate::links::tour::{LearntTour, TourCosts, TourLink, shortest_tour, shortest_tour_by};
use crate::moves::reached::Reached;
use crate::moves::turn::{TurnChain, TurnTo};
use crate::moves::{Move, MoveSettings, configuration_of};
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
    /// Number of links between pieces that were timed as they are made around obstacles; 0 if all
    /// links count the time of their slowest axis, with nothing in the way.
    pub timed_links: usize,
    /// Time of all links in the order as laid, and of the slowest axis on the way to the first
    /// piece, s. A pair that no link joins counts as a million seconds.
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
/// Links cost the time that `link_time` gives them, or without it that of their slowest axis: an
/// estimate, which affects no guarantee.
///
/// # Errors
/// Returns an error if the monitor cancels.
pub(crate) fn ordered(
    test: &PoseTest<'_>,
    (settings, link_time): (&MoveSettings, Option<&LinkTime<'_>>),
    from: Option<&Move>,
    chains: Vec<TurnChain>,
    monitor: &dyn Monitor,
) -> Result<(Vec<TurnChain>, PassOrderReport), PathError> {
    let (machine, tool) = (test.cell.machine, test.cell.tool);
    let paths: Vec<CutPath> = chains.iter().filter_map(|chain| path_of(chain)).collect();
    let ends: Vec<[Waypoint; 2]> =
        chains.iter().filter_map(|chain| Some([chain.first()?.0.start(), chain.last()?.0.end()])).collect();
    let views = [(machine, tool.gauge_length())];
    let clock = LinkClock::new(&views);
    let before = from.map(|m| Waypoint { cl: m.cl, configuration: configuration_of(test, &m.axes) });
    let start = from.map_or_else(|| machine.home(), |m| m.axes);
    // Endless axes go on from where they are.
    let least_time = |a: &AxisValues, b: &AxisValues| clock.least_time(a, &endless_near(test, b, a));
    let as_made = |(from, to): TourLink, link_time: &LinkTime<'_>| {
        let to = &ends[to][0];
        // The way from home is not a link.
        let Some(from) = from.map_or(before, |k| Some(ends[k][1])) else { return 0.0 };
        let Ok(way) = Linker::new(test, &settings.link).link(&from, to) else { return NO_LINK };
        let mut through: Vec<AxisValues> = Vec::with_capacity(way.len() + 1);
        for pose in way.iter().chain([to]) {
            let at = through.last().unwrap_or(&from.configuration.axes);
            through.push(endless_near(test, &pose.configuration.axes, at));
        }
        let time = link_time(&from.configuration.axes, &through);
        if time.is_finite() { time } else { NO_LINK }
    };
    let timed = |link: TourLink| {
        monitor.checkpoint()?;
        Ok::<f64, PathError>(link_time.map_or(0.0, |time| as_made(link, time)))
    };
    let times = LinkTimes { least: &least_time, as_made: link_time.is_some().then_some(&timed) };
    let (order, report) = shortest_order(&paths, &start, farthest_touch(tool.cutter()), &times, monitor)?;
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

/// Time of a pair of pieces that no link joins, s: more than all links of an operation take.
const NO_LINK: f64 = 1e6;

/// Times of links.
pub struct LinkTimes<'t> {
    /// Least time of a link between two positions, s.
    pub least: &'t (dyn Fn(&AxisValues, &AxisValues) -> f64 + Sync),
    /// Time of a link as it is made, by the indices of its pieces, s; `None` if the least times
    /// count.
    pub as_made: Option<&'t (dyn Fn(TourLink) -> Result<f64, PathError> + Sync)>,
}

/// Returns the indices of pieces in the order with the shortest links; pieces that can touch each
/// other keep their order. `reach` is the largest distance of the flutes from the tip over all
/// tools, mm.
///
/// # Errors
/// Returns an error if the monitor cancels.
pub fn shortest_order(
    paths: &[CutPath],
    from: &AxisValues,
    reach: f64,
    times: &LinkTimes<'_>,
    monitor: &dyn Monitor,
) -> Result<(Vec<usize>, PassOrderReport), PathError> {
    let least = times.least;
    let links = paths.par_iter().flat_map_iter(|a| paths.iter().map(|b| least(&a.ends[1], &b.ends[0]))).collect();
    let first = paths.iter().map(|path| least(from, &path.ends[0])).collect();
    let pairs = touching(paths, reach);
    monitor.checkpoint()?;
    let kept_pairs = pairs.len();
    let costs = TourCosts::new(links, first, vec![0.0; paths.len()]).and_then(|costs| costs.keeping(pairs));
    let costs = costs.map_err(|e| PathError::Fault(e.to_string()))?;
    let LearntTour { tour, present_cost, links: timed_links } = match times.as_made {
        Some(as_made) => shortest_tour_by(costs, as_made)?,
        None => {
            let present_cost = costs.of(&(0..paths.len()).collect::<Vec<_>>());
            LearntTour { tour: shortest_tour(&costs), present_cost, links: 0 }
        }
    };
    monitor.checkpoint()?;
    let report = PassOrderReport {
        operation: String::new(),
        pieces: paths.len(),
        kept_pairs,
        timed_links,
        as_laid_s: present_cost,
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
