//! A move as ways of the tool on which the tip goes straight and the axis turns evenly, within a
//! proven tolerance.

use facemill_cl_data::ClPoint;
use facemill_inverse_kinematics::{AxisValues, Motion};
use nalgebra::{Unit, Vector3};

use crate::motion::moves::Move;
use crate::motion::rates::{Parts, RateBounds};
use crate::motion::spans::Spans;
use crate::run::scene::RunScene;

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

/// Halvings of a part of a move, on which no axis turns by more than a turn. Shorter ones only
/// fight rounding, or stand at a place that the axes cannot follow.
const MAX_HALVINGS: u32 = 16;

/// The segments of a move, in order; `None` where the axes cannot follow it, or no bound on their
/// motion is known. Turns of one axis alone that the last one repeats have none.
///
/// At both ends of a segment the tool is where it is on the segment's way. Between them a point of
/// the tool axis that is accelerated by at most a over the whole segment is at most a/8 beside the
/// chord of its true way, and the same point of the segment's way, h from the tip, is at most
/// h·θ²/8 beside it, with θ the turn of the axis. Where the tip is beside its place by d and the
/// point at the reach by e, the axis is turned by at most (d + e)/reach, so that no point of the
/// tool is farther than 2·d + e from its place: three times the larger bound.
pub(crate) fn segments(scene: &RunScene<'_>, m: &Move, coarse: &Coarseness) -> Option<Vec<Segment>> {
    common_segments(&[MoveOfHead { scene, m, coarse }])?.pop()
}

/// A move as one head makes it.
#[derive(Clone, Copy)]
pub(crate) struct MoveOfHead<'r, 'a> {
    pub(crate) scene: &'r RunScene<'a>,
    pub(crate) m: &'r Move,
    pub(crate) coarse: &'r Coarseness,
}

/// The segments of each head in one and the same move: those of all moving heads begin and end at
/// the same times, so that the k-th of one is driven while the k-th of the other is. None for a
/// head at rest; `None` where its way is not known, or cannot be divided at the times of the
/// others.
pub(crate) fn segments_of_heads(heads: &[MoveOfHead<'_, '_>]) -> Vec<Option<Vec<Segment>>> {
    let going: Vec<usize> = (0..heads.len()).filter(|&h| heads[h].m.moves_tool).collect();
    let mut all = vec![Some(Vec::new()); heads.len()];
    if let Some(segments) = common_segments(&going.iter().map(|&h| heads[h]).collect::<Vec<_>>()) {
        going.into_iter().zip(segments).for_each(|(h, s)| all[h] = Some(s));
        return all;
    }
    going.iter().for_each(|&h| all[h] = None);
    // Where the way of one alone is known it is cut as if the other stood: of that one's there is a
    // finding.
    let mut known = going.into_iter().filter_map(|h| Some((h, common_segments(&[heads[h]])?.pop()?)));
    if let (Some((h, segments)), None) = (known.next(), known.next()) {
        all[h] = Some(segments);
    }
    all
}

/// The segments of all heads, divided at the same times.
fn common_segments(heads: &[MoveOfHead<'_, '_>]) -> Option<Vec<Vec<Segment>>> {
    let mut ways = heads.iter().map(DividedMove::new).collect::<Option<Vec<_>>>()?;
    let mut open: Vec<(f64, f64, u32)> = common_parts(heads).into_iter().rev().map(|[a, b]| (a, b, 0)).collect();
    let mut done = 0.0;
    while let Some((from, to, halvings)) = open.pop() {
        if from > done {
            // The next part repeats the motion between.
            ways.iter_mut().try_for_each(|way| way.skip(from))?;
        }
        for way in &mut ways {
            way.ahead = way.pose(to)?;
        }
        if ways.iter().all(|way| way.is_close(from, to)) {
            ways.iter_mut().for_each(|way| way.go(from, to));
            done = to;
        } else if halvings < MAX_HALVINGS {
            let middle = 0.5 * (from + to);
            open.push((middle, to, halvings + 1));
            open.push((from, middle, halvings + 1));
        } else {
            return None;
        }
    }
    Some(ways.into_iter().map(|way| way.segments).collect())
}

