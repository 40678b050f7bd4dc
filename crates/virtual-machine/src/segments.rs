//! A move as ways of the tool on which the tip goes straight and the axis turns evenly, within a proven tolerance.

use facemill_cl_data::{ClPoint, RapidLaw};
use facemill_inverse_kinematics::{AxisValues, BlockLaw, Motion};
use nalgebra::{Unit, Vector3};

use crate::{
    moves::Move,
    rates::{Parts, RateBounds},
    scene::Scene,
    stepping::stops,
};

/// A part of a move.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    /// The tool at its start, workpiece frame.
    pub(crate) from: ClPoint,
    /// The tool at its end.
    pub(crate) to: ClPoint,
    /// Axis values at its end.
    pub(crate) axes: AxisValues,
    /// Fractions of the move's time at its start and end.
    pub(crate) start: f64,
    pub(crate) end: f64,
}

/// How coarse segments may be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coarseness {
    /// By how much a point of the tool may be beside its true place at any time, mm.
    pub(crate) tolerance: f64,
    /// Distance of the tool's farthest point from the tip, mm.
    pub(crate) reach: f64,
    /// Largest way of the tip and of the point at the reach on the axis, mm.
    pub(crate) max_way: f64,
}

/// Halvings of a move. Shorter parts only fight rounding, or stand at a place that the axes cannot follow.
const MAX_HALVINGS: u32 = 16;

/// The segments of a move, in order; `None` where the axes cannot follow it, or no bound on their motion is known.
///
/// At both ends of a segment the tool is where it is on the segment's way. Between them a point of the tool axis that is
/// accelerated by at most a over the whole segment is at most a/8 beside the chord of its true way, and the same point of
/// the segment's way, h from the tip, is at most h·θ²/8 beside it, with θ the turn of the axis. Where the tip is beside its
/// place by d and the point at the reach by e, the axis is turned by at most (d + e)/reach, so that no point of the tool is
/// farther than 2·d + e from its place: three times the larger bound.
pub(crate) fn segments(scene: &Scene<'_>, m: &Move, coarse: &Coarseness) -> Option<Vec<Segment>> {
    let machine = scene.setup.machine;
    let motion = Motion::new(machine, m.law, &m.start, &m.end, scene.tool_length).ok()?;
    let rates = RateBounds::new(machine, motion, m.law, [&m.start, &m.end], scene.tool_length);
    let mut breaks = vec![0.0, 1.0];
    if m.law == BlockLaw::Rapid(RapidLaw::PerAxis) {
        breaks.extend(stops(machine, [&m.start, &m.end]));
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
    }
    let pose = |t: f64| -> Option<(AxisValues, ClPoint)> {
        let axes = motion.at(t).ok()?;
        let work_from_tool = scene.work_from_table * machine.forward(&axes, scene.tool_length);
        let axis = Unit::new_unchecked(work_from_tool.rotation * Vector3::z());
        Some((axes, ClPoint { tip: work_from_tool.translation.vector.into(), axis }))
    };
    let mut out = Vec::new();
    let mut at = pose(0.0)?.1;
    let mut open: Vec<(f64, f64, u32)> = breaks.windows(2).rev().map(|b| (b[0], b[1], 0)).collect();
    while let Some((from, to, halvings)) = open.pop() {
        let (axes, end) = pose(to)?;
        if is_close(&rates, (from, to), (&at, &end), coarse) {
            out.push(Segment { from: at, to: end, axes, start: from, end: to });
            at = end;
        } else if halvings < MAX_HALVINGS {
            let middle = 0.5 * (from + to);
            open.push((middle, to, halvings + 1));
            open.push((from, middle, halvings + 1));
        } else {
            return None;
        }
    }
    Some(out)
}

/// Whether a part of a move is a segment.
fn is_close(rates: &RateBounds<'_>, (from, to): (f64, f64), (a, b): (&ClPoint, &ClPoint), coarse: &Coarseness) -> bool {
    let turn = a.axis.cross(&b.axis).norm().atan2(a.axis.dot(&b.axis));
    let way = (b.tip - a.tip).norm() + coarse.reach * turn;
    if way > coarse.max_way {
        return false;
    }
    let Some(rates) = rates.over(from, to, Parts::OneHead) else { return false };
    let beside = (rates.acceleration(coarse.reach) + coarse.reach * turn * turn) / 8.0;
    3.0 * beside <= coarse.tolerance
}
