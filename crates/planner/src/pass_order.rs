//! In which order the pieces of an operation's passes are cut.

use std::f64::consts::TAU;

use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine};
use facemill_tool_model::{Cutter, ToolAssembly};
use nalgebra::Point3;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::job_file::ApproachFile;
use crate::pieces::Piece;
use crate::rapids::{LinkClock, TourCosts, TourError, shortest_tour};

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

/// Pieces in the order with the shortest links, from where the tool comes from, in which all that can touch each other keep the
/// order that they have: no place is in reach of the flutes on the cuts and arcs of two pieces that change places, so that every cut
/// takes the stock that it takes in the order as laid.
///
/// Links cost the time of their slowest axis by itself, limited rotary axes at the whole turns that are nearest: a guess of what they
/// take, which changes no claim.
///
/// # Errors
/// When a cost is no number, which no pose of a machine makes.
pub(crate) fn ordered(
    machine: &Machine,
    (tool, arcs): (&ToolAssembly, [&ApproachFile; 2]),
    from: &AxisValues,
    pieces: Vec<Piece>,
) -> Result<(Vec<Piece>, PassOrderReport), TourError> {
    let views = [(machine, tool.gauge_length())];
    let clock = LinkClock::new(&views);
    let ends = |piece: &Piece| {
        let axes = |k: usize| piece.cuts[k].pose.configuration.axes;
        [axes(0), axes(piece.cuts.len() - 1)]
    };
    let ends: Vec<[AxisValues; 2]> = pieces.iter().map(ends).collect();
    let time = |from: &AxisValues, to: &AxisValues| clock.least_time(from, &nearest_turns(machine, from, to));
    let links = ends.par_iter().flat_map_iter(|[_, end]| ends.iter().map(|[start, _]| time(end, start))).collect();
    let first = ends.iter().map(|[start, _]| time(from, start)).collect();
    let pairs = touching(&pieces, farthest_touch(tool.cutter(), arcs));
    let kept_pairs = pairs.len();
    let costs = TourCosts::new(links, first, vec![0.0; pieces.len()])?.keeping(pairs)?;
    let tour = shortest_tour(&costs);
    let report = PassOrderReport {
        operation: String::new(),
        pieces: pieces.len(),
        kept_pairs,
        as_laid_s: costs.of(&(0..pieces.len()).collect::<Vec<_>>()),
        ordered_s: tour.cost,
        lower_bound_s: tour.lower_bound,
        is_exact: tour.is_exact,
    };
    let mut pieces: Vec<Option<Piece>> = pieces.into_iter().map(Some).collect();
    Ok((tour.order.iter().filter_map(|&k| pieces[k].take()).collect(), report))
}

/// A position with its rotary axes whole turns nearer to another one, within their limits.
fn nearest_turns(machine: &Machine, from: &AxisValues, to: &AxisValues) -> AxisValues {
    AxisValues::from_fn(to.len(), |k| {
        let axis = &machine.axes()[k];
        if axis.kind != AxisKind::Rotary {
            return to[k];
        }
        let turns = ((from[k] - to[k]) / TAU).round();
        let nearest = [turns, turns - turns.signum()].map(|turns| to[k] + TAU * turns);
        nearest.into_iter().find(|q| (axis.min..=axis.max).contains(q)).unwrap_or(to[k])
    })
}

/// How far from a CC point the cutter's flutes reach, whatever the posture, mm: to the far end of their far side, and on an arc to or
/// from it by no more than the arc's length farther.
fn farthest_touch(cutter: &Cutter, arcs: [&ApproachFile; 2]) -> f64 {
    let length = |(ApproachFile::TangentialArc(arc) | ApproachFile::RollIn(arc)): &ApproachFile| {
        arc.radius_mm * arc.angle_deg.to_radians()
    };
    (2.0 * cutter.radius()).hypot(cutter.flute_length()) + length(arcs[0]).max(length(arcs[1]))
}

/// Pairs of pieces, as they are laid, with poses from which the flutes may reach one place: with CC points less than twice so far
/// apart, and the way between two neighbours.
fn touching(pieces: &[Piece], reach: f64) -> Vec<(usize, usize)> {
    let beads: Vec<Vec<Bead>> = pieces.iter().map(|p| beads(p, reach)).collect();
    let touch = |a: &[Bead], b: &[Bead]| {
        a.iter().any(|a| b.iter().any(|b| (a.center - b.center).norm() <= a.radius + b.radius + 2.0 * reach))
    };
    let of = |b: usize| (0..b).filter(|&a| touch(&beads[a], &beads[b])).map(|a| (a, b)).collect::<Vec<_>>();
    (0..pieces.len()).into_par_iter().flat_map_iter(of).collect()
}

/// A ball around some neighbouring CC points of a piece and the straight ways between them.
struct Bead {
    center: Point3<f64>,
    radius: f64,
}

/// Balls around a piece, each of at most a quarter of the reach but for points that are farther from each other.
fn beads(piece: &Piece, reach: f64) -> Vec<Bead> {
    let mut all: Vec<Bead> = Vec::new();
    let points: Vec<Point3<f64>> = piece.cuts.iter().map(|c| c.cc.position).collect();
    let mut first = 0;
    while first + 1 < points.len() {
        let near = points[first + 1..].iter().take_while(|p| (**p - points[first]).norm() <= 0.25 * reach).count();
        let last = first + near.max(1);
        let radius = points[first..=last].iter().map(|p| (p - points[first]).norm()).fold(0.0, f64::max);
        all.push(Bead { center: points[first], radius });
        first = last;
    }
    all
}