/// The parts of the move that have to be looked at for any of the heads, divided where any of them
/// has to be.
fn common_parts(heads: &[MoveOfHead<'_, '_>]) -> Vec<[f64; 2]> {
    let of_head = |h: &MoveOfHead<'_, '_>| {
        Spans::new(h.scene.setup.machine, h.m.law, [&h.m.start, &h.m.end], h.scene.tool_length).parts
    };
    let all: Vec<Vec<[f64; 2]>> = heads.iter().map(of_head).collect();
    let mut breaks: Vec<f64> = all.iter().flatten().flatten().copied().collect();
    breaks.sort_by(f64::total_cmp);
    breaks.dedup();
    let is_in = |pair: &[f64]| all.iter().flatten().any(|part| part[0] <= pair[0] && pair[1] <= part[1]);
    breaks.windows(2).filter(|pair| is_in(pair)).map(|pair| [pair[0], pair[1]]).collect()
}

/// A move that is being divided.
struct DividedMove<'r, 'a> {
    head: MoveOfHead<'r, 'a>,
    motion: Motion<'a>,
    rates: RateBounds<'a>,
    /// Where the tool is at the end of the last segment.
    at: ClPoint,
    /// Where axes and tool are at the end of the part that is looked at.
    ahead: (AxisValues, ClPoint),
    segments: Vec<Segment>,
}

impl<'r, 'a> DividedMove<'r, 'a> {
    fn new(head: &MoveOfHead<'r, 'a>) -> Option<Self> {
        let MoveOfHead { scene, m, .. } = *head;
        let machine = scene.setup.machine;
        let motion = Motion::new(machine, m.law, &m.start, &m.end, scene.tool_length).ok()?;
        let rates = RateBounds::new(machine, motion, m.law, [&m.start, &m.end], scene.tool_length);
        let ahead = pose(scene, &motion, 0.0)?;
        Some(Self { head: *head, motion, rates, at: ahead.1, ahead, segments: Vec::new() })
    }

    fn pose(&self, t: f64) -> Option<(AxisValues, ClPoint)> {
        pose(self.head.scene, &self.motion, t)
    }

    /// Whether the part of the move from the end of the last segment to what is ahead is a segment.
    fn is_close(&self, from: f64, to: f64) -> bool {
        let (a, b, coarse) = (&self.at, &self.ahead.1, self.head.coarse);
        let turn = a.axis.cross(&b.axis).norm().atan2(a.axis.dot(&b.axis));
        let way = (b.tip - a.tip).norm() + coarse.reach * turn;
        if way > coarse.max_way {
            return false;
        }
        let Some(rates) = self.rates.over(from, to, Parts::OneHead) else { return false };
        let beside = (rates.acceleration(coarse.reach) + coarse.reach * turn * turn) / 8.0;
        3.0 * beside <= coarse.tolerance
    }

    /// Goes on from this time, without a segment to there.
    fn skip(&mut self, to: f64) -> Option<()> {
        self.at = self.pose(to)?.1;
        Some(())
    }

    fn go(&mut self, start: f64, end: f64) {
        let (axes, to) = self.ahead;
        self.segments.push(Segment { from: self.at, to, axes, start, end });
        self.at = to;
    }
}

/// Axes and tool at a fraction of a move's time; `None` where the axes cannot follow.
fn pose(scene: &RunScene<'_>, motion: &Motion<'_>, t: f64) -> Option<(AxisValues, ClPoint)> {
    let axes = motion.at(t).ok()?;
    let work_from_tool = scene.work_from_table * scene.setup.machine.forward(&axes, scene.tool_length);
    let axis = Unit::new_unchecked(work_from_tool.rotation * Vector3::z());
    Some((axes, ClPoint { tip: work_from_tool.translation.vector.into(), axis }))
}
